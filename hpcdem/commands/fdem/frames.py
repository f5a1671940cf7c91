"""output vtk: frames of the model for ParaView.

Those that are due while the model is stepped are written asynchronously, as those of particles are
(commands/dem/output.py): the next step with frames, a checkpoint and the end of the command wait for them; errors of
the disk stop all ranks there, or at the next line of the log.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hpcdem.commands.fdem import frame_tables
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.values import frames_name
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import quoted
from hpcdem.core.units import declared
from hpcdem.io import vtkhdf_mesh
from hpcdem.io.behind import Deliveries, under_way
from hpcdem.io.frame import Table
from hpcdem.io.slabs import to_slabs
from hpcdem.io.vtkhdf_mesh import MeshFrame, MeshState, write_mesh_frame
from hpcdem.physics import supports
from hpcdem.physics.fdem import diagnostics, readiness, user_laws
from hpcdem.physics.fdem.diagnostics import JOINT_SIZE, PROPERTIES, QUANTITIES
from hpcdem.physics.fdem.groups import CHANNEL, ELEMENT, JOINT
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fields import kinds
from hpcdem.physics.flow.model import Flow


def vtk(project: Project, file: str, every: int | None = None, off: bool = False) -> None:
    """Write `<file>_<step>.vtkhdf` into the output folder, now or every so many steps; off: end the frames of this
    name. Collective.
    """
    if off:
        if file not in project.frames:
            known = quoted(project.frames, "none")
            raise CommandError(f"there are no frames '{file}' to stop; available: {known}")
        del project.frames[file]
        return
    frames_name(file)
    if every is None:
        project.ready(use=False)
        _write(project, file)
    else:
        project.frames[file] = every


def write_due(project: Project) -> None:
    """Write the frames that are due at this step, once each; `settle` waits for them. Collective."""
    due = [
        name for name, every in project.frames.items()
        if project.count % every == 0 and project.framed.get(name) != project.step
    ]  # fmt: skip
    if not due:
        return
    if not _particles_just_wrote(project):
        settle(project)
    for name in due:
        _write(project, name, under_way)
    under_way.go()


def settle(project: Project) -> None:
    """Wait until all files are complete. Raises HpcdemError on all ranks if one could not be written."""
    with project.blocks.timers.around("output"):
        under_way.settle(project.comm)


def _particles_just_wrote(project: Project) -> bool:
    """Return whether the particles of a coupled model have just written the frame of this step."""
    both = project.coupled
    return both is not None and both.particles.last_frame == (both.particles.clock.step, False)


def write_last(project: Project) -> None:
    """Write a frame of each name of an invalid state for inspection. Collective."""
    with np.errstate(all="ignore"):
        for name in project.frames:
            _write(project, name, sound=False)


def _write(project: Project, name: str, later: Deliveries | None = None, sound: bool = True) -> None:
    path, comm = project.folder() / f"{name}_{project.step:010d}.vtkhdf", project.comm
    with project.blocks.timers.around("output"):
        if later is None:
            write_mesh_frame(path, frame(project, sound), comm)
        else:
            moment = _kept(frame(project))
            if comm.size == 1:
                later.entrust(lambda: write_mesh_frame(path, moment, comm))
            else:
                write_mesh_frame(path, moment, comm, later)
    project.framed[name] = project.step


def _kept(moment: MeshFrame) -> MeshFrame:
    """A copy of a frame with its own arrays, as the model continues."""

    def own(table: Table) -> Table:
        return Table({name: np.array(values) for name, values in table.columns.items()}, table.offset, table.total)

    return replace(
        moment, corners=own(moment.corners), elements=own(moment.elements), joints=own(moment.joints),
        tables={name: own(table) for name, table in moment.tables.items()},
    )  # fmt: skip


def whole(project: Project) -> MeshState | None:
    """Return the present state as a frame, on rank 0. Collective."""
    return vtkhdf_mesh.whole(frame(project), project.comm)


_OF_FIELDS = {f"mean_{name}": name for name in diagnostics.DIFFUSING} | {
    name: one.name for one in kinds().values() for name in one.derived
}
"""Quantities that are there with columns of a field, and their names."""


def _names(blocks: Blocks, kind: str) -> list[str]:
    """Select the columns of elements or joints: without positions, which the points contain, and without integration
    points of joints; properties only if a table or a field makes them differ between objects; plastic flow and creep
    only if elements can yield or creep; all state variables of user laws."""
    yields = "plastic" in blocks.cold or bool(blocks.yielding().any())
    creeps = "creep" in blocks.cold or bool(blocks.creeping().any())
    varied = {name for on, name in blocks.varied if on == {"joint": JOINT}.get(kind, kind)}
    return [
        name for name, quantity in QUANTITIES.items()
        if quantity.on == kind and blocks.dim in quantity.dims
        and (quantity.framed or PROPERTIES[kind].get(name) in varied)
        and (yields or not name.startswith("plastic_")) and (creeps or not name.startswith(("creep_", "kelvin_")))
        and (name not in _OF_FIELDS or _OF_FIELDS[name] in blocks.cold)
    ] + (user_laws.quantities(blocks) if kind == ELEMENT else [])  # fmt: skip


def _corners(blocks: Blocks) -> dict[str, np.ndarray]:
    """Return the columns of every corner of this rank's elements, with its node: corners at broken joints differ."""
    axes = "xyz"[: blocks.dim]
    vectors = [f"{name}_{axis}" for name in ("position", "displacement", "velocity") for axis in axes]
    fields = [name for name in diagnostics.DIFFUSING if name in blocks.cold]
    columns = diagnostics.owned_values(blocks, "corner", vectors + fields)
    columns["node"] = blocks.the_mesh().cells[columns["number"] // 4, columns["number"] % 4].astype(np.int64)
    places = {f"position_{axis}": axis for axis in axes}
    return {places.get(name, name): values for name, values in columns.items()}


def _with_cracks(blocks: Blocks, elements: np.ndarray, joints: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Joints, and the open edges beside this rank's elements that have no cohesive model: cracks from the beginning, of
    state 0."""
    mesh = blocks.the_mesh()
    faces = (4 * elements[:, None] + np.arange(4)).reshape(-1)
    beside = blocks.partner[faces]
    cracks = faces[(beside > faces) & blocks.open[faces] & (blocks.joint_row[faces] == 0) & blocks.alive[beside // 4]]
    known = {"number": cracks, "state": np.zeros(len(cracks)), "mode": np.zeros(len(cracks)),
             JOINT_SIZE[mesh.dim]: mesh.face_sizes(cracks)}  # fmt: skip
    nothing = np.full(len(cracks), np.nan)
    return {name: np.concatenate([values, known.get(name, nothing)]) for name, values in joints.items()}


FLUID = {
    "fluid_pressure": "pressure", "saturation": "saturation", "aperture": "aperture", "flow_rate": "flow_rate",
    "fluid_velocity": "velocity",
}  # fmt: skip
"""Columns of joints that are channels, and the quantities of channels in them."""
OF_OTHERS = {
    "fluid_temperature": "temperature",
    "proppant_concentration": "concentration",
    "pack_pressure": "pack_pressure",
}
"""Quantities of further physics, by object."""


def _with_channels(blocks: Blocks, joints: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Joints with the fluid in them, NaN where missing; and the channels between elements that are connected
    without a cohesive model, of state 1."""
    flow = Flow.there(blocks)
    if flow is None or not len(flow.network.channels):
        return joints
    mesh = blocks.the_mesh()
    columns = FLUID | {column: name for column, name in OF_OTHERS.items() if name in flow.more}
    fluid = flow.owned_values(CHANNEL, list(columns.values()))
    new = np.setdiff1d(fluid["number"], joints["number"])
    known = {"number": new, "state": np.ones(len(new)), "mode": np.zeros(len(new)),
             JOINT_SIZE[mesh.dim]: mesh.face_sizes(new)}  # fmt: skip
    nothing = np.full(len(new), np.nan)
    found = {name: np.concatenate([values, known.get(name, nothing)]) for name, values in joints.items()}
    order = np.argsort(found["number"])
    at = order[np.searchsorted(found["number"][order], fluid["number"])]
    for column, name in columns.items():
        found[column] = np.full(len(found["number"]), np.nan)
        found[column][at] = fluid[name]
    return found


def _with_groups(project: Project, elements: dict[str, np.ndarray]) -> dict[str, list[str]]:
    """Give elements a column for each set of groups, and how many corners they have; the names of the groups."""
    mesh = project.whole_mesh()
    if project.hidden.any():
        elements["hidden"] = project.hidden[elements["number"]].astype(np.int32)
    elements["corners"] = np.where(mesh.cells[elements["number"], 3] >= 0, 4, 3)
    names: dict[str, list[str]] = {}
    for set_name, groups in project.groups[ELEMENT].sets.items():
        column = f"group_{set_name}"
        code = np.full(len(mesh.cells), -1, np.int32)
        for k, members in enumerate(groups.values()):
            code[members] = k
        elements[column] = code[elements["number"]]
        names[column] = list(groups)
    return names


def _of_mesh(project: Project) -> MeshFrame:
    """The mesh with its groups and cracks, of which each rank has an equal share of the elements. Collective."""
    blocks, comm, mesh = project.blocks, project.comm, project.whole_mesh()
    number = np.array_split(np.flatnonzero(blocks.alive), comm.size)[comm.rank]
    row, k = np.nonzero(mesh.cells[number] >= 0)
    node = mesh.cells[number[row], k].astype(np.int64)
    corners = {"number": 4 * number[row] + k} | dict(zip("xyz", mesh.points[node].T.copy())) | {"node": node}
    elements = {"number": number, {2: "area", 3: "volume"}[mesh.dim]: blocks.areas[number]}
    none = {name: np.zeros(0) for name in ("state", "mode", JOINT_SIZE[mesh.dim])}
    joints = _with_cracks(blocks, number, {"number": np.zeros(0, np.int64)} | none)
    names = _with_groups(project, elements)
    joints |= dict(zip(vtkhdf_mesh.CORNERS[mesh.dim], mesh.face_corners(joints["number"]).T.copy(), strict=True))
    of_corners, of_elements, of_joints = (to_slabs(comm, ("number",), c) for c in (corners, elements, joints))
    clock = blocks.clock
    return MeshFrame(
        int(clock.step), float(blocks.reported_time()), float(clock.dt), of_corners, of_elements, of_joints, names,
        units=declared(project.units),
    )  # fmt: skip


def frame(project: Project, sound: bool = True) -> MeshFrame:
    """Collect the quantities of a frame; before all elements have a model, only the mesh. sound: include forces between
    elements and on them. Collective.
    """
    blocks, comm, mesh = project.blocks, project.comm, project.whole_mesh()
    if len(readiness.bare(blocks)):
        return _of_mesh(project)
    with blocks.one_moment():
        corners = _corners(blocks)
        elements = diagnostics.owned_values(blocks, "element", _names(blocks, "element"))
        joints = _with_cracks(
            blocks, elements["number"], diagnostics.owned_values(blocks, "joint", _names(blocks, "joint"))
        )
        joints = _with_channels(blocks, joints)
        names = _with_groups(project, elements)
        joints |= dict(zip(vtkhdf_mesh.CORNERS[mesh.dim], mesh.face_corners(joints["number"]).T.copy(), strict=True))
        of_corners, of_elements, of_joints = (to_slabs(comm, ("number",), c) for c in (corners, elements, joints))
        clock = blocks.clock
        there = [found for one in supports.ALL if (found := one.there(blocks)) is not None]
        return MeshFrame(
            int(clock.step), float(blocks.reported_time()), float(clock.dt), of_corners, of_elements, of_joints, names,
            {found.name: found.columns() for found in there}, frame_tables.tables(blocks) if sound else {},
            declared(project.units),
        )  # fmt: skip
