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


FILES = {
    "clumps/end.sav": {"particles/x": "one", "particles/y": "another"}, "clumps/data/energy.csv": {"text": "a third"}
}  # fmt: skip
"""Fingerprints of datasets, by file."""


@pytest.mark.slow
@pytest.mark.mpi
def test_a_recording_is_the_same_again(tmp_path: Path) -> None:
    done = digests("record", "one.json", "clumps", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert digests("record", "two.json", "clumps", "--layout", "1x1", cwd=tmp_path).returncode == 0
    found = json.loads((tmp_path / "one.json").read_text())
    assert found["clumps"]["1x1"] == found["clumps"]["2x1"]
    files = found["clumps"]["1x1"]
    assert {"clumps/end.sav", "clumps/data/all_0000020000.vtkhdf", "clumps/data/energy.csv"} <= files.keys()
    assert "particles/x" in files["clumps/end.sav"] and "text" in files["clumps/data/energy.csv"]
    again = json.loads((tmp_path / "two.json").read_text())
    assert again["clumps"]["1x1"] == files


def test_what_differs_is_named(tmp_path: Path) -> None:
    def compared(second: dict[str, object]) -> subprocess.CompletedProcess[str]:
        for name, layouts in (("one", {"1x1": FILES, "2x1": FILES}), ("two", {"1x1": FILES} | second)):
            (tmp_path / f"{name}.json").write_text(json.dumps({"clumps": layouts}))
        return digests("compare", "one.json", "two.json", cwd=tmp_path)

    missing = compared({})
    assert missing.returncode == 1 and "clumps 2x1: only before" in missing.stdout
    assert compared({"2x1": FILES}).returncode == 0
    changed = compared({"2x1": FILES | {"clumps/end.sav": FILES["clumps/end.sav"] | {"particles/x": "changed"}}})
    assert changed.returncode == 1 and "  clumps/end.sav: particles/x\n" in changed.stdout
    lacking = compared({"2x1": {"clumps/end.sav": FILES["clumps/end.sav"]}})
    assert lacking.returncode == 1 and "- clumps/data/energy.csv: text" in lacking.stdout


def test_a_model_that_is_not_there_is_named(tmp_path: Path) -> None:
    done = digests("record", "one.json", "clamps", cwd=tmp_path)
    assert done.returncode == 2 and "there is no model clamps; available: " in done.stderr
