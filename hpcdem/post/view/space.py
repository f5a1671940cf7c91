"""Bodies in space: from where they are seen, and their outer surface, cut by a plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpcdem.core.picture_words import Section

SIDES = 6
"""Number of sides of a bar."""


class Skin(NamedTuple):
    """Visible surface of elements: points (k, 3) [m]; cells (m, 4) rows of points, -1 in the fourth column of
    triangles; of (m,): elements of the faces, as positions in the selection; cut (m,): whether the plane made the
    face."""

    points: np.ndarray
    cells: np.ndarray
    of: np.ndarray
    cut: np.ndarray


def turn_of(eye: tuple[float, float, float]) -> np.ndarray:
    """(3, 3): right, up and towards the eye, by rows. z is up; from above and below y is."""
    out = np.array(eye) / np.linalg.norm(eye)
    level = np.hypot(out[0], out[1])
    right = np.array([1.0, 0.0, 0.0]) if level < 1e-12 else np.array([-out[1], out[0], 0.0]) / level
    return np.array([right, np.cross(out, right), out])


def axes_of(turn: np.ndarray) -> tuple[tuple[float, str], tuple[float, str]] | None:
    """Sign and name of the axes along the picture and up it, where both are axes of space; else None."""
    found = []
    for direction in turn[:2]:
        k = int(np.argmax(np.abs(direction)))
        if abs(direction[k]) < 1.0 - 1e-12:
            return None
        found.append((float(np.sign(direction[k])), "xyz"[k]))
    return found[0], found[1]


def taken(section: Section, eye: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A point of the plane, and the unit normal into what is taken away."""
    normal = np.array(section.normal) / np.linalg.norm(section.normal)
    if not section.sided and normal @ eye < 0.0:
        normal = -normal
    return np.array(section.point), normal


