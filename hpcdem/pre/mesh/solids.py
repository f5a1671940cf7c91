"""Bodies and surfaces in space: what geometry layers hold in three dimensions. Ranges ask how far a point is from
them, Gmsh receives them unchanged (occ.py).

Bodies have an inside (distances are negative there); surfaces, `Polygon`, `Disc` and `Plane`, have none: meshes are cut
along them, and faces lie on them. All are frozen, and go into checkpoints as JSON (`state`, `restored`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from hpcdem.core.errors import CommandError

Point = tuple[float, float, float]

IN_PLANE = 1e-6
"""Largest deviation of the corners of a polygon from a plane, over its size."""
FULL = 360.0


class Body:
    """Solid with an inside."""

    surface = False

    def check(self) -> None:
        """CommandError if it has no volume."""
        raise NotImplementedError

    def bounds(self) -> np.ndarray:
        """(2, 3) least and greatest coordinates [m]."""
        raise NotImplementedError

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance of points (n, 3) from the surface [m], negative inside."""
        raise NotImplementedError

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        """Distance (n,) of points (n, 3) from each smooth part of the surface [m]; a part may extend beyond the
        body."""
        raise NotImplementedError


@dataclass(frozen=True)
class Box(Body):
    """A box along the axes, between two corners [m]."""

    first: Point
    second: Point

    def check(self) -> None:
        if any(a == b for a, b in zip(self.first, self.second)):
            raise CommandError(f"a box needs two corners that differ in x, y and z, got {self.first} and {self.second}")

    def bounds(self) -> np.ndarray:
        return np.sort(np.array([self.first, self.second], np.float64), axis=0)

    def distance(self, points: np.ndarray) -> np.ndarray:
        low, high = self.bounds()
        over = np.abs(points - 0.5 * (low + high)) - 0.5 * (high - low)
        outside = np.maximum(over, 0.0)
        return np.sqrt((outside * outside).sum(axis=1)) + np.minimum(over.max(axis=1), 0.0)

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        return [points[:, axis] - bound for one in self.bounds() for axis, bound in enumerate(one)]


@dataclass(frozen=True)
class Sphere(Body):
    """Sphere about a centre [m]."""

    centre: Point
    radius: float

    def check(self) -> None:
        if not self.radius > 0.0:
            raise CommandError(f"a sphere needs a radius above 0, got {self.radius:g}")

    def bounds(self) -> np.ndarray:
        return np.array(self.centre) + self.radius * np.array([[-1.0], [1.0]])

    def distance(self, points: np.ndarray) -> np.ndarray:
        offset = points - np.array(self.centre)
        return np.sqrt((offset * offset).sum(axis=1)) - self.radius

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        return [self.distance(points)]


class _Round(Body):
    """A body of revolution about the axis from `first` to `second`, by its outline in the half plane (along, from the
    axis).
    """

    first: Point
    second: Point

    def outline(self) -> np.ndarray:
        """(k, 2) corners: along the axis from `first`, distance from it [m]."""
        raise NotImplementedError

    def bounds(self) -> np.ndarray:
        a, axis, _ = _axis(self.first, self.second)
        ends = [a + along * axis + sign * r * np.sqrt(np.maximum(1.0 - axis * axis, 0.0))
                for along, r in self.outline() for sign in (-1.0, 1.0)]  # fmt: skip
        return np.array([np.min(ends, axis=0), np.max(ends, axis=0)])

    def distance(self, points: np.ndarray) -> np.ndarray:
        return outline_distance(self.outline(), self.half_plane(points), on_axis=True)

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        at, corners = self.half_plane(points), self.outline()
        return [_from_line(a, b, at) for a, b in _sides(corners) if not (a[1] == b[1] == 0.0)]

    def half_plane(self, points: np.ndarray) -> np.ndarray:
        """(n, 2): where points are along the axis and away from it [m]."""
        a, axis, _ = _axis(self.first, self.second)
        along = (points - a) @ axis
        across = np.sqrt(np.maximum(((points - a - along[:, None] * axis) ** 2).sum(axis=1), 0.0))
        return np.column_stack([along, across])


