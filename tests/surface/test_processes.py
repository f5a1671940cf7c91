"""SURFACE on particles: what it does to the surface, and its balance."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import pytest

from hpcdem.commands.dem import checkpoints, clumps, cycles, particles, properties, settings, surface, walls
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.selection import Group
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.numerics import landscape
from hpcdem.runtime.progress import Log
from tests.clumped import write_lattice
from tests.support import model
from tests.surface.support import SAND, assert_adds_up, basin, heights

WIDTH, STEP = 120.0, 60.0
K = 20.0


@pytest.fixture(scope="module")
def scarp(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A checkpoint: a step from 20 m to 10 m, filled in layers by two processes."""
    folder = tmp_path_factory.mktemp("scarp")
    sim = basin(folder, WIDTH)
    surface.surface(sim, 1, 100, x=(0.0, STEP), below=20.0, group="high", **SAND)
    surface.surface(sim, 2, 100, x=(STEP, WIDTH), below=10.0, group="low", **SAND)
    cycles.cycle(sim, 1500)
    for ident, level, ends in ((1, 20.0, slice(1, 13)), (2, 10.0, slice(17, 29))):
        assert_adds_up(sim, ident)
        seen = surface.balance(sim, ident)  # at the cliff, discs slide down and are replaced
        assert seen["discs_settling"] < 0.1 * seen["discs_deposited"]
        _, h, owed = heights(sim, ident, WIDTH)
        assert owed[ends].mean() == pytest.approx(level, abs=0.3)  # a sixth of a disc
        surface.surface(sim, ident, off=True)
    assert set(sim.groups) == {"***", "high", "low"}
    checkpoints.save(sim, folder / "scarp.sav")
    return str(folder / "scarp.sav")


def restored(scarp: str, folder):
    sim = model(folder)
    checkpoints.restore(sim, scarp)
    return sim


def test_a_scarp_of_particles_diffuses(scarp: str, tmp_path) -> None:
    """Its surface follows the diffusion of the one at the beginning, and the error function, within a sixth and a
    fourth of a disc; as much is deposited as is eroded, within one disc; strata are in groups by episode."""
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, diffuse=K, x=(0.0, WIDTH), episode=700, colors=["red", "blue"], **SAND)
    sides, start, _ = heights(sim, 1, WIDTH)
    begun = sim.clock.time
    cycles.cycle(sim, 1400)
    _, _, now = heights(sim, 1, WIDTH)
    width, spread = np.diff(sides), K * (sim.clock.time - begun)
    exact = landscape.moved(start, width, landscape.diffused(start, width, spread))
    assert np.sqrt(((now - exact) ** 2).mean()) < 0.3
    upper, lower = start[:13].mean(), start[17:].mean()
    x = 0.5 * (sides[:-1] + sides[1:]) - STEP
    erf = lower + 0.5 * (upper - lower) * np.array([math.erfc(v / math.sqrt(4.0 * spread)) for v in x])
    assert np.sqrt(((now - erf) ** 2).mean()) < 0.5
    assert_adds_up(sim, 1)
    seen = surface.balance(sim, 1)
    disc = math.pi / (1.0 - surface.POROSITY)
    assert seen["demanded"] == 0.0 and seen["eroded"] > 5.0 * disc
    assert abs(seen["eroded"] - seen["deposited"] - seen["settling"]) < disc
    groups = np.array(sim.groups)[sim.particles["group"]]
    color = sim.particles["color"]
    assert (groups == "growth1").sum() > 2 and (groups == "growth2").sum() > 0
    assert (color[groups == "growth1"] == 3).all() and (color[groups == "growth2"] == 7).all()
    rows = [line.split(",") for line in (tmp_path / "surface.csv").read_text().splitlines()]
    assert len(rows) == 29 and float(rows[-1][3]) == seen["eroded"]


def test_a_slope_limit_gives_that_slope(scarp: str, tmp_path) -> None:
    """The step of 10 m becomes a slope of 10 degrees, 57 m wide. With what columns still owe, less than a disc each,
    it is gentler by up to 1.5 degrees, as its upper half owes erosion and the lower one deposition."""
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, slope=10.0, x=(0.0, WIDTH), **SAND)
    cycles.cycle(sim, 600)
    sides, h, owed = heights(sim, 1, WIDTH)
    x = 0.5 * (sides[:-1] + sides[1:])
    middle = np.abs(x - STEP) < 22.0
    of_discs, angle = (math.degrees(math.atan(-np.polyfit(x[middle], v[middle], 1)[0])) for v in (h, owed))
    assert of_discs == pytest.approx(10.0, abs=1.0)
    assert angle == pytest.approx(9.25, abs=0.75) and angle < of_discs
    assert_adds_up(sim, 1)


