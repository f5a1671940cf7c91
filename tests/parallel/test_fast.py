"""A few particles far faster than all others: they do not cost the many their lists, and the bits are the same on any
number of ranks and threads, and across a restart.

The model: a bonded bed on a row of particles, pushed by a wall that speeds up; discs fall below it, two of them one
behind the other; others are thrown along the surface and against it, and two that are one clump.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, particles, properties, walls
from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import RADIUS, X, Y
from hpcdem.core.selection import Ids
from hpcdem.physics.dem.kernels import fast
from hpcdem.physics.dem.kernels.fast import Fast
from hpcdem.physics.dem.kernels.walls import closest
from hpcdem.physics.dem.simulation import Simulation
from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files, contents
from tests.support import model, only, value

STRAYS = """\
START
SET disk on
BOX left 0.0 right 12000.0 bottom -9000.0 height 16000.0
WALL id 1 nodes (60.0, 5000.0) (60.0, 40.0) kn 0 ks 0
WALL id 2 nodes (11900.0, 40.0) (11900.0, 900.0) kn 0 ks 0
GLINE P1 (60.0, 0.0) P2 (11900.0, 0.0) rad 60.0 group base
GEN grid rad discrete 50.0 60.0 x (80.0, 11800.0) y (60.0, 1100.0) group bed
PROP density 2e5 fric 0.3 shear 2.9e9 poiss 0.2 damp 0.4 hertz
FIX x y spin RANGE group base
SET dt 0.04 gravity 0.0 -9.8
SET print 300
SET save 130
CYC 600
PROP ebmod 2e8 gbmod 2e8 tstrength 2e6 sstrength 4e6
BALL id 9001 x 4000.0 y -400.0 rad 50.0 group stray
BALL id 9002 x 4010.0 y -700.0 rad 60.0 group stray
BALL id 9003 x 300.0 y 1300.0 rad 50.0 group stray
BALL id 9004 x 6000.0 y 2400.0 rad 60.0 group stray
BALL id 9005 x 9000.0 y 1500.0 rad 50.0 group stray
BALL id 9006 x 2000.0 y 1500.0 rad 50.0 group stray
BALL id 9007 x 2060.0 y 1540.0 rad 60.0 group stray
BALL id 9008 x 11000.0 y 2000.0 rad 50.0 group stray
BALL id 9009 x 8000.0 y -500.0 rad 50.0 group stray
PROP density 2e5 fric 0.3 shear 2.9e9 poiss 0.2 damp 0.1 hertz RANGE group stray
CLUMP RANGE id 9006 9007
INI yv -41.0 RANGE id 9001 9001
INI yv -30.0 RANGE id 9002 9002
INI xv 60.0 RANGE id 9003 9003
INI xv -30.0 yv -50.0 RANGE id 9004 9004
INI xv -60.0 RANGE id 9005 9005
INI xv 40.0 spin 0.2 RANGE id 9006 9007
INI xv 90.0 RANGE id 9008 9008
INI yv -60.0 RANGE id 9009 9009
WALL id 1 xv 0.5
CYC 450
WALL id 1 xv 4.0
IMPLE wall id 1 xmove 70.0 save 20.0 print 40.0
STOP
"""


def run(resident: Resident, folder: Path, ranks: int, *options: str) -> None:
    """The model in a folder."""
    folder.mkdir(exist_ok=True)
    script = folder / "strays.py"
    script.write_text(STRAYS)
    done = resident(ranks, script, "--no-figure", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def reference(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run on one rank and one thread."""
    folder = tmp_path_factory.mktemp("strays") / "one"
    run(resident, folder, 1)
    return folder


def states(folder: Path) -> list[dict]:
    """The state of each checkpoint."""
    return [json.loads(str(contents(path)["@state"])) for path in sorted((folder / "data").glob("*.sav"))]


def test_the_model_has_what_it_takes(reference: Path) -> None:
    """Fast particles with pairs far away and alone, a clump among them, and lists that were never late."""
    found = states(reference)
    fast = [{int(row[0]): bool(row[2]) for row in state["fast"]} for state in found]
    assert any(state["lattice"]["columns"] >= 4 for state in found)
    assert any(len(names) >= 5 for names in fast)
    assert any(names.get(9009) for names in fast) and any(9006 in names for names in fast)
    assert all(state["lattice"]["late"] == 0 for state in found)


