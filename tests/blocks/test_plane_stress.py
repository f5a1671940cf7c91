"""Plates in plane stress: the return of stresses, closed forms of each law, at rest and in motion, what is refused."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium
from hpcdem.physics.fdem.elements.tangent import plane_slopes
from hpcdem.physics.fdem.kernels import plasticity
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, ROCK, model, near, rectangle, shaken
from tests.blocks.test_creep import SALT, compliance, crept, width
from tests.blocks.test_creep import body as salt
from tests.blocks.test_plasticity import FLOWS, MohrCoulomb, constants
from tests.blocks.test_user_laws import law
from tests.blocks.test_yielding import SOIL, deform, stresses

E, NU = ROCK["young"], ROCK["poisson_ratio"]


def plane(rock: MohrCoulomb) -> tuple[float, ...]:
    """`constants` with lambda' in the place of lambda."""
    *strengths, lame, two_mu = constants(rock)
    return *strengths, lame * two_mu / (lame + two_mu), two_mu


# ---- the return of stresses ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rock", FLOWS.values(), ids=FLOWS)
def test_the_end_is_on_the_surface_and_what_flows_is_that_of_its_planes(rock):
    """Of random stresses: no plane is passed at the end, and the plastic strain, that across the plane too, is a sum of
    the flows of the planes it lies on, by multipliers that are not negative (Koiter)."""
    n, m, k, t, lame, two_mu = constants_ = plane(rock)
    rng, met = np.random.default_rng(5), set()
    for size in (3e5, 3e6, 3e7):
        for s11, s22, s12 in rng.normal(size=(200, 3)) * [size, size, 0.5 * size]:
            e11, e22, e12, e33, how = plasticity.plane_stress_strain(s11, s22, s12, 0.0, *constants_)
            p = lame * (e11 + e22)
            s = np.array([[s11 - p - two_mu * e11, s12 - two_mu * e12], [0.0, s22 - p - two_mu * e22]])
            s[1, 0] = s[0, 1]
            (low, high), axes = np.linalg.eigh(s)
            r, tiny = np.array([high, low, 0.0]), 1e-9 * (size + k)
            e = axes.T @ np.array([[e11, e12], [e12, e22]]) @ axes
            flows, beyond = [], [r.max() - t]
            for i in range(3):
                if abs(r[i] - t) < 1e2 * tiny:
                    flows.append(np.eye(3)[i])
                for j in range(3):
                    if i != j:
                        beyond.append(n * r[i] - r[j] - k)
                        if abs(beyond[-1]) < 1e2 * tiny:
                            flows.append(m * np.eye(3)[i] - np.eye(3)[j])
            assert max(beyond) < tiny
            if how == 0.0:
                assert (e11, e22, e12, e33) == (0.0, 0.0, 0.0, 0.0)
                continue
            strain = np.array([e[1, 1], e[0, 0], e33])
            rest = scipy.optimize.nnls(np.array(flows).T, strain)[1]
            assert rest < 1e-6 * np.abs(strain).max()
            met.add((how, len(flows)))
    assert len(met) >= 2


def test_uniaxial_and_biaxial_strength():
    """2 c sqrt(N) in compression, along one axis and along both, as the third stress is 0; T, or 2 c / sqrt(N), in
    tension."""
    n, _, k, _, lame, two_mu = plane(FLOWS["usual"])
    for t, tension in ((0.5e6, 0.5e6), (1.7e6, k / n)):
        args = n, n, k, min(t, k / n), lame + two_mu, lame
        low, high, _ = plasticity.plane_stress_return(-3.0 * k, -3.0 * k, *args)
        assert (low, high) == (-k, -k)
        low, high, _ = plasticity.plane_stress_return(2.0 * tension, 3.0 * tension, *args)
        assert (low, high) == (tension, tension)


@pytest.mark.parametrize("rock", [FLOWS["usual"], FLOWS["up to the apex"], FLOWS["auxetic"]])
def test_slopes_of_the_return(rock):
    """By central differences, on all sides and corners."""
    n, m, k, t, lame, two_mu = plane(rock)
    k, t, a, b = k / 1e6, t / 1e6, (lame + two_mu) / 1e9, lame / 1e9
    rng, slopes, met = np.random.default_rng(2), np.empty((3, 3)), set()
    for low, high in np.sort(rng.normal(size=(600, 2)) * 8.0, axis=1):
        met.add(plane_slopes(low, high, n, m, k, t, a, b, slopes)[2])
        for j, (d_low, d_high) in enumerate(((1e-7, 0.0), (0.0, 1e-7))):
            ends = [
                plasticity.plane_stress_return(low + s * d_low, high + s * d_high, n, m, k, min(t, k / n), a, b)[:2]
                for s in (1.0, -1.0)
            ]
            found = (np.array(ends[0]) - np.array(ends[1])) / 2e-7
            assert [slopes[0, 2 * j], slopes[2, 2 * j]] == pytest.approx(found.tolist(), abs=1e-5)
    assert len(met) == 6


