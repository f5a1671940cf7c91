"""The static solve of elements that yield: the tangent, closed forms, relaxation, increments, what is refused."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.elements.tangent import principal_slopes
from hpcdem.physics.fdem.kernels.plasticity import SHEAR_NOW, principal_return
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from tests.blocks.support import EVERY_KIND, model, near, rectangle, shaken
from tests.blocks.test_equilibrium import farthest, refused, state
from tests.blocks.test_yielding import MOHR_COULOMB, SOIL, STRESSES, A, B, K, N, soil
from tests.cases.plastic_hole import test_plastic_hole as ring
from tests.space.support import box, hexes

MEMORY = ("plastic_shear_strain", "plastic_volume_strain", "plastic_work")


@pytest.fixture
def newton(monkeypatch):
    """What Newton's method came to, one after the other."""
    found, run = [], equilibrium._newton

    def told(*args, **how):
        found.append(run(*args, **how))
        return found[-1]

    monkeypatch.setattr(equilibrium, "_newton", told)
    return found


# ---- the tangent ---------------------------------------------------------------------------------------------------


def test_slopes_of_the_return():
    """T against differences of the return, exact as it is linear between its edges; every region is met."""
    rng, met = np.random.default_rng(5), set()
    slopes = np.empty((3, 3))
    for _ in range(3000):
        n, t = 3.0, rng.choice([0.2, 0.9])
        m = rng.choice([1.0, 1.42, 3.0])
        a, b, k = 18.0, 6.0, 3.5
        s = np.sort(rng.uniform(-6.0, 4.0, 3))
        found = principal_slopes(*s, n, m, k, t, a, b, slopes)
        assert found == principal_return(*s, n, m, k, t, a, b)
        r1, r2, r3, bits = found
        met.add((bits, r1 == r2, r2 == r3))
        by = np.empty((3, 3))
        for j in range(3):
            ends = []
            for h in (1e-7, -1e-7):
                moved = s.copy()
                moved[j] += h
                ends.append(np.array(principal_return(*moved, n, m, k, t, a, b)[:3]))
            by[:, j] = (ends[0] - ends[1]) / 2e-7
        if np.diff(s).min() > 1e-5:
            assert slopes == pytest.approx(by, abs=1e-6)
    assert len(met) >= 8


# ---- closed forms --------------------------------------------------------------------------------------------------


def walls(sim: Blocks, speed: float) -> None:
    """Stiff smooth walls on three sides, the fourth, on top, moves by this much per unit of time."""
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 1.0 - 1e-9)), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 1.0 - 1e-9), vy=speed)


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("steps", [1, 7])
def test_uniaxial_strain(kind, steps, newton):
    """The closed form of test_yielding.test_uniaxial_strain, on an edge of the surface, in one solve."""
    m = math.tan(math.pi / 4.0 + 0.5 * math.radians(SOIL["dilation"])) ** 2
    sim, e = soil(kind), 0.01
    sim.option(large_strain=False)
    walls(sim, -e / 4.0)
    found = equilibrium.solve_elastic(sim, cycles=4, steps=steps)
    assert found.increments == steps <= len(newton) and found.ratio < 1e-8 and sim.clock.step == 4
    lag = (A * e - N * B * e - K) / (A - B * m - N * (B - 0.5 * (A + B) * m))
    sy, sx = -A * e + lag * (A - B * m), -B * e + lag * (B - 0.5 * (A + B) * m)
    for name, want in zip(STRESSES, (sx, sy, 0.0, sx)):
        assert diagnostics.values(sim, name) == pytest.approx(want, rel=1e-7, abs=1e-7 * abs(sy))
    assert diagnostics.values(sim, "plastic_volume_strain") == pytest.approx(lag * (m - 1.0), rel=1e-6)
    assert (diagnostics.values(sim, "plastic_state") == SHEAR_NOW).all()


