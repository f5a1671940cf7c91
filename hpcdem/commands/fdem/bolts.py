"""Rock bolts: where they are, what is prescribed at their nodes. The rest is that of all supports (supports.py)."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.commands.fdem import supports
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts import kernels
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem.groups import BOLT_ELEMENT, BOLT_NODE, DEFAULT, Range

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
    """Install a bolt, as things are now, see `Bolts.create`; group: that its elements and nodes are put into."""
    blocks = project.ready()
    known = Bolts.there(blocks)
    bolts = Bolts.of(blocks)
    try:
        nodes, elements = bolts.create(points, segments, length, grout, plate)
    except CommandError:
        if known is None:
            blocks.surface_loads.remove(bolts)
        raise
    if group is not None:
        project.groups[BOLT_NODE].assign(nodes, group, set_name)
        project.groups[BOLT_ELEMENT].assign(elements, group, set_name)


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
    """Velocity [m/s] or acceleration [m/s2] of nodes of bolts; a text is the name of a table of time."""
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
    """Force [N] on each of these nodes of one bolt."""
    given = {"force_x": fx, "force_y": fy, "force_z": fz}
    changes = {name: value for name, value in given.items() if value is not None}
    supports.condition(project, BOLT_NODE, changes, where)
