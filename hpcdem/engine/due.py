"""Work between steps: tasks that are due at certain steps, and responses to signals and limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from hpcdem.engine.model import Model


def after(step: int, every: int, origin: int = 0) -> int:
    """Return the first step after this one that is a multiple of `every`, counted from the origin."""
    return origin + ((step - origin) // every + 1) * every


@dataclass
class Task:
    """A task that is due at the steps origin + k * every, k > 0, and at the step `also`."""

    every: int
    origin: int
    run: Callable[..., object]
    also: int = -1

    def next_after(self, step: int) -> int:
        """Return the first step after `step` at which the task is due."""
        regular = after(step, self.every, self.origin)
        return min(regular, self.also) if self.also > step else regular

    def due_at(self, step: int) -> bool:
        """Return whether the task is due at this step."""
        return self.next_after(step - 1) == step


def first_after(step: int, tasks: Iterable[Task]) -> int:
    """Return the first step after `step` at which one of the tasks is due."""
    return min(task.next_after(step) for task in tasks)


def answer(model: Model, request: int, save: Callable[[bool], Path], how: Callable[[Path], str]) -> None:
    """Respond to a signal or time limit that requests a checkpoint and perhaps the end of the run.

    save: writes a checkpoint, automatic or not, and returns its path; how: the command that resumes from it. Raises
    StoppedWithCheckpoint if the run ends. Collective.
    """
    stop, log, step = model.stop, model.log, model.clock.step
    what = stop.decide(request)
    if what == "none":
        return
    path = save(what == "auto")
    if what == "stop":
        raise stop.end(f"stopped at step {step} by {stop.reason}; checkpoint {path} written, resume with {how(path)}")
    if log is not None:
        why = "automatically" if what == "auto" else "on request"
        log.info(f"step {step}: checkpoint {path} written {why}")