def hole(
    dilation: float, mesh: Mesh, friction: float = 30.0, zz: float = -ring.P0, edge: float = ring.EDGE,
    zone: float = ring.radius(0.0),
) -> Blocks:  # fmt: skip
    """The hole of tests/cases/plastic_hole without pressure in it; outside the stress of the closed form."""
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, MOHR_COULOMB, {**ring.ROCK, "dilation": dilation, "friction": friction})
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.initial_stress(None, xx=-ring.P0, yy=-ring.P0, zz=zz)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    edges = sim.mesh.edges()
    faces, far = edges.faces[~edges.inner][:, 0], np.hypot(x, y)[edges.points[~edges.inner]]
    drop = (ring.P0 - edge) * zone**2
    outer = (far > ring.OUTSIDE - 1e-6).all(axis=1)
    sim.stress_condition(faces[outer], normal=drop / ring.OUTSIDE**2 - ring.P0)
    return sim


@pytest.mark.some_of_each
@pytest.mark.parametrize("each", [4, 1])
@pytest.mark.parametrize("dilation, steps", [(30.0, 1), (30.0, 10), (0.0, 10)])
def test_a_hole_in_rock_that_yields(dilation, steps, each):
    """Salencon 1969: stresses to 1 % between the hole and 5 a, the plastic radius 1.735 a and the radial stress there,
    12.01 MPa, to 2 %; as by relaxation in 40 stages."""
    sim = hole(dilation, ring.quarter(each))
    found = equilibrium.solve_elastic(sim, steps=steps)
    assert found.increments >= steps and (each == 1 or found.iterations < 15 * found.increments)
    areas, centres = sim.mesh.areas(), sim.mesh.centroids()
    c, s = centres.T / np.hypot(*centres.T)
    xx, yy, xy = (diagnostics.values(sim, name) for name in STRESSES[:3])
    both = xx * c * c + yy * s * s + 2.0 * xy * c * s, xx * s * s + yy * c * c - 2.0 * xy * c * s
    cells = areas.reshape(-1, each).sum(axis=1)
    means = [(areas * part).reshape(-1, each).sum(axis=1) / cells for part in both]
    wanted = [(areas * part).reshape(-1, each).sum(axis=1) / cells for part in ring.exact(np.hypot(*centres.T))]
    r = np.hypot(*centres.T).reshape(-1, each).mean(axis=1)
    near_by = np.where(r < 5.0, cells, 0.0)
    for mean, want in zip(means, wanted):
        assert math.sqrt((near_by * (mean - want) ** 2).sum() / (near_by * want**2).sum()) < 0.01
    flowed = diagnostics.values(sim, "plastic_shear_strain") > ring.LITTLE
    assert math.sqrt(1.0 + 4.0 / math.pi * areas[flowed].sum()) == pytest.approx(1.735, rel=0.02)
    rings = means[0].reshape(ring.ALONG, ring.AROUND).mean(axis=1)
    there = np.interp(1.735, r.reshape(ring.ALONG, ring.AROUND).mean(axis=1), rings)
    assert there == pytest.approx(-12.01e6, rel=0.02)


@pytest.mark.parametrize("kind, off, within", [("quad", -1.4, 0.3), ("cross", -1.7, 0.3), ("one", -17.5, 1.0)])
def test_the_wall_of_the_hole_with_much_dilation(kind, off, within):
    """Salencon's displacement, phi = psi = 33 degrees, zz between the stresses of the plane: quads and four triangles
    in each cell come near it, two triangles with one diagonal lock (docs/blocks.md has these figures)."""
    nu, n = (3.0 * 3.9 - 2.0 * 2.8) / (2.0 * (3.0 * 3.9 + 2.8)), math.tan(math.radians(45.0 + 16.5)) ** 2
    s, p = 2.0 * ring.ROCK["cohesion"] * math.sqrt(n) / (n - 1.0), ring.P0
    zone = (2.0 / (n + 1.0) * (p + s) / s) ** (1.0 / (n - 1.0))
    wall = (1.0 - nu) * (n * n - 1.0) / (2.0 * n) * zone ** (2.0 * n) + (1.0 - nu) * (n * n + 1.0) / (2.0 * n) - nu
    exact = (wall * s - (1.0 - 2.0 * nu) * (p + s)) / (2.0 * ring.ROCK["shear"])
    mesh = ring.quarter(4 if kind == "cross" else 1)
    if kind == "one":
        mesh = Mesh.of(
            mesh.points, mesh.cells[:, [[0, 1, 3, 0], [1, 2, 3, 0]]].reshape(-1, 4) * [1, 1, 1, 0] - [0, 0, 0, 1]
        )
    sim = hole(33.0, mesh, friction=33.0, zz=-17e6, edge=p - (p + s) * (n - 1.0) / (n + 1.0), zone=zone)
    equilibrium.solve_elastic(sim)
    x, y = sim.mesh.points.T
    at = np.abs(np.hypot(x, y) - 1.0) < 1e-9
    inwards = -sum(
        diagnostics.values(sim, f"displacement_{c}")[at] * sim.mesh.points[at, k] for k, c in enumerate("xy")
    )
    assert 100.0 * (inwards.mean() / exact - 1.0) == pytest.approx(off, abs=within)


