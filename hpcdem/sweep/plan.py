"""The folder of a sweep: `sweep.json` says what its members are, `0007/state.json` how one of them ended.

A member that runs holds the lock of its folder, also when the process that started it is gone; what is neither locked
nor done can be started.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path
from hpcdem.io.lock import holder_of
from hpcdem.lang.parameters import Adjustable, Value

RECORD = "sweep.json"
STATE = "state.json"
PARAMETERS = "parameters.json"
LOG = "out.log"
DONE, FAILED, STOPPED, RUNNING, WAITING = "done", "failed", "stopped", "running", "waiting"


@dataclass(frozen=True)
class Member:
    """One run: its folder, and the values of its parameters."""

    folder: Path
    values: dict[str, Value]

    @property
    def name(self) -> str:
        """The number that its folder is called by."""
        return self.folder.name

    @property
    def state(self) -> str:
        """Return the state of the member on disk: DONE, FAILED, STOPPED, RUNNING or WAITING."""
        if holder_of(self.folder) is not None:
            return RUNNING
        return str(read_json(self.folder / STATE, {"state": WAITING})["state"])

    def label(self) -> str:
        """Return the name and values of the member for messages."""
        return f"{self.name} ({', '.join(f'{name}={value}' for name, value in self.values.items())})"


@dataclass
class Plan:
    """Plan of a sweep. script: name of the file in each member's folder; digest: of the script without other values;
    sampling: None, or method, number and seed, with `wanted` as given."""

    folder: Path
    script: str
    kind: str
    digest: str
    ranks: int = 1
    threads: int = 1
    sampling: list[Any] | None = None
    wanted: dict[str, Any] = field(default_factory=dict)
    values: list[dict[str, Value]] = field(default_factory=list)

    @property
    def members(self) -> list[Member]:
        """List all members in order."""
        return [Member(self.folder / f"{k:04d}", values) for k, values in enumerate(self.values)]

    def member(self, number: int) -> Member:
        """UsageError for an unknown number."""
        if not 0 <= number < len(self.values):
            raise UsageError(
                f"{self.folder} has no member {number}: its {len(self.values)} members are numbered from 0"
            )
        return self.members[number]


def make(
    folder: Path,
    script: Adjustable,
    values: Sequence[dict[str, Value]],
    wanted: Mapping[str, Any],
    sampling: list[Any] | None,
    ranks: int,
    threads: int,
    links: Sequence[Path] = (),
) -> tuple[Plan, int]:
    """The plan in a folder, with these members after those that are there already, and how many are new. links: files
    that the script reads, to be found in each member's folder. UsageError if the folder holds another sweep."""
    digest = hashlib.sha256(script.text).hexdigest()
    plan = Plan(folder, Path(script.file).name, script.kind, digest, ranks, threads, sampling, dict(wanted))
    if (folder / RECORD).exists():
        before = load(folder)
        _check_same(before, plan, list(values[0]))
        plan.values = list(before.values)
    elif folder.exists() and any(folder.iterdir()):
        raise UsageError(f"{folder} is not empty and contains no sweep: choose another folder with -o")
    new = [one for one in values if one not in plan.values]
    for link in links:
        if link.name in (RECORD, STATE, PARAMETERS, LOG, "data", plan.script):
            raise UsageError(f"--with {link.name}: each member writes a file of this name")
        if not link.exists():
            raise UsageError(f"--with {link}: there is no such file")
    plan.values += new
    for member in plan.members[len(plan.values) - len(new) :]:
        member.folder.mkdir(parents=True, exist_ok=True)
        (member.folder / plan.script).write_bytes(script.with_values(member.values))
        write_json(member.folder / PARAMETERS, member.values)
        for link in links:
            place = member.folder / link.name
            if not place.is_symlink():
                place.symlink_to(os.path.relpath(link.resolve(), member.folder.resolve()))
    about = asdict(plan)
    del about["folder"]
    write_json(folder / RECORD, about)  # last: a sweep whose creation was interrupted is made again
    return plan, len(new)


def _check_same(before: Plan, plan: Plan, names: list[str]) -> None:
    """UsageError if members of this plan, over parameters of these names, are none of the sweep that was before."""
    other = ""
    if (before.script, before.digest) != (plan.script, plan.digest):
        other = f"a sweep of a different version of {before.script}"
    elif plan.sampling is not None and (before.sampling, before.wanted) != (plan.sampling, plan.wanted):
        other = "samples of a different kind, number or range"
    elif before.sampling is not None and plan.sampling is None:
        other = "samples, to which a grid cannot be added"
    elif before.values and set(before.values[0]) != set(names):
        other = f"a sweep over {', '.join(before.values[0])}, not {', '.join(names)}"
    if other:
        raise UsageError(f"{plan.folder} contains {other}: choose another folder with -o")


def load(folder: Path) -> Plan:
    """The plan in a folder. UsageError without one."""
    given = read_json(folder / RECORD, None)
    if given is None:
        raise UsageError(f"{folder}: no sweep ({RECORD} not found)")
    try:
        plan = Plan(folder=folder, **given)
        whole = all(isinstance(number, int) and number > 0 for number in (plan.ranks, plan.threads))
        whole = whole and Path(plan.script).name == plan.script and not plan.script.startswith("-")  # it is started
    except TypeError:
        whole = False
    if not whole:
        raise HpcdemError(f"{folder / RECORD} was written by another version of hpcdem, or is damaged")
    return plan


def read_json(path: Path, absent: Any) -> Any:
    """HpcdemError for what is no JSON."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return absent
    except (OSError, ValueError) as problem:
        raise HpcdemError(f"{path} cannot be read: {problem}") from None


def write_json(path: Path, what: Any) -> None:
    """Whole or not at all."""
    with atomic_path(path) as temporary:
        Path(temporary).write_text(json.dumps(what, indent=1) + "\n", encoding="utf-8")
