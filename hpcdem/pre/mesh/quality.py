"""Quality of a mesh: element sizes, angles and shapes, and the position of the worst element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.hexahedra import PARTS
from hpcdem.physics.fdem.mesh import Mesh, sizes


@dataclass(frozen=True)
class Quality:
    """Quality measures of a mesh; angles in degrees, lengths in metres; elements by number, hexahedra by that of their
    first element. In space, angles are those between the sides of an element; `edges`, `crack_edges` and `crack_length`
    are faces and areas [m2], `area` is the volume [m3].
    """

    dim: int
    points: int
    triangles: int
    quads: int
    tetrahedra: int
    hexahedra: int
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
    angle_least_at: tuple[float, ...]
    angle_greatest: float
    angles_below: dict[int, int]
    """Number of elements with an angle below 10, 20 and 30 degrees."""
    aspect_mean: float
    aspect_greatest: float
    aspect_greatest_element: int
    altitude_least: float
    """Smallest height of an element over an edge; the time step follows from it."""
    altitude_least_element: int

    def lines(self) -> list[str]:
        """The figures as text."""
        place = ", ".join(f"{c:g}" for c in self.angle_least_at)
        kinds, size, faces, unit, best = _WORDS[self.dim]
        counts = ", ".join(f"{getattr(self, kind)} {kind}" for kind in kinds)
        below = ", ".join(f"{n} below {a}" for a, n in self.angles_below.items())
        return [
            f"elements       {counts}; {self.points} points",
            f"{size:15}{self.area:g} m{self.dim}",
            f"{faces:15}{self.edges}, {self.inner_edges} of them inside; "
            f"{self.crack_edges} cracks of together {self.crack_length:g} {unit}",
            f"edge length    {self.edge_least:g} to {self.edge_greatest:g}, mean {self.edge_mean:g} m",
            f"angles         {self.angle_least:.1f} (element {self.angle_least_element} at {place}) to "
            f"{self.angle_greatest:.1f} degrees; elements: {below}",
            f"aspect         mean {self.aspect_mean:.3f}, worst {self.aspect_greatest:.2f} "
            f"(element {self.aspect_greatest_element}); 1 is {best}",
            f"least altitude {self.altitude_least:g} m (element {self.altitude_least_element})",
        ]


_WORDS = {
    2: (("triangles", "quads"), "area", "edges", "m", "an equilateral triangle or a square"),
    3: (("tetrahedra", "hexahedra"), "volume", "faces", "m2", "a regular tetrahedron or a cube"),
}
_BESIDE = {
    4: np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]),
    8: np.array([[1, 3, 4], [0, 2, 5], [1, 3, 6], [0, 2, 7], [0, 5, 7], [1, 4, 6], [2, 5, 7], [3, 4, 6]]),
}
"""Corners adjacent to each corner of a tetrahedron, and of a hexahedron."""


def corner_angles(mesh: Mesh) -> np.ndarray:
    """(ne, 4) f8 angle at each corner [degrees], nan for the fourth of a triangle; in space (ne, 24) angles between the
    sides that meet at each corner, nan for what there is not."""
    out = np.full((len(mesh.cells), 4 if mesh.dim == 2 else 24), np.nan)
    for rows, xy in _by_kind(mesh):
        n = xy.shape[1]
        if mesh.dim == 3:
            out[rows, : 3 * n] = _between_sides(xy)
            continue
        to_next, to_last = np.roll(xy, -1, axis=1) - xy, np.roll(xy, 1, axis=1) - xy
        cross = to_next[..., 0] * to_last[..., 1] - to_next[..., 1] * to_last[..., 0]
        out[rows, :n] = np.degrees(np.arctan2(cross, (to_next * to_last).sum(axis=2)))
    return out


def _between_sides(xyz: np.ndarray) -> np.ndarray:
    """(m, 3 n) angles [degrees] of elements in space with corners (m, n, 3)."""
    edge_vectors = xyz[:, _BESIDE[xyz.shape[1]]] - xyz[:, :, None]
    out = []
    for k in range(3):
        a, b, c = edge_vectors[:, :, k], edge_vectors[:, :, k - 1], edge_vectors[:, :, k - 2]
        b, c = np.cross(a, b), np.cross(a, c)
        sine = np.linalg.norm(np.cross(b, c), axis=2)
        out.append(np.degrees(np.arctan2(sine, (b * c).sum(axis=2))))
    return np.concatenate(out, axis=1)


def aspects(mesh: Mesh) -> np.ndarray:
    """(ne,) square of the longest edge over the area, in space its cube over the volume, in units of the best possible:
    1 equilateral or square, regular or a cube. nan for all elements of a hexahedron but the first."""
    out = np.full(len(mesh.cells), np.nan)
    area = mesh.areas()
    for rows, xy in _by_kind(mesh):
        if mesh.dim == 3:
            longest = np.linalg.norm(xy[:, _BESIDE[xy.shape[1]]] - xy[:, :, None], axis=3).max(axis=(1, 2))
            whole = rows if xy.shape[1] == 4 else rows[:, None] + np.arange(PARTS)
            size = area[whole].reshape(len(rows), -1).sum(axis=1)
            out[rows] = longest**3 / size * (np.sqrt(2.0) / 12.0 if xy.shape[1] == 4 else 1.0)
            continue
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
    inner = edges.inner & ~mesh.inside_macros(edges.faces[:, 0])
    ends = edges.points
    if mesh.dim == 3:
        tets = mesh.cells[mesh.macro_of() < 0]
        both = [np.stack(np.broadcast_arrays(of[:, :, None], of[:, _BESIDE[of.shape[1]]]), axis=3)
                for of in (tets, mesh.hexes[:, :8])]  # fmt: skip
        ends = np.unique(np.sort(np.concatenate([of.reshape(-1, 2) for of in both]), axis=1), axis=0)
    length = np.linalg.norm(mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1)
    crack = sizes(mesh.points[mesh.cracks])
    angles = corner_angles(mesh)
    least = np.where(np.isnan(angles), np.inf, angles).min(axis=1)
    aspect, altitude = aspects(mesh), altitudes(mesh)
    sharp, thin, odd = int(least.argmin()), int(altitude.argmin()), int(np.nanargmax(aspect))
    triangles, plane = int((corner_counts(mesh.cells) == 3).sum()), mesh.dim == 2
    return Quality(
        dim=mesh.dim,
        points=len(mesh.points),
        triangles=triangles if plane else 0,
        quads=len(mesh.cells) - triangles if plane else 0,
        tetrahedra=0 if plane else len(mesh.cells) - PARTS * len(mesh.hexes),
        hexahedra=len(mesh.hexes),
        edges=len(edges) - int(mesh.inside_macros(edges.faces[:, 0]).sum()),
        inner_edges=int(inner.sum()),
        crack_edges=len(crack),
        crack_length=float(crack.sum()),
        area=float(mesh.areas().sum()),
        edge_least=float(length.min()),
        edge_mean=float(length.mean()),
        edge_greatest=float(length.max()),
        angle_least=float(least[sharp]),
        angle_least_element=sharp,
        angle_least_at=tuple(mesh.centroids()[sharp].tolist()),
        angle_greatest=float(np.nanmax(angles)),
        angles_below={a: int((least < a).sum()) for a in (10, 20, 30)},
        aspect_mean=float(np.nanmean(aspect)),
        aspect_greatest=float(aspect[odd]),
        aspect_greatest_element=odd,
        altitude_least=float(altitude[thin]),
        altitude_least_element=thin,
    )


def _by_kind(mesh: Mesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows of triangles and of quads, each with their corners (m, 3 or 4, 2); of tetrahedra and of hexahedra, these by
    their first element, (m, 4 or 8, 3)."""
    if mesh.dim == 3:
        tets, first = np.flatnonzero(mesh.macro_of() < 0), mesh.hexes[:, 8]
        both = [(tets, mesh.points[mesh.cells[tets]]), (first, mesh.points[mesh.hexes[:, :8]])]
        return [one for one in both if len(one[0])]
    counts = corner_counts(mesh.cells)
    rows = [(np.flatnonzero(counts == n), n) for n in (3, 4)]
    return [(r, mesh.points[mesh.cells[r, :n]]) for r, n in rows if len(r)]
