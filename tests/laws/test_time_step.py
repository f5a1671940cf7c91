"""SET DT and SET frac: dt = f sqrt(m_min / k_max).

m_min: the smallest mass with a free degree of freedom; k_max: the largest pair stiffness (two springs in series),
also of particle and wall. The rule follows from the published length of the sandbox run of Li et al. 2021 ("about
130 000 steps"): 0.16 m at 0.04 m/s with f = 0.4, m_min = 4.5033e-5 kg and k = 7.5e3 N/m make dt = 3.0995e-5 s and
129 052 steps.
"""

from __future__ import annotations

import math

import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings, walls
from hpcdem.physics.dem.simulation import Simulation
from tests.support import model, only, steps


def with_frac(folder, frac: float, disk: str = "on") -> Simulation:
    sim = model(folder, disk=disk)
    settings.set_option(sim, "frac", frac)
    return sim


def test_the_sandbox_of_li_2021(tmp_path):
    sim = with_frac(tmp_path, 0.4, disk="hex")
    for gid, r in enumerate([1e-4, 1.5e-4, 2e-4]):
        particles.ball(sim, gid, 1e-3 * gid, 0.0, r)
    properties.prop(sim, density=1300.0, kn=1.5e4, ks=1.5e4)
    walls.wall(sim, 1, ((-1.0, -1.0), (-1.0, 1.0)), kn=1.5e4, ks=1.5e4, xv=0.04)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(3.0995e-5, rel=2e-5)
    assert round(0.16 / (0.04 * sim.clock.dt)) == pytest.approx(129052, abs=3)


def test_the_last_of_dt_and_frac_counts(tmp_path):
    sim = with_frac(tmp_path, 0.2)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=2e6)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(1000.0 * math.pi / 1e6))
    settings.set_option(sim, "dt", 0.05)
    cycles.prepare(sim)
    assert sim.clock.dt == 0.05
    settings.set_option(sim, "frac", 0.1)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.1 * math.sqrt(1000.0 * math.pi / 1e6))


def test_fixed_particles_do_not_count_but_walls_do(tmp_path):
    sim = with_frac(tmp_path, 0.2)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    particles.ball(sim, 1, 5.0, 0.0, 0.1)
    properties.prop(sim, density=1000.0, kn=2e6)
    properties.fix(sim, ("x", "y", "spin"), only(1))
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(1000.0 * math.pi / 1e6))
    properties.free(sim, ("spin",), only(1))
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(10.0 * math.pi / 1e6))
    walls.wall(sim, 0, ((-9.0, -9.0), (9.0, -9.0)), kn=6e6)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(10.0 * math.pi / 1.5e6))


def test_hertz_particles(tmp_path):
    """Tangent 1.5 K sqrt(U) of the stiffest contact; without contacts at U = 0.01 R of the largest particle."""
    sim = with_frac(tmp_path, 0.2, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    particles.ball(sim, 1, 2.5, 0.0, 1.0)
    properties.prop(sim, density=1000.0, shear=1e8, poiss=0.25, hertz=True)
    cycles.prepare(sim)
    mass, k = 4000.0 / 3.0 * math.pi, 2e8 * math.sqrt(2.0) / (3.0 * 0.75)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(mass / (1.5 * k * math.sqrt(0.01))), rel=1e-9)
    properties.fix(sim, ("x", "y", "spin"))
    properties.free(sim, ("spin",))
    properties.prop(sim, only(1), xv=-0.6 / (100 * sim.clock.dt))
    steps(sim, 100)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(mass / (1.5 * k * math.sqrt(0.1))), rel=1e-6)


def test_hertz_particles_that_hardly_press(tmp_path):
    """As without contacts: the tangent of an overlap that is rounding would allow any time step."""
    sim = with_frac(tmp_path, 0.2, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    particles.ball(sim, 1, 2.0 - 1e-12, 0.0, 1.0)
    properties.prop(sim, density=1000.0, shear=1e8, poiss=0.25, hertz=True)
    cycles.prepare(sim)
    mass, k = 4000.0 / 3.0 * math.pi, 2e8 * math.sqrt(2.0) / (3.0 * 0.75)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(mass / (1.5 * k * math.sqrt(0.01))), rel=1e-9)