# ---- closed forms --------------------------------------------------------------------------------------------------


def plate(kind: str = "cross", name: str = "mech_iso_elastic", **values: float) -> Blocks:
    """A plate of a square metre in plane stress."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(4, 4, 1.0, 1.0, kind=kind), 0.2))
    changes.element_model(sim, None, name, values or ROCK)
    sim.option(plane_stress=True, collision=False)
    return sim


def pulled(sim: Blocks, xx: float = 0.0, yy: float = 0.0) -> Blocks:
    """On rollers on the left and below, with these stresses on the right and on top, in balance."""
    x, y = sim.mesh.points.T
    sim.option(dynamic=False)
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.stress_condition(near(sim.mesh, 0, 1.0), xx=xx)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=yy)
    equilibrium.solve_elastic(sim)
    return sim


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("name", ["mech_iso_elastic", "mech_mohr_coulomb", "mech_burgers"])
def test_uniaxial_stress(kind, name):
    """E along it, -nu across it, nothing across the plane; the energy is that of the work."""
    strong = {"cohesion": 1e12, "tensile": 1e12} if name == "mech_mohr_coulomb" else {}
    sim = plate(kind, name, **ROCK, **strong, **({"maxwell_viscosity": 1e20} if name == "mech_burgers" else {}))
    sim.option(large_strain=False)
    pulled(sim, yy=-1e6)
    assert width(sim) == pytest.approx([NU * 1e6 / E, -1e6 / E], rel=1e-5)  # the load follows its face
    assert stresses(sim)[:, 3].tolist() == [0.0] * len(sim.number)
    assert stresses(sim) == pytest.approx(np.tile([0.0, -1e6, 0.0, 0.0], (len(sim.number), 1)), abs=10.0)
    assert diagnostics.total(sim, "strain_energy") == pytest.approx(0.5e12 / E, rel=2e-5)


@EVERY_KIND
def test_strength_of_a_plate(kind):
    """Squeezed along both axes it bears 2 c sqrt(N) along each, whatever the dilation; pulled so 2 c / sqrt(N)."""
    n, root = 3.0, math.sqrt(3.0)
    rock = {**SOIL, "cohesion": 1e6, "friction": 30.0, "dilation": 10.0, "tensile": 1.7e6}
    for way, bears in ((-1.0, -2e6 * root), (1.0, 2e6 * root / n)):
        sim = plate(kind, "mech_mohr_coulomb", **rock)
        sim.option(dynamic=False, large_strain=False)
        deform(sim, np.diag([1.0 + way * 0.01, 1.0 + way * 0.01]))
        assert stresses(sim) == pytest.approx(np.tile([bears, bears, 0.0, 0.0], (len(sim.number), 1)), abs=1.0)
        # e33 of a pair of shear planes: -N_psi of those of the plane, or -1 / N_psi
        m = math.tan(math.pi / 4.0 + math.radians(5.0)) ** 2
        elastic = bears * (3.0 * SOIL["bulk"] + 4.0 * SOIL["shear"]) / (18.0 * SOIL["bulk"] * SOIL["shear"])
        flowed = 2.0 * (way * 0.01 - elastic)
        volume = flowed * (1.0 - m) if way < 0.0 else flowed * (1.0 - 1.0 / m)
        assert diagnostics.values(sim, "plastic_volume_strain") == pytest.approx(
            np.full(len(sim.number), volume), rel=1e-6
        )


@pytest.mark.parametrize("kind", [pytest.param("cross", marks=pytest.mark.slow), "quad"])
def test_a_footing_at_rest_is_that_of_relaxation(kind):
    """On half of the top of a plate, in small stages: static solve and steps. (A load put on at once swings beyond its
    end in relaxation, and what flows then stays: 5 % of the stress.)"""
    rock = {**SOIL, "cohesion": 1e6, "friction": 25.0, "dilation": 5.0, "tensile": 1e6}
    found = []
    for at_once in (True, False):
        sim = plate(kind, "mech_mohr_coulomb", **rock)
        sim.option(dynamic=False, large_strain=False)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] < 1e-9), vx=0.0, vy=0.0)
        top = near(sim.mesh, 1, 1.0)
        top = top[sim.mesh.centroids()[top // 4, 0] < 0.5]
        for stage in range(1, 9):
            sim.stress_condition(top, yy=-2e6 - 1e5 * stage)
            if at_once:
                assert equilibrium.solve_elastic(sim, steps=4).ratio < 1e-8
            else:
                assert convergence.solve(sim, ratio=1e-7, cycles=20000).reason == "ratio"
        found.append(stresses(sim))
        assert diagnostics.values(sim, "plastic_shear_strain").max() > 1e-5
    assert np.abs(found[0] - found[1]).max() < 1e-3 * np.abs(found[1]).max()


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("time", [2e4, 1e5])
def test_uniaxial_creep(kind, time):
    """p (1 / (9 K) + J(t) / 3) along the stress, p (1 / (9 K) - J(t) / 6) across it."""
    sim = salt(kind)
    sim.option(plane_stress=True, large_strain=False)
    pulled(sim, yy=-5e6)
    crept(sim, time, 40)
    j, k = compliance(time), 1.0 / (9.0 * SALT["bulk"])
    assert width(sim) == pytest.approx([-5e6 * (k - j / 6.0), -5e6 * (k + j / 3.0)], rel=5e-4)
    assert np.abs(stresses(sim)[:, 3]).max() == 0.0


def hole(sigma: float, **options: float) -> tuple[Blocks, np.ndarray]:
    """A ring of quads around a hole of 1 m, its outer nodes where Kirsch's plate under sigma along x has them, and the
    displacements (n, 2) of that plate: kappa = (3 - nu) / (1 + nu) in plane stress, 3 - 4 nu in plane strain."""
    rings, parts = 16, 48
    radius = 1.0 * 4.0 ** (np.arange(rings + 1) / rings)
    angle = 2.0 * math.pi * np.arange(parts) / parts
    points = np.array([(r * math.cos(a), r * math.sin(a)) for r in radius for a in angle])
    cells = [
        (i * parts + j, (i + 1) * parts + j, (i + 1) * parts + (j + 1) % parts, i * parts + (j + 1) % parts)
        for i in range(rings) for j in range(parts)
    ]  # fmt: skip
    sim = model(Mesh.of(points, cells))
    sim.option(collision=False, dynamic=False, large_strain=False, **options)
    mu, kappa = E / (2.0 * (1.0 + NU)), (3.0 - NU) / (1.0 + NU) if options else 3.0 - 4.0 * NU
    r, a = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    c, s = np.cos(2.0 * a), np.sin(2.0 * a)
    u_r = r * (kappa - 1.0 + 2.0 * c) + 2.0 / r * (1.0 + (kappa + 1.0) * c) - 2.0 / r**3 * c
    u_a = -2.0 * r * s + 2.0 / r * (1.0 - kappa) * s - 2.0 / r**3 * s
    u = sigma / (8.0 * mu) * np.column_stack([u_r * np.cos(a) - u_a * np.sin(a), u_r * np.sin(a) + u_a * np.cos(a)])
    outer = np.flatnonzero(r > 4.0 - 1e-9)
    sim.velocity_condition(outer, vx=0.0, vy=0.0)
    sim.open_model()
    sim.x[:, :8] = (points + u)[sim.mesh.cells[sim.number]].reshape(-1, 8)
    changes.repeat(sim, sim.x)
    equilibrium.solve_elastic(sim)
    return sim, u


@pytest.mark.parametrize("stress", [True, False], ids=["plane stress", "plane strain"])
def test_displacements_around_a_hole(stress):
    """Kirsch, 1898."""
    sim, u = hole(1e6, **({"plane_stress": True} if stress else {}))
    wall = np.arange(48)
    found = np.column_stack([diagnostics.values(sim, f"displacement_{axis}", wall) for axis in "xy"])
    assert np.abs(found - u[wall]).max() < 0.01 * np.abs(u[wall]).max()


def test_a_cantilever_approaches_the_beam():
    """Load at the end: w = P L^3 / (3 E I) + 1.2 P L / (G A); what is missing falls with the square of the size."""
    length, height, load, missing = 1.0, 0.1, 1e3, []
    beam = load * length**3 / (3.0 * E * height**3 / 12.0) + 1.2 * load * length / (E / 2.5 * height)
    for n in (2, 4):
        mesh = rectangle(10 * n, n, length, height, kind="quad")
        sim = model(mesh)
        sim.option(dynamic=False, collision=False, plane_stress=True)
        x, y = mesh.points.T
        sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0, vy=0.0)
        end = np.flatnonzero(x > length - 1e-9)
        for node in end:
            outer = y[node] < 1e-9 or y[node] > height - 1e-9
            sim.force_condition([node], fy=-load / (n * (2 if outer else 1)))
        equilibrium.solve_elastic(sim)
        missing.append(1.0 + float(diagnostics.values(sim, "displacement_y", end).mean()) / beam)
    assert 0.0 < missing[1] < 0.1 and missing[0] / missing[1] == pytest.approx(4.0, rel=0.25)


def test_a_bar_rings_at_the_speed_of_a_plate():
    """The time step is that of the modulus E / (1 - nu^2), with mass and damping as they are."""
    steps = []
    for stress in (False, True):
        sim = model(shaken(rectangle(4, 4, 1.0, 1.0), 0.2))
        sim.option(plane_stress=stress, collision=False)
        sim.close_model()
        sim.step()
        steps.append(sim.clock.dt)
    wave = (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)) * (1.0 - NU**2)
    assert steps[1] / steps[0] == pytest.approx(math.sqrt(wave), rel=1e-12)


# ---- motion --------------------------------------------------------------------------------------------------------


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("name", ["mech_mohr_coulomb", "mech_burgers"])
def test_the_energy_account_closes(kind, name):
    """A plate swings and flows, or creeps, with small strains."""
    own = (
        {"cohesion": 1e5, "friction": 20.0, "dilation": 5.0, "tensile": 1e5} if name == "mech_mohr_coulomb"
        else {"maxwell_viscosity": 4e7, "kelvin_shear": 4e8, "kelvin_viscosity": 2e7}
    )  # fmt: skip
    sim = plate(kind, name, density=2500.0, young=1e9, poisson_ratio=0.25, **own)
    sim.option(large_strain=False)
    sim.time_step(safety=0.3)
    if name == "mech_burgers":
        creep.switch(sim, True)
    diagnostics.account_energy(sim)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 0.99), 1.0, 2.0)
    given = diagnostics.energies(sim)["kinetic"]
    convergence.advance(sim, 600)
    found = diagnostics.energies(sim)
    assert found["plastic_lost"] + found["creep_lost"] > 0.05 * given
    assert found["relative"] < (0.01 if name == "mech_mohr_coulomb" else 1e-11), found
    assert (stresses(sim)[:, 3] == 0.0).all()


# ---- what is refused -----------------------------------------------------------------------------------------------


def test_what_comes_too_late_or_cannot_be():
    sim = plate()
    with pytest.raises(CommandError, match=r"stress zz of 1e\+06 Pa cannot be in plane stress.*omit stress-zz"):
        sim.initial_stress(None, xx=-1e6, zz=1e6)
    sim.initial_stress(None, xx=-1e6, yy=-2e6)
    sim.close_model()
    assert (diagnostics.values(sim, "stress_zz") == 0.0).all()
    with pytest.raises(CommandError, match="model plane-strain must precede element initial"):
        sim.option(plane_stress=False)
    other = plate()
    other.step()
    with pytest.raises(CommandError, match="model plane-strain must precede the first step"):
        other.option(plane_stress=False)


def test_a_law_of_the_user_gives_no_stress_across_the_plane():
    """One that does is refused by name; one that is made for plane stress acts."""
    sim = plate()
    changes.element_model(sim, None, law(sim, "elastic"), ROCK)
    with pytest.raises(
        CommandError, match=r"law rock.py:elastic gives a stress s33 of .* Pa.*in plane stress it must be 0"
    ):
        sim.close_model()
    sim = plate()
    changes.element_model(sim, None, law(sim, "flat"), ROCK)
    sim.option(dynamic=False)
    x, y = sim.mesh.points.T
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=-1e6)
    convergence.solve(sim, ratio=1e-7, cycles=5000)
    assert width(sim) == pytest.approx([NU * 1e6 / E, -1e6 / E], rel=1e-4)


def test_moduli_of_plane_stress() -> None:
    """K_n = 9 K G / (3 K + 4 G), with which E and nu of the solid are those of the plate; zero where both are."""
    rows = SimpleNamespace(column=lambda name: {"bulk": [0.0, 3e9], "shear": [0.0, 2e9]}[name])
    for plate, lame in ((False, 3e9 - 4e9 / 3.0), (True, 54e18 / 17e9 - 2e9)):
        found = moduli(rows, plate)
        assert found.lame == pytest.approx([0.0, lame]) and found.wave == pytest.approx([0.0, lame + 4e9])
        assert found.shear.tolist() == [0.0, 2e9] and found.normal == ([0, 1] if plate else [0, 1, 3])
    young, nu = 54e18 / 11e9, (9e9 - 4e9) / 22e9
    assert found.bulk[1] == pytest.approx(young / (2.0 * (1.0 - nu)))
