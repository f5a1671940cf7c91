"""What a mesh is like: sizes, angles, shapes, and where the worst element is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.mesh import Mesh


@dataclass(frozen=True)
class Quality:
    """Figures of a mesh; angles in degrees, lengths in metres, elements by their number."""

    points: int
    triangles: int
    quads: int
    edges: int
    inner_edges: int
    crack_edges: int
    crack_length: float
    area: float
    edge_least: float
    edge_mean: float
    edge_greatest: float
    angle_least: float
    angle_least_element: int
    angle_least_at: tuple[float, float]
    angle_greatest: float
    angles_below: dict[int, int]
    """Elements with an angle below 10, 20, 30 degrees."""
    aspect_mean: float
    aspect_greatest: float
    aspect_greatest_element: int
    altitude_least: float
    """Least height over an edge; the time step follows it."""
    altitude_least_element: int

    def lines(self) -> list[str]:
        """The figures as text."""
        x, y = self.angle_least_at
        below = ", ".join(f"{n} below {a}" for a, n in self.angles_below.items())
        return [
            f"elements       {self.triangles} triangles, {self.quads} quads; {self.points} points",
            f"area           {self.area:g} m2",
            f"edges          {self.edges}, {self.inner_edges} of them inside; "
            f"{self.crack_edges} cracks of together {self.crack_length:g} m",
            f"edge length    {self.edge_least:g} to {self.edge_greatest:g}, mean {self.edge_mean:g} m",
            f"angles         {self.angle_least:.1f} (element {self.angle_least_element} at {x:g}, {y:g}) to "
            f"{self.angle_greatest:.1f} degrees; elements: {below}",
            f"aspect         mean {self.aspect_mean:.3f}, worst {self.aspect_greatest:.2f} "
            f"(element {self.aspect_greatest_element}); 1 is an equilateral triangle or a square",
            f"least altitude {self.altitude_least:g} m (element {self.altitude_least_element})",
        ]


def corner_angles(mesh: Mesh) -> np.ndarray:
    """(ne, 4) f8 angle at each corner [degrees], nan for the fourth of a triangle."""
    out = np.full(mesh.cells.shape, np.nan)
    for rows, xy in _by_kind(mesh):
        n = xy.shape[1]
        to_next, to_last = np.roll(xy, -1, axis=1) - xy, np.roll(xy, 1, axis=1) - xy
        cross = to_next[..., 0] * to_last[..., 1] - to_next[..., 1] * to_last[..., 0]
        out[rows, :n] = np.degrees(np.arctan2(cross, (to_next * to_last).sum(axis=2)))
    return out


def aspects(mesh: Mesh) -> np.ndarray:
    """(ne,) square of the longest edge over the area, in units of the best possible: 1 equilateral or square."""
    out = np.empty(len(mesh.cells))
    area = mesh.areas()
    for rows, xy in _by_kind(mesh):
        longest2 = ((np.roll(xy, -1, axis=1) - xy) ** 2).sum(axis=2).max(axis=1)
        out[rows] = longest2 / area[rows] * (np.sqrt(3.0) / 4.0 if xy.shape[1] == 3 else 1.0)
    return out


def altitudes(mesh: Mesh) -> np.ndarray:
    """(ne,) least height [m]: 2 area / longest edge of a triangle; of a quad the least of its four corner triangles;
    3 volumes / largest face of a tetrahedron."""
    if mesh.dim == 3:
        return 3.0 * mesh.areas() / mesh.face_sizes(np.arange(mesh.cells.size)).reshape(-1, 4).max(axis=1)
    out = np.empty(len(mesh.cells))
    for rows, xy in _by_kind(mesh):
        a, b, c = np.roll(xy, 1, axis=1), xy, np.roll(xy, -1, axis=1)
        doubled = (b - a)[..., 0] * (c - b)[..., 1] - (b - a)[..., 1] * (c - b)[..., 0]
        longest2 = np.max([((q - p) ** 2).sum(axis=2) for p, q in ((a, b), (b, c), (c, a))], axis=0)
        out[rows] = (doubled / np.sqrt(longest2)).min(axis=1)
    return out


def quality(mesh: Mesh) -> Quality:
    """Measure a mesh that `check` accepts."""
    edges = mesh.edges()
    length = np.hypot(*(mesh.points[edges.points[:, 1]] - mesh.points[edges.points[:, 0]]).T)
    crack = np.hypot(*(mesh.points[mesh.cracks[:, 1]] - mesh.points[mesh.cracks[:, 0]]).T)
    angles = corner_angles(mesh)
    least = np.nanmin(angles, axis=1)
    aspect, altitude = aspects(mesh), altitudes(mesh)
    sharp, thin, odd = int(least.argmin()), int(altitude.argmin()), int(aspect.argmax())
    x, y = mesh.centroids()[sharp]
    triangles = int((corner_counts(mesh.cells) == 3).sum())
    return Quality(
        points=len(mesh.points),
        triangles=triangles,
        quads=len(mesh.cells) - triangles,
        edges=len(edges),
        inner_edges=int(edges.inner.sum()),
        crack_edges=len(crack),
        crack_length=float(crack.sum()),
        area=float(mesh.areas().sum()),
        edge_least=float(length.min()),
        edge_mean=float(length.mean()),
        edge_greatest=float(length.max()),
        angle_least=float(least[sharp]),
        angle_least_element=sharp,
        angle_least_at=(float(x), float(y)),
        angle_greatest=float(np.nanmax(angles)),
        angles_below={a: int((least < a).sum()) for a in (10, 20, 30)},
        aspect_mean=float(aspect.mean()),
        aspect_greatest=float(aspect[odd]),
        aspect_greatest_element=odd,
        altitude_least=float(altitude[thin]),
        altitude_least_element=thin,
    )


def _by_kind(mesh: Mesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows of triangles and of quads, each with their corners (m, 3 or 4, 2)."""
    counts = corner_counts(mesh.cells)
    rows = [(np.flatnonzero(counts == n), n) for n in (3, 4)]
    return [(r, mesh.points[mesh.cells[r, :n]]) for r, n in rows if len(r)]
