"""The warm-ups call every kernel that a program may call: no program compiles any more, on whatever ranks.

Else each rank would compile for itself, while the others wait, what the warm-up has forgotten.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.clumped import write_lattice
from tests.conftest import ROOT, Launcher
from tests.pcdc.test_whole import SCRIPTS

WATCHED = """\
from hpcdem.cli import main
from hpcdem.runtime import kernels

try:
    main()
finally:
    print(f"compiled late: {kernels.late}\\n", end="", flush=True)
"""

PARTICLES = """\
START
SET disk on
BOX left 0.0 right 41.0 bottom 0.0 height 40.0 kn 2e7 ks 1e7
WALL id 0 nodes (0.0, 0.5) (40.0, 0.5) kn 2e7 ks 1e7 fric 0.3
WALL id 1 nodes (0.5, 28.0) (0.5, 0.5) kn 2e7 ks 1e7 fric 0.3
GEN grid rad discrete 0.4 x (1.0 39.0) y (1.0 4.0) group bed
GEN num 40 rad discrete 0.4 0.5 x (1.0, 39.0) y (5.0, 9.0) group loose
CLUMP file bodies.clumps x 2.0 y 12.0 scale 0.12 group rock
PROP density 2e3 shear 2.9e7 poiss 0.2 fric 0.4 damp 0.2 hertz
SET dt 5e-4 gravity 0.0 -9.8
SET print 40 vtk 40 save 40 energy 20
HIST id 1 interval 10 kinetic
HIST id 2 interval 10 energy
CYC 40
PROP ebmod 2e6 gbmod 2e6 tstrength 1e3 sstrength 1e3 RANGE group bed
WALL id 1 xv 5.0
CYC 80
DEL RANGE x 0.0 3.0
BOND break RANGE x 5.0 8.0
CLUMP group stone RANGE group loose and x 20.0 22.0
GEN num 20 rad discrete 0.4 x (10.0, 35.0) y (20.0, 28.0) group rain
PROP density 2e3 shear 2.9e7 poiss 0.2 hertz RANGE group rain
IMPLE wall id 1 xmove 0.5 print 0.25
SAV end.sav
EXP end.dat group
STOP
"""
AGAIN = """\
RES end.sav
SET outdir again
CYC 20
STOP
"""

FOLLOWED = """\
START
BOX left 0.0 right 9.0 bottom 0.0 height 9.0
GEN grid rad discrete 0.4 x (1.0 8.0) y (1.0 4.0)
PROP density 2e3 kn 2e7 ks 1e7
SET dt 5e-4 gravity 0.0 -9.8
HIST id 1 interval 10 energy
CYC 20
STOP
"""
"""Energy without the account of it."""

BOTH = """\
import hpcdem
{first}
pcdc mesh structured (0,0) (9,1) cells 9 2 type quad
pcdc mesh structured (0,1) (9,2) cells 9 2
pcdc element c-model mech-iso-e property den 2000 y 1e9 p-r 0.2
pcdc face-joint c-model c-i-c-i property f 30 c 2e6 t-s 1e5 gf1 1 gf2 10
pcdc model gravity (0,-10)
pcdc model option energy on
pcdc history create 'load' node value reaction-y sum range y 0 0
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc element-face boundary m-s-b-c s-n -1e3 range y 2 2
pcdc output vtk 'a' every 20
pcdc model step 20
pcdc element c-model null range id 9
pcdc model option dynamic off
pcdc model solve cycles 40
pcdc model save 'a.sav'
pcdc model restore 'a.sav'
pcdc model option dynamic on
{then}
sand.cycle(50)
both = hpcdem.couple(sand, friction=0.6)
pcdc model step 60
pcdc model save 'b.sav'
print(both.force(), len(both.contacts()['id']), pcdc.energies['closing'])
"""

SAND = """\
sand = hpcdem.Simulation(outdir='sand')
sand.set(disk='on', gravity=(0.0, -9.8), dt=1e-5, energy=20, print=50)
sand.box(-1.0, 10.0, -1.0, 9.0)
sand.gen(60, rad=[0.1, 0.12], x=(0.5, 8.5), y=(2.1, 3.0))
sand.prop(density=2000.0, kn=1e7, ks=1e7, fric=0.5)
sand.bond('x 0 4', n_bond=1e4, s_bond=1e4)
"""


@pytest.fixture
def late(launch: Launcher, tmp_path: Path):
    """`late(2, "a.sc", ...)`: run hpcdem; the line of each rank that tells what was compiled besides the warm-ups."""
    (tmp_path / "watched.py").write_text(WATCHED)

    def run(ranks: int, *words: object) -> list[str]:
        done = launch.python(ranks, "watched.py", *words, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
        lines = [line for line in done.stdout.splitlines() if line.startswith("compiled late: ")]
        assert len(lines) == ranks
        return lines

    return run


NOTHING = "compiled late: []"
SLOW, MPI = pytest.mark.slow, pytest.mark.mpi


@pytest.mark.parametrize("ranks", [1, pytest.param(3, marks=[MPI, SLOW])])
def test_particles(late, tmp_path: Path, ranks: int) -> None:
    write_lattice(tmp_path / "bodies.clumps", 3.0, 10, 6)
    for name, text, n in (("model.py", PARTICLES, ranks), ("again.py", AGAIN, ranks), ("followed.py", FOLLOWED, 1)):
        (tmp_path / name).write_text(text)
        assert late(n, name) == [NOTHING] * n


@pytest.mark.parametrize(
    ("ranks", "first"),
    [
        (1, "blocks"),
        pytest.param(2, "particles", marks=[MPI, SLOW]),
    ],
)
def test_blocks_and_particles_in_any_order(late, tmp_path: Path, ranks: int, first: str) -> None:
    text = BOTH.format(first=SAND, then="") if first == "particles" else BOTH.format(first="", then=SAND)
    (tmp_path / "both.sc").write_text(text)
    assert late(ranks, "both.sc") == [NOTHING] * ranks


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=[MPI, SLOW])])
def test_a_script_of_both_that_continues(launch: Launcher, tmp_path: Path, ranks: int) -> None:
    """The checkpoint is read while only the kernels of blocks are there."""
    (tmp_path / "watched.py").write_text(WATCHED)
    shutil.copy(ROOT / "tests" / "coupled" / "fall.sc", tmp_path)
    (tmp_path / "stop").touch()
    assert launch.python(ranks, "watched.py", "fall.sc", "--no-figure", cwd=tmp_path).returncode == 85
    (tmp_path / "stop").unlink()
    done = launch.python(ranks, "watched.py", "fall.sc", "--no-figure", "--resume", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.count(f"{NOTHING}\n") == ranks, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "threads"), [(1, 2), pytest.param(2, 1, marks=MPI)])
def test_a_bar_that_breaks(late, tmp_path: Path, ranks: int, threads: int) -> None:
    for name in ("bar.sc", "loop.sc"):
        assert late(ranks, SCRIPTS / name, "-j", threads, "--outdir", tmp_path / name[:3]) == [NOTHING] * ranks


@pytest.mark.slow
@pytest.mark.mpi
def test_of_two_threads(late, tmp_path: Path) -> None:
    write_lattice(tmp_path / "bodies.clumps", 3.0, 10, 6)
    (tmp_path / "model.py").write_text(PARTICLES)
    assert late(1, "model.py", "-j", 2) == [NOTHING]
    (tmp_path / "both.sc").write_text(BOTH.format(first="", then=SAND))
    assert late(1, "both.sc", "-j", 2) == [NOTHING]


def test_what_was_forgotten_is_reported_and_kept_for_later_runs(launch: Launcher, tmp_path: Path) -> None:
    """A kernel of the particles with arguments that no run has."""
    (tmp_path / "model.py").write_text(
        "import hpcdem\nsim = hpcdem.Simulation()\nsim.box(0, 1, 0, 1)\n"
        "from hpcdem.numerics import rng\nfrom hpcdem.runtime import kernels, kept\n"
        "rng.uniform._cache._name += 'of-this-test'\nrng.uniform._cache.flush()\n"
        "import sys\nrng.uniform(True, 1, 2)\nprint(*kernels.late)\n"
        "known = any(kept.has(rng.uniform, one) for one in rng.uniform.signatures)\n"
        "print(sum(rng.uniform.stats.cache_hits.values()), known)\n"
        "rng.uniform._cache.flush()\n"
    )
    done = launch.python(1, "model.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()[-2:]
    assert said[0].startswith("hpcdem.numerics.rng.uniform(bool, ") and said[1] == "0 True"
