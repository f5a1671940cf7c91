"""Liners: where they are, what is prescribed at their nodes. The rest is that of all supports (supports.py)."""

from __future__ import annotations

from hpcdem.commands.fdem import supports
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.needed import begun
from hpcdem.commands.fdem.project import Project
from hpcdem.physics.fdem.groups import DEFAULT, FACE, LINER_ELEMENT, LINER_NODE, Range
from hpcdem.physics.fdem.structures import VELOCITY
from hpcdem.physics.liners.model import Liners

Number = float | str
"""A number, or the name of a table of time."""


def create(project: Project, group: str | None = None, set_name: str = DEFAULT, where: Range | None = None) -> None:
    """Install a liner on the free faces of a range at their present positions, see `Liners.create`. group: group of its
    elements and nodes.
    """
    faces = everything(project, FACE, where)
    with begun(project, Liners) as liners:
        nodes, elements = liners.create(faces)
    supports.put_into(project, group, set_name, {LINER_NODE: nodes, LINER_ELEMENT: elements})


def velocity(
    project: Project,
    vx: Number | None = None,
    vy: Number | None = None,
    spin: Number | None = None,
    where: Range | None = None,
    vz: Number | None = None,
    spin_x: Number | None = None,
    spin_y: Number | None = None,
    spin_z: Number | None = None,
) -> None:
    """Prescribe velocity [m/s] and angular velocity [rad/s] of liner nodes, in the plane spin, in space about the axes;
    a string is the name of a table of time.
    """
    turn = spin if spin_z is None else spin_z
    given = {"x": vx, "y": vy, "z": vz, "turn_x": spin_x, "turn_y": spin_y, "turn": turn}
    changes: dict[str, Number] = {}
    for part, value in given.items():
        if value is not None:
            changes[f"does_{part}"], changes[f"at_{part}"] = VELOCITY, value
    supports.condition(project, LINER_NODE, changes, where)


def force(
    project: Project,
    fx: Number | None = None,
    fy: Number | None = None,
    moment: Number | None = None,
    where: Range | None = None,
    fz: Number | None = None,
    moment_x: Number | None = None,
    moment_y: Number | None = None,
    moment_z: Number | None = None,
) -> None:
    """Prescribe force [N/m] and moment [N m/m] on each liner node, in space [N] and [N m] about the axes."""
    about_z = moment if moment_z is None else moment_z
    given = {
        "force_x": fx, "force_y": fy, "force_z": fz, "moment_x": moment_x, "moment_y": moment_y, "moment": about_z,
    }  # fmt: skip
    changes = {name: value for name, value in given.items() if value is not None}
    supports.condition(project, LINER_NODE, changes, where)
