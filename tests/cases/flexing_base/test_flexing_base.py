"""FLEXURE: discs on a wall or a row that an elastic plate carries, compared with closed forms and with the plate alone.

Small enough for a second: a base of 100 m, a flexural parameter of 10 m. Closed forms: Turcotte & Schubert,
Geodynamics, ch. 3; Hetenyi.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, flexure, history, particles, properties, settings, walls
from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Group
from hpcdem.physics.dem import diagnostics, saved_state
from hpcdem.physics.dem.flexing_base import Base
from hpcdem.physics.dem.simulation import Simulation
from tests.support import model, only

R, G, DENSITY, CONTRAST, ALPHA = 0.5, 10.0, 2500.0, 3e4, 10.0
K = CONTRAST * G
PLATE = {"rigidity": ALPHA**4 * K / 4.0, "contrast": CONTRAST, "interval": 200, "speed": 0.5}
WEIGHT = DENSITY * math.pi * R * R * G
ROW = Group("base")


def empty(folder: Path, row: bool = False, half: float = 50.0) -> Simulation:
    """A horizontal base from -half to half at y = 0."""
    sim = model(folder, 2e-3, gravity=(0.0, -G), disk="on")
    if row:
        particles.gline(sim, (R - half, -R), (half, -R), R, group="base")
        properties.fix(sim, ("x", "y", "spin"), where=ROW)
    else:
        walls.wall(sim, 1, ((-half, 0.0), (half, 0.0)), kn=1e7, ks=1e7, fric=0.3)
    return sim


def load(sim: Simulation, x: np.ndarray) -> None:
    """Discs at these x, which move up and down only."""
    first = sim.next_gid
    for at in x.tolist():
        particles.ball(sim, sim.next_gid, at, 0.999 * R, R, group="load")
    properties.prop(sim, None, density=DENSITY, kn=1e7, ks=1e7, damp=0.7)
    properties.fix(sim, ("x", "spin"), where=Group("load"))
    assert sim.next_gid == first + len(x)


def base_of(sim: Simulation) -> Base:
    assert len(sim.bases) == 1
    return sim.bases[0]


def deflection(sim: Simulation) -> np.ndarray:
    """Of the nodes under the base, as the base is."""
    base = base_of(sim)
    return base.now(sim.clock.step)[base.nodes, 0]


def hetenyi(x: np.ndarray, half: float, q: float) -> np.ndarray:
    """Deflection of an infinite plate under a uniform load from -half to half."""

    def part(distance: np.ndarray) -> np.ndarray:
        s = np.abs(distance) / ALPHA
        return np.sign(distance) * (1.0 - np.exp(-s) * np.cos(s))

    return q / (2.0 * K) * (part(x + half) - part(x - half))


@pytest.mark.parametrize("row", [False, True], ids=["wall", "row"])
def test_a_row_of_discs_is_a_uniform_load(tmp_path, row):
    """Static equilibrium: the base carries the weight of the discs, the fluid the base, in the shape of Hetenyi."""
    sim = empty(tmp_path, row)
    load(sim, np.arange(-10.0, 11.0))
    flexure.flexure(sim, *((None, ROW) if row else (1,)), **PLATE)
    cycles.cycle(sim, 3000)
    base, weight = base_of(sim), 21 * WEIGHT
    assert base.loads[:, ::2].sum() == pytest.approx(weight, rel=1e-4)
    assert base.plate(sim).buoyancy(base.now(sim.clock.step)) == pytest.approx(weight, rel=1e-3)
    expected = hetenyi(base.x, 10.5, WEIGHT / (2.0 * R))
    assert np.abs(deflection(sim) - expected).max() < (0.01 if row else 1e-3) * expected.max()
    if row:
        p = sim.particles
        mine = np.isin(p["gid"], base.row)
        np.testing.assert_allclose(-R - p["y"][mine], np.interp(p["x"][mine], base.x, deflection(sim)), atol=1e-4)
    else:
        w = sim.walls
        rows = w.parts(1)
        assert (w.p2[rows[:-1]] == w.p1[rows[1:]]).all()
        np.testing.assert_allclose(-w.p1[rows, 1], deflection(sim)[:-1], atol=1e-9)
        assert float(diagnostics.wall_forces(sim)[rows, 1].sum()) == pytest.approx(-weight, rel=1e-4)


def test_wall_and_row_bend_alike(tmp_path):
    found = []
    for row in (False, True):
        sim = empty(tmp_path, row)
        load(sim, np.arange(-10.0, 11.0) + (0.5 if row else 0.0))  # on tops of discs of the row
        flexure.flexure(sim, *((None, ROW) if row else (1,)), **PLATE)
        cycles.cycle(sim, 3000)
        found.append(deflection(sim))
    x = np.linspace(-50.0, 50.0, len(found[0]))
    np.testing.assert_allclose(np.interp(x + 0.5, x, found[1])[:-5], found[0][:-5], atol=3e-3 * found[0].max())


@pytest.mark.parametrize(
    ("ends", "w0", "bulge"), [({}, 1.0 / 8.0, (math.pi, -0.0432)), ({"left": "broken"}, 1.0 / 2.0, (2.3562, -0.0670))]
)
def test_line_load_of_one_disc(tmp_path, ends, w0, bulge):
    """V alpha^3 / (8 D) on an infinite plate, forebulge at pi alpha; on the end of a broken one V alpha^3 / (2 D): V is
    half of the load of both halves in the book."""
    sim = empty(tmp_path)
    load(sim, np.array([0.0 if not ends else -50.0]))
    properties.prop(sim, None, density=20.0 * DENSITY)
    flexure.flexure(sim, 1, segments=200, **PLATE, **ends)
    cycles.cycle(sim, 3000)
    base = base_of(sim)
    expected = w0 * 20.0 * WEIGHT * ALPHA**3 / base.rigidity
    assert deflection(sim).max() == pytest.approx(expected, rel=5e-3)
    highest = int(np.argmin(deflection(sim)))
    assert deflection(sim)[highest] == pytest.approx(bulge[1] * expected, rel=0.02)
    start = 0.0 if not ends else -50.0
    assert abs(abs(base.x[highest] - start) - bulge[0] * ALPHA) <= 0.5


def heap(folder: Path, row: bool = False, **options: object) -> Simulation:
    """A heap of discs with friction that has come to rest, and then a base that gives way."""
    sim = empty(folder, row, 30.0)
    walls.box(sim, -30.0, 30.0, -5.0, 30.0, kn=1e7)
    particles.gen_grid(sim, rad=[0.4, 0.5], x=(-8.0, 8.0), y=(0.0, 5.0), group="load")
    properties.prop(sim, None, density=DENSITY, kn=1e7, ks=1e7, fric=0.5, damp=0.7)
    properties.fix(sim, ("spin",), where=Group("load"))  # no disc rolls away slowly
    flexure.flexure(sim, *((None, ROW) if row else (1,)), **{**PLATE, **options})
    return sim


def test_a_heap_is_in_equilibrium_with_its_base(tmp_path):
    """The shape is that of the plate alone under the measured contact forces, which are the weight of the heap."""
    sim = heap(tmp_path, interval=400)
    history.hist(sim, 4, 500, "deflection")
    cycles.cycle(sim, 7000)
    base = base_of(sim)
    p = sim.particles
    weight = float((DENSITY * math.pi * p["radius"] ** 2 * G).sum())
    assert base.loads[:, ::2].sum() == pytest.approx(weight, rel=0.01)
    out, _ = diagnostics.wall_rows(sim)
    plate = base.plate(sim)
    expected = plate.solve(plate.loads(out[:, diagnostics.AT_X], out[:, diagnostics.FORCE_Y]))[base.nodes, 0]
    assert np.abs(deflection(sim) - expected).max() < 0.01 * expected.max()
    assert plate.buoyancy(base.now(sim.clock.step)) == pytest.approx(weight, rel=0.01)
    last = (tmp_path / "hist_4.csv").read_text().splitlines()[-1].split(",")
    assert float(last[2]) == deflection(sim).max()
    rows = [line.split(",") for line in (tmp_path / "flexure.csv").read_text().splitlines()]
    assert rows[0] == flexure.COLUMNS.split(",")
    of_end = np.array([[float(word) for word in row[3:]] for row in rows[1:] if row[0] == "7000"])
    np.testing.assert_array_equal(of_end[:, 0], base.x)
    np.testing.assert_array_equal(of_end[:, 1], deflection(sim))
    walls_csv = [line.split(",") for line in (tmp_path / "walls.csv").read_text().splitlines()]
    assert [row[2] for row in walls_csv if row[0] == "7000"] == ["100", "101", "102", "103", "1"]
    assert float(walls_csv[-1][-1]) == pytest.approx(-weight, rel=0.01)


def test_a_compensated_load_bends_nothing(tmp_path):
    sim = empty(tmp_path)
    load(sim, np.arange(-10.0, 11.0))
    cycles.cycle(sim, 600)
    flexure.flexure(sim, 1, compensated=True, **PLATE)
    cycles.cycle(sim, 1000)
    assert np.abs(deflection(sim)).max() < 1e-5
    for at in (-0.5, 0.5):
        particles.ball(sim, sim.next_gid, at, R + R * math.sqrt(3.0) - 0.01, R, group="load")
    properties.prop(sim, Group("load"), density=DENSITY, kn=1e7, ks=1e7, damp=0.7)
    properties.fix(sim, ("x", "spin"), where=Group("load"))
    cycles.cycle(sim, 3000)
    line = 2.0 * WEIGHT * ALPHA**3 / (8.0 * base_of(sim).rigidity)
    assert deflection(sim).max() == pytest.approx(line, rel=0.02)


def test_a_constant_load_and_the_speed_of_the_base(tmp_path):
    sim = empty(tmp_path)
    load(sim, np.array([-5.0]))
    flexure.flexure(sim, 1, x=(-80.0, 90.0), left="clamped", right="free", load=(5.0, 4e5), **{**PLATE, "speed": 0.05})
    cycles.cycle(sim, 800)
    assert deflection(sim).max() == pytest.approx(0.05 * 3 * 0.2, rel=1e-6)  # three intervals, in half of each 0.2 s
    cycles.cycle(sim, 6000)
    base, expected = base_of(sim), np.zeros(len(deflection(sim)))
    for at, force in ((5.0, 4e5), (-5.0, WEIGHT)):
        s = np.abs(base.x[base.nodes] - at) / ALPHA
        expected += force * ALPHA**3 / (8.0 * base.rigidity) * np.exp(-s) * (np.cos(s) + np.sin(s))
    np.testing.assert_allclose(deflection(sim), expected, atol=0.01 * expected.max())


@pytest.mark.parametrize("row", [False, True], ids=["wall", "row"])
def test_resumed_in_the_middle_of_an_interval(tmp_path, row):
    """Saved while the base moves, and while it is sampled; lists are rebuilt in between."""
    sim = heap(tmp_path / "whole", row)
    cycles.cycle(sim, 1250)
    expected = diagnostics.fingerprint(sim), base_of(sim).state()
    assert deflection(sim).max() > 1e-3
    for middle in (630, 777):
        first = heap(tmp_path / "first", row)
        cycles.cycle(first, middle)
        saved_state.save(first, tmp_path / "middle.sav")
        second = Simulation(outdir=tmp_path / "second")
        saved_state.restore(second, tmp_path / "middle.sav")
        cycles.cycle(second, 1250 - middle)
        assert (diagnostics.fingerprint(second), base_of(second).state()) == expected


def test_contacts_continue_when_the_wall_becomes_a_polyline(tmp_path):
    """Shear forces and sides of the contacts at the wall stay as they were; off keeps the base as it is."""
    sim = empty(tmp_path)
    load(sim, np.arange(-10.0, 11.0))
    properties.free(sim, ("x",), where=Group("load"))
    properties.prop(sim, Group("load"), xv=0.05, fric=0.3)
    cycles.cycle(sim, 300)
    before, ids = diagnostics.wall_rows(sim)
    flexure.flexure(sim, 1, **PLATE)
    sim.close_model()
    after, ids_after = diagnostics.wall_rows(sim)
    assert np.abs(before[:, 1]).max() > 0.0
    order, order_after = np.argsort(ids[:, 0]), np.argsort(ids_after[:, 0])
    np.testing.assert_array_equal(after[order_after], before[order])
    cycles.cycle(sim, 1000)
    shape = sim.walls.p1.copy()
    flexure.flexure(sim, 1, off=True)
    cycles.cycle(sim, 500)
    assert not sim.bases
    np.testing.assert_array_equal(sim.walls.p1, shape)
    walls.wall(sim, 1, fric=0.1)
    assert (sim.walls.fric == 0.1).all() and len(sim.walls) > 40
    walls.wall(sim, 1, nodes=((-50.0, 0.0), (50.0, 0.0)))
    assert len(sim.walls) == 1


REFUSED = {
    "either a wall or": {"wall": None},
    "contrast must be above 0, got 0": {"contrast": 0.0},
    "contrast must be above 0, got None": {"contrast": None},
    "rigidity must be above 0, got -1": {"rigidity": -1.0},
    "give either rigidity, or young and te": {"rigidity": None},
    "either rigidity, or young": {"young": 7e10},
    "te must be above 0, got None": {"rigidity": None, "young": 7e10},
    "poisson must be above -1": {"rigidity": None, "young": 7e10, "te": 10.0, "poisson": 0.5},
    "left must be free, broken, clamped, fixed, infinite, got loose": {"left": "loose"},
    "does not contain the base from -50 to 50 m": {"x": (-40.0, 90.0)},
    "too long for 2000 nodes": {"x": (-1e6, 90.0)},
    "the load at 60 m lies outside": {"load": (60.0, 1e6)},
    "interval must be at least 4": {"interval": 3},
    "relax must be above 0 and at most 1, got 1.5": {"relax": 1.5},
    "speed must be above 0, got 0": {"speed": 0.0},
    "needs at least 40": {"segments": 10},
    "there is no wall with id 7": {"wall": 7},
    "side of BOX, which cannot bend": {"wall": 100},
    "from (0, 1) to (1, 2) is not horizontal": {"wall": 2},
    "wall 3 has a velocity": {"wall": 3},
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_cannot_act_is_refused(tmp_path, text):
    sim = empty(tmp_path)
    walls.box(sim, -50.0, 50.0, -5.0, 20.0)
    walls.wall(sim, 2, ((0.0, 1.0), (1.0, 2.0)))
    walls.wall(sim, 3, ((0.0, 1.0), (10.0, 1.0)), xv=1.0)
    with pytest.raises(CommandError) as refused:
        flexure.flexure(sim, **{"wall": 1, **PLATE, **REFUSED[text]})
    assert text in str(refused.value)
    assert "FLEXURE: " not in str(refused.value)  # the command is named by the language
    assert not sim.bases and len(sim.walls) == 7


def test_a_row_that_cannot_bend_is_refused(tmp_path):
    sim = empty(tmp_path, row=True)
    load(sim, np.array([0.0]))
    with pytest.raises(CommandError, match="1 particles of the row are not fixed in x and y, the first has id 100"):
        flexure.flexure(sim, None, ROW | Group("load"), **PLATE)
    properties.prop(sim, only(3), yv=0.1)
    with pytest.raises(CommandError, match="1 particles of the row move already, the first has id 3"):
        flexure.flexure(sim, None, ROW, **PLATE)
    with pytest.raises(CommandError, match="at least two particles; the selection contains 1"):
        flexure.flexure(sim, None, only(4), **PLATE)
    properties.prop(sim, only(3), yv=0.0)
    flexure.flexure(sim, None, ROW, **PLATE)
    with pytest.raises(CommandError, match=r"the row of 100 particles at y = -0\.5 m bends already"):
        flexure.flexure(sim, None, only(4) | only(5), **PLATE)
    properties.free(sim, ("y",), where=only(8))
    with pytest.raises(CommandError, match=r"step 100: 1 particles of the row .* were deleted or freed in y"):
        cycles.cycle(sim, 500)
    flexure.flexure(sim, None, ROW, off=True)
    held = (sim.particles["gid"] < 100) & (sim.particles["gid"] != 8)
    assert not sim.bases and (sim.particles["vy"][held] == 0.0).all()
    cycles.cycle(sim, 10)


@pytest.mark.parametrize("gone", [only(8), ROW], ids=["one", "all"])
def test_a_row_of_which_particles_were_deleted_can_be_ended(tmp_path, gone):
    sim = empty(tmp_path, row=True)
    load(sim, np.array([0.0]))
    flexure.flexure(sim, None, ROW, **PLATE)
    cycles.cycle(sim, 250)
    particles.delete(sim, gone)
    with pytest.raises(CommandError, match="FLEXURE off ends it"):
        cycles.cycle(sim, 500)
    flexure.flexure(sim, None, ROW, off=True)
    assert not sim.bases
    cycles.cycle(sim, 10)


def test_a_history_of_deflection_continues_after_the_last_base_has_ended(tmp_path):
    sim = empty(tmp_path)
    load(sim, np.array([0.0]))
    flexure.flexure(sim, 1, **PLATE)
    history.hist(sim, 1, 100, "deflection")
    cycles.cycle(sim, 400)
    flexure.flexure(sim, 1, off=True)
    cycles.cycle(sim, 200)
    values = [float(line.split(",")[-1]) for line in (tmp_path / "hist_1.csv").read_text().splitlines()[1:]]
    assert len(values) == 6 and values[3] > 0.0 and np.isnan(values[4:]).all()


def test_commands_on_a_base_that_bends(tmp_path):
    sim = empty(tmp_path)
    load(sim, np.array([0.0]))
    with pytest.raises(CommandError, match="no base bends yet; give FLEXURE first"):
        history.hist(sim, 1, 10, "deflection")
    flexure.flexure(sim, 1, **PLATE)
    for change in ({"yv": 1.0}, {"nodes": ((0.0, 0.0), (1.0, 0.0))}, {"delete": True}):
        with pytest.raises(CommandError, match="wall 1 bends on an elastic plate"):
            walls.wall(sim, 1, **change)
    with pytest.raises(CommandError, match=r"wall 105 is a segment of wall 1, .* ids 104 to \d+; choose another"):
        walls.wall(sim, 105, fric=0.2)
    with pytest.raises(CommandError, match="wall 1 bends already"):
        flexure.flexure(sim, 1, **PLATE)
    settings.set_option(sim, "energy", 10)
    with pytest.raises(CommandError, match="does not support a wall that bends"):
        cycles.cycle(sim, 10)
    settings.set_option(sim, "energy", 0)
    settings.set_option(sim, "gravity", (0.0, 0.0))
    with pytest.raises(CommandError, match="needs gravity that points down"):
        cycles.cycle(sim, 10)
    settings.set_option(sim, "gravity", (0.0, -G))
    walls.box(sim, -60.0, 60.0, -1e-4, 20.0)
    with pytest.raises(CommandError, match=r"wall 1 sinks to .* below the bottom of the BOX at -0\.0001 m"):
        cycles.cycle(sim, 500)
