"""A process that does not end on request.

Python calls its signal handlers between two of its own instructions. A rank that waits inside MPI for a rank that will
never come, or inside the system for a disk that does not answer, never gets there: SIGTERM would do nothing at all. So
a thread listens as well, to what the system's own handler writes into a pipe, and ends the process

- `GRACE` seconds after a second SIGTERM or Ctrl-C, if it is still there then;
- when a SIGTERM has not been answered and the process has been inside one and the same call for `TIMEOUT` seconds.

The launcher then ends the other ranks. No step is slower for it: the thread sleeps until a signal comes.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

from hpcdem.runtime.shutdown import EXIT_INTERRUPTED, EXIT_TERMINATED, flush

TIMEOUT = 60.0
GRACE = 5.0
SAME_SIGNAL = 2.0
"""A SIGTERM this soon [s] after another is the same one: launchers and queues send it to a job by several ways."""
_INTERVAL = 1.0
_CODES = {"SIGTERM": EXIT_TERMINATED, "SIGINT": EXIT_INTERRUPTED}


class Watchdog:
    """The thread that listens. rank: named in its messages; leave: ends the process (replaced in tests)."""

    def __init__(
        self, rank: int = 0, timeout: float = TIMEOUT, grace: float = GRACE, leave: Callable[[int], object] = os._exit
    ) -> None:
        self._rank, self._timeout, self._grace, self._leave = rank, timeout, grace, leave
        self._main = threading.main_thread().ident or 0
        self._first: dict[str, float] = {}  # when a signal came first
        self._due: tuple[float, str] | None = None
        self._stuck: tuple[FrameType | None, float] = (None, 0.0)  # where the main thread is, since when
        self._answered = threading.Event()
        self._handles: tuple[int, int] | None = None

    def listen(self) -> None:
        """Begin. In the main thread only. Somebody else who listens already (an event loop) is not disturbed."""
        handles = os.pipe()
        for handle in handles:
            os.set_blocking(handle, False)
        other = signal.set_wakeup_fd(handles[1], warn_on_full_buffer=False)
        if other != -1:
            signal.set_wakeup_fd(other)
            _close(*handles)
            return
        self._handles = handles
        threading.Thread(target=self._watch, args=handles, name="watchdog", daemon=True).start()

    def answered(self) -> None:
        """Note that all ranks have agreed to stop: the last checkpoint may take as long as it needs."""
        self._answered.set()

    def close(self) -> None:
        """Listen no more; what was due is forgotten."""
        if self._handles is not None:
            signal.set_wakeup_fd(-1)
            os.write(self._handles[1], b"\0")
            self._handles = None

    def _watch(self, listening: int, writing: int) -> None:
        poll = select.poll()
        poll.register(listening, select.POLLIN)
        while True:
            waiting = self._due is not None or ("SIGTERM" in self._first and not self._answered.is_set())
            if poll.poll(1000.0 * min(_INTERVAL, self._timeout / 4, self._grace / 4) if waiting else None):
                heard = os.read(listening, 64)
                if 0 in heard:
                    _close(listening, writing)
                    return
                for number in heard:
                    self._receive(signal.Signals(number).name, time.monotonic())
            self._check(time.monotonic())

    def _receive(self, name: str, now: float) -> None:
        if name not in _CODES:
            return
        first = self._first.setdefault(name, now)
        if first == now:
            self._stuck = (None, now)
        elif self._due is None and (name == "SIGINT" or now - first > SAME_SIGNAL):
            self._due = now + self._grace, name

    def _check(self, now: float) -> None:
        if self._due is not None and now >= self._due[0]:
            name = self._due[1]
            self._end(_CODES[name], f"{'Ctrl-C' if name == 'SIGINT' else name} came twice")
        elif "SIGTERM" in self._first and not self._answered.is_set():
            frame = sys._current_frames().get(self._main)
            if frame is not self._stuck[0]:  # the frame is held, so another one cannot be taken for it
                self._stuck = frame, now
            if now - self._stuck[1] >= self._timeout:
                self._end(EXIT_TERMINATED, f"SIGTERM was not answered for {self._timeout:g} s")
        else:
            self._stuck = (None, now)

    def _end(self, code: int, why: str) -> None:
        time.sleep(0.2 * min(self._rank, 20))  # of several ranks the lowest comes to speak; then the launcher acts
        frame = sys._current_frames().get(self._main)
        where = ""
        if frame is not None:
            place = frame.f_code
            where = f" while waiting in {os.path.basename(place.co_filename)}:{frame.f_lineno} ({place.co_name})"
        helper = threading.Thread(target=flush, daemon=True)  # the main thread may hold the lock of stdout
        helper.start()
        helper.join(0.5)
        text = f"hpcdem: rank {self._rank}: {why}{where}; ended without saving. Resume from the last checkpoint\n"
        os.write(2, text.encode())
        self._leave(code)


def _close(*handles: int) -> None:
    for handle in handles:
        os.close(handle)
