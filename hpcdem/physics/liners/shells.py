"""Elements of liners in space: flat triangular shells.

The membrane has constant strain; plates bend after Batoz, Bathe and Ho 1980 (DKT): without shear deformation at the
corners and along the sides, with moments that are linear. Rotations of nodes about the normal of an element, of which
neither knows anything, are held at that of the element by a weak spring. Columns and frames: kernels_space.py.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from hpcdem.physics.fdem.assignments import COMPONENTS
from hpcdem.physics.fdem.groups import LINER_ELEMENT, LINER_NODE
from hpcdem.physics.fdem.structures import Columns
from hpcdem.physics.liners import kernels_space as kernels
from hpcdem.physics.liners import layout
from hpcdem.physics.liners.elements import BOND, Elements, Laid, of_bond, of_node, of_places
from hpcdem.physics.liners.kernels_space import (
    AREA,
    COMPRESSION,
    DRILL,
    MEMBRANE,
    NU,
    OF_MEMBRANE,
    OF_PLATE,
    PLASTIC_MOMENT,
    PLATE,
    TENSION,
    TURNS,
)  # fmt: skip

HELD = 0.1
"""Stiffness of a rotation about the normal over that of the plate, E t^3 / 12 (1 - nu^2)."""
ROTARY = 2.0 / 39.0
"""Rotational inertia of a node over its mass and the area of the element: as that of beams (beams.ROTARY) of a length
L, L^2 = 2 A, which is the leg of half a square."""
SIDES = ((0, 1), (1, 2), (2, 0))


def slopes(rest: np.ndarray) -> np.ndarray:
    """(m, 3, 2) gradients of linear shape functions of triangles with corners at (0, 0), (l, 0) and (x, y): rest (m, 3)
    l, x, y [m]."""
    length, x, y = rest.T
    nothing = np.zeros_like(x)
    out = np.stack([np.stack([-y, y, nothing], axis=1), np.stack([x - length, -x, length], axis=1)], axis=2)
    return out / (length * y)[:, None, None]


def curvatures(rest: np.ndarray) -> np.ndarray:
    """(m, 9, 6): curvatures at the middles of three sides from the rotations of three corners about both axes.

    Normals turn by b = (turn about 2, -turn about 1), which is quadratic; in the middle of a side between i and j its
    part along the side, of direction s, is -(b_i + b_j) / 4, as that of a cubic deflection which is 0 at both ends; its
    part across is linear.
    """
    slope, m = slopes(rest), len(rest)
    length, x, y = rest.T
    nothing = np.zeros_like(x)
    corner = np.stack([np.stack([nothing, nothing], 1), np.stack([length, nothing], 1), np.stack([x, y], 1)], axis=1)
    out = np.zeros((m, 3, 3, 3, 2))
    for p, ends in enumerate(SIDES):
        weight = np.zeros(3)
        weight[list(ends)] = 0.5
        of_corner = (4.0 * weight - 1.0)[None, :, None] * slope
        gradient = np.zeros(
            (m, 3, 2, 2, 2)
        )  # of component c of b along axis d, from component g of corner k: k, c, g, d
        gradient[:, :, 0, 0], gradient[:, :, 1, 1] = of_corner, of_corner
        for i, j in SIDES:
            edge = corner[:, j] - corner[:, i]
            edge /= np.linalg.norm(edge, axis=1)[:, None]
            there = 0.5 * np.eye(2) - 0.75 * edge[:, :, None] * edge[:, None, :]
            of_side = 4.0 * (weight[i] * slope[:, j] + weight[j] * slope[:, i])
            for k in (i, j):
                gradient[:, k] += there[:, :, :, None] * of_side[:, None, None, :]
        bent = np.stack(
            [gradient[:, :, 0, :, 0], gradient[:, :, 1, :, 1], gradient[:, :, 0, :, 1] + gradient[:, :, 1, :, 0]],
            axis=1,
        )
        out[:, p, :, :, 0], out[:, p, :, :, 1] = -bent[..., 1], bent[..., 0]
    return out.reshape(m, 9, 6)


def stiffnesses(table: np.ndarray, rest: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """(m, 18, 18) of elements as installed: of each corner three displacements and three rotations, in the frame."""
    slope, m = slopes(rest), len(rest)
    nu, nothing, one = table[:, NU], np.zeros(m), np.ones(m)
    plane = np.stack(
        [
            np.stack(row, axis=1)
            for row in ((one, nu, nothing), (nu, one, nothing), (nothing, nothing, 0.5 * (1.0 - nu)))
        ],
        axis=1,
    )
    strain, own = np.zeros((m, 3, 3, 6)), np.zeros((m, 3, 3, 3, 6))  # own: rotations of corners against the element
    strain[:, 0, :, 0], strain[:, 1, :, 1] = slope[:, :, 0], slope[:, :, 1]
    strain[:, 2, :, 0], strain[:, 2, :, 1] = slope[:, :, 1], slope[:, :, 0]
    for k in range(3):
        own[:, k, 0, :, 2], own[:, k, 1, :, 2] = -slope[:, :, 1], slope[:, :, 0]
        own[:, k, 2, :, 0], own[:, k, 2, :, 1] = 0.5 * slope[:, :, 1], -0.5 * slope[:, :, 0]
        for c in range(3):
            own[:, k, c, k, 3 + c] = 1.0
    strain, own = strain.reshape(m, 3, 18), own.reshape(m, 3, 3, 18)
    bent = np.einsum("mri,mij->mrj", curve, own[:, :, :2].reshape(m, 6, 18)).reshape(m, 3, 3, 18)
    out = np.einsum("mai,mab,mbj->mij", strain, (table[:, AREA] * table[:, MEMBRANE])[:, None, None] * plane, strain)
    out += np.einsum(
        "mpai,mab,mpbj->mij", bent, (table[:, AREA] / 3.0 * table[:, PLATE])[:, None, None] * plane, bent, optimize=True
    )
    return out + np.einsum("mki,m,mkj->mij", own[:, :, 2], table[:, DRILL], own[:, :, 2])


def rotations(posture: np.ndarray) -> np.ndarray:
    """Rotation vectors (n, 3) [rad] of unit quaternions (n, 4), up to half a turn."""
    q = np.where(posture[:, :1] < 0.0, -posture, posture)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    part = np.divide(2.0 * np.arctan2(sine, q[:, 0]), sine, out=np.full(len(q), 2.0), where=sine > 0.0)
    return part[:, None] * q[:, 1:]


def _energy(t: np.ndarray, stiff: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """(m,) per area, of tensors (m, 3) of forces."""
    normal = t[:, 0] ** 2 + t[:, 1] ** 2 - 2.0 * nu * t[:, 0] * t[:, 1]
    twice = normal / (1.0 - nu**2) + 2.0 * t[:, 2] ** 2 / (1.0 - nu)
    return np.divide(0.5 * twice, stiff, out=np.zeros(len(t)), where=stiff > 0.0)


_TENSORS = {
    "membrane": ("N/m", "force of the membrane"),
    "bending": ("N m/m", "moment, positive with tension on the side away from the rock"),
}


class Shells(Elements):
    """Elements of liners in space."""

    corners: ClassVar[int] = 3
    parts: ClassVar[np.ndarray] = np.arange(6)
    of_nodes: ClassVar[Columns] = {**of_node(3), "posture": (np.float64, 4)}
    """posture: rotation since installation, as a unit quaternion."""
    of_elements: ClassVar[Columns] = {
        **of_bond(3), "rest": (np.float64, 3), "seat": (np.float64, 27), "form": (np.float64, 12),
        "force": (np.float64, 12), "plastic": (np.float64, 12),
    }  # fmt: skip
    """rest: as installed, see `slopes`; seat: see `shape`; form, force, plastic: see the columns above."""
    quantities: ClassVar[Mapping[str, Mapping[str, tuple[str, str]]]] = {
        LINER_NODE: {
            **of_places("xyz", "N/m"),
            **{f"rotation_{axis}": ("rad", f"rotation vector since it was installed, in {axis}") for axis in "xyz"},
            **{f"spin_{axis}": ("rad/s", f"rate of rotation about {axis}") for axis in "xyz"},
            **{f"reaction_moment_{axis}": ("N m/m", f"moment about {axis} of conditions") for axis in "xyz"},
        },
        LINER_ELEMENT: {
            **{
                f"{name}_{part}": (unit, f"{of} principal {doc}")
                for name, (unit, doc) in _TENSORS.items()
                for part, of in (("largest", "larger (most tensile)"), ("smallest", "smaller"))
            },
            **{
                f"{name}_{c}": (unit, f"component {c} of the {doc}")
                for name, (unit, doc) in _TENSORS.items()
                for c in COMPONENTS[3]
            },
            "transverse_shear": ("N/m", "force across the shell, the change of its moments"),
            "plastic_strain": ("1", "plastic part of it, in space its size"),
            "plastic_curvature": ("1/m", "largest plastic curvature, without sign"),
            **BOND,
        },
    }
    parted_at: ClassVar[str] = "edges"

    def lay(self, faces: np.ndarray, points: np.ndarray, at: np.ndarray) -> Laid:
        liners, shells = self.liners, self.liners.elements
        there = np.flatnonzero(self.there() & (shells["host"] >= 0))
        old = liners.blocks.the_mesh().face_points(shells["face"][there])
        ends, label, parted = layout.joined(points, at, old, shells["ends"][there], liners.nodes["x"])
        return Laid(np.arange(len(faces)), ends, parted, label)

    def begin(self, laid: Laid, nodes: dict[str, np.ndarray], elements: dict[str, np.ndarray]) -> None:
        before, ends = self.liners.nodes, laid.ends
        nodes["posture"][:, 0] = 1.0
        x, posture = (np.concatenate([before[name], nodes[name]]) for name in ("x", "posture"))
        frame, turn = np.zeros((3, 3)), np.zeros((3, 3))
        for e, three in enumerate(ends):
            elements["rest"][e] = kernels.lie(x[three[0]], x[three[1]], x[three[2]], frame)
            for k, i in enumerate(three):
                kernels.matrix(posture[i], turn)
                elements["seat"][e, 9 * k : 9 * k + 9] = (frame @ turn).reshape(-1)
        first = int(before["liner"].max(initial=-1)) + 1
        new = ends >= len(self.liners)
        nodes["liner"][ends[new] - len(self.liners)] = first + np.repeat(laid.about, 3).reshape(ends.shape)[new]

    def arrange(self) -> tuple[np.ndarray, ...]:
        liners, shells, column = self.liners, self.liners.elements, self.liners._column
        there, rest, m = self.there(), shells["rest"], len(shells["row"])
        young, thick, nu = np.where(there, column("young"), 0.0), column("thickness"), column("poisson_ratio")
        self.table = table = np.zeros((m, 8))
        table[:, AREA], table[:, NU] = 0.5 * rest[:, 0] * rest[:, 2], nu
        table[:, MEMBRANE] = young * thick / (1.0 - nu**2)
        table[:, PLATE] = table[:, MEMBRANE] * thick**2 / 12.0
        table[:, DRILL] = HELD * table[:, PLATE]
        table[:, TENSION] = column("tensile_strength") * thick
        table[:, COMPRESSION] = column("compressive_strength") * thick
        table[:, PLASTIC_MOMENT] = column("plastic_moment", math.inf)
        self.slope, self.curve = slopes(rest), curvatures(rest)
        self.frame, self._mean = np.zeros((m, 3, 3)), np.zeros((len(liners), 3))
        kernels.place(shells["ends"], liners.nodes["x"], shells["state"], self.slope, self.frame)
        mass = np.where(there, column("density") * thick * table[:, AREA] / 3.0, 0.0)
        turning = mass * (ROTARY * table[:, AREA] + thick**2 / 12.0)
        stiff, turns = np.zeros((m, 3)), np.zeros((m, 3))
        for some in np.array_split(np.arange(m), m // 1000 + 1):
            rows = np.abs(stiffnesses(table[some], rest[some], self.curve[some])).reshape(-1, 3, 6, 3, 6)
            edge = rows[..., :3].sum(axis=(3, 4)), rows[..., 3:].sum(axis=(3, 4))
            size = self.sizes()[some][:, None, None]
            stiff[some] = 0.5 * (edge[0] + edge[1] / size)[:, :, :3].max(axis=2)
            turns[some] = 0.5 * (edge[0] * size + edge[1])[:, :, 3:].max(axis=2)
        return mass, turning, stiff, turns

    def frames(self, frame: np.ndarray) -> None:
        shells = self.liners.elements
        kernels.frames(shells["ends"], self.liners.nodes["x"], self.frame, shells["state"], self._mean, frame)

    def turn(self, dt: float) -> None:
        kernels.turn_nodes(self.liners.nodes["posture"], self.liners.nodes["spin"], dt)

    def bend(self, work: np.ndarray) -> None:
        shells, nodes = self.liners.elements, self.liners.nodes
        kernels.bend(
            shells["ends"], nodes["x"], nodes["posture"], self.table, self.slope, self.curve,
            shells["seat"].reshape(-1, 3, 3, 3), self.frame, shells["form"], shells["force"], shells["plastic"],
            shells["state"], work,
        )  # fmt: skip

    def push(self, frame: np.ndarray, total: np.ndarray, on_rock: np.ndarray) -> None:
        shells = self.liners.elements
        kernels.push(
            shells["ends"], self.table, self.slope, self.curve, self.frame, frame, shells["form"], shells["force"],
            shells["state"], shells["pressure"].reshape(-1), shells["shear"].reshape(-1, 2), total, on_rock,
        )  # fmt: skip

    def stored(self) -> np.ndarray:
        force, table = self.liners.elements["force"], self.table
        found = _energy(force[:, OF_MEMBRANE], table[:, MEMBRANE], table[:, NU])
        for p in range(3):
            found += _energy(force[:, 3 + 3 * p : 6 + 3 * p], table[:, PLATE], table[:, NU]) / 3.0
        held = self.liners.elements["form"][:, TURNS + 2 :: 3]
        return table[:, AREA] * found + 0.5 * table[:, DRILL] * (held**2).sum(axis=1)

    def areas(self, elements: np.ndarray) -> np.ndarray:
        rest = self.liners.elements["rest"][elements]
        return rest[:, 0] * rest[:, 2] / 6.0

    def sizes(self) -> np.ndarray:
        """The leg of half a square of the same area."""
        rest = self.liners.elements["rest"]
        return np.sqrt(rest[:, 0] * rest[:, 2])

    def contributing(self) -> list[np.ndarray]:
        force, area = self.liners.elements["force"], self.table[:, AREA]
        n = force[:, [[0, 2], [2, 1]]]
        of_membrane = area[:, None] * np.linalg.norm(np.einsum("mij,mkj->mki", n, self.slope), axis=2)
        moment = np.einsum("mrc,mr->mc", self.curve, force[:, OF_PLATE]) * (area / 3.0 / self.sizes())[:, None]
        return [of_membrane, self.element_value("transverse_shear") * self.sizes(), np.abs(moment)]

    def node_value(self, name: str) -> np.ndarray:
        stem, _, axis = name.rpartition("_")
        nodes = self.liners.nodes
        found = nodes["spin"] if stem == "spin" else rotations(nodes["posture"])
        return found[:, "xyz".index(axis)].copy()

    def element_value(self, name: str) -> np.ndarray:
        shells = self.liners.elements
        force, plastic = shells["force"], shells["plastic"]
        points = force[:, OF_PLATE].reshape(-1, 3, 3)
        stem, _, part = name.rpartition("_")
        if stem in _TENSORS:
            t = force[:, OF_MEMBRANE] if stem == "membrane" else points.mean(axis=1)
            middle, half = 0.5 * (t[:, 0] + t[:, 1]), np.hypot(0.5 * (t[:, 0] - t[:, 1]), t[:, 2])
            if part in ("largest", "smallest"):
                return middle + half if part == "largest" else middle - half
            a, b = ("xyz".index(axis) for axis in part)
            return np.einsum("mij,mi,mj->m", t[:, [[0, 2], [2, 1]]], self.frame[:, :2, a], self.frame[:, :2, b])
        if name == "transverse_shear":
            corner = points[:, [0, 0, 1]] + points[:, [2, 1, 2]] - points[:, [1, 2, 0]]
            along = np.einsum("mkr,mkc->mrc", corner, self.slope)
            return np.hypot(along[:, 0, 0] + along[:, 2, 1], along[:, 2, 0] + along[:, 1, 1])
        if name == "plastic_strain":
            e = plastic[:, OF_MEMBRANE]
            return np.sqrt(e[:, 0] ** 2 + e[:, 1] ** 2 + 0.5 * e[:, 2] ** 2)
        k = plastic[:, OF_PLATE].reshape(-1, 3, 3)
        middle, half = 0.5 * (k[..., 0] + k[..., 1]), 0.5 * np.hypot(k[..., 0] - k[..., 1], k[..., 2])
        return (np.abs(middle) + half).max(axis=1)

    def ends_by_name(self) -> dict[str, np.ndarray]:
        names = ("first_node", "second_node", "last_node")
        return {name: column.copy() for name, column in zip(names, self.liners.elements["ends"].T, strict=True)}
