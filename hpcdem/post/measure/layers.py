"""Areas of layers, that is of colours and groups, and how they change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.post.measure.grains import Grains
from hpcdem.post.measure.images import extended
from hpcdem.post.measure.triangles import shares


@dataclass(frozen=True)
class Area:
    """Number of grains, area of their discs and of the section that they take up with their pores [m2]."""

    grains: int
    discs: float
    envelope: float

    @property
    def porosity(self) -> float:
        """Part of the envelope that is not discs; NaN without any."""
        return 1.0 - self.discs / self.envelope if self.envelope > 0.0 else float("nan")


def areas(g: Grains) -> dict[tuple[str, str], Area]:
    """Areas by (kind, name): ("all", ""), ("color", number), ("group", name)."""
    around = extended(g)[0] if g.period else g  # the images hold what lies beside the sides
    discs = np.pi * g.r * g.r
    envelope = shares(around.x, around.y, around.r, 4.0 * float(np.max(g.r, initial=0.0)))[: len(g)]

    def of(chosen: np.ndarray) -> Area:
        return Area(int(chosen.sum()), float(discs[chosen].sum()), float(envelope[chosen].sum()))

    result = {("all", ""): of(np.ones(len(g), bool))}
    result |= {("color", str(c)): of(g.color == c) for c in np.unique(g.color)}
    return result | {("group", n): of(g.group == n) for n in sorted({*g.group.tolist()}) if n}
