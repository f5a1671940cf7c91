"""Laws of the user for pairs of discs: the same bits on any number of ranks and threads, and across a restart; a law
with the arithmetic of the built-in one has its bits."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.property.workers import Resident
from tests.short_push import assert_same_files, contents

LAWS = Path(__file__).resolve().parent.parent / "laws" / "pairs.py"
PUSH = """\
START
BOX left 0 right 60 bottom 0 height 20 kn 1e7 ks 1e7 fric 0.3
WALL id 5 nodes (1, 20) (1, 0) kn 1e7 ks 1e7 xv 2.0
GEN num 1200 rad discrete 0.3 0.4 0.5 x (2 58) y (0 18) group sand
PROP density 2500 kn 1e7 ks 8e6 fric 0.4 damp 0.3 LAW
SET DT 2e-4 GRAVITY 0 -9.8 print 1500 save 1000
HIST id 1 interval 100 kinetic
CYC 2000
PROP fric 0.2 RANGE x (0 20)
CYC 1500
STOP
"""
WORDS = {"built-in": "", "linear": "law pairs.py:linear", "sticky": "law pairs.py:sticky parameter pull 2e3"}
WORDS["two"] = f"""{WORDS["sticky"]}
PROP law pairs.py:linear RANGE x (0 30)
PROP law pairs.py:sticky between pairs.py:linear|pairs.py:sticky parameter pull 1e3
SET energy 500"""
SLOW = pytest.mark.slow


def run(resident: Resident, folder: Path, law: str, ranks: int, *options: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(LAWS, folder)
    (folder / "push.py").write_text(PUSH.replace("LAW", WORDS[law]))
    done = resident(ranks, "push.py", "--no-figure", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All of them on one rank with one thread."""
    folder = tmp_path_factory.mktemp("alone")
    for law in WORDS:
        run(resident, folder / law, law, 1)
    return folder


def states(folder: Path) -> dict[str, np.ndarray]:
    """The last checkpoint."""
    return contents(sorted((folder / "data").glob("*.sav"))[-1])


def test_the_linear_law_has_the_bits_of_the_built_in_one(alone):
    built_in, linear = states(alone / "built-in"), states(alone / "linear")
    for name in ("particles/x", "particles/vy", "particles/spin", "particles/fx"):
        assert built_in[name].tobytes() == linear[name].tobytes()
    assert np.count_nonzero(linear["pairs/fs"]) > 100


def test_contacts_remember(alone):
    sticky = states(alone / "sticky")
    stamp, most, age = (sticky[f"pairs/memory{k}"] for k in range(3))
    assert len(set(stamp.tolist())) == 1 and len(stamp) > 100
    assert (most > 0.0).all() and age.min() < 1.1 < age.max() < 1.0 + 3500 * 2e-4 + 1e-9
    assert states(alone / "linear")["particles/x"].tobytes() != sticky["particles/x"].tobytes()


def test_two_laws_keep_an_account(alone):
    """It closes to a thousandth of what the wall, gravity and damping move; each law is at work."""
    rows = np.genfromtxt(alone / "two" / "data" / "energy.csv", delimiter=",", names=True)
    assert abs(rows["relative"][-1]) < 1e-3 and rows["loss_laws"][-1] > 0.0 < rows["elastic_normal"][-1]
    two = states(alone / "two")
    for law in ("linear", "sticky"):
        assert two["particles/x"].tobytes() != states(alone / law)["particles/x"].tobytes()
    assert set(np.unique(two["pairs/memory0"] % 1.0).tolist()) == {0.0, 1.0 / 64.0}


@pytest.mark.mpi
@pytest.mark.parametrize("law", ["two", pytest.param("sticky", marks=SLOW), pytest.param("linear", marks=SLOW)])
@pytest.mark.parametrize("ranks, threads", [(2, 1), pytest.param(4, 2, marks=SLOW)])
def test_ranks_and_threads_do_not_change_a_bit(alone, resident, tmp_path, law, ranks, threads):
    run(resident, tmp_path, law, ranks, "-j", str(threads))
    assert_same_files(alone / law / "data", tmp_path / "data")


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=SLOW)])
def test_a_restart_does_not_change_a_bit(alone, resident, tmp_path, ranks):
    """From step 1000, in the middle of the first CYC."""
    shutil.copytree(alone / "two", tmp_path / "run")
    data = tmp_path / "run" / "data"
    for path in [*data.glob("*.sav")]:
        if int(path.stem.rpartition("_")[2]) > 1000:
            path.unlink()
    run(resident, tmp_path / "run", "two", ranks, "--resume")
    assert_same_files(alone / "two" / "data", data)


@pytest.mark.slow
def test_another_text_does_not_continue(alone, launch, tmp_path):
    shutil.copytree(alone / "sticky", tmp_path / "run")
    folder = tmp_path / "run"
    (folder / "pairs.py").write_text((folder / "pairs.py").read_text() + "\n# changed\n")
    (folder / "again.py").write_text(f"RES {sorted((folder / 'data').glob('*.sav'))[0]}\nCYC 10\nSTOP\n")
    done = launch(1, "again.py", "--no-figure", "--outdir", "other", cwd=folder)
    assert (
        done.returncode != 0
        and "again.py:1: RESTORE: the checkpoint has discs with the law pairs.py:sticky, which" in (done.stderr)
    )
    (folder / "again.py").write_text(
        f"RES {sorted((folder / 'data').glob('*.sav'))[0]}\nPROP law pairs.py:sticky parameter pull 2e3\nCYC 10\nSTOP\n"
    )
    done = launch(1, "again.py", "--no-figure", "--outdir", "other", cwd=folder)
    assert (
        done.returncode != 0 and "but pairs.py has changed since: a run cannot resume with a changed law" in done.stderr
    )
    shutil.copy(LAWS, folder)
    done = launch(1, "again.py", "--no-figure", "--outdir", "other", cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "push.py").unlink()
    (folder / "data" / "run.json").unlink()
    done = launch(1, "resume", "data", "--no-figure", cwd=folder)  # the script out of the checkpoint
    assert done.returncode != 0 and "user laws are never executed from a checkpoint" in done.stderr


def test_a_wrong_law_stops_before_the_first_line(launch, tmp_path):
    shutil.copy(LAWS, tmp_path)
    (tmp_path / "pairs.py").write_text(LAWS.read_text().replace("return fn, fs + 0.0", "return fn"))
    (tmp_path / "push.py").write_text(PUSH.replace("LAW", WORDS["linear"]))
    done = launch(1, "push.py", "--no-figure", cwd=tmp_path)
    assert done.returncode != 0
    assert "push.py:5: PROP: pairs.py:10: the law must return 2 numbers (fn, fs), it returns float64" in done.stderr
    assert not (tmp_path / "data").exists() or not list((tmp_path / "data").glob("*.vtkhdf"))
