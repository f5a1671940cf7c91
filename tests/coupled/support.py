"""Models of discs and blocks for the tests of both together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpcdem.commands.dem import cycles, particles, properties, settings
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks

ROCK = {"density": 2500.0, "young": 1e9, "poisson_ratio": 0.25}
STIFF = {"density": 2500.0, "young": 50e9, "poisson_ratio": 0.25}


def discs(places: Sequence[tuple[float, float, float]], folder: Path, dt: float = 0.0, **options) -> Simulation:
    """Discs (x, y, radius), density 2500."""
    sim = Simulation(outdir=folder)
    particles.start(sim)
    settings.set_option(sim, "disk", "on")
    if dt > 0.0:
        settings.set_option(sim, "dt", dt)
    for name, value in options.items():
        settings.set_option(sim, name, value)
    for k, (x, y, r) in enumerate(places):
        particles.ball(sim, k, x, y, r)
    properties.prop(sim, density=2500.0, kn=1e7, ks=5e6, fric=0.5)
    return sim


def body(mesh: Mesh, rock: dict[str, float] = ROCK, fixed: bool = False, gravity: float = 0.0) -> Blocks:
    """A model of blocks; fixed: no corner moves."""
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", rock)
    sim.gravity(0.0, -gravity)
    if fixed:
        sim.velocity_condition(None, vx=0.0, vy=0.0)
    return sim


def together(sim: Simulation, blocks: Blocks, **options) -> Coupled:
    """Both, ready to step."""
    cycles.prepare(sim, dt_known=sim.settings.dt == 0.0)
    both = Coupled(sim, blocks, **options)
    both.settle_time_step()
    return both


def of_disc(both: Coupled, name: str, gid: int = 0) -> float:
    """A field of one disc."""
    p = both.particles.particles
    return float(p[name][p["gid"] == gid][0])


def momentum(both: Coupled) -> np.ndarray:
    """Momentum in x and y, and about the origin, of all there is (on one rank)."""
    blocks, p = both.blocks, both.particles.particles
    blocks.close_model()
    both.particles.close_model()
    single = p.clump < 0 if both.particles.clumps else np.ones(len(p), bool)
    bodies = {"mass": both.particles.body[single, 0], "inertia": both.particles.body[single, 1],
              **{name: p[name][single] for name in ("x", "y", "vx", "vy", "spin")}}  # fmt: skip
    rows = []
    for of in (bodies, diagnostics.clumps(both.particles)):
        m = of["mass"]
        about = m * (of["x"] * of["vy"] - of["y"] * of["vx"]) + of["inertia"] * of["spin"]
        rows.append(np.column_stack([m * of["vx"], m * of["vy"], about]))
    mass, x, v = blocks.local.true_mass[blocks.owned], blocks.x[blocks.owned], blocks.v[blocks.owned]
    for k in range(3 if v.shape[1] == 6 else 4):
        mk, xk, yk, uk, vk = mass[:, k], x[:, 2 * k], x[:, 2 * k + 1], v[:, 2 * k], v[:, 2 * k + 1]
        rows.append(np.column_stack([mk * uk, mk * vk, mk * (xk * vk - yk * uk)]))
    return np.concatenate(rows).sum(axis=0)
