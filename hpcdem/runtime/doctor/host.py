"""The host around a process: memory, limits of the shell, clocks, text."""

from __future__ import annotations

import codecs
import resource
from collections.abc import Iterator

from hpcdem.runtime.doctor import cgroups
from hpcdem.runtime.doctor.findings import Finding, ok, problem, size, warning
from hpcdem.runtime.doctor.scene import Scene
from hpcdem.runtime.doctor.storage import SKEW

NEEDED, COMFORTABLE = 256 << 20, 512 << 20
"""Bytes that a rank takes before the first particle, with and without the compiler at work."""
MIB = 1 << 20


def memory(scene: Scene) -> Iterator[Finding]:
    """What each rank may take, by the control group, by Slurm, and by what is free."""
    ranks = len(scene.here)
    limits = [(limit, where) for limit, where in _memory_limits(scene) if limit is not None]
    if not limits:
        return
    limit, where = min(limits)
    each = limit / ranks
    if each < COMFORTABLE:
        text = f"{size(each)} of memory for each of {ranks} rank{'s' * (ranks > 1)} ({where} {size(limit)})"
        say = problem if each < NEEDED else warning
        yield say(
            "memory",
            f"{text}: a rank takes {size(NEEDED)} and more before the first particle",
            "#SBATCH --mem-per-cpu=2G (a number without a unit means MiB)" if "SLURM_JOB_ID" in scene.environ else
            f"mpiexec -n {max(1, int(limit // COMFORTABLE))} hpcdem ...",
        )  # fmt: skip


def memory_said(scene: Scene) -> Iterator[Finding]:
    """The same when all is well."""
    if next(memory(scene), None) is None:
        found = [f"{where} {size(limit)}" for limit, where in _memory_limits(scene) if limit is not None]
        if found:
            yield ok("memory", "; ".join(found))


def _memory_limits(scene: Scene) -> Iterator[tuple[int | None, str]]:
    yield cgroups.memory(scene), "limit of the control group"
    yield _of_slurm(scene), "limit of the Slurm job on this host"
    for line in scene.read("proc/meminfo").splitlines():
        name, _, rest = line.partition(":")
        if name == "MemAvailable" and rest.split()[:1] and rest.split()[0].isdigit():
            yield int(rest.split()[0]) * 1024, "free"


def _of_slurm(scene: Scene) -> int | None:
    """Slurm says MiB in its variables; 0 means all that the node has."""
    per_node, per_cpu, cpus = (
        scene.environ.get(f"SLURM_{name}", "") for name in ("MEM_PER_NODE", "MEM_PER_CPU", "CPUS_ON_NODE")
    )
    if per_node.isdigit() and int(per_node):
        return int(per_node) * MIB
    if per_cpu.isdigit() and cpus.isdigit() and int(per_cpu):
        return int(per_cpu) * int(cpus) * MIB
    return None


# -- limits of the shell -------------------------------------------------------------------------------------------


def shell_limits(scene: Scene) -> Iterator[Finding]:
    """`ulimit`: what ends a run or keeps it from starting."""
    for name, letter, least, why in (
        ("NOFILE", "n", 256, "launchers and MPI open a file for each rank of a host, and more"),
        ("STACK", "s", 1 << 20, "the compiler of the kernels needs a deeper stack"),
        ("AS", "v", 4 << 30, "numba and MPI reserve far more addresses than memory"),
        ("NPROC", "u", 64, "each rank has helper threads"),
    ):
        allowed = _soft(scene, name)
        if allowed is not None and allowed < least:
            shown, unit = (size(allowed), 1024) if name in ("STACK", "AS") else (str(allowed), 1)
            yield warning("ulimit", f"ulimit -{letter} is {shown}: {why}", f"ulimit -{letter} {least // unit}")
    allowed = _soft(scene, "FSIZE")
    if allowed is not None:
        yield warning("ulimit", f"files may have no more than {size(allowed)} (ulimit -f)", "ulimit -f unlimited")
    allowed = _soft(scene, "CPU")
    if allowed is not None:
        yield warning(
            "ulimit",
            f"a process is killed after {allowed} s of processor time (ulimit -t), as on login nodes",
            "ulimit -t unlimited, or run in a job",
        )
    allowed = _soft(scene, "MEMLOCK")
    infiniband = any((scene.root / "sys/class/infiniband").glob("*"))
    if allowed is not None and allowed < 64 * MIB and len(scene.hosts) > 1 and infiniband:
        yield warning(
            "ulimit",
            f"only {size(allowed)} of memory can be locked (ulimit -l): InfiniBand will not be used or fail",
            "ulimit -l unlimited",
        )


def shell_limits_said(scene: Scene) -> Iterator[Finding]:
    """The limits, whatever they are."""
    found = []
    words = {"NOFILE": "open files", "CORE": "core files", "STACK": "stack", "MEMLOCK": "locked memory"}
    for name, word in words.items():
        allowed = _soft(scene, name)
        shown = "unlimited" if allowed is None else str(allowed) if name == "NOFILE" else size(allowed)
        found.append(f"{word} {shown}")
    yield ok("ulimit", ", ".join(found))
    if _soft(scene, "CORE") != 0:
        yield ok("ulimit", "a crash leaves a core file as large as the memory of the rank", "ulimit -c 0")


def _soft(scene: Scene, name: str) -> int | None:
    """The soft limit; None where there is none."""
    soft, _ = scene.limits(getattr(resource, f"RLIMIT_{name}"))
    return None if soft == resource.RLIM_INFINITY else soft


# -- clocks and text -----------------------------------------------------------------------------------------------

LONG_AGO = 1_700_000_000.0
"""A time of day [s since 1970] before this program was written."""


def clocks(scene: Scene) -> Iterator[Finding]:
    """The time of day: time limits and names of newest files rest on it."""
    if scene.now() < LONG_AGO:
        yield warning("clock", "the clock of this host is set to a time long ago", "timedatectl set-ntp true")
    if scene.clocks and max(scene.clocks) - min(scene.clocks) > SKEW:
        yield warning(
            "clock",
            f"the clocks of the hosts differ by {max(scene.clocks) - min(scene.clocks):.0f} s: the end of a Slurm job "
            "is seen at another time by each",
            "timedatectl set-ntp true",
        )


def text(scene: Scene) -> Iterator[Finding]:
    """Whether names of files and the log can hold letters that are not ASCII."""
    wrong = [f"{what}: {code}" for what, code in scene.encodings().items() if not _is_utf8(code)]
    if wrong:
        said = f"text is not UTF-8 ({', '.join(wrong)}): names with Chinese letters fail"
        yield warning("text", said, "export LC_ALL=C.UTF-8")


def _is_utf8(code: str) -> bool:
    try:
        return codecs.lookup(code).name == "utf-8"
    except LookupError:
        return False
