"""Sizes and positions that a model can have; others are rejected as obvious mistakes.

The language checks them while it reads a script, the commands check them again with the values at run time, so both
give the same message. All lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hpcdem.core.errors import CommandError

LARGEST = 1e60
"""Largest number accepted for any quantity: products of several remain within the range of a double."""
LONGEST, SHORTEST = 1e30, 1e-30
"""Bounds of lengths: squares and cubes remain within the range of a double."""
FARTHEST = 1e12
"""Largest coordinate of a particle in radii; a double resolves 1e-4 of the radius there."""
MOST = 10**8
"""Largest number of particles per command. GEN creates all of them on every rank; more do not fit a node of a
cluster."""
MOST_ATTEMPTS = 10**10
"""Largest number of attempts of one GEN, which take about half an hour."""

Point = Sequence[float]


def check_circle(x: float, y: float, r: float) -> None:
    """CommandError unless a particle can have this centre and radius."""
    if not (math.isfinite(x) and math.isfinite(y)):
        raise CommandError(f"the centre ({x:g}, {y:g}) is not a finite position")
    check_radius(r)
    if max(abs(x), abs(y)) > FARTHEST * r:
        raise CommandError(
            f"a particle of radius {r:g} m at ({x:g}, {y:g}) is too far from the origin for its size; at most "
            f"{FARTHEST:g} radii"
        )


def check_radius(r: float) -> None:
    """CommandError unless a particle can have this radius."""
    if not r > 0.0:
        raise CommandError(f"a radius must be positive, got {r:g}")
    if not SHORTEST <= r <= LONGEST:
        raise CommandError(f"a radius of {r:g} m is out of range ({SHORTEST:g} to {LONGEST:g})")


def check_nodes(p1: Point, p2: Point, name: str = "the wall") -> None:
    """CommandError unless a wall can have these ends."""
    if not all(abs(c) <= LONGEST for c in (*p1, *p2)):
        raise CommandError(f"the nodes of {name}, {_point(p1)} and {_point(p2)}, are out of range ({LONGEST:g} m)")
    if tuple(p1) == tuple(p2):
        raise CommandError(f"{name} has zero length: both nodes are {_point(p1)}")
    if math.dist(p1, p2) < SHORTEST:
        raise CommandError(f"{name} is {math.dist(p1, p2):g} m long, too short")


def check_rectangle(radii: Sequence[float], x: Point, y: Point, grid: bool) -> None:
    """CommandError unless GEN can fill this rectangle with these radii."""
    if not len(radii):
        raise CommandError("no radii given")
    for r in radii:
        check_radius(r)
    # A lattice is as wide as its largest particle; at random, the smaller ones may still find room.
    needed = 2.0 * (max(radii) if grid else min(radii))
    cells = 1.0
    for name, (low, high) in (("x", x), ("y", y)):
        if not max(abs(low), abs(high)) <= LONGEST:
            raise CommandError(f"the bounds of {name}, {low:g} and {high:g}, are out of range ({LONGEST:g} m)")
        if not high > low:
            raise CommandError(f"the rectangle is empty in {name}: {low:g} to {high:g}")
        if (high - low) * (1.0 + 1e-9) < needed:
            raise CommandError(
                f"the rectangle is {high - low:g} m in {name}, too narrow for a particle of radius {needed / 2:g}"
            )
        cells *= (high - low) / (2.0 * max(radii)) + 1.0
    if cells > MOST:
        raise CommandError(
            f"the rectangle {x[1] - x[0]:g} m x {y[1] - y[0]:g} m holds {cells:.2g} particles, at most {MOST:g} allowed"
        )


def check_attempts(num: int, factor: float) -> None:
    """CommandError if GEN num would try for hours."""
    if num * factor > MOST_ATTEMPTS:
        raise CommandError(
            f"{num:g} particles with {factor:g} attempts each require {num * factor:.2g} attempts, at most "
            f"{MOST_ATTEMPTS:g} allowed"
        )


def check_row(p1: Point, p2: Point, rad: float, cratio: float) -> None:
    """CommandError unless GLINE can make this row."""
    check_circle(p1[0], p1[1], rad)
    check_circle(p2[0], p2[1], rad)
    if not 0.0 < cratio <= 1.0:
        raise CommandError(f"cratio must lie in (0, 1], got {cratio:g}")
    n = math.dist(p1, p2) / (2.0 * rad * cratio) if rad * cratio > 0.0 else math.inf
    if n > MOST:
        raise CommandError(f"the row has {n:.2g} particles; at most {MOST:g}")


STEEPEST = 80.0
"""Largest angle [deg] to which a slope can be limited."""
PROCESSES = ("diffuse", "slope", "erode", "above", "deposit", "below")
OF_EROSION = ("id", "interval", "x", "spacing", "erode", "above", "rise", "years", "only", "porosity")
"""Options of SURFACE accepted without a deposit."""


def check_surface(given: Mapping[str, Any]) -> None:
    """CommandError unless these options of SURFACE, without None, go together."""
    active = [name for name in PROCESSES if name in given]
    if given.get("off"):
        if len(given) > 2:
            raise CommandError("off accepts only the id")
        return
    if not active:
        raise CommandError(f"nothing to do; give one or more of {', '.join(PROCESSES)}, or off")
    if "interval" not in given:
        raise CommandError("give interval, the number of steps between two applications")
    if given["interval"] < 1:
        raise CommandError(f"interval must be at least 1 step, got {given['interval']}")
    for name in ("diffuse", "erode", "deposit", "years", "spacing"):
        if name in given and not 0.0 < given[name] <= LARGEST:
            raise CommandError(f"{name} must be above 0, got {given[name]:g}")
    if not 0.0 < given.get("slope", 1.0) <= STEEPEST:
        raise CommandError(f"slope: an angle above 0, at most {STEEPEST:g} degrees, got {given['slope']:g}")
    if not 0.0 <= given.get("porosity", 0.0) < 0.9:
        raise CommandError(f"porosity: from 0 to less than 0.9, got {given['porosity']:g}")
    lowers, raises = ("erode" in given or "above" in given), ("deposit" in given or "below" in given)
    above, below = given.get("above", -math.inf), given.get("below", math.inf)
    if lowers and raises and below > above:
        raise CommandError(
            f"erosion (above {_level(above)}) and deposition (below {_level(below)}) would act at the same heights; "
            "the level of erosion must not be below that of deposition"
        )
    _check_rise(given)
    _check_deposit(given, [name for name in ("diffuse", "slope", "deposit", "below") if name in given])


def _check_rise(given: Mapping[str, Any]) -> None:
    """CommandError for a velocity of levels that is not finite, or moves none."""
    if "rise" in given and not abs(given["rise"]) <= LARGEST:
        raise CommandError(f"rise must be a number, got {given['rise']:g}")
    if "rise" in given and not ("above" in given or "below" in given):
        raise CommandError("rise is the velocity of a level: give above or below")


def _level(level: float) -> str:
    return f"{level:g} m" if math.isfinite(level) else "no level"


def _check_deposit(given: Mapping[str, Any], makers: Sequence[str]) -> None:
    """CommandError unless the discs that these processes make are described, and nothing else is."""
    if not makers:
        strange = [name for name in given if name not in OF_EROSION]
        if strange:
            raise CommandError(f"{strange[0]} describes a deposit, but this process only erodes")
        return
    if not len(given.get("rad", ())):
        raise CommandError(f"{makers[0]} deposits discs: give their radii (rad)")
    for r in given["rad"]:
        check_radius(r)
    law = (given.get("shear") and given.get("hertz")) or given.get("kn")
    missing = "density" if not given.get("density") else "" if law else "kn, or shear, poiss and hertz"
    if missing:
        raise CommandError(f"{makers[0]} deposits discs: give their {missing}")
    if "compact" in given and not (0.0 < given["compact"][0] < 0.9 and 0.0 < given["compact"][1] <= LARGEST):
        raise CommandError(
            f"compact: a porosity above 0 and below 0.9 and a depth above 0, got {given['compact'][0]:g} and "
            f"{given['compact'][1]:g}"
        )
    if given.get("episode", 1) < 1:
        raise CommandError(f"episode must be at least 1 step, got {given['episode']}")


def _point(p: Point) -> str:
    return f"({p[0]}, {p[1]})"