@dataclass(frozen=True)
class Cylinder(_Round):
    """A circular cylinder between the centres of its ends [m]."""

    first: Point
    second: Point
    radius: float

    def check(self) -> None:
        if not self.radius > 0.0 or self.first == self.second:
            raise CommandError("a cylinder needs two ends that are apart, and a radius above 0")

    def outline(self) -> np.ndarray:
        length = _axis(self.first, self.second)[2]
        return np.array([[0.0, 0.0], [0.0, self.radius], [length, self.radius], [length, 0.0]])


@dataclass(frozen=True)
class Cone(_Round):
    """A circular cone with a radius at each end [m], one of which may be 0."""

    first: Point
    second: Point
    radius: float
    other: float

    def check(self) -> None:
        if self.first == self.second or min(self.radius, self.other) < 0.0 or self.radius == self.other:
            raise CommandError(
                "a cone needs two ends that are apart, and two radii that differ, none of them below 0; with equal "
                "radii it is a cylinder"
            )

    def outline(self) -> np.ndarray:
        length = _axis(self.first, self.second)[2]
        ends = [[0.0, 0.0], [0.0, self.radius], [length, self.other], [length, 0.0]]
        return np.array([p for i, p in enumerate(ends) if p != ends[i - 1]])


@dataclass(frozen=True)
class Extruded(Body):
    """A polygon (its corners) extruded along a vector [m]."""

    corners: tuple[Point, ...]
    vector: Point

    def check(self) -> None:
        Polygon(self.corners).check()
        _, normal = _plane(self.corners)
        if abs(normal @ np.array(self.vector)) <= IN_PLANE * float(np.linalg.norm(self.vector)):
            raise CommandError("the extrusion vector must not lie in the plane of the polygon")

    def bounds(self) -> np.ndarray:
        ends = np.concatenate([np.array(self.corners), np.array(self.corners) + self.vector])
        return np.array([ends.min(axis=0), ends.max(axis=0)])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Outside of an oblique one, and beyond its edges, a lower bound."""
        beside, ends = self._beside(points), self._ends(points)
        beyond = np.maximum(ends[0], ends[1])
        outside = np.sqrt(np.maximum(beside, 0.0) ** 2 + np.maximum(beyond, 0.0) ** 2)
        _, normal = _plane(self.corners)
        if abs(normal @ _unit(self.vector)) < 1.0 - 1e-9:
            outside = np.maximum(np.maximum(beside, beyond), 0.0)
        return outside + np.minimum(np.maximum(beside, beyond), 0.0)

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        frame = _frame(_unit(self.vector))
        at, corners = points @ frame.T, np.array(self.corners) @ frame.T
        return [*self._ends(points), *(_from_line(a, b, at) for a, b in _sides(corners))]

    def _beside(self, points: np.ndarray) -> np.ndarray:
        """Distance from the infinite lateral surface, negative inside."""
        frame = _frame(_unit(self.vector))
        return outline_distance(np.array(self.corners) @ frame.T, points @ frame.T)

    def _ends(self, points: np.ndarray) -> list[np.ndarray]:
        """Distance beyond the planes of the ends."""
        at, normal = _plane(self.corners)
        normal = normal * math.copysign(1.0, normal @ np.array(self.vector))
        return [-(points - at) @ normal, (points - at - self.vector) @ normal]


@dataclass(frozen=True)
class Revolved(Body):
    """A polygon (its corners) revolved about an axis in its plane by an angle [degrees], right-handed."""

    corners: tuple[Point, ...]
    about: Point
    axis: Point
    angle: float

    def check(self) -> None:
        Polygon(self.corners).check()
        if not any(self.axis) or not 0.0 < self.angle <= FULL:
            raise CommandError(
                "revolving a polygon needs an axis with a length above 0, and an angle from 0 to 360 degrees"
            )
        flat, at = self._flat(), np.array(self.corners)
        size = float(np.ptp(at, axis=0).max())
        _, normal = _plane(self.corners)
        off = abs(normal @ _unit(self.axis)), abs(normal @ (np.array(self.about) - at[0])) / size
        if max(off) > IN_PLANE:
            raise CommandError("the axis of revolution must lie in the plane of the polygon")
        if flat[:, 1].min() < -IN_PLANE * size:
            raise CommandError("the axis of revolution must not cross the polygon")

    def _flat(self) -> np.ndarray:
        """(k, 2) corners: along the axis, distance from it towards the polygon [m]; tiny ones are 0."""
        axis, out = _unit(self.axis), self._outwards()
        offset = np.array(self.corners) - self.about
        flat = np.column_stack([offset @ axis, offset @ out])
        flat[np.abs(flat[:, 1]) < IN_PLANE * np.ptp(flat, axis=0).max(), 1] = 0.0
        return flat

    def _outwards(self) -> np.ndarray:
        """Unit vector from the axis towards the corner that is farthest from it."""
        axis = _unit(self.axis)
        offset = np.array(self.corners) - self.about
        offset = offset - (offset @ axis)[:, None] * axis
        return _unit(offset[np.argmax((offset * offset).sum(axis=1))])

    def _turned(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points in the half plane (n, 2), and their angle from the polygon (n,) [rad], from -pi to pi."""
        axis, out = _unit(self.axis), self._outwards()
        offset = points - np.array(self.about)
        x, y = offset @ out, offset @ np.cross(axis, out)
        return np.column_stack([offset @ axis, np.hypot(x, y)]), np.arctan2(y, x)

    def bounds(self) -> np.ndarray:
        axis = _unit(self.axis)
        across = np.sqrt(np.maximum(1.0 - axis * axis, 0.0))
        ends = [np.array(self.about) + along * axis + sign * r * across
                for along, r in self._flat() for sign in (-1.0, 1.0)]  # fmt: skip
        return np.array([np.min(ends, axis=0), np.max(ends, axis=0)])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Beyond the ends of a part of a turn a lower bound."""
        at, _ = self._turned(points)
        found = outline_distance(self._flat(), at, on_axis=True)
        if self.angle < FULL:
            before, after = self._planes(points)
            wedge = np.maximum(before, after) if self.angle <= 180.0 else np.minimum(before, after)
            found = np.maximum(found, wedge)
        return found

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        at, _ = self._turned(points)
        sides = [_from_line(a, b, at) for a, b in _sides(self._flat()) if not (a[1] == b[1] == 0.0)]
        return [*sides, *(self._planes(points) if self.angle < FULL else ())]

    def _planes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance before the first and behind the last half plane."""
        axis, out = _unit(self.axis), self._outwards()
        offset, turn = points - np.array(self.about), math.radians(self.angle)
        across = np.cross(axis, out)
        last = math.cos(turn) * across - math.sin(turn) * out
        return -(offset @ across), offset @ last


