"""Meshes of triangles from pieces of lines, each with its role and a mesh size of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh.geometry import Curve, Layers
from hpcdem.pre.mesh.pieces import HOLE, LINE, OUTLINE, Piece
from hpcdem.pre.mesh.sizes import Refinement, positive
from hpcdem.pre.mesh.triangulate import MeshSettings, Region


def settings(
    layers: Layers,
    pieces: Sequence[tuple[Piece, list[Curve]]],
    size: float | None,
    tolerance: float,
    group: tuple[str, str],
) -> tuple[Layers, MeshSettings]:
    """Prepare the input of triangulate.py: the layers (unnamed pieces included) and settings. pieces: with the curves
    of their shapes; group: (set, group) of the elements. Raises CommandError for pieces that bound nothing or have no
    size."""
    if not any(piece.role == OUTLINE for piece, _ in pieces):
        raise CommandError("no piece is given as boundary of the mesh")
    sizes = [piece.size for piece, _ in pieces if piece.size is not None]
    if size is None and not sizes:
        raise CommandError("no mesh size is given")
    for piece, _ in pieces:
        if piece.size is not None:
            positive(piece.size, f"mesh size of {piece.what}")
    base = max([*sizes, *([] if size is None else [size])])
    whole = max(sizes) if size is None else size
    found = Layers()
    roles: dict[str, str] = {}
    refine: list[Refinement] = []
    snap = _Snap(tolerance)
    for piece, shape in sorted(pieces, key=lambda one: one[0].role == LINE):  # lines give way
        named = {name: layers[name] for name in piece.layers}
        if shape:
            named[_free(piece.what, layers, found)] = shape
        if piece.role == OUTLINE and len(named) > 1 and not all(c.closed for of in named.values() for c in of):
            # only together do they enclose something
            named = {_free(piece.what, layers, found): [c for of in named.values() for c in of], **named}
        for k, (name, curves) in enumerate(named.items()):
            if name not in roles:
                found.add(name, *(moved for c in curves if (moved := snap(c)) is not None))
                roles[name] = piece.role if k == 0 or all(c.closed for c in curves) else LINE
            fine = whole if piece.size is None else piece.size
            if fine < base and not any(one.layer == name for one in refine):
                refine.append(Refinement(name, fine))
    of = {role: [name for name, has in roles.items() if has == role] for role in (OUTLINE, HOLE, LINE)}
    set_name, in_group = group
    regions = [Region(name, in_group, set_name) for name in of[OUTLINE]]
    return found, MeshSettings(regions, base, holes=of[HOLE], inside=of[LINE], refine=refine)


def _free(what: str, *taken: Layers) -> str:
    """A name for a layer that is none yet."""
    number = 1
    while any(f"{what} {number}" in layers for layers in taken):
        number += 1
    return f"{what} {number}"


class _Snap:
    """Moves ends of lines and single points that lie nearer than a tolerance [m] to an earlier one onto that."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.known = np.empty((0, 2))

    def __call__(self, curve: Curve) -> Curve | None:
        """The curve; None if nothing is left of it."""
        if not self.tolerance > 0.0:
            return curve
        points = curve.points.copy()
        for k, at in enumerate(points):
            far = np.hypot(*(self.known - at).T)
            if len(far) and far.min() <= self.tolerance:
                points[k] = self.known[far.argmin()]
            else:
                self.known = np.vstack([self.known, at])
        ahead = np.roll(points, -1, axis=0)
        kept = (points != ahead).any(axis=1)
        if not curve.closed:
            kept[-1] = True
        if curve.segments and kept.sum() < (3 if curve.closed and not curve.bulges.any() else 2):
            return None
        return replace(curve, points=points[kept], bulges=curve.bulges[kept])
