"""Which faces make up a liner, and in which order: functions of the mesh."""

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

    Returns the faces along the chains (m,), for each whether it goes on from the one before (m,), the pairs (end of a
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