# ---- what is said between two balances -----------------------------------------------------------------------------


def column(kind: str, bodies: dict, **properties: float) -> Blocks:
    """A block on rollers, free at one side, under nine tenths of the load that it bears."""
    sim = Blocks(SerialComm())
    sim.take_mesh(bodies[kind]())
    changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, **properties})
    sim.option(dynamic=False, collision=False, large_strain=False)
    for axis, name in enumerate(("vx", "vy", "vz")[: sim.mesh.dim]):
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, axis] < 1e-9), **{name: 0.0})
    edges = sim.mesh.edges()
    top = (np.abs(sim.mesh.points[edges.points][..., 1] - 1.0) < 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[top & ~edges.inner][:, 0], normal=-0.9 * K)
    return sim


BODIES = {
    **{kind: partial(lambda kind: shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2), kind)
       for kind in ("cross", "quad", "mixed")},
    "tets": partial(box, (2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2),
    "hexes": partial(hexes, (2, 2, 2), (1.0, 1.0, 1.0), 0.2),
}  # fmt: skip


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize("what", ["stiffer", "initial", "weaker"])
def test_nothing_flows_before_balance(what, steps, kind):
    """Young's modulus three times as large, an initial stress of four times the tensile strength in a body that is free
    to shrink, both at a load that it bears: at the old positions the stress is far beyond the strength, in balance it
    is that of the load, and nothing has flowed, in one increment or more. Where the cohesion falls to 95 % the load is
    borne too."""
    sim = column(kind, BODIES)
    equilibrium.solve_elastic(sim)
    before = diagnostics.values(sim, "stress_yy")
    assert before == pytest.approx(-0.9 * K, rel=2e-3)  # loaded faces are as long as they are now
    if what == "stiffer":
        sim.element_property(None, {"bulk": 3.0 * SOIL["bulk"], "shear": 3.0 * SOIL["shear"]})
    elif what == "weaker":
        sim.element_property(None, {"cohesion": 0.95 * SOIL["cohesion"]})
    else:
        sim.initial_stress(None, xx=4e6, yy=4e6, **({"zz": 4e6} if sim.mesh.dim == 3 else {}))
    if what != "weaker":
        sim.close_model()
        assert equilibrium._still_to_flow(sim) > 0.1
    equilibrium.solve_elastic(sim, steps=steps)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(before, rel=2e-3)
    assert not diagnostics.values(sim, "plastic_state").any() and not diagnostics.values(sim, "plastic_work").any()


