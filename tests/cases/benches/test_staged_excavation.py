"""A slope is made by taking out four benches one after the other: relaxation, the static solve, and a finite element
program of its own (plain_fe.py) give the same displacements. Then in rock that yields."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import model, rectangle
from tests.cases.benches import plain_fe

RHO, YOUNG, NU, G = 2500.0, 1e9, 0.3, 9.81
WIDTH, HEIGHT, BENCH, STAGES = 40.0, 20.0, 2.5, 4


def box(kind: str, size: float) -> Mesh:
    return rectangle(round(WIDTH / size), round(HEIGHT / size), WIDTH, HEIGHT, kind=kind)


def bench(mesh: Mesh, stage: int) -> np.ndarray:
    """Elements of a bench: 2.5 m high, beginning 2.5 m farther on the lower it lies (45 degrees on the whole)."""
    x, y = mesh.centroids().T
    top = HEIGHT - BENCH * stage
    return np.flatnonzero((y < top) & (y > top - BENCH) & (x > 15.0 + BENCH * stage))


def ground(mesh: Mesh) -> Blocks:
    """Rollers on both sides and the floor, weight."""
    sim = model(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > WIDTH - 1e-9)), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.gravity(0.0, -G)
    sim.option(dynamic=False, collision=False)
    return sim


def moved(sim: Blocks) -> np.ndarray:
    """(np, 2) displacements, NaN where nothing is left."""
    return np.column_stack([diagnostics.values(sim, f"displacement_{axis}") for axis in "xy"])


def test_staged_excavation_of_quads_by_relaxation_and_at_once():
    """Displacements since the gravity stage after every bench, to 1 % of the largest; no element outside of the benches
    is lost, every stage of relaxation ends at a ratio of 1e-5, and the floor carries what is left."""
    mesh = box("quad", 1.25)
    at_once, slowly = ground(mesh), ground(mesh)
    equilibrium.solve_elastic(at_once)
    convergence.solve(slowly, ratio=1e-6, cycles=50000)
    floor = np.flatnonzero(mesh.points[:, 1] < 1e-9)
    left, farthest = mesh.areas().sum(), 0.0
    for sim in (at_once, slowly):
        changes.reset_displacement(sim)
    for stage in range(STAGES):
        out = bench(mesh, stage)
        changes.null(at_once, out)
        changes.null(slowly, out, relax=200)
        equilibrium.solve_elastic(at_once)
        convergence.advance(slowly, 200)
        found = convergence.solve(slowly, ratio=1e-5, cycles=50000)
        assert found.reason == "ratio" and found.ratio < 1e-5
        a, b = moved(at_once), moved(slowly)
        assert np.array_equal(np.isnan(a), np.isnan(b))
        largest = np.nanmax(np.abs(a))
        assert largest > farthest  # it heaves more with every stage
        farthest = largest
        assert np.nanmax(np.abs(a - b)) < 0.01 * largest
        left -= mesh.areas()[out].sum()
        assert int(at_once.alive.sum()) == len(mesh.cells) - sum(len(bench(mesh, k)) for k in range(stage + 1))
        assert diagnostics.total(at_once, "reaction_y", floor) == pytest.approx(RHO * G * left, rel=1e-8)


def test_staged_excavation_of_triangles_against_another_program():
    """Small strains: displacements by the last stage to 1e-7 of those of plain_fe."""
    mesh = box("cross", 1.25)
    sim = ground(mesh)
    sim.option(large_strain=False)
    held = np.zeros((len(mesh.points), 2), bool)
    x, y = mesh.points.T
    held[(x < 1e-9) | (x > WIDTH - 1e-9), 0] = held[y < 1e-9, 1] = True
    triangles = mesh.cells[:, :3]
    before = plain_fe.displacement(mesh.points, triangles, YOUNG, NU, RHO, G, held)
    equilibrium.solve_elastic(sim)
    assert moved(sim) == pytest.approx(before, abs=1e-8 * np.abs(before).max())
    changes.reset_displacement(sim)
    there = np.ones(len(triangles), bool)
    for stage in range(STAGES):
        there[bench(mesh, stage)] = False
        changes.null(sim, bench(mesh, stage), relax=100)
        equilibrium.solve_elastic(sim)
        after = plain_fe.displacement(mesh.points, triangles[there], YOUNG, NU, RHO, G, held) - before
        found = moved(sim)
        known = ~np.isnan(found[:, 0])
        assert known.sum() == len(np.unique(triangles[there]))
        assert found[known] == pytest.approx(after[known], abs=1e-7 * np.abs(after[known]).max())


def test_staged_excavation_of_quads_that_yield():
    """Mohr and Coulomb: what has yielded grows with every bench, and so does what this adds to the displacement of
    elastic rock; every stage ends at a ratio of 1e-5, and nothing is lost but the benches."""
    mesh = box("quad", 2.5)
    yielding, elastic = ground(mesh), ground(mesh)
    rock = {"density": RHO, "young": YOUNG, "poisson_ratio": NU, "friction": 20.0, "cohesion": 25e3, "tensile": 10e3}
    changes.element_model(yielding, None, "mech_mohr_coulomb", rock)
    convergence.solve(yielding, ratio=1e-6, cycles=50000)
    equilibrium.solve_elastic(elastic)
    for sim in (yielding, elastic):
        changes.reset_displacement(sim)
    assert not diagnostics.values(yielding, "plastic_state").any()
    out, flowed, farther = np.zeros(len(mesh.cells), bool), [0], [0.0]
    for stage in range(STAGES):
        out[bench(mesh, stage)] = True
        for sim in (yielding, elastic):
            changes.null(sim, bench(mesh, stage), relax=200)
        equilibrium.solve_elastic(elastic)
        convergence.advance(yielding, 200)
        assert convergence.solve(yielding, ratio=1e-5, cycles=50000).ratio < 1e-5
        assert np.array_equal(yielding.alive, ~out)
        flowed.append(int((diagnostics.values(yielding, "plastic_state") > 0).sum()))
        farther.append(float(np.nanmax(np.abs(moved(yielding) - moved(elastic)))))
    assert (np.diff(flowed) > 0).all() and (np.diff(farther) > 0.0).all()
    assert farther[-1] > 0.1 * np.nanmax(np.abs(moved(elastic)))
