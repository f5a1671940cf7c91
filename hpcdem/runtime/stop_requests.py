"""Requests to save or to stop, from outside: signals, a time limit, the end of a Slurm job.

| what | then |
|---|---|
| SIGUSR1, SIGTERM, first SIGINT (Ctrl-C) | save a checkpoint and stop, exit code 85 |
| SIGUSR2 | save a checkpoint and continue |
| so much time since the last checkpoint (autosave) | the same |
| second SIGINT, or second SIGTERM | stop at once, nothing is saved, exit code 130 or 143 |
| first SIGINT in a loop of the script's own, without commands | the same, after a second |
| first SIGINT, SIGTERM in a loop of commands that do not step | save and stop, after a second |
| time limit or end of the Slurm job | save and stop, early enough for the save to finish |

srun and scancel pass on every signal. Of a signal to mpiexec itself the ranks see SIGUSR1 with either MPI, SIGTERM and
SIGINT with MPICH only, SIGUSR2 with Open MPI only (as tried with MPICH 5.0 and Open MPI 5.0).

A rank that hangs inside MPI cannot look at flags: `watchdog.Watchdog` ends it after a second SIGTERM or SIGINT, and
after one SIGTERM that is not answered for a minute.

What ends the run is no `Exception`. A script that catches it all the same (`except:`) meets it again at its next
command: nothing is stepped, asked or written after the checkpoint.

A signal may reach one rank only and the clocks of the ranks differ, so a request counts only once all ranks have
seen it. The step loop puts `local_request()` into a maximum that it takes over the ranks anyway, and hands the
result to `decide()`.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from datetime import datetime
from types import FrameType
from typing import TYPE_CHECKING, Any, Literal

from hpcdem.core.errors import StoppedWithCheckpoint, UsageError
from hpcdem.runtime.watchdog import SAME_SIGNAL, Watchdog

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm


NONE, AUTO, SAVE, STOP = 0, 1, 2, 3
"""Codes of a request; the largest one wins. AUTO: the last checkpoint was long ago."""

Decision = Literal["none", "auto", "save", "stop"]

HANDLED = ("SIGUSR2", "SIGUSR1", "SIGTERM", "SIGINT")
GRACE = 1.0
"""Seconds after the first SIGINT in which the script may come to a command; its own Python is interrupted then."""
_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep
SAME_REQUEST = 2.0
"""A SIGUSR2 this soon [s] after a save was sent to all ranks at once and is answered already."""


AUTOSAVE = 1800.0
"""Seconds between automatic checkpoints."""
LEAST_SHARE = 20.0
"""Least interval between them, as a multiple of the duration of the last one."""


def parse_limit(text: str, option: str = "--time-limit") -> float:
    """Seconds in ``HH:MM:SS``, ``MM:SS``, ``D-HH:MM:SS`` (as Slurm writes it) or a plain number of seconds.

    UsageError for anything else.
    """
    try:
        days, dash, clock = text.strip().rpartition("-")
        seconds = 0.0
        for part in clock.split(":", 2):
            seconds = 60.0 * seconds + float(part)
        seconds += 86400.0 * int(days if dash else 0)
    except ValueError:
        seconds = -1.0
    if not 0.0 < seconds < math.inf:
        raise UsageError(f"{option} {text}: expected a time as HH:MM:SS, for example 11:30:00")
    return seconds


class StopRequests:
    """The requests seen by this rank.

    time_limit: seconds from now (wall clock) after which the run must have ended; None: no limit of its own.
    end_time: the same as a time of day [s since 1970], as Slurm gives it.
    autosave: seconds after which a checkpoint is written if there was none; None: never. ended: what has ended the run.
    """

    def __init__(
        self, time_limit: float | None = None, end_time: float | None = None, autosave: float | None = None
    ) -> None:
        self.reason = ""
        self._began = self._last_file = time.monotonic()
        self._autosave = autosave
        self._limits: list[tuple[float, float, str]] = []  # latest end (monotonic), first margin, name
        if time_limit is not None:
            self._limits.append((self._began + time_limit, min(60.0, 0.05 * time_limit), "the time limit"))
        if end_time is not None:
            left = end_time - time.time()
            self._limits.append((self._began + left, min(120.0, 0.05 * left), "the end of the Slurm job"))
        self._save = False
        self._stop = ""
        self._interrupts = 0
        self._terminated: float | None = None
        self._watchdog = Watchdog()
        self._last_save_took: float | None = None
        self._last_saved = -math.inf
        self._before: dict[int, Any] = {}
        self._answered = False
        self._asked = 0.0
        self.ended: StoppedWithCheckpoint | None = None

    # -- signals ---------------------------------------------------------------------------------------------

    def install(self, rank: int = 0) -> StopRequests:
        """Take over the signals, once; after MPI has begun, which may set its own handlers. rank: for messages."""
        if self._before:
            return self
        for name in HANDLED:
            number = getattr(signal, name, None)
            if number is not None:
                self._before[number] = signal.signal(number, self._on_signal)
        self._watchdog = Watchdog(rank)
        self._watchdog.listen()
        return self

    def uninstall(self) -> None:
        """Give the signals back."""
        self._quiet()
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()
        self._watchdog.close()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        """Set a flag only: the state may be in the middle of a step."""
        name = signal.Signals(number).name
        if name == "SIGUSR2":
            self._save = self._save or time.monotonic() - self._last_saved > SAME_REQUEST
            return
        if name == "SIGINT":
            self._interrupts += 1
            if self._interrupts > 1:
                raise KeyboardInterrupt
            self._wait_for_a_command()
        if name == "SIGTERM":
            self._terminated = self._terminated or time.monotonic()
            if time.monotonic() - self._terminated > SAME_SIGNAL:
                raise KeyboardInterrupt("SIGTERM")
        self._stop = self._stop or ("Ctrl-C" if name == "SIGINT" else name)

    def _wait_for_a_command(self) -> None:
        """A script in its own loop never checks flags: check it at intervals. Where it uses the alarm itself it must be
        interrupted a second time.
        """
        number = getattr(signal, "SIGALRM", None)
        if number is not None and signal.getsignal(number) in (signal.SIG_DFL, None):
            self._before[number] = signal.signal(number, self._on_alarm)
            signal.setitimer(signal.ITIMER_REAL, GRACE, GRACE)

    def _on_alarm(self, number: int, frame: FrameType | None) -> None:
        if not self._answered and in_the_script(frame):
            raise KeyboardInterrupt("own loop")

    def _quiet(self) -> None:
        """The request is being answered: no alarm any more."""
        self._answered = True
        number = getattr(signal, "SIGALRM", None)
        if number in self._before:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(number, self._before.pop(number))

    # -- the questions of the step loop ----------------------------------------------------------------------

    def local_request(self) -> int:
        """Return the request known to this rank: one of the codes above."""
        if not self._stop:
            now = time.monotonic()
            for end, _, name in self._limits:
                if now >= end - self.margin():
                    self._stop = name
        if self._stop or self._save:
            return STOP if self._stop else SAVE
        return AUTO if self._autosave is not None and time.monotonic() - self._last_file > self._pause() else NONE

    def overdue_request(self) -> int:
        """STOP if a stop was requested and no step has responded for some time; else NONE."""
        if self.local_request() != STOP:
            return NONE
        self._asked = self._asked or time.monotonic()
        return STOP if time.monotonic() - self._asked > GRACE else NONE

    def _pause(self) -> float:
        """Seconds between automatic checkpoints."""
        return max(self._autosave or 0.0, LEAST_SHARE * (self._last_save_took or 0.0))

    def decide(self, code: int) -> Decision:
        """The decision that belongs to the largest code of all ranks; a save request is answered by it."""
        if code >= STOP:
            self.reason = self._stop or "a request to another rank"
            self._quiet()
            self._watchdog.answered()
            return "stop"
        if code == SAVE:
            self._save = False
            self._last_saved = time.monotonic()
            return "save"
        if code == AUTO:
            self._last_file = time.monotonic()
            return "auto"
        return "none"

    def end(self, message: str) -> StoppedWithCheckpoint:
        """The exception that ends the run: the request is answered. A console continues after it."""
        end = StoppedWithCheckpoint(message)
        if not hasattr(sys, "ps1"):
            self.ended = end
        return end

    def refuse(self) -> None:
        """Raise what has ended the run, if it has: the script has caught it."""
        if self.ended is not None:
            raise self.ended

    def poll(self, comm: Comm) -> Decision:
        """Collective: the decision of all ranks, where no other reduction can carry the code."""
        import numpy as np

        return self.decide(int(comm.max_into(np.array([self.local_request()], dtype=np.int64))[0]))

    # -- margin ----------------------------------------------------------------------------------------------

    def saved(self, seconds: float) -> None:
        """Record the duration of a checkpoint, from which the next margin follows."""
        self._last_save_took = seconds
        self._last_saved = self._last_file = time.monotonic()

    def margin(self) -> float:
        """Seconds before the nearest limit at which the last checkpoint is begun.

        Twice the last save and a second for the check interval; before the first save 5 % of the limit, at most
        one minute (two before the end of a Slurm job).
        """
        if self._last_save_took is not None:
            return 2.0 * self._last_save_took + 1.0
        return max((margin for _, margin, _ in self._limits), default=0.0)


def in_the_script(frame: FrameType | None) -> bool:
    """Return whether this frame, or the nearest outer one that belongs to either, is of the user's program, not of
    hpcdem."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_PACKAGE):
            return False
        if frame.f_globals.get("__name__") == "__main__":
            return True
        frame = frame.f_back
    return False


def slurm_end_time(environ: Mapping[str, str] = os.environ, ask: Callable[..., Any] = subprocess.run) -> float | None:
    """The end of this Slurm job [s since 1970]: SLURM_JOB_END_TIME, else what squeue says; None outside a job.

    Ask on one rank only: a thousand squeue calls at once would hurt the controller.
    """
    given = environ.get("SLURM_JOB_END_TIME", "")
    if given.isdigit():
        return float(given)
    job = environ.get("SLURM_JOB_ID")
    if job is None:
        return None
    try:
        answer = ask(["squeue", "-h", "-j", job, "-o", "%e"], capture_output=True, text=True, timeout=10, check=True)
        return datetime.fromisoformat(answer.stdout.strip()).timestamp()
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
