"""Frames that a ZDEM script foretells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from hpcdem.lang.zdem.plan import Run


def frames(run: Run) -> Iterator[tuple[int, bool]] | None:
    """(step, initial) of every frame in the order in which they are written; None if unknown."""
    start, steps, every = run.start, run.steps, run.every["print"]
    if start is None or steps is None or every is None:
        return None
    return _frames(start, start + steps, every, run.imple)


def _frames(start: int, end: int, every: int, imple: bool) -> Iterator[tuple[int, bool]]:
    yield start, True
    last = start
    if every > 0:
        first = start + every if imple else (start // every + 1) * every
        for last in range(first, end + 1, every):
            yield last, False
    if (imple and last != end) or (imple and every == 0):
        yield end, False


def frame_names(runs: Iterable[Run], suffix: str = ".dat") -> list[str] | None:
    """Names of all frames of a script, each once, in order; None where something is unknown. As long as there are
    frames: ask `Run.files` how many before."""
    names: dict[str, None] = {}
    for run in runs:
        there = frames(run)
        if there is None:
            return None
        names.update((f"all_{step:010d}{'_ini' if initial else ''}{suffix}", None) for step, initial in there)
    return list(names)
