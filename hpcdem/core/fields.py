"""Every quantity of a particle: where it is stored, its unit, its meaning. Allocation, halo, checkpoints, frames and
the Python API all read this table; a new field is one new row.

A particle is two rows of eight 8-byte words, one cache line each. The *hot* row contains what a contact needs of its
partner, and is sent to neighbours every step. The *cold* row stays with the owner. Integers are stored as int64 bits in
the same rows. Added physics (physics/particle_physics.py) store more columns in a third row, which is also sent to
neighbours.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

HOT, COLD, MORE = "hot", "cold", "more"
WIDTH = 8

# Columns of the hot row, for kernels.
X, Y, VX, VY, SPIN, RADIUS, MATERIAL, GID = range(8)
# Columns of the cold row.
ANGLE, FX, FY, TORQUE, FIX, GROUP, COLOR, BIRTH = range(8)

# Columns of a third row that particles have while there are clumps: the clump (int64; that is the gid of its first
# member, -1 for a free particle), its centre [m], velocity [m/s], spin [rad/s], angle [rad], area [m2] and polar second
# moment of area [m4], place of the member in the frame of the clump [m], number of members (int64). What all members of
# a clump share is equal to the last bit in all their rows.
CLUMP, CLUMP_X, CLUMP_Y, CLUMP_VX, CLUMP_VY, CLUMP_SPIN, CLUMP_ANGLE = range(7)
AREA, MOMENT, OFFSET_X, OFFSET_Y, MEMBERS = range(7, 12)
CLUMP_WIDTH = 12
FREE = -1

FIX_X, FIX_Y, FIX_SPIN = 1, 2, 4
FIX_BITS = {"x": FIX_X, "y": FIX_Y, "spin": FIX_SPIN}

BOX_IDS = {"bottom": 100, "right": 101, "top": 102, "left": 103}
"""Ids of the walls of BOX, in their order in frames: those of frames of ZDEM 2.2."""


def sides_of_box(ids: Iterable[int]) -> set[int]:
    """Return which walls of a file are those of BOX: BOX_IDS, or -1 to -4 in frames of earlier versions."""
    found = {int(i) for i in ids}
    old = {i for i in found if i < 0}
    return old or (set(BOX_IDS.values()) if found.issuperset(BOX_IDS.values()) else set())


@dataclass(frozen=True)
class Field:
    """One column of the particle table."""

    row: str
    column: int
    dtype: type
    unit: str
    doc: str
    initial: float = 0.0


FIELDS: dict[str, Field] = {
    "x": Field(HOT, X, np.float64, "m", "centre"),
    "y": Field(HOT, Y, np.float64, "m", "centre"),
    "vx": Field(HOT, VX, np.float64, "m/s", "velocity at the last half step"),
    "vy": Field(HOT, VY, np.float64, "m/s", "velocity at the last half step"),
    "spin": Field(HOT, SPIN, np.float64, "rad/s", "angular velocity, anticlockwise, at the last half step"),
    "radius": Field(HOT, RADIUS, np.float64, "m", "radius"),
    "material": Field(HOT, MATERIAL, np.int64, "1", "row of the material table"),
    "gid": Field(HOT, GID, np.int64, "1", "global id, never reused"),
    "angle": Field(COLD, ANGLE, np.float64, "rad", "rotation since birth"),
    "fx": Field(COLD, FX, np.float64, "N", "sum of contact and bond forces"),
    "fy": Field(COLD, FY, np.float64, "N", "sum of contact and bond forces"),
    "torque": Field(COLD, TORQUE, np.float64, "N m", "sum of contact and bond torques"),
    "fix": Field(COLD, FIX, np.int64, "1", "bits of the fixed degrees of freedom: 1 x, 2 y, 4 spin"),
    "group": Field(COLD, GROUP, np.int64, "1", "row of the group name table"),
    "color": Field(COLD, COLOR, np.int64, "1", "colour number 0-9"),
    "birth": Field(COLD, BIRTH, np.int64, "1", "step at which the particle was made"),
}

PER_METRE = {"N/m": "N", "J/m": "J", "N m/m": "N m", "m2/s": "m3/s", "kg/m": "kg"}
"""Units in the plane, where everything is that of a metre of thickness, and in space."""


def unit_in(unit: str, dim: int, content: bool = False) -> str:
    """Convert a unit of the plane to the given number of dimensions; content: m2 is a volume of fluid there."""
    units = {**PER_METRE, "m2": "m3"} if content else PER_METRE
    return units.get(unit, unit) if dim == 3 else unit
