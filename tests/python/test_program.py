"""How a Python program that uses hpcdem starts, fails and goes on; what the names in it give."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.conftest import ROOT, Launcher
from tests.property.workers import Resident
from tests.tables import each

HEAD = """\
import hpcdem

sim = hpcdem.Simulation()
sim.set(dt=1e-3, gravity=(0.0, -9.8))
sim.box(-20.0, 120.0, -20.0, 300.0)
sim.wall(0, nodes=((0.0, 0.0), (100.0, 0.0)))
sim.gen(300, rad=[1.0, 1.5], x=(0.0, 100.0), y=(2.0, 100.0), color="red", group="rock")
sim.prop(density=2000.0, shear=1e7, poiss=0.2, hertz=True, damp=0.2)
"""


def program(folder: Path, text: str, head: str = HEAD) -> Path:
    """A program in a folder of its own."""
    path = folder / "study.py"
    path.write_text(head + text)
    return path


WRONG = {
    "unknown keyword": ("sim.prop(frci=0.3)", "prop: .*frci"),
    "unknown colour": ("sim.prop(color='pink')", "prop: expected a colour"),
    "word for a number": ("sim.cycle('many')", "cycle: .*many"),
    "negative steps": ("sim.cycle(-1)", "cycle: .*not negative"),
    "no such wall": ("sim.imple(9, xmove=1.0)", "imple: there is no wall with id 9"),
    "wall that stands": ("sim.imple(0, xmove=1.0)", "imple: wall 0 does not move"),
    "wrong RANGE": ("sim.delete('z 0 1')", "delete: where 'z 0 1': .*read 'z'"),
    "no RANGE at all": ("sim.delete(3.0)", "delete: where: expected the text of a RANGE"),
    "wrong command": ("sim.command('PROPP fric 0.3')", "command: read 'PROPP'"),
    "wrong value in a command": ("sim.command('SET dt 0.1\\nSET dt -1')", "command: SET"),
    "mistyped field": ("sim['radus']", "there is no field 'radus'; did you mean 'radius'\\?"),
    "mistyped setting": ("sim.set(gravty=(0.0, -9.8))", "set: SET has no option gravty; did you mean 'gravity'\\?"),
    "unknown field": ("sim['velocity']", "there is no field 'velocity'"),
    "field that is not to be set": ("sim['gid'] = 3", "field 'gid' cannot be set"),
    "wrong length": ("sim['vx'] = [1.0, 2.0, 3.0]", "field 'vx' has .* values on this rank"),
    "not a number": ("sim['vx'] = float('nan')", "field 'vx' must be finite"),
    "missing file": ("sim.load('nowhere.dat')", "load: there is no file"),
    "cycle in a function": ("sim.every(5, lambda s: s.cycle(1)); sim.cycle(10)", "cannot be used by a function"),
    "no steps": ("sim.every(0, print)", "every: expected a number of steps"),
    "other threads": ("hpcdem.Simulation(threads=7)", "7 requested"),
    "two kinds of bond": ("sim.bond(ebmod=1e8, n_bond=1e3)", "bond: a bond is either"),
}


@each("case", WRONG)
def test_a_mistake_is_named_with_its_line(resident: Resident, tmp_path: Path, case: str) -> None:
    text, expected = WRONG[case]
    program(tmp_path, text + "\n")
    done = resident(1, "study.py", cwd=tmp_path)
    line = len(HEAD.splitlines()) + 1
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    place = "" if case == "other threads" else f"study.py:{line}: "
    assert len(done.stderr.strip().splitlines()) == 1
    assert re.search(f"^hpcdem: {place}.*{expected}", done.stderr), done.stderr


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("how", ["hpcdem", "python"])
def test_a_mistake_stops_all_ranks_with_one_message(launch: Launcher, tmp_path: Path, how: str) -> None:
    program(tmp_path, "sim.prop(density=-1.0)\n")
    start = launch if how == "hpcdem" else launch.python
    done = start(3, "study.py", cwd=tmp_path, timeout=120)
    assert done.returncode == 2
    assert done.stderr.count(f"study.py:{len(HEAD.splitlines()) + 1}: prop: ") == 1 and "Traceback" not in done.stderr
    assert not (tmp_path / "data").exists()


@pytest.mark.mpi
@pytest.mark.parametrize("how", [pytest.param("hpcdem", marks=pytest.mark.slow), "python"])
def test_an_error_of_one_rank_ends_all(launch: Launcher, tmp_path: Path, how: str) -> None:
    program(tmp_path, "if sim.rank == 1:\n    values = [][3]\nsim.cycle(100)\n")
    start = launch if how == "hpcdem" else launch.python
    done = start(3, "study.py", cwd=tmp_path, timeout=120)
    assert done.returncode != 0
    assert "IndexError" in done.stderr and "study.py" in done.stderr and "runtime/shutdown" not in done.stderr


def test_the_traceback_of_a_users_error_begins_in_the_program(resident: Resident, tmp_path: Path) -> None:
    program(tmp_path, "def f(s):\n    return 1 / 0\nsim.every(3, f)\nsim.cycle(10)\n")
    done = resident(1, "study.py", cwd=tmp_path)
    assert done.returncode == 1
    assert "ZeroDivisionError" in done.stderr and "return 1 / 0" in done.stderr
    assert "cli/run.py" not in done.stderr


def test_arguments_and_exit_codes(resident: Resident, tmp_path: Path) -> None:
    program(tmp_path, "import sys\nprint('ARG', sys.argv[1:], __name__)\nsys.exit(3)\n", head="import hpcdem\n")
    done = resident(1, "study.py", "--", "0.3", "--mu", cwd=tmp_path)
    assert done.returncode == 3 and "ARG ['0.3', '--mu'] __main__" in done.stdout


@pytest.mark.slow
@pytest.mark.mpi
def test_several_simulations_and_the_end(launch: Launcher, tmp_path: Path) -> None:
    """A study over a parameter: folders of their own, beside the program; each ends with table, frame and figure."""
    text = """\
