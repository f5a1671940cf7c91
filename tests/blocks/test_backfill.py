"""Elements that were taken out come back: backfill and support, free of stress where the void is now."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.pre.mesh.quadratic import quadratic
from tests.blocks.support import ROCK, jointed, model, rectangle

FILL = {"density": 1900.0, "young": 7e9, "poisson_ratio": 0.0}
ELASTIC, COHESIVE = "mech_iso_elastic", "classic_intrinsic_cohesive_interface"
STIFF = {"density": 2500.0, "young": 40e9, "poisson_ratio": 0.0}


def plate(large: bool = True, kind: str = "quad") -> tuple[Blocks, np.ndarray]:
    """4 m x 4 m without lateral strain, and the elements of the 2 m x 2 m in its middle."""
    mesh = quadratic(rectangle(4, 4, 4.0, 4.0)).mesh if kind == "six" else rectangle(4, 4, 4.0, 4.0, kind=kind)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, ELASTIC, STIFF)
    sim.option(dynamic=False, large_strain=large, collision=False)
    return sim, np.flatnonzero((np.abs(mesh.centroids() - 2.0) < 1.0).all(axis=1))


def strained(sim: Blocks, by: float) -> None:
    """All nodes but those in the hole go down by so much of their height in the mesh; these find their place."""
    y = sim.mesh.points[:, 1]
    held = sim.node_exists() & (np.abs(sim.mesh.points - 2.0) > 0.99).any(axis=1)
    for node in np.flatnonzero(held):
        sim.velocity_condition([node], vx=0.0, vy=-by * y[node] / 100.0)
    convergence.advance(sim, 100)
    sim.velocity_condition(np.flatnonzero(held), vy=0.0)
    convergence.solve(sim, ratio=1e-10, cycles=20000)


CASES = [("quad", True, 0.15), ("cross", True, 0.15), ("mixed", False, 0.002), ("six", True, 0.15)]


@pytest.mark.parametrize(("kind", "large", "first"), CASES)
def test_fill_takes_what_comes_after_it_and_nothing_of_what_was_before(kind, large, first):
    """A patch test: E (first + second) where rock stayed, E_f second / (1 - first) in the fill, whose height it is."""
    sim, hole = plate(large, kind)
    changes.null(sim, hole)
    strained(sim, first)
    stay = np.flatnonzero(sim.alive)
    before = diagnostics.values(sim, "stress_yy", stay)
    assert before == pytest.approx(-40e9 * first, rel=1e-9)
    changes.element_model(sim, hole, ELASTIC, FILL)
    assert sim.alive.all() and np.array_equal(diagnostics.values(sim, "stress_yy", stay), before)
    for c in ("xx", "yy", "xy"):
        assert np.abs(diagnostics.values(sim, f"stress_{c}", hole)).max() < 1e-4  # rounding of positions times E
    # The node in the middle of the void lies as if it had been strained with the rest; so does what is shown of it.
    assert diagnostics.values(sim, "position_y", [12]) == pytest.approx(2.0 * (1 - first), rel=1e-12)
    assert diagnostics.values(sim, "displacement_y", [12]) == pytest.approx(-2.0 * first, rel=1e-9)
    assert diagnostics.values(sim, "area", hole).sum() == pytest.approx(4.0 * (1 - first), rel=1e-12)
    assert sim.local.true_mass.sum() == pytest.approx(2500.0 * 12.0 + 1900.0 * 4.0 * (1 - first), rel=1e-12)
    second = 0.3 * first
    strained(sim, second)
    assert diagnostics.values(sim, "stress_yy", stay) == pytest.approx(-40e9 * (first + second), rel=1e-9)
    grown = second / (1 - first)
    assert diagnostics.values(sim, "stress_yy", hole) == pytest.approx(-7e9 * grown, rel=1e-6)
    sim.element_property(hole, {"young": 14e9})  # of what it has been strained since, not before
    assert diagnostics.values(sim, "stress_yy", hole) == pytest.approx(-14e9 * grown, rel=1e-6)


def opening() -> tuple[Blocks, np.ndarray]:
    """A jointed block under stress with a hole of 2 x 2 squares, at rest."""
    mesh = rectangle(6, 6, 6.0, 6.0)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, ELASTIC, ROCK)
    jointed(sim)
    sim.option(dynamic=False)
    x, y = mesh.points.T
    rim = (np.minimum(x, y) < 1e-9) | (np.maximum(x, y) > 6.0 - 1e-9)
    sim.initial_stress(None, xx=-4e6, yy=-2e6)
    sim.move_constraint(np.flatnonzero(rim), 1)
    hole = np.flatnonzero((np.abs(mesh.centroids() - 3.0) < 1.0).all(axis=1))
    changes.null(sim, hole)
    convergence.solve(sim, ratio=1e-9, cycles=60000)
    return sim, hole


def test_in_jointed_rock_it_fits_in_without_a_push():
    """No joint, no contact and no element has a force by it: the balance stays what it was."""
    sim, hole = opening()
    stay = np.flatnonzero(sim.alive)
    ratio, stress = diagnostics.unbalanced_ratio(sim), diagnostics.values(sim, "stress_xx", stay)
    assert ratio < 1e-8 and np.abs(diagnostics.values(sim, "displacement_x")[sim.node_exists()]).max() > 1e-5
    changes.element_model(sim, hole, ELASTIC, ROCK)
    assert np.array_equal(diagnostics.values(sim, "stress_xx", stay), stress)
    assert np.abs(diagnostics.values(sim, "stress_xx", hole)).max() < 1e-3
    assert diagnostics.unbalanced_ratio(sim) < 1e-8
    joints = np.flatnonzero(sim.joint_exists())
    touching = np.isin(joints // 4, hole) | np.isin(sim.partner[joints] // 4, hole)
    assert touching.sum() > 8 and (sim.joint_row[joints[touching]] == 0).all() and not sim.open[joints].any()
    # and can have joints of its own, which feel nothing yet
    inside = joints[np.isin(joints // 4, hole) & np.isin(sim.partner[joints] // 4, hole)]
    row = sim.joint_rows.values(int(sim.joint_row.max()))
    sim.joint_model(inside, COHESIVE, row)
    assert np.abs(diagnostics.values(sim, "normal_stress", inside)).max() < 10.0
    assert diagnostics.joint_counts(sim)[0] > len(inside)


def test_cracks_of_the_mesh_stay_cracks():
    mesh = rectangle(4, 4, 4.0, 4.0)
    ends = mesh.points[mesh.edges().points]
    on = mesh.edges().inner & (np.abs(ends[:, :, 0] - 2.0) < 1e-9).all(axis=1)
    from hpcdem.physics.fdem.mesh import Mesh

    sim = model(Mesh.of(mesh.points, mesh.cells, cracks=mesh.edges().points[on]))
    cracks = mesh.edges().faces[on, 0]
    right = np.flatnonzero(mesh.centroids()[:, 0] > 2.0)
    changes.null(sim, right)
    changes.element_model(sim, right, ELASTIC, ROCK)
    assert sim.open[cracks].all() and sim.open.sum() == 2 * len(cracks)
    convergence.advance(sim, 20)
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() < 1.0


def test_what_it_hangs_on_keeps_its_momentum():
    """In motion: the two sides of a slot part; a wedge that comes back moves with them, momentum is kept."""
    mesh = rectangle(5, 2, 5.0, 2.0)
    sim = model(mesh)
    middle = np.flatnonzero(np.abs(mesh.centroids()[:, 0] - 2.5) < 0.5)
    changes.null(sim, middle)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] < 2.5), vx=1.0, vy=-0.5)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] > 2.5), vx=3.0, vy=0.5)
    convergence.advance(sim, 5)
    stay = np.flatnonzero(sim.alive)
    kept = diagnostics.values(sim, "velocity_x")[:6].copy()
    changes.element_model(sim, middle, ELASTIC, ROCK)
    assert diagnostics.values(sim, "velocity_x")[:6] == pytest.approx(kept) and len(stay) + len(middle) == len(
        mesh.cells
    )
    inside = diagnostics.values(sim, "element_velocity_x", middle)
    assert (inside > 1.0).all() and (inside < 3.0).all()
    convergence.advance(sim, 50)
    assert np.isfinite(diagnostics.values(sim, "velocity_x")).all()


def test_the_energy_account_closes_over_it():
    sim, right = plate(kind="cross")
    sim.option(dynamic=True)
    sim.velocity_condition(np.arange(5), vy=0.0)
    sim.gravity(0.0, -9.81)
    diagnostics.account_energy(sim)
    convergence.advance(sim, 200)
    changes.null(sim, right)
    convergence.advance(sim, 100)
    changes.element_model(sim, right, ELASTIC, FILL)
    convergence.advance(sim, 200)
    found = diagnostics.energies(sim)
    assert found["commands"] != 0.0 and found["relative"] < 1e-6


def test_what_lies_in_the_place_is_named():
    """A block that has fallen into the void."""
    from tests.blocks.support import joined

    sim = model(joined(rectangle(3, 3, 3.0, 3.0), rectangle(1, 1, 0.9, 0.9, x0=1.05, y0=3.2)))
    hole = np.flatnonzero((np.abs(sim.mesh.centroids() - 1.5) < 0.5).all(axis=1))
    top = np.flatnonzero((np.abs(sim.mesh.centroids() - [1.5, 2.5]) < 0.5).all(axis=1))
    fallen = np.arange(len(rectangle(3, 3, 3.0, 3.0).points), len(sim.mesh.points))
    changes.null(sim, np.concatenate([hole, top]))
    sim.option(collision=False)
    changes.set_velocity(sim, fallen, vy=-10.0)
    while diagnostics.values(sim, "position_y", fallen).min() > 1.05:
        convergence.advance(sim, 10)
    changes.element_model(sim, top, ELASTIC, ROCK)  # above of it
    with pytest.raises(CommandError, match=r"cannot be reinstated: element \d+ intrudes by 0\.\d+ m"):
        changes.element_model(sim, hole, ELASTIC, ROCK)
    assert not sim.alive[hole].any() and sim.alive[top].all()


def test_a_place_that_has_closed_is_refused():
    sim, right = plate()
    changes.null(sim, right)
    sim.close_model()
    sim.open_model()
    sim.x[:, 1::2] *= -1.0  # as no run would leave it
    with pytest.raises(CommandError, match="its void has closed"):
        changes.element_model(sim, right, ELASTIC, FILL)


def test_without_a_range_they_stay_away():
    sim, right = plate()
    changes.null(sim, right)
    changes.element_model(sim, None, ELASTIC, STIFF)
    assert not sim.alive[right].any()
