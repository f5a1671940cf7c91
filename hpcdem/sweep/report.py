"""`hpcdem sweep report`: every member that is done is measured, and all of them are put beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import on_first
from hpcdem.io.frames import list_frames, list_mesh_frames
from hpcdem.io.run_record import RECORD
from hpcdem.post.measure import emission
from hpcdem.post.measure import figures as pages
from hpcdem.post.measure import report as measures
from hpcdem.post.measure.scene import Request
from hpcdem.sweep import figures, tables
from hpcdem.sweep.plan import DONE, Member, Plan
from hpcdem.sweep.tables import Report


class _Quiet:
    """A log of the measurements of each member, of which only warnings are shown."""

    def __init__(self, log: Any, name: str) -> None:
        self.log, self.name = log, name

    def info(self, text: str) -> None:
        """Said of each member alike."""

    def warn(self, text: str) -> None:
        """Log a warning with the name of the member."""
        self.log.warn(f"{self.name}: {text}")


def run(comm: Comm, log: Any, plan: Plan, request: Request, kinds: Sequence[str] = ("csv",)) -> Report:
    """Collective: measure as asked, write tables and figures into `report` of the sweep's folder (or request.output),
    and return the tables (on rank 0; empty elsewhere). Raises HpcdemError where no member is done."""
    on_first(comm, lambda: tables.check(kinds))
    for what in request.what:
        if what in tables.APART:
            raise UsageError(
                f"{what}: a sweep does not support paths of single particles, which differ between members"
            )
    members = on_first(comm, lambda: _done(plan, log))
    found = []
    for member in members:
        data = on_first(comm, lambda: data_folder(member))  # noqa: B023
        target = member.folder / "measure"
        one = replace(request, folder=data, output=target, formats=())
        on_first(comm, lambda: _cleared(target))  # noqa: B023
        frames = on_first(comm, lambda: _frames_in(data))  # noqa: B023
        if request.what or frames:
            measures.run(comm, _Quiet(log, member.name), one, without=tables.APART)
        else:
            on_first(comm, lambda: log.warn(f"{member.name}: no frames to measure; using its histories only"))  # noqa: B023
        found.append(on_first(comm, lambda: tables.measured(target, data)))  # noqa: B023
    return on_first(comm, lambda: _written(log, plan, request, kinds, members, found))


def _done(plan: Plan, log: Any) -> list[Member]:
    states = [(member, member.state) for member in plan.members]
    members = [member for member, state in states if state == DONE]
    left = [f"{member.name} {state}" for member, state in states if state != DONE]
    if not members:
        raise HpcdemError(f"{plan.folder}: no member is done: {', '.join(left[:10])}")
    if left:
        log.warn(
            f"{len(left)} of {len(plan.members)} members are unfinished and not in the report: {', '.join(left[:10])}"
        )
    return members


def _cleared(folder: Path) -> None:
    """Tables of an earlier report are no part of this one."""
    for path in folder.glob("*.csv"):
        path.unlink()


def _frames_in(data: Path) -> bool:
    """Return whether the folder contains more than histories to measure."""
    return bool(list_frames(data) or list_mesh_frames(data) or (data / emission.TABLE).is_file())


def data_folder(member: Member) -> Path:
    """The folder of a member's results. HpcdemError without results, or if several folders have some."""
    found = sorted(path.parent for path in member.folder.rglob(RECORD))
    if not found:
        raise HpcdemError(f"{member.folder}: no results ({RECORD} not found)")
    if len(found) > 1:
        names = ", ".join(str(path.relative_to(member.folder)) for path in found)
        raise HpcdemError(
            f"{member.folder}: results are in several folders ({names}). The script of a sweep must write into one"
        )
    return found[0]


def _written(
    log: Any, plan: Plan, request: Request, kinds: Sequence[str], members: list[Member], found: list[Any]
) -> Report:
    folder = plan.folder / "report" if request.output is None else request.output
    folder.mkdir(parents=True, exist_ok=True)
    report = tables.collect(members, found, folder)
    paths = []
    for name, table in tables.sheets(report).items():
        if table:
            paths += tables.write(folder, name, table, kinds)
    if request.formats:
        for name, figure in figures.all_of(report):
            paths += [pages.save(figure, folder / f"{name}.{suffix}") for suffix in request.formats]
    log.info(f"{folder}: {len(members)} members, {len(paths)} files: {', '.join(path.name for path in paths)}")
    return report
