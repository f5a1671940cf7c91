"""Faces of a liner and their order: functions of the mesh."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

NEAR = 0.1
"""Corners of two faces at one point of the mesh that have come further apart than this part of their edges are on both
sides of a gap, which a liner does not span."""


def chained(
    points: np.ndarray, ends: np.ndarray, old: dict[int, tuple[list[int], list[int]]], place: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[tuple[int, int]], int]:
    """Chains of faces, each with the rock to its left, where one ends and exactly one begins at a point of the mesh.

    points (m, 2): first and last point of the mesh of each face; ends (m, 2, 2) [m]: where they are now; old: by point,
    the nodes at which liners end and begin there already; place (n, 2) [m]: of these nodes.

    Returns the faces along the chains (m,), for each whether it continues from the one before (m,), the pairs (end of a
    face, node) that are a node of before (ends are numbered 2 face + 0 or 1 in the new order), and how many points
    where more than two faces meet, or that have come apart, part it.
    """
    begin, stop = defaultdict(list), defaultdict(list)
    for i, (a, b) in enumerate(points.tolist()):
        begin[a].append(i)
        stop[b].append(i)
    size = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    after: dict[int, int] = {}
    before: dict[int, int] = {}
    joined: dict[tuple[int, int], int] = {}
    parted = 0
    for at in {*begin, *stop}:
        old_stop, old_begin = old.get(at, ([], []))
        comes, goes = len(stop[at]) + len(old_stop), len(begin[at]) + len(old_begin)
        if not comes or not goes:
            continue
        if comes > 1 or goes > 1:
            parted += 1
            continue
        mine = [(i, 1) for i in stop[at]] + [(i, 0) for i in begin[at]]
        where = [ends[i, k] for i, k in mine] + [place[node] for node in (*old_stop, *old_begin)]
        if np.hypot(*(where[0] - where[1])) > NEAR * min(size[i] for i, _ in mine):
            parted += 1
        elif len(mine) == 2:
            after[stop[at][0]], before[begin[at][0]] = begin[at][0], stop[at][0]
        elif mine:
            joined[mine[0]] = (*old_stop, *old_begin)[0]
    order: list[int] = []
    goes_on: list[bool] = []
    seen: set[int] = set()
    first = [i for i in range(len(points)) if i not in before]
    for start in (*first, *range(len(points))):  # open ones from their beginning, then closed ones
        i, on = start, False
        while i not in seen:
            seen.add(i)
            order.append(i)
            goes_on.append(on)
            if i not in after:
                break
            i, on = after[i], True
    rank = {i: k for k, i in enumerate(order)}
    pairs = sorted((2 * rank[i] + k, node) for (i, k), node in joined.items())
    return np.array(order, np.int64), np.array(goes_on, bool), pairs, parted


def closing(points: np.ndarray, goes_on: np.ndarray) -> list[tuple[int, int]]:
    """First and last face of each chain, points (m, 2) in the order of chains, whose last point is its first."""
    starts = np.flatnonzero(~goes_on)
    return [
        (int(a), int(b) - 1)
        for a, b in zip(starts, np.append(starts[1:], len(points)), strict=True)
        if points[a, 0] == points[b - 1, 1] and b - a > 2
    ]


def joined(
    points: np.ndarray, places: np.ndarray, old: np.ndarray, old_nodes: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Nodes of triangles, which are joined along an edge of the mesh where two meet.

    points (m, 3): of the mesh, of each face, counter-clockwise; places (m, 3, 3) [m]: where these are now; old,
    old_nodes (k, 3): points and nodes of triangles of before; at (n, 3) [m]: where their nodes are.

    Returns the nodes of the faces (m, 3), new ones from n on; a label of each face (m,), equal where faces are
    connected; and how many edges where more than two faces meet, or that have come apart, part them.
    """
    m, n = len(points), len(at)
    place = np.concatenate([places.reshape(-1, 3), at])
    of_corner = np.concatenate([np.arange(3 * m).reshape(-1, 3), 3 * m + old_nodes])
    parent, label = np.arange(3 * m + n), np.arange(m)
    known = np.concatenate([np.full(3 * m, -1), np.arange(n)])  # node of before of each set of corners

    def root(of: np.ndarray, i: int) -> int:
        while of[i] != i:
            of[i] = i = of[of[i]]
        return i

    sides = defaultdict(list)
    for t, three in enumerate(np.concatenate([points, old]).tolist()):
        for k in range(3):
            a, b = three[k], three[(k + 1) % 3]
            sides[min(a, b), max(a, b)].append((t, k, a < b))
    parted = 0
    for found in sides.values():
        if len(found) == 1 or all(t >= m for t, _, _ in found):
            continue
        (t, k, up), (s, j, other_up) = found[:2]
        mine, others = of_corner[t, [k, (k + 1) % 3]], of_corner[s, [(j + 1) % 3, j]]
        gap = np.linalg.norm(place[mine] - place[others], axis=1).max()
        pairs = [(root(parent, a), root(parent, b)) for a, b in zip(mine.tolist(), others.tolist(), strict=True)]
        both = any(a != b and known[a] >= 0 and known[b] >= 0 for a, b in pairs)
        if len(found) > 2 or up == other_up or both or gap > NEAR * np.linalg.norm(np.subtract(*place[mine])):
            parted += 1
            continue
        for a, b in pairs:
            a, b = root(parent, a), root(parent, b)
            parent[max(a, b)] = min(a, b)
            known[min(a, b)] = max(known[a], known[b])
        if s < m:
            label[root(label, s)] = root(label, t)
    node: dict[int, int] = {}
    out = np.empty(3 * m, np.int64)
    for i in range(3 * m):
        top = root(parent, i)
        out[i] = known[top] if known[top] >= 0 else node.setdefault(top, n + len(node))
    _, labels = np.unique([root(label, t) for t in range(m)], return_inverse=True)
    return out.reshape(-1, 3), labels.reshape(-1), parted