def test_erosion_at_a_rate_down_to_a_level(scarp: str, tmp_path) -> None:
    """0.5 m/s for 2 s takes 1 m of the upper half, more does not go below 18 m; what is not named protects."""
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, erode=0.5, above=18.0, x=(0.0, WIDTH))
    _, start, _ = heights(sim, 1, WIDTH)
    cycles.cycle(sim, 1000)
    _, h, owed = heights(sim, 1, WIDTH)
    assert (owed - start)[2:12].mean() == pytest.approx(-1.0, abs=0.2)
    assert surface.balance(sim, 1)["discs_deposited"] == 0
    before, eroded = len(sim.particles), surface.balance(sim, 1)["eroded"]
    surface.surface(sim, 1, 50, above=18.0, x=(0.0, WIDTH), only=["low"])
    cycles.cycle(sim, 100)
    assert len(sim.particles) == before and surface.balance(sim, 1)["eroded"] == eroded > 0.0
    surface.surface(sim, 1, 50, above=18.0, x=(0.0, WIDTH), only=["High"])
    cycles.cycle(sim, 300)
    _, h, owed = heights(sim, 1, WIDTH)
    assert owed[2:12].max() < 18.6 and owed[2:12].mean() == pytest.approx(18.0, abs=0.3)
    assert_adds_up(sim, 1)


def test_discs_count_when_they_are_at_rest(scarp: str, tmp_path) -> None:
    """New discs are part of the deposit only after they have come to rest; those that are deleted before are lost."""
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, deposit=20.0, below=21.0, x=(0.0, WIDTH), group="new", **SAND)
    cycles.cycle(sim, 50)
    seen = surface.balance(sim, 1)
    new = np.array(sim.groups)[sim.particles["group"]] == "new"
    assert seen["deposited"] == 0.0 and seen["discs_settling"] == new.sum() > 10
    particles.delete(sim, Group("new"))
    surface.surface(sim, 2, 50, deposit=20.0, below=21.0, x=(0.0, WIDTH), group="second", **SAND)
    cycles.cycle(sim, 50)
    assert surface.balance(sim, 1)["lost"] == seen["settling"]
    for ident in (1, 2):
        assert_adds_up(sim, ident)
    surface.surface(sim, 1, off=True)
    cycles.cycle(sim, 1000)
    seen = surface.balance(sim, 2)
    second = np.array(sim.groups)[sim.particles["group"]] == "second"
    assert seen["discs_settling"] <= 3 and seen["discs_deposited"] + seen["discs_settling"] == second.sum()


def test_what_is_buried_is_compacted(tmp_path) -> None:
    """Radii follow the porosity of Athy at the depth of a disc, p0 exp(-z / 10 m), within three of 32 steps, and masses
    stay; the area that is lost is in the balance."""
    sim = basin(tmp_path, 40.0)
    porosity, scale = 0.5, 10.0
    surface.surface(sim, 1, 100, x=(0.0, 40.0), below=12.0, compact=(porosity, scale), **SAND)
    cycles.cycle(sim, 8000)
    p, land = sim.particles, sim.lands[1]
    depth = heights(sim, 1, 40.0)[1].mean() - p["y"]
    levels = np.array([land.levels.get(gid, 0) for gid in p["gid"].tolist()])
    wanted = landscape.compaction(depth, scale)
    assert levels.max() >= 18 and (levels >= wanted - 3).mean() > 0.97 and (np.abs(levels - wanted) <= 3).mean() > 0.8
    assert surface.balance(sim, 1)["discs_settling"] == 0
    mass = sim.materials.rows["density"][p["material"]] * math.pi * p["radius"] ** 2
    ratio = np.array([landscape.shrinkage(k, porosity) for k in levels.tolist()])
    original = p["radius"] / ratio
    assert np.minimum(np.abs(original - 0.8), np.abs(original - 1.0)).max() < 1e-12
    assert mass == pytest.approx(math.pi * original**2, rel=1e-12)
    lost = (math.pi * (original**2 - p["radius"] ** 2)).sum() / (1.0 - surface.POROSITY)
    assert surface.balance(sim, 1)["compacted"] == pytest.approx(lost, rel=1e-5)
    assert_adds_up(sim, 1)
    with pytest.raises(CommandError, match=r"SURFACE 1: its deposits have porosity 0.5 at the surface"):
        surface.surface(sim, 1, 100, x=(0.0, 40.0), below=12.0, compact=(0.4, scale), **SAND)
    surface.surface(sim, 1, 100, x=(0.0, 40.0), below=12.0, compact=(porosity, 5.0), **SAND)
    cycles.cycle(sim, 200)
    assert max(sim.lands[1].levels.values()) > levels.max()


