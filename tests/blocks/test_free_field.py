"""Earthquakes from below: waves that come in through a quiet base, between free-field sides, against plane waves.

A vertical wave v(t) below a uniform half space moves its surface by 2 v, one travel time later. On ground with a soft
layer (height H, impedance z = rho c) on rock (z_r) the surface moves, over a free surface of the rock, by
1 / sqrt(cos^2 kH + (z / z_r)^2 sin^2 kH), k = omega / c (Kramer 1996, section 7.2.1).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.free_field import FreeField
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import near, rectangle
from tests.blocks.test_user_laws import law

ROCK = {"density": 2200.0, "young": 2.6e9, "poisson_ratio": 0.3}
SOIL = {"density": 1800.0, "young": 0.2e9, "poisson_ratio": 0.25}
WIDTH, HEIGHT = 24.0, 20.0
AMPLITUDE = 0.01
SLOW = pytest.mark.slow


def speeds(ground: dict[str, float]) -> tuple[float, float]:
    """c_p and c_s [m/s]."""
    e, nu, rho = ground["young"], ground["poisson_ratio"], ground["density"]
    return math.sqrt(e * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * rho)), math.sqrt(e / (2 * (1 + nu) * rho))


def ricker(t: float, f: float) -> float:
    a = (math.pi * f * (t - 1.2 / f)) ** 2
    return AMPLITUDE * (1.0 - 2.0 * a) * math.exp(-a)


def ground(
    sides: str, wave: str = "x", f: float = 40.0, layer: float = 0.0, kind: str = "cross", width: float = WIDTH, **o
) -> Blocks:
    """Rock, with soil above the last `layer` metres; a Ricker pulse of f [Hz] comes in from below, if any."""
    sim = Blocks(**o)
    sim.take_mesh(rectangle(round(width), round(HEIGHT), width, HEIGHT, kind=kind))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    top = np.flatnonzero(sim.mesh.centroids()[:, 1] > HEIGHT - layer)
    if len(top):
        changes.element_model(sim, top, "mech_iso_elastic", SOIL)
    sim.option(collision=False)
    sim.stress_condition(near(sim.mesh, 1, 0.0), quiet=True)
    if wave:
        sim.table("wave", [(t, ricker(t, f)) for t in np.linspace(0.0, 2.4 / f, 400)] + [(1e3, 0.0)])
        sim.stress_condition(near(sim.mesh, 1, 0.0), **{f"incoming_{wave}": "wave"})
    both = np.concatenate([near(sim.mesh, 0, 0.0), near(sim.mesh, 0, width)])
    if sides == "free field":
        FreeField.create(sim, both)
    elif sides == "quiet":
        sim.stress_condition(both, quiet=True)
    elif sides == "held":
        sim.velocity_condition(np.flatnonzero(np.isin(sim.mesh.points[:, 0], (0.0, width))), vx=0.0, vy=0.0)
    return sim


def surface(sim: Blocks, time: float, every: int = 1, axis: str = "x") -> tuple[np.ndarray, np.ndarray]:
    """Velocities (steps, 3) [m/s] of the surface at the left side, in the middle and halfway to the right; times."""
    x, y = sim.mesh.points.T
    width = x.max()
    at = [np.flatnonzero((np.abs(x - place) < 1e-9) & (y == y.max()))[0] for place in (0.0, width / 2, 0.75 * width)]
    found, times = [], []
    while sim.clock.time < time:
        convergence.advance(sim, every)
        found.append(diagnostics.values(sim, f"velocity_{axis}", at))
        times.append(sim.clock.time - 0.5 * sim.clock.dt)
    return np.array(found), np.array(times)


@pytest.mark.parametrize(
    ("wave", "kind"),
    [("y", "quad"), *(pytest.param(*one, marks=SLOW) for one in (("x", "quad"), ("x", "cross"), ("y", "cross")))],
)
def test_the_surface_of_a_half_space_moves_by_twice_the_wave(wave, kind):
    """S and P waves of 40 elements: within 1.5 %, at the sides as in the middle; other sides lose half of it."""
    c = speeds(ROCK)[0 if wave == "y" else 1]
    f = c / 40.0
    for sides in ("free field", "held", "free", "quiet"):
        sim = ground(sides, wave, f, kind=kind)
        v, times = surface(sim, 2.4 / f + 1.5 * HEIGHT / c, 2, wave)
        wrong = np.abs(v - np.array([2.0 * ricker(t - HEIGHT / c, f) for t in times])[:, None]).max(axis=0)
        if sides == "free field":
            assert (wrong < 0.015 * 2.0 * AMPLITUDE).all()
            assert np.abs(v - v[:, :1]).max() < (0.01 if kind == "cross" else 1e-5) * 2.0 * AMPLITUDE
        else:
            assert wrong.max() > 0.4 * 2.0 * AMPLITUDE


@SLOW
@pytest.mark.parametrize("part", [None, "both"])
def test_amplification_of_a_soft_layer(part):
    """Spectra of the surface over those of a free surface of rock, 2 v, from 3 to 15 Hz; damped: with the complex wave
    numbers of the layer and the rock (Kelvin and Voigt), whose wave is the weaker by the way through the rock."""
    layer, f = 8.0, 12.0
    sim = ground("free field", "x", f, layer, "quad", width=4.0)
    if part:
        sim.rayleigh(0.05, 10.0, part)
    sim.step()
    every = 4
    v, times = surface(sim, 1.6, every)
    assert np.abs(v - v[:, :1]).max() < 1e-4 * np.abs(v).max()
    w = 2.0 * math.pi * np.linspace(3.0, 15.0, 25)
    kernel = np.exp(-1j * w[:, None] * times)
    found = np.abs(kernel @ v[:, 1]) / np.abs(kernel @ [2.0 * ricker(t, f) for t in times])
    o = sim.options

    def medium(rock: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Wave number [1/m] and impedance: rho w^2 (1 - i alpha / w) = mu (1 + i beta w) k^2."""
        mu, rho = rock["density"] * speeds(rock)[1] ** 2, rock["density"]
        stiff, mass = mu * (1.0 + 1j * w * o.stiffness_damping), rho * (1.0 - 1j * o.mass_damping / w)
        return w * np.sqrt(mass / stiff), np.sqrt(mass * stiff)

    (k, z), (k_r, z_r) = medium(SOIL), medium(ROCK)
    z_base = ROCK["density"] * speeds(ROCK)[1]  # dashpots of the base, in which there is no damping
    a, b = np.cos(k * layer), -np.sin(k * layer) * z  # u and stress / (w u_top) at the top of the rock
    h = HEIGHT - layer
    u = a * np.cos(k_r * h) + b / z_r * np.sin(k_r * h)
    s = -a * z_r * np.sin(k_r * h) + b * np.cos(k_r * h)  # tau / w at the base
    exact = np.abs(1.0 / (u + s / (1j * z_base)))
    if not part:
        plain = 1.0 / np.sqrt(np.cos(k.real * layer) ** 2 + (z.real / z_r.real) ** 2 * np.sin(k.real * layer) ** 2)
        assert exact == pytest.approx(plain, rel=1e-6)
        assert exact.max() > 3.8
    assert found == pytest.approx(exact, rel=0.04)


