"""Models that cannot be right are stopped with a message that says what and where."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, particles, properties, settings
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.dem.simulation import Simulation
from tests.support import force, model, only, steps, value

HERTZ = {"shear": 1e9, "poiss": 0.2, "hertz": True}


def two(folder, gap: float = -0.1):
    """Two balls of 1 m, this far apart."""
    sim = model(folder)
    particles.ball(sim, 11, 0.0, 0.0, 1.0)
    particles.ball(sim, 12, 2.0 + gap, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=1e6)
    return sim


# ---- what a cycle needs ------------------------------------------------------------------------------------------


def test_a_touching_pair_of_two_laws(tmp_path):
    sim = two(tmp_path)
    properties.prop(sim, only(12), **HERTZ)
    with pytest.raises(CommandError, match="11 and 12 are in contact, but one has the law linear and the other hertz"):
        cycles.cycle(sim, 1)


def test_two_laws_apart_are_fine(tmp_path):
    sim = two(tmp_path, gap=0.5)
    properties.prop(sim, only(12), **HERTZ)
    cycles.cycle(sim, 10)
    assert not force(sim, 11).any()


def test_linear_keys_without_hertz_choose_the_linear_law(tmp_path):
    """A later PROP kn makes Hertz particles linear ones."""
    sim = two(tmp_path)
    properties.prop(sim, **HERTZ)
    properties.prop(sim, kn=4e6)
    cycles.cycle(sim, 1)
    assert force(sim, 12)[0] == pytest.approx(2e6 * 0.1, rel=1e-9)


def test_no_density(tmp_path):
    sim = model(tmp_path)
    particles.ball(sim, 11, 0.0, 0.0, 1.0)
    particles.ball(sim, 12, 1.9, 0.0, 1.0)
    properties.prop(sim, kn=1e6)
    properties.prop(sim, only(12), density=1000.0)
    with pytest.raises(CommandError, match="1 particles that are free to move have no density"):
        cycles.cycle(sim, 1)
    properties.fix(sim, ("x", "y"), only(11))
    with pytest.raises(CommandError, match="density"):
        cycles.cycle(sim, 1)
    properties.fix(sim, ("spin",), only(11))
    cycles.cycle(sim, 3)
    assert value(sim, "x", 11) == 0.0 and value(sim, "x", 12) > 1.9


def test_no_time_step(tmp_path):
    sim = Simulation(outdir=tmp_path)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    properties.prop(sim, density=1.0)
    with pytest.raises(CommandError, match="no time step"):
        cycles.cycle(sim, 1)
    settings.set_option(sim, "frac", 0.2)
    with pytest.raises(CommandError, match="no stiffness"):
        cycles.cycle(sim, 1)


@pytest.mark.parametrize(
    "keys",
    [
        {"density": -1.0},
        {"density": 0.0},
        {"fric": -0.1},
        {"kn": -5.0},
        {"damp": -0.4},
        {"poiss": 0.6},
        {"poiss": -1.0},
        {"youngs": 1.0},
    ],
)
def test_properties_that_make_no_sense(tmp_path, keys):
    sim = two(tmp_path)
    with pytest.raises(CommandError, match=next(iter(keys))):
        properties.prop(sim, **keys)


def test_bonds_that_make_no_sense(tmp_path):
    sim = two(tmp_path)
    with pytest.raises(CommandError, match="not both"):
        bonds.bond(sim, ebmod=1.0, n_bond=1.0)
    with pytest.raises(CommandError, match="no bond property"):
        bonds.bond(sim)
    with pytest.raises(CommandError, match="must not be negative"):
        bonds.bond(sim, ebmod=1e8, tstrength=-1.0)
    with pytest.raises(CommandError, match="rext"):
        bonds.bond(sim, ebmod=1e8, rext=0.0)


# ---- what must stop a run ----------------------------------------------------------------------------------------


def test_a_runaway_is_named(tmp_path):
    """Half a radius in a step is too far: id, place and velocity are told."""
    sim = two(tmp_path, gap=5.0)
    properties.prop(sim, only(12), xv=600.0)
    with pytest.raises(PhysicsError) as stop:
        cycles.cycle(sim, 10)
    message = str(stop.value)
    assert "over half its radius" in message and "(1 particles)" in message
    assert "particle 12 at (7.6, 0), velocity (600, 0)" in message and "particle 11" not in message
    assert list(tmp_path.glob("all_*[0-9].vtkhdf")), "the state is left for a look"


def test_the_limit_of_a_step_itself_is_allowed(tmp_path):
    sim = two(tmp_path, gap=5.0)
    properties.prop(sim, only(12), xv=499.0)
    steps(sim, 10)
    assert value(sim, "x", 12) == pytest.approx(7.0 + 4.99)


@pytest.mark.parametrize(("field", "bad"), [("x", math.nan), ("vy", math.inf), ("vx", math.nan), ("spin", math.nan)])
def test_numbers_that_are_not_finite_are_named(tmp_path, field, bad):
    """Whatever of the state it is, within the longest time between two looks."""
    sim = two(tmp_path, gap=5.0)
    steps(sim, 3)
    sim.particles[field][sim.particles["gid"] == 12] = bad
    with pytest.raises(PhysicsError, match="not finite") as stop:
        steps(sim, 70)
    assert "particle 12 at" in str(stop.value) and "particle 11" not in str(stop.value)


def test_too_large_a_time_step_stops(tmp_path):
    """dt 60 times the stable one: the pair flies apart faster than it should, and is named."""
    sim = two(tmp_path)
    properties.prop(sim, kn=1e12)
    with pytest.raises(PhysicsError, match=r"the time step 0\.001 s is probably too large") as stop:
        cycles.cycle(sim, 200)
    assert "particle 11 at" in str(stop.value) and "particle 12 at" in str(stop.value)


def test_at_most_ten_are_listed(tmp_path):
    sim = model(tmp_path)
    for gid in range(30):
        particles.ball(sim, gid, 5.0 * gid, 0.0, 1.0)
    properties.prop(sim, density=1000.0, yv=-1e4)
    with pytest.raises(PhysicsError) as stop:
        cycles.cycle(sim, 1)
    lines = str(stop.value).splitlines()
    assert "(30 particles)" in lines[0] and len(lines) == 11
    assert [int(line.split()[1]) for line in lines[1:]] == list(range(10))


def test_centres_in_one_place_do_not_stop_the_run(tmp_path):
    """Two rows may start at one corner: fixed particles there push each other along x, whatever it means."""
    sim = model(tmp_path)
    particles.gline(sim, (0.0, 0.0), (10.0, 0.0), 1.0)
    particles.gline(sim, (0.0, 0.0), (0.0, 10.0), 1.0)
    properties.prop(sim, density=1.0, kn=2e6, ks=2e6, fric=0.3)
    properties.fix(sim, ("x", "y", "spin"))
    cycles.cycle(sim, 5)
    assert np.isfinite(sim.lists.owned_forces()).all()
    assert force(sim, 0)[0] == pytest.approx(-2e6, rel=1e-6), "kn (Ra + Rb), and no neighbour is nearer than touching"
