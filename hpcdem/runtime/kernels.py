"""Compile kernels, once per machine type.

A kernel is compiled once per machine type and kept in the store (`kept.py`) as soon as it is done; every process takes
from there what it calls, when it first calls it. What a kind of model may call is compiled before the model is made, by
several processes, and noted when it is complete; then nothing is loaded beforehand. One process of a host compiles at a
time. Others wait for it, and continue its work if it ends early, whatever ended it.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import filelock

from hpcdem.runtime import cgroups, kept, launch
from hpcdem.runtime.compilers import compile_in_processes
from hpcdem.runtime.kept import late
from hpcdem.runtime.launch import patient_barrier

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm
    from hpcdem.runtime.progress import Log

__all__ = ["late", "prepare_kernels", "turn_of", "warmup"]

QUIET_SECONDS = 5.0
"""Between two lines on how far compiling has come."""
PROCESSES = 8
"""Largest number of processes that compile at the same time: the kernel that takes longest takes a fifth of the time
of all."""
MEMORY = 700e6
"""Of one of them, at most [bytes]."""


def prepare_kernels(comm: Comm, log: Log, warm_ups: Mapping[str, Callable[[], None]]) -> Path:
    """Collective: have the kernels of all kinds compiled that no process has compiled before; returns the folder of the
    store. warm_ups: by kind, what calls all of its kernels once, a function that can be pickled. Rank 0 logs progress.

    When something is missing, one rank of each machine type goes first, then one of each host, then the rest, so that
    nothing is compiled twice on a shared file system and each local disk gets its copy. A rank compiles with processes
    on the cores of all ranks of its host, which wait.
    """
    kept.install()
    place, writable = kept.store()
    missing = {kind: warm for kind, warm in warm_ups.items() if not ready(kind)}
    ranks = comm.allgather((socket.gethostname(), place.name, bool(missing), launch.mask()))
    if not any(rank[2] for rank in ranks):
        return place
    host = ranks[comm.rank][0]
    turn = turn_of([rank[:2] for rank in ranks], comm.rank)
    cores = frozenset().union(*(rank[3] for rank in ranks if rank[0] == host))
    problem = ""
    kept.unkept.clear()
    for now in range(3):
        if now == turn:
            problem = _compile(place, missing, cores, log if comm.rank == 0 else None)
        patient_barrier(comm)
    if comm.any(not writable):
        log.warn(
            f"the kernel cache under {kept.cache_base()} cannot be written; using {place}. NUMBA_CACHE_DIR moves it"
        )
    if problem := next(filter(None, comm.allgather(problem)), ""):
        log.warn(f"processes that compiled kernels failed; continuing with one ({problem})")
    if reason := next((reasons[0] for reasons in comm.allgather(kept.unkept[:1]) if reasons), ""):
        log.warn(
            f"compiled kernels cannot be stored in {place} ({reason}), so later runs compile them again. Free space, "
            "or set NUMBA_CACHE_DIR"
        )
    if comm.rank == 0:
        kept.tidy(place.parent)
    return place


def ready(kind: str) -> bool:
    """Return whether all kernels of a kind are in the store: with threads there are more of them than with one
    thread."""
    names = [_name(kind, threaded) for threaded in {True, _threaded()}]
    return any((kept.store()[0] / name).is_file() for name in names)


def _threaded() -> bool:
    return os.environ.get("NUMBA_NUM_THREADS", "1") != "1"


def _name(kind: str, threaded: bool) -> str:
    return f"ready-{kind or 'particles'}{'-threads' if threaded else ''}-{kept.sources()}"


def turn_of(ranks: Sequence[tuple[str, str]], rank: int) -> int:
    """Return the turn in which a rank compiles, 0 to 2: first one of each machine type, then one of each host, then the
    rest. ranks: host and machine type of each."""
    host, key = ranks[rank]
    if next(r for r, one in enumerate(ranks) if one[1] == key) == rank:
        return 0
    return 1 if next(r for r, one in enumerate(ranks) if one[0] == host) == rank else 2


def _compile(place: Path, warm_ups: Mapping[str, Callable[[], None]], cores: frozenset[int], log: Log | None) -> str:
    """Compile what is missing, unless somebody else did so meanwhile; what went wrong, if anything."""
    with _alone(place, log):
        missing = {kind: warm for kind, warm in warm_ups.items() if not ready(kind)}
        if not missing:
            return ""
        progress = _Progress(log)
        problem = _compile_beside(list(missing.values()), cores, progress)
        with progress.announced(), kept.warming():
            for kind, warm in missing.items():
                warm()  # what the processes could not know of, and all of it if there were none
                if not kept.unkept:
                    with contextlib.suppress(OSError):
                        kept.write(place / _name(kind, _threaded()), b"")
    return problem


@contextlib.contextmanager
def _alone(place: Path, log: Log | None) -> Iterator[None]:
    """No other process of this host compiles into this store meanwhile. The lock ends with the process that has it."""
    holder = place / f"building-{socket.gethostname()}"
    lock = filelock.FileLock(holder.with_suffix(".lock"))
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=0)
        except filelock.Timeout:
            if log is not None:
                log.info(f"waiting for {_text(holder) or 'another process'}, which is compiling kernels")
            lock.acquire(poll_interval=0.2)
        with contextlib.suppress(OSError):
            holder.write_text(f"process {os.getpid()} of {socket.gethostname()}")
    except (OSError, NotImplementedError):  # a file system without locks: twice the work does no harm
        yield
        return
    try:
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def builder() -> str:
    """Return which process of this host compiles kernels at the moment, in words; "" none."""
    words = _text(kept.store()[0] / f"building-{socket.gethostname()}")
    try:
        os.kill(int(words.split()[1]), 0)
    except (IndexError, ValueError, OSError):  # nobody, or one that was killed
        return ""
    return words


def _text(path: Path) -> str:
    with contextlib.suppress(OSError):
        return path.read_text()
    return ""


class _Progress:
    """Reports from time to time how many kernels are compiled, and the remaining time."""

    def __init__(self, log: Log | None):
        self.log, self.began, self.done = log, time.monotonic(), 0
        self.last = -math.inf

    def update(self, done: int, total: int) -> None:
        """Unless it has just done so."""
        now = time.monotonic()
        if self.log is None or total == 0 or now - self.last < QUIET_SECONDS:
            return
        if self.last == -math.inf:
            self.log.info(
                f"compiling {total} kernels (first run of this version on this machine; each is stored when done)"
            )
        elif 0 < done < total:
            left = (now - self.began) / done * (total - done)
            self.log.info(f"{done} of {total} kernels compiled, about {math.ceil(left)} s left")
        self.last = now

    @contextlib.contextmanager
    def announced(self) -> Iterator[None]:
        """While this process compiles, which does not know how many there are."""
        from numba.core import event

        class Listener(event.Listener):
            def on_start(listener, _: event.Event) -> None:
                """Nothing: kernels that are called by others are compiled within these."""

            def on_end(listener, _: event.Event) -> None:
                self.done += 1
                now = time.monotonic()
                if self.log is not None and now - max(self.last, self.began) > QUIET_SECONDS:
                    self.log.info(f"{self.done} kernels compiled")
                    self.last = now

        with event.install_listener("numba:compile", Listener()):
            yield


def _compile_beside(warm_ups: list[Callable[[], None]], cores: frozenset[int], progress: _Progress) -> str:
    """Compile with several processes, if there are cores for them; what went wrong, if anything."""
    quota, memory = cgroups.cpu_quota(Path("/")), cgroups.memory(Path("/"))
    limits = (quota, memory and memory / MEMORY)
    count = int(min(len(cores), PROCESSES, *(round(limit) for limit in limits if limit is not None)))
    if count < 2:
        return ""
    try:
        return compile_in_processes(warm_ups, count, cores, progress.update)
    except (OSError, pickle.PicklingError, AttributeError) as error:  # no more processes; a warm-up of a closure
        return f"{type(error).__name__}: {error}"


def warmup(log: Log, prepare: Callable[[], Path]) -> None:
    """Compile for later runs, as on a login node: `hpcdem warmup`."""
    began = time.monotonic()
    folder = prepare()
    log.info(f"kernels ready in {time.monotonic() - began:.1f} s: {folder}")
