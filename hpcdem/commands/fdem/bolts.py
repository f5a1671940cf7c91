"""Rock bolts: where they are, what is prescribed at their nodes. The rest is that of all supports (supports.py)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hpcdem.commands.fdem import supports
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.needed import begun
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts import kernels, layout
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.groups import BOLT_ELEMENT, BOLT_NODE, DEFAULT, ELEMENT, Range

SIZE = 0.2
"""Default length of elements of a bolt between two points [m]."""
Number = float | str
"""A number, or the name of a table of time."""


def create(
    project: Project,
    points: Sequence[Sequence[float]],
    segments: int | None = None,
    length: float | None = None,
    grout: tuple[float, float] | None = None,
    plate: bool = False,
    group: str | None = None,
    set_name: str = DEFAULT,
) -> None:
    """Install a bolt at the present positions, see `Bolts.create`. group: group of its elements and nodes."""
    with begun(project, Bolts) as bolts:
        nodes, elements = bolts.create(points, segments, length, grout, plate)
    supports.put_into(project, group, set_name, {BOLT_NODE: nodes, BOLT_ELEMENT: elements})


def between(
    project: Project,
    first: Sequence[float],
    second: Sequence[float],
    mesh_size: float = SIZE,
    group: str | None = None,
    set_name: str = DEFAULT,
    where: Range | None = None,
) -> None:
    """Install a bolt between two points [m], with elements no longer than mesh_size [m], in each segment inside the
    selected elements. Raises CommandError if no segment lies inside them.
    """
    blocks = project.ready()
    alive = np.zeros(len(blocks.alive), bool)
    alive[everything(project, ELEMENT, where)] = True
    line = layout.checked([first, second], blocks.dim)
    cells = blocks.the_mesh().cells
    corners = diagnostics.corner_values(blocks, "position").reshape(-1, 4, blocks.dim)
    pieces = layout.inside(line[0], line[1], corners, cells, alive)
    if not len(pieces):
        raise CommandError("no part of the bolt lies in the rock")
    for ends in pieces:
        create(project, ends.tolist(), length=mesh_size, group=group, set_name=set_name)
    left = float(layout.lengths(pieces[:, 1] - pieces[:, 0]).sum())
    whole = float(layout.lengths((line[1] - line[0])[None])[0])
    if project.log is not None and left < whole * (1.0 - 1e-9):
        project.log.info(f"bolt: {whole - left:g} of {whole:g} m lie outside the rock and were removed")


def velocity(
    project: Project,
    vx: Number | None = None,
    vy: Number | None = None,
    ax: Number | None = None,
    ay: Number | None = None,
    vz: Number | None = None,
    az: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe velocity [m/s] or acceleration [m/s2] of bolt nodes; a string is the name of a table of time."""
    changes: dict[str, Number] = {}
    for axis, speed, push in (("x", vx, ax), ("y", vy, ay), ("z", vz, az)):
        if speed is not None and push is not None:
            raise CommandError(f"velocity and acceleration in {axis} cannot both be prescribed")
        if speed is not None:
            changes[f"does_{axis}"], changes[f"at_{axis}"] = kernels.VELOCITY, speed
        if push is not None:
            changes[f"does_{axis}"], changes[f"at_{axis}"] = kernels.ACCELERATION, push
    supports.condition(project, BOLT_NODE, changes, where)


def force(
    project: Project,
    fx: Number | None = None,
    fy: Number | None = None,
    fz: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe the force on each bolt node [N]."""
    given = {"force_x": fx, "force_y": fy, "force_z": fz}
    changes = {name: value for name, value in given.items() if value is not None}
    supports.condition(project, BOLT_NODE, changes, where)