@pytest.mark.mpi
@pytest.mark.parametrize("case", layouts(("3 ranks",)))
def test_same_files_however_it_is_run(reference: Path, resident: Resident, tmp_path: Path, case: str) -> None:
    ranks, options = LAYOUTS[case]
    run(resident, tmp_path / "other", ranks, *options)
    assert_same_files(reference, tmp_path / "other")


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_resumed_run_equals_the_uninterrupted_one(
    reference: Path, resident: Resident, tmp_path: Path, ranks: int
) -> None:
    """From the first checkpoint with fast particles whose pairs lie several columns apart."""
    folder = tmp_path / "resumed"
    shutil.copytree(reference, folder)
    start = next(k for k, state in enumerate(states(folder)) if state["lattice"]["columns"] >= 4 and state["closed"])
    for path in sorted((folder / "data").glob("*.sav"))[start + 1 :]:
        path.unlink()
    run(resident, folder, ranks, "--resume")
    assert_same_files(reference, folder)


# ---- on one rank, step by step -----------------------------------------------------------------------------------


def bed(folder: Path, *strays: tuple[float, float, float, float], wall: float = 0.0) -> Simulation:
    """Discs of 60 m at rest without gravity, bonded, between a floor and a wall that moves at this speed [m/s]; strays:
    x, y, vx, vy of more, ids 1000, 1001, ..."""
    sim = model(folder, dt=0.04, disk="off")
    walls.wall(sim, 0, ((-1000.0, 0.0), (5000.0, 0.0)))
    walls.wall(sim, 1, ((-1000.0, 3000.0), (-1000.0, 0.0)), xv=wall)
    particles.gen_grid(sim, [60.0], (0.0, 3600.0), (0.0, 600.0))
    for k, (x, y, vx, vy) in enumerate(strays):
        particles.ball(sim, 1000 + k, x, y, 60.0)
        properties.prop(sim, only(1000 + k), xv=vx, yv=vy)
    properties.prop(sim, density=2500.0, fric=0.3, shear=2.9e9, poiss=0.2, hertz=True)
    bonds.bond(sim, Ids(0, 999), ebmod=2e8, gbmod=2e8, tstrength=1e12, sstrength=1e12)
    cycles.prepare(sim)
    return sim


THROWN = [(-800.0, 300.0, 50.0, 0.0), (4000.0, 900.0, -60.0, -30.0), (2000.0, 900.0, 10.0, -40.0), (3000, -80, 0, -45)]


def test_no_contact_is_missed(tmp_path: Path) -> None:
    """After each step all pairs that touch, and all walls that are touched, are in the lists. With few rebuilds."""
    sim = bed(tmp_path, *THROWN, wall=1.0)
    touched, far = set(), False
    for _ in range(400):
        sim.step()
        p = sim.particles
        x, y, r = p["x"], p["y"], p["radius"]
        d = np.hypot(x[:, None] - x, y[:, None] - y)
        pairs = set(zip(*np.nonzero(np.triu(d < r[:, None] + r, 1)), strict=True))
        n = sim.lists.ptr[-1]
        listed = set(zip(sim.lists.row[:n].tolist(), sim.lists.partner[:n].tolist(), strict=True))
        assert pairs <= listed
        at_walls = {
            (i, w)
            for w, wall in enumerate(sim.walls.table())
            for i, row in enumerate(p.hot)
            if np.hypot(*np.subtract(closest(wall, row[X], row[Y])[2:], row[X : Y + 1])) < row[RADIUS]
        }
        assert at_walls <= set(zip(sim.lists.slot_row.tolist(), sim.lists.slot_wall.tolist(), strict=True))
        strays = set(np.flatnonzero(p["gid"] >= 1000).tolist())
        touched |= {int(p["gid"][i]) for pair in pairs for i in pair if i in strays}
        far = far or sim.rebuild_state.columns > 2
    assert touched >= {1000, 1001, 1002} and far
    assert sim.rebuild_state.late == 0 and sim.rebuilds < 40


@pytest.mark.parametrize("speed", [41.0, 120.0])
def test_one_stray_particle_does_not_set_the_pace(tmp_path: Path, speed: float) -> None:
    """A disc that falls through the floor: lists are built for it a few times until it is known, then hardly ever. What
    it is like without it is the standard; before there was one rebuild in six (two) steps."""
    sim = bed(tmp_path, (1800.0, -200.0, 0.0, -speed))
    cycles.cycle(sim, 1000)
    assert value(sim, "y", 1000) == pytest.approx(-200.0 - 1000 * 0.04 * speed)
    assert sim.rebuilds < 20


