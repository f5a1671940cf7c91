"""A Python program and the ZDEM script that says the same write the same files, on any number of ranks."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.runtime.run_folder import RECORD
from tests.conftest import Launcher
from tests.property.workers import Resident
from tests.short_push import contents

ZDEM = """\
START
SET disk off seed 5
BOX left 0.0 right 5000.0 bottom 0.0 height 4000.0
WALL id 0 nodes (0.0, 50.0) (4800.0, 50.0)
WALL id 1 nodes (50.0, 3900.0) (50.0, 50.0) color blue
WALL id 2 nodes (4800.0, 50.0) (4800.0, 3900.0)
GLINE p1 (400.0, 110.0) p2 (1600.0, 110.0) rad 60.0 group row
FIX x y spin range group row
GEN num 1500 rad discrete 50.0 70.0 x (50.0, 4800.0) y (200.0, 3000.0) group bed
BALL id 5000 x 3000.0 y 3500.0 rad 80.0 color red group stone
PROP density 2.5e3 fric 0.0 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8
SET print 400
HIST id 1 interval 100 kinetic
CYC 500
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3 range group bed
PROP color mg range y {top}-600.0 {top} and x 0.0 2500.0
WALL id 0 fric 0.3
WALL id 1 fric 0.3 xv 8.0
IMPLE wall id 1 xmove 96.0 save 48.0 print 48.0
DEL range y {top}-300.0 {top}
GEN num 60 rad discrete 50.0 60.0 x (1500.0, 4500.0) y (2200.0, 3600.0) color red group rain
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group rain
FREE x range group row
BOND break range x 0.0 1500.0
EXP end.dat group range group rain
WALL id 0 delete
CYC 300
STOP
"""

PYTHON = """\
import hpcdem

