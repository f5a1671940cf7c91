"""Discrete fracture networks in space: round discs with given statistics, as `fractures.py` has traces in the plane.

Centres are a Poisson process; orientation and radius of each disc are independent of it and of each other. The box in
which centres are drawn is larger than the bodies by the greatest radius, so the densities hold in the mean up to their
surface (`disc_sets.py`).

Every number is a function of (seed, number of the set, number of the disc): `numerics.rng`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.rng import uniform
from hpcdem.pre.mesh.disc_sets import DiscSet
from hpcdem.pre.mesh.fractures import DRAWS, MOST, poisson
from hpcdem.pre.mesh.solids import Disc, _frame

SPOTS = 512
"""Number of points of a disc with which its area inside the bodies is measured (`reached`)."""
VOLUME = 2_000_000
"""Number of points with which the volume of the bodies is measured (`reached`)."""


def discs(one: DiscSet, bodies: Sequence[Any], seed: int, number: int = 0) -> list[Disc]:
    """Return the complete discs of a set that may reach into bodies."""
    one.check("fractures")
    flat = [body for body in bodies if body.surface]
    if flat or not bodies:
        raise CommandError("fractures need a layer with bodies; this layer has none, or a surface")
    bounds = np.array([body.bounds() for body in bodies])
    reach = one.radius.longest()
    low, high = bounds[:, 0].min(axis=0) - reach, bounds[:, 1].max(axis=0) + reach
    expected = one.p30() * float(np.prod(high - low))
    if not expected < 0.5 * MOST:
        raise CommandError(f"fracture set {number}: {expected:.3g} discs expected, at most {MOST // 2} allowed")
    stream = 2 * number
    n = poisson(expected, uniform(seed, stream + 1, 0))
    if one.reached:
        return _until_reached(one, bodies, (low, high), seed, stream, max(64, n))
    return _touching(_made(one, (low, high), seed, stream, np.arange(n)), bodies)


def area(of: Sequence[Disc]) -> float:
    """Sum the areas of discs [m2]."""
    return math.fsum(math.pi * disc.radius**2 for disc in of)


def area_inside(disc: Disc, bodies: Sequence[Any]) -> float:
    """Return the area of the part of a disc inside bodies [m2], by points in a spiral (Vogel 1979) that represent equal
    areas.
    """
    k = np.arange(SPOTS) + 0.5
    radius, turn = disc.radius * np.sqrt(k / SPOTS), k * math.pi * (3.0 - math.sqrt(5.0))
    u, v = _frame(disc.plane()[1])
    at = np.array(disc.centre) + (radius * np.cos(turn))[:, None] * u + (radius * np.sin(turn))[:, None] * v
    inside = np.any([body.distance(at) < 0.0 for body in bodies], axis=0)
    return math.pi * disc.radius**2 * float(inside.mean())


def _made(one: DiscSet, box: tuple[np.ndarray, np.ndarray], seed: int, stream: int, numbers: np.ndarray) -> list[Disc]:
    u = np.array([[uniform(seed, stream, DRAWS * int(i) + k) for k in range(6)] for i in numbers]).reshape(-1, 6)
    centre = box[0] + (box[1] - box[0]) * u[:, :3]
    normal, radius = one.poles.normals(u[:, 3:5]), one.radius.lengths(u[:, 5])
    rows = zip(centre.tolist(), normal.tolist(), radius.tolist(), strict=True)
    return [Disc((c[0], c[1], c[2]), (n[0], n[1], n[2]), r) for c, n, r in rows]


def _touching(of: list[Disc], bodies: Sequence[Any]) -> list[Disc]:
    """Without those that cannot reach into a body."""
    if not of:
        return of
    far = np.min([body.distance(np.array([disc.centre for disc in of])) for body in bodies], axis=0)
    return [disc for disc, gap in zip(of, far, strict=True) if gap < disc.radius]


def _until_reached(
    one: DiscSet, bodies: Sequence[Any], box: tuple[np.ndarray, np.ndarray], seed: int, stream: int, batch: int
) -> list[Disc]:
    """Discs in sequence until the density in the bodies is nearest to the requested one."""
    goal = one.density * _volume(bodies)
    made: list[Disc] = []
    total, start = 0.0, 0
    while start < MOST:
        for disc in _made(one, box, seed, stream, np.arange(start, start + batch)):
            if one.measure == "p30":
                share = float(any(body.distance(np.array([disc.centre]))[0] < 0.0 for body in bodies))
            else:
                share = area_inside(disc, bodies)
            if total + share >= goal:
                made += [disc] if total + share - goal <= goal - total else []
                return _touching(made, bodies)
            total += share
            made.append(disc)
        start += batch
    raise CommandError(f"{MOST} discs do not reach the density {one.density:g}")


def _volume(bodies: Sequence[Any]) -> float:
    """Estimate the volume of bodies [m3] as the share of lattice points of their bounding box that lie inside."""
    bounds = np.array([body.bounds() for body in bodies])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    n = np.maximum(np.round((high - low) * (VOLUME / np.prod(high - low)) ** (1.0 / 3.0)), 1).astype(int)
    z = low[2] + (high[2] - low[2]) * (np.arange(n[2]) + 0.5) / n[2]
    x, y = (low[a] + (high[a] - low[a]) * (np.arange(n[a]) + 0.5) / n[a] for a in (0, 1))
    flat = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = 0
    for height in z:
        at = np.column_stack([flat, np.full(len(flat), height)])
        inside += int(np.any([body.distance(at) < 0.0 for body in bodies], axis=0).sum())
    return float(np.prod(high - low)) * inside / (len(flat) * len(z))
