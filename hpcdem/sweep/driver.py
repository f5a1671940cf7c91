"""Many members at once on this machine, never more processes than cores; whatever ends the driver, members are found
again by their locks."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import Any

from hpcdem.core.errors import EXIT_CHECKPOINT, EXIT_USAGE, UsageError
from hpcdem.io.lock import FolderLock, Taken
from hpcdem.runtime import launch
from hpcdem.sweep.plan import DONE, LOG, RUNNING, STATE, Member, Plan, read_json

POLL_SECONDS = 0.1
"""Time between two checks of the members [s]."""


def jobs_at_once(plan: Plan, jobs: int | None) -> int:
    """Number of members run at once: as given, else as many as the cores allow. UsageError if that is too many."""
    cores, each = launch.cores(), plan.ranks * plan.threads
    if (jobs or 1) * each > cores:
        raise UsageError(
            f"{jobs or 1} at once with {plan.ranks} ranks of {plan.threads} threads are {(jobs or 1) * each} processes "
            f"and threads; available: {cores} cores here"
        )
    return jobs or cores // each


def run(plan: Plan, log: Any, jobs: int | None = None, tries: int = 2, without: Collection[str] = ()) -> dict[str, str]:
    """Carry out all members that are not done; returns the state of each. tries: how often a member is started now;
    without: names of members that are left as they are."""
    at_once = jobs_at_once(plan, jobs)
    try:
        lock = FolderLock(plan.folder, {"host": socket.gethostname(), "pid": os.getpid()})
    except Taken as taken:
        who = f"process {taken.holder.get('pid', '?')} on {taken.holder.get('host', '?')}"
        raise UsageError(f"{plan.folder}: {who} already runs this sweep") from None
    try:
        with _signals() as asked:
            return _Driver(plan, log, at_once, tries, asked, without).run()
    finally:
        lock.release()


@contextmanager
def _signals() -> Iterator[Callable[[], bool]]:
    """A function that returns whether Ctrl-C or SIGTERM requested a stop."""
    seen: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)
    before = {number: signal.signal(number, lambda number, frame: seen.append(number)) for number in numbers}
    try:
        yield lambda: bool(seen)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Driver:
    """One pass over the members."""

    def __init__(
        self, plan: Plan, log: Any, at_once: int, tries: int, asked: Callable[[], bool], without: Collection[str] = ()
    ) -> None:
        self.plan, self.log, self.at_once, self.tries, self.asked = plan, log, at_once, tries, asked
        self.mine: dict[str, subprocess.Popen[bytes]] = {}
        self.left = dict.fromkeys((member.name for member in plan.members), tries)
        unfinished = [member for member in plan.members if member.state != DONE]
        self.open = [member for member in unfinished if member.name not in without]
        self.done = len(plan.members) - len(unfinished)

    def run(self) -> dict[str, str]:
        """Run members until all are done, have failed, or somebody asks to stop."""
        found = [member.name for member in self.open if member.state == RUNNING]
        already = f", {self.done} already done" if self.done else ""
        self.log.info(f"{self.plan.folder}: {len(self.plan.members)} members{already}, {self.at_once} at once")
        if found:
            self.log.info(f"members {', '.join(found)} are still running since an earlier call: waiting for them")
        while self.open and not self.asked():
            self._poll()
            time.sleep(POLL_SECONDS)
        if self.mine:
            self.log.info(f"stopping: {len(self.mine)} members write a checkpoint")
            for process in self.mine.values():
                process.terminate()
            for process in self.mine.values():
                process.wait()
        return {member.name: member.state for member in self.plan.members}

    def _poll(self) -> None:
        """Record members that have ended, and start as many as the limit allows. Members started by an earlier call
        count too.
        """
        busy = 0
        for member in list(self.open):
            process = self.mine.get(member.name)
            if process is not None and process.poll() is None:
                busy += 1
                continue
            state = member.state
            if state == RUNNING:
                busy += 1
                continue
            if process is not None or state == DONE:
                self.mine.pop(member.name, None)
                self._ended(member, state)
        for member in [one for one in self.open if one.name not in self.mine][: max(0, self.at_once - busy)]:
            if member.state == RUNNING:
                continue
            self.left[member.name] -= 1
            words = [sys.executable, "-m", "hpcdem", "sweep", str(self.plan.folder), "--member", member.name]
            # dict(os.environ): without what an MPI that was loaded here has put into it.
            self.mine[member.name] = subprocess.Popen(
                words, env=dict(os.environ), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                start_new_session=True,
            )  # fmt: skip

    def _ended(self, member: Member, state: str) -> None:
        """A member of ours, or of an earlier call, is no longer running."""
        about = read_json(member.folder / STATE, {"code": None, "seconds": 0.0})
        if state == DONE:
            self.done += 1
            self.open.remove(member)
            self.log.info(f"{member.label()} done in {about['seconds']:.0f} s; {self.done} of {len(self.plan.members)}")
            return
        code = about["code"]
        why = "was killed" if code is None else f"ended with {code}"
        if code in (EXIT_USAGE, EXIT_CHECKPOINT) or not self.left[member.name]:
            self.open.remove(member)
            self.log.warn(f"{member.label()} {why}: see {member.folder / LOG}")
        else:
            self.log.info(f"{member.label()} {why}; resuming from its last checkpoint")
