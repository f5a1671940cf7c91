"""scripts/digests: fingerprints that change with the results and with nothing else."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT, mpi_environment


def digests(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(ROOT / "scripts" / "lib"), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "digests", *map(str, words)], cwd=cwd, env=mpi_environment() | {"PYTHONPATH": path},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.mark.mpi
def test_a_recording_is_the_same_again_and_a_changed_one_is_named(tmp_path: Path) -> None:
    done = digests("record", "one.json", "clumps", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert digests("record", "two.json", "clumps", "--layout", "1x1", cwd=tmp_path).returncode == 0
    found = json.loads((tmp_path / "one.json").read_text())
    assert found["clumps"]["1x1"] == found["clumps"]["2x1"]
    files = found["clumps"]["1x1"]
    assert {"clumps/end.sav", "clumps/data/all_0000020000.vtkhdf", "clumps/data/energy.csv"} <= files.keys()
    again = json.loads((tmp_path / "two.json").read_text())
    assert again["clumps"]["1x1"] == files

    missing = digests("compare", "one.json", "two.json", cwd=tmp_path)
    assert missing.returncode == 1 and "clumps 2x1: only before" in missing.stdout
    again["clumps"]["2x1"] = again["clumps"]["1x1"]
    (tmp_path / "two.json").write_text(json.dumps(again))
    assert digests("compare", "one.json", "two.json", cwd=tmp_path).returncode == 0
    again["clumps"]["2x1"] = files | {"clumps/end.sav": files["clumps/end.sav"] | {"particles/x": "another"}}
    (tmp_path / "two.json").write_text(json.dumps(again))
    changed = digests("compare", "one.json", "two.json", cwd=tmp_path)
    assert changed.returncode == 1 and "  clumps/end.sav: particles/x\n" in changed.stdout
    del again["clumps"]["2x1"]["clumps/data/energy.csv"]
    again["clumps"]["2x1"]["clumps/end.sav"] = files["clumps/end.sav"]
    (tmp_path / "two.json").write_text(json.dumps(again))
    lacking = digests("compare", "one.json", "two.json", cwd=tmp_path)
    assert lacking.returncode == 1 and "- clumps/data/energy.csv: text" in lacking.stdout


def test_a_model_that_is_not_there_is_named(tmp_path: Path) -> None:
    done = digests("record", "one.json", "clamps", cwd=tmp_path)
    assert done.returncode == 2 and "there is no model clamps; there is " in done.stderr
