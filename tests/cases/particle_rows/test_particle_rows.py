"""V23: rows of particles made by GLINE, and bonds between nearest neighbours only.

Centres stand at P1 + k s e, s = 2 R c, k = 0 .. floor(|P2 - P1| / s + 1e-9), c = cratio. Pairs k apart have the
distance k s and touch if k s <= 2 R, that is k c <= 1. A bond command with rext = c looks for k s <= 2 R c = s: k =
1 alone, N - 1 bonds; with rext = 1 it takes every k <= 1 / c, sum over k of (N - k): for c = 0.4 the first and
second neighbours, 2 N - 3 bonds.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, particles, properties
from hpcdem.physics.dem import diagnostics
from tests.support import force, model, steps


def row(folder, p1, p2, rad, cratio=1.0):
    """A held row of Hertz particles; returns the model and the centres by id."""
    sim = model(folder, disk="off")
    made = particles.gline(sim, p1, p2, rad, cratio=cratio)
    properties.prop(sim, shear=2.9e9, poiss=0.2, hertz=True, fric=0.3)
    properties.fix(sim, ("x", "y", "spin"))
    order = np.argsort(sim.particles["gid"])
    centres = np.column_stack([sim.particles["x"][order], sim.particles["y"][order]])
    assert made == len(centres) and (sim.particles["gid"][order] == np.arange(made)).all()
    return sim, centres


def test_v23_spacing_of_160_m(tmp_path):
    _, centres = row(tmp_path, (0.0, 80.0), (40000.0, 80.0), 80.0)
    assert (centres == np.column_stack([160.0 * np.arange(251), np.full(251, 80.0)])).all()


@pytest.mark.parametrize(("length", "count"), [(159.999, 1), (160.0, 2), (160.001, 2), (319.9, 2), (0.0, 1)])
def test_the_row_ends_at_the_last_whole_spacing(tmp_path, length, count):
    _, centres = row(tmp_path, (5.0, 0.0), (5.0, -length), 80.0)
    assert len(centres) == count and (centres[0] == (5.0, 0.0)).all()


def test_an_inclined_row(tmp_path):
    p1, p2 = np.array([100.0, 50.0]), np.array([400.0, 450.0])
    _, centres = row(tmp_path, tuple(p1), tuple(p2), 25.0, 0.4)
    e = (p2 - p1) / 500.0
    assert centres == pytest.approx(p1 + 20.0 * np.arange(26)[:, None] * e, abs=1e-10)


@pytest.mark.some_of_each
@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 137.0])
@pytest.mark.parametrize(("rext", "neighbours"), [(0.4, 1), (1.0, 2)])
def test_v23_only_nearest_neighbours_are_bonded(tmp_path, angle, rext, neighbours):
    p1 = np.array([1000.0, -300.0])
    e = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    sim, centres = row(tmp_path, tuple(p1), tuple(p1 + 64.0 * 40 * e), 80.0, 0.4)
    n = len(centres)
    assert n == 41
    made = bonds.bond(sim, ebmod=2e8, gbmod=2e8, tstrength=2e7, sstrength=4e7, rext=rext)
    assert made == sum(n - k for k in range(1, neighbours + 1))
    steps(sim, 1)
    assert sim.bonds_left() == made
    _, ids = diagnostics.contact_rows(sim)
    bonded = ids[ids[:, 2] > 0]
    assert set(map(tuple, bonded[:, :2])) == {(i, i + k) for k in range(1, neighbours + 1) for i in range(n - k)}
    # Overlapping neighbours (k = 1 and 2) push with the full radii whether they are bonded or not.
    k_hertz = 2.0 * 2.9e9 * math.sqrt(160.0) / (3.0 * 0.8)
    end = k_hertz * ((160.0 - 64.0) ** 1.5 + (160.0 - 128.0) ** 1.5)
    assert force(sim, 0)[:2] == pytest.approx(-end * e, rel=1e-9, abs=1e-9 * end)
    assert force(sim, 20)[:2] == pytest.approx([0.0, 0.0], abs=1e-9 * end)
