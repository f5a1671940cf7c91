"""Quantities that Python in a script can query: numbers of objects, values, sums."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.needed import needed
from hpcdem.commands.fdem.project import Project
from hpcdem.physics import supports
from hpcdem.physics.fdem import diagnostics, sides
from hpcdem.physics.fdem.groups import FLOW, NODE, SUPPORTS, Range
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import QUANTITIES as OF_WELLS
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant


def numbers(project: Project, kind: str, where: Range | None = None) -> np.ndarray:
    """Return the ascending numbers of the objects of a kind that a range selects; for nodes, their points.
    Collective.
    """
    found = everything(project, kind, where)
    return sides.points(project.whole_mesh().cells, found) if kind == NODE else found


def values(project: Project, kind: str, name: str, where: Range | None = None) -> np.ndarray:
    """Return a quantity of these objects in the order of their numbers (`numbers`), for nodes on the selected side; NaN
    where undefined. Collective.
    """
    if kind in SUPPORTS:
        return _of_supports(project, kind, name, where)
    if kind in FLOW:
        return _of_flow(project, kind, name, where)
    return diagnostics.values(project.ready(use=False), name, everything(project, kind, where))


def total(project: Project, kind: str, name: str, where: Range | None = None) -> float:
    """Return the exact sum of a quantity; for nodes, over all selected corners. Collective."""
    if kind in SUPPORTS:
        return math.fsum(_of_supports(project, kind, name, where).tolist())
    if kind in FLOW:
        return math.fsum(_of_flow(project, kind, name, where).tolist())
    return diagnostics.total(project.ready(use=False), name, everything(project, kind, where))


def _of_supports(project: Project, kind: str, name: str, where: Range | None) -> np.ndarray:
    numbers = everything(project, kind, where)  # refuses if there are no such objects
    return supports.of(project.ready(use=False), kind).values(kind, name, numbers)


def _of_flow(project: Project, kind: str, name: str, where: Range | None) -> np.ndarray:
    numbers = everything(project, kind, where)  # refuses if missing
    return Flow.of(project.ready(use=False)).values(kind, name, numbers)


def wells(project: Project) -> dict[str, dict[str, float]]:
    """Return the present quantities of wells by name (physics.flow.wells.QUANTITIES); empty without fluid."""
    flow = Flow.there(project.ready(use=False))
    return {} if flow is None else {
        well.name: {name: flow.well_value(well.name, name) for name in OF_WELLS} for well in flow.wells
    }  # fmt: skip


def wet_faces(project: Project) -> dict[str, np.ndarray]:
    """Return the free faces loaded by fluid pressure, see `Flow.wet_faces`; no rows without fluid. Collective."""
    found = Flow.there(project.ready(use=False))
    if found is None:
        return {"number": np.empty(0, np.int64), "size": np.empty(0), "pressure": np.empty(0)}
    return found.wet_faces()


def fluid(project: Project) -> dict[str, float]:
    """Return the budget of the fluid [m2], see `Flow.account`. Collective."""
    return needed(project, Flow, use=False).account()


def fluid_energies(project: Project) -> dict[str, float]:
    """Return the energies of blocks and fluid in implicit steps [J/m], see `Flow.energies`. Collective."""
    return needed(project, Flow, use=False).energies()


def proppant(project: Project) -> dict[str, float]:
    """Return the budget of proppant [m2], see `Proppant.account`. Collective."""
    return needed(project, Proppant, use=False).account()


def heat(project: Project) -> dict[str, float]:
    """Return the heat budget [J/m], see `Heat.account`. Collective."""
    return needed(project, Heat, use=False).account()


def energies(project: Project) -> dict[str, float]:
    """Return the energy budget [J/m, in space J]. Collective."""
    return diagnostics.energies(project.blocks)


def ratio(project: Project) -> float:
    """Return the ratio of unbalanced to total nodal forces. Collective."""
    return diagnostics.unbalanced_ratio(project.ready(use=False))
