"""Closed outlines made of circular arcs and straight edges, many at a time, as plain arrays.

An arc is given by its two ends and its central angle, so that a straight edge is one of angle 0 and nothing grows
without bounds on the way there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

STRAIGHT = 1e-8
"""Central angles below this [rad] are straight edges to those who need the centre of an arc: the arc rises 1e-9 of
its length above the edge, less than what the rounding of its huge radius would cost."""


@dataclass(frozen=True)
class Outlines:
    """n outlines of m arcs in all, each anticlockwise.

    start (n + 1,) i8: outline k has the arcs start[k] to start[k + 1]. x, y (m,) f8 [m]: where an arc begins; it ends
    where the next of its outline begins. theta (m,) f8 [rad], 0 to below 2 pi: its central angle; it bulges outwards.
    """

    start: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def arcs_each(self) -> int:
        """Number of arcs of every outline; 0 if the outlines differ or there are no outlines."""
        number = np.diff(self.start)
        return int(number[0]) if len(number) and (number == number[0]).all() else 0

    @property
    def owner(self) -> np.ndarray:
        """(m,) i8: the outline of each arc."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    def placed(self, x: np.ndarray, y: np.ndarray, angle: np.ndarray) -> Outlines:
        """Outline k turned about the origin by angle[k] [rad] and moved by (x[k], y[k]) [m]."""
        k = self.owner
        c, s = np.cos(angle)[k], np.sin(angle)[k]
        return Outlines(self.start, x[k] + c * self.x - s * self.y, y[k] + s * self.x + c * self.y, self.theta)

    def taken(self, which: np.ndarray) -> Outlines:
        """The outlines of these numbers, in their order."""
        number = np.diff(self.start)[which]
        start = np.concatenate([[0], np.cumsum(number)]).astype(np.int64)
        arcs = np.repeat(self.start[:-1][which] - start[:-1], number) + np.arange(start[-1])
        return Outlines(start, self.x[arcs], self.y[arcs], self.theta[arcs])

    def boxes(self) -> np.ndarray:
        """(n, 4) f8: left, right, bottom, top [m] of each outline, its arcs included."""
        return _boxes(self.start, self.x, self.y, self.theta)


def uniform_outlines(x: np.ndarray, y: np.ndarray, theta: np.ndarray) -> Outlines:
    """Outlines of equally many arcs from (n, arcs) arrays."""
    n, arcs = x.shape
    start = np.arange(n + 1, dtype=np.int64) * arcs
    return Outlines(start, *(np.ascontiguousarray(a, dtype=np.float64).reshape(-1) for a in (x, y, theta)))


def sampled(outlines: Outlines, per_arc: int) -> np.ndarray:
    """Points on the outlines, `per_arc` on each arc, its first end among them and evenly by angle.

    Returns (n, arcs * per_arc, 2) f8 [m] if all outlines have equally many arcs, else (m * per_arc, 2) in which
    outline k has the rows start[k] * per_arc to start[k + 1] * per_arc.
    """
    points = _sampled(outlines.start, outlines.x, outlines.y, outlines.theta, per_arc)
    return points.reshape(len(outlines), -1, 2) if outlines.arcs_each else points


@njit(cache=True, nogil=True, error_model="numpy")
def _sampled(start, x, y, theta, per_arc):
    points = np.empty((len(x) * per_arc, 2))
    for k in range(len(start) - 1):
        for i in range(start[k], start[k + 1]):
            j = i + 1 if i + 1 < start[k + 1] else start[k]
            dx, dy, t = x[j] - x[i], y[j] - y[i], theta[i]
            for q in range(per_arc):
                part = q / per_arc
                # The chord to the point: shorter than that of the whole arc, and turned outwards against it.
                turn = -0.5 * t * (1.0 - part)
                longer = part if t < 1e-6 else np.sin(0.5 * t * part) / np.sin(0.5 * t)
                c, s = longer * np.cos(turn), longer * np.sin(turn)
                points[i * per_arc + q, 0] = x[i] + c * dx - s * dy
                points[i * per_arc + q, 1] = y[i] + s * dx + c * dy
    return points


def arc_circles(outlines: Outlines) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Radius [m], centre x, y [m] and angle of the first normal [rad] of each arc, (m,) f8 each.

    A straight edge has an infinite radius, and its centre is not a number. From the first normal on an arc goes
    anticlockwise through its central angle.
    """
    following = np.arange(1, len(outlines.x) + 1)
    following[outlines.start[1:] - 1] = outlines.start[:-1]
    dx, dy = outlines.x[following] - outlines.x, outlines.y[following] - outlines.y
    half = 0.5 * outlines.theta
    first = np.arctan2(dy, dx) - 0.5 * np.pi - half
    straight = outlines.theta < STRAIGHT
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.where(straight, np.inf, np.hypot(dx, dy) / (2.0 * np.sin(half)))
        cx = np.where(straight, np.nan, outlines.x - radius * np.cos(first))
        cy = np.where(straight, np.nan, outlines.y - radius * np.sin(first))
    return radius, cx, cy, first


@njit(cache=True, nogil=True, error_model="numpy")
def _boxes(start, x, y, theta):
    out = np.empty((len(start) - 1, 4))
    for k in range(len(start) - 1):
        a, b = start[k], start[k + 1]
        left, right, bottom, top = x[a:b].min(), x[a:b].max(), y[a:b].min(), y[a:b].max()
        for i in range(a, b):
            t = theta[i]
            if t < STRAIGHT:
                continue
            j = i + 1 if i + 1 < b else a
            dx, dy = x[j] - x[i], y[j] - y[i]
            first = np.arctan2(dy, dx) - 0.5 * np.pi - 0.5 * t
            radius = np.sqrt(dx * dx + dy * dy) / (2.0 * np.sin(0.5 * t))
            cx, cy = x[i] - radius * np.cos(first), y[i] - radius * np.sin(first)
            # The axes' directions among the normals of the arc.
            quarter = int(np.ceil(first / (0.5 * np.pi)))
            while quarter * 0.5 * np.pi <= first + t:
                side = quarter % 4
                if side == 0:
                    right = max(right, cx + radius)
                elif side == 1:
                    top = max(top, cy + radius)
                elif side == 2:
                    left = min(left, cx - radius)
                else:
                    bottom = min(bottom, cy - radius)
                quarter += 1
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = left, right, bottom, top
    return out
