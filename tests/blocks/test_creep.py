"""Elements that creep after Burgers: closed forms of creep, relaxation and recovery, its limits, energy, refusals.

The creep compliance of the deviator is J(t) = 1 / G_M + t / eta_M + (1 - exp(-G_K t / eta_K)) / G_K (e = J S / 2), in
the Laplace domain s J(s) = N(s) / D(s) with the polynomials of `transform`.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.kernels import creep as kernels
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, JOINT, joined, near, rectangle, shaken

BURGERS = "mech_burgers"
SALT = {
    "density": 2500.0, "bulk": 20e9, "maxwell_shear": 10e9, "maxwell_viscosity": 1e16, "kelvin_shear": 5e9,
    "kelvin_viscosity": 1e14,
}  # fmt: skip
ROCK = {
    "density": 2200.0, "bulk": 12e9, "maxwell_shear": 7e9, "maxwell_viscosity": 3e15, "kelvin_shear": 11e9,
    "kelvin_viscosity": 2e14,
}  # fmt: skip
MAXWELL = {**SALT, "kelvin_shear": 0.0}
STRESSES = ("stress_xx", "stress_yy", "stress_xy", "stress_zz")
LOAD = 5e6


def body(kind: str = "cross", **other: float) -> Blocks:
    """A unit square of triangles, quads, or both, that creeps, at rest, without conditions."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
    changes.element_model(sim, None, BURGERS, {**SALT, **other})
    sim.option(dynamic=False, collision=False)
    return sim


def loaded(xx: float, yy: float, kind: str = "cross", **other: float) -> Blocks:
    """The square on rollers on the left and below, with these stresses on the right and on top, in balance."""
    sim = body(kind, **other)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.stress_condition(near(sim.mesh, 0, 1.0), xx=xx)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=yy)
    equilibrium.solve_elastic(sim)
    return sim


def crept(sim: Blocks, time: float, steps: int) -> None:
    """So much creep time, in equal creep steps, each at once."""
    end = sim.creep.time + time
    creep.switch(sim, True, dt=time / steps)
    for _ in range(steps):
        creep.begin(sim, end)
        equilibrium.solve_elastic(sim)
        creep.finish(sim, end)
    assert sim.creep.time == end


def held(sim: Blocks, where: np.ndarray) -> None:
    """All nodes go to these places (n, 2), or to those in the mesh times a deformation gradient (2, 2), and stay."""
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.open_model()
    x, cells = np.asarray(where), sim.mesh.cells[sim.number]
    x = sim.mesh.points @ x.T if x.shape == (2, 2) else x
    for corner in range(4):
        has = cells[:, corner] >= 0
        sim.x[has, 2 * corner : 2 * corner + 2] = x[cells[has, corner]]
    changes.repeat(sim, sim.x)
    sim.close_model()


def waited(sim: Blocks, time: float, steps: int) -> None:
    """The same of nodes that are held: there is nothing to balance."""
    end = sim.creep.time + time
    creep.switch(sim, True, dt=time / steps)
    for _ in range(steps):
        creep.begin(sim, end)
        creep.finish(sim, end)


def width(sim: Blocks) -> np.ndarray:
    """Strain xx and yy of the square."""
    corner = [int(np.flatnonzero((sim.mesh.points == 1.0).all(axis=1))[0])]
    return np.array([diagnostics.values(sim, f"displacement_{axis}", corner)[0] for axis in "xy"])


def stresses(sim: Blocks) -> np.ndarray:
    return np.column_stack([diagnostics.values(sim, name) for name in STRESSES])


def compliance(t: float, of=SALT) -> float:
    """J(t) [1/Pa]."""
    kelvin, viscosity = of["kelvin_shear"], of["kelvin_viscosity"]
    unit = (1.0 - math.exp(-kelvin * t / viscosity)) / kelvin if kelvin and viscosity else 0.0
    return 1.0 / of["maxwell_shear"] + (t / of["maxwell_viscosity"] if of["maxwell_viscosity"] else 0.0) + unit


