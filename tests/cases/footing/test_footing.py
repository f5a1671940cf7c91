"""Bearing capacity of a strip footing on Mohr-Coulomb soil without weight, by quads and by triangles.

Half of the footing, 1 m, goes down on a block of n elements per metre, which grow outwards, in static mode at small
strain until its load stays. The movement falls to zero over the next element: as usual (FLAC's verification problem of
this footing) half of it counts as footing. Without that the load per metre is 1 / (2 n) higher.

Found, in parts of the closed form, phi = 0, rough base (smooth base): quads 16 per metre 1.013 (0.996), 32 per metre
1.011 (0.999); triangles with diagonals in turn, 16 per metre, 1.059 and still rising: they lock, as flow of constant
volume asks more of them than they can do; four triangles in each cell 1.015, with four times as many elements. phi =
psi = 20 degrees, with a load beside it, 24 quads per metre: 1.025 (0.986, and it falls slowly on).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.cases.footing import exact

COHESION = 1e5
SOIL = {"density": 2000.0, "bulk": 2e9, "shear": 1e9, "cohesion": COHESION, "tensile": 1e12}
GROWTH = 1.1
"""From element to element, away from the footing."""


class Loads(NamedTuple):
    """Pressure below the footing [Pa], with half of the next element as footing and without."""

    pressure: float
    bare: float


def sizes(first: float, length: float) -> np.ndarray:
    """Ends of elements that grow, from 0 to a length [m]; the first is about as large as said."""
    count = round(np.log(1.0 + length / first * (GROWTH - 1.0)) / np.log(GROWTH))
    ends = np.cumsum(first * GROWTH ** np.arange(count))
    return ends * length / ends[-1]


def ground(n: int, width: float, depth: float, kind: str) -> tuple[Mesh, float]:
    """The block, and the size of the element beside the footing [m]. kind: "quad", "turn" (two triangles per cell,
    diagonals in turn), "both" (four)."""
    beside = sizes(1.0 / n, width - 1.0)
    x = np.concatenate([np.linspace(0.0, 1.0, n + 1), 1.0 + beside])
    y = np.concatenate([[0.0], -sizes(1.0 / n, depth)])[::-1]
    points = [(a, b) for a in x for b in y]
    cells: list[tuple[int, int, int, int]] = []
    for i in range(len(x) - 1):
        for j in range(len(y) - 1):
            a, b = i * len(y) + j, (i + 1) * len(y) + j
            d, c = a + 1, b + 1
            if kind == "quad":
                cells.append((a, b, c, d))
            elif kind == "turn":
                cells += [(a, b, c, -1), (a, c, d, -1)] if (i + j) % 2 else [(a, b, d, -1), (b, c, d, -1)]
            else:
                middle = len(points)
                points.append((0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1])))
                cells += [(p, q, middle, -1) for p, q in ((a, b), (b, c), (c, d), (d, a))]
    return Mesh.of(np.array(points), cells), float(beside[0])


def pushed(
    n: int, rough: bool, kind: str = "quad", friction: float = 0.0, dilation: float | None = None, load: float = 0.0
) -> Loads:
    """The pressure at which the footing goes on."""
    width, depth = (8.0, 5.0) if friction else (5.0, 3.0)
    mesh, beside = ground(n, width, depth, kind)
    sim = Blocks()
    sim.take_mesh(mesh)
    dilation = friction if dilation is None else dilation
    changes.element_model(sim, None, "mech_mohr_coulomb", {**SOIL, "friction": friction, "dilation": dilation})
    sim.option(dynamic=False, collision=False, large_strain=False)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > width - 1e-9)), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9 - depth), vx=0.0, vy=0.0)
    if load:
        sim.initial_stress(None, xx=-load, yy=-load, zz=-load)
        edges = mesh.edges()
        outer = edges.faces[~edges.inner][:, 0]
        sim.stress_condition(
            outer[(mesh.points[edges.points[~edges.inner]][:, :, 1] > -1e-9).all(axis=1)], normal=-load
        )
    base = np.flatnonzero((y > -1e-9) & (x < 1.0 + 1e-9))
    speed = (6e-5 if friction else 1.5e-5) / n / 3.0
    sim.velocity_condition(base, vy=-speed, **({"vx": 0.0} if rough else {}))
    sim.velocity_condition(base[x[base] < 1e-9], vx=0.0, vy=-speed)
    readings = [0.0]
    for _ in range(20):
        convergence.advance(sim, 60 * n)
        readings.append(-diagnostics.total(sim, "reaction_y", base))
        if abs(readings[-1] - readings[-2]) < 5e-4 * readings[-1] and diagnostics.unbalanced_ratio(sim) < 2e-5:
            break
    assert diagnostics.unbalanced_ratio(sim) < 1e-4
    found = Loads(readings[-1] / (1.0 + 0.5 * beside) + load, readings[-1] + load)
    print(kind, n, "rough" if rough else "smooth", friction, np.array(found) / exact.pressure(COHESION, friction, load))
    return found


@pytest.mark.parametrize("rough", [True, False])
def test_cohesive_soil(rough):
    found = pushed(16, rough)
    assert found.pressure == pytest.approx(exact.pressure(COHESION, 0.0, 0.0), rel=0.02)
    assert exact.pressure(1.0, 0.0, 0.0) == pytest.approx(5.1416, abs=1e-4)


@pytest.mark.slow
def test_smaller_elements():
    """Within 3 % even of the footing alone."""
    found = pushed(32, True)
    want = exact.pressure(COHESION, 0.0, 0.0)
    assert found.pressure == pytest.approx(want, rel=0.015) and found.bare == pytest.approx(want, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("rough", [True, False])
def test_soil_with_friction(rough):
    found = pushed(24, rough, friction=20.0, load=COHESION)
    assert exact.pressure(1.0, 20.0, 0.0) == pytest.approx(14.835, abs=1e-3)
    assert exact.pressure(0.0, 20.0, 1.0) == pytest.approx(6.399, abs=1e-3)
    assert found.pressure == pytest.approx(exact.pressure(COHESION, 20.0, COHESION), rel=0.03)


@pytest.mark.slow
def test_triangles_lock():
    """Two in a cell bear more than quads of the same nodes, four hardly more."""
    want = exact.pressure(COHESION, 0.0, 0.0)
    two, four = (pushed(16, True, kind).pressure / want for kind in ("turn", "both"))
    assert 1.04 < two < 1.08 and four == pytest.approx(1.0, abs=0.03)
