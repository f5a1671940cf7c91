"""The energy budget where bodies break: it closes, and nothing gives more than it was given.

Kinetic and elastic energy are functions of the state, work is added up over the steps: so the sum can fail.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import scipy

from hpcdem.physics.fdem import changes, convergence, creep, diagnostics
from hpcdem.physics.fdem.kernels import elements, energy, energy_space
from hpcdem.physics.fdem.kernels.joint_law import SOFTENING_AREA, softening
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks import models
from tests.blocks.support import EVERY_KIND, ROCK, jointed, model, rectangle, shaken

E = ROCK["young"]


def watched(sim: Blocks, until: float, act: Callable[[Blocks], None] = lambda sim: None) -> dict[str, float]:
    """Run to this time; at every look the budget closes to 1 %. Returns the last reading."""
    found: dict[str, float] = {}
    while sim.clock.time < until:
        for _ in range(200):
            act(sim)
            sim.step()
        found = diagnostics.energies(sim)
        assert found["relative"] < 0.01, found
        given = found["work_gravity"] + found["work_outside"] + found["commands"]
        size = max(abs(given), found["kinetic"], found["joints_lost"])
        # What contact gives back is what joints that broke closed had handed to it, or what was pressed into it.
        assert found["joints_lost"] + found["contact"] > -0.01 * size, found
        assert found["viscous_lost"] >= 0.0
    return found


def test_a_plate_pulled_apart():
    """The joints lose no less than G_f1 per length of the crack, no more than their damage says."""
    sim = model(rectangle(4, 8, 0.04, 0.08))
    sim.element_property(None, {"damp_factor": 0.2})
    jointed(sim, gf1=5.0, gf2=50.0, tensile_strength=2e6)
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.table("grip", [(0.0, 0.0), (5e-5, 0.05)])
    sim.velocity_condition(np.flatnonzero(y > 0.08 - 1e-9), vy="grip")
    diagnostics.account_energy(sim)
    found = watched(sim, 8e-4)
    events = diagnostics.events(sim)
    assert len(events["joint"]) >= 4 and (events["mode"] < 1.3).mean() > 0.7
    # Broken joints have lost G_f1 per length, damaged ones the part of it that lies under f up to their damage.
    damage, length = diagnostics.values(sim, "damage"), diagnostics.values(sim, "length")
    part = np.array([scipy.integrate.quad(softening, 0.0, d)[0] for d in damage]) / SOFTENING_AREA
    assert 0.97 * 5.0 * events["length"].sum() < found["joints_lost"] < 1.05 * 5.0 * (part * length).sum()


@pytest.mark.parametrize(
    "shape, friction, penalty",
    [
        ("cross", 0.0, 0.0),
        ("mixed", 20.0, 0.0),
        ("cross", 20.0, 10.0),
        *(pytest.param(kind, 20.0, 0.0, marks=pytest.mark.slow) for kind in ("cross", "quad")),
    ],
)
def test_a_block_that_falls_apart(shape, friction, penalty):
    """Compressed joints break and their faces go on by contact, also at the tips of cracks that have not met: no energy
    comes out of that, even if contact has a penalty (over E) that would make it six times stiffer than the joints were.
    The block never gets faster than it came."""
    sim = Blocks()
    models.impact(sim, shape)
    if penalty:
        sim.face_model(None, "contact_mohr_coulomb", {"friction": friction, "penalty_normal": penalty * E})
    sim.joint_property(None, {"friction": friction})
    sim.gravity(0.0, 0.0)
    diagnostics.account_energy(sim)
    start = 0.5 * ROCK["density"] * 0.96 * (0.5**2 + 2.0**2)
    found = watched(sim, 1.6e-3)
    assert diagnostics.joint_counts(sim)[2] > 30
    total = found["kinetic"] + found["strain"] + found["joints"]
    assert total < start
    assert total + found["viscous_lost"] + found["joints_lost"] + found["contact"] == pytest.approx(start, rel=1e-3)


def test_a_specimen_crushed():
    """Two platens that move together; friction and shear failure."""
    sim = model(shaken(rectangle(6, 12, 0.03, 0.06), 0.2))
    sim.element_property(None, {"damp_factor": 0.3, "friction": 20.0})
    jointed(sim, gf1=3.0, gf2=15.0, tensile_strength=2e6, cohesion=6e6)
    y = sim.mesh.points[:, 1]
    for speed, name, nodes in ((1.0, "up", y < 1e-9), (-1.0, "down", y > 0.06 - 1e-9)):
        sim.table(name, [(0.0, 0.0), (2e-5, speed)])
        sim.velocity_condition(np.flatnonzero(nodes), vy=name)
    diagnostics.account_energy(sim)
    found = watched(sim, 4e-4)
    _, yielded, broken = diagnostics.joint_counts(sim)
    assert broken > 15 and yielded > 15
    assert (diagnostics.events(sim)["mode"] > 1.5).any()
    assert found["work_outside"] > 20.0 and found["joints_lost"] > 0.0


def test_a_beam_bent():
    """Three points: one crack from below, opened; work of the middle one is stored or lost."""
    sim = model(rectangle(24, 6, 0.24, 0.06))
    sim.element_property(None, {"damp_factor": 0.3})
    jointed(sim, gf1=10.0, gf2=100.0, tensile_strength=2e6, cohesion=20e6)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero((y < 1e-9) & ((np.abs(x - 0.02) < 1e-9) | (np.abs(x - 0.22) < 1e-9))), vy=0.0)
    sim.table("load", [(0.0, 0.0), (1e-4, -0.1)])
    sim.velocity_condition(np.flatnonzero((y > 0.06 - 1e-9) & (np.abs(x - 0.12) < 1e-9)), vx=0.0, vy="load")
    diagnostics.account_energy(sim)
    watched(sim, 6e-4)
    events = diagnostics.events(sim)
    assert len(events["joint"]) >= 4 and (events["mode"] < 1.5).mean() > 0.6
    assert np.abs(events["x"] - 0.12).min() < 0.03


def test_a_hole_blasted():
    """After a static stage: pressure that follows a table, mass scaling, an automatic time step, other properties on
    the way; commands change what is stored, and are told apart."""
    sim = Blocks()
    models.opening(sim)
    while sim.clock.step < 751:
        models.open_up(sim)
        sim.step()
    found = watched(sim, 2e-3, models.open_up)
    assert diagnostics.joint_counts(sim)[2] > 20 and found["commands"] != 0.0
    assert found["work_outside"] > 1000.0


def test_the_account_does_not_change_the_run():
    """With and without a budget, mass scaling included: the same bits."""
    ends = []
    for keep in (True, False):
        sim = Blocks()
        models.opening(sim)
        while sim.clock.step < 1300:
            models.open_up(sim)
            if not keep and sim.clock.step == 750:
                diagnostics.account_energy(sim, False)
            sim.step()
        ends.append(
            np.concatenate(
                [
                    diagnostics.values(sim, "position_x"),
                    diagnostics.values(sim, "velocity_y"),
                    diagnostics.values(sim, "damage"),
                ]
            )
        )
    assert np.array_equal(ends[0], ends[1], equal_nan=True)
    assert math.isfinite(float(np.nansum(ends[0])))


@pytest.mark.some_of_each
@pytest.mark.parametrize("damping", ["viscous", "rayleigh", "creep"])
@EVERY_KIND
def test_small_strains_close_to_rounding(kind, damping):
    """Their forces are those of an energy, on the shape of the mesh: of a soft cantilever that swings far, all that
    damping does not take is there."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(6, 3, 1.0, 0.5, kind=kind), 0.2))
    soft = {"density": 2500.0, "damp_factor": 0.3 * (damping == "viscous")}
    if damping == "creep":
        units = {"maxwell_viscosity": 4e5, "kelvin_shear": 4e6, "kelvin_viscosity": 2e5}
        changes.element_model(sim, None, "mech_burgers", {**soft, **units, "bulk": 6.7e6, "maxwell_shear": 4e6})
        creep.switch(sim, True)
    else:
        changes.element_model(sim, None, "mech_iso_elastic", {**soft, "young": 1e7, "poisson_ratio": 0.25})
    sim.option(large_strain=False, collision=False)
    if damping == "rayleigh":
        sim.rayleigh(0.1, 30.0)
    diagnostics.account_energy(sim)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0, vy=0.0)
    sim.time_step(value=5e-5)
    changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 0.99), 0.0, 8.0)
    given = diagnostics.energies(sim)["kinetic"]
    convergence.advance(sim, 600)
    found = diagnostics.energies(sim)
    assert np.abs(diagnostics.values(sim, "displacement_y")).max() > 0.02
    assert found["viscous_lost"] + found["creep_lost"] > 0.1 * given
    assert found["relative"] < 1e-12, found


