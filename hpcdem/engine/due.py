"""What happens between steps: tasks that are due at some of them, and answers to what the outside asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from hpcdem.engine.model import Model


def after(step: int, every: int, origin: int = 0) -> int:
    """The first step after this one that is a multiple of `every` from the origin on."""
    return origin + ((step - origin) // every + 1) * every


@dataclass
class Task:
    """Something to do at the steps origin + k * every, k > 0, and at the step `also`."""

    every: int
    origin: int
    run: Callable[..., object]
    also: int = -1

    def next_after(self, step: int) -> int:
        """The first step after `step` at which it is due."""
        regular = after(step, self.every, self.origin)
        return min(regular, self.also) if self.also > step else regular

    def due_at(self, step: int) -> bool:
        """Whether it is due at this step."""
        return self.next_after(step - 1) == step


def first_after(step: int, tasks: Iterable[Task]) -> int:
    """The first step after `step` at which one of them is due."""
    return min(task.next_after(step) for task in tasks)


def answer(model: Model, request: int, save: Callable[[bool], Path], how: Callable[[Path], str]) -> None:
    """A signal or the time limit requests a checkpoint, perhaps also the end of the run. save: writes one and returns
    its path, automatic or not; how: the command that resumes from it. StoppedWithCheckpoint. Collective."""
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
