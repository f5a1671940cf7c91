"""Periodic sides of discs: pairs across them, conservation, ranks, restart, packing, mean stress, frames, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import (
    bonds,
    clumps,
    cycles,
    flexure,
    history,
    output,
    particles,
    properties,
    queries,
    settings,
    surface,
    walls,
)
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, HpcdemError, ScriptError, UsageError
from hpcdem.core.selection import Group, Ids, Interval
from hpcdem.io.frames import read_frame
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem import diagnostics, mean_stress, periodic, saved_state
from hpcdem.physics.dem.platens import OF_PARTS
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.diffusion.model import Diffusion
from hpcdem.post import strain_stress
from hpcdem.post.measure.grains import grains
from hpcdem.post.view.moment import read_moment
from tests.cases.periodic import exact
from tests.conftest import ROOT, Launcher
from tests.pretended import Ranks
from tests.support import force, model, steps, value

LENGTH = 4.0
BENDS = "WALL id 5 nodes (0.2, 0.0) (0.8, 0.0)\nFLEXURE wall id 5 rigidity 1e6 contrast 500.0"


def pair(folder, at: float, apart: float, length: float = LENGTH, left: float = 0.0) -> Simulation:
    """Two discs of radius 0.1, the first at `at` from the left side, the second `apart` to its right, past the side if
    need be; they slide and spin."""
    sim = model(folder, 1e-5)
    walls.periodic(sim, (left, left + length))
    for gid, x in enumerate((at, at + apart)):
        particles.ball(sim, gid, left + x % length, 0.03 * gid, 0.1)
    properties.prop(sim, density=2000.0, kn=1e6, ks=5e5, fric=0.5)
    properties.prop(sim, Ids(0, 0), yv=0.7, spin=3.0)
    properties.prop(sim, Ids(1, 1), xv=-0.4, spin=-1.0)
    cycles.prepare(sim)
    return steps(sim, 5)


@pytest.mark.parametrize("left", [0.0, -3.7, 1000.123, 0.1])
def test_a_pair_across_the_sides_has_the_forces_of_one_inside(tmp_path, left):
    """Opposite to the last bit, also where the sides are no round numbers."""
    length = 4.0 / 3.0
    inside, across = (pair(tmp_path, at, 0.19, length, left) for at in (0.5, length - 0.07))
    for sim in (inside, across):
        assert np.array_equal(force(sim, 0)[:2], -force(sim, 1)[:2]) and np.hypot(*force(sim, 0)[:2]) > 100.0
        assert diagnostics.survey(sim).contacts == 1
    assert force(across, 0) == pytest.approx(force(inside, 0), rel=3e-9 * max(1.0, abs(left)))
    assert across.lists.n_pairs == 2 * inside.lists.n_pairs == 2  # this rank is on both sides of it


def gas(folder, shift: float = 0.0, speed: float = 2.0) -> Simulation:
    """Discs without friction that cross the sides, in a mean flow."""
    sim = model(folder, 1e-4)
    walls.periodic(sim, (shift, LENGTH + shift))
    x, y = (places.ravel() for places in np.meshgrid(0.3 * np.arange(13) + 0.05, 0.3 * np.arange(5)))
    particles.add(sim, np.column_stack([x + shift, y, np.full(len(x), 0.1)]), 0, 0)
    properties.prop(sim, density=2000.0, kn=1e6, ks=5e5)
    random = np.random.default_rng(4).normal(size=(2, len(x)))
    sim.particles["vx"][:], sim.particles["vy"][:] = speed + random[0], random[1]
    cycles.prepare(sim)
    return sim


def by_id(sim, *names) -> np.ndarray:
    order = np.argsort(sim.particles["gid"])
    return np.stack([sim.particles[name][order] for name in names], axis=1)


def momentum(sim) -> np.ndarray:
    p, mass = sim.particles, sim.body[:, 0]
    return np.array([math.fsum(mass * p["vx"]), math.fsum(mass * p["vy"])])


def test_momentum_and_energy_stay_while_a_gas_goes_round(tmp_path):
    """Momentum of springs without friction drifts by rounding only, energy by the time step; the mean flow goes
    round once, and each disc is where its velocity has brought it."""
    sim = gas(tmp_path, 0.1, 10.0)
    before, energy = momentum(sim), output.HISTORIES["energy"][1](sim)
    begun = by_id(sim, "x", "y")
    middle = begun[:, 0].mean()
    steps(sim, 4000)
    scale = sim.body[:, 0].sum()
    assert np.abs(momentum(sim) - before).max() < 2e-12 * scale
    assert output.HISTORIES["energy"][1](sim) == pytest.approx(energy, rel=1e-3)
    x, laps = by_id(sim, "x", "laps").T
    assert laps.min() <= 0.0 and laps.max() >= 1.0 and laps.sum() > 30
    moved = (x + LENGTH * laps).mean() - middle
    assert moved == pytest.approx(before[0] / scale * 0.4, abs=1e-9)


def test_a_shift_of_the_whole_model_changes_rounding_only(tmp_path):
    here, there = gas(tmp_path), gas(tmp_path, 1.23456789)
    for sim, shift in ((here, 0.0), (there, 1.23456789)):
        sim.particles["x"][:] = np.round(sim.particles["x"] - shift, 10) + shift
        steps(sim, 60)
    assert by_id(there, "vx", "vy") == pytest.approx(by_id(here, "vx", "vy"), abs=1e-11)


# ---- ranks, threads, restart -----------------------------------------------------------------------------------------


def flowing(comm, threads: int = 1) -> Simulation:
    """A layer on a rough bed, half of it bonded with a moment, that flows on a slope: friction, rolling, dashpots."""
    sim = Simulation(comm, threads, outdir=Path("unused"))
    for name, given in {"dt": 1e-4, "gravity": (6.0, -8.0), "restitution": 0.6}.items():
        settings.set_option(sim, name, given)
    walls.box(sim, 0.0, 3.0, 0.0, 2.0, kn=1e6, ks=1e6, fric=0.5)
    walls.periodic(sim, (0.0, 3.0))
    particles.gline(sim, (0.05, 0.1), (2.96, 0.1), 0.05, group="bed")
    properties.fix(sim, ("x", "y", "spin"), where=Group("bed"))
    particles.gen_grid(sim, [0.06, 0.075], (0.0, 3.0), (0.2, 0.95))
    properties.prop(sim, density=2000.0, kn=1e6, ks=5e5, fric=0.5, rfric=0.1)
    properties.prop(sim, Interval("y", 0.15, 2.0), xv=5.0)
    properties.prop(sim, Interval("x", 0.5, 1.0), yv=-1.0)
    bonds.bond(
        sim, Interval("y", 0.5, 2.0), ebmod=1e7, gbmod=1e7, tstrength=4e5, sstrength=4e5, tolerate=0.04, moment=True
    )
    cycles.prepare(sim)
    return sim


def finished(sim, until: int = 700) -> tuple:
    steps(sim, until - sim.clock.step)
    cycles.prepare(sim)
    stress = tuple(mean_stress.mean(sim, name, (0.1, 0.6)) for name in mean_stress.COMPONENTS)
    laps = int(sim.count(int(np.abs(sim.particles[periodic.LAPS]).sum())))
    found = diagnostics.fingerprint(sim), stress, sim.bonds_left(), sim.broken(), laps, diagnostics.survey(sim)
    sim.release()
    return found


def test_bits_do_not_depend_on_ranks_threads_and_restarts(tmp_path):
    """One rank is its own neighbour; of two each is the neighbour of the other on both sides."""
    whole = finished(flowing(SerialComm()))
    assert whole[4] >= 10 and sum(whole[3]) > 5 and whole[2] > 5
    assert finished(flowing(SerialComm(), 2)) == whole
    for ranks in (2, 3, 4):
        assert Ranks(ranks).run(lambda comm, threads=1 + ranks % 2: finished(flowing(comm, threads))) == [whole] * ranks
    begun = steps(flowing(SerialComm()), 333)
    saved_state.save(begun, tmp_path / "middle.sav")

    def resumed(comm) -> tuple:
        sim = Simulation(comm, 1, outdir=Path("unused"))
        saved_state.restore(sim, tmp_path / "middle.sav")
        return finished(sim)

    assert resumed(SerialComm()) == whole
    assert Ranks(2).run(resumed) == [whole] * 2


def test_more_ranks_than_columns_are_refused():
    def refused(comm) -> str:
        with pytest.raises(UsageError) as error:
            flowing(comm)
        return str(error.value)

    assert all("ranks fit; start it with fewer" in text for text in Ranks(18).run(refused))


# ---- packing, bonds, heat --------------------------------------------------------------------------------------------


def test_random_packing_fills_the_sides_like_the_middle(tmp_path):
    """Discs lie across the sides, none overlap, and the strip there is as full as any other."""
    sim = model(tmp_path)
    walls.periodic(sim, (0.0, 3.0))
    particles.gen(sim, 5000, [0.04, 0.05], (0.0, 3.0), (0.0, 6.0))
    particles.gen(sim, 5000, [0.01], (2.5, 3.0), (0.0, 6.0))  # beside the sides, around the discs that lie across
    properties.prop(sim, density=1.0, kn=1.0, ks=1.0)
    cycles.prepare(sim)
    assert diagnostics.survey(sim).contacts == 0
    x, r = sim.particles["x"], sim.particles["radius"]
    large = r > 0.02
    assert (large & ((x < r) | (x > 3.0 - r))).sum() > 40
    strips = [
        np.pi * (r[large & (np.abs((x - at + 1.5) % 3.0 - 1.5) < 0.15)] ** 2).sum() / 1.8 for at in np.arange(0, 3, 0.3)
    ]
    assert strips[0] == pytest.approx(np.mean(strips), abs=3.0 * np.std(strips[1:])) and min(strips) > 0.4


def chain(folder, gap: float, number: int = 12, strength: float = 1e6, modulus: float = 1e8) -> Simulation:
    """A closed chain of discs of radius 0.1 with open bonds, at rest."""
    length = number * (0.2 + gap)
    sim = model(folder, 1e-5)
    walls.periodic(sim, (0.0, length))
    x = (np.arange(number) + 0.25) * (0.2 + gap)
    particles.add(sim, np.column_stack([x, np.zeros(number), np.full(number, 0.1)]), 0, 0)
    properties.prop(sim, density=2000.0, kn=1e6, ks=1e6)
    made = bonds.bond(sim, ebmod=modulus, gbmod=modulus, tstrength=strength, sstrength=strength, tolerate=1.001 * gap)
    assert made == number
    cycles.prepare(sim)
    return steps(sim, 1)


@pytest.mark.parametrize(("part", "holds"), [(0.99, True), (1.01, False)])
def test_a_closed_chain_pulls_and_breaks_at_its_strength(tmp_path, part, holds):
    gap = part * exact.breaking_gap(1e8, 1e6, 0.1)
    sim = chain(tmp_path, gap)
    assert sim.bonds_left() == (12 if holds else 0) and sim.broken() == ((0, 0) if holds else (12, 0))
    expected = -exact.tension(1e8, 0.1, gap) / 2.0 if holds else 0.0
    assert mean_stress.mean(sim, "sxx", (-1.0, 1.0)) == pytest.approx(expected, rel=1e-9)
    assert np.abs(sim.lists.owned_forces()).max() < 1e-6  # every disc is pulled from both sides


def test_bonds_across_the_sides_survive_laps(tmp_path):
    sim = chain(tmp_path, 1e-5)
    properties.prop(sim, xv=30.0)
    steps(sim, 9000)
    cycles.prepare(sim)
    assert sim.bonds_left() == 12 and sim.particles["laps"].min() >= 1.0
    assert np.ptp(sim.particles["vx"]) < 1e-8 and sim.rebuilds > 20


def test_heat_goes_round(tmp_path):
    sim = chain(tmp_path, 1e-5)
    sim.add_physics(Diffusion(3.0, 2.0))
    number = np.cos(2.0 * np.pi * sim.particles["gid"] / 12.0)
    sim.particles["temperature"][:] = number
    bonds.break_bonds(sim)
    properties.prop(sim, kn=0.0)
    sim.particles["radius"][:] = 0.1 + 2e-5
    capacity = 2.0 * 2000.0 * np.pi * 0.10002**2
    cycles.prepare(sim)
    steps(sim, 100)
    wave = np.cos(2.0 * np.pi * sim.particles["gid"] / 12.0)
    factor = exact.decay(3.0, capacity, 1e-5, 12) ** 100
    assert sim.particles["temperature"] == pytest.approx(factor * wave, abs=1e-12) and 1.0 - factor > 1e-7


# ---- mean stress -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def layer(tmp_path_factory):
    """A dense layer at rest on the floor of BOX, under gravity that is inclined by atan(1/8)."""
    sim = model(tmp_path_factory.mktemp("layer"), 2e-4, gravity=(1.0, -8.0))
    walls.box(sim, 0.0, 3.0, 0.0, 2.0, kn=1e7, ks=1e7, fric=1.0)
    walls.periodic(sim, (0.0, 3.0))
    x, row = (places.ravel() for places in np.meshgrid(0.15 * np.arange(20), np.arange(7)))
    y = 0.075 + 0.075 * math.sqrt(3.0) * row
    particles.add(sim, np.column_stack([(x + 0.075 * row) % 3.0, y, np.full(len(x), 0.075)]), 0, 0)
    properties.prop(sim, density=2000.0, kn=1e7, ks=1e7, fric=0.8, damp=0.7)
    history.hist(sim, 1, 1000, "syy")
    cycles.cycle(sim, 4000)
    return sim


def test_stress_of_a_layer_is_its_weight(layer):
    weight = 8.0 * layer.body[:, 0]
    for low, high in ((0.0, 2.0), (0.0, 0.3), (0.31, 0.6), (0.9, 1.0)):
        expected = exact.weight_stress(weight, layer.particles["y"], low, high, 3.0)
        found = queries.stress(layer, (low, high))
        assert found["syy"] == pytest.approx(expected, rel=2e-3)
        assert found["sxy"] == pytest.approx(-expected / 8.0, rel=1e-2)
    floor = queries.wall_force(layer, 100)
    assert floor[1] / 3.0 == pytest.approx(-math.fsum(weight) / 3.0, rel=1e-3)
    assert floor[0] / floor[1] == pytest.approx(-1.0 / 8.0, rel=1e-2)
    history.hist(layer, 2, 1, "ystress wall 100")
    assert OF_PARTS["ystress"].value(layer, "ystress wall 100", 2) == pytest.approx(math.fsum(weight) / 3.0, rel=1e-3)
    rows = (layer.outdir / "hist_1.csv").read_text().splitlines()
    assert "syy [Pa]" in rows[0]
    assert float(rows[-1].split(",")[2]) == pytest.approx(
        exact.weight_stress(weight, layer.particles["y"], 0.0, 2.0, 3.0), rel=2e-3
    )


def test_frames_hold_places_between_the_sides_and_continuous_ones(tmp_path):
    sim = gas(tmp_path, speed=10.0)
    output.Snapshot(sim, initial=True).write_print()
    begun = by_id(sim, "x").ravel()
    steps(sim, 1501)
    output.Snapshot(sim).write_print()
    path = tmp_path / "all_0000001501.vtkhdf"
    frame = read_frame(path)
    p = frame.tables["particles"].columns
    assert (
        frame.settings["period"] == LENGTH == frame.settings["right"] and p["x"].min() >= 0.0 and p["x"].max() < LENGTH
    )
    x, laps = by_id(sim, "x", "laps").T
    assert p["x"] + LENGTH * p["laps"] == pytest.approx(x + LENGTH * laps, abs=1e-12) and p["laps"].max() > 0.0
    moved = read_moment(path).objects["particles"].vectors["displacement"]
    assert moved[:, 0] == pytest.approx(x + LENGTH * laps - begun, abs=1e-12)
    text = read_frame(path.with_suffix(".dat"))
    assert text.settings["period"] == LENGTH
    read = grains(path)
    assert (read.side, read.period) == (0.0, LENGTH) and np.array_equal(read.laps, p["laps"][np.argsort(p["gid"])])
    with pytest.raises(HpcdemError, match=r"does not contain the crossings of the particles .laps.; measure frames"):
        grains(path.with_suffix(".dat"))
    with pytest.raises(HpcdemError, match="periodic"):
        strain_stress.read_snapshot(path, strain_stress.Options(tmp_path, 0.5))


def test_a_range_takes_particles_by_their_place_between_the_sides(tmp_path):
    sim = pair(tmp_path, LENGTH - 1e-7, 0.5)
    properties.prop(sim, Ids(0, 0), xv=1.0)
    steps(sim, 1)
    assert value(sim, "x") > LENGTH or value(sim, "laps") == 1.0
    assert properties.chosen(sim, Interval("x", 0.0, 0.1)).sum() == 1


@pytest.mark.slow
@pytest.mark.nightly
def test_the_example_flows_as_its_caption_says(launch: Launcher, tmp_path):
    launch(2, "--outdir", tmp_path, ROOT / "examples" / "chute.py")
    columns = []
    for name in ("all_0000020000_ini.vtkhdf", "all_0000070000.vtkhdf"):
        p = read_frame(tmp_path / name).tables["particles"].columns
        order = np.argsort(p["gid"])
        columns.append({key: p[key][order] for key in ("x", "y", "vx", "laps", "fix")})
    before, now = columns
    moved = now["x"] - before["x"] + 4.0 * (now["laps"] - before["laps"])
    assert len(moved) == 769 and not moved[now["fix"] > 0].any() and (now["laps"] > 0).sum() > 150
    layers = [moved[(now["y"] >= low) & (now["y"] < low + 0.3)].mean() for low in (0.1, 0.4, 0.7, 1.0, 1.3)]
    assert (np.diff(layers) > 0.0).all() and now["y"].max() < 1.7


# ---- what is refused -------------------------------------------------------------------------------------------------


def test_what_cannot_act_is_refused(tmp_path):
    sim = model(tmp_path)
    walls.box(sim, 0.0, 4.0, 0.0, 2.0)
    for wrong, text in (
        ((0.0, 3.0), "^x must be the sides of BOX"),
        ((4.0, 0.0), "^left must be below right"),
        ((0.0, math.inf), "PERIODIC"),
    ):
        with pytest.raises(CommandError, match=text):
            walls.periodic(sim, wrong)
    particles.ball(sim, 0, 5.0, 1.0, 0.1)
    with pytest.raises(CommandError, match="outside the periodic sides"):
        walls.periodic(sim, (0.0, 4.0))
    particles.delete(sim)
    walls.wall(sim, 7, ((1.0, 0.5), (3.95, 0.5)))
    walls.periodic(sim, (0.0, 4.0))
    assert sim.walls.id.tolist() == [100, 102, 7] and sim.walls.around.tolist() == [True, True, False]
    with pytest.raises(CommandError, match="already"):
        walls.periodic(sim, (0.0, 4.0))
    with pytest.raises(CommandError, match="must precede PERIODIC"):
        walls.box(sim, 0.0, 4.0, 0.0, 2.0)
    with pytest.raises(CommandError, match="outside the periodic sides"):
        particles.ball(sim, 1, -0.1, 1.0, 0.1)
    particles.ball(sim, 1, 0.5, 1.0, 0.1)
    particles.ball(sim, 2, 2.0, 1.0, 0.1)
    with pytest.raises(CommandError, match="clumps do not support"):
        clumps.join(sim, Ids(1, 2))
    properties.prop(sim, density=1.0, kn=1.0, ks=1.0)
    with pytest.raises(CommandError, match=r"wall 7 reaches from x = 1 to 3\.95"):
        cycles.cycle(sim, 1)
    walls.wall(sim, 7, delete=True)
    particles.ball(sim, 3, 2.0, 1.0, 0.7)
    properties.prop(sim, density=1.0, kn=1.0, ks=1.0)
    with pytest.raises(CommandError, match="at least 3 times the reach"):
        cycles.cycle(sim, 1)


@pytest.mark.parametrize("left", [-137.3517, 0.1, 1234.567])
def test_a_floor_with_the_ends_of_the_sides_spans_them(tmp_path, left):
    """Although the sides are rounded, some away from its ends."""
    for first in (True, False):
        sim = model(tmp_path)
        for k, right in enumerate(left + np.linspace(1.1, 97.3, 41)):
            sim.clear()
            if first:
                walls.wall(sim, 7, ((left, 0.0), (right, 0.0)))
            walls.periodic(sim, (left, right))
            if not first:
                walls.wall(sim, 7, ((left, 0.0), (right, 0.0)))
            assert sim.walls.around.tolist() == [True], k


def test_surface_processes_are_refused(tmp_path):
    sim = gas(tmp_path)
    surface.surface(sim, 1, interval=10, erode=0.1, above=1.0)
    with pytest.raises(CommandError, match="SURFACE 1 does not support periodic sides"):
        surface.check(sim)


def test_a_base_that_bends_is_refused(tmp_path):
    """In both orders; ended by off it excludes nothing."""
    sim = model(tmp_path)
    sim.settings.gy = -10.0
    walls.wall(sim, 5, ((1.0, 0.0), (3.0, 0.0)))
    flexure.flexure(sim, 5, rigidity=1e6, contrast=500.0)
    with pytest.raises(CommandError, match="PERIODIC does not support FLEXURE, and wall 5 bends"):
        walls.periodic(sim, (0.0, LENGTH))
    flexure.flexure(sim, 5, off=True)
    walls.periodic(sim, (0.0, LENGTH))
    walls.wall(sim, 6, ((1.0, 1.0), (3.0, 1.0)))
    with pytest.raises(CommandError, match="FLEXURE does not support periodic sides"):
        flexure.flexure(sim, 6, rigidity=1e6, contrast=500.0)
    script = f"START\n{BENDS}\nFLEXURE wall id 5 off\nPERIODIC x (0.0, 1.0)\nSTOP\n"
    parse_text(script, "script.py")


def test_mean_stress_needs_periodic_sides_and_heights(tmp_path):
    sim = model(tmp_path)
    with pytest.raises(CommandError, match="needs periodic sides"):
        history.hist(sim, 1, 1, "sxx")
    walls.periodic(sim, (0.0, 1.0))
    with pytest.raises(CommandError, match="range of y, or BOX"):
        history.hist(sim, 1, 1, "sxx")


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ("PERIODIC x (2.0, 1.0)", "is above the upper bound"),
        ("PERIODIC x (0.0, 1.0)\nPERIODIC x (0.0, 1.0)", "already"),
        ("PERIODIC x (0.0, 1.0)\nBOX left 0 right 1 bottom 0 height 1", "must precede PERIODIC"),
        ("PERIODIC x (0.0, 1.0)\nCLUMP group a RANGE id 1 2", "clumps do not support"),
        ("CLUMP group a RANGE id 1 2\nPERIODIC x (0.0, 1.0)", r"script\.py:3: .*clumps do not support"),
        (f"{BENDS}\nPERIODIC x (0.0, 1.0)", r"script\.py:4: .*bases that bend \(FLEXURE\) do not support periodic"),
        (f"PERIODIC x (0.0, 1.0)\n{BENDS}", r"script\.py:4: .*bases that bend \(FLEXURE\) do not support periodic"),
    ],
)
def test_scripts_are_refused_before_the_run(lines, text):
    with pytest.raises(ScriptError, match=text):
        parse_text(f"START\n{lines}\nSTOP\n", "script.py")