@pytest.mark.parametrize("kind", BODIES)
def test_what_flows_in_balance_is_that_of_the_strength_of_now(kind):
    """A plate that is stretched along x, held across, flows in tension; then its tensile strength falls to a half: the
    stress is that strength, in one increment as in four."""
    for steps in (1, 4):
        sim = column(kind, BODIES)
        x, y = sim.mesh.points.T[:2]
        edges = sim.mesh.edges()
        top = (np.abs(sim.mesh.points[edges.points][..., 1] - 1.0) < 1e-9).all(axis=1)
        sim.stress_condition(edges.faces[top & ~edges.inner][:, 0], normal=-1e5)
        sim.velocity_condition(np.flatnonzero(x > 1.0 - 1e-9), vx=1e-3)
        equilibrium.solve_elastic(sim)
        sim.velocity_condition(np.flatnonzero(x > 1.0 - 1e-9), vx=0.0)
        assert diagnostics.values(sim, "stress_xx") == pytest.approx(SOIL["tensile"], rel=1e-6)
        sim.element_property(None, {"tensile": 0.5 * SOIL["tensile"]})
        equilibrium.solve_elastic(sim, steps=steps)
        assert diagnostics.values(sim, "stress_xx") == pytest.approx(0.5 * SOIL["tensile"], rel=1e-6)
        assert diagnostics.values(sim, "stress_yy") == pytest.approx(-1e5, rel=2e-3)


# ---- convergence ---------------------------------------------------------------------------------------------------


@EVERY_KIND
def test_convergence_is_quadratic(kind, newton):
    """A plate under a rough stamp: once the elements that flow are known each iteration squares the ratio, up to a
    factor and rounding; with the elastic matrix alone it is far from there."""
    sim = stamp(kind)
    equilibrium.solve_elastic(sim)
    ratios = newton[0].ratios
    near_by = [(a, b) for a, b in pairwise(ratios[1:]) if a < 1e-3 and b > 1e-11]
    assert near_by and all(b < 20.0 * a**1.7 for a, b in near_by)
    assert len(ratios) < 12 and ratios[-1] < 1e-11


def stamp(kind: str, press: float = 4e-3, **properties: float) -> Blocks:
    sim = soil(kind, **{"dilation": 30.0, "tensile": 5e6, **properties})
    x, y = sim.mesh.points.T
    sim.option(large_strain=False)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero((y > 1.0 - 1e-9) & (x < 0.7)), vx=0.0, vy=-press)
    return sim


@pytest.mark.parametrize("kind", ["cross", pytest.param("mixed", marks=pytest.mark.slow)])
def test_the_same_as_relaxation(kind):
    """A plate that is pressed by a rough stamp, by steps and at once: the way is the same where increments are small
    and relaxation slow, and so is what flows on it; 128 increments and twice the steps come to 0.25 %."""
    sim, slow = stamp(kind), stamp(kind, 4e-3 / 16)
    found = equilibrium.solve_elastic(sim, steps=64)
    assert found.increments >= 64
    top = np.flatnonzero((sim.mesh.points[:, 1] > 1.0 - 1e-9) & (sim.mesh.points[:, 0] < 0.7))
    for _ in range(16):
        slow.velocity_condition(top, vy=-4e-3 / 16 / 200)
        convergence.advance(slow, 200)
        slow.velocity_condition(top, vy=0.0)
        assert convergence.solve(slow, ratio=1e-7, cycles=20000).reason == "ratio"
    assert diagnostics.values(sim, "plastic_shear_strain").max() > 3e-3
    assert farthest(sim, slow, (*STRESSES, "displacement_x", "displacement_y", *MEMORY)) < 0.01


@pytest.mark.parametrize("end, within", [(12e6, 2e-4), pytest.param(1.5e6, 1e-5, marks=pytest.mark.slow)])
def test_strength_that_follows_tables(end, within):
    """Cohesion that grows or falls to `end` over a plastic strain of 0.01, under uniaxial strain in 200 increments: the
    stress is on the surface of the strength that belongs to the strain of each element, and the plastic strain that of
    steps. Flow in an increment is with the strength before it: where that grows, stress stays behind by a part of an
    increment."""
    both = []
    for at_once in (True, False):
        sim = soil("cross")
        sim.option(large_strain=False)
        sim.table("c", [(0.0, SOIL["cohesion"]), (0.01, end)])
        sim.element_property(None, {"cohesion": Over("c", PLASTIC_STRAIN)})
        walls(sim, -0.02 if at_once else -0.02 / 4000)
        if at_once:
            equilibrium.solve_elastic(sim, steps=200)
        else:
            convergence.advance(sim, 4000)
            walls(sim, 0.0)
            assert convergence.solve(sim, ratio=1e-9, cycles=20000).reason == "ratio"
        both.append(sim)
    strain = diagnostics.values(both[0], "plastic_shear_strain")
    xx, yy = (diagnostics.values(both[0], name) for name in ("stress_xx", "stress_yy"))
    c = np.interp(strain, [0.0, 0.01], [SOIL["cohesion"], end])
    assert -yy + N * xx - 2.0 * c * math.sqrt(N) == pytest.approx(0.0, abs=within * np.abs(yy).max())
    assert strain.min() > 8e-4 and farthest(*both, ("stress_xx", "stress_yy", "stress_zz", *MEMORY)) < 0.005


