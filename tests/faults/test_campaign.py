"""scripts/faults: a dozen faults of different kinds with a fixed seed, and the judge, which must be able to condemn."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from faults import campaign, judge, report
from faults.kinds import KINDS
from faults.model import MODELS, Reference

DOZEN = (
    "kill a rank", "kill in a write of a checkpoint", "kill in a write of a frame", "kill at flush or rename",
    "kill in a row of a series", "SIGTERM", "disk error", "limit on the size of files", ".sav cut",
    ".sav with an empty page", ".sav of another script", "clock of the disk jumps",
)  # fmt: skip


@pytest.mark.alone
@pytest.mark.slow
def test_a_dozen_faults(tmp_path: Path) -> None:
    """All runs, of particles, blocks and both by turns, come to the same end. One rank; two runs at a time."""
    paths = [str(ROOT / "scripts" / "lib"), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    kinds = [word for name in DOZEN for word in ("--kind", name)]
    lines = tmp_path / "lines.json"
    command = [sys.executable, "-m", "faults", "--number", str(len(DOZEN)), "--seed", "7", "--ranks", "1", *kinds]
    done = run([*command, "--json", str(lines)], tmp_path, env={"PYTHONPATH": os.pathsep.join(paths)}, timeout=900)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in lines.read_text().splitlines()]
    assert {row["kind"] for row in rows} == set(DOZEN)
    assert {row["result"] for row in rows} <= {"survived", "refused", "missed"}
    assert sum(row["result"] == "survived" for row in rows) >= 2 * len(DOZEN) // 3
    assert {row["model"] for row in rows} == set(MODELS)
    page = tmp_path / "page.md"
    page.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n")
    report.into(page, report.text(rows, {"seed": 7, "minutes": 1.0, "cores": 2, "mpi": "Open MPI"}))
    text = page.read_text()
    assert text.startswith("before\n") and text.endswith("after\n") and "\nold\n" not in text
    assert text.count("| kill a rank | 1 | 1 | 0 | 0 |") == 1


@pytest.fixture
def pair(tmp_path: Path, stopped_run: Path) -> tuple[Path, Reference]:
    """An output folder that is equal to that of the undisturbed run."""
    reference = Reference(tmp_path / "reference")
    for folder in (reference.data, tmp_path / "data"):
        shutil.copytree(stopped_run, folder)
    return tmp_path / "data", reference


def test_equal_folders_pass(pair) -> None:
    data, reference = pair
    assert judge.other_end(data, reference, set()) == []
    assert judge.newest(data) == max(int(path.stem) for path in data.glob("*.sav"))


@pytest.mark.parametrize("pattern", ["*.sav", "all_*.vtkhdf", "all_*.dat", "walls.csv"])
def test_a_changed_file_is_found(pair, pattern) -> None:
    """One byte in the middle of the data."""
    data, reference = pair
    path = sorted(data.glob(pattern))[-1]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert any(path.name in why for why in judge.other_end(data, reference, set()))


@pytest.mark.parametrize("pattern", ["all_*.vtkhdf", "all_*.dat", "walls.csv"])
def test_a_missing_file_is_found(pair, pattern) -> None:
    data, reference = pair
    path = sorted(data.glob(pattern))[-1]
    path.unlink()
    assert judge.other_end(data, reference, set()) == [f"{path.name} is missing"]


def test_folders_below_are_inspected(tmp_path: Path) -> None:
    """As that of the particles of a coupled run: a changed series, a missing and a strange frame."""
    reference = Reference(tmp_path / "reference", model=MODELS["coupled"])
    for data in (reference.data, tmp_path / "data"):
        (data / "sand").mkdir(parents=True)
        (data / "sand" / "walls.csv").write_text("step,time\n50,1.0\n650,2.0\n")
        (data / "sand" / "all_0000000500.dat").write_text("a frame")
        (data / "run.json").write_text(str(data))
    data = tmp_path / "data"
    assert judge.other_end(data, reference, set()) == [] and judge.reached(data, reference.model) == 650
    (data / "sand" / "walls.csv").write_text("step,time\n50,1.0\n")
    (data / "sand" / "all_0000000500.dat").rename(data / "sand" / "all_0000000501.dat")
    found = judge.other_end(data, reference, set())
    assert len(found) == 3 and all("sand/" in why for why in found)


def test_checkpoints_by_their_steps(tmp_path: Path) -> None:
    names = ["auto_0000000900.sav", "0000000800.sav", "0000001000.sav"]
    for name in names:
        (tmp_path / name).touch()
    assert [path.name for path in judge.in_order(tmp_path)] == [names[1], names[0], names[2]]


def test_a_frame_that_does_not_belong_is_found(pair) -> None:
    data, reference = pair
    (data / "all_0000000077.dat").write_text("?")
    (data / "all_0000000078.dat.tmp").write_text("half a file")  # under its temporary name it is nothing
    assert len(judge.other_end(data, reference, set())) == 1


def test_the_step_of_a_series_leaves_out_what_is_half_written(tmp_path: Path) -> None:
    assert judge.reached(tmp_path) == 0
    (tmp_path / "walls.csv").write_text("step,time\n100,4.0,0\n100,4.0,1\n200,8.0,0\n30")
    assert judge.reached(tmp_path) == 200


def test_cases_are_the_same_for_the_same_seed() -> None:
    """All kinds in turn; the rare ones seldom; never more ranks than are wanted."""
    kinds = list(KINDS.values())
    cases = campaign.plan(120, 3, kinds, 3)
    assert cases == campaign.plan(120, 3, kinds, 3) != campaign.plan(120, 4, kinds, 3)
    assert {chain[0].name for _, chain, _ in cases} == {k.name for k in kinds}
    for _, chain, ranks in cases:
        assert 1 <= len(chain) <= 3 and max(ranks) <= min(k.most for k in chain)
        assert ranks[0] >= chain[0].least and all(k.least == 1 for k in chain[1:])
    assert all(set(ranks) == {1} for _, _, ranks in campaign.plan(50, 3, kinds, 1))
