"""Areas inside curves, arcs as arcs."""

from __future__ import annotations

import math

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh.geometry import Curve, arc_of


def enclosed_area(curve: Curve) -> float:
    """Area inside a closed curve, positive if it runs counter-clockwise [m2]: shoelace plus circle segments."""
    if not curve.closed:
        raise CommandError("an open curve encloses no area")
    terms = []
    for i in range(curve.segments):
        a, b, bulge = curve.segment(i)
        terms.append(0.5 * (a[0] * b[1] - a[1] * b[0]))
        if bulge != 0.0:
            _, radius, _, sweep = arc_of(a, b, bulge)
            terms.append(0.5 * radius * radius * (sweep - math.sin(sweep)))
    return math.fsum(terms)