# ---- what follows --------------------------------------------------------------------------------------------------


def test_increments_count():
    """Loaded and then turned: where the direction of flow changes on the way, fewer increments give another answer,
    and more of them come nearer and nearer to each other."""
    found = []
    for steps in (1, 8, 16, 32):
        sim = stamp("cross", dilation=0.0)
        x, y = sim.mesh.points.T
        sim.velocity_condition(np.flatnonzero((y > 1.0 - 1e-9) & (x < 0.7)), vx=2e-3, vy=-4e-3)
        sim.stress_condition(near(sim.mesh, 0, 1.0), normal=-1e6)
        equilibrium.solve_elastic(sim, steps=steps)
        found.append(diagnostics.values(sim, "plastic_shear_strain"))
    gaps = [np.abs(a - b).max() for a, b in pairwise(found)]
    assert gaps[0] > 2.0 * gaps[1] > 2.0 * gaps[2] > 0.0


@pytest.mark.slow
def test_one_stage_after_the_other_and_a_file_between(tmp_path):
    """Loaded in two stages and taken back: the same bits after a checkpoint; what has flowed stays."""

    def begin() -> Blocks:
        sim = stamp("mixed")
        equilibrium.solve_elastic(sim, steps=2)
        return sim

    def go_on(sim: Blocks) -> list[np.ndarray]:
        top = np.flatnonzero((sim.mesh.points[:, 1] > 1.0 - 1e-9) & (sim.mesh.points[:, 0] < 0.7))
        equilibrium.solve_elastic(sim)
        sim.velocity_condition(top, vx=0.0, vy=2e-4)
        equilibrium.solve_elastic(sim)
        convergence.advance(sim, 10)
        return [*state(sim), *(diagnostics.values(sim, name) for name in (*STRESSES, *MEMORY))]

    sim = begin()
    before = diagnostics.values(sim, "plastic_work")
    saved_state.save(sim, tmp_path / "middle.sav")
    straight, again = go_on(begin()), Blocks()
    saved_state.restore(again, tmp_path / "middle.sav")
    for a, b in zip(straight, go_on(again)):
        assert np.array_equal(a, b)
    assert (straight[-1] >= before).all() and straight[-1].max() > 1.5 * before.max() > 0.0


def test_steps_that_continue_from_there_change_nothing():
    sim = stamp("mixed")
    equilibrium.solve_elastic(sim)
    before = {name: diagnostics.values(sim, name) for name in (*STRESSES, *MEMORY)}
    top = np.flatnonzero(sim.mesh.points[:, 1] > 1.0 - 1e-9)
    sim.velocity_condition(top[sim.mesh.points[top, 0] < 0.7], vx=0.0, vy=0.0)
    convergence.advance(sim, 100)
    assert diagnostics.unbalanced_ratio(sim) < 1e-8
    for name, values in before.items():
        assert diagnostics.values(sim, name) == pytest.approx(values, abs=1e-6 * np.abs(values).max()), name


