"""`--check-reproducible N [--against LOG]`: fingerprints of the state in the log, and their comparison.

A line is made every N steps: ``state 2000: particles=<32 digits> contacts=<32 digits> walls=<32 digits>``. Two runs
that print the same lines had the same bits, on however many ranks and threads. Several simulations of a program are
distinguished by their number: ``state 2000 of model 2: ...``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError, UsageError

LINE = re.compile(r"state (\d+)(?: of model (\d+))?: ((?:\w+=[0-9a-f]{32} ?)+)\s*$")

States = dict[tuple[int, int], dict[str, str]]
"""Digests of the parts of the state, by model and step."""


def line(step: int, model: int, parts: Mapping[str, str]) -> str:
    """Format the log line of a state."""
    of = f" of model {model}" if model > 1 else ""
    return f"state {step}{of}: " + " ".join(f"{name}={value}" for name, value in parts.items())


def read(path: Path) -> States:
    """Return the states recorded in a log; of a step recorded twice (by a run that resumed from a checkpoint) the last.

    UsageError if it cannot be read or has no such lines.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as problem:
        raise UsageError(f"--against {path}: cannot read it: {problem.strerror}") from None
    states: States = {}
    for row in text.splitlines():
        found = LINE.search(row)
        if found is not None:
            parts = dict(part.split("=") for part in found[3].split())
            states[int(found[2] or 1), int(found[1])] = parts
    if not states:
        raise UsageError(f"--against {path}: read no line 'state <step>: ...', expected the log of a run with "
                         "--check-reproducible")  # fmt: skip
    return states


class Reproduction:
    """Tells of states in the log, and compares them with those of an earlier log if there is one.

    every: steps between two looks; expected: of `read`, None to compare with nothing;
    source: name of that log.
    """

    def __init__(self, every: int, log: Any, expected: States | None = None, source: str = "") -> None:
        self.every, self.log, self.expected, self.source = every, log, expected, source
        self.models = self.compared = 0

    def new_model(self) -> int:
        """The number of a simulation that is being made."""
        self.models += 1
        return self.models

    def see(self, model: int, step: int, parts: Mapping[str, str]) -> None:
        """Tell of a state; HpcdemError if the earlier run had another one. The same on all ranks."""
        self.log.info(line(step, model, parts))
        before = None if self.expected is None else self.expected.get((model, step))
        if before is None:
            return
        different = [name for name in parts if before.get(name) != parts[name]]
        if different:
            raise HpcdemError(
                f"step {step} is the first that differs from {self.source}: different {', '.join(different)} "
                f"(compared every {self.every} steps; {self.compared} states before it were equal)"
            )
        self.compared += 1

    def close(self) -> None:
        """The end of the run: say what was compared."""
        if self.expected is None:
            return
        if self.compared:
            self.log.info(f"reproducible: {self.compared} states agree with {self.source}")
        else:
            self.log.warn(
                f"no state in {self.source} has a step of this run: check that its steps are multiples of {self.every}"
            )