@SLOW
def test_little_of_a_source_in_the_middle_comes_back():
    """A shear pulse in the middle against a model five times as wide, until its own sides are heard: some 8 % of the
    peak, as of quiet sides, which dashpots are; from sides that are held more than came."""
    f = 60.0

    def shaken_in_the_middle(sides: str, width: float = WIDTH) -> np.ndarray:
        sim = ground(sides, "", f, width=width)
        sim.table("pulse", [(t, 1e6 * ricker(t, f)) for t in np.linspace(0.0, 2.4 / f, 300)] + [(1e3, 0.0)])
        x, y = sim.mesh.points.T
        sim.force_condition(np.flatnonzero(np.abs(x - width / 2) < 0.1), fy="pulse")
        seen = [np.flatnonzero((np.abs(x - width / 2 - dx) < 1e-9) & (np.abs(y - 10.0) < 1e-9))[0] for dx in (0.0, 8.0)]
        sim.time_step(value=4e-5)
        found = []
        while sim.clock.time < 0.075:
            convergence.advance(sim, 10)
            found.append(diagnostics.values(sim, "velocity_y", seen))
        return np.array(found)

    wide = shaken_in_the_middle("free field", 5.0 * WIDTH)
    found = {sides: shaken_in_the_middle(sides) for sides in ("free field", "quiet", "held")}
    back = {sides: (np.abs(v - wide).max(axis=0) / np.abs(wide).max(axis=0)).max() for sides, v in found.items()}
    assert back["free field"] < 0.1 and back["held"] > 1.0
    # Dashpots of quiet faces see the present length and normal of a face, the others that of the mesh.
    assert found["free field"] == pytest.approx(found["quiet"], rel=0.0, abs=1e-5 * np.abs(wide).max())


