"""Water before the surface of a model: hydrostatic pressure on free faces below a water line, wherever they move.

The pressure on a face is linear, density times gravity times the depth below the line; on the part of a face that is
below the line its resultant and moment are exact. Cracks stay dry: fluid in them is that of physics/flow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.surface_loads import SurfaceLoad

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.physics.fdem.topology import Numbers

SLACK = 1e-9
"""Tolerance over the size of the model: up to this distance beyond the end of a line, points count as below it."""
Level = tuple[tuple[float, ...], ...]
"""A water line: its points (x, y), from left to right; in space a point and normal of its plane, and then the corners
(x, y) of a polygon about it, if it ends somewhere [m]."""


class Water(SurfaceLoad):
    """The water before a model of blocks. lines: levels with the density of the water there [kg/m3]; row (4 ne,): which
    of them stands before a face, from 1 on, 0: none. All is equal on all ranks."""

    name: ClassVar[str] = "water"
    of_mesh: ClassVar[bool] = True

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks
        self.lines: list[tuple[Level, float]] = []
        self.row = np.zeros(blocks.the_mesh().cells.size, np.int64)
        self._of, self._at = np.empty(0, np.int64), np.empty((0, blocks.dim), np.int64)
        self._share = np.empty(0)

    @property
    def stays(self) -> bool:
        """The tangent of the static solve leaves it out: it is small beside that of the rock."""
        return True

    @staticmethod
    def create(blocks: Blocks, elements: Numbers, levels: Sequence[Level], density: float) -> int:
        """Water of this density stands before faces of these elements that lie below the levels; 0: none. Returns
        before how many faces it will stand once they are free. Collective."""
        if density and not blocks.gravity_down() > 0.0:
            raise CommandError("element water needs gravity along the last axis, for example model gravity (0,-9.8)")
        mesh = blocks.the_mesh()
        chosen = np.zeros(len(mesh.cells), bool)
        chosen[slice(None) if elements is None else np.asarray(elements, np.int64)] = True
        faces = np.flatnonzero(np.repeat(chosen, 4) & (mesh.cells.reshape(-1) >= 0))
        faces = faces[~mesh.inside_macros(faces)]
        at = mesh.points[mesh.face_points(faces)]
        slack = SLACK * float(np.ptp(mesh.points, axis=0).max())
        known = Water.there(blocks)
        best, which = np.full(len(faces), -np.inf), np.zeros(len(faces), np.int64)
        first = 0 if known is None else len(known.lines)
        for k, level in enumerate(levels if density else ()):
            below = _covers(level, at, slack)
            height = np.where(below, _height(level, at).mean(axis=1), -np.inf)
            higher = height > best
            best[higher], which[higher] = height[higher], first + k + 1
        if density and not (which > 0).any():
            raise CommandError("no face of these elements lies below the water line; there is no water beyond its ends")
        if known is None and not density:
            return 0
        blocks.before_change()
        load = known or Water(blocks)
        if known is None:
            blocks.surface_loads.add(load)
        if density:
            load.lines += [(level, density) for level in levels]
        load.row[faces] = which
        if not load.row.any():
            blocks.surface_loads.remove(load)
        blocks.changed()
        return int((which > 0).sum())

    # ---- called by the blocks ------------------------------------------------------------------------------------

    def _wet(self) -> np.ndarray:
        """Faces of owned elements with water before them, ascending: nothing is beyond them."""
        blocks = self.blocks
        faces = np.flatnonzero(self.row)
        row = blocks.where[faces // 4]
        mine = (row >= blocks.owned.start) & (row < blocks.owned.stop) & blocks.alive[faces // 4]
        faces = faces[mine]
        beyond = blocks.partner[faces]
        return np.asarray(faces[(beyond < 0) | ~blocks.alive[np.maximum(beyond, 0) // 4]])

    def _corners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (m,) of `lines` from 0 on, storage rows and local corners (m, dim) of wet faces."""
        blocks, faces = self.blocks, self._wet()
        corners = blocks.the_mesh().face_corners(faces)
        return self.row[faces] - 1, blocks.where[corners // 4], corners % 4

    def corners(self, blocks: Any) -> np.ndarray:
        out = np.zeros((blocks.n_own, 4), bool)
        _, rows, local = self._corners()
        out[rows - blocks.n_left, local] = True
        mesh = blocks.the_mesh()
        if len(mesh.hexes) and len(rows):  # the force on a side goes to both ways to cut it
            of = mesh.macro_of()
            wet = np.unique(of[blocks.number[rows[:, 0]]])
            out[np.isin(of[blocks.number[blocks.owned]], wet[wet >= 0])] = True
        return out

    def storage_rebuilt(self) -> None:
        blocks = self.blocks
        self._of, rows, local = self._corners()
        self._share = np.ones(len(rows))
        if blocks.dim == 2:
            self._from = blocks.x.shape[1] * rows + 2 * local
            self._to = blocks.local.force_width * rows + blocks.local.stride * local
            return
        self._from = tets.ROW * rows + tets.STRIDE * local
        hexes = getattr(blocks.local, "hexes", None)
        if hexes is not None and len(rows):
            of, others = hexes.other_cuts(self._from, rows[:, 0] - blocks.n_left)
            self._share[of] = 0.5
            self._of = np.concatenate([self._of, self._of[of]])
            self._from = np.concatenate([self._from, others])
            self._share = np.concatenate([self._share, np.full(len(of), 0.5)])
        self._to = self._from

    def add_to(self, applied: np.ndarray) -> None:
        if not len(self._of):
            return
        blocks, out = self.blocks, applied.reshape(-1)
        x, dim = blocks.x.reshape(-1), blocks.dim
        at = np.stack([x[self._from + c] for c in range(dim)], axis=-1)
        depth, weight = np.empty(at.shape[:2]), np.empty(len(at))
        for k in np.unique(self._of).tolist():
            level, density = self.lines[k]
            some = self._of == k
            depth[some] = _height(level, at[some]) - at[some, :, -1]
            weight[some] = density
        weight *= blocks.gravity_down() * self._share
        push = (_on_edges if dim == 2 else _on_triangles)(depth) * weight[:, None]
        if dim == 2:
            along = at[:, 1] - at[:, 0]
            normal = np.column_stack([along[:, 1], -along[:, 0]])
        else:
            normal = 0.5 * np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
        for corner in range(dim):
            for c in range(dim):
                np.add.at(out, self._to[:, corner] + c, -push[:, corner] * normal[:, c])

    def mesh_replaced(self) -> None:
        """Do nothing: `of_mesh` reports that this is removed with the mesh."""

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        return {"lines": [[[list(point) for point in level], density] for level, density in self.lines]}

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        faces = np.flatnonzero(self.row)
        return {"water": {"number": faces, "row": self.row[faces]}}

    @staticmethod
    def restored(blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of both: the blocks have this water."""
        made = Water(blocks)
        made.lines = [(tuple(map(tuple, level)), float(density)) for level, density in state["lines"]]
        made.row[tables["water"]["number"].astype(np.int64)] = tables["water"]["row"]
        blocks.surface_loads.add(made)


def _height(level: Level, at: np.ndarray) -> np.ndarray:
    """(n, k) height of the water at points (n, k, dim) [m]; beyond the ends of a line as at its ends."""
    if at.shape[-1] == 2:
        return np.interp(at[..., 0], [x for x, _ in level], [y for _, y in level])
    (px, py, pz), (nx, ny, nz) = level[0], level[1]
    return np.asarray(pz - (nx * (at[..., 0] - px) + ny * (at[..., 1] - py)) / nz)


def _covers(level: Level, at: np.ndarray, slack: float) -> np.ndarray:
    """(n,) bool: faces with points (n, k, dim) whose points all lie below or above the line."""
    if at.shape[-1] == 2:
        x = at[..., 0]
        return np.asarray(((x >= level[0][0] - slack) & (x <= level[-1][0] + slack)).all(axis=1))
    corners = np.array(level[2:])
    inside = np.ones(len(at), bool)
    if not len(corners):
        return inside
    x, y = at[..., 0], at[..., 1]
    odd, near = np.zeros(x.shape, bool), np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0)):
        across = (ay > y) != (by > y)
        odd ^= across & (x < ax + (y - ay) * (bx - ax) / np.where(by == ay, 1.0, by - ay))
        t = np.clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2), 0.0, 1.0)
        near |= np.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay)) <= slack
    return np.asarray((odd | near).all(axis=1))


def _on_edges(depth: np.ndarray) -> np.ndarray:
    """(n, 2) shares of both ends of edges: the integral of max(depth, 0) times their shape, over the length [m]. depth
    (n, 2) [m]: negative above the water."""
    a, b = depth.T
    low, high = np.maximum(depth, 0.0).T
    whole = np.column_stack([2.0 * low + high, low + 2.0 * high]) / 6.0
    part = (a > 0.0) != (b > 0.0)
    if not part.any():
        return whole
    a, b = depth[part].T
    wet = np.maximum(a, b)  # at the wet end, and 0 a part t of the length away
    t = wet / np.abs(a - b)
    near, far = wet * (0.5 * t - t * t / 6.0), wet * t * t / 6.0
    whole[part] = np.where((a > 0.0)[:, None], np.column_stack([near, far]), np.column_stack([far, near]))
    return whole


def _on_triangles(depth: np.ndarray) -> np.ndarray:
    """Shares of the pressure at the corners of triangles (n, 3), over their area."""
    whole = (depth.sum(axis=1)[:, None] + depth) / 12.0
    wet = (depth > 0.0).sum(axis=1)
    whole[wet == 0] = 0.0
    rows = np.flatnonzero((wet == 1) | (wet == 2))
    if not len(rows):
        return whole
    # The corner that is alone, a, wet or dry; the water line cuts its sides at parts s and t of them.
    alone = np.where(wet[rows] == 1, (depth[rows] > 0.0).argmax(axis=1), (depth[rows] <= 0.0).argmax(axis=1))
    order = (alone[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(depth[rows], order, axis=1).T
    s, t = a / (a - b), a / (a - c)
    # Integral over the small triangle at a, where the depth goes from a to 0 and 0.
    small = np.column_stack([2.0 + (1.0 - s) + (1.0 - t), s, t]) * (a * s * t / 12.0)[:, None]
    of = np.column_stack([2.0 * a + b + c, a + 2.0 * b + c, a + b + 2.0 * c]) / 12.0
    found = np.where((wet[rows] == 1)[:, None], small, of - small)
    np.put_along_axis(found_at := np.empty_like(found), order, found, axis=1)
    whole[rows] = found_at
    return whole