def test_radii_in_another_unit_are_refused(tmp_path) -> None:
    """Discs of 900 m in a box of 40 m; with columns of a given width, they are refused for these."""
    sim = model(tmp_path, dt=2e-3, gravity=(0.0, -10.0))
    walls.box(sim, 0.0, 40.0, 0.0, 20.0)
    deposit = {"below": 12.0, **SAND, "rad": [900.0]}
    with pytest.raises(
        CommandError, match="4 times the largest radius, 3600 m, is wider than BOX, 0 to 40 m; check the"
    ):
        surface.surface(sim, 1, 100, **deposit)
    with pytest.raises(CommandError, match="spacing 8 m is less than a largest particle, 1800 m"):
        surface.surface(sim, 1, 100, spacing=8.0, **deposit)
    surface.surface(sim, 1, 100, **{**deposit, "rad": [10.0]})
    assert list(sim.lands) == [1] and sim.lands[1].spacing == 40.0


def test_a_process_given_again_continues_its_balance(scarp: str, tmp_path) -> None:
    """Rates that change every 130 steps, in mid-interval, with columns of another width: one balance for all, areas at
    rate x time, episodes that go on, and ids of eroded deposits that BALL cannot take."""
    sim = restored(scarp, tmp_path)
    laid, rates = 0.0, (1.0, 2.0, 0.5, 3.0)
    for rate, spacing in zip(rates, (4.0, 5.0, 4.0, 8.0)):
        surface.surface(sim, 1, 50, deposit=rate, x=(0.0, WIDTH), spacing=spacing, episode=200, **SAND)
        cycles.cycle(sim, 130)
    # Each rate acts from the last application before it, at 0, 100, 250 and 350, to that before the next one.
    laid = WIDTH * sim.clock.dt * (1.0 * 100 + 2.0 * 150 + 0.5 * 100 + 3.0 * 150)
    seen = surface.balance(sim, 1)
    assert seen["demanded"] == pytest.approx(laid, rel=1e-6)
    assert_adds_up(sim, 1)
    groups = np.array(sim.groups)[sim.particles["group"]]
    assert {name for name in set(groups) if name.startswith("growth")} == {"growth1", "growth2", "growth3"}
    cycles.cycle(sim, 80)
    surface.surface(sim, 1, 50, above=15.0, x=(0.0, WIDTH))
    cycles.cycle(sim, 200)
    seen = surface.balance(sim, 1)
    made = [gid for first, end in sim.lands[1].made for gid in range(first, end)]
    gone = sorted(set(made) - set(sim.particles["gid"].tolist()))
    assert gone and seen["deposited"] > 0.9 * laid and seen["discs_eroded"] > len(gone) // 2
    assert_adds_up(sim, 1)
    assert seen["mass_deposited"] == pytest.approx(seen["deposited"] * (1.0 - surface.POROSITY), rel=1e-6)
    with pytest.raises(CommandError, match=f"id {gone[0]} was that of a disc which SURFACE 1 deposited"):
        particles.ball(sim, gone[0], 50.0, 55.0, 1.0)
    particles.ball(sim, sim.next_gid, 50.0, 55.0, 1.0)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"interval": 0, "diffuse": 1.0}, "interval must be at least 1 step"),
        ({"diffuse": 1.0}, "give interval, the number of steps between two applications"),
        ({"interval": 5}, "nothing to do; give one or more of diffuse, slope"),
        ({"interval": 5, "diffuse": -1.0}, "diffuse must be above 0, got -1"),
        ({"interval": 5, "erode": math.nan, "above": 3.0}, "erode must be above 0, got nan"),
        ({"interval": 5, "slope": 90.0}, "slope: an angle above 0, at most 80 degrees, got 90"),
        ({"interval": 5, "below": 5.0, "above": 4.0, **SAND}, "erosion .above 4 m. and deposition .below 5 m. would"),
        ({"interval": 5, "diffuse": 1.0}, "diffuse deposits discs: give their radii"),
        ({"interval": 5, "diffuse": 1.0, "rad": [1.0]}, "diffuse deposits discs: give their density"),
        ({"interval": 5, "diffuse": 1.0, "rad": [1.0], "density": 1.0}, "give their kn, or shear, poiss and hertz"),
        ({"interval": 5, "above": 5.0, "density": 1.0}, "density describes a deposit, but this process only erodes"),
        ({"interval": 5, "erode": 1.0, "fric": 0.0}, "fric describes a deposit, but this process only erodes"),
        ({"interval": 5, "erode": 1.0, "hertz": True}, "hertz describes a deposit"),
        ({"interval": 5, "diffuse": 0.0, "slope": 20.0, **SAND}, "diffuse must be above 0, got 0"),
        ({"interval": 5, "above": -3.0}, "above -3 m is not above the base of the model, -0.0"),
        (
            {"interval": 5, "above": 3.0, "only": ["hihg"]},
            "ever been in group hihg; did you mean 'high'",
        ),
        ({"interval": 5, "below": 3.0, **SAND, "colors": ["pink"]}, "colors: expected lg, green"),
        ({"interval": 5, "below": 3.0, **SAND, "porosity": 0.95}, "porosity: from 0 to less than 0.9"),
        ({"interval": 5, "above": 3.0, "spacing": 1.0}, "spacing 1 m is less than a largest particle, 2 m"),
        ({"interval": 5, "above": 3.0, "x": (0.0, 1.0)}, "x from 0 to 1 m is narrower than a column"),
        ({"interval": 5, "below": 3.0, **SAND, "compact": (0.0, 5.0)}, "compact: a porosity above 0 and below 0.9"),
        ({"off": True}, "there is no process 7 of SURFACE; active: 1"),
        ({"interval": 5, "below": 19.0, **SAND}, "SURFACE 7 and 1 would erode and deposit at the same heights"),
    ],
)
def test_what_cannot_act_is_refused(scarp: str, tmp_path, words, message) -> None:
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, above=18.0)
    with pytest.raises(CommandError, match=message):
        surface.surface(sim, 7, **words)
    assert list(sim.lands) == [1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"x": (200.0, 300.0), "deposit": 1.0}, "SURFACE 1: there is no ground between x = 200 and 300 m"),
        ({"spacing": 200.0, "slope": 5.0}, "one column .spacing 200 m. covers everything"),
    ],
)
def test_a_process_that_finds_nothing_to_do_reports_it(scarp: str, tmp_path, words, message) -> None:
    sim = restored(scarp, tmp_path)
    said = io.StringIO()
    sim.log = Log(stream=said)
    surface.surface(sim, 1, 5, **SAND, **words)
    cycles.cycle(sim, 10)
    assert len(re.findall(message, said.getvalue())) == 1


