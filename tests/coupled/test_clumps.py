"""A rigid pair of discs and blocks: closed forms and what is kept.

Two discs of radius R, distance L, one body of mass M and inertia I. Lying flat both touch at once: M u'' = -2 k u, so
it leaves with the speed v after pi sqrt(M / 2k), the largest overlap being v sqrt(M / 2k). At an angle only the lower
disc touches, a = (L/2) cos(theta) beside the centre; for a stiff contact the push on it is 2 mu v, 1/mu = 1/M + a^2/I.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import clumps, properties
from hpcdem.core.errors import CommandError
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.fdem import diagnostics as of_blocks
from tests.blocks.support import rectangle, shaken
from tests.coupled.support import body, discs, momentum, together

R, L, DENSITY = 0.05, 0.3, 2500.0
AREA = 2.0 * math.pi * R**2
MASS, INERTIA = DENSITY * AREA, DENSITY * AREA * (0.5 * R**2 + 0.25 * L**2)
TOP = 0.6


def pair(folder, blocks, theta=0.0, kn=1e7, dt=2e-6, above=1e-4, x=0.6, **motion):
    """The pair above the upper face, the lower disc `above` it; frictionless unless said."""
    half = 0.5 * L * np.array([math.cos(theta), math.sin(theta)])
    y = TOP + R + half[1] + above
    sim = discs([(x - half[0], y - half[1], R), (x + half[0], y + half[1], R)], folder, dt=dt)
    properties.prop(sim, kn=kn, ks=0.5 * kn, **{"fric": 0.0, **motion})
    clumps.join(sim)
    return together(sim, blocks)


def now(both) -> dict[str, float]:
    """The pair as it is."""
    return {name: float(values[0]) for name, values in diagnostics.clumps(both.particles).items()}


def held():
    return body(rectangle(6, 3, 1.2, TOP), fixed=True)


def test_flat_rebound(tmp_path):
    v, k, dt = 1.0, 1e7, 2e-6
    both = pair(tmp_path, held(), kn=k, dt=dt, above=0.0, x=0.61, yv=-v)
    assert now(both)["mass"] == pytest.approx(MASS) and now(both)["inertia"] == pytest.approx(INERTIA)
    deepest, steps = 0.0, 0
    while steps == 0 or len(both.contacts()["id"]):
        both.advance(1)
        found = both.contacts()
        assert steps == 0 or len(found["id"]) in (0, 2)
        deepest = max(deepest, *found["overlap"], 0.0)
        steps += 1
    assert deepest == pytest.approx(v * math.sqrt(MASS / (2.0 * k)), rel=1e-5)
    assert steps * dt == pytest.approx(math.pi * math.sqrt(MASS / (2.0 * k)), abs=3 * dt)
    end = now(both)
    assert end["vy"] == pytest.approx(v, rel=1e-6) and abs(end["spin"]) < 1e-9 and abs(end["vx"]) < 1e-12


def test_oblique_rebound(tmp_path):
    """The error of the limit goes with the time of contact, k^(-1/2): a tenth of it at a hundredfold stiffness."""
    v, theta = 0.2, 0.5
    a = 0.5 * L * math.cos(theta)
    mu = 1.0 / (1.0 / MASS + a * a / INERTIA)
    push = 2.0 * mu * v
    wrong = []
    for k, dt in ((1e7, 2e-6), (1e9, 2e-7)):
        both = pair(tmp_path, held(), theta, kn=k, dt=dt, above=0.0, yv=-v)
        both.advance(int(1.5 * math.pi * math.sqrt(mu / k) / dt))
        assert not len(both.contacts()["id"])
        end = now(both)
        wrong.append(max(abs(end["vy"] - (-v + push / MASS)), L * abs(end["spin"] + a * push / INERTIA)) / v)
    assert wrong[1] < 2e-3 and wrong[1] < 0.15 * wrong[0]


def test_momentum(tmp_path):
    """A turning pair hits a free elastic body beside its centre, with friction: momentum and its moment stay."""
    both = pair(tmp_path, body(shaken(rectangle(6, 3, 1.2, TOP), 0.2)), 0.4, dt=5e-6, above=0.02, x=0.8,
                xv=1.0, yv=-2.0, fric=0.5)  # fmt: skip
    both.prepare()
    before = momentum(both)
    touched = 0
    for _ in range(30):
        both.advance(200)
        touched += len(both.contacts()["id"]) > 0
        assert np.abs(momentum(both) - before).max() <= 1e-12 * np.abs(before).max()
    assert (
        touched > 2
        and abs(now(both)["spin"]) > 1.0
        and np.abs(of_blocks.values(both.blocks, "velocity_y")).max() > 1e-3
    )


def test_no_account_of_energy(tmp_path):
    both = pair(tmp_path, held())
    both.particles.energy = Budget()
    both.release()
    with pytest.raises(CommandError, match="budget does not support clumps that are coupled to blocks"):
        both_again = type(both)(both.particles, both.blocks)
        both_again.settle_time_step()
        both_again.advance(1)
