"""V13: shear of a Hertz-Mindlin contact, loaded by moving fixed particles."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties, walls
from tests.cases.mindlin_shear import exact
from tests.support import at_wall, force, model, only, pair, steps, watch

DT, STEP = 1e-3, 1e-3
"""Time step [s] and tangential way per step [m]."""
LEGS = (+150, +150, -300, -250, +100)
"""Steps there and back: to 2/3 of the limit, into slip, through zero, into slip the other way, and up again."""


def follow(sim, move, look) -> tuple[np.ndarray, np.ndarray]:
    """Tangential way [m] and what `look` sees, along LEGS; `move(speed)` sets the sliding speed [m/s]."""
    way, seen = [0.0], [look(sim)]
    for leg in LEGS:
        move(np.sign(leg) * STEP / DT)
        seen.extend(watch(sim, abs(leg), look)[1:])
        way.extend(way[-1] + np.sign(leg) * STEP * np.arange(1, abs(leg) + 1))
    return np.array(way), np.array(seen)


def test_v13_sphere_along_a_wall(tmp_path):
    sim = model(tmp_path, DT, disk="off")
    walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)), fric=exact.MU)
    particles.ball(sim, 0, 0.0, exact.RADIUS - exact.OVERLAP, exact.RADIUS)
    properties.prop(sim, shear=exact.G, poiss=exact.NU, fric=0.9, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)
    assert at_wall(sim).fn == pytest.approx(exact.normal_force(exact.OVERLAP), rel=1e-10)

    # On the floor n points down, so the tangent is +x; the floor moves along -t relative to a ball that moves to +x.
    way, fs = follow(sim, lambda v: properties.prop(sim, xv=v), lambda sim: at_wall(sim).fs)
    scale = exact.MU * exact.normal_force(exact.OVERLAP)
    assert fs == pytest.approx(exact.there_and_back(-way, exact.OVERLAP), abs=1e-8 * scale)
    assert np.abs(fs).max() == pytest.approx(scale, rel=1e-12)
    assert force(sim)[0] == fs[-1], "friction acts along +t on the particle"
    assert force(sim)[2] == pytest.approx(fs[-1] * (exact.RADIUS - 0.5 * exact.OVERLAP), rel=1e-12)


def test_v13_wall_under_a_sphere(tmp_path):
    """The same, the wall moving instead."""
    sim = model(tmp_path, DT, disk="off")
    walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)), fric=exact.MU)
    particles.ball(sim, 0, 0.0, exact.RADIUS - exact.OVERLAP, exact.RADIUS)
    properties.prop(sim, shear=exact.G, poiss=exact.NU, fric=0.9, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)
    way, fs = follow(sim, lambda v: walls.wall(sim, 0, xv=v), lambda sim: at_wall(sim).fs)
    scale = exact.MU * exact.normal_force(exact.OVERLAP)
    assert fs == pytest.approx(exact.there_and_back(way, exact.OVERLAP), abs=1e-8 * scale)


@pytest.mark.parametrize("turning", [0, 1])
def test_v13_turning_spheres(tmp_path, turning):
    """One of two pressed spheres turns on the spot: the geometry stays exactly as it is. The surfaces meet U/2
    inside."""
    sim = model(tmp_path, DT, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, exact.RADIUS)
    particles.ball(sim, 1, 2.0 * exact.RADIUS - exact.OVERLAP, 0.0, exact.RADIUS)
    properties.prop(sim, shear=exact.G, poiss=exact.NU, fric=exact.MU, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)
    arm = exact.RADIUS - 0.5 * exact.OVERLAP
    way, fs = follow(
        sim, lambda v: properties.prop(sim, only(turning), spin=v / arm), lambda sim: pair(sim).fs
    )  # fmt: skip
    scale = exact.MU * exact.normal_force(exact.OVERLAP)
    assert fs == pytest.approx(exact.there_and_back(-way, exact.OVERLAP), abs=1e-8 * scale)
    assert force(sim, 0)[2] == force(sim, 1)[2] == pytest.approx(fs[-1] * arm, rel=1e-12)


def test_shear_force_is_kept_on_unloading_but_cut_by_friction(tmp_path):
    """Fs = 0.8 mu Fn(1 m) is kept when the overlap becomes 0.9 m (limit 0.854), and is cut at 0.5 m (limit 0.354)."""
    sim = model(tmp_path, DT, disk="off")
    walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)), fric=exact.MU)
    particles.ball(sim, 0, 0.0, exact.RADIUS - exact.OVERLAP, exact.RADIUS)
    properties.prop(sim, shear=exact.G, poiss=exact.NU, fric=exact.MU, hertz=True, xv=-1.0)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 180)
    loaded = at_wall(sim).fs
    assert loaded == pytest.approx(0.8 * exact.MU * exact.normal_force(1.0), rel=1e-8)
    properties.prop(sim, xv=0.0, yv=1.0)
    steps(sim, 100)
    assert at_wall(sim).fs == loaded
    steps(sim, 400)
    assert at_wall(sim).fs == pytest.approx(exact.MU * exact.normal_force(0.5), rel=1e-8)
    properties.prop(sim, yv=-1.0)
    steps(sim, 500)
    assert at_wall(sim).fs == pytest.approx(exact.MU * exact.normal_force(0.5), rel=1e-8), "what was cut is gone"
    properties.prop(sim, yv=1.0)
    steps(sim, 1001)
    assert at_wall(sim) is None
    properties.prop(sim, yv=-1.0)
    steps(sim, 1001)
    assert at_wall(sim).fs == 0.0, "a contact that opened has forgotten its shear force"
