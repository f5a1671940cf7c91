"""Discs that would leave slivers between them and others, or the surface of the body, are moved a little before a mesh
is cut along them: Gmsh makes elements as flat as what it is given.

Two rules. Discs that cross at less than `LEAST_ANGLE` become parallel: the later one is turned, and moved into the
plane of the earlier one if it is nearer to it than a quarter of an edge. A disc whose rim ends within a quarter of an
edge of the surface, on either side, is made so much smaller that a quarter is left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hpcdem.pre.mesh.solids import Disc, _frame

LEAST_ANGLE = 15.0
"""Smallest angle [degrees] at which discs cross; at smaller angles the later disc is made parallel."""
NEAR = 0.25
"""Distance over the mesh size within which a disc is moved into the plane of a parallel one, or its radius reduced so
that its rim keeps off the surface."""
AROUND = 64
"""Number of points of a rim that are checked."""

Named = tuple[str, Sequence[Any]]


def snapped(surfaces: Sequence[Named], bodies: Sequence[Any], size: float) -> tuple[list[Named], list[str]]:
    """The surfaces as they are cut in, and notes. size: edges of the mesh [m]."""
    before: list[Disc] = []
    turned = shrunk = lost = 0
    out: list[Named] = []
    for name, of in surfaces:
        kept: list[Any] = []
        for one in of:
            if isinstance(one, Disc):
                disc = _aligned(one, before, size)
                turned += disc is not one
                inside = _inside(disc, bodies, size)
                lost += inside is None
                if inside is None:
                    continue
                shrunk += inside is not disc
                before.append(inside)
                kept.append(inside)
            else:
                kept.append(one)
        out.append((name, kept))
    counts = (
        (turned, f"were rotated: they crossed others at less than {LEAST_ANGLE:g} degrees"),
        (shrunk, "were shortened: they ended within a quarter of an edge of the surface"),
        (lost, "were omitted: they lie outside the body, or are smaller than a quarter of an edge"),
    )
    return out, [f"{count} discs {what}" for count, what in counts if count]


def _aligned(disc: Disc, before: Sequence[Disc], size: float) -> Disc:
    """Return the disc parallel to the first of the earlier discs that it crosses at a small angle."""
    centre, normal = disc.plane()
    for other in before:
        at, along = other.plane()
        cosine = float(normal @ along)
        off = float((centre - at) @ along)
        if abs(cosine) <= math.cos(math.radians(LEAST_ANGLE)):
            continue
        parallel = abs(cosine) > 1.0 - 1e-12
        if parallel and (abs(off) >= NEAR * size or abs(off) < 1e-12 * disc.radius):
            continue
        if not parallel and not _meet(disc, other):
            continue
        if not _beside(disc, other):
            continue
        moved = centre - off * along if abs(off) < NEAR * size else centre
        return replace(disc, centre=tuple(moved.tolist()), normal=tuple((math.copysign(1.0, cosine) * along).tolist()))
    return disc


def _beside(disc: Disc, other: Disc) -> bool:
    """Do they lie over each other, seen along the normal?"""
    at, along = other.plane()
    offset = np.array(disc.centre) - at
    offset = offset - (offset @ along) * along
    return float(np.sqrt(offset @ offset)) < disc.radius + other.radius


def _meet(disc: Disc, other: Disc) -> bool:
    """Do two discs cross? Their chords on the line that the planes share overlap."""
    (c, n), (d, m) = disc.plane(), other.plane()
    line = np.cross(n, m)
    line /= math.sqrt(line @ line)
    # the point of the line nearest to the middle between both
    middle = 0.5 * (c + d)
    p = np.linalg.solve(np.array([n, m, line]), [n @ c, m @ d, line @ middle])
    spans = []
    for centre, radius in ((c, disc.radius), (d, other.radius)):
        along = (centre - p) @ line
        off2 = (centre - p) @ (centre - p) - along * along
        if off2 >= radius * radius:
            return False
        half = math.sqrt(radius * radius - off2)
        spans.append((along - half, along + half))
    return bool(max(spans[0][0], spans[1][0]) < min(spans[0][1], spans[1][1]))


def _inside(disc: Disc, bodies: Sequence[Any], size: float) -> Disc | None:
    """Smaller, if its rim would leave a sliver at the surface; None if nothing of it is inside."""
    centre, normal = disc.plane()
    u, v = _frame(normal)
    angle = 2.0 * math.pi * np.arange(AROUND) / AROUND
    offset = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    depths = np.linspace(0.0, 1.0, 9)[1:, None, None] * disc.radius * offset
    over = np.min([one.distance(np.vstack([centre, (centre + depths).reshape(-1, 3)])) for one in bodies], axis=0)
    if (over >= 0.0).all():
        return None
    rim = np.min([one.distance(centre + disc.radius * offset) for one in bodies], axis=0)
    worst = float(rim.max())
    near = NEAR * size
    if not -near < worst < near or worst <= -near:
        return disc
    radius = disc.radius
    for _ in range(8):
        radius -= max(worst + near, 1e-3 * near)
        if radius < near:
            return None
        worst = float(np.min([one.distance(centre + radius * offset) for one in bodies], axis=0).max())
        if worst <= -near * (1.0 - 1e-9):
            break
    return replace(disc, radius=radius)
