"""Points and edges in the plane that meet in points only, and keep apart as far as a mesh of the wanted size needs.

Outlines are inserted unchanged (`fixed`). Cracks and inner layers are adjusted: what comes nearer to an existing point
or edge than `ratio` times the local mesh size is moved onto it. So cracks that cross just beside a corner cross in it,
a tip that ends just before another crack ends on it, and two cracks at a small angle run together until they are far
enough apart. No single move is farther than that distance; where lines crowd, moves can add up. Traces are worked
through in the order given: the same input makes the same edges, to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from itertools import pairwise

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh.sizes import SizeField

RATIO = 0.3
"""Least distance between points, and of points from edges, in units of the mesh size. It also bounds angles:
asin(0.3) = 17 degrees where an edge of full length leaves another."""
MOST_PIECES = 200_000
"""Number of moves at which a single trace is given up, since the mesh size is unreasonable for its length."""

Labels = frozenset[Hashable]


class Plane:
    """A planar straight-line graph that grows: points x[i], y[i], and labelled edges by their ordered end points."""

    def __init__(self, sizes: SizeField, ratio: float = RATIO) -> None:
        self.sizes, self.ratio = sizes, ratio
        self.x: list[float] = []
        self.y: list[float] = []
        self.near: list[float] = []
        """Least distance about each point [m]."""
        self.edges: dict[tuple[int, int], Labels] = {}
        self.fixed: dict[tuple[int, int], None] = {}
        """Edges of outlines: they may be divided, but not moved."""
        self.pending: list[tuple[int, int, Labels, bool]] = []
        """Edges removed because a new point is too near; they are rebuilt through it."""
        # Buckets between the smallest and the largest edge: neither holds many small nor spans many buckets.
        self.cell = math.sqrt(sizes.smallest * sizes.base)
        self.points_in: dict[tuple[int, int], list[int]] = {}
        self.edges_in: dict[tuple[int, int], list[tuple[int, int]]] = {}

    # --- outlines ---------------------------------------------------------------------------------------------

    def put(self, x: float, y: float) -> int:
        """A point exactly here; an existing one with the same coordinates is found again."""
        for i in self.points_in.get(self._bucket(x, y), ()):
            if self.x[i] == x and self.y[i] == y:
                return i
        self.x.append(x)
        self.y.append(y)
        self.near.append(self.ratio * float(self.sizes(np.array([[x, y]]))[0]))
        self.points_in.setdefault(self._bucket(x, y), []).append(len(self.x) - 1)
        return len(self.x) - 1

    def join(self, a: int, b: int, labels: Labels, fixed: bool) -> None:
        """An edge between two points, as it is; a second one between the same points adds its labels."""
        if a == b:
            return
        key = (min(a, b), max(a, b))
        if key not in self.edges:
            for bucket in self._along(*self._ends(key), 0.0):
                self.edges_in.setdefault(bucket, []).append(key)
        self.edges[key] = self.edges.get(key, frozenset()) | labels
        if fixed:
            self.fixed[key] = None

    # --- what gives way ---------------------------------------------------------------------------------------

    def add_point(self, x: float, y: float) -> int:
        """A point here or, if something is too near, the existing point or the point on the edge that is."""
        reach = self.ratio * float(self.sizes(np.array([[x, y]]))[0])
        i = self._nearest_point(x, y, reach)
        if i >= 0:
            return i
        best, best_d, foot = None, reach, (x, y)
        for key in self._edges_near(x, y, reach):
            fx, fy = self._foot(key, x, y)
            d = math.hypot(fx - x, fy - y)
            if d < best_d:
                best, best_d, foot = key, d, (fx, fy)
        if best is None:
            return self.put(x, y)
        i = self._nearest_point(*foot, reach)
        return i if i >= 0 else self._divide_at(best, *foot)

    def add_line(self, start: tuple[float, float], end: tuple[float, float], labels: Labels) -> None:
        """Add a straight trace, cut at what it crosses. `divide` then cuts all edges to size.

        The two steps are separate because a trace must avoid corners, tips and crossings, but not points that arise
        only when edges are divided.
        """
        self._lay(self.add_point(*start), self.add_point(*end), labels, short=False)

    def divide(self) -> None:
        """Cut all edges so that none is longer than the mesh size there: first those that may move, then outlines."""
        self._lay(0, 0, frozenset(), short=False)  # what waits to be laid again
        done: set[tuple[int, int]] = set()
        while todo := [key for key in self.edges if key not in self.fixed and key not in done]:
            for key in todo:
                if key not in self.edges or key in self.fixed:
                    continue
                if len(self._steps(*key, measure=True)) > 2:
                    self._lay(*key, self._take(key), short=True)
                if key in self.edges:
                    done.add(key)
        for key in list(self.fixed):
            self._lay_fixed(key)

    def _lay_fixed(self, key: tuple[int, int]) -> None:
        a, b = key
        pa, pb = np.array([self.x[a], self.y[a]]), np.array([self.x[b], self.y[b]])
        labels = self.edges[key]
        most = min([math.inf, *(self.sizes.on(n) for n in labels if isinstance(n, str))])
        cuts = self._cuts(pa, pb, most)
        if len(cuts) == 2:
            return
        self._take(key)
        stops = [a, *(self.put(x, y) for x, y in (pa + cuts[1:-1, None] * (pb - pa)).tolist()), b]
        for i, j in pairwise(stops):
            self.join(i, j, labels, fixed=True)

    def _lay(self, a: int, b: int, labels: Labels, short: bool) -> None:
        """Insert the path from a to b into the plane, cut and moved as necessary; `short`: in edges of the mesh
        size.
        """
        stack = [*self.pending, (a, b, labels, short)]
        self.pending.clear()
        moves = 0
        while stack:
            a, b, labels, short = stack.pop()
            moves += 1
            if moves > MOST_PIECES:
                raise HpcdemError(
                    f"a trace near ({self.x[a]:g}, {self.y[a]:g}) cannot be cut into edges of the mesh size"
                )
            if a == b:
                continue
            if (min(a, b), max(a, b)) in self.edges:
                self.join(a, b, labels, fixed=False)
                continue
            by = self._beside(a, b)
            if by < 0:
                by = self._crossing(a, b)
            stops = [a, by, b] if by >= 0 else self._steps(a, b) if short else [a, b]
            if len(stops) == 2:
                self.join(a, b, labels, fixed=False)
            else:
                stack += [(i, j, labels, short) for i, j in reversed(list(pairwise(stops)))]
            stack += self.pending
            self.pending.clear()

    def _take(self, key: tuple[int, int]) -> Labels:
        """Remove an edge; returns its labels."""
        for bucket in self._along(*self._ends(key), 0.0):
            self.edges_in[bucket].remove(key)
        self.fixed.pop(key, None)
        return self.edges.pop(key)

    def _beside(self, a: int, b: int) -> int:
        """The point nearest to the segment a-b that is too near to it, else -1.

        Only points nearer to both ends than these to each other: pieces get shorter each time, so there is an end.
        """
        ax, ay, bx, by = self.x[a], self.y[a], self.x[b], self.y[b]
        ux, uy = bx - ax, by - ay
        length2 = ux * ux + uy * uy
        reach = self.ratio * self.sizes.base
        best, best_d = -1, math.inf
        for i in self._points_along(ax, ay, bx, by, reach):
            if i in (a, b):
                continue
            wx, wy = self.x[i] - ax, self.y[i] - ay
            t = (wx * ux + wy * uy) / length2
            if not 0.0 < t < 1.0:
                continue
            d = math.hypot(wx - t * ux, wy - t * uy)
            if d >= self.near[i] or d >= best_d:
                continue
            vx, vy = self.x[i] - bx, self.y[i] - by
            if wx * wx + wy * wy < length2 and vx * vx + vy * vy < length2:
                best, best_d = i, d
        return best

    def _crossing(self, a: int, b: int) -> int:
        """A new point where the segment a-b first crosses an edge; -1 if it crosses none."""
        ax, ay, bx, by = self.x[a], self.y[a], self.x[b], self.y[b]
        while True:
            first, edge = math.inf, None
            for key in self._edges_along(ax, ay, bx, by):
                if a in key or b in key:
                    continue
                t = _meeting(ax, ay, bx, by, *self._ends(key))
                if t is not None and t < first:
                    first, edge = t, key
            if edge is None:
                return -1
            x, y = ax + first * (bx - ax), ay + first * (by - ay)
            i = self._on_outline(x, y, edge)
            if i >= 0 and self._between(i, a, b):
                if edge in self.edges and self._between(i, *edge):
                    self._send_through(edge, i)
                if edge not in self.edges:
                    return i
            if edge in self.edges:
                return self._divide_at(edge, x, y)
            # A new point on the outline has taken the edge out of the way: look again.

    def _on_outline(self, x: float, y: float, edge: tuple[int, int]) -> int:
        """The point of an outline that a crossing just beside it is to be moved to, else -1."""
        if edge in self.fixed:
            return -1
        reach = self.ratio * float(self.sizes(np.array([[x, y]]))[0])
        for key in self._edges_near(x, y, reach):
            foot = self._foot(key, x, y)
            if key in self.fixed and math.hypot(foot[0] - x, foot[1] - y) < reach:
                i = self._nearest_point(*foot, reach)
                return i if i >= 0 else self._divide_at(key, *foot)
        return -1

    def _cuts(self, pa: np.ndarray, pb: np.ndarray, most: float = math.inf) -> np.ndarray:
        whole = float(np.hypot(*(pb - pa)))
        t = self.sizes.samples_for(whole)
        return self.sizes.parts_of(pa + t[:, None] * (pb - pa), whole, most)

    def _steps(self, a: int, b: int, measure: bool = False) -> list[int]:
        """The points, a and b included, that cut the segment a-b into edges of the wanted size.

        measure: only their number counts, and nothing is put into the plane.
        """
        pa, pb = np.array([self.x[a], self.y[a]]), np.array([self.x[b], self.y[b]])
        cuts = self._cuts(pa, pb)
        if measure or len(cuts) == 2:
            return [a] * (len(cuts) - 1) + [b]
        stops = [a]
        for x, y in (pa + cuts[1:-1, None] * (pb - pa)).tolist():
            i = self.add_point(x, y)
            if i != stops[-1] and i != b:
                stops.append(i)
        stops.append(b)
        longest = max(math.hypot(self.x[i] - self.x[j], self.y[i] - self.y[j]) for i, j in pairwise(stops))
        return stops if longest < float(np.hypot(*(pb - pa))) else [a, b]

    def _divide_at(self, key: tuple[int, int], x: float, y: float) -> int:
        """Put a point on an edge, which becomes two."""
        i = self.put(x, y)
        if i in key:
            return i
        fixed = key in self.fixed
        labels = self._take(key)
        self.join(key[0], i, labels, fixed)
        self.join(i, key[1], labels, fixed)
        for other in self._edges_near(x, y, self.near[i]):
            if i not in other and other not in self.fixed and self._between(i, *other):
                foot = self._foot(other, x, y)
                if math.hypot(foot[0] - x, foot[1] - y) < self.near[i]:
                    self._send_through(other, i)
        return i

    def _send_through(self, key: tuple[int, int], i: int) -> None:
        """Remove an edge, to be inserted again through a point."""
        labels = self._take(key)
        self.pending += [(key[0], i, labels, False), (i, key[1], labels, False)]

    def _between(self, i: int, a: int, b: int) -> bool:
        """Return whether point i is nearer to both ends than these are to each other, so that both parts of a path
        through it are shorter.
        """
        return i not in (a, b) and max(
            math.hypot(self.x[i] - self.x[e], self.y[i] - self.y[e]) for e in (a, b)
        ) < math.hypot(self.x[b] - self.x[a], self.y[b] - self.y[a])

    # --- who is near ------------------------------------------------------------------------------------------

    def _bucket(self, x: float, y: float) -> tuple[int, int]:
        return math.floor(x / self.cell), math.floor(y / self.cell)

    def _ends(self, key: tuple[int, int]) -> tuple[float, float, float, float]:
        c, d = key
        return self.x[c], self.y[c], self.x[d], self.y[d]

    def _along(self, ax: float, ay: float, bx: float, by: float, reach: float) -> Iterator[tuple[int, int]]:
        """Buckets of all that is within `reach` of a segment, column by column."""
        if bx < ax:
            ax, ay, bx, by = bx, by, ax, ay
        rise = (by - ay) / (bx - ax) if bx > ax else 0.0
        low, high = min(ay, by), max(ay, by)
        hair = 1e-9 * self.cell
        for i in range(math.floor((ax - reach - hair) / self.cell), math.floor((bx + reach + hair) / self.cell) + 1):
            y0, y1 = low, high
            if rise != 0.0:
                left, right = i * self.cell - reach - hair, (i + 1) * self.cell + reach + hair
                one, other = ay + rise * (left - ax), ay + rise * (right - ax)
                y0, y1 = max(min(one, other), low), min(max(one, other), high)
            for j in range(
                math.floor((y0 - reach - hair) / self.cell), math.floor((y1 + reach + hair) / self.cell) + 1
            ):
                yield i, j

    def _points_along(self, ax: float, ay: float, bx: float, by: float, reach: float) -> Iterator[int]:
        for bucket in self._along(ax, ay, bx, by, reach):
            yield from self.points_in.get(bucket, ())

    def _edges_along(self, ax: float, ay: float, bx: float, by: float) -> list[tuple[int, int]]:
        """Edges that may cross a segment, each once, in a fixed order."""
        return list(dict.fromkeys(k for b in self._along(ax, ay, bx, by, 0.0) for k in self.edges_in.get(b, ())))

    def _edges_near(self, x: float, y: float, reach: float) -> list[tuple[int, int]]:
        return list(dict.fromkeys(k for b in self._along(x, y, x, y, reach) for k in self.edges_in.get(b, ())))

    def _nearest_point(self, x: float, y: float, reach: float) -> int:
        best, best_d = -1, reach
        for i in self._points_along(x, y, x, y, reach):
            d = math.hypot(self.x[i] - x, self.y[i] - y)
            if d < best_d:
                best, best_d = i, d
        return best

    def _foot(self, key: tuple[int, int], x: float, y: float) -> tuple[float, float]:
        """The point of an edge that is nearest to (x, y)."""
        cx, cy, dx, dy = self._ends(key)
        ux, uy = dx - cx, dy - cy
        t = min(max(((x - cx) * ux + (y - cy) * uy) / (ux * ux + uy * uy), 0.0), 1.0)
        return cx + t * ux, cy + t * uy


def _meeting(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> float | None:
    """Fraction of a-b at which it crosses c-d; None if it does not, or runs along it."""
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    cross = ux * vy - uy * vx
    if cross == 0.0:
        return None
    wx, wy = cx - ax, cy - ay
    t, s = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
    return t if 0.0 < t < 1.0 and 0.0 <= s <= 1.0 else None
