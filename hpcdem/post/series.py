"""Many pictures, shared out over the ranks, or over processes of one machine."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from hpcdem.errors import HpcdemError
from hpcdem.io.axes import View
from hpcdem.post import blocks
from hpcdem.post.plots import Style, plot_file

Report = Callable[[str], None]
_LAUNCHER = ("PMI", "OMPI_", "SLURM_", "PALS_", "MPI_")


@dataclass(frozen=True)
class Job:
    """A frame in a file, and the picture to be made of it."""

    source: Path
    picture: Path
    style: Style | blocks.Looks
    seen: View | None = None


def draw_all(jobs: Sequence[Job], comm: Any, workers: int = 1, report: Report | None = None) -> None:
    """Collective: draw all jobs, equal on all ranks. The same bytes on any number of ranks and workers.

    Several ranks take turns, each draws alone; one rank starts `workers` processes. A job that fails does not keep the
    others from being drawn; HpcdemError on all ranks afterwards. report: called on this rank with lines of progress.
    """
    mine = range(comm.rank, len(jobs), comm.size)
    workers = min(workers, len(jobs))
    progress = Progress(len(jobs), len(mine), report)
    failures: dict[int, str] = {}
    for k, failure in _in_processes(jobs, workers) if comm.size == 1 and workers > 1 else _here(jobs, mine):
        if failure is not None:
            failures[k] = failure
        progress.done(jobs[k].source.stem)
    failures = {k: text for part in comm.allgather(failures) for k, text in part.items()}
    if failures:
        first = failures[min(failures)]
        count = f"{len(failures)} of {len(jobs)} pictures could not be made; the first: " if len(failures) > 1 else ""
        raise HpcdemError(count + first)


def _here(jobs: Sequence[Job], mine: Sequence[int]) -> Iterator[tuple[int, str | None]]:
    for k in mine:
        yield k, _draw(jobs[k])


def _in_processes(jobs: Sequence[Job], workers: int) -> Iterator[tuple[int, str | None]]:
    # Fresh processes, not forks: a fork of a process with threads (OpenMP, HDF5, MPI) may hang.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), initializer=_alone)
    try:
        number = {pool.submit(_draw, job): k for k, job in enumerate(jobs)}
        for drawn in as_completed(number):
            yield number.pop(drawn), drawn.result()
    except BrokenProcessPool:
        raise HpcdemError(
            f"one of the {workers} processes that draw was ended from outside, perhaps for want of memory: take fewer "
            "(--max_workers), or a smaller --dpi"
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


def _alone() -> None:
    """In a new process: it is no rank, so an HDF5 with MPI must not take it for one."""
    for name in [name for name in os.environ if name.startswith(_LAUNCHER)]:
        del os.environ[name]


def _draw(job: Job) -> str | None:
    """Draw; what went wrong, or None."""
    try:
        if isinstance(job.style, blocks.Looks):
            blocks.plot_file(job.source, job.picture, job.style, job.seen)
        else:
            plot_file(job.source, job.picture, job.style, job.seen)
    except HpcdemError as failure:
        text = str(failure)
        return text if job.source.name in text or job.picture.name in text else f"{job.source}: {text}"
    except MemoryError:
        return f"{job.picture}: not enough memory for this picture"
    except Exception as failure:  # one bad file must not keep a thousand good ones from being drawn
        return f"cannot draw {job.source}: {type(failure).__name__}: {failure}"
    return None


class Progress:
    """A line every second at most: what is done and how long it will take."""

    def __init__(self, total: int, mine: int, report: Report | None) -> None:
        self._total, self._mine, self._report = total, mine, report
        self._done, self._began, self._last = 0, time.monotonic(), -1e9

    def done(self, name: str) -> None:
        """One more picture of this rank is there."""
        self._done += 1
        now = time.monotonic()
        if self._report is None or (now - self._last < 1.0 and self._done < self._mine):
            return
        self._last = now
        pace = (now - self._began) / self._done
        count = self._total if self._done == self._mine else self._done * self._total // self._mine
        left = f", about {pace * (self._mine - self._done):.0f} s left" if self._done < self._mine else ""
        self._report(f"{name}: {count} of {self._total}, {pace * self._mine / self._total:.2g} s each{left}")
