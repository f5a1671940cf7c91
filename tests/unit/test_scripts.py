"""The shell scripts can be read by bash, and started."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.conftest import ROOT

PROGRAMS = [ROOT / "scripts" / "run", ROOT / "scripts" / "test", ROOT / "scripts" / "faults", ROOT / ".ci" / "run"]


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
