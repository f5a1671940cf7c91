"""scripts/soak: its machinery on runs of minutes and seconds, and that what grows or drifts is found."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from soak import judge

KEYS = {
    "step", "seconds", "rss_mb", "objects", "files", "particles", "bonds", "broken", "momentum_residual", "kinetic",
    "kinetic_limit", "particle_steps_per_s", "generated", "deleted", "bonds_made", "broken_by_command", "wall_turns",
    "restored", "border_moves", "migrations", "rebuilds",
}  # fmt: skip


def soak(folder: Path, *words: str, timeout: float = 120.0) -> tuple[int, str, list[dict[str, Any]]]:
    """`scripts/soak` in the environment that runs the tests: exit code, what it says, its lines."""
    paths = os.pathsep.join(filter(None, (str(ROOT / "scripts" / "lib"), str(ROOT), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", "soak", "--json", "lines.json", "--folder", str(folder / "run"), *words]
    done = run(command, folder, timeout, {"PYTHONPATH": paths})
    lines = folder / "lines.json"
    return done.returncode, done.stderr, [json.loads(row) for row in lines.read_text().splitlines()]


@pytest.mark.slow
@pytest.mark.mpi
def test_two_thousand_steps(tmp_path: Path) -> None:
    """Everything has happened, momentum is in balance, files do not pile up."""
    code, said, rows = soak(tmp_path, "--steps", "2000", "--every", "200")
    assert code == 0, said
    assert [row["step"] for row in rows] == list(range(200, 2001, 200))
    assert all(row.keys() == KEYS and len(row["rss_mb"]) == 2 for row in rows)
    assert rows[-1]["generated"] == rows[-1]["deleted"] == 64 and rows[-1]["restored"] == 2
    assert max(row["momentum_residual"] for row in rows) < judge.MOMENTUM
    assert "2000 steps" in said and "fault" not in said
    assert len(list((tmp_path / "run" / "data").glob("all_*.dat"))) <= 4


@pytest.mark.mpi
@pytest.mark.slow
def test_twenty_thousand_steps(tmp_path: Path) -> None:
    code, said, rows = soak(tmp_path, "--steps", "20000", timeout=600.0)
    assert code == 0 and len(rows) == 10, said


def test_a_leak_ends_with_exit_code_1(tmp_path: Path) -> None:
    """Of 3 MB per line, on one rank."""
    code, said, rows = soak(tmp_path, "--steps", "1000", "--every", "100", "--ranks", "1", "--leak", "3")
    assert code == 1 and len(rows) == 10
    assert "fault: rank 0: megabytes grow by" in said


# ---- the judgement, on lines made up ---------------------------------------------------------------------------------


def lines(**changes: Any) -> list[dict[str, Any]]:
    """Two hundred lines of a sound run of two million steps; changes: functions of the number of the line."""
    rows = []
    for k in range(1, 201):
        noise = 0.3 * ((7 * k) % 11 - 5) / 5
        row = {
            "step": 10000 * k, "seconds": 4.0 * k, "rss_mb": [300 + noise, 200 - noise], "files": [9, 8],
            "objects": [50000 + k % 7, 49000], "particles": 250, "bonds": 20, "broken": 3 * k,
            "momentum_residual": 1e-15, "kinetic": 1e6 + 1e5 * (k % 5), "kinetic_limit": 4e8,
            "particle_steps_per_s": 2e6, "generated": 64 * k,
            "deleted": 64 * k, "bonds_made": 56 * k, "broken_by_command": k, "wall_turns": 4 * k,
            "restored": k // 10, "border_moves": k, "migrations": 50 * k, "rebuilds": 300 * k,
        }  # fmt: skip
        rows.append(row | {name: change(k) for name, change in changes.items()})
    return rows


def test_a_sound_run_has_no_faults() -> None:
    assert judge.faults(lines(), 2_000_000) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rss_mb": lambda k: [300.0, 200.0 + 0.012 * k]}, "rank 1: megabytes grow by 1.20 MB per million steps"),
        ({"objects": lambda k: [50000 + 3 * k, 49000]}, "rank 0: objects grow"),
        ({"files": lambda k: [9, 8 + k // 60]}, "rank 1: open files grow"),
        ({"momentum_residual": lambda k: 1e-15 if k != 77 else 2e-13}, "missing from the balance of momentum"),
        ({"momentum_residual": lambda k: float("nan")}, "missing from the balance of momentum"),
        ({"momentum_residual": lambda k: None if k % 2 else 0.0}, "momentum was measured in 100 of 200"),
        ({"kinetic": lambda k: 5e6 if k == 9 else 1e6}, "kinetic energy between"),
        ({"kinetic": lambda k: 3e5 if k == 9 else 1e6}, "kinetic energy between"),
        ({"kinetic": lambda k: float("nan") if k == 9 else 1e6}, "kinetic energy between"),
        ({"kinetic": lambda k: 1e6 * 1.0065**k}, "mean kinetic energy of the last third is 1.5"),
        ({"border_moves": lambda k: 0}, "there were no border moves"),
        ({"broken": lambda k: 0}, "there were no broken"),
    ],
)
def test_what_grows_or_drifts_is_a_fault(changes: dict[str, Any], message: str) -> None:
    found = judge.faults(lines(**changes), 2_000_000)
    assert len(found) == 1 and message in found[0]


def test_what_grew_only_in_the_beginning_is_none() -> None:
    early = lines(rss_mb=lambda k: [300 + min(k, 40), 200], files=lambda k: [min(k, 9), 8])
    assert judge.faults(early, 2_000_000) == []


def test_a_run_that_came_to_no_end() -> None:
    assert judge.faults(lines()[:150], 2_000_000) == ["the run came to step 1500000 of 2000000"]
    assert judge.faults([], 1000) == ["the run came to step 0 of 1000"]
