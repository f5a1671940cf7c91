"""Many pictures, shared out over the ranks, or over processes of one machine."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.axes import View
from hpcdem.io.disk import explain
from hpcdem.post import blocks
from hpcdem.post.plots import Style, plot_file

if TYPE_CHECKING:
    from hpcdem.post.view.model import ModelView
    from hpcdem.post.view.paper import Paper

Report = Callable[[str], None]
_LAUNCHER = ("PMI", "OMPI_", "SLURM_", "PALS_", "MPI_")


@dataclass(frozen=True)
class Job:
    """A frame in a file, and the picture to be made of it."""

    source: Path
    picture: Path
    style: Style | blocks.Appearance
    seen: View | None = None

    @property
    def name(self) -> str:
        """Return the name shown by the progress report."""
        return self.source.stem

    def __call__(self) -> None:
        """Draw. Raises HpcdemError that names one of the files."""
        try:
            if isinstance(self.style, blocks.Appearance):
                blocks.plot_file(self.source, self.picture, self.style, self.seen)
            else:
                plot_file(self.source, self.picture, self.style, self.seen)
        except HpcdemError as failure:
            text = str(failure)
            named = self.source.name in text or self.picture.name in text
            raise HpcdemError(text if named else f"{self.source}: {text}") from None


@dataclass(frozen=True)
class ViewJob:
    """A view of a frame in a file, and the picture to be made of it."""

    source: Path
    picture: Path
    view: ModelView
    paper: Paper
    seen: View

    @property
    def name(self) -> str:
        """Return the name shown by the progress report."""
        return self.source.stem

    def __call__(self) -> None:
        """Draw. Raises HpcdemError that names one of the files."""
        from hpcdem.post.view.paper import draw

        try:
            draw(self.source, self.picture, self.view, self.paper, self.seen)
        except HpcdemError as failure:
            text = str(failure)
            raise HpcdemError(text if self.source.name in text else f"{self.source}: {text}") from None


class Task(Protocol):
    """Work that can be done in another process: it can be pickled."""

    @property
    def name(self) -> str:
        """Return the name shown by the progress report."""

    def __call__(self) -> None:
        """Do it. Raises HpcdemError."""


def draw_all(tasks: Sequence[Task], comm: Comm, workers: int = 1, report: Report | None = None) -> None:
    """Collective: do all tasks, equal on all ranks. The same bytes on any number of ranks and workers.

    Several ranks take turns, each works alone; one rank starts `workers` processes. A task that fails does not keep the
    others from being done; HpcdemError on all ranks afterwards. report: called on this rank with lines of progress.
    """
    mine = range(comm.rank, len(tasks), comm.size)
    workers = min(workers, len(tasks))
    failures: dict[int, str] = {}
    with Progress(len(tasks), len(mine), report if comm.rank == 0 else None) as progress:
        for k, failure in _in_processes(tasks, workers) if comm.size == 1 and workers > 1 else _here(tasks, mine):
            if failure is not None:
                failures[k] = failure
            progress.done(tasks[k].name)
    failures = {k: text for part in comm.allgather(failures) for k, text in part.items()}
    if failures:
        first = failures[min(failures)]
        count = f"{len(failures)} of {len(tasks)} pictures could not be made; the first: " if len(failures) > 1 else ""
        raise HpcdemError(count + first)


def _here(tasks: Sequence[Task], mine: Sequence[int]) -> Iterator[tuple[int, str | None]]:
    for k in mine:
        yield k, _done(tasks[k])


def _in_processes(tasks: Sequence[Task], workers: int) -> Iterator[tuple[int, str | None]]:
    # Fresh processes, not forks: a fork of a process with threads (OpenMP, HDF5, MPI) may hang.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), initializer=_alone)
    try:
        number = {pool.submit(_done, task): k for k, task in enumerate(tasks)}
        for drawn in as_completed(number):
            yield number.pop(drawn), drawn.result()
    except BrokenProcessPool:
        raise HpcdemError(
            f"one of {workers} drawing processes was killed, perhaps for lack of memory: use fewer (--max_workers), "
            "or a smaller --dpi"
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


def _alone() -> None:
    """Prepare a new process: it is not a rank, so an HDF5 with MPI must not mistake it for one."""
    for name in [name for name in os.environ if name.startswith(_LAUNCHER)]:
        del os.environ[name]


def _done(task: Task) -> str | None:
    """Do it; what went wrong, or None."""
    try:
        task()
    except HpcdemError as failure:
        return str(failure)
    except MemoryError:
        return f"{task.name}: not enough memory for this picture"
    except OSError as failure:
        return explain(failure.filename or f"the picture of {task.name}", failure)
    except Exception as failure:  # one bad file must not keep a thousand good ones from being drawn
        return f"cannot draw {task.name}: {type(failure).__name__}: {failure}"
    return None


class Progress:
    """Progress of a series and its remaining time: a bar on a terminal, otherwise at most one line per second."""

    def __init__(self, total: int, mine: int, report: Report | None) -> None:
        self._total, self._mine, self._report = total, mine, report
        self._done, self._began, self._last = 0, time.monotonic(), -1e9
        self._bar: Any = None

    def __enter__(self) -> Progress:
        # Open MPI gives its processes a terminal of their own, wherever their output goes in the end.
        if self._report is not None and sys.stdout.isatty() and "OMPI_COMM_WORLD_SIZE" not in os.environ:
            from rich import progress

            self._bar = progress.Progress(*progress.Progress.get_default_columns(), transient=True)
            self._bar.add_task("", total=self._mine)
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def done(self, name: str) -> None:
        """Count a completed task of this rank."""
        self._done += 1
        now = time.monotonic()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=self._done, description=name)
            return
        if self._report is None or (now - self._last < 1.0 and self._done < self._mine):
            return
        self._last = now
        pace = (now - self._began) / self._done
        count = self._total if self._done == self._mine else self._done * self._total // self._mine
        left = f", about {pace * (self._mine - self._done):.0f} s left" if self._done < self._mine else ""
        self._report(f"{name}: {count} of {self._total}, {pace * self._mine / self._total:.2g} s each{left}")