def test_the_energy_budget_calls_it_a_command():
    sim = stamp("mixed")
    sim.option(dynamic=True)
    diagnostics.account_energy(sim)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero((y > 1.0 - 1e-9) & (x < 0.7)), vx=0.0, vy=0.0)
    sim.stress_condition(near(sim.mesh, 1, 1.0), normal=-8e6)
    sim.stress_condition(near(sim.mesh, 0, 1.0), normal=-0.5e6)
    sim.step()
    equilibrium.solve_elastic(sim)
    assert diagnostics.values(sim, "plastic_work").max() > 0.0
    convergence.advance(sim, 20)
    energies = diagnostics.energies(sim)
    assert abs(energies["closing"]) < 1e-9 * abs(energies["commands"])


# ---- what is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_more_than_the_rock_can_carry(kind):
    """A plate between smooth plates bears 2 c sqrt(N); under 5/4 of that balance is found up to four fifths, within the
    smallest increment, and the model is as it was."""
    sim = soil(kind, tensile=1e9)
    sim.option(large_strain=False)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero((x < 1e-9) & (y < 1e-9)), vx=0.0)
    sim.stress_condition(near(sim.mesh, 1, 1.0), normal=-1.25 * K)
    with pytest.raises(CommandError, match="it converged with") as told:
        equilibrium.solve_elastic(sim)
    part = float(str(told.value).split("converged with ")[1].split(" %")[0])
    assert 80.0 - 100.0 / 64.0 < part <= 80.0
    refused(sim, "did not converge|singular")
    assert diagnostics.values(sim, "plastic_work").max() == 0.0
    sim.stress_condition(near(sim.mesh, 1, 1.0), normal=-0.99 * K)
    assert equilibrium.solve_elastic(sim).ratio < 1e-8


@pytest.mark.slow
def test_what_yielded_before_is_as_it_was_after_a_refusal():
    """An answer that is refused because surfaces touch in it leaves what elements remember, too."""
    sim = stamp("mixed", 3e-4)
    equilibrium.solve_elastic(sim)
    before = {name: diagnostics.values(sim, name) for name in (*STRESSES, *MEMORY)}
    top = np.flatnonzero((sim.mesh.points[:, 1] > 1.0 - 1e-9) & (sim.mesh.points[:, 0] < 0.7))
    sim.velocity_condition(top, vx=0.0, vy=-1.5)
    refused(sim, "did not converge|inverted|singular")
    for name, values in before.items():
        assert np.array_equal(diagnostics.values(sim, name), values), name


def test_refusals():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    sim.velocity_condition([0, 1, 2], vx=0.0, vy=0.0)
    sim.option(dynamic=False, collision=False)
    refused(sim, "steps must be positive, got 0", steps=0)


@pytest.mark.slow
def test_what_creeps_beside_what_yields():
    """A column under a load that it just bears; its lower half creeps, spreads and draws the upper one apart, which
    begins to yield: the same in creep steps at once as by relaxation."""
    both = []
    for at_once in (True, False):
        sim = Blocks()
        sim.take_mesh(shaken(rectangle(3, 4, 1.0, 1.0), 0.2))
        low = np.flatnonzero(sim.mesh.centroids()[:, 1] < 0.5)
        changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, "tensile": 1e9, "dilation": 30.0})
        soft = {"density": 2000.0, "young": 6.8e9, "poisson_ratio": 0.2, "maxwell_viscosity": 1e15}
        changes.element_model(sim, low, "mech_burgers", soft)
        sim.option(dynamic=False, collision=False, large_strain=False)
        y = sim.mesh.points[:, 1]
        sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
        sim.stress_condition(near(sim.mesh, 1, 1.0), normal=-0.95 * K)
        creep.switch(sim, True, dt=1e4)
        equilibrium.solve_elastic(sim)
        began = diagnostics.values(sim, "plastic_shear_strain").max()
        for _ in range(20):
            creep.begin(sim, 2e5)
            equilibrium.solve_elastic(sim) if at_once else convergence.solve(sim, ratio=1e-8)
            creep.finish(sim, 2e5)
        both.append(sim)
    assert sim.creep.time == 2e5 and diagnostics.values(both[0], "plastic_shear_strain").max() > 1e-5 > began
    assert farthest(*both, (*STRESSES, "plastic_shear_strain", "creep_strain_yy")) < 0.01
