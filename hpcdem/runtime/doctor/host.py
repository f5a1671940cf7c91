"""The host around the ranks: cores, memory, limits of the shell, clocks, text; and what Slurm gives of them."""

from __future__ import annotations

import codecs
import math
import re
import resource
import sys
from collections import Counter
from collections.abc import Iterable
from datetime import datetime
from itertools import groupby

from hpcdem.runtime import cgroups
from hpcdem.runtime.doctor.machine import CLOCK_SKEW, MIB, Findings, Machine, ok, problem, size, warning
from hpcdem.runtime.stop_requests import slurm_end_time

NEEDED, COMFORTABLE = 256 * MIB, 512 * MIB
"""Bytes that a rank takes before the first particle, without and with the compiler at work."""
LIMITS = (
    ("NOFILE", 256, "ulimit -n is {}: launchers and MPI open a file for each rank of a host, and more", "-n 256"),
    ("STACK", MIB, "ulimit -s is {}: the compiler of the kernels needs a deeper stack", "-s 1024"),
    ("AS", 4096 * MIB, "ulimit -v is {}: numba and MPI reserve much more address space than memory", "-v 4194304"),
    ("NPROC", 64, "ulimit -u is {}: each rank has helper threads", "-u 64"),
    ("FSIZE", math.inf, "files may have no more than {} (ulimit -f)", "-f unlimited"),
    (
        "CPU",
        math.inf,
        "a process is killed after {} s of processor time (ulimit -t), as on login nodes",
        "-t unlimited",
    ),
    ("MEMLOCK", 64 * MIB, "only {} of memory can be locked (ulimit -l): InfiniBand will fail", "-l unlimited"),
)
"""Names of limits, the least that will do, what happens below it, how to raise it."""


def oversubscribed(machine: Machine) -> Findings:
    """Threads and ranks of this host that share cores."""
    wanted: Counter[frozenset[int]] = Counter()
    for p in machine.here:
        wanted[p.mask] += p.threads
    n, few, free = machine.here[0].threads, min(map(len, wanted)), len(frozenset.union(*wanted))
    mask = max(wanted, key=lambda mask: wanted[mask] - len(mask))
    if n > few:
        cure = f"srun -c {n}; mpiexec --map-by slot:PE={n} or --bind-to none; or -j 1"
        yield warning("cores", f"{n} threads per rank, but ranks may use only {_cores(few)}", cure)
    elif wanted.total() > free:
        text = f"{len(machine.here)} ranks x {n} threads share {_cores(free)}: expect less speed"
        yield warning("cores", text, f"mpiexec -n {max(1, free // n)} hpcdem ...")
    elif wanted[mask] > len(mask):
        text = f"{wanted[mask] // n} ranks are bound to the same {len(mask)} of the {free} cores ({core_list(mask)})"
        yield warning("cores", f"{text} while others are idle", "mpiexec --bind-to none hpcdem ...")


def narrowed(machine: Machine) -> Findings:
    """Masks that are smaller since MPI has begun."""
    found = [(p.cores_before, len(p.mask)) for p in machine.places if len(p.mask) < p.cores_before]
    if found:
        text = f"starting MPI narrowed the cores of {len(found)} ranks from {found[0][0]} to {found[0][1]} each"
        yield warning("cores", text, "mpiexec --bind-to none hpcdem ...")


def cpu_quota(machine: Machine) -> Findings:
    """Processor time that a control group allows, which masks do not show: with less, all ranks are halted at times."""
    allowed, threads = cgroups.cpu_quota(machine.root), sum(p.threads for p in machine.here)
    if allowed is None:
        return
    text = f"the control group (container, job) allows {allowed:.3g} cores"
    if allowed < min(threads, len(frozenset.union(*(p.mask for p in machine.here)))):
        cure = f"mpiexec -n {max(1, int(allowed))} hpcdem ..."
        yield warning("cores", f"{text}, fewer than the {threads} threads on this host", cure)
    else:
        yield ok("cores", text)


def mapping(machine: Machine) -> Findings:
    """List the cores that each rank may use."""
    masks = [p.mask for p in machine.places]
    ranks = [f"rank {rank} cores {core_list(mask)}" for rank, mask in enumerate(masks[:8])] + ["..."] * (len(masks) > 8)
    yield ok("cores", "; ".join(ranks) if len(set(masks)) > 1 else f"each rank may use cores {core_list(masks[0])}")


def core_list(mask: Iterable[int]) -> str:
    """Numbers of cores as `0-3,8`."""
    runs = [list(run) for _, run in groupby(enumerate(sorted(mask)), lambda pair: pair[1] - pair[0])]
    return ",".join(f"{run[0][1]}-{run[-1][1]}" if len(run) > 1 else f"{run[0][1]}" for run in runs)


def _cores(n: int) -> str:
    return f"{n} core{'s' * (n > 1)}"


def srun_cores(machine: Machine) -> Findings:
    """The two ways to ask sbatch for -c 12 and then run on one core."""
    asked, n, used = machine.slurm("CPUS_PER_TASK"), len(machine.here[0].mask), sum(p.threads for p in machine.here)
    if asked < 2 or not machine.in_step:
        return
    if n < asked and "SRUN_CPUS_PER_TASK" not in machine.environ:
        text = f"the job requested {asked} cores per task, srun has {n}: srun does not inherit -c from sbatch"
        yield warning("Slurm", text, "Start with: srun -c $SLURM_CPUS_PER_TASK")
    elif used < n:
        cure = f"Request ranks instead (#SBATCH -n {asked} -c 1 and srun -n {asked}), or threads (-j {asked})"
        yield warning("Slurm", f"{used} of the {n} cores of this job are used", cure)


