"""The mass rules of SET disk."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings
from hpcdem.physics.dem.kernels import mass
from tests.support import body, model

R = np.array([1e-3, 0.5, 1.0, 60.0, 80.0])


@pytest.mark.parametrize(
    ("disk", "volume", "gyration"),
    [
        ("on", math.pi * R**2, 0.5),
        ("hex", 2.0 * math.sqrt(3.0) * R**2, 0.5),
        ("off", 4.0 / 3.0 * math.pi * R**3, 0.4),
        ("0", 4.0 / 3.0 * math.pi * R**3, 0.4),
    ],
)
def test_volume_and_inertia(disk, volume, gyration):
    assert mass.volume(R, disk) == pytest.approx(volume, rel=1e-15)
    assert mass.inertia(2500.0 * volume, R, disk) == pytest.approx(gyration * 2500.0 * volume * R**2, rel=1e-15)
    assert mass.SPHERES[disk] == (gyration == 0.4)


def test_the_hexagonal_cell_is_that_of_the_closest_packing():
    """Discs in hexagonal packing cover pi / (2 sqrt 3) of the plane."""
    assert mass.volume(R, "on") / mass.volume(R, "hex") == pytest.approx(math.pi / math.sqrt(12.0), rel=1e-15)


def test_published_masses():
    """Li et al. 2018: 2.16506e7 kg; Li et al. 2021, smallest grain of 0.1 mm radius and 1300 kg/m^2: 4.5033e-5 kg."""
    assert 2500.0 * mass.volume(np.array([50.0]), "hex")[0] == pytest.approx(2.16506e7, rel=2e-6)
    assert 1300.0 * mass.volume(np.array([1e-4]), "hex")[0] == pytest.approx(4.5033e-5, rel=1e-4)


def test_set_disk_acts_on_particles_that_are_there(tmp_path):
    """Masses follow from the stored density whenever the rule is changed."""
    sim = model(tmp_path)
    particles.ball(sim, 0, 0.0, 0.0, 2.0)
    properties.prop(sim, density=1000.0)
    seen = {}
    for disk in ("on", "off", "hex", "0"):
        settings.set_option(sim, "disk", disk)
        cycles.prepare(sim)
        seen[disk] = body(sim)
    assert seen["on"] == pytest.approx((4000.0 * math.pi, 8000.0 * math.pi))
    assert seen["off"] == pytest.approx((32000.0 / 3.0 * math.pi, 51200.0 / 3.0 * math.pi)) == seen["0"]
    assert seen["hex"] == pytest.approx((8000.0 * math.sqrt(3.0), 16000.0 * math.sqrt(3.0)))
