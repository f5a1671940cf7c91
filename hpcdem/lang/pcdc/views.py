"""`pcdc` in the Python of a script: queries of the present model. Every query is collective: all ranks must execute it,
as they do commands.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.commands import fdem
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc.vector import Vector
from hpcdem.physics.fdem import groups as g

KINDS = {
    "element": g.ELEMENT, "node": g.NODE, "joint": g.JOINT, "face": g.FACE,
    **{kind: kind for kind in (*g.SUPPORTS, *g.FLOW)},
}  # fmt: skip
_VECTORS = ("position", "displacement", "velocity", "reaction")


class Accounts:
    """Quantities of blocks at this moment, for scripts and Python programs."""

    def _now(self, ask: Callable[[Any], Any]) -> Any:
        """Evaluate a function of the project. Collective."""
        raise NotImplementedError

    @property
    def creep_time(self) -> float:
        """Time that the elements have crept [s]."""
        return self._now(lambda project: float(project.blocks.creep.time))

    @property
    def energies(self) -> dict[str, float]:
        """The energy budget of the blocks [J/m], in space [J], once option energy is on. Collective."""
        return self._now(fdem.queries.energies)

    @property
    def ratio(self) -> float:
        """Unbalanced over all forces of the nodes. Collective."""
        return self._now(fdem.queries.ratio)

    @property
    def wet_faces(self) -> dict[str, np.ndarray]:
        """Free faces before which water stands: number (element * 4 + face), size [m], in space [m2], and the mean
        pressure that pushes on each [Pa]. Collective."""
        return self._now(fdem.queries.wet_faces)

    @property
    def fluid(self) -> dict[str, float]:
        """The account of the fluid [m2]: given, stored, leaked, removed; what does not add up. Collective."""
        return self._now(fdem.queries.fluid)

    @property
    def fluid_energies(self) -> dict[str, float]:
        """The energy of blocks and fluid in implicit steps [J/m], in space [J]: pumped, leaked, viscous, fluid, strain,
        joints, fracture, outside; what does not add up. Collective."""
        return self._now(fdem.queries.fluid_energies)

    @property
    def proppant(self) -> dict[str, float]:
        """The account of proppant [m2]: came, stored, packed, left, removed; what does not add up. Collective."""
        return self._now(fdem.queries.proppant)

    @property
    def heat(self) -> dict[str, float]:
        """The account of heat [J/m]: given, commands, stored, fluid, removed; what does not add up. Collective."""
        return self._now(fdem.queries.heat)


class Model(Accounts):
    """`pcdc.time`, `pcdc.node(3).velocity`, `pcdc.values('element', 'stress-yy', group='rock')`."""

    def __init__(self, project: Any, query: Callable[..., Any]) -> None:
        self._project, self._query = project, query

    def _now(self, ask: Callable[[Any], Any]) -> Any:
        return self._query(lambda: ask(self._project))

    @property
    def time(self) -> float:
        """Model time [s]."""
        return self._query(lambda: float(self._project.blocks.clock.time))

    @property
    def cycle(self) -> int:
        """Steps done."""
        return self._query(lambda: int(self._project.blocks.clock.step))

    @property
    def solved(self) -> dict[str, Any]:
        """Outcome of the last `model solve`: "reason" (ratio, cycles, time; without equilibrium: no progress, limit,
        runaway), "ratio" at the end (NaN if not evaluated), "steps" it took. Empty before the first.
        """
        return self._query(lambda: dict(self._project.solved))

    @property
    def rank(self) -> int:
        """Number of this rank, from 0."""
        return int(self._project.comm.rank)

    @property
    def wells(self) -> dict[str, dict[str, float]]:
        """Wells by name: pressure [Pa], rate [m2/s], injected [m2], stage."""
        return self._query(lambda: fdem.queries.wells(self._project))

    def field(self, name: str) -> dict[str, float]:
        """The account of a field of elements, as "moisture": given, commands, stored, removed, closing, relative."""
        return self._query(lambda: fdem.fields.account(self._project, name))

    def node(self, number: int) -> View:
        """A node by its number: .position, .displacement, .velocity, .reaction (Vectors), .values(name)."""
        return View(self, "node", number)

    def element(self, number: int) -> View:
        """An element: .stress_xx, .stress_yy, .stress_xy, .stress_zz."""
        return View(self, "element", number)

    def joint(self, number: int) -> View:
        """A joint: .opening, .slip, .damage, .state, .normal_stress, .shear_stress (means), .normal_stress_largest,
        .shear_stress_largest (of its points)."""
        return View(self, "joint", number)

    def numbers(self, kind: str, **where: Any) -> np.ndarray:
        """Numbers of the elements, nodes, joints, faces, elements and nodes of bolts and liners, flow-nodes or
        flow-channels that are there: of a group (group=, set=), of a layer (geometry=), or x=(from, to), y=, z= in the
        mesh, with present=True by where they are now; of a group of elements (face_of=), of elements by number
        (element=), or as RANGE has it between=, boundary=True, crack=True."""
        query = f"numbers {kind} {where}"
        return self._query(lambda: fdem.queries.numbers(self._project, _kind(kind), _range(where)), query)

    def values(self, kind: str, name: str, **where: Any) -> np.ndarray:
        """A quantity by name, in the order of numbers; of nodes with face_of= or element= on their side."""
        query = f"values {kind} {name} {where}"
        return self._query(lambda: fdem.queries.values(self._project, _kind(kind), _name(name), _range(where)), query)

    def total(self, kind: str, name: str, **where: Any) -> float:
        """Exact sum of a quantity."""
        query = f"total {kind} {name} {where}"
        return self._query(lambda: fdem.queries.total(self._project, _kind(kind), _name(name), _range(where)), query)

    def history(self, name: str) -> np.ndarray:
        """(n, 3) step, time and value of what a history has recorded."""

        def rows() -> np.ndarray:
            return np.array(fdem.histories.find(self._project, name).rows, np.float64).reshape(-1, 3)

        return self._query(rows)


class View:
    """One object; its quantities are attributes."""

    def __init__(self, model: Model, kind: str, number: int) -> None:
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)):
            raise CommandError(f"pcdc.{kind}({number!r}): the number of the {kind} must be a whole number")
        self._model, self._kind, self._number = model, kind, int(number)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if self._kind == "node" and name in _VECTORS:
            return Vector(*(self.value(f"{name}_{axis}") for axis in "xyz"[: self._model._project.dim]))
        return self.value(name)

    def value(self, name: str) -> float:
        """A quantity of it by name."""
        found = self._model.values(self._kind, name, id=self._number)
        return float(found[0])


def _kind(kind: str) -> str:
    if kind not in KINDS:
        raise CommandError(f"'{kind}' is not one of {', '.join(KINDS)}")
    return KINDS[kind]


def _name(name: str) -> str:
    return name.replace("-", "_")


def _range(where: dict[str, Any]) -> g.Range | None:
    terms: list[g.Term] = []
    set_name = where.pop("set", None)
    if where.pop("present", False):
        terms.append(g.Present())
    of_set = set_name or g.DEFAULT
    for word, value in where.items():
        if word == "group":
            terms.append(g.InGroup(value, of_set))
        elif word == "face_of":
            terms.append(g.OfElements(value, of_set))
        elif word == "between":
            terms.append(g.Between(value[0], value[1], of_set))
        elif word == "geometry":
            terms.append(g.OnLayer(value))
        elif word in ("id", "element"):
            first, last = value if isinstance(value, (tuple, list)) else (value, value)
            terms.append((g.Ids if word == "id" else g.OfElement)(int(first), int(last)))
        elif word in ("x", "y", "z"):
            terms.append(g.Span("xyz".index(word), float(value[0]), float(value[1])))
        elif word in ("boundary", "crack"):
            terms += [g.OnBoundary() if word == "boundary" else g.OnCrack()] * bool(value)
        else:
            raise CommandError(
                f"'{word}' is not one of group, face_of, between, set, geometry, id, element, x, y, z, boundary, crack "
                "and present"
            )
    if set_name is not None and not where.keys() & {"group", "face_of", "between"}:
        terms.append(g.InSet(set_name))
    return tuple(terms) or None