import hpcdem
for mu in (0.0, 0.5):
    with hpcdem.Simulation(outdir=f"mu{mu}") as sim:
        sim.command('''
            BOX left 0.0 right 50.0 bottom 0.0 height 50.0
            GEN num 40 rad discrete 1.0 x 0.0 50.0 y 0.0 50.0
            PROP density 2000.0 shear 1e7 poiss 0.2 hertz
            SET dt 1e-3 gravity 0.0 -9.8
        ''')
        sim.prop(fric=mu)
        sim.cycle(20)
"""
    program(tmp_path, text, head="")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    done = launch.python(2, "../study.py", cwd=elsewhere)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("20 steps in") == 2 and done.stdout.count("figure: ") == 2
    for mu in ("mu0.0", "mu0.5"):
        names = {p.name for p in (tmp_path / mu).iterdir()}
        assert {"all_0000000020.vtkhdf", "all_0000000020.dat", "all_0000000020.jpg"} <= names
    assert not any(elsewhere.iterdir())


@pytest.mark.mpi
def test_stopped_and_resumed(resident: Resident, tmp_path: Path) -> None:
    """A time limit ends the program with 85 and a checkpoint; `resume` finishes the cycle: nothing is different."""
    text = """\
import sys
ran = []
sim.every(500, lambda s: ran.append(s.steps))
if not sim.resume():
    sim.cycle(10)
    if "stop" in sys.argv:
        import os, signal
        sim.every(1000, lambda s: os.kill(os.getpid(), signal.SIGTERM))
    sim.cycle(4000)
sim.write_frame()
end = f"{sim.steps} {float(sim.gather('y').sum()).hex()} {ran[-1]}"
open(f"end_{sim.rank}.txt", "w").write(end)  # not printed: ranks write into one pipe, lines may mix
"""
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
        program(tmp_path / name, text)
    whole = resident(1, "study.py", "--no-figure", cwd=tmp_path / "whole")
    assert whole.returncode == 0, whole.stderr
    cut = resident(1, "study.py", "--no-figure", "stop", cwd=tmp_path / "cut")
    assert cut.returncode == 85 and "Simulation.resume()" in cut.stderr, cut.stderr
    rest = resident(2, "study.py", "--no-figure", cwd=tmp_path / "cut")
    assert rest.returncode == 0, rest.stderr
    ends = {name: [file.read_text() for file in (tmp_path / name).glob("end_*.txt")] for name in ("whole", "cut")}
    assert len(ends["whole"]) == 1 and ends["whole"][0].startswith("4010 ")
    assert ends["cut"] == ends["whole"] * 2


BACK = """\
sim.set(save=100, print=0)
sim.cycle(300)
again, never = hpcdem.Simulation(), hpcdem.Simulation()
assert again.resume(before=0.21) and again.steps == 300
assert again.gather("y").tobytes() == sim.gather("y").tobytes()
try:
    never.resume(before=0.05)
except hpcdem.HpcdemError as error:
    open("said.txt", "w").write(str(error))
