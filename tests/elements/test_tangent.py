"""The stiffness of elements in the static solve, asked of all kinds alike: it is the derivative of their forces."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import equilibrium
from hpcdem.physics.fdem.simulation import Blocks
from tests.elements.bodies import KINDS, SOIL, body

ELASTIC = {"density": 2500.0, "young": 30e9, "poisson_ratio": 0.4}
STRESS = {"xx": -1e6, "yy": -7e6, "zz": -3e6, "xy": 1e6}


def prepared(name: str, law: str, large: bool, plate: bool = False, **properties: float) -> tuple[Blocks, np.ndarray]:
    sim = body(name, law, **properties)
    sim.option(large_strain=large, **({"plane_stress": True} if plate else {}))
    more = {"xz": 0.5e6, "yz": -0.8e6} if sim.dim == 3 else {}
    sim.initial_stress(None, **STRESS, **more) if not plate else sim.initial_stress(None, **{**STRESS, "zz": 0.0})
    sim.close_model()
    return sim, equilibrium.all_nodes(sim).x


def error(sim: Blocks, x: np.ndarray, step: float) -> float:
    """Largest difference between the matrix and central differences along three random ways, over the largest."""
    rng, worst = np.random.default_rng(11), 0.0
    nodes = equilibrium.all_nodes(sim)
    unknowns = equilibrium.unknowns_of(sim, nodes, 1)
    equilibrium.place_corners(sim, x)
    pieces, _ = equilibrium.tangent(sim)
    for _ in range(3):
        way, product = rng.uniform(-1.0, 1.0, x.shape), np.zeros(x.shape)
        for one in pieces:
            m, k = one.node.shape
            local = way[one.node].reshape(m, k * sim.dim, 1)
            np.add.at(product, one.node, (one.stiffness @ local).reshape(m, k, sim.dim))
        ends = [equilibrium.unbalanced(sim, nodes, unknowns, x + h * way)[0] for h in (step, -step)]
        slope = (ends[1] - ends[0]) / (2.0 * step)
        worst = max(worst, np.abs(product - slope).max() / np.abs(slope).max())
    return worst


@pytest.mark.parametrize("name", KINDS)
def test_of_elastic_elements(name: str) -> None:
    """Forces are linear in small strains: nothing but rounding is left. In large ones, of 1e-4 under an initial stress
    of 2e-4 E, terms of the order of the strain are left out."""
    sim, x = prepared(name, "mech_iso_elastic", False, **ELASTIC)
    assert error(sim, x, 1e-4) < 1e-10
    sim, x = prepared(name, "mech_iso_elastic", True, **ELASTIC)
    assert error(sim, x + np.random.default_rng(3).uniform(-2e-5, 2e-5, x.shape), 1e-6) < 1e-3


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize(
    ("name", "plate"),
    [*(pytest.param(*kind.values, False, marks=kind.marks) for kind in KINDS), ("triangle", True), ("quad", True)],
)
def test_of_elements_that_flow(name: str, large: bool, plate: bool) -> None:
    """Most of them do, in shear and in tension."""
    sim, x = prepared(name, "mech_mohr_coulomb", large, plate, **{**SOIL, "tensile": 0.5e6})
    x = x + np.random.default_rng(3).uniform(-4e-4, 4e-4, x.shape)
    equilibrium.place_corners(sim, x)
    flowing, elastic = (equilibrium.tangent(sim, flows=flows)[0] for flows in (True, False))
    changed = [np.abs(a.stiffness - b.stiffness).max(axis=(1, 2)) > 0.0 for a, b in zip(flowing, elastic) if len(a.key)]
    assert np.concatenate(changed).mean() > 0.5
    assert error(sim, x, 1e-9) < (1e-2 if large else 1e-4)
