"""Histories: numbers that are recorded while the model runs, in memory and in `history_<name>.csv`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hpcdem.commands.fdem.choices import chosen, everything, places
from hpcdem.commands.fdem.needed import needed
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.recorded import LAW_STATE, MODEL, UNITS, WELL
from hpcdem.commands.fdem.records import ENERGIES, History
from hpcdem.commands.fdem.values import history_name, result_name
from hpcdem.core.deprecated import present_history
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import quoted
from hpcdem.core.units import label
from hpcdem.io.agreed import make_folder
from hpcdem.io.columns import append_rows
from hpcdem.io.files import write_sections
from hpcdem.physics import supports
from hpcdem.physics.fdem import diagnostics, user_laws
from hpcdem.physics.fdem.connectivity import nearest_point
from hpcdem.physics.fdem.groups import ELEMENT, FLOW, JOINT, NODE, SUPPORTS, Ids, Range
from hpcdem.physics.fdem.sides import SIDE
from hpcdem.physics.flow.model import Flow

IN_SPACE = tuple(name for name in UNITS[MODEL] if name != "disc_work")
"""Quantities of the model that a history can record in three dimensions."""
ON_IT = 1e-6
"""Distance over the size of the model within which a position coincides with a node and selects all its sides."""
FLUSH = 500
"""Largest number of records kept in memory before they are written."""


def create(
    project: Project,
    name: str,
    kind: str,
    value: str,
    id: int | None = None,
    nearest: tuple[float, ...] | None = None,
    how: str = "",
    every: int = 1,
    where: Range | None = None,
    variable: str = "",
    well: str = "",
) -> None:
    """Record a quantity at an interval of steps: of one object (by number, or the object nearest to a point [m]); of
    the objects of a range, or all (how: sum, mean, minimum, maximum); of a well, by its name; or of the model.
    variable: for the value law_state, a state variable of user laws.
    """
    history_name(name)
    if name in project.histories:
        raise CommandError(f"history '{name}' exists already")
    if value not in UNITS.get(kind, {}):
        raise CommandError(f"a history of {kind} can follow {', '.join(UNITS.get(kind, {}))}, not {value}")
    if value in ENERGIES and project.blocks.budget is None:
        raise CommandError("no energy budget yet: use model option energy on first")
    if (value == LAW_STATE) != bool(variable):
        raise CommandError("value law-state and variable, the name of a state variable, are both required")
    if variable:
        value = user_laws.quantity(project.ready(), variable)
    if (kind == WELL) != bool(well):
        raise CommandError("object well and well, its name, are both required")
    if well:
        needed(project, Flow).well(well)
    numbers = [] if kind in (MODEL, WELL) else _followed(project, kind, id, nearest, where).tolist()
    _check_value(project, kind, value)
    if kind == JOINT and value in diagnostics.QUANTITIES:
        _warn_of_nothing(project, name, value, numbers)
    project.histories[name] = History(kind, value, numbers, well or how, every, dim=project.dim)


def _followed(
    project: Project, kind: str, ident: int | None, nearest: tuple[float, ...] | None, where: Range | None
) -> np.ndarray:
    """Numbers of the objects that a history follows."""
    if nearest is not None and ident is None:
        return np.array([_nearest(project, kind, nearest)])
    found = chosen(project, kind, where if ident is None else (Ids(ident, ident),))
    # Without a range: those count that are there at the moment.
    return everything(project, kind, None, null_too=True) if found is None else found


def _check_value(project: Project, kind: str, value: str) -> None:
    """CommandError if the model has no such quantity."""
    if kind == MODEL and project.dim == 3 and value not in IN_SPACE:
        raise CommandError(f"in three dimensions a history of the model can follow {', '.join(IN_SPACE)}, not {value}")
    if kind in (ELEMENT, NODE, JOINT) and value in diagnostics.QUANTITIES:
        diagnostics.quantity(project.ready(use=False), value)
    if kind in SUPPORTS:
        supports.of(project.ready(use=False), kind).check(kind, value)


def _warn_of_nothing(project: Project, name: str, value: str, joints: Sequence[int]) -> None:
    """Warn if none of these joints has this quantity so far."""
    blocks, at = project.blocks, np.array(joints, np.int64)
    there = (blocks.joint_row[at] > 0) | (blocks.open[at] & (value in ("opening", "slip")))
    if len(at) and not there.any() and project.log is not None:
        which = f"joint {at[0]} has" if len(at) == 1 else f"none of the {len(at)} joints has"
        project.log.warn(
            f"history '{name}': {which} a model, so {value.replace('_', '-')} is nan until face-joint c-model assigns "
            "one" + (" (of cracks opening and slip are known)" if blocks.open[at].any() else "")
        )


def _nearest(project: Project, kind: str, at: tuple[float, ...]) -> int:
    if len(at) != project.whole_mesh().dim:
        raise CommandError(f"nearest needs a vector of {project.whole_mesh().dim} numbers, got {len(at)}")
    if kind in SUPPORTS or kind in FLOW:
        numbers, middles = everything(project, kind, None), places(project, kind)
        return int(numbers[nearest_point(middles, at)])
    mesh, xy = project.whole_mesh(), project.positions()
    if kind == NODE:
        return _nearest_side(project, at)
    if kind == ELEMENT:
        return mesh.nearest_element(xy, mesh.cells, at, np.flatnonzero(project.alive))
    edges = project.edges()
    inner = np.flatnonzero(edges.inner)
    inner = inner[~mesh.inside_macros(edges.faces[inner, 0])]
    middles = xy[edges.points[inner]].mean(axis=1)
    there = np.flatnonzero(~np.isnan(middles[:, 0]))
    if not len(there):
        raise CommandError("the mesh has no joints: no edge lies between two elements")
    return int(edges.faces[inner, 0][nearest_point(middles, at, there)])


def _nearest_side(project: Project, at: tuple[float, ...]) -> int:
    """The node nearest to a point [m]. Where elements may part, of the sides that are as near that of the element that
    is nearest, or all of them if that is none more than another."""
    node = project.ready(use=False).clusters()[0].reshape(-1)
    mesh, corners = project.whole_mesh(), project.corner_positions()
    cells, there = mesh.cells.reshape(-1), np.flatnonzero(~np.isnan(corners[:, 0]) & (node >= 0))
    far = np.linalg.norm(corners[there] - np.asarray(at, np.float64), axis=1)
    point = int(cells[there[far == far.min()]].min())
    beside = there[cells[there] == point]
    on_it = far[cells[there] == point] <= ON_IT * float(np.ptp(mesh.points, axis=0).max())
    if len(np.unique(node[beside])) == 1 or len(np.unique(node[beside[on_it]])) > 1:
        return point
    own = 4 * (beside // 4)[:, None] + np.arange(4)
    own = np.where(cells[own] >= 0, own, -1)
    return SIDE + int(beside[mesh.nearest_element(corners, own, at, np.arange(len(own)))])


def delete(project: Project, name: str) -> None:
    """End a history. Its file is kept."""
    find(project, name)
    flush(project)
    del project.histories[named(project, name)]


def find(project: Project, name: str) -> History:
    """Return a history by its name. Raises CommandError if missing."""
    return project.histories[named(project, name)]


def named(project: Project, name: str) -> str:
    """Return the present name of a history. Raises CommandError if missing."""
    present = present_history(name, project.histories)
    if present != name and project.log is not None:
        project.log.warn_once(f"history {name}", f"history '{name}' is deprecated: use '{present}'")
    if present not in project.histories:
        raise CommandError(f"there is no history '{name}'; available: {quoted(project.histories)}")
    return present


def record(project: Project, goes_on: bool = False) -> None:
    """Record what is due at this step. goes_on: steps follow in this command, see `History.record`. Collective."""
    blocks = project.blocks
    waiting = 0
    with blocks.timers.around("history"), blocks.one_moment():
        for history in project.histories.values():
            history.take(blocks)
            if project.count % history.every == 0:
                history.record(blocks, goes_on)
            waiting = max(waiting, len(history.rows) - history.filed)
    if waiting >= FLUSH:
        _write(project)


def wait(project: Project) -> bool:
    """Return whether records of this step need the forces of the next one."""
    return any(history.waits for history in project.histories.values())


def flush(project: Project) -> None:
    """Write the records to the files `history_<name>.csv` in the output folder. Collective."""
    blocks = project.blocks
    if wait(project):
        with blocks.timers.around("history"), blocks.one_moment():
            for history in project.histories.values():
                history.take(blocks)
    _write(project)


def _write(project: Project) -> None:
    for name, history in project.histories.items():
        new = history.rows[history.filed :]
        if not new:
            continue
        path = project.folder() / f"history_{history_name(name)}.csv"
        header = f"step,time [s],{history.value} [{label(project.units, history.unit)}]"
        if not history.filed:  # a new model, or a restored one: the file holds what is in memory, no more
            append_rows(path, header, [_line(row) for row in history.rows], 0, project.comm)
        else:
            append_rows(path, header, [_line(row) for row in new], None, project.comm)
        history.filed = len(history.rows)


def _line(row: Sequence[float]) -> str:
    return ",".join(repr(number) for number in row)


def export(project: Project, file: str, names: Sequence[str] = ()) -> None:
    """Write histories as columns of one CSV file in the output folder: step, time, one column each, empty without a
    record. Collective.
    """
    result_name(file)
    wanted = {name: find(project, name) for name in names} or project.histories
    if not wanted:
        raise CommandError("no histories to write")
    by_step: dict[int, dict[str, float]] = {}
    times: dict[int, float] = {}
    for name, history in wanted.items():
        for step, time, value in history.rows:
            times[step] = time
            by_step.setdefault(step, {})[name] = value
    titles = [_quoted(f"{name} {h.value} [{label(project.units, h.unit)}]") for name, h in wanted.items()]
    lines = [",".join(["step", "time [s]", *titles])]
    for step in sorted(by_step):
        cells = [repr(by_step[step][name]) if name in by_step[step] else "" for name in wanted]
        lines.append(",".join([str(step), repr(times[step]), *cells]))
    path = project.to_write(project.result(file))
    project.folder()
    make_folder(path.parent, project.comm)
    write_sections(path, project.comm, lambda: [("\n".join(lines) + "\n").encode()])


def _quoted(title: str) -> str:
    doubled = title.replace('"', '""')
    return f'"{doubled}"' if any(char in title for char in ',"') else title
