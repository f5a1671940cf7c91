"""Specimens as files hold them: grains of PPDEM, rows x y r, clumps."""

from __future__ import annotations

import numpy as np

from hpcdem.io.clumps import Clumps
from hpcdem.io.ppdem import PpdemGrains, circles
from hpcdem.physics.polyarc.moments import moments
from hpcdem.pre.specimen import Specimen
from hpcdem.pre.specimen.discs import GAP, Discs, inscribed
from hpcdem.pre.specimen.shapes import SIDES


def to_ppdem(specimen: Specimen) -> PpdemGrains:
    """Convert grains to the PPDEM format; polygons with the roundness of each edge."""
    if specimen.request.shape == "circle":
        return circles(specimen.x, specimen.y, specimen.size)
    o = specimen.outlines
    polygon = specimen.request.shape in SIDES
    roundness = np.full(len(o.x), specimen.request.roundness) if polygon else None
    return PpdemGrains(o.start, o.x, o.y, o.theta, np.zeros(len(specimen)), roundness)


def group_of(size: float) -> str:
    """Name of the group of grains of a size [mm], a word that scripts can write."""
    return f"d{size:.6g}mm"


def xyr(specimen: Specimen) -> str:
    """Rows "x y r group" [m] for LOAD, a group for each size; of circles only."""
    assert specimen.request.shape == "circle"
    names = [group_of(size) for size in specimen.grading.sizes.tolist()]
    rows = zip(specimen.x.tolist(), specimen.y.tolist(), (0.5 * specimen.size).tolist(), specimen.class_of.tolist())
    return "".join(f"{x:.12e}   {y:.12e}   {r:.12e}   {names[k]}\n" for x, y, r, k in rows)


def to_clumps(specimen: Specimen, gap: float = GAP) -> tuple[Clumps, Discs]:
    """Rigid bodies of discs inside the outlines, with area and inertia of the outlines; and how well they fill them.

    gap: between outline and discs, over the size of the grain.
    """
    discs = inscribed(specimen.body, specimen.size, gap)
    area, cx, cy, polar = moments(specimen.body)
    c, s = np.cos(specimen.angle), np.sin(specimen.angle)
    owner = np.repeat(np.arange(len(specimen)), np.diff(discs.start))
    clumps = Clumps(
        specimen.x + c * cx - s * cy, specimen.y + s * cx + c * cy, specimen.angle, area, polar, discs.start,
        discs.x - cx[owner], discs.y - cy[owner], discs.r,
    )  # fmt: skip
    return clumps, discs
