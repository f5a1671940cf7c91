"""Elements that were taken out come back in space: backfill, free of stress where the void is now."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import backfill, changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import ROCK, body, box, hexes

FILL = {"density": 1900.0, "young": 7e9, "poisson_ratio": 0.0}
KINDS = pytest.mark.parametrize("made", [box, hexes], ids=["tetrahedra", "hexahedra"])


def block(made, dynamic: bool = False) -> tuple[Blocks, np.ndarray]:
    """4 m x 4 m x 4 m without lateral strain, and the elements of the 2 m in its middle, with one node inside."""
    sim = body(made((4, 4, 4), (4.0, 4.0, 4.0)), dynamic, density=2500.0, young=40e9, poisson_ratio=0.0)
    cell = np.arange(len(sim.mesh.cells)) // 6
    inner = [(c > 0) & (c < 3) for c in (cell % 4, cell // 4 % 4, cell // 16)]
    return sim, np.flatnonzero(inner[0] & inner[1] & inner[2])


MIDDLE = 2 + 5 * 2 + 25 * 2


def strained(sim: Blocks, by: float) -> None:
    """All nodes but the one in the middle go down by so much of their height in the mesh; that one finds its place."""
    z = sim.mesh.points[:, 2]
    for height in np.unique(z):
        at = np.flatnonzero(sim.node_exists() & (np.abs(z - height) < 1e-9))
        sim.velocity_condition(at[at != MIDDLE], vx=0.0, vy=0.0, vz=-by * height / 100.0)
    convergence.advance(sim, 100)
    at = np.flatnonzero(sim.node_exists())
    sim.velocity_condition(at[at != MIDDLE], vz=0.0)
    convergence.solve(sim, ratio=1e-10, cycles=20000)


@KINDS
def test_fill_takes_what_comes_after_it_and_nothing_of_what_was_before(made, tmp_path):
    """A patch test: E (first + second) where rock stayed, E_f second / (1 - first) in the fill, whose height it is, as
    in the plane (tests/blocks/test_backfill.py); and the same from a file."""
    first, second = 0.15, 0.045
    sim, hole = block(made)
    assert len(hole) == 48
    changes.null(sim, hole)
    strained(sim, first)
    stay = np.flatnonzero(sim.alive)
    before = diagnostics.values(sim, "stress_zz", stay)
    assert before == pytest.approx(-40e9 * first, rel=1e-9)
    changes.element_model(sim, hole, "mech_iso_elastic", FILL)
    assert sim.alive.all() and np.array_equal(diagnostics.values(sim, "stress_zz", stay), before)
    for c in ("xx", "yy", "zz", "xy", "xz", "yz"):
        assert np.abs(diagnostics.values(sim, f"stress_{c}", hole)).max() < 1e-3  # rounding of positions times E
    # The node in the middle of the void lies as if it had been strained with the rest; so does what is shown of it.
    assert diagnostics.values(sim, "position_z", [MIDDLE]) == pytest.approx(2.0 * (1 - first), rel=1e-12)
    assert diagnostics.values(sim, "displacement_z", [MIDDLE]) == pytest.approx(-2.0 * first, rel=1e-9)
    assert diagnostics.values(sim, "volume", hole).sum() == pytest.approx(8.0 * (1 - first), rel=1e-12)
    assert sim.local.true_mass.sum() == pytest.approx(2500.0 * 56.0 + 1900.0 * 8.0 * (1 - first), rel=1e-12)
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        strained(one, second)
    assert np.array_equal(sim.x, again.x)
    assert diagnostics.values(sim, "stress_zz", stay) == pytest.approx(-40e9 * (first + second), rel=1e-9)
    assert diagnostics.values(sim, "stress_zz", hole) == pytest.approx(-7e9 * second / (1 - first), rel=1e-6)


@KINDS
def test_what_it_hangs_on_keeps_its_momentum(made):
    """In motion: the two sides of a slot part; what comes back between has the velocity of what it hangs on, and the
    step after it is whole."""
    sim = body(made((3, 1, 1), (3.0, 1.0, 1.0)))
    mesh = sim.mesh
    middle = np.arange(6, 12)
    changes.null(sim, middle)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] < 1.5), 1.0, -0.5, 0.25)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] > 1.5), 3.0, 0.5, 0.25)
    convergence.advance(sim, 5)
    kept = diagnostics.values(sim, "velocity_x").copy()
    changes.element_model(sim, middle, "mech_iso_elastic", ROCK)
    assert diagnostics.values(sim, "velocity_x") == pytest.approx(kept, rel=1e-12)
    assert diagnostics.values(sim, "velocity_z") == pytest.approx(0.25)
    mass = sim.corner_masses(np.arange(len(mesh.cells))).reshape(-1)
    v = diagnostics.corner_values(sim, "velocity")
    momentum = (mass[:, None] * v).sum(axis=0)
    convergence.advance(sim, 50)
    later = (mass[:, None] * diagnostics.corner_values(sim, "velocity")).sum(axis=0)
    assert later == pytest.approx(momentum, rel=1e-9, abs=1e-6)


def test_what_lies_in_the_place_is_named():
    """A tetrahedron that has fallen into the void."""
    rock, stone = box((3, 3, 3), (3.0, 3.0, 3.0)), box((1, 1, 1), (0.5, 0.5, 0.5), 5)
    mesh = Mesh.of(
        np.concatenate([rock.points, stone.points + [1.2, 1.2, 1.2]]),
        np.concatenate([rock.cells, stone.cells + len(rock.points)]),
    )
    sim = Blocks()
    sim.take_mesh(mesh)
    sim.option(overlap="keep", collision=False)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    hole = np.flatnonzero(np.arange(len(mesh.cells)) // 6 == 13)
    changes.null(sim, hole)
    with pytest.raises(CommandError, match=r"cannot be reinstated: element 16\d intrudes by 0\.\d+ m"):
        changes.element_model(sim, hole, "mech_iso_elastic", ROCK)
    assert not sim.alive[hole].any()


def test_a_part_of_a_hexahedron_does_not_come_back_alone():
    sim, hole = block(hexes)
    changes.null(sim, hole)
    with pytest.raises(CommandError, match="are one hexahedron, of which only 3 were given"):
        changes.element_model(sim, hole[:3], "mech_iso_elastic", FILL)


def test_depth_of_tetrahedra():
    """Two corners that look at each other, two edges that cross, and those that are apart."""
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    other = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    for far, expected in ((-0.2, -0.2), (0.3, 0.3)):
        assert backfill.depth(corner, other + [far, 0, 0]) == pytest.approx(expected, abs=1e-12)
    ridge = np.array([[-1.0, 0, 0], [1, 0, 0], [0, -0.1, -1], [0, 0.1, -1]])
    roof = np.array([[0.0, -1, -0.05], [0, 1, -0.05], [-0.1, 0, 1], [0.1, 0, 1]])
    for shape in (ridge, roof):
        if np.linalg.det(shape[1:] - shape[0]) < 0.0:
            shape[[2, 3]] = shape[[3, 2]]
    assert backfill.depth(ridge, roof) == pytest.approx(0.05, rel=1e-9)
    assert backfill.depth(roof + [0, 0, 0.1], ridge) == pytest.approx(-0.05, rel=1e-9)
    places = np.random.default_rng(3).uniform(-1, 1, (40, 4, 3))
    for one, two in itertools.pairwise(places):
        for shape in (one, two):
            if np.linalg.det(shape[1:] - shape[0]) < 0.0:
                shape[[2, 3]] = shape[[3, 2]]
        assert backfill.depth(one, two) == pytest.approx(backfill.depth(two, one), rel=1e-9)