def test_a_rigid_base_leads_the_columns_too():
    """Fixed in y and led in x, no quiet faces: the damped layer vibrates the same at the sides; by acceleration too."""
    for what in ("vx", "ax"):
        sim = ground("", "", kind="quad")
        sim.remove_stress_conditions(None)
        base = np.flatnonzero(sim.mesh.points[:, 1] < 1e-9)
        size = 1.0 if what == "vx" else 2.0 * math.pi * 20.0
        sim.table("shake", [(t, size * 0.01 * math.sin(2.0 * math.pi * 20.0 * t)) for t in np.linspace(0.0, 0.2, 400)])
        sim.velocity_condition(base, vy=0.0, **{what: "shake"})
        sim.rayleigh(0.05, 20.0)
        FreeField.create(sim, np.concatenate([near(sim.mesh, 0, 0.0), near(sim.mesh, 0, WIDTH)]))
        v, _ = surface(sim, 0.15, 5)
        assert np.abs(v).max() > 0.015
        assert np.abs(v - v[:, :1]).max() < 1e-4 * np.abs(v).max()


def test_a_model_at_rest_under_its_weight_stays_at_rest():
    """A static stage between rollers, then free-field sides in their place: what moves is rounding."""
    sim = ground("", "", kind="cross")
    x, y = sim.mesh.points.T
    sides, base = np.flatnonzero((x < 1e-9) | (x > WIDTH - 1e-9)), np.flatnonzero(y < 1e-9)
    sim.stress_condition(near(sim.mesh, 1, 0.0), quiet=False)
    sim.gravity(0.0, -9.81)
    sim.velocity_condition(sides, vx=0.0)
    sim.velocity_condition(base, vy=0.0)
    sim.option(dynamic=False)
    assert convergence.solve(sim, ratio=1e-9).reason == "ratio"
    fallen = np.abs(diagnostics.values(sim, "displacement_y")).max()
    sim.option(dynamic=True)
    sim.remove_conditions(sides)
    sim.velocity_condition(base, vx=0.0, vy=0.0)
    FreeField.create(sim, np.concatenate([near(sim.mesh, 0, 0.0), near(sim.mesh, 0, WIDTH)]))
    before = diagnostics.values(sim, "position_x")
    convergence.solve(sim, time=0.2)
    assert np.abs(diagnostics.values(sim, "position_x") - before).max() < 1e-6 * fallen
    FreeField.remove(sim, sim.numbers_of_faces(None))
    convergence.solve(sim, time=0.2)
    assert np.abs(diagnostics.values(sim, "position_x") - before).max() > 1e-2 * fallen