def transform(of) -> tuple[np.poly1d, np.poly1d]:
    """N, D of s J(s) = 1 / G_M + 1 / (eta_M s) + 1 / (G_K + eta_K s)."""
    s, unit = np.poly1d([1.0, 0.0]), np.poly1d([of["kelvin_viscosity"], of["kelvin_shear"]])
    g, m = of["maxwell_shear"], of["maxwell_viscosity"]
    return m * s * unit + g * unit + g * m * s, g * m * s * unit


def after_step(n: np.poly1d, d: np.poly1d, t: float) -> float:
    """What has n / d in the Laplace domain, after a unit step at t = 0: n(0) / d(0) + sum n(r) / (r d'(r)) exp(r t)."""
    found = n(0.0) / d(0.0)
    for r in d.roots.real:
        found += n(r) / (r * d.deriv()(r)) * math.exp(r * t)
    return found


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize(
    ("time", "strain"),
    [(1e4, 8.98469e-4), (1e5, 1.543262e-3),
     *(pytest.param(*one, marks=pytest.mark.slow) for one in ((2e4, 1.142121e-3), (5e4, 1.442915e-3)))],
)  # fmt: skip
def test_pure_shear(time, strain, kind):
    """sigma_xx = -sigma_yy = 5 MPa: shear strain 5 MPa J(t), in plane strain too, as no stress acts along z."""
    sim = loaded(LOAD, -LOAD, kind)
    assert np.ptp(width(sim)[::-1]) == pytest.approx(5e-4, rel=1e-6)
    crept(sim, time, 20)
    found = width(sim)
    assert found[0] - found[1] == pytest.approx(strain, rel=2e-3)
    assert strain == pytest.approx(LOAD * compliance(time), rel=1e-5)
    assert stresses(sim) == pytest.approx(np.tile([LOAD, -LOAD, 0.0, 0.0], (len(sim.number), 1)), abs=1.0)


def test_the_order_is_two():
    """Ten times as many steps, a hundredth of the error."""
    errors = []
    for steps in (5, 50):
        sim = loaded(LOAD, -LOAD)
        crept(sim, 1e5, steps)
        errors.append(abs(width(sim)[0] * 2.0 / (LOAD * compliance(1e5)) - 1.0))
    assert 90.0 < errors[0] / errors[1] < 110.0 and errors[1] < 5e-5


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("time", [2e4, 1e5])
def test_uniaxial_stress_in_plane_strain(time, kind):
    """sigma_yy = p alone, plane strain: with 1 / G in the place of s J(s) the elastic strain is
    p (1 - nu^2) / E = p (3 K + 4 G) / (4 G (3 K + G)) = p [1 / (4 G) + 3 / (4 (3 K + G))], and 1 / (3 K + G) becomes
    N / (D + 3 K N); along x it is -p nu (1 + nu) / E = p [1 / (3 K + G) 3 / 4 - 1 / (4 G)]."""
    sim = loaded(0.0, -LOAD, kind, **ROCK)
    n, d = transform(ROCK)
    crept(sim, time, 100)
    shear, both = 0.25 * compliance(time, ROCK), 0.75 * after_step(n, d + 3.0 * ROCK["bulk"] * n, time)
    assert width(sim) == pytest.approx([-LOAD * (both - shear), -LOAD * (both + shear)], rel=5e-4)
    assert not np.allclose(stresses(sim)[:, 3], stresses(loaded(0.0, -LOAD, kind, **ROCK))[:, 3], rtol=0.05)


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("gradient", [[[1.0, 1e-4], [1e-4, 1.0]], [[1.0 - 2e-4, 0.0], [0.0, 1.0 + 1e-4]]])
def test_relaxation_at_fixed_strain(gradient, kind):
    """S(t) = 2 e D / N after a step, the mean stress stays; second order in the creep step."""
    n, d = transform(ROCK)
    errors = []
    for steps in (20, 200):
        sim = body(kind, **ROCK)
        held(sim, gradient)
        before = stresses(sim)
        waited(sim, 3e5, steps)
        left = after_step(d, n, 3e5) / ROCK["maxwell_shear"]
        mean = before[:, [0, 1, 3]].mean(axis=1, keepdims=True) * [1.0, 1.0, 0.0, 1.0]
        expected = mean + left * (before - mean)
        errors.append(np.abs(stresses(sim) - expected).max() / np.abs(before).max())
    assert left < 0.7 and errors[0] < 2e-3 and 80.0 < errors[0] / errors[1] < 120.0


