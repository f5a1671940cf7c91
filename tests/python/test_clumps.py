"""Rigid clumps from Python: the same files as the script on one and two ranks, and what may be set."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.clumped import write_lattice
from tests.property.workers import Resident
from tests.short_push import assert_same_files

SCRIPT = """\
START
SET dt 2e-3 gravity 0.0 -9.8 print 200
WALL id 0 nodes (-50.0, 0.0) (250.0, 0.0) kn 2e7 ks 2e7 fric 0.3
CLUMP file bodies.clumps x 5.0 angle 0.1 scale 0.9 color red group rock
GLINE p1 (0.0, 170.0) p2 (60.0, 170.0) rad 3.0 group row
CLUMP group bar color blue RANGE group row
PROP density 2e3 kn 2e7 ks 1e7 fric 0.2 damp 0.1
PROP spin 0.3 RANGE group bar
CYC 400
DEL RANGE x 100.0 120.0
SAV end.sav
STOP
"""

PROGRAM = """\
import hpcdem

sim = hpcdem.Simulation()
sim.set(dt=2e-3, gravity=(0.0, -9.8), print=200)
sim.wall(0, ((-50.0, 0.0), (250.0, 0.0)), kn=2e7, ks=2e7, fric=0.3)
assert sim.clump("bodies.clumps", x=5.0, angle=0.1, scale=0.9, color="red", group="rock") == 24
row = sim.gline((0.0, 170.0), (60.0, 170.0), 3.0, group="row")
assert sim.join("group row", group="bar", color="blue") == row
sim.prop(density=2e3, kn=2e7, ks=1e7, fric=0.2, damp=0.1)
sim.prop("group bar", spin=0.3)
sim.cycle(400)
sim.delete("x 100.0 120.0")
sim.save("end.sav")
sim.finish()
"""

LOOKS = """\
import numpy as np
import hpcdem

sim = hpcdem.Simulation()
sim.set(dt=1e-3)
sim.clump("bodies.clumps")
sim.ball(300.0, 0.0, 2.0)
sim.prop(density=2.0, kn=1e3)
assert (sim.gather("clump")[:8] == [0, 0, 0, 0, 0, 0, 0, 7]).all() and sim.gather("clump")[-1] == -1
c = sim.clumps()
assert len(c["id"]) == 24 and (c["mass"] == 2.0 * c["area"]).all() and c["members"][0] == 7
gid, clump, mass = sim.gather("gid", "clump", "mass")
assert np.isclose(mass[clump == 0].sum(), c["mass"][0], rtol=1e-14)
wanted = 0.01 * gid.astype(float)
sim["vx"] = 0.01 * sim["gid"]  # each clump that of its first member
sim["spin"] = 0.5
c = sim.clumps()
assert (c["vx"] == 0.01 * c["id"]).all() and (c["spin"] == 0.5).all() and (sim.gather("spin") == 0.5).all()
x, y, vx = sim.gather("x", "y", "vx")
first = clump == 0
assert np.allclose(vx[first], 0.0 - 0.5 * (y[first] - c["y"][0]), atol=1e-13) and vx[-1] == wanted[-1]
sim["color"] = sim["gid"] % 10
assert len(set(sim.gather("color")[first])) == 1
sim["y"] = np.where(sim["clump"] < 0, 5.0, sim["y"])  # free particles may be moved
assert sim.gather("y")[-1] == 5.0
before = sim.clumps()
sim.cycle(20)
assert np.allclose(sim.clumps()["x"], before["x"] + before["vx"] * 0.02, atol=1e-12)
try:
    sim["x"] = sim["x"] + 1.0
except Exception as error:
    assert "field 'x' of members of a clump cannot be set" in str(error), error
else:
    raise SystemExit("members were moved")
assert np.allclose(sim.clumps()["x"], before["x"] + before["vx"] * 0.02, atol=1e-12)
sim.delete()
assert sim.count == 0 and len(sim.clumps()["id"]) == 0
print("looked", sim.rank)
"""


def folder(path: Path, name: str, text: str) -> Path:
    path.mkdir()
    write_lattice(path / "bodies.clumps", 3.0, 6, 4)
    (path / name).write_text(text)
    return path / name


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.mpi)])
def test_the_same_files_as_the_script(resident: Resident, tmp_path: Path, ranks: int) -> None:
    for place, text in (("script", SCRIPT), ("program", PROGRAM)):
        done = resident(ranks, folder(tmp_path / place, "run.py", text), "--no-figure", cwd=tmp_path / place)
        assert done.returncode == 0, done.stdout + done.stderr
        (tmp_path / place / "end.sav").unlink()  # its text of the script is another
    (tmp_path / "program" / "run.py").write_text(SCRIPT)
    assert_same_files(tmp_path / "script", tmp_path / "program")


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.mpi)])
def test_looking_and_setting(resident: Resident, tmp_path: Path, ranks: int) -> None:
    done = resident(ranks, folder(tmp_path / "here", "look.py", LOOKS), cwd=tmp_path / "here")
    assert done.returncode == 0 and done.stdout.count("looked") == ranks, done.stdout + done.stderr
