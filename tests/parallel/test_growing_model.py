"""Particles come and go in mid-run, on any number of ranks: same files, ids used once, borders that move at once, and
generation that depends on nothing but its seed and the particles in its way."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import particles
from hpcdem.io.frames import list_frames, read_frame
from hpcdem.physics.dem.simulation import Simulation
from tests.property.workers import Resident
from tests.short_push import assert_same_files, contents
from tests.support import model

# ---- a script in which a bed is pushed, buried on one side, eroded, and buried again -----------------------------

GROWING = """\
START
SET disk off
BOX left 0.0 right 10000.0 bottom 0.0 height 6000.0
WALL id 0 nodes (0.0, 50.0) (9900.0, 50.0)
WALL id 1 nodes (50.0, 5500.0) (50.0, 50.0)
WALL id 2 nodes (9900.0, 50.0) (9900.0, 5500.0)
GEN num 700 rad discrete 50.0 70.0 x (50.0, 9900.0) y (50.0, 1600.0) group bed
PROP density 2.5e3 fric 0.0 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8
SET print 100
CYC 300
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3
WALL id 1 xv 8.0
IMPLE wall id 1 xmove 80.0 print 40.0 save 80.0
GEN num 700 rad discrete 40.0 60.0 x (6500.0, 9900.0) y (1000.0, 4000.0) group rain
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group rain
CYC 200
DEL range x 5000.0 10000.0
CYC 100
GEN num 300 rad discrete 50.0 70.0 x (4000.0, 9900.0) y (50.0, 1600.0) group second
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group second
CYC 100
DEL range group second
SAV half.sav
"""

REST = """\
GEN num 200 rad discrete 40.0 50.0 x (50.0, 5000.0) y (50.0, 2500.0) group third
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group third
CYC 200
EXP end.dat group
STOP
"""

# All particles vanish; a later pile has a single column; then the model is wide again. No BOX tells how wide it may be.
STARVED = """\
START
SET disk off
WALL id 0 nodes (0.0, 50.0) (5900.0, 50.0)
GEN num 200 rad discrete 50.0 70.0 x (50.0, 5900.0) y (50.0, 1000.0) group first
PROP density 2.5e3 fric 0.2 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8
SET print 50
HIST id 1 interval 20 kinetic
CYC 60
DEL
CYC 60
GEN num 200 rad discrete 50.0 70.0 x (50.0, 5900.0) y (50.0, 1000.0) group next
PROP density 2.5e3 fric 0.2 shear 2.9e9 poiss 0.2 damp 0.3 hertz
CYC 60
DEL range x 0.0 2800.0
DEL range x 2950.0 6000.0
SAV column.sav
CYC 60
GEN num 200 rad discrete 50.0 70.0 x (50.0, 5900.0) y (1100.0, 2000.0) group last
PROP density 2.5e3 fric 0.2 shear 2.9e9 poiss 0.2 damp 0.3 hertz range group last
CYC 60
EXP end.dat
STOP
"""


GROUPS = ("bed", "rain", "second", "third")


def run_text(resident: Resident, text: str, folder: Path, ranks: int, *options: str) -> Path:
    """Run a script, by the name of its folder, in that folder."""
    folder.mkdir(parents=True, exist_ok=True)
    script = folder / "script.py"
    script.write_text(text)
    done = resident(ranks, script, "--no-figure", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def grown(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The growing model on one rank."""
    return run_text(resident, GROWING + REST, tmp_path_factory.mktemp("growing") / "one", 1)