def test_a_disc_that_falls_for_ever_stops_nobody(tmp_path: Path) -> None:
    """Nothing is in its way, so it may move more than half its radius per step: its speed is that of free fall."""
    sim = bed(tmp_path, (1800.0, -200.0, 0.0, -41.0))
    sim.settings.gy = -9.8
    properties.fix(sim, ("x", "y", "spin"), Ids(0, 999))
    cycles.cycle(sim, 2500)
    assert value(sim, "vy", 1000) == pytest.approx(-41.0 - 9.8 * 0.04 * 2500)
    assert value(sim, "vy", 1000) * -0.04 > 30.0
    assert sim.rebuilds < 40


def test_a_disc_that_is_too_fast_near_others_still_stops_the_run(tmp_path: Path) -> None:
    """On its way to the bed it may be as fast as it likes, not when it comes near."""
    sim = bed(tmp_path, (1800.0, 8000.0, 0.0, -740.0))
    sim.settings.gy = -9.8
    properties.fix(sim, ("x", "y", "spin"), Ids(0, 999))
    with pytest.raises(PhysicsError, match="particle 1000 at"):
        cycles.cycle(sim, 300)
    assert value(sim, "vy", 1000) * -0.04 > 31.0 and value(sim, "y", 1000) < 2000.0


def test_a_disc_that_leaves_the_box_is_deleted_at_the_next_check(tmp_path: Path) -> None:
    """Although lists are hardly ever built: they are when a fast particle has left the BOX."""
    sim = bed(tmp_path, (1800.0, -200.0, 0.0, -41.0))
    walls.box(sim, -2000.0, 6000.0, -1000.0, 5000.0)
    properties.prop(sim, only(1000), kn=1e6, ks=1e6)
    cycles.cycle(sim, 800 * 25 // 41 + 70)
    assert sim.lost == 1 and 1000 not in sim.particles["gid"]


def test_steps_are_the_same_as_with_lists_for_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same motion as when lists are built for the fast ones too, but for rounding in another order of sums."""
    ends = []
    for few in (16, 0):
        monkeypatch.setattr("hpcdem.physics.dem.kernels.fast.FEWEST", few)
        monkeypatch.setattr("hpcdem.physics.dem.kernels.fast.SHARE", 100 if few else 10**9)
        sim = bed(tmp_path, *THROWN)
        cycles.cycle(sim, 150)
        order = np.argsort(sim.particles["gid"])
        ends.append((sim.rebuilds, sim.particles.positions()[order]))
    assert ends[0][0] < 0.5 * ends[1][0]
    assert ends[0][1] == pytest.approx(ends[1][1], abs=1e-6)


def test_whom_it_pays_to_treat_as_fast() -> None:
    counts = np.zeros(fast.CLASSES, np.int64)
    assert fast.slowest_class(counts, 20_000, 0.0, 0.1) is None  # nobody
    counts[5] = 1
    assert fast.slowest_class(counts, 20_000, 0.0, 0.1) == 0
    assert fast.slowest_class(counts, 20_000, 0.9, 0.1) is None  # a wall is nearly as fast
    counts[0:4] = 300, 150, 60, 20
    assert fast.slowest_class(counts, 20_000, 0.0, 0.1) == 2  # 81 are few, 231 are too many
    counts[4] = 5000
    assert fast.slowest_class(counts, 20_000, 0.0, 0.1) is None  # the gain would be small
    which, classes = fast.classes(np.array([0.05, 0.1, 0.15, 0.21, 0.25, 7.0]), 0.1)
    assert which.tolist() == [2, 3, 4, 5] and classes.tolist() == [0, 1, 1, 6]


def test_the_list_of_fast_ones_survives_json() -> None:
    one = Fast(np.array([3, 7]), np.array([0.1, np.inf]), np.array([False, True]))
    other = Fast.restored(json.loads(json.dumps(one.state())))
    assert other.state() == one.state() and len(other) == 2 and other.alone.dtype == bool
    assert [a.tolist() for a in one.among(np.array([7, 5, 3, 9]))] == [[0, 2], [1, 0]]
