"""Elements of liners in the plane: beams that may turn by any angle, by Euler and Bernoulli.

Element e of (m,) is a beam from node ends[e, 0] to ends[e, 1], the rock to its left. Angles and moments count
counter-clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from hpcdem.physics.fdem.connectivity import face_points
from hpcdem.physics.fdem.groups import LINER_ELEMENT, LINER_NODE
from hpcdem.physics.fdem.structures import Columns
from hpcdem.physics.liners import kernels, layout
from hpcdem.physics.liners.elements import BOND, Elements, Laid, of_bond, of_node, of_places

ROTARY = 1.0 / 78.0
"""Rotational inertia of half a beam over m L^2, m: its mass; the diagonal of the consistent mass matrix, scaled so that
the translations have all of it (Hinton, Rock and Zienkiewicz 1976)."""


class Beams(Elements):
    """Elements of liners in the plane: per metre of thickness."""

    corners: ClassVar[int] = 2
    parts: ClassVar[np.ndarray] = np.array([0, 1, 5])
    of_nodes: ClassVar[Columns] = {**of_node(2), "arc": (np.float64, 0), "turn": (np.float64, 0)}
    """arc: distance along the liner [m]; turn: rotation."""
    of_elements: ClassVar[Columns] = {
        **of_bond(2), "length": (np.float64, 0), "angle": (np.float64, 0), "form": (np.float64, 3),
        "force": (np.float64, 3), "plastic": (np.float64, 3),
    }  # fmt: skip
    """length, angle: as installed; form, force, plastic: see `bend`."""
    quantities: ClassVar[Mapping[str, Mapping[str, tuple[str, str]]]] = {
        LINER_NODE: {
            **of_places("xy", "N/m"),
            "rotation": ("rad", "rotation since its installation"),
            "spin": ("rad/s", "rate of rotation"),
            "reaction_moment": ("N m/m", "moment of conditions"),
            "distance": ("m", "distance along the liner from its first node, as installed"),
        },
        LINER_ELEMENT: {
            "axial_force": ("N/m", "axial force, tension positive"),
            "shear_force": ("N/m", "change of the moment along the element"),
            "moment_first": ("N m/m", "moment at its first node, positive with tension on the side away from the rock"),
            "moment_last": ("N m/m", "moment at its last node, positive with tension on the side away from the rock"),
            "axial_strain": ("1", "elongation since its installation, over its length"),
            "plastic_strain": ("1", "plastic part of it, in space its size"),
            "plastic_rotation": ("rad", "larger plastic rotation of its ends, without sign"),
            **BOND,
        },
    }
    parted_at: ClassVar[str] = "points"

    def lay(self, faces: np.ndarray, points: np.ndarray, at: np.ndarray) -> Laid:
        nodes = self.liners.nodes
        order, goes_on, old, parted = layout.chained(points, at, self._open_ends(), nodes["x"])
        return Laid(order, self._numbered(goes_on, old, layout.closing(points[order], goes_on)), parted, goes_on)

    def _open_ends(self) -> dict[int, tuple[list[int], list[int]]]:
        """Return by point of the mesh the nodes at which a liner ends and those at which one begins, that have no
        neighbour on the other side."""
        liners, beams = self.liners, self.liners.elements
        there = np.flatnonzero(self.there() & (beams["host"] >= 0))
        points, ends = face_points(liners.blocks.the_mesh().cells, beams["face"][there]), beams["ends"]
        in_use = ends[self.there()]
        found: dict[int, tuple[list[int], list[int]]] = {}
        for side in (1, 0):
            alone = ~np.isin(ends[there, side], in_use[:, 1 - side])
            for point, node in zip(points[alone, side].tolist(), ends[there[alone], side].tolist(), strict=True):
                found.setdefault(point, ([], []))[1 - side].append(node)
        return found

    def _numbered(self, goes_on: np.ndarray, old: list[tuple[int, int]], closed: list[tuple[int, int]]) -> np.ndarray:
        """(m, 2) nodes of new elements in the order of their chains; old: ends that have a node already; closed: first
        and last element of chains that come back to their beginning."""
        known, last = dict(old), {last: first for first, last in closed}
        ends, following = np.empty((len(goes_on), 2), np.int64), len(self.liners)
        for i, on in enumerate(goes_on.tolist()):
            for side in (0, 1):
                if side == 0 and on:
                    ends[i, 0] = ends[i - 1, 1]
                elif 2 * i + side in known:
                    ends[i, side] = known[2 * i + side]
                elif side == 1 and i in last and 2 * last[i] not in known:
                    ends[i, 1] = ends[last[i], 0]
                else:
                    ends[i, side] = following
                    following += 1
        return ends

    def begin(self, laid: Laid, nodes: dict[str, np.ndarray], elements: dict[str, np.ndarray]) -> None:
        liners, ends, goes_on = self.liners, laid.ends, laid.about
        x = np.concatenate([liners.nodes["x"], nodes["x"]])
        turn = np.concatenate([liners.nodes["turn"], nodes["turn"]])
        chord = x[ends[:, 1]] - x[ends[:, 0]]
        length = np.hypot(chord[:, 0], chord[:, 1])
        elements["length"][:], elements["angle"][:] = length, [math.atan2(y, x) for x, y in chord.tolist()]
        elements["form"][:] = np.column_stack([length, turn[ends]])
        chain = int(liners.nodes["liner"].max(initial=-1)) + np.cumsum(~goes_on)
        arc = 0.0
        for i in range(len(ends)):
            arc = arc if goes_on[i] else 0.0
            for side in (0, 1):
                row = ends[i, side] - len(liners)
                if row >= 0 and (side or not goes_on[i]) and not (side and row == ends[0, 0] - len(liners)):
                    nodes["liner"][row], nodes["arc"][row] = chain[i], arc + side * length[i]
            arc += length[i]
        first = ends[~goes_on, 0] - len(liners)
        nodes["arc"][first[first >= 0]] = 0.0  # also of closed ones

    def arrange(self) -> tuple[np.ndarray, ...]:
        liners, beams, column = self.liners, self.liners.elements, self.liners._column
        there, length, poisson = self.there(), beams["length"], column("poisson_ratio")
        held = 0.0 if liners.blocks.options.plane_stress else poisson**2
        young = np.where(there, column("young") / (1.0 - held), 0.0)
        area, inertia, rho = column("area"), column("inertia"), column("density")
        self.table = table = np.zeros((len(length), 5))
        table[:, kernels.AXIAL], table[:, kernels.BENDING] = young * area / length, young * inertia / length
        table[:, kernels.TENSION] = column("tensile_strength") * area
        table[:, kernels.COMPRESSION] = column("compressive_strength") * area
        table[:, kernels.PLASTIC_MOMENT] = column("plastic_moment", math.inf)
        self.along, self._mean = np.zeros((len(length), 2)), np.zeros((len(liners), 2))
        for e, (a, b) in enumerate(beams["ends"].tolist()):
            chord = liners.nodes["x"][b] - liners.nodes["x"][a]
            self.along[e] = chord / math.sqrt(chord[0] * chord[0] + chord[1] * chord[1])
        mass = np.where(there, 0.5 * rho * area * length, 0.0)
        turning = 2.0 * ROTARY * mass * length**2 + np.where(there, 0.5 * rho * inertia * length, 0.0)
        shear = table[:, kernels.BENDING] / np.where(length > 0.0, length, 1.0) ** 2
        # Of 2 E A / L, 36 E I / L^3, and for rotations 18 E I / L.
        stiff, turns = table[:, kernels.AXIAL] + 18.0 * shear, 9.0 * table[:, kernels.BENDING]
        return mass, turning, np.column_stack([stiff, stiff]), np.column_stack([turns, turns])

    def frames(self, frame: np.ndarray) -> None:
        beams = self.liners.elements
        kernels.frames(beams["ends"], self.along, beams["state"], self._mean, frame)

    def turn(self, dt: float) -> None:
        self.liners.nodes["turn"] += self.liners.nodes["spin"] * dt

    def bend(self, work: np.ndarray) -> None:
        beams, nodes = self.liners.elements, self.liners.nodes
        kernels.bend(
            beams["ends"], nodes["x"], nodes["turn"], self.table, beams["angle"], self.along, beams["form"],
            beams["force"], beams["plastic"], beams["state"], work,
        )  # fmt: skip

    def push(self, frame: np.ndarray, total: np.ndarray, on_rock: np.ndarray) -> None:
        beams = self.liners.elements
        kernels.push(
            beams["ends"], self.along, frame, beams["form"], beams["force"], beams["state"],
            beams["pressure"].reshape(-1), beams["shear"].reshape(-1, 1), total, on_rock,
        )  # fmt: skip

    def stored(self) -> np.ndarray:
        """N^2 L / (2 E A) + L (Ma^2 - Ma Mb + Mb^2) / (6 E I)."""
        n, a, b = self.liners.elements["force"].T
        axial, bending = self.table[:, kernels.AXIAL], self.table[:, kernels.BENDING]
        with np.errstate(divide="ignore", invalid="ignore"):
            found = n**2 / (2.0 * axial) + (a * a - a * b + b * b) / (6.0 * bending)
        return np.where(axial > 0.0, found, 0.0)

    def areas(self, elements: np.ndarray) -> np.ndarray:
        return 0.5 * self.liners.elements["length"][elements]

    def sizes(self) -> np.ndarray:
        return self.liners.elements["length"]

    def contributing(self) -> list[np.ndarray]:
        beams = self.liners.elements
        moment = np.abs(beams["force"][:, 1:]) / beams["length"][:, None]
        return [2.0 * np.abs(beams["force"][:, 0]), 2.0 * np.abs(self.element_value("shear_force")), moment]

    def node_value(self, name: str) -> np.ndarray:
        return self.liners.nodes[{"distance": "arc", "rotation": "turn"}.get(name, name)].copy()

    def element_value(self, name: str) -> np.ndarray:
        beams = self.liners.elements
        n, first, last = beams["force"].T
        match name:
            case "axial_force":
                return n.copy()
            case "shear_force":
                return (first + last) / beams["form"][:, 0]
            case "moment_first":
                return -first
            case "moment_last":
                return last.copy()
            case "axial_strain":
                return (beams["form"][:, 0] - beams["length"]) / beams["length"]
            case "plastic_strain":
                return beams["plastic"][:, 0] / beams["length"]
        return np.abs(beams["plastic"][:, 1:]).max(axis=1)  # plastic_rotation

    def ends_by_name(self) -> dict[str, np.ndarray]:
        first, last = self.liners.elements["ends"].T
        return {"first_node": first.copy(), "last_node": last.copy()}
