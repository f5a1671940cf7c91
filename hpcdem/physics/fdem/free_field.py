"""Free-field sides: columns of ground beyond the sides of a model, through which the motion of an earthquake continues.

Beside a vertical side the ground without what is modelled is a column that moves alike at every x: a chain of nodes at
the heights of the nodes of the side, with the elastic constants, density and damping of its elements, and the base that
the model has there. The side is tied to it by dashpots that see the difference of both motions, and has its stress:

    t = n_x (sigma_xx, sigma_xy) of the column - rho c_p (v_x - v_x column) e_x - rho c_s (v_y - v_y column) e_y

on a face with the outward normal n_x e_x = +-e_x (Cundall, Hansteen, Lacasse & Selnes 1980). Nothing acts back on a
column, so every rank moves all of them by itself: the bits depend on neither ranks nor threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import connectivity, user_laws
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels.elements import ETA, Q_ETA
from hpcdem.physics.fdem.loads import tractions_now
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.node_set import conditions_now
from hpcdem.physics.fdem.surface_loads import SurfaceLoad
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.physics.fdem.topology import Numbers

UPRIGHT = 1e-6
"""Largest deviation of a face from the vertical in the mesh, over its height."""
_FACES: dict[str, tuple[type, int]] = {
    "face": (np.int64, 1), "low": (np.int64, 1), "lower": (np.int64, 1), "upper": (np.int64, 1),
    "height": (np.float64, 1), "sign": (np.float64, 1), "hold": (np.float64, 4),
}  # fmt: skip
"""Columns of the faces, upwards: number; node at its lower end, the next one is at its upper; local corners there;
height [m]; n_x; forces that hold both corners as they were (x, y, x, y) [N/m]."""
_NODES: dict[str, tuple[type, int]] = {"point": (np.int64, 1), "u": (np.float64, 2), "v": (np.float64, 2)}
"""Columns of the nodes: point of the mesh; displacement [m], velocity [m/s]."""


class FreeField(SurfaceLoad):
    """The free-field sides of a model of blocks. faces, nodes: columns by name, equal on all ranks. Methods are
    collective unless they say otherwise."""

    name: ClassVar[str] = "free_field"
    of_mesh: ClassVar[bool] = True

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks
        self.faces: dict[str, np.ndarray] = {name: np.zeros((0, n), of) for name, (of, n) in _FACES.items()}
        self.nodes: dict[str, np.ndarray] = {name: np.zeros((0, n), of) for name, (of, n) in _NODES.items()}
        self._wrong: str | None = None

    # ---- what is given --------------------------------------------------------------------------------------------

    @staticmethod
    def create(blocks: Blocks, chosen: Numbers) -> None:
        """Make these faces free-field sides. Their nodes are held by the forces that they have at this moment, of
        stress, weight and loads: a model in equilibrium stays in it when the conditions of its sides go.

        CommandError if they are not upright faces of the surface, or in static mode.
        """
        if not blocks.options.dynamic:
            raise CommandError("free-field boundaries need a dynamic run: use model option dynamic on first")
        faces = blocks.numbers_of_faces(chosen)
        if not len(faces):
            raise CommandError("a free-field side needs faces, but the range contains none")
        known = FreeField.there(blocks)
        if known is not None and np.isin(faces, known.faces["face"]).any():
            raise CommandError("some of these faces are on a free-field side already")
        of_faces, of_nodes = _chains(blocks, np.sort(faces))
        blocks.before_change()
        load = known or FreeField(blocks)
        if known is None:
            blocks.surface_loads.add(load)
        of_faces["low"] += len(load.nodes["point"])
        first = len(load.faces["face"])
        load.faces = {name: np.concatenate([old, of_faces[name]]) for name, old in load.faces.items()}
        load.nodes = {name: np.concatenate([old, of_nodes[name]]) for name, old in load.nodes.items()}
        blocks.changed()
        load._hold(first)

    def _hold(self, first: int) -> None:
        """Hold the nodes at the faces from `first` on as they are."""
        blocks = self.blocks
        seen = blocks.evaluate()
        local, node = blocks.local, blocks.node.reshape(-1)
        lead = local.nodes.first_corners[local.nodes.mine]
        felt = np.zeros((int(node.max()) + 1, 2))
        felt[node[lead]] = seen.felt[local.nodes.mine, :2]
        blocks.comm.sum_into(felt.view(np.int64))  # one rank has each row, the others zero: exact
        face = self.faces["face"][first:, 0] // 4
        corners = 4 * face[:, None] + np.hstack([self.faces["lower"][first:], self.faces["upper"][first:]])
        clusters, at = np.unique(node[corners], return_index=True)
        hold = np.zeros((corners.size, 2))
        hold[at] = -felt[clusters]
        self.faces["hold"][first:] = hold.reshape(-1, 4)

    @staticmethod
    def remove(blocks: Blocks, chosen: Numbers) -> None:
        """Sides of which all faces are among these are ordinary ones again, without any force. CommandError if some
        faces of a side are not among them."""
        load = FreeField.there(blocks)
        if load is None:
            return
        gone = np.isin(load.faces["face"][:, 0], blocks.numbers_of_faces(chosen))
        side = load._side_of_faces()
        for one in np.unique(side[gone]).tolist():
            if not gone[side == one].all():
                missing = load.faces["face"][(side == one) & ~gone, 0]
                raise CommandError(
                    f"a free-field side can only be removed completely: face {missing[0]} of it ({len(missing)} in "
                    "all) is not in the range"
                )
        if not gone.any():
            return
        blocks.before_change()
        if gone.all():
            blocks.surface_loads.remove(load)
        else:
            node_gone = np.zeros(len(load.nodes["point"]), bool)
            node_gone[load.faces["low"][gone, 0]] = node_gone[load.faces["low"][gone, 0] + 1] = True
            load.faces = {name: rows[~gone] for name, rows in load.faces.items()}
            load.nodes = {name: rows[~node_gone] for name, rows in load.nodes.items()}
            load.faces["low"] -= np.cumsum(node_gone)[load.faces["low"]]
        blocks.changed()

    def _side_of_faces(self) -> np.ndarray:
        """(m,) which side each face is on."""
        low = self.faces["low"][:, 0]
        return np.cumsum(np.diff(low, prepend=low[:1]) > 1)

    def stop(self) -> None:
        """Velocities become zero. Not collective."""
        self.nodes["v"][:] = 0.0

    # ---- called by the blocks ------------------------------------------------------------------------------------

    def _corners_here(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces of owned elements, the storage rows of these, and the local corners (n, 2) at their ends."""
        blocks, faces = self.blocks, self.faces
        row = blocks.where[faces["face"][:, 0] // 4]
        at = np.flatnonzero((row >= blocks.owned.start) & (row < blocks.owned.stop))
        return at, row[at], np.hstack([faces["lower"], faces["upper"]])[at]

    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: those of the sides."""
        out = np.zeros((blocks.n_own, 4), bool)
        _, rows, ends = self._corners_here()
        out[rows[:, None] - blocks.n_left, ends] = True
        return out

    def dashpots(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) dashpots at these corners [N s/m per m], for the time step."""
        out = np.zeros((blocks.n_own, 4))
        at, rows, ends = self._corners_here()
        lame, shear, rho = self._ground()
        drag = 0.5 * self.faces["height"][:, 0] * np.sqrt(rho * (lame + 2.0 * shear))
        np.add.at(out, (rows[:, None] - blocks.n_left, ends), drag[at, None])
        return out

    def _ground(self) -> tuple[np.ndarray, ...]:
        """lambda, mu [Pa] and density [kg/m3] of the elements at the sides."""
        blocks = self.blocks
        row = blocks.element_row[self.faces["face"][:, 0] // 4]
        of = moduli(blocks.element_rows, blocks.options.plane_stress)
        return of.lame[row], of.shear[row], np.array(blocks.element_rows.column("density"))[row]

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners, or other properties; conditions may be others."""
        blocks, faces, nodes = self.blocks, self.faces, self.nodes
        self._wrong = self._complaint()
        if self._wrong is not None:
            return
        at, rows, ends = self._corners_here()
        self._mine = at
        self._to = 8 * rows[:, None] + 2 * ends
        self._from = rows[:, None] * blocks.v.shape[1] + 2 * ends
        lame, shear, rho = self._ground()
        self._lame, self._shear, self._height = lame, shear, faces["height"][:, 0]
        self._p, self._s = np.sqrt(rho * (lame + 2.0 * shear)), np.sqrt(rho * shear)
        self._eta = self._viscosity()
        self._low = faces["low"][:, 0]
        self._mass = np.zeros(len(nodes["point"]))
        half = 0.5 * rho * self._height
        np.add.at(self._mass, self._low, half)
        np.add.at(self._mass, self._low + 1, half)

    def _viscosity(self) -> np.ndarray:
        """(m,) of the elements at the sides [Pa s], as they have it."""
        blocks, found = self.blocks, np.zeros(len(self.faces["face"]))
        local = blocks.local
        own = np.zeros(blocks.n_own)
        own[local.triangle_rows[: local.count] - blocks.n_left] = local.c[: local.count, ETA]
        own[local.quad_rows - blocks.n_left] = local.q[:, Q_ETA]
        found[self._mine] = own[blocks.where[self.faces["face"][self._mine, 0] // 4] - blocks.n_left]
        blocks.comm.sum_into(found.view(np.int64))  # one rank has each, the others zero: exact
        return found

    def _complaint(self) -> str | None:
        """Return why no step is possible with these sides, and determine what drives their bases. Not collective."""
        blocks, o = self.blocks, self.blocks.options
        element = self.faces["face"][:, 0] // 4
        if not o.dynamic:
            return (
                "free-field boundaries need a dynamic run: remove them with element-face boundary remove before "
                "dynamic off"
            )
        if o.mass_scaling > 0.0:
            return "free-field boundaries need true masses: use time-step mass-scaling 0"
        if not blocks.alive[element].all():
            gone = element[~blocks.alive[element]][0]
            return f"element {gone} of a free-field side was removed: use element-face boundary remove first"
        has_law = user_laws.numbers(blocks)[element] > 0
        if has_law.any():
            return f"element {element[has_law][0]} of a free-field side has a user law: columns are elastic"
        if blocks.log is not None and blocks.yielding()[element].any():
            blocks.log.warn_once("free field", "elements of free-field sides can yield: their columns are elastic")
        quiet = blocks.quiet_faces()[self.faces["face"][:, 0]]
        if quiet.any():
            return f"face {self.faces['face'][quiet][0, 0]} of a free-field side is quiet too: use quiet off first"
        points = self.nodes["point"][:, 0]
        base = np.setdiff1d(self.faces["low"], self.faces["low"] + 1)
        above = np.setdiff1d(np.arange(len(points)), base)
        rows = self._rows()
        for point in points[above].tolist():
            one = blocks.acting()[rows[point]]
            if one.does_x != moving.FREE or one.constraint == moving.FIXED:
                return f"node {point} of a free-field side is fixed in x: use node boundary remove first"
        return self._drive(base, points[base])

    def _rows(self) -> np.ndarray:
        """(np,) rows of conditions of the nodes of the sides, by points."""
        cells = self.blocks.the_mesh().cells.reshape(-1)
        element = self.faces["face"][:, 0] // 4
        corner = (4 * element[:, None] + np.arange(4)).reshape(-1)
        corner = corner[cells[corner] >= 0]
        out = np.zeros(len(self.blocks.the_mesh().points), np.int64)
        out[cells[corner]] = self.blocks.rows_of_nodes(corner, self.blocks.node)[0]
        return out

    def _drive(self, base: np.ndarray, points: np.ndarray) -> str | None:
        """Bind the lowest nodes to their drive: per component the condition of the model's node there, otherwise the
        quiet face below. Returns the reason if that is impossible. base, points (k,): nodes, and points of the mesh."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        self._base, k = base, len(base)
        self._given = np.zeros((k, 2), bool)
        quiet = np.flatnonzero(blocks.quiet_faces() & ~np.isin(np.arange(len(blocks.load_row)), self.faces["face"]))
        ends = connectivity.face_points(mesh.cells, quiet)
        below = np.zeros(k, np.int64)
        rows = self._rows()
        for i, point in enumerate(points.tolist()):
            one = blocks.acting()[rows[point]]
            held = one.constraint == moving.FIXED
            self._given[i] = held or one.does_x != moving.FREE, held or one.does_y != moving.FREE
            if one.constraint == moving.ALONG:
                if min(abs(edge_vector) for edge_vector in one.direction) > UPRIGHT:
                    return (
                        f"node {point} at the base of a free-field side moves along {one.direction}, but must move "
                        "along x or y"
                    )
                self._given[i, 1 if abs(one.direction[0]) > 0.5 else 0] = True
            found = quiet[(ends == point).any(axis=1)]
            below[i] = found[0] if len(found) else -1
            if not len(found) and not self._given[i].all():
                axis = "y" if self._given[i, 0] else "x"
                return (
                    f"the column of the free-field side above node {point} has no base in {axis}: that node needs a "
                    "velocity there, or a quiet face"
                )
        loads = np.where(below >= 0, blocks.load_row[below], 0).astype(np.int64)
        self._loads = Placed(blocks.loads, loads, mesh.points[points])
        self._conditions = Placed(blocks.acting(), rows[points], mesh.points[points])
        self._first_face = np.searchsorted(self.faces["low"][:, 0], base)
        return None

    def check_start(self) -> None:
        """CommandError if no step can be done with these sides. Not collective."""
        if self._wrong is not None:
            raise CommandError(self._wrong)

    def _stress(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stresses xx, yy and xy (m,) [Pa] of the columns."""
        beta, low = self.blocks.options.stiffness_damping, self._low
        strain = (self.nodes["u"][low + 1] - self.nodes["u"][low]) / self._height[:, None]
        rate = (self.nodes["v"][low + 1] - self.nodes["v"][low]) / self._height[:, None]
        shear, along = (strain + beta * rate).T
        xy = self._shear * shear + 0.5 * self._eta * rate[:, 0]
        yy = (self._lame + 2.0 * self._shear) * along + self._eta * rate[:, 1]
        return self._lame * along, yy, xy

    def add_to(self, applied: np.ndarray) -> None:
        """Forces on the sides at the present positions [N/m]. Not collective."""
        if self._wrong is not None:
            return
        at = self._mine
        xx, _, xy = self._stress()
        half, sign = 0.5 * self._height[at], self.faces["sign"][at, 0]
        v, out = self.blocks.v.reshape(-1), applied.reshape(-1)
        for end in range(2):
            to, there = self._to[:, end], self.nodes["v"][self._low[at] + end]
            vx, vy = v[self._from[:, end]], v[self._from[:, end] + 1]
            fx = half * (sign * xx[at] - self._p[at] * (vx - there[:, 0])) + self.faces["hold"][at, 2 * end]
            fy = half * (sign * xy[at] - self._s[at] * (vy - there[:, 1])) + self.faces["hold"][at, 2 * end + 1]
            np.add.at(out, to, fx)
            np.add.at(out, to + 1, fy)

    def follow(self) -> None:
        """Move the columns over the step that the blocks have done."""
        blocks, nodes = self.blocks, self.nodes
        if self._wrong is not None:
            return
        clock, base, u, v = blocks.clock, self._base, nodes["u"], nodes["v"]
        dt = clock.dt
        time = clock.time - dt
        _, yy, xy = self._stress()
        force = -blocks.options.mass_damping * self._mass[:, None] * v
        pull = np.column_stack([xy, yy])
        np.add.at(force, self._low, pull)
        np.add.at(force, self._low + 1, -pull)
        loads = tractions_now(blocks, self._loads, time)[self._loads.of]
        incoming = loads[:, [moving.INCOMING_X, moving.INCOMING_Y]]
        z = np.column_stack([self._s, self._p])[self._first_face]
        force[base] -= np.where(self._given, 0.0, z * (v[base] - 2.0 * incoming))
        before = v[base]
        v += dt * force / self._mass[:, None]
        table = conditions_now(blocks, self._conditions, time, time + 0.5 * dt, dt)[self._conditions.of]
        for axis, (does, at) in enumerate(((moving.DOES_X, moving.AT_X), (moving.DOES_Y, moving.AT_Y))):
            led = np.where(table[:, does] == moving.ACCELERATION, before[:, axis] + table[:, at], table[:, at])
            led = np.where((table[:, does] == moving.FREE) | (table[:, moving.CONSTRAINT] == moving.FIXED), 0.0, led)
            v[base, axis] = np.where(self._given[:, axis], led, v[base, axis])
        u += dt * v

    def uses_table(self, name: str) -> bool:
        """Return False: the bases are driven by conditions of nodes and faces, which use the tables. Not collective."""
        return False

    def mesh_replaced(self) -> None:
        """Do nothing: `of_mesh` reports that these are removed with the mesh."""

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """Return no state: the columns contain all of it."""
        return {}

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """The columns of faces and nodes."""
        return {
            table: {f"{name}_{c}": rows[:, c].copy() for name, rows in of.items() for c in range(rows.shape[1])}
            for table, of in (("free_field_faces", self.faces), ("free_field_nodes", self.nodes))
        }

    @staticmethod
    def restored(blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of both: the blocks have these sides."""
        made = FreeField(blocks)
        made.faces, made.nodes = (
            {name: np.column_stack([tables[table][f"{name}_{c}"] for c in range(n)]).astype(of)
             for name, (of, n) in columns.items()}
            for table, columns in (("free_field_faces", _FACES), ("free_field_nodes", _NODES))
        )  # fmt: skip
        blocks.surface_loads.add(made)


def _chains(blocks: Blocks, faces: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Columns of faces and nodes of new sides, each upwards, left ones first; heights are those of the mesh."""
    mesh = blocks.the_mesh()
    element, k = faces // 4, faces % 4
    k2 = (k + 1) % connectivity.corner_counts(mesh.cells[element])
    inside = blocks.closed_faces()[faces] | ~blocks.alive[element]
    if inside.any():
        raise CommandError(f"face {faces[inside][0]} is not on the surface and cannot be a free-field side")
    edge_vector = mesh.points[mesh.cells[element, k2]] - mesh.points[mesh.cells[element, k]]
    leans = np.abs(edge_vector[:, 0]) > UPRIGHT * np.abs(edge_vector[:, 1])
    if leans.any():
        raise CommandError(
            f"face {faces[leans][0]} is not vertical ({int(leans.sum())} in all): free-field sides must be vertical"
        )
    sign = np.sign(edge_vector[:, 1])
    lower, upper = np.where(sign > 0.0, k, k2), np.where(sign > 0.0, k2, k)
    low, high = mesh.cells[element, lower], mesh.cells[element, upper]
    order = []
    for side in (-1.0, 1.0):
        starts = {int(low[i]): i for i in np.flatnonzero(sign == side)}
        if len(starts) < (sign == side).sum():
            raise CommandError("two faces of a free-field side begin at the same node")
        lowest = sorted(set(starts) - {int(high[i]) for i in starts.values()})
        for at in lowest:
            while at in starts:
                order.append(starts[at])
                at = int(high[starts[at]])
    edge_vector, sign, lower, upper, low, high = (part[order] for part in (edge_vector, sign, lower, upper, low, high))
    first = np.concatenate([[True], low[1:] != high[:-1]]) | np.concatenate([[True], sign[1:] != sign[:-1]])
    node = np.arange(len(order)) + np.cumsum(first) - 1
    points = np.zeros(int(node[-1]) + 2, np.int64)
    points[node], points[node + 1] = low, high
    n = len(points)
    of_faces = {
        "face": faces[order], "low": node, "lower": lower, "upper": upper,
        "height": np.abs(edge_vector[:, 1]), "sign": sign,
    }  # fmt: skip
    return (
        {**{name: rows[:, None] for name, rows in of_faces.items()}, "hold": np.zeros((len(order), 4))},
        {"point": points[:, None], "u": np.zeros((n, 2)), "v": np.zeros((n, 2))},
    )
