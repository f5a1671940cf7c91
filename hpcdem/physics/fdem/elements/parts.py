"""Functions of the parts of an element, the same for each kind (kind.py): where they are, their strain, their volume.

They take tables `g` of elements, see `kind.Tables`, and which element i, part p, corner k is meant; which kind it is
they see from the class of the tables while a kernel is compiled, so that a loop over elements is written once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload

from hpcdem.physics.fdem.elements.kind import KINDS, Kind
from hpcdem.physics.fdem.kernels import hexes, laws, tets
from hpcdem.physics.fdem.kernels.elements import _part
from hpcdem.physics.fdem.kernels.tets import _product
from hpcdem.physics.fdem.six import kernels as six

SHARED = 1e-12
"""Difference of pressures in an overlay, over its stresses, that is put down to rounding."""


def _constant(number: int) -> Any:
    return njit(error_model="numpy", forceinline=True)(lambda g: number)


def _by_kind(make: Callable[[Kind], Any]) -> Any:
    """A function (g, ...) of the tables of any kind. make: what it is for one kind."""
    of = {kind.tables: make(kind) for kind in KINDS}

    def function(g, *args):
        return of[type(g)](g, *args)

    @overload(function, jit_options={"forceinline": True})
    def chosen(g, *args):
        one = of[g.instance_class]
        return lambda g, *args: one(g, *args)

    return function


count = _by_kind(lambda kind: _constant(len(kind.parts)))
"""count(g): parts of an element."""
components = _by_kind(lambda kind: _constant(len(kind.components)))
"""components(g): of stress and strain."""
overlays = _by_kind(lambda kind: _constant(kind.overlays))
"""overlays(g): of an element."""


def _end(kind: Kind) -> Any:
    ends = np.array(kind.parts)
    return njit(error_model="numpy", forceinline=True)(lambda g, p, k: ends[p, k])


end = _by_kind(_end)
"""end(g, p, k): which corner of the element corner k of part p is."""


def _corner(kind: Kind) -> Any:
    stride = kind.stride
    if kind.stored > 1:
        return njit(error_model="numpy", forceinline=True)(lambda g, i, k: np.int64(g.place[i, k]))
    return njit(error_model="numpy", forceinline=True)(lambda g, i, k: np.int64(g.rows[i]) * g.width + stride * k)


corner = _by_kind(_corner)
"""corner(g, i, k): where corner k begins in x."""


def _inverse(kind: Kind) -> Any:
    size = hexes.BLOCK

    @njit(error_model="numpy", forceinline=True)
    def plane(g, i, p):
        c, o = g.c, 4 * p
        return c[i, o], c[i, o + 1], c[i, o + 2], c[i, o + 3]

    @njit(error_model="numpy", forceinline=True)
    def tetrahedron(g, i, p):
        c = g.c
        return c[i, 0], c[i, 1], c[i, 2], c[i, 3], c[i, 4], c[i, 5], c[i, 6], c[i, 7], c[i, 8]

    @njit(error_model="numpy", forceinline=True)
    def of_hexahedron(g, i, p):
        c, b, m = g.parts, i // size, i % size
        return (
            c[b, p, 0, m], c[b, p, 1, m], c[b, p, 2, m], c[b, p, 3, m], c[b, p, 4, m], c[b, p, 5, m], c[b, p, 6, m],
            c[b, p, 7, m], c[b, p, 8, m],
        )  # fmt: skip

    return plane if kind.dim == 2 else (of_hexahedron if kind.corners == 8 else tetrahedron)


inverse = _by_kind(_inverse)
"""inverse(g, i, p): of the reference matrix of a part, whose columns are its sides from the first corner, by rows."""


def _volume(kind: Kind) -> Any:
    column, five, size, share = kind.volume, kind.each, hexes.BLOCK, hexes.SHARE

    @njit(error_model="numpy", forceinline=True)
    def triangle(g, i, p):
        a, b, c, d = inverse(g, i, p)
        return 0.5 / (a * d - b * c)

    @njit(error_model="numpy", forceinline=True)
    def of_quad(g, i, p):
        return g.c[i, column + p]

    @njit(error_model="numpy", forceinline=True)
    def tetrahedron(g, i, p):
        return 1.0 / tets.per_volume(*inverse(g, i, p))

    @njit(error_model="numpy", forceinline=True)
    def of_hexahedron(g, i, p):
        return g.c[i, column + p // five] * g.parts[i // size, p, share, i % size]

    simple, several = (triangle, of_quad) if kind.dim == 2 else (tetrahedron, of_hexahedron)
    return simple if column < 0 else several


volume = _by_kind(_volume)
"""volume(g, i, p): of a part in the mesh [m3], in the plane its area [m2]."""


def _weight(kind: Kind) -> Any:
    counts = 1.0 / kind.overlays
    return njit(error_model="numpy", forceinline=True)(lambda g, i, p: counts * volume(g, i, p))


weight = _by_kind(_weight)
"""weight(g, i, p): the same, of what a part counts in a sum over the element: each overlay covers it once."""


def _moduli(kind: Kind) -> Any:
    lame, two_mu, free = kind.lame, kind.two_mu, kind.free
    if free < 0:
        return njit(error_model="numpy", forceinline=True)(lambda g, i: (g.c[i, lame], g.c[i, two_mu], 0.0))
    return njit(error_model="numpy", forceinline=True)(lambda g, i: (g.c[i, lame], g.c[i, two_mu], g.c[i, free]))


moduli = _by_kind(_moduli)
"""moduli(g, i): lambda, 2 mu [Pa], and 1.0 if the strain across the plane is free, else 0.0."""


def _put_moduli(kind: Kind) -> Any:
    of_lame, of_two_mu = kind.lame, kind.two_mu

    @njit(error_model="numpy", forceinline=True)
    def put(g, i, lame, two_mu, c):
        c[i, of_lame], c[i, of_two_mu] = lame, two_mu

    return put


put_moduli = _by_kind(_put_moduli)
"""put_moduli(g, i, lame, two_mu, c): into a copy of the constants."""


def _place(kind: Kind) -> Any:
    each = kind.in_row

    @njit(error_model="numpy", forceinline=True)
    def place(g, i, p, width):
        return np.int64(g.rows[i]) - g.first + p // each, width * (p % each)

    return place


place = _by_kind(_place)
"""place(g, i, p, width): row, of those of owned elements, and first of the `width` columns that a part remembers.
(Views are counted, which takes longer than what a loop over elements does with one.)"""


@njit(error_model="numpy", forceinline=True)
def memory(g, i, p, of, width):
    """A view (width,) of them, of the rows `of` of owned elements."""
    j, o = place(g, i, p, width)
    return of[j, o : o + width]


def _strain(kind: Kind) -> Any:
    @njit(error_model="numpy", forceinline=True)
    def plane(g, i, p, small):
        x, a, b, c = g.x, corner(g, i, end(g, p, 0)), corner(g, i, end(g, p, 1)), corner(g, i, end(g, p, 2))
        r11, r12, r21, r22 = inverse(g, i, p)
        _, _, _, _, cs, sn, e11, e22, e12 = _part(
            x[a], x[a + 1], x[b], x[b + 1], x[c], x[c + 1], r11, r12, r21, r22, small
        )
        return (e11, e22, e12, 0.0), (cs, sn)

    @njit(error_model="numpy", forceinline=True)
    def space(g, i, p, small):
        x, a, b = g.x, corner(g, i, end(g, p, 0)), corner(g, i, end(g, p, 1))
        c, d = corner(g, i, end(g, p, 2)), corner(g, i, end(g, p, 3))
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = inverse(g, i, p)
        ux, uy, uz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
        wx, wy, wz = x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]
        tx, ty, tz = x[d] - x[a], x[d + 1] - x[a + 1], x[d + 2] - x[a + 2]
        f = (
            _product(ux, wx, tx, c11, c21, c31), _product(ux, wx, tx, c12, c22, c32),
            _product(ux, wx, tx, c13, c23, c33), _product(uy, wy, ty, c11, c21, c31),
            _product(uy, wy, ty, c12, c22, c32), _product(uy, wy, ty, c13, c23, c33),
            _product(uz, wz, tz, c11, c21, c31), _product(uz, wz, tz, c12, c22, c32),
            _product(uz, wz, tz, c13, c23, c33),
        )  # fmt: skip
        r = tets.frame(f, small)
        e11, e22, e12, e33, e13, e23 = tets.in_frame(r, f)
        return (e11 - 1.0, e22 - 1.0, e12, e33 - 1.0, e13, e23), r

    @njit(error_model="numpy", forceinline=True)
    def of_six_nodes(g, i, p, small):
        _, frame, (e11, e22, e12) = six.strain(i, p, g.place, g.x, g.c, small)
        return (e11, e22, e12, 0.0), frame

    if len(kind.parts[0]) > kind.dim + 1:
        return of_six_nodes
    return plane if kind.dim == 2 else space


strain = _by_kind(_strain)
"""strain(g, i, p, small): of a part alone, in the frame that turns with it (11, 22, 12, 33, in space 13, 23), and that
frame: cosine and sine, in space the rotation by rows."""


def _trace(kind: Kind) -> Any:
    if kind.dim == 2:
        return njit(error_model="numpy", forceinline=True)(lambda g, s, p: s[p, 0] + s[p, 1])
    return njit(error_model="numpy", forceinline=True)(lambda g, s, p: s[p, 0] + s[p, 1] + s[p, 3])


trace = _by_kind(_trace)
"""trace(g, s, p): of row p of stresses or strains, as far as parts of an overlay share it: in the plane 11 and 22."""


def _swell(kind: Kind) -> Any:
    @njit(error_model="numpy", forceinline=True)
    def plane(g, s, p, more):
        more = 0.5 * more
        s[p, 0] += more
        s[p, 1] += more

    @njit(error_model="numpy", forceinline=True)
    def space(g, s, p, more):
        more = more / 3.0
        s[p, 0] += more
        s[p, 1] += more
        s[p, 3] += more

    return plane if kind.dim == 2 else space


swell = _by_kind(_swell)
"""swell(g, s, p, more): adds to it."""


def _strains(kind: Kind) -> Any:
    several, each, width, words = kind.overlays, kind.each, len(kind.components), kind.frame

    @njit(error_model="numpy", forceinline=True)
    def strains(g, i, small, e, frames):
        for overlay in range(several):
            first = each * overlay
            mean = whole = 0.0
            for p in range(first, first + each):
                found, frame = strain(g, i, p, small)
                for k in range(width):
                    e[p, k] = found[k]
                for k in range(words):
                    frames[p, k] = frame[k]
                if each > 1:
                    part = volume(g, i, p)
                    mean += part * trace(g, e, p)
                    whole += part
            if each > 1:
                mean /= whole
                for p in range(first, first + each):
                    swell(g, e, p, mean - trace(g, e, p))

    return strains


strains = _by_kind(_strains)
"""strains(g, i, small, e, frames): of all parts of an element, with the mean trace of their overlay, into e (parts, 4
or 6), and their frames into (parts, 2 or 9)."""


def _share(kind: Kind) -> Any:
    several, each, normal = kind.overlays, kind.each, kind.normal

    @njit(error_model="numpy", forceinline=True)
    def nothing(g, i, s):
        return

    @njit(error_model="numpy", forceinline=True)
    def share(g, i, s):
        s = s[i]
        for overlay in range(several):
            first = each * overlay
            low = high = trace(g, s, first)
            mean = whole = size = 0.0
            for p in range(first, first + each):
                part, own = volume(g, i, p), trace(g, s, p)
                low, high = min(low, own), max(high, own)
                mean += part * own
                whole += part
                for k in normal:
                    size += abs(s[p, k])
            if high - low > len(normal) * SHARED * size:
                mean /= whole
                for p in range(first, first + each):
                    swell(g, s, p, mean - trace(g, s, p))

    return share if each > 1 else nothing


share = _by_kind(_share)
"""share(g, i, s): the parts of an overlay get one pressure, the mean of theirs by volume; s (n, parts, 4 or more):
stresses. What is rounding stays."""


def _turned(kind: Kind) -> Any:
    @njit(error_model="numpy", forceinline=True)
    def plane(g, s, frame):
        xx, yy, xy = laws.turned(s[0], s[1], s[2], frame[0], frame[1])
        return xx, yy, xy, s[3]

    @njit(error_model="numpy", forceinline=True)
    def space(g, s, frame):
        return tets.turned(s[0], s[1], s[2], s[3], s[4], s[5], frame)

    return plane if kind.dim == 2 else space


turned = _by_kind(_turned)
"""turned(g, s, frame): stress or strain (4 or 6,) in a frame (2 or 9,) along the axes of space."""


def _room(kind: Kind) -> Any:
    n, width, words = len(kind.parts), len(kind.components), kind.frame
    return njit(error_model="numpy", forceinline=True)(lambda g: (np.zeros((n, width)), np.zeros((n, words))))


room = _by_kind(_room)
"""room(g): strains (parts, 4 or 6) and frames (parts, 2 or 9), to be filled."""