@pytest.fixture(scope="module")
def starved(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model that loses its particles, on one rank."""
    return run_text(resident, STARVED, tmp_path_factory.mktemp("starved") / "one", 1)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_growing_model_on_more_ranks(grown: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    assert_same_files(grown, run_text(resident, GROWING + REST, tmp_path / "more", ranks))


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_growth_continues_after_a_restart(grown: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    """RES and GEN give what the run without a break gave: particles, ids, frames."""
    (tmp_path / "again").mkdir()
    shutil.copy(grown / "half.sav", tmp_path / "again")
    again = run_text(resident, "RES half.sav\n" + REST, tmp_path / "again", ranks)
    for path in list((again / "data").glob("all_*")) + [again / "end.dat"]:
        assert path.read_bytes() == (grown / path.relative_to(again)).read_bytes(), path.name
    assert len(list((again / "data").glob("all_*.dat"))) == 3


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_strips_without_particles(starved: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    """No particles at all, and fewer columns than ranks: the run goes on."""
    assert_same_files(starved, run_text(resident, STARVED, tmp_path / "more", ranks))


@pytest.mark.mpi
def test_restart_of_a_model_with_fewer_columns_than_ranks(starved: Path, resident: Resident, tmp_path: Path) -> None:
    """A run that got so far on 3 ranks must be able to go on with them."""
    shutil.copytree(starved, tmp_path / "again")
    rest = "RES column.sav\n" + STARVED.split("SAV column.sav\n")[1]
    assert (run_text(resident, rest, tmp_path / "again", 3) / "end.dat").read_bytes() == (
        starved / "end.dat"
    ).read_bytes()


def test_starved_model_was_starved(starved: Path) -> None:
    counts = [len(read_frame(f.path, ("particles",)).tables["particles"]) for f in list_frames(starved / "data")]
    assert 0 in counts and any(0 < n < 20 for n in counts)
    x = contents(starved / "column.sav")["particles/x"]
    assert len(x) > 1 and np.ptp(x) < 160.0


def test_ids_are_never_used_again(grown: Path) -> None:
    """Later particles have higher ids than all before them, also where the highest had been deleted, and after SAV."""
    ever: dict[int, tuple[str, float]] = {}
    for file in list_frames(grown / "data"):
        frame = read_frame(file.path, ("particles",))
        rows = frame.tables["particles"].columns
        for gid, group, radius in zip(rows["gid"].tolist(), rows["group"].tolist(), rows["radius"].tolist()):
            who = frame.group_names[group], radius
            assert ever.setdefault(gid, who) == who, f"id {gid} was {ever[gid]}, then {who}"
    ids = {name: [gid for gid, (group, _) in ever.items() if group == name] for name in GROUPS}
    for earlier, later in pairwise(GROUPS):
        assert min(ids[later]) > max(ids[earlier])
    at_save = contents(grown / "half.sav")
    assert at_save["particles/gid"].max() < min(ids["second"])
    assert min(ids["third"]) == json.loads(str(at_save["@state"]))["next_gid"] == max(ids["second"]) + 1


# ---- borders and generation, seen from a program -----------------------------------------------------------------

PROGRAM = """\
import json
import sys

import numpy as np

import hpcdem

sim = hpcdem.Simulation()
comm = sim.engine.comm
sim.set(disk="off", dt=0.04, gravity=(0.0, -9.8), seed=4)
sim.wall(0, nodes=((0.0, 50.0), (12000.0, 50.0)))
seen = []
made = []


def here_and_now(what):
    \"\"\"Particles of each rank in the step after a change, and what each would have with the borders of before.\"\"\"
    old, side = sim.engine.ownership.borders.copy(), sim.engine.ownership.side
    sim.prop(density=2.5e3, fric=0.2, shear=2.9e9, poiss=0.2, damp=0.3, hertz=True)
    sim.cycle(1)
    x = sim.gather("x")
    owner = np.searchsorted(old[1:-1] * side, x, side="right")
    before = np.bincount(owner, minlength=sim.ranks).tolist()
    seen.append({"what": what, "now": comm.allgather(len(sim)), "before": before})


def new_rows():
    x, y, r = sim.gather("x", "y", "radius")
    made.append(np.column_stack([x, y, r]).tolist())


sim.gen(900, rad=[50.0, 60.0], x=(0.0, 12000.0), y=(50.0, 1500.0))
new_rows()
here_and_now("begin")
sim.cycle(200)
sim.gen(800, rad=[40.0, 50.0], x=(8500.0, 12000.0), y=(300.0, 4300.0))
new_rows()
here_and_now("rain on the right")
sim.cycle(100)
sim.delete("x 6000.0 20000.0")
here_and_now("right half gone")
sim.cycle(100)
sim.gen(800, rad=[40.0, 50.0], x=(8500.0, 12000.0), y=(300.0, 4300.0))
new_rows()
here_and_now("rain again")
if sim.rank == 0:
    json.dump({"seen": seen, "made": made}, open(sys.argv[1], "w"))
"""

WAYS = {
    "2 ranks": (2, []),
    "3 ranks, borders stay": (3, ["--no-balance"]),
    "4 ranks": (4, []),
}


def run_program(resident: Resident, folder: Path, ranks: int, *options: str) -> dict:
    """What the program saw."""
    folder.mkdir(exist_ok=True)
    (folder / "grow.py").write_text(PROGRAM)
    done = resident(ranks, *options, "--no-figure", folder / "grow.py", folder / "seen.json", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads((folder / "seen.json").read_text())


@pytest.fixture(scope="module")
def watched(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, dict]]:
    """What the program saw in each way of running it, filled as the tests go."""
    folder = tmp_path_factory.mktemp("watched")
    yield {"alone": run_program(resident, folder, 1)}


@pytest.mark.mpi
@pytest.mark.parametrize(
    "way", [way if way == "2 ranks" else pytest.param(way, marks=pytest.mark.slow) for way in WAYS]
)
def test_borders_move_at_once(watched: dict[str, dict], resident: Resident, tmp_path: Path, way: str) -> None:
    """In the step after GEN or DEL no rank has much more than its share, whatever it had before, and everything was
    made and moved as on one rank."""
    ranks, options = WAYS[way]
    found = run_program(resident, tmp_path, ranks, *options)
    assert found["made"] == watched["alone"]["made"]
    for moment in found["seen"]:
        now, before = np.array(moment["now"]), np.array(moment["before"])
        assert now.sum() == before.sum() > 200
        assert now.max() <= 1.25 * now.mean(), moment
        if ranks > 1 and moment["what"] != "begin":
            assert before.max() > 1.4 * now.mean(), moment


# ---- generation alone --------------------------------------------------------------------------------------------


def rows(sim: Simulation) -> np.ndarray:
    """(n, 3) x, y, r of all particles in the order of ids."""
    p = sim.particles
    return np.column_stack([p["x"], p["y"], p["radius"]])[np.argsort(p["gid"])]


def bed(folder: Path, seed: int, high: float = 1000.0) -> Simulation:
    """A model with one GEN."""
    sim = model(folder, seed=seed)
    assert particles.gen(sim, 300, [30.0, 50.0], (0.0, 4000.0), (0.0, high)) > 100
    return sim


def test_gen_depends_on_the_seed(tmp_path: Path) -> None:
    first, same, other = (rows(bed(tmp_path, seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert not np.intersect1d(first[:, 0], other[:, 0]).size


def test_two_gens_in_a_row_differ(tmp_path: Path) -> None:
    sim = bed(tmp_path, 1)
    n = len(sim.particles)
    particles.gen(sim, 300, [30.0, 50.0], (0.0, 4000.0), (5000.0, 6000.0))
    both = rows(sim)
    assert not np.intersect1d(both[:n, 0], both[n:, 0]).size


def test_the_rest_of_the_model_does_not_matter(tmp_path: Path) -> None:
    """Same seed, second GEN of the script: the same discs, however many others there are elsewhere, and wherever they
    stand in memory."""
    tails = []
    for high in (700.0, 1000.0):
        sim = bed(tmp_path, 1, high)
        n = len(sim.particles)
        particles.gen(sim, 300, [30.0, 50.0], (0.0, 4000.0), (5000.0, 6000.0))
        tails.append(rows(sim)[n:])
    np.testing.assert_array_equal(*tails)


def test_who_is_in_the_way_matters_not_where_he_stands_in_memory(tmp_path: Path) -> None:
    made = []
    for turn in (False, True):
        sim = bed(tmp_path, 1)
        n = len(sim.particles)
        if turn:
            p = sim.particles
            p.set_owned(p.hot[p.owned][::-1].copy(), p.cold[::-1].copy())
        particles.gen(sim, 2000, [15.0, 20.0], (500.0, 4500.0), (0.0, 1200.0))
        made.append(rows(sim))
    np.testing.assert_array_equal(*made)
    everyone, new = made[0], made[0][n:]
    assert len(new) > 100
    gap = np.hypot(*(new[:, None, k] - everyone[None, :, k] for k in (0, 1))) - new[:, None, 2] - everyone[None, :, 2]
    gap[np.arange(len(new)), n + np.arange(len(new))] = np.inf
    assert gap.min() >= 0.0
    inside = new[:, :2] - new[:, 2:], new[:, :2] + new[:, 2:]
    assert (inside[0] >= [500.0, 0.0]).all() and (inside[1] <= [4500.0, 1200.0]).all()


def test_gen_into_a_full_place(tmp_path: Path) -> None:
    """Nothing is made, nothing is spoilt, and the next GEN goes its own way."""
    sim = model(tmp_path, seed=1)
    particles.gen_grid(sim, [50.0], (0.0, 1000.0), (0.0, 1000.0))
    assert particles.gen(sim, 100, [40.0], (100.0, 900.0), (100.0, 900.0)) == 0
    assert sim.next_gid == len(sim.particles) == 100
    assert particles.gen(sim, 10, [40.0], (2000.0, 4000.0), (0.0, 1000.0)) == 10
    assert rows(sim).shape == (110, 3) and sim.next_gid == 110