def test_recovery_after_unloading():
    """To a tenth of the load: the springs recover, the dashpot of the Maxwell unit does not (superposition)."""
    sim = loaded(LOAD, -LOAD)
    crept(sim, 5e4, 50)
    sim.stress_condition(near(sim.mesh, 0, 1.0), xx=0.1 * LOAD)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=-0.1 * LOAD)
    equilibrium.solve_elastic(sim)
    assert 2.0 * width(sim)[0] == pytest.approx(LOAD * (compliance(5e4) - 0.9 * compliance(0.0)), rel=1e-3)
    crept(sim, 3e4, 50)
    assert 2.0 * width(sim)[0] == pytest.approx(LOAD * (compliance(8e4) - 0.9 * compliance(3e4)), rel=1e-3)


@pytest.mark.parametrize(
    "none",
    [{"kelvin_shear": 0.0}, {"kelvin_viscosity": 0.0}, {"maxwell_viscosity": 0.0},
     {"kelvin_shear": 0.0, "maxwell_viscosity": 0.0}],
)  # fmt: skip
def test_units_that_are_not_there(none):
    """Maxwell alone flows at a constant rate, Kelvin alone comes to rest, neither is elastic."""
    sim = loaded(LOAD, -LOAD, **none)
    crept(sim, 4e4, 20)
    assert 2.0 * width(sim)[0] == pytest.approx(LOAD * compliance(4e4, {**SALT, **none}), rel=1e-3)
    assert compliance(4e4, {**SALT, **none}) < 0.99 * compliance(4e4)


@EVERY_KIND
def test_elastic_as_long_as_creep_is_off(kind):
    """The bits of an elastic element, in motion."""
    ends = []
    for name in (BURGERS, "mech_iso_elastic"):
        sim = Blocks()
        sim.take_mesh(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
        rock = {"density": 2500.0, "young": 30e9, "poisson_ratio": 0.3, "damp_factor": 0.1}
        more = {"kelvin_shear": 1e9, "kelvin_viscosity": 1e5, "maxwell_viscosity": 1e5} if name == BURGERS else {}
        changes.element_model(sim, None, name, {**rock, **more})
        sim.initial_stress(None, xx=1e6, yy=-2e6, zz=1e5)
        changes.set_velocity(sim, np.arange(4), 1.0, -2.0)
        convergence.advance(sim, 50)
        ends.append(np.concatenate([diagnostics.values(sim, "position_x"), diagnostics.values(sim, "strain_energy")]))
    assert np.array_equal(*ends)


@EVERY_KIND
def test_a_turn_changes_nothing(kind):
    """Stress, creep strain and Kelvin strain turn with the body."""
    turn = np.array([[math.cos(1.0), -math.sin(1.0)], [math.sin(1.0), math.cos(1.0)]])
    stretch = np.array([[1.001, 4e-4], [4e-4, 0.9995]])
    found = []
    for r in (np.eye(2), turn):
        sim = body(kind)
        held(sim, r @ stretch)
        waited(sim, 3e4, 10)
        held(sim, r)
        parts = []
        for name in ("stress", "creep_strain", "kelvin_strain"):
            xx, yy, xy = (diagnostics.values(sim, f"{name}_{c}") for c in ("xx", "yy", "xy"))
            parts.append(r.T @ np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1) @ r)
        found.append(parts)
    for one, other in zip(*found):
        assert other == pytest.approx(one, abs=1e-9 * np.abs(one).max())
    assert np.abs(found[0][1]).min() > 1e-6 and not np.allclose(found[0][1], found[0][2], rtol=0.01)


