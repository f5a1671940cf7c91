"""Files that a thread writes while the run continues.

A writer that receives a `Deliveries` gives the work of rank 0 to a thread: writing bytes, flushing them to the disk,
and renaming the file. All work that needs other ranks is done before, so the thread never calls MPI. It spends its time
inside the operating system, so the step loop keeps the Python interpreter.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Protocol

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError

BUFFER = 256 << 20
"""Largest number of bytes that wait to be written; a writer with more has to wait."""


class Delivered(Protocol):
    """A file and its error, if any."""

    error: str | None


class _Job:
    error: str | None = None


class Deliveries:
    """Files in progress: a queue of tasks on rank 0, executed in sequence after `go`.

    All ranks know which files are in progress (`expect`); `look` and `settle` raise their errors on all ranks.
    """

    def __init__(self, limit: int = BUFFER) -> None:
        self._limit, self._waiting = limit, 0
        self._held: list[tuple[Callable[[], None], int]] = []
        self._tasks: deque[tuple[Callable[[], None], int]] = deque()
        self._change = threading.Condition()
        self._thread: threading.Thread | None = None
        self._files: list[Delivered] = []
        self._expected = False
        self._failure: BaseException | None = None

    # -- the line --------------------------------------------------------------------------------------------

    def put(self, task: Callable[[], None], size: int = 0) -> None:
        """Add a task that holds `size` bytes until it is done; wait while the tasks would hold more than the limit."""
        with self._change:
            while self._waiting and self._waiting + size > self._limit:
                self._go()
                self._change.wait()
            self._held.append((task, size))
            self._waiting += size

    def go(self) -> None:
        """Start the tasks added so far. They are held back until then, so that two threads do not compete for the
        interpreter."""
        with self._change:
            self._go()

    def _go(self) -> None:
        if self._held:
            self._tasks.extend(self._held)
            self._held.clear()
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="deliveries", daemon=True)
                self._thread.start()
            self._change.notify_all()

    def wait(self) -> None:
        """Until all tasks are done. Not collective."""
        with self._change:
            self._go()
            while self._tasks:
                self._change.wait()

    def _work(self) -> None:
        while True:
            with self._change:
                while not self._tasks:
                    self._change.wait()
                task, size = self._tasks[0]
            try:
                task()
            except BaseException as failure:  # a mistake of ours: tasks keep errors of the disk to themselves
                self._failure = failure
            del task  # and the data with it
            with self._change:
                self._tasks.popleft()
                self._waiting -= size
                self._change.notify_all()

    def entrust(self, write: Callable[[], None]) -> None:
        """Write a file that needs no other rank in the thread: it calls `write`."""
        job = _Job()

        def work() -> None:
            try:
                write()
            except HpcdemError as failure:
                job.error = str(failure)

        self.put(work)
        self.expect(job)

    # -- files, as all ranks see them ------------------------------------------------------------------------

    def expect(self, file: Delivered | None) -> None:
        """Register a file in progress; None on the ranks that do not write it. Collective."""
        self._expected = True
        if file is not None:
            self._files.append(file)

    def poll(self, comm: Comm) -> None:
        """Raise HpcdemError on all ranks if a file is known to have failed. Collective, waits for no disk."""
        if self._expected:
            comm.agree(self._first_error())

    def settle(self, comm: Comm) -> None:
        """Wait until all files have their names. Raises HpcdemError on all ranks if one has failed. Collective."""
        if not self._expected:
            return
        self.wait()
        error, failure = self._first_error(), self._failure
        self._files.clear()
        self._expected, self._failure = False, None
        if failure is not None:
            raise failure
        comm.agree(error)

    def _first_error(self) -> str | None:
        return next((file.error for file in self._files if file.error is not None), None)


under_way = Deliveries()
"""Files being written by this process, of any model."""
