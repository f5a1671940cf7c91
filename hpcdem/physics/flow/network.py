"""Network of possible flow: pure functions of the mesh and of the joints with a hydraulic model, equal on all ranks.

A *channel* is a joint with a hydraulic model, broken or not, between two elements that are there; it has the number of
the joint, its lower face. A *flow node* is a point of the mesh at which a channel ends, and has the number of the
point: however many corners of elements have parted there, they share one pressure. Fluid goes along *links* between two
nodes: in the plane the channel itself, in space the three sides of its triangle, of which each stands for a third.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.mesh import Mesh


@dataclass(frozen=True)
class Shape:
    """Geometry of channels. links: corners between which fluid flows; facing: the corner of the other face opposite
    each."""

    links: tuple[tuple[int, int], ...]
    facing: tuple[int, ...]


EDGE = Shape(((0, 1),), (1, 0))
TRIANGLE = Shape(((1, 2), (2, 0), (0, 1)), (0, 2, 1))
SHAPES = {2: EDGE, 3: TRIANGLE}
"""Shape of channels by the number of their corners, which equals the dimension of space."""
LINKS = {corners: len(shape.links) for corners, shape in SHAPES.items()}
"""Number of links of a channel."""


@dataclass(frozen=True)
class Network:
    """channels (m,): joints, ascending; corners (m, 2), in space (m, 3): points of the mesh at which they end, in the
    direction of the lower face; ends (l, 2): those of their links, see `links_of`; nodes (n,): points, ascending; there
    (np,) bool: points that are nodes."""

    channels: np.ndarray
    corners: np.ndarray
    ends: np.ndarray
    nodes: np.ndarray
    there: np.ndarray

    @staticmethod
    def of(mesh: Mesh, channels: np.ndarray) -> Network:
        """The network of these channels (lower faces, ascending)."""
        corners = mesh.face_points(channels)
        there = np.zeros(len(mesh.points), bool)
        there[corners] = True
        return Network(channels, corners, links_of(corners), np.flatnonzero(there), there)


def links_of(corners: np.ndarray) -> np.ndarray:
    """(l, 2) ends of the links of channels with these corners (m, 2) or (m, 3): the sides of triangles one after the
    other, the k-th opposite the k-th corner."""
    return corners[:, np.array(SHAPES[corners.shape[1]].links)].reshape(-1, 2)


def normals(corners: np.ndarray) -> np.ndarray:
    """Outward normals (m, dim) of faces (m, dim, dim), as long as edges, twice as long as triangles are large."""
    edges = corners[:, 1:] - corners[:, :1]
    if edges.shape[1] == 1:
        return np.column_stack([edges[:, 0, 1], -edges[:, 0, 0]])
    return np.cross(edges[:, 0], edges[:, 1])


def conducting(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the geometry of links (l,) of channels with these corners (m, dim, dim): vectors from end to end (l, dim)
    [m]; length over width of the conducting part [m, in space 1], below 0 opposite an obtuse angle; part of a wall at
    each end [m, in space m2]."""
    ends = links_of(np.arange(corners.shape[1])[None])
    sides = corners[:, ends[:, 1]] - corners[:, ends[:, 0]]
    if len(ends) == 1:
        length = np.hypot(*sides[:, 0].T)
        return sides[:, 0], length, 0.5 * length
    double = np.linalg.norm(normals(corners), axis=1)
    one, other = corners[:, [1, 2, 0]] - corners, corners[:, [2, 0, 1]] - corners
    with np.errstate(divide="ignore"):
        edges = 2.0 * double[:, None] / (one * other).sum(axis=2)
    return sides.reshape(-1, 3), edges.reshape(-1), np.repeat(double / 12.0, 3)


def at_nodes(ends: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Links (m,) with these ends (rows of nodes, -1: another's) by the nodes 0 .. n - 1: begin (n + 1,), and for each
    the links and -1.0 where it is their first end, 1.0 where it is their last, in the order of links."""
    m = len(ends)
    node, channel = ends.T.reshape(-1), np.tile(np.arange(m), 2)
    side = np.repeat([-1.0, 1.0], m)
    keep = (node >= 0) & (node < n)
    node, channel, side = node[keep], channel[keep], side[keep]
    order = np.lexsort((channel, node))
    begin = np.zeros(n + 1, np.int64)
    begin[1:] = np.cumsum(np.bincount(node, minlength=n))
    return begin, channel[order], side[order]


def path(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Channels (m,) with these ends (m, 2) in the order of the line that they make, and its points (m + 1,), from the
    free end of the lower number on; None if they make no single line with two free ends."""
    beside: dict[int, list[int]] = {}
    for channel, pair in enumerate(ends.tolist()):
        for point in pair:
            beside.setdefault(point, []).append(channel)
    free = [point for point, channels in beside.items() if len(channels) == 1]
    if len(free) != 2 or max(map(len, beside.values())) > 2:
        return None
    order: list[int] = []
    points = [min(free)]
    while len(order) < len(ends):
        candidates = [channel for channel in beside[points[-1]] if not order or channel != order[-1]]
        if not candidates:
            return None  # the rest is closed in itself
        order.append(candidates[0])
        points.append(int(ends[candidates[0]].sum()) - points[-1])
    return np.array(order), np.array(points)


def faces_of(mesh: Mesh, elements: np.ndarray) -> np.ndarray:
    """Return all faces of these elements (n,), in their order."""
    faces = 4 * elements[:, None] + np.arange(4)
    return faces[np.arange(4) < corner_counts(mesh.cells[elements])[:, None]]


def around(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces whose corners all are among these points, and those of which some corner is; ascending."""
    member = np.zeros(len(mesh.points), bool)
    member[points] = True
    beside = ((mesh.cells >= 0) & member[mesh.cells]).any(axis=1)
    faces = faces_of(mesh, np.flatnonzero(beside))
    inside = member[mesh.face_points(faces)]
    return faces[inside.all(axis=1)], faces[inside.any(axis=1)]


def sides_and_free(
    partner: np.ndarray, faces: np.ndarray, closed: np.ndarray, channel: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Split faces (k,) into sides of channels and free faces; the others are omitted.

    closed (4 ne,) bool: faces that are connected with their partner; channel (4 ne,) bool: lower faces of channels.
    """
    other = partner[faces]
    is_channel = channel[np.where(other >= 0, np.minimum(faces, other), faces)]
    return faces[is_channel], faces[~is_channel & ~closed[faces]]
