"""The shell scripts can be read by bash, and started."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

PROGRAMS = [
    ROOT / "scripts" / "run",
    ROOT / "scripts" / "test",
    ROOT / "scripts" / "faults",
    ROOT / "scripts" / "mutants",
    ROOT / ".ci" / "run",
]


@pytest.mark.parametrize("script", [*PROGRAMS, ROOT / "scripts" / "lib" / "setup.sh"], ids=lambda path: path.name)
def test_script_is_clean(script: Path) -> None:
    assert b"\r" not in script.read_bytes()
    subprocess.run(["bash", "-n", script], check=True)


@pytest.mark.parametrize("script", PROGRAMS, ids=lambda path: path.name)
def test_program_can_be_started(script: Path) -> None:
    assert os.access(script, os.X_OK)


@pytest.mark.parametrize("name", ["run", "test"])
def test_help_sets_nothing_up(name: str) -> None:
    done = subprocess.run([ROOT / "scripts" / name, "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "usage:" in done.stdout and "--setup-only" in done.stdout
    assert "Setting up" not in done.stderr


@pytest.mark.slow
def test_what_has_passed_is_left_out(tmp_path: Path) -> None:
    """scripts/test --go-on."""
    (tmp_path / "test_two.py").write_text("def test_good(): pass\ndef test_bad(): assert False\n")
    command = [sys.executable, "-m", "pytest", "-p", "tests.conftest", "-p", "no:cacheprovider", "--rootdir", tmp_path]
    env = os.environ | {"HPCDEM_TEST_GREEN": str(tmp_path / "green"), "PYTHONPATH": str(ROOT)}

    def go_on(*words: str) -> str:
        done = subprocess.run([*command, *words], cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
        return f"{done.returncode} {done.stdout.splitlines()[-1].strip('= ')}"

    assert go_on("-n", "2").startswith("1 1 failed, 1 passed")
    assert go_on().startswith("1 1 failed in")
    (tmp_path / "test_two.py").write_text("def test_good(): pass\ndef test_bad(): pass\n")
    assert go_on().startswith("0 1 passed")
    assert go_on("-n", "2").startswith("0 ") and go_on().startswith("0 no tests ran")
