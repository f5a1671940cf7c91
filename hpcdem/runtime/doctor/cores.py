"""Who computes where: masks of cores, threads, what a control group leaves of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from hpcdem.runtime.doctor import cgroups
from hpcdem.runtime.doctor.findings import Finding, ok, warning
from hpcdem.runtime.doctor.scene import Scene
from hpcdem.runtime.launch import Place

TOPIC = "cores"
MOST = 8
"""Ranks whose cores are named one by one."""


def crowded(scene: Scene) -> Iterator[Finding]:
    """Threads and ranks that share cores."""
    places = scene.places
    tight = [p for p in places if p.threads > len(p.mask)]
    if tight:
        p = tight[0]
        yield warning(
            TOPIC,
            f"{p.threads} threads per rank, but {len(tight)} of {len(places)} ranks may use only {len(p.mask)} "
            f"core{'s' * (len(p.mask) > 1)}: the threads will take turns",
            f"Give each rank its cores (srun -c {p.threads}; mpiexec --map-by slot:PE={p.threads} or --bind-to none) "
            "or use -j 1",
        )
        return
    for host in scene.hosts:
        here = [p for p in places if p.host == host]
        free, wanted = len(frozenset.union(*(p.mask for p in here))), sum(p.threads for p in here)
        if wanted > free:
            yield warning(
                TOPIC,
                f"{len(here)} ranks x {here[0].threads} threads share {free} core{'s' * (free > 1)} on {host}: "
                "expect less speed than with as many as there are cores",
                f"mpiexec -n {max(1, free // here[0].threads)} hpcdem ...",
            )
            return
        for mask, ranks in _by_mask(here).items():
            if sum(p.threads for p in ranks) > len(mask):
                yield warning(
                    TOPIC,
                    f"{len(ranks)} ranks are bound to the same {len(mask)} of the {free} cores open on {host} "
                    f"({core_list(mask)}) while others are idle",
                    "mpiexec --bind-to none hpcdem ...",
                )
                return


def narrowed(scene: Scene) -> Iterator[Finding]:
    """Masks that are smaller since MPI has begun."""
    shrunk = [p for p in scene.places if len(p.mask) < p.cores_before]
    if shrunk:
        p = shrunk[0]
        yield warning(
            TOPIC,
            f"starting MPI narrowed the cores of {len(shrunk)} ranks from {p.cores_before} to {len(p.mask)} each",
            "mpiexec --bind-to none hpcdem ...",
        )


def of_a_job_step(scene: Scene) -> Iterator[Finding]:
    """The two ways to ask sbatch for -c 12 and then run on one core."""
    asked = scene.environ.get("SLURM_CPUS_PER_TASK", "")
    if "SLURM_STEP_ID" not in scene.environ or not asked.isdigit() or int(asked) < 2:
        return
    cores_here = len(scene.places[0].mask)
    if cores_here < int(asked) and "SRUN_CPUS_PER_TASK" not in scene.environ:
        yield warning(
            "Slurm",
            f"the job asked for {asked} cores per task, this srun got {cores_here}: some versions of srun do not take "
            "--cpus-per-task from sbatch",
            "Start with: srun -c $SLURM_CPUS_PER_TASK",
        )
        return
    used = sum(p.threads for p in scene.places if p.host == scene.places[0].host)
    if used < cores_here:
        yield warning(
            "Slurm",
            f"{used} of the {cores_here} cores of this job are used",
            f"Ask for ranks instead (#SBATCH -n {asked} -c 1 and srun -n {asked}), or for threads (-j {asked})",
        )


def quota(scene: Scene) -> Iterator[Finding]:
    """Processor time that a control group allows, in cores: less than the mask shows, and all ranks are halted in
    every tenth of a second."""
    allowed = cgroups.cpu_quota(scene)
    if allowed is None:
        return
    open_here = len(frozenset.union(*(p.mask for p in scene.here)))
    wanted = sum(p.threads for p in scene.here)
    if allowed < min(wanted, open_here):
        yield warning(
            TOPIC,
            f"the control group (container, job) allows the time of {allowed:.3g} cores, fewer than the {wanted} "
            f"threads on this host; the {open_here} cores of the mask do not show it",
            f"mpiexec -n {max(1, int(allowed))} hpcdem ...",
        )


def mapping(scene: Scene) -> Iterator[Finding]:
    """Where each rank may run: said, not judged."""
    masks = {p.mask for p in scene.places}
    if len(scene.places) == 1 or len(masks) == 1:
        who = "this process" if len(scene.places) == 1 else f"each of the {len(scene.places)} ranks"
        yield ok(TOPIC, f"{who} may use {core_list(scene.places[0].mask)}{_many(scene.places[0])}")
    else:
        ranks = [f"rank {r} {core_list(p.mask)}" for r, p in enumerate(scene.places[:MOST])]
        yield ok(TOPIC, "; ".join(ranks) + ("; ..." if len(scene.places) > MOST else ""))
    allowed = cgroups.cpu_quota(scene)
    if allowed is not None:
        yield ok(TOPIC, f"the control group allows the time of {allowed:.3g} cores on {scene.places[scene.rank].host}")


def core_list(mask: Iterable[int]) -> str:
    """`core 3`, `cores 0-3,8`."""
    numbers = sorted(mask)
    runs: list[list[int]] = []
    for n in numbers:
        if runs and n == runs[-1][1] + 1:
            runs[-1][1] = n
        else:
            runs.append([n, n])
    text = ",".join(f"{a}" if a == b else f"{a}-{b}" for a, b in runs)
    return f"core{'s' * (len(numbers) != 1)} {text}"


def _many(place: Place) -> str:
    return f" ({len(place.mask)} in all)" if len(place.mask) > 2 else ""


def _by_mask(places: list[Place]) -> dict[frozenset[int], list[Place]]:
    found: dict[frozenset[int], list[Place]] = defaultdict(list)
    for p in places:
        found[p.mask].append(p)
    return found
