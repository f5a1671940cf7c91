"""A4: the stress that particle stresses give in a settled bed is the weight of what lies above.

Stress of a particle (Christoffersen et al. 1981; PFC), compression positive, summed over its contacts c with particles
and walls:

    V s_ij = - sum_c l_i f_j,     l from the centre to the contact point, f the force on the particle

Stress of a region: sum of V s_ij over the particles in it / (A t), A its area and t the thickness, for spheres twice
the mean radius. At rest d(s_yy)/d(depth) = rho_bulk g with rho_bulk = mass / (A t).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings, walls
from hpcdem.core.selection import Interval
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation
from tests import support

G, BAND = 9.8, 200.0
PROPERTIES = {"density": 2.5e3, "fric": 0.0, "shear": 2.9e9, "poiss": 0.2, "damp": 0.4, "hertz": True}


def particle_stress(sim: Simulation) -> np.ndarray:
    """V s_ij (n, 2, 2) [N m] of all particles of a closed model on one rank."""
    p = sim.particles
    order = np.argsort(p["gid"])
    gids = p["gid"][order]
    centre = np.column_stack([p["x"], p["y"]])
    total = np.zeros((len(p), 2, 2))

    def add(ids: np.ndarray, force: np.ndarray, place: np.ndarray) -> None:
        at = order[np.searchsorted(gids, ids)]
        np.subtract.at(total, at, (place - centre[at])[:, :, None] * force[:, None, :])

    out, ids = diagnostics.contact_rows(sim)
    force, place = (
        out[:, diagnostics.FORCE_X : diagnostics.FORCE_Y + 1],
        out[:, diagnostics.AT_X : diagnostics.AT_Y + 1],
    )
    add(ids[:, 0], force, place)
    add(ids[:, 1], -force, place)
    out, ids = diagnostics.wall_rows(sim)
    add(
        ids[:, 0],
        out[:, diagnostics.FORCE_X : diagnostics.FORCE_Y + 1],
        out[:, diagnostics.AT_X : diagnostics.AT_Y + 1],
    )
    return total


def below(height: np.ndarray, y: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Part of the area of each disc (n,) that lies below each height (m,): (m, n). Area of a circular segment."""
    t = np.clip((height[:, None] - y) / r, -1.0, 1.0)
    return (np.arcsin(t) + t * np.sqrt(1.0 - t * t)) / np.pi + 0.5


def profile(sim: Simulation, width: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(height of the middle, stress (n, 2, 2) [Pa], bulk density [kg/m^3]) of horizontal bands of height BAND.

    A particle counts in a band with the part of it that lies there: bands are hardly higher than particles, and by
    centres alone a layer would be in or out as a whole.
    """
    p, thickness = sim.particles, 2.0 * sim.particles["radius"].mean()
    volume = width * BAND * thickness
    stress, edges = particle_stress(sim), np.arange(low, high + 1.0, BAND)
    part = np.diff(below(edges, p["y"], p["radius"]), axis=0)
    return (
        0.5 * (edges[1:] + edges[:-1]),
        np.einsum("kn,nij->kij", part, stress) / volume,
        part @ sim.body[:, 0] / volume,
    )


def check(sim: Simulation, width: float) -> None:
    """Slope within 1 % of rho_bulk g, each band within 2 % of the weight above; no shear without friction."""
    height, stress, density = profile(sim, width, 500.0, 3500.0)
    slope = np.polyfit(height, stress[:, 1, 1], 1)[0]
    print(f"stress gradient / rho_bulk g = {-slope / (density.mean() * G):.4f}")
    assert -slope == pytest.approx(density.mean() * G, rel=0.01)
    y, r = sim.particles["y"], sim.particles["radius"]
    above = (1.0 - below(height, y, r)) @ sim.body[:, 0] * G / (width * 2.0 * r.mean())
    assert stress[:, 1, 1] == pytest.approx(above, rel=0.02)
    assert np.abs(stress[:, 0, 1] - stress[:, 1, 0]).max() < 1e-6 * stress[:, 1, 1].max()  # moments balance
    assert np.abs(stress[:, 0, 1]).max() < 0.02 * stress[:, 1, 1].max()


def test_resting_sphere_carries_its_weight(tmp_path: Path) -> None:
    """One sphere on a floor: V s_yy = m g (R - U/2), nothing else."""
    sim = support.model(tmp_path, dt=1e-2, disk="off", gravity=(0.0, -G))
    walls.wall(sim, 0, ((-500.0, 0.0), (500.0, 0.0)))
    particles.ball(sim, 0, 0.0, 60.0, 60.0)
    properties.prop(sim, **PROPERTIES)
    support.steps(sim, 3000)
    mass, overlap = sim.body[0, 0], support.at_wall(sim).overlap
    expected = np.array([[0.0, 0.0], [0.0, mass * G * (60.0 - 0.5 * overlap)]])
    # the contact point lies half the overlap behind the wall's face
    assert particle_stress(sim)[0] == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected[1, 1])


def test_settled_bed(tmp_path: Path) -> None:
    """8 km of the bed of A3, settled here."""
    sim = support.model(tmp_path, dt=5e-2, disk="off", gravity=(0.0, -G), seed=1, gentry=2.75)
    walls.wall(sim, 0, ((0.0, 0.0), (8000.0, 0.0)))
    walls.wall(sim, 1, ((0.0, 10000.0), (0.0, 0.0)))
    walls.wall(sim, 2, ((8000.0, 0.0), (8000.0, 10000.0)))
    particles.gen(sim, 20000, [60.0, 80.0], (0.0, 8000.0), (0.0, 10000.0))
    properties.prop(sim, **PROPERTIES)
    support.steps(sim, 4000)
    particles.delete(sim, Interval("y", 4000.0, 999000.0))
    support.steps(sim, 1500)
    check(sim, 8000.0)


def test_published_bed(manual_scripts: Path) -> None:
    """The bed of 10 713 spheres of the ZDEM manual, as loaded."""
    sim = Simulation()
    particles.load(sim, manual_scripts / "init_xyr.dat")
    settings.set_option(sim, "disk", "off")
    settings.set_option(sim, "dt", 5e-2)
    settings.set_option(sim, "gravity", (0.0, -G))
    walls.box(sim, 0.0, 41000.0, 0.0, 11000.0)
    walls.wall(sim, 0, ((0.0, 10.0), (40000.0, 10.0)))
    walls.wall(sim, 1, ((10.0, 10000.0), (10.0, 10.0)))
    walls.wall(sim, 2, ((40000.0, 10.0), (40000.0, 10000.0)))
    properties.prop(sim, **PROPERTIES)
    cycles.prepare(sim)
    check(sim, 39990.0)
