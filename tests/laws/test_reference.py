"""Walls and motion against the plain loops of physics/dem/reference.py, in random states (pairs: test_pair_forces)."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from hpcdem.core.fields import ANGLE, FIX, MATERIAL, SPIN, VX, VY, X, Y
from hpcdem.core.selection import Ids, Interval
from hpcdem.physics.dem import reference
from hpcdem.physics.dem.kernels.motion import ALPHA, INERTIA, MASS
from hpcdem.physics.dem.kernels.walls import END1, END2, FACE, NONE
from hpcdem.physics.dem.simulation import Simulation
from tests import support

ZIGZAG = [(2.0 + 1.3 * k, 7.0 + 0.4 * k + 1.5 * (k % 2)) for k in range(20)]


def cloud(folder: Path, hertz: bool, seed: int, **options: float | str) -> Simulation:
    """Discs about a box, a zigzag of moving walls with common ends, and a wall across it, of both kinds of sides."""
    sim = support.model(folder, dt=1e-3, disk="off", seed=seed, **options)
    particles.gen_grid(sim, [0.6], (0.6, 30.0), (0.6, 30.0))
    modulus = {"hertz": True, "shear": 1e6, "poiss": 0.25} if hertz else {"kn": 1e6, "ks": 7e5}
    properties.prop(sim, density=2000.0, damp=0.2, fric=0.5, **modulus)
    properties.prop(sim, Interval("x", 0.0, 15.0), fric=0.2, damp=0.0)
    for k, nodes in enumerate(pairwise(ZIGZAG)):
        walls.wall(sim, k, nodes, kn=2e6, ks=1e6, fric=0.4, xv=0.3, yv=-0.2)
    walls.box(sim, 0.1, 30.1, 0.1, 30.0)
    sim.settings.wallside = "left"
    walls.wall(sim, 30, ((3.0, 25.0), (20.0, 12.0)), kn=2e6, ks=1e6, fric=0.1)
    sim.open_model()
    p, rng = sim.particles, np.random.default_rng(seed)
    for name, size in (("x", 0.5), ("y", 0.5), ("vx", 1.0), ("vy", 1.0), ("spin", 2.0)):
        p[name][:] += size * rng.uniform(-1.0, 1.0, len(p))[p["gid"]]
    cycles.prepare(sim)
    return sim


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("hertz", [False, True])
def test_walls(tmp_path: Path, hertz: bool, seed: int) -> None:
    """Same forces to rounding, same histories and sides, from random ones; faces, ends and common ends occur."""
    sim = cloud(tmp_path, hertz, seed)
    lists, p, rng = sim.lists, sim.particles, np.random.default_rng(seed)
    m = len(lists.slot_row)
    lists.slot_fs[:] = rng.normal(0.0, 1e4, m)
    lists.slot_side[:] = before = rng.choice([-1.0, 0.0, 0.0, 1.0], m)
    slots = np.column_stack([lists.slot_row, lists.slot_wall])
    table = sim.wall_laws.reshape(len(sim.walls), -1, 4)
    args = p.hot, p.ihot[:, MATERIAL], sim.walls.table(), slots
    force, fs, side = reference.wall_forces(*args, lists.slot_fs.copy(), before, table, sim.settings.dt)
    lists.force[:] = 0.0
    sim._wall_forces(lists.n_blocks, *sim._wall_args)
    found = np.abs(force).max()
    assert lists.owned_forces() == pytest.approx(force[p.owned], rel=1e-11, abs=1e-12 * found)
    assert lists.slot_fs == pytest.approx(fs, rel=1e-10, abs=1e-12 * found)
    assert np.array_equal(lists.slot_side, side)
    meets = [reference.wall_contact(args[2][w], p.hot[i, :2], 0.6, z)[0] for (i, w), z in zip(slots, before)]
    assert {NONE, FACE, END1, END2} == set(meets) and np.count_nonzero(force[:, 0]) > 40
    assert any(fs[k] == 0.0 for k in range(m) if meets[k] > FACE), "another wall goes on from the end"


@pytest.mark.parametrize("eta", [0.0, 300.0])
def test_motion(tmp_path: Path, eta: float) -> None:
    """Places and velocities after one kick by random forces, some components fixed."""
    sim = cloud(tmp_path, False, 3, gravity=(0.4, -9.8), lsm=eta)
    for first, dofs in ((10, ("x",)), (30, ("y", "spin")), (50, ("x", "y", "spin"))):
        properties.fix(sim, dofs, Ids(first, first + 15))
    cycles.prepare(sim)
    p, rows, s = sim.particles, sim.lists.force_rows(), sim.settings
    sim.lists.force[rows, :3] = np.random.default_rng(5).normal(0.0, 1e4, (len(p), 3))
    hot, cold = p.hot[p.owned].copy(), p.cold.copy()
    place, velocity = np.column_stack([hot[:, [X, Y]], cold[:, ANGLE]]), hot[:, [VX, VY, SPIN]]
    fixed = (p.icold[:, [FIX]] & [1, 2, 4]) != 0
    place, velocity = reference.move(
        place, velocity, sim.lists.owned_forces(), sim.body[:, [MASS, MASS, INERTIA]], fixed, sim.body[:, ALPHA],
        (s.gx, s.gy), eta, s.dt,
    )  # fmt: skip
    sim._mover(sim.lists.n_blocks, 0, len(p), *sim._move_args)
    hot = p.hot[p.owned]
    assert fixed.any(axis=0).all() and not fixed.all()
    assert np.column_stack([hot[:, [X, Y]], p.cold[:, ANGLE]]) == pytest.approx(place, rel=1e-14, abs=1e-14)
    assert hot[:, [VX, VY, SPIN]] == pytest.approx(velocity, rel=1e-13, abs=1e-13)