@dataclass(frozen=True)
class Shell(Body):
    """Body enclosed by a closed shell of triangles that was read from a file (three corners per triangle)."""

    corners: tuple[Point, ...]

    def check(self) -> None:
        """CommandError if it is not closed: each side belongs to two triangles, which run along it opposite ways."""
        if not self.corners or len(self.corners) % 3:
            raise CommandError("a shell needs triangles")
        _, number = np.unique(np.array(self.corners, np.float64), axis=0, return_inverse=True)
        of = number.reshape(-1, 3)
        if ((of == np.roll(of, 1, axis=1)).any(axis=1)).any():
            where = int(np.flatnonzero((of == np.roll(of, 1, axis=1)).any(axis=1))[0])
            raise CommandError(f"triangle {where + 1} of the shell has the same corner twice")
        edges = np.concatenate([of, np.roll(of, -1, axis=1)]).reshape(2, -1).T
        found, times = np.unique(edges, axis=0, return_counts=True)
        back = {(int(b), int(a)) for a, b in found}
        lost = [(a, b) for a, b in found.tolist() if (a, b) not in back]
        if lost or (times > 1).any():
            a = lost[0][0] if lost else int(found[times > 1][0][0])
            at = np.array(self.corners)[np.flatnonzero(number.reshape(-1) == a)[0]]
            raise CommandError(
                f"the shell is not closed, or its triangles do not all face outwards: near ({at[0]:g}, {at[1]:g}, "
                f"{at[2]:g}) a side has no triangle across it that runs the other way"
            )

    def triangles(self) -> np.ndarray:
        """(k, 3, 3) corners [m]."""
        return np.array(self.corners, np.float64).reshape(-1, 3, 3)

    def bounds(self) -> np.ndarray:
        at = np.array(self.corners)
        return np.array([at.min(axis=0), at.max(axis=0)])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """The nearest triangle says how far; the sum of the solid angles of all is 4 pi inside (van Oosterom & Strackee
        1983)."""
        far, angle = np.full(len(points), np.inf), np.zeros(len(points))
        for triangle in self.triangles():
            far = np.minimum(far, _from_triangle(triangle, points))
            a, b, c = (corner - points for corner in triangle)
            la, lb, lc = (np.sqrt((v * v).sum(axis=1)) for v in (a, b, c))
            dot = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
            angle += 2.0 * np.arctan2((a * np.cross(b, c)).sum(axis=1), dot)
        inside = np.round(np.abs(angle) / (4.0 * math.pi)).astype(np.int64) % 2 == 1  # a cavity lies within two shells
        return np.where(inside, -far, far)

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the distances to each plane: triangles in one plane are one part."""
        planes: dict[tuple[float, ...], tuple[np.ndarray, np.ndarray]] = {}
        size = float(np.ptp(np.array(self.corners), axis=0).max())
        for a, b, c in self.triangles():
            n = np.cross(b - a, c - a)
            n /= math.sqrt(n @ n)
            planes.setdefault((*np.round(n, 6).tolist(), round(float(n @ a) / size, 6)), (a, n))
        return [(points - a) @ n for a, n in planes.values()]


@dataclass(frozen=True)
class Brep(Body):
    """A solid of a CAD file: its text as OpenCASCADE writes it (BREP), in metres, and the triangles of a picture of it,
    by which ranges know it."""

    text: str
    corners: tuple[Point, ...]
    faces: tuple[float, ...]
    """Number of the face of each triangle."""
    name: str = ""
    """Name in the file."""

    def check(self) -> None:
        if not self.text or not self.corners:
            raise CommandError("a solid of a CAD file needs its text and triangles")

    def shell(self) -> Shell:
        """Return the shell of its triangles."""
        return Shell(self.corners)

    def bounds(self) -> np.ndarray:
        return self.shell().bounds()

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return distances to the triangles, which approximate curved faces."""
        return self.shell().distance(points)

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the distances to each face."""
        triangles, of = self.shell().triangles(), np.array(self.faces)
        return [
            np.min([_from_triangle(one, points) for one in triangles[of == face]], axis=0) for face in np.unique(of)
        ]


class Surface:
    """Surface without an inside."""

    surface = True

    def check(self) -> None:
        """CommandError if it has no area."""
        raise NotImplementedError

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance of points (n, 3) from it [m]."""
        at, normal = self.plane()
        off = np.abs((points - at) @ normal)
        return np.hypot(off, np.maximum(self.beyond(points), 0.0))

    def parts(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the distances (n,) to each part; a surface has one."""
        return [self.distance(points)]

    def plane(self) -> tuple[np.ndarray, np.ndarray]:
        """A point of it and its unit normal."""
        raise NotImplementedError

    def beyond(self, points: np.ndarray) -> np.ndarray:
        """(n,) how far the feet of points on its plane lie outside of its rim [m], negative inside."""
        raise NotImplementedError


@dataclass(frozen=True)
class Polygon(Surface):
    """A plane polygon, by its corners in order [m]."""

    corners: tuple[Point, ...]

    def check(self) -> None:
        if len(self.corners) < 3:
            raise CommandError(f"a polygon needs three corners, got {len(self.corners)}")
        at = np.array(self.corners, np.float64)
        size = float(np.ptp(at, axis=0).max())
        middle, normal = _plane(self.corners)
        if not np.isfinite(normal).all():
            raise CommandError("the corners of a polygon lie on one line")
        if float(np.abs((at - middle) @ normal).max()) > IN_PLANE * size:
            raise CommandError("the corners of a polygon do not lie in one plane")
        if (at == np.roll(at, 1, axis=0)).all(axis=1).any():
            raise CommandError("two successive corners of a polygon coincide")

    def plane(self) -> tuple[np.ndarray, np.ndarray]:
        return _plane(self.corners)

    def beyond(self, points: np.ndarray) -> np.ndarray:
        frame = _frame(self.plane()[1])
        return outline_distance(np.array(self.corners) @ frame.T, points @ frame.T)


@dataclass(frozen=True)
class Disc(Surface):
    """A plane disc: centre [m], normal of any length, radius [m]."""

    centre: Point
    normal: Point
    radius: float

    def check(self) -> None:
        if not self.radius > 0.0 or not any(self.normal):
            raise CommandError("a disc needs a normal and a radius above 0")

    def plane(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.centre), _unit(self.normal)

    def beyond(self, points: np.ndarray) -> np.ndarray:
        at, normal = self.plane()
        offset = points - at
        offset = offset - (offset @ normal)[:, None] * normal
        return np.sqrt((offset * offset).sum(axis=1)) - self.radius


@dataclass(frozen=True)
class Plane(Surface):
    """Infinite plane: a point [m] and a normal of any length."""

    point: Point
    normal: Point

    def check(self) -> None:
        if not any(self.normal):
            raise CommandError("a plane needs a normal")

    def plane(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.point), _unit(self.normal)

    def beyond(self, points: np.ndarray) -> np.ndarray:
        return np.full(len(points), -np.inf)


Solid = Body | Surface
KINDS: dict[str, Any] = {
    "box": Box, "sphere": Sphere, "cylinder": Cylinder, "cone": Cone, "extrude": Extruded, "revolve": Revolved,
    "shell": Shell, "brep": Brep, "polygon": Polygon, "disc": Disc, "plane": Plane,
}  # fmt: skip


def made(kind: str, *values: Any) -> Any:
    """A checked body or surface of this kind. CommandError if it has no volume or area."""
    solid = KINDS[kind](*map(_plain, values))
    solid.check()
    return solid


_PLACES, _VECTORS, _LENGTHS = (
    {"first", "second", "centre", "corners", "about", "point"},
    {"vector"},
    {"radius", "other"},
)
"""Fields of solids that are points, vectors between points, or lengths. Of the others, `normal` stays perpendicular to
its surface, and `axis` rotates."""


def transformed(
    solid: Any,
    translate: Sequence[float] = (0.0, 0.0, 0.0),
    rotate: float = 0.0,
    scale: float | Sequence[float] = 1.0,
    about: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> Any:
    """Scale a solid, rotate it by an angle [degrees], right-handed about an axis through the point `about`, then
    translate it [m].

    A negative factor mirrors. CommandError if a round solid would become oval, for a solid of a CAD file, and if a
    number is not finite or an axis or factor is zero.
    """
    factors = np.broadcast_to(np.array(scale, np.float64), 3)
    numbers = np.concatenate([factors, translate, about, axis, [rotate]]).astype(np.float64)
    if not np.isfinite(numbers).all() or not factors.all() or not any(axis):
        raise CommandError(
            "transform: factors, an axis, vectors and the angle must be finite, factors and axis not zero"
        )
    name = next(kind for kind, of in KINDS.items() if type(solid) is of)
    if name == "brep":
        raise CommandError(
            "a solid of a CAD file cannot be transformed: use geometry import scale, or change it in the CAD program"
        )
    if isinstance(solid, (Sphere, _Round, Revolved, Disc)) and np.ptp(np.abs(factors)) > 0.0:
        raise CommandError(f"transform: factors ({', '.join(f'{f:g}' for f in factors)}) would make a {name} oval")
    turn = Rotation.from_rotvec(math.radians(rotate) * _unit(axis)).as_matrix()
    if rotate % 90.0 == 0.0 and np.count_nonzero(axis) == 1:
        turn = np.round(turn)  # so that what lies along the axes stays so
    matrix, centre = turn * factors, np.array(about, np.float64)
    if isinstance(solid, Box) and np.count_nonzero(matrix) > 3:
        (x, y, z), (u, v, w) = solid.bounds().tolist()
        solid, name = made("extrude", ((x, y, z), (u, y, z), (u, v, z), (x, v, z)), (0.0, 0.0, w - z)), "extrude"
    mirrors = float(np.prod(np.sign(factors)))

    def new(field: str, value: Any) -> Any:
        if field in _PLACES:
            return ((np.array(value) - centre) @ matrix.T + centre + translate).tolist()
        if field in _LENGTHS:
            return value * abs(factors[0])
        if field in _VECTORS:
            return (matrix @ value).tolist()
        if field == "normal":
            return (np.linalg.inv(matrix).T @ value).tolist()
        return (mirrors * (matrix @ value)).tolist() if field == "axis" else value

    values = [new(field, value) for field, value in asdict(solid).items()]
    if name == "shell" and mirrors < 0.0:  # its triangles face outwards
        values[0] = np.array(values[0]).reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3).tolist()
    return made(name, *values)


def _plain(value: Any) -> Any:
    """Vectors and rows of them as tuples, numbers as floats, texts as they are."""
    if isinstance(value, (tuple, list)):
        return tuple(_plain(one) for one in value)
    return value if isinstance(value, str) else float(value)


def on_surface(solid: Any, points: np.ndarray, slack: float) -> np.ndarray:
    """(n,) bool: all of the points (n, k, 3) of each object lie on the surface, within `slack` [m]; of a face on one
    smooth part of it: a flat side, an end or the mantle."""
    flat = points.reshape(-1, 3)
    on = (np.abs(solid.distance(flat)) <= slack).reshape(points.shape[:2]).all(axis=1)
    if points.shape[1] == 1 or not on.any():
        return on
    rows = np.flatnonzero(on)
    parts = solid.parts(points[rows].reshape(-1, 3))
    together = [(np.abs(part).reshape(len(rows), -1) <= slack).all(axis=1) for part in parts]
    on[rows] = np.any(together, axis=0)
    return on


def state(solids: Sequence[Any]) -> list[list[Any]]:
    """Convert solids to JSON values: name of the kind and field values of each."""
    names = {of: name for name, of in KINDS.items()}
    return [[names[type(one)], list(asdict(one).values())] for one in solids]


def restored(given: list[list[Any]]) -> list[Any]:
    """Inverse of `state`."""
    return [made(kind, *values) for kind, values in given]


# --- plane and space --------------------------------------------------------------------------------------------------


def outline_distance(corners: np.ndarray, at: np.ndarray, on_axis: bool = False) -> np.ndarray:
    """(n,) distance of points (n, 2) from the sides of a polygon (k, 2), negative inside; on_axis: sides on the axis
    (second coordinate 0) are none."""
    far, inside = np.full(len(at), np.inf), np.zeros(len(at), bool)
    x, y = at[:, 0], at[:, 1]
    if on_axis:  # on the axis itself no side decides whether a point is inside: one a hair away from it does
        y = np.maximum(y, 1e-9 * float(np.ptp(corners, axis=0).max()))
    for a, b in _sides(corners):
        edge = b - a
        if not (on_axis and a[1] == b[1] == 0.0):
            t = np.clip((at - a) @ edge / (edge @ edge), 0.0, 1.0)
            rest = at - a - t[:, None] * edge
            far = np.minimum(far, np.sqrt((rest * rest).sum(axis=1)))
        if edge[1] != 0.0:
            crosses = (a[1] > y) != (b[1] > y)
            inside ^= crosses & (x < a[0] + (y - a[1]) * edge[0] / edge[1])
    return np.where(inside, -far, far)


def _sides(corners: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(zip(corners, np.roll(corners, -1, axis=0), strict=True))


def _from_line(a: np.ndarray, b: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 2) from the line through two others."""
    edge = (b - a) / math.sqrt((b - a) @ (b - a))
    return (at[:, 0] - a[0]) * edge[1] - (at[:, 1] - a[1]) * edge[0]


def _from_triangle(triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 3) from a triangle (3, 3)."""
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    frame = _frame(normal / math.sqrt(normal @ normal))
    beyond = outline_distance(triangle @ frame.T, points @ frame.T)
    off = (points - triangle[0]) @ normal / math.sqrt(normal @ normal)
    return np.hypot(off, np.maximum(beyond, 0.0))


def _axis(first: Point, second: Point) -> tuple[np.ndarray, np.ndarray, float]:
    """First end, unit vector to the second, length [m]."""
    a = np.array(first)
    length = float(np.linalg.norm(np.array(second) - a))
    return a, (np.array(second) - a) / length, length


def _unit(v: Any) -> np.ndarray:
    v = np.asarray(v, np.float64)
    return v / np.sqrt(v @ v)


def _frame(normal: np.ndarray) -> np.ndarray:
    """(2, 3) two unit vectors that make a right-handed frame with a unit normal."""
    least = np.eye(3)[int(np.argmin(np.abs(normal)))]
    u = _unit(np.cross(normal, least))
    return np.array([u, np.cross(normal, u)])


def _plane(corners: Sequence[Point]) -> tuple[np.ndarray, np.ndarray]:
    """Middle and unit normal (Newell's) of a polygon; NaN if its corners lie on a line."""
    at = np.array(corners, np.float64)
    normal = np.cross(at - at[0], np.roll(at, -1, axis=0) - at[0]).sum(axis=0)
    length = math.sqrt(normal @ normal)
    size = float(np.ptp(at, axis=0).max())
    return at.mean(axis=0), normal / length if length > 1e-12 * size * size else np.full(3, np.nan)