"""


def test_resumed_from_before_a_time(resident: Resident, tmp_path: Path) -> None:
    """0.21 s are step 210."""
    program(tmp_path, BACK)
    done = resident(1, "study.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0000000200.sav, step 200" in done.stdout
    assert "no complete checkpoint in" in (tmp_path / "said.txt").read_text()


LOOK = """\
import numpy as np
sim.ball(50.0, 150.0, 2.0, group="stone")
sim.fix("x", "y", "spin", where="group stone")
x = sim["x"]
try:
    x[0] = 1.0
    raise SystemExit("a view could be written")
except ValueError:
    pass
assert len(sim) == len(x) and sim.count == len(sim.gather("gid")) == 1 + int((sim.gather("group") == "rock").sum())
mass, radius, group = sim.gather("mass", "radius", "group")
assert np.allclose(mass, np.where(group == "rock", 2000.0, 0.0) * np.pi * radius**2, rtol=1e-12)
assert set(np.unique(sim["shear"])) <= {0.0, 1e7}
sim.cycle(3000)
rows = sim.wall_contacts()
on_wall = -rows["fy"][rows["wall"] == 0].sum()
assert np.isclose(sim.wall_force(0)[1], on_wall, rtol=1e-12) and on_wall < 0
assert sim.wall_forces()[0] == sim.wall_force(0)
c = sim.contacts()
assert (c["id1"] < c["id2"]).all() and (np.diff(c["id1"]) >= 0).all() and (c["fn"] >= 0).all()
ids, fy = sim.gather("gid", "fy")
total = np.zeros(ids.max() + 1)
np.add.at(total, c["id1"], c["fy"]); np.add.at(total, c["id2"], -c["fy"])
np.add.at(total, rows["id1"], rows["fy"])
assert np.allclose(total[ids], fy, rtol=1e-9, atol=1e-9 * np.abs(fy).max())
assert sim.bonds_left == 0 and sim.bond("group rock", ebmod=1e7, gbmod=1e7, tstrength=1e9, sstrength=1e9) > 0
assert sim.bonds_left == len(sim.bonds()["id1"]) == len(sim.contacts()["id1"])
e = sim.extents()
stone = sim.gather("group") == "stone"
assert np.isclose(e["top"], (sim.gather("y") + sim.gather("radius"))[~stone].max())
sim["vx"] = 0.25
assert (sim.gather("vx") == 0.25).all()
sim["group"] = "new"
assert (sim.gather("group") == "new").all()
assert sim.walls[0].p2 == (100.0, 0.0) and sim.dt == 1e-3 and np.isclose(sim.time, 3.0)
assert sim.unbalanced() >= 0.0 and sim.kinetic_energy() > 0.0
sim.start()
assert sim.count == 0 and sim.steps == 0 and not sim.walls
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_what_can_be_seen(resident: Resident, tmp_path: Path, ranks: int) -> None:
    program(tmp_path, LOOK)
    done = resident(ranks, "study.py", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_import_is_light(launch: Launcher, tmp_path: Path) -> None:
    """numpy, numba and MPI come with the first simulation: before it the environment can still be settled."""
    text = "import hpcdem, sys\nprint([m for m in ('numpy', 'numba', 'mpi4py') if m in sys.modules])\n"
    (tmp_path / "a.py").write_text(text)
    assert launch.python(1, "a.py", cwd=tmp_path).stdout.strip() == "[]"


@pytest.mark.slow
def test_the_program_of_the_documentation_runs(launch: Launcher, tmp_path: Path) -> None:
    """The first block of docs/python.md, with fewer steps."""
    text = (ROOT / "docs" / "python.md").read_text().split("```python\n")[1].split("```")[0]
    for long, short in (("sim.cycle(4000)", "sim.cycle(40)"), ("xmove=2000.0, print=500.0", "xmove=4.0, print=2.0")):
        assert long in text
        text = text.replace(long, short)
    program(tmp_path, text, head="")
    done = launch(1, "study.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "IMPLE, 40 steps" in done.stdout


@pytest.mark.parametrize("clause", ["Exception", "BaseException"])
def test_a_program_cannot_catch_the_stop(resident: Resident, tmp_path: Path, clause: str) -> None:
    """`except Exception` lets it pass; what catches more meets it again at the next method."""
    text = (
        "import os, signal\nos.kill(os.getpid(), signal.SIGTERM)\n"
        f"try:\n    sim.cycle(500)\nexcept {clause}:\n    print('caught')\n"
        "sim.delete()\nsim.cycle(20)\nprint('went on')\n"
    )
    program(tmp_path, text)
    done = resident(1, "study.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 85 and "stopped at step" in done.stderr, done.stdout + done.stderr
    assert ("caught" in done.stdout) == (clause == "BaseException") and "went on" not in done.stdout
    assert len(list((tmp_path / "data").glob("*.sav"))) == 1
