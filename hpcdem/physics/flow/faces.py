"""Faces of elements that fluid pushes on: sides of channels, and free faces before which water stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.channels import Channels
from hpcdem.physics.flow.network import faces_of, sides_and_free

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks


@dataclass
class Shore:
    """Corners of wet free faces at which no channel ends: what is assigned to them gives the pressure there.

    at (k,): where they begin in x, flat; row (k,): of the conditions; node (k,): points of the mesh, the lowest flow
    node of their well, -1: they belong to none; ref (k,): its row in the state; apart (k, dim): from that node to the
    corner, in the mesh [m], as the node may be in motion on another rank.
    """

    at: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    row: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    node: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    ref: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    apart: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.at)


class Faces(Channels):
    """shore: see there; its rows of the state come after those of flow nodes."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self.shore = Shore()
        self.p0 = 0.0
        """Pressure that the variables of implicit steps are measured by, while these are being done [Pa]; else 0."""
        self._reported_wet = ""
        self._wet, self._wet_rows = np.empty(0, np.int64), np.empty((0, blocks.dim), np.int64)
        """Wet free faces of this rank, and rows of the state at their corners."""
        self._loads: list[list[tuple[np.ndarray, ...]]] = []
        """Arguments of kernels for sides of channels, and for the other faces."""

    @property
    def implicit(self) -> bool:
        """Implicit steps are being done."""
        return self.p0 > 0.0

    # ---- which -------------------------------------------------------------------------------------------------------

    @property
    def pushes(self) -> bool:
        """Fluid loads blocks, also where it does not flow at present."""
        return len(self.network.channels) > 0 and not self.blocks.options.one_way

    def pushed(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces of owned elements that fluid pushes on, ascending: sides of channels, and wet free faces."""
        sides, free = self._sides_and_free()
        return sides, free[self._is_wet(free)]

    def _is_wet(self, free: np.ndarray) -> np.ndarray:
        """Return the free faces (k,) that are assigned to be wet and carry no prescribed stress."""
        return (self.wet_bits[free] > 0) & ~self.blocks.stressed(free)

    def _sides_and_free(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces of owned elements, ascending: sides of channels, and free ones."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        faces = faces_of(mesh, np.sort(blocks.number[blocks.owned]))
        channel = np.zeros(mesh.cells.size, bool)
        channel[self.network.channels] = True
        closed, again = blocks.closed_faces(), np.flatnonzero(blocks.broken > 1)
        if len(again):  # free faces but for the static solve, see physics/fdem/pressed.py
            closed = closed.copy()
            closed[again] = closed[blocks.partner[again]] = False
        return sides_and_free(blocks.partner, faces, closed, channel)

    def wet_faces(self) -> dict[str, np.ndarray]:
        """Free faces that fluid pushes on, on all ranks: number, element * 4 + face, ascending, size [m], in space
        [m2], and mean pressure of their corners [Pa]."""
        self.blocks.close_model()
        faces, mean = self._wet, self.state[self._wet_rows, kernels.P].mean(axis=1)
        comm = self.blocks.comm
        parts = comm.allgather((faces, mean)) if comm.size > 1 else [(faces, mean)]
        faces, mean = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(faces)
        faces, mean = faces[order], mean[order]
        return {"number": faces, "size": self.blocks.the_mesh().face_sizes(faces), "pressure": mean}

    def _report_wet(self, free: np.ndarray) -> None:
        """A word in the log about the free faces (k,) of this rank where they are others than before. Collective."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        wet_bits, stressed = self.wet_bits[free] > 0, blocks.stressed(free)
        between = self.network.there[mesh.face_points(free)].all(axis=1)
        kinds = wet_bits & ~stressed, wet_bits & stressed, between & ~wet_bits & ~stressed
        wet, total, dry = blocks.comm.sum_into(np.array([kind.sum() for kind in kinds], np.int64)).tolist()
        notes = []
        if wet:
            notes.append(f"water of conditions and wells loads {wet} free faces")
        if total:
            notes.append(f"{total} with water have a prescribed stress, which replaces the water pressure")
        if dry:
            notes.append(
                f"{dry} free faces between flow nodes are dry: no condition applies water pressure to them (node "
                "boundary hydraulic-constant-flow-boundary pressure, flow-surface, or well create, with a range that "
                "holds their nodes)"
            )
        text = "; ".join(notes)
        if blocks.log is not None and text != self._reported_wet:
            blocks.log.info(f"flow: {text or 'no free face is wet any more'}")
        self._reported_wet = text

    def corners(self, blocks: Any) -> np.ndarray:
        out = np.zeros((blocks.n_own, 4), bool)
        if self.pushes:
            mesh, faces = blocks.the_mesh(), np.concatenate(self.pushed())
            for corner in (mesh.face_corners(faces), mesh.on_sides(faces)[1]):
                out[blocks.where[corner // 4] - blocks.n_left, corner % 4] = True
        return out

    def _bind_faces(self) -> None:
        """Elements have other rows or owners, or there are other channels. Collective."""
        mesh = self.blocks.the_mesh()
        sides = self._wet = np.empty(0, np.int64)
        if self.pushes:
            sides, free = self._sides_and_free()
            self._wet = free[self._is_wet(free)]
            self._report_wet(free)
        faces = np.concatenate([sides, self._wet])
        self.shore, beyond = self._shore_of(faces)
        loaded = mesh.face_points(faces)
        of_shore = self.shore.node >= 0
        local = self._bind(np.append(loaded.reshape(-1)[~beyond], self.shore.node[of_shore]), len(self.shore))
        self.shore.ref = np.where(of_shore, local[self.shore.node], -1)
        at = local[loaded]
        at.reshape(-1)[beyond] = len(self.held) + np.arange(len(self.shore))
        self._wet_rows = at[len(sides) :]
        self._loads = [self._bound(sides, at[: len(sides)]), self._bound(self._wet, self._wet_rows)]

    def _bound(self, faces: np.ndarray, nodes: np.ndarray) -> list[tuple[np.ndarray, ...]]:
        """Make the arguments of `kernels.loads` for these faces (m,), with the rows of the state at their corners (m,
        dim)."""
        mesh, of, where = self.blocks.the_mesh(), self.blocks.local, self.blocks.where
        corner, (half, fourth, *weights) = mesh.face_corners(faces), mesh.on_sides(faces)
        at, all_of = self._begins(corner), np.column_stack([corner[half], fourth])
        to, last = (of.force_width * where[one // 4] + of.stride * (one % 4) for one in (corner, all_of))
        rest = np.delete(np.arange(len(faces)), half)
        nothing = [one[:0] for one in weights]
        return [(at[rest], to[rest], nodes[rest], *nothing), (at[half], last, nodes[half], *weights)][
            : 1 + (len(half) > 0)
        ]

    def _shore_of(self, faces: np.ndarray) -> tuple[Shore, np.ndarray]:
        """Make the shore of faces (m,) loaded by fluid, and flag their corners that belong to it, flat, bool. Rows of
        the state are set by `storage_rebuilt`."""
        network, mesh, o = self.network, self.blocks.the_mesh(), self.blocks.options
        points, corner = (of.reshape(-1) for of in (mesh.face_points(faces), mesh.face_corners(faces)))
        beyond = ~network.there[points]
        points, corner = points[beyond], corner[beyond]
        row = self.condition[points].astype(np.int64)
        node = np.full(len(points), -1, np.int64)
        down = np.array([o.gx, o.gy, o.gz][: mesh.dim])
        for well in self.wells:
            at = well.points[network.there[well.points]]
            mine = (node < 0) & (row == 0) & np.isin(points, well.wall)
            if len(at) and mine.any():
                node[mine] = at[np.argmax(mesh.points[at] @ down)]
        apart = np.where((node >= 0)[:, None], mesh.points[points] - mesh.points[node], 0.0)
        return Shore(self._begins(corner), row, node, np.full(len(points), -1, np.int64), apart), beyond

    def find_shore(self, conditions: np.ndarray | None = None) -> None:
        """Pressures at the shore where it is now, by a table of conditions (None: that of now). Not collective."""
        shore = self.shore
        if not len(shore):
            return
        flat, rho = self.blocks.x.reshape(-1), self.fluid("fluid_density")
        energy = -rho * sum(g * flat[shore.at + k] for k, g in enumerate(self._gravity()))
        does, value = (self.conditions_at(self.time) if conditions is None else conditions)[shore.row].T
        p = np.where(does == kernels.SURFACE, np.maximum(value - energy, 0.0), value)
        of_well = np.flatnonzero(shore.ref >= 0)
        lowest = self.state[shore.ref[of_well], kernels.P]
        drop = rho * sum(g * shore.apart[of_well, k] for k, g in enumerate(self._gravity()))
        p[of_well] = np.where(lowest > 0.0, np.maximum(lowest + drop, 0.0), 0.0)
        self.state[len(self.held) :, kernels.P] = p

    def show(self, rows: np.ndarray | float, conditions: np.ndarray | None = None) -> None:
        """The state of the nodes held here is this; that of the shore follows. Not collective."""
        self.state[: len(self.held)] = rows
        self.find_shore(conditions)

    # ---- forces ------------------------------------------------------------------------------------------------------

    def springs(self, blocks: Any) -> np.ndarray | None:
        """A channel that cannot drain is as stiff as its fluid: K / aperture, in each step. By the aperture without
        opening and the length in the mesh: where things are must not count, as a restart finds masses again."""
        if not self.pushes or not self._on or blocks.options.flow_every > 1:
            return None
        return self.springs_of(blocks, self.fluid("fluid_bulk"))

    def springs_of(self, blocks: Any, modulus: float) -> np.ndarray:
        """Stiffness (n_own, 4) that what fills the channels brings to corners, by its modulus [Pa]."""
        faces, mesh = self._sides_and_free()[0], self.blocks.the_mesh()
        laws = self.laws()[self.row[np.minimum(faces, blocks.partner[faces])] - 1]
        delta = np.clip(laws[:, kernels.INITIAL], laws[:, kernels.LEAST], laws[:, kernels.MOST])
        each = modulus / mesh.dim * mesh.face_sizes(faces) / delta
        out = np.zeros((blocks.n_own, 4))
        for corner in mesh.face_corners(faces).T:
            np.add.at(out, (blocks.where[corner // 4] - blocks.n_left, corner % 4), each)
        return out

    def add_to(self, applied: np.ndarray) -> None:
        if not self.implicit:  # by the places of now in each step: a run that continues has no others
            self.find_shore()
        self.push(self.state, kernels.P, applied)

    def push(self, state: np.ndarray, column: int, applied: np.ndarray, free: bool = True) -> None:
        """Add a pressure on sides of channels, and on wet free faces if asked, to what is applied to corners: a column
        of rows like those of `state`, copies too. Not collective."""
        if not self.pushes:
            return
        loads: Any = kernels.loads
        for of in self._loads if free else self._loads[:1]:
            for one in of:
                loads(*one, self.blocks.x, state, column, applied)