@pytest.mark.parametrize(
    "name", ["bulk", "maxwell_shear", "maxwell_viscosity", "kelvin_shear", "kelvin_viscosity", "kelvin_strain_xx",
             "kelvin_strain_yy", "kelvin_strain_xy", "young", "poisson_ratio"],
)  # fmt: skip
def test_every_property_counts(name):
    ends = []
    for part in (1.0, 0.9):
        salt = dict(SALT)
        if name in ("young", "poisson_ratio"):
            del salt["bulk"], salt["maxwell_shear"]
            salt |= {"young": 25e9, "poisson_ratio": 0.28}
        salt |= dict(zip(kernels_strains(), (3e-5, -1e-5, 2e-5)))
        sim = Blocks()
        sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
        changes.element_model(sim, None, BURGERS, {**salt, name: part * salt[name]})
        sim.option(dynamic=False, collision=False)
        held(sim, [[1.0, 1e-4], [2e-4, 1.0 - 1e-4]])
        waited(sim, 1e4, 5)
        ends.append(stresses(sim))
    assert not np.array_equal(*ends)


def kernels_strains() -> tuple[str, ...]:
    return "kelvin_strain_xx", "kelvin_strain_yy", "kelvin_strain_xy"


def test_moduli():
    """E and Poisson's ratio give K and G_M; what is given beside them takes the place of what they give."""
    given = {"density": 1.0, "young": 25e9, "poisson_ratio": 0.25}
    sim = Blocks()
    sim.take_mesh(rectangle(1, 1, 1.0, 1.0))

    def moduli(**more: float) -> tuple[float, ...]:
        changes.element_model(sim, None, BURGERS, {**given, **more})
        rows = sim.element_rows.values(int(sim.element_row[0]))
        return tuple(rows[n] / 1e9 for n in ("bulk", "maxwell_shear", "young"))

    assert moduli() == pytest.approx((25 / 1.5, 10.0, 25.0))
    assert moduli(bulk=30e9) == pytest.approx((30.0, 10.0, 27.0))
    assert moduli(maxwell_shear=5e9) == pytest.approx((25 / 1.5, 5.0, 150 / 11))
    assert moduli(bulk=30e9, maxwell_shear=5e9) == pytest.approx((30.0, 5.0, 450 / 31.667), rel=1e-3)
    sim.element_property(None, {"maxwell_shear": 6e9})
    rows = sim.element_rows.values(int(sim.element_row[0]))
    assert (rows["bulk"], rows["maxwell_shear"]) == (30e9, 6e9)
    with pytest.raises(CommandError, match=r"needs two of young, poisson_ratio, maxwell_shear, bulk \(Pa\), got bulk"):
        changes.element_model(sim, None, BURGERS, {"density": 1.0, "bulk": 1e9})


def test_friction_of_its_surfaces_is_its_own():
    """A block slides down a slope that is as steep as its friction or not."""
    paths = []
    for friction in (20.0, 50.0):
        lower, upper = rectangle(8, 1, 0.8, 0.1), rectangle(2, 1, 0.2, 0.1, x0=0.05, y0=0.1 + 1e-7)
        sim = Blocks()
        sim.take_mesh(joined(lower, upper))
        changes.element_model(sim, None, BURGERS, {**SALT, "friction": friction, "damp_factor": 0.1})
        sim.velocity_condition(np.arange(len(lower.points)), vx=0.0, vy=0.0)
        sim.gravity(*(9.81 * np.array([math.sin(math.radians(35.0)), -math.cos(math.radians(35.0))])))
        sim.time_step(mass_scaling=2e-5)
        convergence.advance(sim, 1000)
        paths.append(diagnostics.values(sim, "displacement_x").max())
    assert paths[0] > 5.0 * paths[1]


