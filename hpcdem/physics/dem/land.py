"""A surface process of SURFACE: its settings, and what it did so far. Equal on all ranks, part of every checkpoint.

Areas are whole numbers of `unit`, so sums are exact. The area of a disc is bulk area: pi r^2 / (1 - porosity).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

FINEST = 2.0**-24
"""Unit of areas over the area of the smallest disc."""


@dataclass
class Land:
    """Lengths in m, rates in m/s, diffusion in m2/s of the model; None: not active. rise: of the levels.

    every: steps between two applications; x: the range, None: as far as the ground reaches; only: groups that erosion
    may remove, () all; material: row of the deposit; episode: steps with one group, 0: one group for all; begun: step
    of the command; last, since: times of the last application and of the command [s]; stream: of random numbers; unit
    [m2]: of all areas below.

    owed: by number of column, the area that the process demands and whole discs have not yet met (negative: erosion);
    settling: ids, areas and radii of discs that are not yet at rest; drawn: discs made; eroded, deposited, lost: areas
    of discs removed, at rest, and gone otherwise before they were at rest, with their numbers and masses [kg].

    compact: porosity of the sediment at the surface, and the depth [m] at which it is smaller by e, or None; made:
    first id and the one after the last of the discs of each application; levels: by id, compaction of a disc, if any;
    compacted: area that discs lost by it.
    """

    every: int
    x: tuple[float, float] | None
    spacing: float
    diffuse: float | None
    slope: float | None
    erode: float | None
    above: float | None
    deposit: float | None
    below: float | None
    rise: float
    only: tuple[str, ...]
    rad: tuple[float, ...]
    porosity: float
    group: str
    episode: int
    colors: tuple[int, ...]
    material: int
    begun: int
    last: float
    since: float
    stream: int
    unit: float
    owed: dict[int, int] = field(default_factory=dict)
    settling: list[tuple[int, int, float]] = field(default_factory=list)
    drawn: int = 0
    eroded: list[float] = field(default_factory=lambda: [0, 0, 0.0])
    deposited: list[float] = field(default_factory=lambda: [0, 0, 0.0])
    lost: list[float] = field(default_factory=lambda: [0, 0, 0.0])
    asked: int = 0
    compact: tuple[float, float] | None = None
    made: list[tuple[int, int]] = field(default_factory=list)
    levels: dict[int, int] = field(default_factory=dict)
    compacted: int = 0

    @property
    def erodes(self) -> bool:
        """Return whether it can remove discs."""
        return any(value is not None for value in (self.diffuse, self.slope, self.erode, self.above))

    def after(self, earlier: Land) -> Land:
        """Return this process as the continuation of the one with its id that it replaces: with the budget, the discs
        and the random numbers of that one, and its episodes if these are unchanged."""
        same = (self.group, self.episode) == (earlier.group, earlier.episode)
        scale = earlier.spacing / self.spacing
        owed: dict[int, int] = {}
        for column, area in earlier.owed.items():
            at = math.floor((column + 0.5) * scale)
            owed[at] = owed.get(at, 0) + area
        budget = {
            name: getattr(earlier, name)
            for name in ("unit", "last", "stream", "drawn", "settling", "eroded", "deposited", "lost", "asked", "made",
                         "levels", "compacted")
        }  # fmt: skip
        begun, material = earlier.begun if same else self.begun, self.material if self.rad else earlier.material
        return dataclasses.replace(self, **budget, owed=owed, begun=begun, material=material)

    @property
    def deposits(self) -> bool:
        """Return whether it can make discs."""
        return bool(self.rad)

    def made_disc(self, gid: int) -> bool:
        """Return whether it deposited a disc of this id, present or eroded."""
        return any(first <= gid < end for first, end in self.made)

    def units(self, area: float) -> int:
        """Bulk area [m2] as a whole number of units."""
        return round(area / self.unit)

    def of_disc(self, radius: float) -> int:
        """Bulk area of a disc, in units."""
        return self.units(math.pi * radius * radius / (1.0 - self.porosity))

    def episode_at(self, step: int) -> int:
        """Number of the episode to which the deposit of a step belongs, from 0."""
        return max(step - self.begun - 1, 0) // self.episode if self.episode else 0

    def group_at(self, step: int) -> str:
        """Group of the deposit of a step."""
        return f"{self.group}{self.episode_at(step) + 1}" if self.episode else self.group

    def color_at(self, step: int) -> int:
        """Colour of the deposit of a step."""
        return self.colors[self.episode_at(step) % len(self.colors)]

    def state(self) -> dict[str, Any]:
        """JSON values of all fields."""
        return {**dataclasses.asdict(self), "owed": sorted(self.owed.items()), "levels": sorted(self.levels.items())}

    @staticmethod
    def restored(state: dict[str, Any]) -> Land:
        """Inverse of `state`."""
        tuples = {name: tuple(state[name]) for name in ("only", "rad", "colors")}
        x = None if state["x"] is None else tuple(state["x"])
        owed = {int(k): int(v) for k, v in state["owed"]}
        more = {
            "compact": tuple(state["compact"]) if state.get("compact") else None,
            "made": [(int(first), int(end)) for first, end in state.get("made", [])],
            "levels": {int(gid): int(level) for gid, level in state.get("levels", [])},
        }
        settling = [(int(gid), int(area), float(r)) for gid, area, r in state["settling"]]
        return Land(**{**state, **tuples, "x": x, "owed": owed, "settling": settling, **more})


def smallest_unit(radius: float) -> float:
    """Unit of areas [m2] of a model with discs of this smallest radius."""
    return math.pi * radius * radius * FINEST


def carried_over(owed: dict[int, int], first: int, n: int) -> np.ndarray:
    """Areas owed (n,) i8 of the columns from `first` on; those of columns outside belong to the outermost ones."""
    found = np.zeros(n, np.int64)
    for column, area in owed.items():
        found[min(max(column - first, 0), n - 1)] += area
    return found