def test_what_is_removed_while_storage_waits_to_be_sorted():
    """Elements are removed right after a step that scheduled a rebuild: their energy is booked under commands, as it is
    one step earlier, and the account changes no bit."""

    def run(opened: bool, account: bool = True) -> tuple[float, np.ndarray]:
        sim = jointed(model(rectangle(6, 6, 0.06, 0.06)), gf1=50.0, gf2=500.0, tensile_strength=2e8)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=60.0)
        if account:
            diagnostics.account_energy(sim)
        while sim.clock.step < 300 or sim.closed == opened:
            sim.step()
        assert sim.clock.step <= 310
        changes.null(sim, np.flatnonzero((np.abs(sim.mesh.centroids() - 0.03) < 0.012).all(axis=1)))
        for _ in range(100):
            sim.step()
        if not account:
            return 0.0, sim.v
        found = diagnostics.energies(sim)
        assert found["relative"] < 1e-3
        return found["commands"], sim.v

    waiting, v = run(True)
    assert waiting == pytest.approx(run(False)[0], rel=1e-3) and waiting < -3000.0
    np.testing.assert_array_equal(v, run(True, account=False)[1])


@pytest.mark.parametrize("dim", [2, 3])
def test_work_and_kinetic_energy_are_sums_over_corners(dim: int):
    """Two owned elements between ghosts, a triangle and a quad or two tetrahedra; forces by the mean velocity."""
    rng = np.random.default_rng(dim)
    first, n_own, a, b, dt = 1, 2, 0.25, 0.75, 0.1
    before, after, of_joints, pushed = rng.normal(size=(4, 4, 4, dim if dim == 2 else 4))
    mass, felt, outside = rng.uniform(1.0, 2.0, (4, 4)), rng.normal(size=(3, 2 * dim)), rng.normal(size=(3, dim))
    v = (a * before + b * after)[..., :dim]
    flat = [values.reshape(4, -1) for values in (before, after, of_joints, pushed)]
    work, moving = np.zeros((n_own, 8)), np.zeros(n_own)
    rows = np.array([2, 1])  # whom somebody pushes
    begin = np.array([0, 2, 3, 4])
    lowest = np.array([[1, 2], [0, 0], [2, 0], [2, 3]])  # (row, corner) of nodes; the first of each counts
    place = lowest @ np.array([4, 1]) * (before.shape[2])
    if dim == 2:
        count = np.array([3, 4])
        cells = np.array([[0, 1, 2, 3], [0, 1, 2, -1], [3, 4, 5, 6], [0, 1, 2, 3]])
        energy.book_contact(rows, first, count[::-1], flat[3][:2], *flat[:2], a, b, dt, work)
        energy.book_nodes(begin, place, felt, outside, *flat[:2], a, b, dt, first, n_own, 8, work)
        energy.kinetic(first, n_own, cells, np.arange(4), *flat[:2], mass, moving)
    else:
        count = np.array([4, 4])
        gravity = np.array([1.0, -2.0, 3.0])
        energy_space.book(first, n_own, *flat[:2], a, b, flat[2], flat[3], mass, *gravity, dt, work)
        for column, forces in ((energy.BY_JOINTS, of_joints), (energy.VISCOUS, pushed)):
            assert work[:, column] == pytest.approx((forces[..., :3] * v)[1:3].sum(axis=(1, 2)) * dt, rel=1e-12)
        weight = np.einsum("ek,m,ekm->e", mass, gravity, v)[1:3] * dt
        assert work[:, energy.GRAVITY] == pytest.approx(weight, rel=1e-12)
        energy_space.book_contact(rows, first, flat[3][:2], *flat[:2], a, b, dt, work)
        energy_space.book_nodes(begin, place, felt, outside, *flat[:2], a, b, dt, first, n_own, work)
        energy_space.kinetic(first, n_own, *flat[:2], mass, moving)
    for row, force in zip(rows, pushed):
        done = (force[..., :dim] * v[row])[: count[row - first]].sum() * dt
        assert work[row - first, energy.BY_CONTACT] == pytest.approx(done, rel=1e-12)
        both = (mass[row, :, None] * (before * after)[row, :, :dim])[: count[row - first]].sum()
        assert moving[row - first] == pytest.approx(0.5 * both, rel=1e-12)
    done = [((felt[i, dim:] + outside[i]) @ v[tuple(lowest[begin[i]])]) * dt for i in range(3)]
    assert work[:, energy.OUTSIDE] == pytest.approx([done[0], done[1] + done[2]], rel=1e-12)