def sbatch_cores(machine: Machine) -> Findings:
    """Warn, in a batch script, about options that srun does not take over from sbatch."""
    asked = machine.slurm("CPUS_PER_TASK")
    if asked >= 2 and not machine.in_step and "SRUN_CPUS_PER_TASK" not in machine.environ:
        text = f"the job requested {asked} cores per task; srun (since Slurm 22.05) does not inherit -c from sbatch"
        yield warning("Slurm", text, "export SRUN_CPUS_PER_TASK=$SLURM_CPUS_PER_TASK")


def slurm_end(machine: Machine) -> Findings:
    """Check that the run can save itself before the job ends."""
    if not machine.in_job:
        return
    job, end = machine.environ["SLURM_JOB_ID"], slurm_end_time(machine.environ)
    _, script, _ = machine.run(["scontrol", "write", "batch_script", job, "-"])
    signal = re.search(r"^#SBATCH\s+--signal[=\s]\s*(\S+)", script, re.MULTILINE)
    text = (
        f"job {job} ends {datetime.fromtimestamp(end):at %Y-%m-%d %H:%M}" if end else f"the end of job {job} is unknown"
    )
    if end or signal:
        yield ok("Slurm", f"{text}; its script requests the signal {signal[1]}" if signal else text)
    else:
        cure = "#SBATCH --signal=USR1@300, or hpcdem --time-limit HH:MM:SS"
        yield warning("Slurm", f"{text}, and its script requests no --signal: the last steps would be lost", cure)


def memory(machine: Machine) -> Findings:
    """Compare the memory limits of each rank: control group, Slurm (in MiB, 0 for all of the node), and free memory."""
    slurm = machine.slurm("MEM_PER_NODE") or machine.slurm("MEM_PER_CPU") * machine.slurm("CPUS_ON_NODE")
    free = re.search(r"^MemAvailable:\s+(\d+)", cgroups.read(machine.root / "proc/meminfo"), re.MULTILINE)
    found = {
        "limit of the control group": cgroups.memory(machine.root),
        "limit of the Slurm job on this host": slurm * MIB or None,
        "free": int(free[1]) * 1024 if free else None,
    }
    limits = [(limit, where) for where, limit in found.items() if limit is not None]
    least, where = min(limits, default=(math.inf, ""))
    each = least / len(machine.here)
    if each < COMFORTABLE:
        finding = problem if each < NEEDED else warning
        text = f"{size(each)} of memory for each of {len(machine.here)} ranks ({where} {size(least)}): a rank needs "
        cure = f"mpiexec -n {max(1, int(least // COMFORTABLE))} hpcdem ..."
        if machine.in_job:
            cure = "#SBATCH --mem-per-cpu=2G (a number without a unit means MiB)"
        yield finding("memory", f"{text}{size(NEEDED)} and more before the first particle", cure)
    elif limits:
        yield ok("memory", "; ".join(f"{where} {size(limit)}" for limit, where in limits))


def shell_limits(machine: Machine) -> Findings:
    """`ulimit`: what ends a run or keeps it from starting, and what the limits are."""
    infiniband = len(machine.hosts) > 1 and any((machine.root / "sys/class/infiniband").glob("*"))
    for name, least, text, cure in LIMITS:
        allowed, shown = _limit(name)
        if allowed < least and (infiniband or name != "MEMLOCK"):
            yield warning("ulimit", text.format(shown), f"ulimit {cure}")
    words = {"NOFILE": "open files", "CORE": "core files", "STACK": "stack", "MEMLOCK": "locked memory"}
    cure = "ulimit -c 0 (a core file is as large as the memory of the rank)" if _limit("CORE")[0] else ""
    yield ok("ulimit", ", ".join(f"{word} {_limit(name)[1]}" for name, word in words.items()), cure)


def _limit(name: str) -> tuple[float, str]:
    """The soft limit, and as it is shown."""
    soft, _ = resource.getrlimit(getattr(resource, f"RLIMIT_{name}"))
    if soft == resource.RLIM_INFINITY:
        return math.inf, "unlimited"
    return soft, str(soft) if name in ("NOFILE", "NPROC", "CPU") else size(soft)


def clocks(machine: Machine) -> Findings:
    """The time of day of the hosts: time limits and the end of a Slurm job rest on it."""
    apart = max(machine.clocks) - min(machine.clocks)
    if apart > CLOCK_SKEW:
        text = f"the clocks of the hosts differ by {apart:.0f} s: hosts disagree on the end of a Slurm job"
        yield warning("clock", text, "timedatectl set-ntp true")


def text(machine: Machine) -> Findings:
    """Check that the log and file names can contain characters that are not ASCII."""
    codes = {"output": getattr(sys.stdout, "encoding", None) or "utf-8", "file names": sys.getfilesystemencoding()}
    wrong = [f"{what}: {code}" for what, code in codes.items() if codecs.lookup(code).name != "utf-8"]
    if wrong:
        found = f"text is not UTF-8 ({', '.join(wrong)}): names with Chinese characters fail"
        yield warning("text", found, "export LC_ALL=C.UTF-8")