def test_energy_and_restart(tmp_path):
    """What comes in through base and sides is work from outside; both halves of a run give the bits of the whole."""
    sim = ground("free field", "x", 30.0, 8.0)
    diagnostics.account_energy(sim)
    convergence.advance(sim, 300)
    saved_state.save(sim, tmp_path / "a.sav")
    found = diagnostics.energies(sim)
    assert found["work_outside"] > 0.0 and found["relative"] < 1e-4
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 300)
    for name in ("velocity_x", "velocity_y", "position_x"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(again, name))
    assert diagnostics.energies(sim) == diagnostics.energies(again)
    for one in (sim, again):
        changes.reset_velocity(one)
        assert not FreeField.there(one).nodes["v"].any()


def test_sides_can_come_and_go_one_by_one():
    sim = ground("free field")
    left, right = near(sim.mesh, 0, 0.0), near(sim.mesh, 0, WIDTH)
    with pytest.raises(CommandError, match="can only be removed completely"):
        FreeField.remove(sim, left[1:])
    FreeField.remove(sim, left)
    assert set(FreeField.there(sim).faces["face"][:, 0]) == set(right)
    assert (FreeField.there(sim).faces["low"][:, 0] == np.arange(len(right))).all()
    sim.step()
    FreeField.create(sim, left)
    with pytest.raises(CommandError, match="already"):
        FreeField.create(sim, left[:3])
    sim.step()
    FreeField.remove(sim, np.concatenate([left, right]))
    assert FreeField.there(sim) is None


def test_what_cannot_act_is_refused():
    sim = ground("")
    base, left = near(sim.mesh, 1, 0.0), near(sim.mesh, 0, 0.0)
    with pytest.raises(CommandError, match="not vertical"):
        FreeField.create(sim, base)
    with pytest.raises(CommandError, match="not on the surface"):
        FreeField.create(sim, near(sim.mesh, 0, 5.0, inner=True))
    with pytest.raises(CommandError, match="needs faces"):
        FreeField.create(sim, left[:0])
    with pytest.raises(CommandError, match="through quiet faces only"):
        sim.stress_condition(left, incoming_x=1.0)
    with pytest.raises(CommandError, match="through quiet faces only"):
        sim.stress_condition(base, quiet=False)
    FreeField.create(sim, left)
    points = sim.mesh.points
    lowest, middle = (int(np.flatnonzero((points[:, 0] == 0.0) & (points[:, 1] == h))[0]) for h in (0.0, 5.0))
    element = int(left[3] // 4)

    def refused(told: str, do, undo) -> None:
        do()
        with pytest.raises(CommandError, match=told):
            sim.step()
        undo()
        sim.step()

    nothing = {"incoming_x": 0.0, "incoming_y": 0.0}
    refused(
        rf"above node {lowest} has no base in x",
        lambda: sim.stress_condition(base, quiet=False, **nothing), lambda: sim.stress_condition(base, quiet=True),
    )  # fmt: skip
    refused("fixed in x", lambda: sim.velocity_condition([middle], vx=0.0), lambda: sim.remove_conditions([middle]))
    refused("but must move along x or y", lambda: sim.move_constraint([lowest], 2, (1.0, 1.0)),
            lambda: sim.remove_conditions([lowest]))  # fmt: skip
    refused("is quiet too", lambda: sim.stress_condition(left[:1], quiet=True),
            lambda: sim.remove_stress_conditions(left[:1]))  # fmt: skip
    refused("mass-scaling 0", lambda: sim.time_step(mass_scaling=1e-3), lambda: sim.time_step(mass_scaling=0.0))
    refused("need a dynamic run", lambda: sim.option(dynamic=False), lambda: sim.option(dynamic=True))
    limit = {**ROCK, "limit": 1e6}
    refused("has a user law", lambda: changes.element_model(sim, [element], law(sim, "tresca"), limit),
            lambda: changes.element_model(sim, [element], "mech_iso_elastic", ROCK))  # fmt: skip
    changes.null(sim, np.array([element]))
    with pytest.raises(CommandError, match="was removed"):
        sim.step()
    still = ground("")
    still.option(dynamic=False)
    with pytest.raises(CommandError, match="use model option dynamic on first"):
        FreeField.create(still, left)