def test_models_in_which_it_cannot_act_are_refused_before_the_run(scarp: str, tmp_path) -> None:
    sim = restored(scarp, tmp_path)
    surface.surface(sim, 1, 50, above=18.0)
    settings.set_option(sim, "gravity", (0.0, 0.0))
    with pytest.raises(CommandError, match="SURFACE 1 needs gravity along -y"):
        cycles.cycle(sim, 1)
    settings.set_option(sim, "gravity", (0.0, -10.0))
    write_lattice(tmp_path / "bodies", 0.5, 1, 1)
    clumps.clump(sim, tmp_path / "bodies", 10.0, 50.0)
    properties.prop(sim, density=1.0, kn=1e5, ks=1e5)
    with pytest.raises(CommandError, match="SURFACE 1 does not support clumps"):
        cycles.cycle(sim, 1)


def test_a_level_may_be_at_zero(tmp_path) -> None:
    sim = basin(tmp_path, WIDTH)
    walls.wall(sim, 0, ((0.0, -9.0), (WIDTH, -9.0)))
    particles.ball(sim, 0, 5.0, -8.0, 1.0)
    surface.surface(sim, 1, 5, above=0.0)
    surface.surface(sim, 2, 5, erode=1.0, above=5.0, deposit=1.0, below=0.0, **SAND)
    assert sim.lands[1].above == 0.0 and sim.lands[2].below == 0.0
    with pytest.raises(CommandError, match=r"erosion .above -1 m. and deposition .below 0 m. would act"):
        surface.surface(sim, 3, 5, erode=1.0, above=-1.0, deposit=1.0, below=0.0, **SAND)


def test_lines_of_a_script() -> None:
    for line, message in (
        ("SURFACE id 1 interval 0 diffuse 1", "script:2: SURFACE: read '0'"),
        ("SURFACE id 1 interval 9 diffuse -1", "script:2: SURFACE: read '-1'"),
        ("SURFACE interval 9 above 3", "id missing"),
        ("SURFACE id 1 interval 9 erode 1 deposit 1 rad discrete 1 density 1 kn 1", "would act at the same heights"),
        ("SURFACE id 1 off interval 3", "off accepts only the id"),
        ("SURFACE id 1 interval 9 above 3 episode 5", "episode describes a deposit"),
        ("SURFACE id 1 interval 9 slope 30 rad discrete 1 density 1 kn 1 colors red|pink", "colors: expected lg"),
    ):
        with pytest.raises(ScriptError, match=message):
            parse_text(f"START\n{line}\n")