@EVERY_KIND
def test_in_motion_every_step_is_a_creep_step(kind):
    """Held nodes: the stress relaxes with the time of the model; density and damping count in motion."""
    fast = {"maxwell_viscosity": 2e6, "kelvin_viscosity": 1e6}
    n, d = transform({**SALT, **fast})
    sim = body(kind, **fast)
    sim.option(dynamic=True)
    sim.time_step(value=1e-6)
    held(sim, [[1.0, 1e-4], [1e-4, 1.0]])
    before = stresses(sim)
    creep.switch(sim, True)
    convergence.advance(sim, 200)
    left = after_step(d, n, 200e-6) / SALT["maxwell_shear"]
    assert sim.creep.time == pytest.approx(sim.clock.time) == pytest.approx(200e-6)
    assert stresses(sim)[:, 2] == pytest.approx(left * before[:, 2], rel=1e-4)
    assert left < 0.6
    ends = []
    for other in ({}, {"damp_factor": 0.5}, {"density": 2600.0}):
        sim = body(kind, **fast, **other)
        sim.option(dynamic=True)
        sim.time_step(value=1e-6)
        creep.switch(sim, True)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 0.5), -5.0, 0.0)
        convergence.advance(sim, 50)
        ends.append(diagnostics.values(sim, "position_x"))
    assert not np.array_equal(ends[0], ends[1]) and not np.array_equal(ends[0], ends[2])