def skin(
    points: np.ndarray, cells: np.ndarray, partner: np.ndarray, rows: np.ndarray,
    plane: tuple[np.ndarray, np.ndarray] | None = None, alone: bool = False,
) -> Skin:  # fmt: skip
    """The surface of some tetrahedra: their faces on no other of them.

    points (k, 3); cells (n, 4); partner (4 n,): the face that each lies on, -1: none; rows: which tetrahedra,
    ascending; plane: a point and the normal into what is taken away, see `taken`; alone: only what lies in it.
    """
    from hpcdem.physics.fdem import tetrahedra

    rows = rows[np.isfinite(points[cells[rows]]).all(axis=(1, 2))]
    there = np.zeros(len(cells), bool)
    there[rows] = True
    faces = (4 * rows[:, None] + np.arange(4)).reshape(-1)
    beside = partner[faces]
    faces = faces[(beside < 0) | ~there[beside // 4]]
    three = tetrahedra.face_points(cells, faces)
    owner = faces // 4
    cut = np.zeros(len(three), bool)
    made = np.column_stack([three, np.full(len(three), -1)])
    if plane is not None:
        far = (points - plane[0]) @ plane[1]
        points, made, owner, cut = _clipped(points, cells, far, rows, three, owner)
    if alone:
        made, owner, cut = made[cut], owner[cut], cut[cut]
    return _bare(points, made, np.searchsorted(rows, owner), cut)


def _bare(points: np.ndarray, cells: np.ndarray, of: np.ndarray, cut: np.ndarray) -> Skin:
    """Make a skin with only those points that are corners."""
    used, corner = np.unique(np.where(cells < 0, cells[:, :1], cells), return_inverse=True)
    corner = corner.reshape(cells.shape)
    return Skin(points[used], np.where(cells < 0, -1, corner), of, cut)


def rods(ends: np.ndarray, radius: float, plane: tuple[np.ndarray, np.ndarray] | None = None) -> Skin:
    """Bars (n, 2, 3) [m] as prisms of `SIDES` sides, without ends, less what the plane takes away."""
    difference = ends[:, 1] - ends[:, 0]
    along = difference / np.maximum(np.linalg.norm(difference, axis=1), 1e-300)[:, None]
    least = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    across = np.cross(along, least)
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.cos(turn)[:, None] * across[:, None] + np.sin(turn)[:, None] * np.cross(along, across)[:, None]
    points = (ends[:, :, None] + radius * around[:, None]).reshape(-1, 3)
    first = 2 * SIDES * np.arange(len(ends))[:, None]
    a, b = first + np.arange(SIDES), first + (np.arange(SIDES) + 1) % SIDES
    three = np.stack([np.stack([a, b, b + SIDES], axis=2), np.stack([a, b + SIDES, a + SIDES], axis=2)], axis=2)
    found = cut_faces(points, three.reshape(-1, 3), plane)
    return found._replace(of=found.of // (2 * SIDES))


OCTAHEDRON = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
OF_OCTAHEDRON = np.array([[k, (k + 1) % 4, tip] for tip in (4, 5) for k in range(4)])


def balls(at: np.ndarray, radius: float, plane: tuple[np.ndarray, np.ndarray] | None = None) -> Skin:
    """Points (n, 3) [m] as octahedra, less what the plane takes away."""
    points = (at[:, None] + radius * OCTAHEDRON).reshape(-1, 3)
    three = (6 * np.arange(len(at))[:, None, None] + OF_OCTAHEDRON).reshape(-1, 3)
    found = cut_faces(points, three, plane)
    return found._replace(of=found.of // len(OF_OCTAHEDRON))


def middles(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(m, 3) means of the corners of triangles and quads."""
    four = (cells[:, 3] >= 0)[:, None]
    total = points[cells[:, 0]] + points[cells[:, 1]] + points[cells[:, 2]]
    return (total + np.where(four, points[cells[:, 3]], 0.0)) / np.where(four, 4.0, 3.0)


def cut_faces(points: np.ndarray, three: np.ndarray, plane: tuple[np.ndarray, np.ndarray] | None) -> Skin:
    """Triangles (m, 3), rows of points, without what the plane takes away."""
    nobody = np.zeros(0, np.int64)
    far = np.zeros(len(points)) if plane is None else (points - plane[0]) @ plane[1]
    found = _clipped(points, np.zeros((0, 4), np.int64), far, nobody, three, np.arange(len(three)))
    return _bare(*found)


def _clipped(
    points: np.ndarray, cells: np.ndarray, far: np.ndarray, rows: np.ndarray, three: np.ndarray, owner: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points, cells, owners and `cut` of faces (m, 3) where the distance `far` (k,) from a plane is not above 0, and of
    the plane in these tetrahedra."""
    new: list[np.ndarray] = [points]
    count = len(points)
    found: list[tuple[np.ndarray, np.ndarray, bool]] = []

    def crossing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Numbers of new points on the plane between the points a and b (m,), on its two sides."""
        nonlocal count
        part = far[a] / (far[a] - far[b])
        new.append(points[a] + part[:, None] * (points[b] - points[a]))
        count += len(a)
        return np.arange(count - len(a), count)

    def keep(who: np.ndarray, *corners: np.ndarray, cut: bool = False) -> None:
        fourth = corners[3] if len(corners) == 4 else np.full(len(who), -1)
        found.append((np.column_stack([*corners[:3], fourth]), who, cut))

    out = far[three] > 0.0
    outside = out.sum(axis=1)
    keep(owner[outside == 0], *three[outside == 0].T)
    for number in (1, 2):
        some = outside == number
        alone = out[some] if number == 1 else ~out[some]
        a, b, c = _led_by(three[some], alone)
        if number == 1:
            keep(owner[some], crossing(a, b), b, c, crossing(a, c))
        else:
            keep(owner[some], a, crossing(a, b), crossing(a, c))

    out = far[cells[rows]] > 0.0
    outside = out.sum(axis=1)
    for number in (1, 3):
        some = outside == number
        a, *others = _led_by(cells[rows[some]], out[some] if number == 1 else ~out[some])
        keep(rows[some], *(crossing(a, b) for b in others), cut=True)
    some = outside == 2
    a, b, c, d = np.take_along_axis(cells[rows[some]], np.argsort(~out[some], axis=1, kind="stable"), axis=1).T
    keep(rows[some], crossing(a, c), crossing(a, d), crossing(b, d), crossing(b, c), cut=True)
    made, who = (np.concatenate([part[k] for part in found]) for k in range(2))
    return np.concatenate(new), made, who, np.repeat([cut for *_, cut in found], [len(part) for part, *_ in found])


def _led_by(corners: np.ndarray, alone: np.ndarray) -> np.ndarray:
    """(n, m) corners turned round until the one for which `alone` holds stands first, as n rows."""
    n = corners.shape[1]
    turn = (np.argmax(alone, axis=1)[:, None] + np.arange(n)) % n
    return np.take_along_axis(corners, turn, axis=1).T


def normals(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(m, 3) unit normals, zero where there is no area."""
    a, b, c = (points[cells[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    four = cells[:, 3] >= 0  # the first three corners of a piece of a cut may lie in a row
    across[four] += np.cross(c[four] - a[four], points[cells[four, 3]] - a[four])
    return across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