def test_the_viscous_stress_of_a_triangle_works_as_its_power_says():
    """Forces . velocities = - area times stress : rate, whatever the triangle and its rotation; none while it turns."""
    xy = np.array([0.1, 0.2, 1.3, 0.4, 0.5, 1.1])
    m = np.array([xy[2:4] - xy[:2], xy[4:] - xy[:2]]).T
    area = 0.5 * np.linalg.det(m)
    c = np.zeros(16)
    c[:4] = np.linalg.inv(m).reshape(-1)
    out, beta = np.zeros(6), 0.5
    c[[elements.LAMBDA, elements.TWO_MU, elements.ETA]] = 3.0, 5.0, 7.0
    for gradient in (
        [[1.0, 0.0], [0.0, 0.0]],
        [[0.0, 0.0], [0.0, 1.0]],
        [[0.3, 1.0], [0.5, -0.7]],
        [[0.0, 1.0], [-1.0, 0.0]],
    ):
        rate = 0.5 * (np.array(gradient) + np.array(gradient).T)
        velocity = (np.array(gradient) @ xy.reshape(3, 2).T).T.reshape(-1)
        energy._viscous_triangle(xy, velocity, c, False, beta, out)
        stress = (7.0 + beta * 5.0) * rate + beta * 3.0 * np.trace(rate) * np.eye(2)
        assert out @ velocity == pytest.approx(-area * (stress * rate).sum(), rel=1e-12, abs=1e-14)
        assert out.reshape(3, 2).sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-14)