@EVERY_KIND
def test_the_energy_budget_closes(kind):
    """A bar is thrown against a wall and creeps: what its dashpots lose and what is stored add up to what it had, also
    when its Kelvin strain is taken away on the way, and when creep ends."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(12, 4, 0.6, 0.2, kind=kind), 0.2))
    fast = {"maxwell_viscosity": 5e6, "kelvin_viscosity": 5e5, "damp_factor": 0.02}
    changes.element_model(sim, None, BURGERS, {**SALT, **fast, "kelvin_strain_xx": 1e-5})
    sim.option(collision=False)
    sim.initial_stress(None, xx=-1e5, yy=-2e5, zz=-1e5)
    changes.set_velocity(sim, None, -2.0, 0.0)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0)
    creep.switch(sim, True)
    convergence.advance(sim, 20)
    diagnostics.account_energy(sim)
    lost = []
    for k in range(10):
        convergence.advance(sim, 60)
        if k == 4:
            sim.element_property([5], {"kelvin_viscosity": 2e6})
        if k == 6:
            changes.reset_kelvin_strain(sim, np.arange(30))
        if k == 8:
            creep.switch(sim, False)
        found = diagnostics.energies(sim)
        lost.append(found["creep_lost"])
        assert found["relative"] < 0.01, found
    assert (np.diff(lost[:9]) > 0.0).all() and lost[8] == lost[9]
    assert lost[-1] > 0.2 * 0.5 * SALT["density"] * 0.12 * 4.0
    assert lost[-1] <= diagnostics.total(sim, "creep_work")


@EVERY_KIND
def test_reset_of_the_kelvin_strain(kind):
    """Stress and shape stay; the unit creeps as from the beginning."""
    sim = loaded(LOAD, -LOAD, kind)
    crept(sim, 1e5, 50)
    before, at = stresses(sim), width(sim)
    changes.reset_kelvin_strain(sim)
    assert not diagnostics.values(sim, "kelvin_strain_xx").any() and np.array_equal(stresses(sim), before)
    crept(sim, 1e4, 20)
    assert 2.0 * (width(sim) - at)[0] == pytest.approx(LOAD * (compliance(1e4) - compliance(0.0)), rel=1e-3)


@EVERY_KIND
def test_kelvin_strain_of_an_initial_stress(kind):
    """With the strain S / (2 G_K) of an initial stress the Kelvin unit is at rest: only the dashpot flows."""
    strain = LOAD / (2.0 * SALT["kelvin_shear"])
    given = dict(zip(kernels_strains(), (strain, -strain, 0.0)))
    for more, expected in ((given, 3e4 / 1e16), ({}, compliance(3e4) - compliance(0.0))):
        sim = body(kind, **more)
        sim.initial_stress(None, xx=LOAD, yy=-LOAD)
        x, y = sim.mesh.points.T
        sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
        sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
        sim.stress_condition(near(sim.mesh, 0, 1.0), xx=LOAD)
        sim.stress_condition(near(sim.mesh, 1, 1.0), yy=-LOAD)
        crept(sim, 3e4, 30)
        assert 2.0 * width(sim)[0] == pytest.approx(LOAD * expected, rel=1e-3)


@EVERY_KIND
def test_another_model_keeps_what_has_crept(kind):
    """Elastic from here on, the creep strain stays when the load goes; plastic before, the stress stays."""
    sim = loaded(LOAD, -LOAD, kind)
    crept(sim, 5e4, 20)
    before = stresses(sim)
    changes.element_model(sim, None, "mech_iso_elastic", {"density": 2500.0, "bulk": 20e9, "shear": 10e9})
    assert stresses(sim) == pytest.approx(before, abs=1e-3)
    sim.stress_condition(near(sim.mesh, 0, 1.0), xx=0.1 * LOAD)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=-0.1 * LOAD)
    equilibrium.solve_elastic(sim)
    assert 2.0 * width(sim)[0] == pytest.approx(LOAD * (compliance(5e4) - 0.9 * compliance(0.0)), rel=2e-3)
    weak = {"density": 2500.0, "bulk": 20e9, "shear": 10e9, "cohesion": 1e6, "tensile": 1e6}
    sim = body(kind)
    changes.element_model(sim, None, "mech_mohr_coulomb", weak)
    held(sim, [[1.0, 0.0], [0.0, 0.999]])
    sim.step()
    before = stresses(sim)
    changes.element_model(sim, None, BURGERS, SALT)
    assert stresses(sim) == pytest.approx(before, abs=1.0)
    waited(sim, 1e5, 20)
    once = stresses(sim)
    sim.rebuild()
    assert np.array_equal(stresses(sim), once) and np.abs(once[:, 1]).max() < np.abs(before[:, 1]).max()


@EVERY_KIND
def test_relaxation_to_a_ratio_is_as_good_as_at_once(kind):
    sims = [loaded(0.0, -LOAD, kind, **ROCK) for _ in range(2)]
    crept(sims[0], 2e4, 4)
    creep.switch(sims[1], True, dt=5e3)
    for _ in range(4):
        creep.begin(sims[1], 2e4)
        convergence.solve(sims[1], ratio=1e-7)
        creep.finish(sims[1], 2e4)
    assert width(sims[1]) == pytest.approx(width(sims[0]), rel=1e-5)


def test_the_creep_step_follows_the_change_of_stress():
    """Short while the Kelvin unit takes up the load, long when it is at rest, always within its bounds; the strain is
    as good as its limit is small."""
    errors, counts = [], []
    for change in (0.1, 0.025):
        sim = loaded(LOAD, -LOAD)
        creep.switch(sim, True, dt=100.0, change=change, least=50.0, greatest=2e4)
        steps = []
        while sim.creep.time < 2e5:
            creep.begin(sim, 2e5)
            steps.append(sim.creep.passed)
            equilibrium.solve_elastic(sim)
            creep.finish(sim, 2e5)
        assert max(steps) <= 2e4 and min(steps[:-1]) >= 50.0 and max(steps) > 5.0 * steps[0]
        assert all(b <= 2.0 * a * (1.0 + 1e-12) for a, b in itertools.pairwise(steps))
        errors.append(abs(2.0 * width(sim)[0] / (LOAD * compliance(2e5)) - 1.0))
        counts.append(len(steps))
    assert errors[1] < errors[0] < 1e-3 and counts[1] > 1.5 * counts[0]


def test_delayed_failure():
    """A creeping and an elastic strip share a load on a stiff cap; the load goes over to the elastic one until its
    joints break in mid-creep. With twice the viscosities and creep steps it does so at twice the time, bit for bit."""
    times, ends = [], []
    for slow in (1.0, 2.0):
        mesh = rectangle(4, 4, 1.0, 1.0)
        sim = Blocks()
        sim.take_mesh(mesh)
        elastic = {"density": 2500.0, "bulk": 20e9, "shear": 10e9}
        changes.element_model(sim, None, "mech_iso_elastic", elastic)
        centre = mesh.centroids()
        soft = {**MAXWELL, "maxwell_viscosity": slow * 1e15}
        changes.element_model(sim, np.flatnonzero((centre[:, 0] < 0.5) & (centre[:, 1] < 0.75)), BURGERS, soft)
        stiff = {"density": 2500.0, "bulk": 2e12, "shear": 1e12}
        changes.element_model(sim, np.flatnonzero(centre[:, 1] > 0.75), "mech_iso_elastic", stiff)
        sim.option(dynamic=False, collision=False)
        edges = mesh.edges()
        inner = edges.faces[edges.inner][:, 0]
        ends_of = mesh.points[edges.points[edges.inner]]
        at = (np.abs(ends_of[:, :, 1] - 0.5) < 1e-9).all(axis=1) & (ends_of[:, :, 0] > 0.49).all(axis=1)
        joint = {**JOINT, "tensile_strength": 5.6e6, "cohesion": 1e9, "gf1": 5.0, "gf2": 1e5}
        sim.joint_model(inner[at], "classic_intrinsic_cohesive_interface", joint)
        sim.velocity_condition(None, vx=0.0)
        sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] < 1e-9), vy=0.0)
        sim.stress_condition(near(mesh, 1, 1.0), yy=LOAD)
        convergence.solve(sim, ratio=1e-6)
        assert diagnostics.joint_counts(sim)[2] == 0
        creep.switch(sim, True, dt=slow * 5e3)
        while not diagnostics.joint_counts(sim)[2] and sim.creep.steps < 60:
            creep.begin(sim, math.inf)
            convergence.solve(sim, ratio=1e-5, window=0, limit=4000)
            creep.finish(sim, math.inf)
        times.append(diagnostics.events(sim)["time"][0])
        ends.append(diagnostics.values(sim, "position_y"))
    assert times[0] > 1e4 and times[1] == 2.0 * times[0] and np.array_equal(*ends)


@EVERY_KIND
def test_looking_changes_nothing(kind):
    """In motion and in a creep step."""
    ends = []
    for look in (False, True):
        sim = body(kind, maxwell_viscosity=2e6, kelvin_viscosity=1e6)
        sim.option(dynamic=True)
        creep.switch(sim, True)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 1] > 0.5), 0.0, -2.0)
        for k in range(90):
            if k == 60:
                sim.option(dynamic=False)
                creep.switch(sim, True, dt=1e-4)
                creep.begin(sim, 1.0)
            convergence.advance(sim, 1)
            if look:
                for name in ("stress_max", "creep_strain_xx", "kelvin_strain_xy", "creep_work", "strain_energy"):
                    diagnostics.values(sim, name)
                diagnostics.unbalanced_ratio(sim)
        creep.finish(sim, 1.0)
        ends.append(np.concatenate([diagnostics.values(sim, "position_y"), diagnostics.values(sim, "creep_work")]))
    assert np.array_equal(*ends) and ends[0][-len(sim.alive) :].min() > 0.0


@EVERY_KIND
def test_a_step_that_finds_no_balance_is_forgotten(kind, tmp_path):
    """Creep time and creep strain are those of the step before; what is saved in mid-creep goes on as it was."""
    sim = loaded(LOAD, -LOAD, kind)
    crept(sim, 1e4, 2)
    before = diagnostics.values(sim, "creep_strain_xx"), stresses(sim)
    creep.begin(sim, 2e4)
    convergence.advance(sim, 1)
    saved_state.save(sim, tmp_path / "a.sav")
    assert not np.array_equal(diagnostics.values(sim, "creep_strain_xx"), before[0])
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for one in (sim, other):
        convergence.advance(one, 40)
        creep.finish(one, 2e4)
    assert np.array_equal(stresses(sim), stresses(other)) and sim.creep == other.creep
    again = loaded(LOAD, -LOAD, kind)
    crept(again, 1e4, 2)
    creep.begin(again, 2e4)
    again.local.forces()
    again.option(dynamic=True)
    assert again.creep.passed == 0.0
    assert np.array_equal(diagnostics.values(again, "creep_strain_xx"), before[0])
    assert np.array_equal(stresses(again), before[1]) and again.creep.time == 1e4


def test_refusals():
    sim = Blocks()
    sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
    with pytest.raises(CommandError, match="has the model mech_burgers: there is no Kelvin strain"):
        changes.reset_kelvin_strain(sim)
    sim.option(dynamic=False)
    for given, message in (
        ({"dt": 0.0}, "dt of creep must be positive, got 0"),
        ({"dt": math.nan}, "dt must be finite"),
        ({"change": 0.1}, "change of creep needs dt"),
        ({"dt": 1.0, "least": 0.1}, "add change"),
        ({"dt": 1.0, "change": 1.0}, "below 1, got 1"),
        ({"dt": 1.0, "change": 0.1, "greatest": 0.5}, "must lie between least, 0.01 s, and greatest, 0.5 s"),
    ):
        with pytest.raises(CommandError, match=message):
            creep.switch(sim, True, **given)
    with pytest.raises(CommandError, match="creep off does not accept dt"):
        creep.switch(sim, False, dt=1.0)
    with pytest.raises(CommandError, match="model creep on"):
        creep.check(sim, 1.0)
    creep.switch(sim, True)
    with pytest.raises(CommandError, match="no element can creep: assign element c-model mech-burgers first"):
        creep.check(sim, 1.0)
    sim = body()
    creep.switch(sim, True)
    with pytest.raises(CommandError, match="need the length of a creep step"):
        creep.check(sim, 1.0)
    creep.switch(sim, True, dt=1.0)
    sim.velocity_condition([3], vy=0.1)
    with pytest.raises(CommandError, match="node 3 has a prescribed motion in y"):
        creep.check(sim, 1.0)
    sim.velocity_condition([3], ay=0.1)
    with pytest.raises(CommandError, match="node 3 has a prescribed motion in y"):
        creep.check(sim, 1.0)
    sim.velocity_condition([3], ay=0.0)
    creep.check(sim, 1.0)


def test_what_crept_yields_afterwards_and_what_yielded_creeps():
    """Quads, each triangle of which remembers both: with another model the stress stays as it is, and the two triangles
    of an overlay keep one pressure in the plane, though they flowed by different strains."""
    weak = {"density": 2500.0, "bulk": 20e9, "shear": 10e9, "cohesion": 1e6, "tensile": 1e6, "dilation": 10.0,
            "friction": 20.0}  # fmt: skip

    def now() -> np.ndarray:
        sim.close_model()
        return sim.local.stresses(flow=False)[0]

    sim = body("quad")
    changes.element_model(sim, None, "mech_mohr_coulomb", weak)
    x, y = sim.mesh.points.T
    for k, name in enumerate(("mech_mohr_coulomb", BURGERS, "mech_mohr_coulomb", BURGERS)):
        before = now()
        changes.element_model(sim, None, name, SALT if name == BURGERS else weak)
        assert now() == pytest.approx(before, abs=1.0), k
        if name == BURGERS:
            waited(sim, 2e4, 5)
        else:
            held(sim, np.column_stack([x + (1 + k) * 1e-3 * x * y, y - (1 + k) * 1e-3 * y * y]))
            sim.step()
        assert np.abs(now() - before).max() > 0.05 * np.abs(now()).max(), k
        s0 = sim.local.solids.blocks[1].s0.reshape(-1, 2, 2, 4)
        pressure = 0.5 * (s0[..., 0] + s0[..., 1])
        assert np.abs(pressure[:, :, 0] - pressure[:, :, 1]).max() < 1e-9 * np.abs(s0).max(), k
        assert np.abs(s0[:, :, 0] - s0[:, :, 1]).max() > 1e-3 * np.abs(s0).max(), k


def test_the_law_of_a_step():
    """The factors of the formulas at the head of kernels/creep.py, by hand: dt = 2 s, G_M = 0.5, G_K = 3, eta_K = 4,
    eta_M = 5."""
    back, kelvin, maxwell, x, ratio = kernels.factors(2.0, 1.0, 3.0, 0.25, 0.2)
    assert (ratio, back) == pytest.approx((0.25 / 1.75, 0.25 / 1.75 - 1.0))
    assert (kelvin, maxwell) == pytest.approx((0.5 / (1.75 * 4.0), 0.1))
    assert x == pytest.approx(1.0 + 0.5 * (1.0 / 5.0 + 1.0 / (1.75 * 4.0)))