seen = []
sim = hpcdem.Simulation()
sim.every(7, lambda s: seen.append((s.kinetic_energy(), s.wall_force(1), s.contacts()["fn"].sum())))
sim.set(disk="off", seed=5)
sim.box(0.0, 5000.0, 0.0, 4000.0)
sim.wall(0, nodes=((0.0, 50.0), (4800.0, 50.0)))
sim.wall(1, nodes=((50.0, 3900.0), (50.0, 50.0)), color="blue")
sim.wall(2, nodes=((4800.0, 50.0), (4800.0, 3900.0)))
sim.gline((400.0, 110.0), (1600.0, 110.0), 60.0, group="row")
sim.fix("x", "y", "spin", where="group row")
sim.gen(1500, rad=[50.0, 70.0], x=(50.0, 4800.0), y=(200.0, 3000.0), group="bed")
sim.ball(3000.0, 3500.0, 80.0, id=5000, color="red", group="stone")
sim.prop(density=2.5e3, fric=0.0, shear=2.9e9, poiss=0.2, damp=0.3, hertz=True)
sim.set(dt=0.04, gravity=(0.0, -9.8))
sim.set(print=400)
sim.hist(1, 100, "kinetic")
sim.cycle(500)
sim.bond("group bed", ebmod=2e8, gbmod=2e8, tstrength=1e6, sstrength=2e6, fric=0.3)
sim.prop("y {top}-600.0 {top} and x 0.0 2500.0", color="mg")
sim.wall(0, fric=0.3)
sim.command("WALL id 1 fric 0.3 xv 8.0")
sim.imple(1, xmove=96.0, save=48.0, print=48.0)
sim.delete("y {top}-300.0 {top}")
sim.gen(60, rad=[50.0, 60.0], x=(1500.0, 4500.0), y=(2200.0, 3600.0), color="red", group="rain")
sim.prop("group rain", density=2.2e3, fric=0.4, shear=2.9e9, poiss=0.2, damp=0.2, hertz=True)
sim.free("x", where="group row")
sim.break_bonds("x 0.0 1500.0")
sim.export("end.dat", group=True, where="group rain")
sim.command('''
# a comment at the beginning, and a blank line

SET print 0   # a comment
WALL id 0 delete
CYC 300
''')
assert len(seen) == sim.steps // 7, len(seen)
"""


@pytest.fixture(scope="module")
def script(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the run of the ZDEM script on one rank."""
    folder = tmp_path_factory.mktemp("zdem")
    (folder / "model.py").write_text(ZDEM.replace("CYC 300", "SET print 0\nCYC 300"))
    done = resident(1, "model.py", "--no-figure", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def assert_same(one: Path, other: Path) -> None:
    """Frames, series, exported rows; of checkpoints all but the text of the script and the place in it.

    A Python program writes its last state in any case, a script only if it says so.
    """
    assert (one / "end.dat").read_text() == (other / "end.dat").read_text()
    names = sorted(p.name for p in (one / "data").iterdir())
    more = {p.name for p in (other / "data").iterdir()} - set(names) - {"all_0000001100.jpg"}
    assert more == {"all_0000001100.vtkhdf", "all_0000001100.dat"}
    for name in names:
        a, b = one / "data" / name, other / "data" / name
        if a.suffix in (".vtkhdf", ".sav"):
            left, right = contents(a), contents(b)
            assert left.keys() == right.keys()
            different = [k for k in left if left[k].tobytes() != right[k].tobytes()]
            assert set(different) <= ({"@state", "@crc"} if a.suffix == ".sav" else set()), name
        elif name != RECORD:  # which says who wrote here
            assert a.read_bytes() == b.read_bytes(), name


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_python_says_what_the_script_says(script: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    (tmp_path / "model.py").write_text(PYTHON)
    done = resident(ranks, "model.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert_same(script, tmp_path)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_the_same_program_started_by_python(script: Path, launch: Launcher, tmp_path: Path, ranks: int) -> None:
    (tmp_path / "model.py").write_text(PYTHON)
    done = launch.python(ranks, "model.py", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "particle-steps/s" in done.stdout and "figure: " in done.stdout
    assert_same(script, tmp_path)


STEERED = """\
import numpy as np
import hpcdem

sim = hpcdem.Simulation()
sim.set(dt=2e-4, gravity=(0.0, -9.8), disk="on", print=500)
sim.box(-1.0, 31.0, -1.0, 40.0)
sim.wall(0, nodes=((0.0, 0.0), (30.0, 0.0)), kn=1e6, ks=1e6)
sim.wall(1, nodes=((0.0, 30.0), (0.0, 0.0)), kn=1e6, ks=1e6)
sim.wall(2, nodes=((30.0, 0.0), (30.0, 30.0)), kn=1e6, ks=1e6)
sim.gen(400, rad=[0.5, 0.7], x=(0.0, 30.0), y=(0.0, 30.0), group="sand")
sim.prop(density=2000.0, kn=1e6, ks=1e6, fric=0.2, damp=0.5)


def steer(s):
    # A wall that follows the force on it, rain, erosion, and velocities set by hand.
    fx, fy = s.wall_force(1)
    s.wall(1, xv=float(np.clip(-2e-4 * fx, 0.0, 1.0)))
    if s.steps == 600:
        s.gen(100, rad=[0.5], x=(2.0, 10.0), y=(20.0, 38.0), color="blue", group="rain")
        s.prop("group rain", density=2000.0, kn=1e6, ks=1e6)
    if s.steps == 900:
        s.delete("x 20 30")
        s["vx"] = np.where(s["group"] == "rain", 0.5, s["vx"])
    if s.steps == 1200:
        s["x"] = s["x"] + 0.01
    return s.steps == 1750


call = sim.every(50, steer)
sim.cycle(4000)
call.cancel()
assert sim.steps == 1750, sim.steps
sim.save("middle.sav")
sim.cycle(100)
x, group = sim.gather("x", "group")
if sim.rank == 0:
    print("END", sim.steps, float(x.sum()).hex(), (group == "rain").sum(), len(x))
"""


@pytest.mark.mpi
def test_a_function_may_steer_the_run(resident: Resident, tmp_path: Path) -> None:
    """Servo wall, GEN, DEL and fields set in the middle of a cycle; an early end: the same on all numbers of ranks."""
    ends = []
    for ranks in (1, 3):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "model.py").write_text(STEERED)
        done = resident(ranks, "model.py", "--no-figure", cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        ends.append([line for line in done.stdout.splitlines() if line.startswith("END")])
    assert len(ends[0]) == 1 and ends[0] == ends[1]
    rain = int(ends[0][0].split()[3])
    assert rain > 20
    one, three = (contents(tmp_path / n / "data" / "all_0000001850.vtkhdf") for n in ("1", "3"))
    assert all(one[k].tobytes() == three[k].tobytes() for k in one)
