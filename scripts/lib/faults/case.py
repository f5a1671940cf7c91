"""One case: a folder, a run, one fault or several after each other, and the way to the end."""

from __future__ import annotations

import random
import re
import shutil
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from faults import judge, runs
from faults.model import Model, Reference, write_script
from faults.runs import End, Job

DONE, FAILED, USAGE, STOPPED = 0, 1, 2, 85


@dataclass
class World:
    """What all cases share. other: a run of another script; folder: for the cases."""

    reference: Reference
    other: Reference
    folder: Path
    most_ranks: int = 3
    cluster: Any = None


class Skipped(Exception):
    """This fault cannot be made on this machine; the message says why."""


@dataclass
class Case:
    """rng: what is random; problems: what did not hold; moments: steps reached at the faults; lost: steps done twice;
    refused: the program declined, with a reason, to go on until something was put right."""

    world: World
    rng: random.Random
    folder: Path
    ranks: tuple[int, ...] = (1,)
    problems: list[str] = field(default_factory=list)
    moments: list[int] = field(default_factory=list)
    spoiled: set[str] = field(default_factory=set)
    lost: int = 0
    refused: bool = False
    gone: bool = False  # the output folder was taken away
    options: list[str] = field(default_factory=list)
    jobs: list[Job] = field(default_factory=list)
    cleanup: list[Callable[[], object]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.script = write_script(self.folder, self.model)
        self.options += self.model.options
        self.data = self.folder / "data"
        self._expected: int | None = None
        self._row = 0

    @property
    def model(self) -> Model:
        """What is run."""
        return self.world.reference.model

    def reached(self) -> int:
        """The last step that a row tells of."""
        return judge.reached(self.data, self.model)

    # ---- runs --------------------------------------------------------------------------------------------------------

    def next_ranks(self) -> int:
        """How many ranks the next run has."""
        first, *rest = self.ranks
        self.ranks = (*rest, first)
        return first

    def start(
        self, plan: dict[str, Any] | None = None, options: Collection[str] = (), ranks: int | None = None,
        limit: int | None = None, **variables: str,
    ) -> Job:  # fmt: skip
        """Begin, or go on with what is there."""
        self._expected = judge.newest(self.data, self.spoiled)
        self._row = self.reached()
        words = [*runs.resume_words(self.script, self.data), *self.options, *options]
        name = f"log{len(self.jobs)}"
        job = runs.start(words, ranks or self.next_ranks(), self.folder, plan, limit, name, **variables)
        self.jobs.append(job)
        return job

    def moment(self, job: Job, least: int = 0, begins: bool = True) -> bool:
        """Wait for a random moment of a run, at a step after `least`; False if it was over before. begins: it may also
        be before the first step; else the program has taken over the signals."""
        if begins and least == 0 and self.rng.random() < 0.08:
            time.sleep(self.rng.uniform(0.0, 1.5))
        else:
            last, every = self.model.last, self.model.every
            last -= 2 * every if begins else last // 5  # a signal shall not come when the run is over
            target = self.rng.randint(min(max(least, self.reached() + 1), last), last)
            while (self.reached() < target or not (begins or job.at_work())) and not job.ended():
                time.sleep(0.002)
            time.sleep(self.rng.uniform(0.0, 0.02))
        return self.note(job)

    def note(self, job: Job) -> bool:
        """Remember the step of a fault that comes now; False if the run is over already."""
        if job.ended():
            return False
        self.moments.append(self.reached())
        return True

    def until(self, ready: Callable[[], object], job: Job, pause: float = 0.001) -> bool:
        """Wait until something is so, or the run is over."""
        while not ready():
            if job.ended():
                return False
            time.sleep(pause)
        return self.note(job)

    def end(self, job: Job, codes: Collection[int] | None = None, says: str = "", quiet: bool = False) -> End:
        """The end of a job: in time, with one of these codes (None: any), saying this if the code is not 0, without a
        traceback (quiet: one of the ranks was killed, and launchers print what they like); where it went on from was
        the newest checkpoint that is whole."""
        end = job.end()
        if end.code is None:
            self.problem(f"not at its end {runs.LONGEST:g} s after the fault", end)
        elif codes is not None and end.code not in codes:
            self.problem(f"exit code {end.code}, expected {' or '.join(map(str, sorted(codes)))}", end)
        elif says and end.code != DONE and not re.search(says, end.said):
            self.problem(f"does not say '{says}'", end)
        if "Traceback" in end.said and not quiet:
            self.problem("a traceback", end)
        if self._expected is not None and not (set(codes or ()) == {USAGE}):
            self._went_on(end)
        if not self.gone and (odd := judge.broken(self.data, self.world.reference, self.spoiled)):
            self.problem("; ".join(odd), end)
        return end

    def _went_on(self, end: End) -> None:
        found = re.search(r"resuming from (\S+), step (\d+)", end.out)
        if found is not None:
            step = int(found[2]) + self.model.ahead
            self.lost += max(0, self._row - step)
            if step < (self._expected or 0) + self.model.ahead:
                self.problem(f"went on from step {step}, a whole checkpoint of step {self._expected} is there", end)
        elif "starting at the beginning" in end.out:
            self.problem(f"starts at the beginning, a whole checkpoint of step {self._expected} is there", end)

    # ---- the verdict -------------------------------------------------------------------------------------------------

    def problem(self, what: str, end: End | None = None) -> None:
        """Something did not hold."""
        tail = end.said.strip().splitlines()[-4:] if end is not None else []
        self.problems.append(" | ".join([what, *tail]))

    def kept(self, before: set[str]) -> None:
        """All these files are still there."""
        missing = sorted(before - judge.final_names(self.data) - self.spoiled)
        missing = [name for name in missing if not name.startswith("auto_")]  # the last two are kept
        if "--keep" in self.options:
            missing = [name for name in missing if not name.endswith(".sav")]
        if missing:
            self.problem(f"lost: {', '.join(missing[:5])}")

    def finish(self) -> None:
        """Go on without any fault, to the same end."""
        before = set() if self.gone else judge.final_names(self.data)
        self.gone = False
        if not self.done():
            self.end(self.start(), {DONE})
        self.kept(before)
        for why in judge.other_end(self.data, self.world.reference, self.spoiled):
            self.problem(why)
        if not self.problems and self.lost > 2 * self.model.last:
            self.problem(f"{self.lost} steps were done twice")

    def done(self) -> bool:
        """Whether the last run came to its end."""
        names = [name for name in self.world.reference.names if name.endswith((".dat", ".txt"))]
        return all((self.data / name).exists() for name in names) and bool(self.jobs) and self._last_code() == DONE

    def _last_code(self) -> int | None:
        return self.jobs[-1].process.returncode

    def close(self, keep: bool) -> None:
        """End what still runs, give back what was mounted, remove the folder unless it is to be looked at."""
        for job in self.jobs:
            job.kill()
        if keep and self.data.is_dir() and self.cleanup:
            shutil.copytree(self.data, self.folder / "copy", dirs_exist_ok=True)
        for action in reversed(self.cleanup):
            action()
        if not keep:
            shutil.rmtree(self.folder, ignore_errors=True)
