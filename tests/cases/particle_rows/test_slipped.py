"""Who slips through a row of GLINE or a wall is named in the log, once, with place; who stays above or goes round the
end is not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SCRIPT = """\
START
SET disk off dt 0.05
GLINE P1 (1000.0, 0.0) P2 (5000.0, 400.0) rad 60.0 group base
WALL id 0 nodes (1000.0, 4000.0) (5000.0, 4000.0) kn 0 ks 0
BALL id 501 x 2000.0 y 500.0 rad 50.0 group driven
BALL id 502 x 4000.0 y -300.0 rad 50.0 group driven
BALL id 503 x 800.0 y 500.0 rad 50.0 group driven
BALL id 504 x 3000.0 y 600.0 rad 50.0 group driven
BALL id 505 x 3000.0 y 4300.0 rad 50.0 group driven
BALL id 506 x 5200.0 y 4300.0 rad 50.0 group driven
BALL id 507 x 4000.0 y 4120.0 rad 50.0 group driven
PROP density 2.5e3 kn 1e9 ks 0
FIX x y spin
INI yv -5.0 RANGE group driven
INI yv 5.0 RANGE id 502 502
INI yv -0.5 RANGE id 504 504
INI yv -0.1 RANGE id 507 507
CYC 4500
{more}STOP
"""


def named(log: str) -> dict[str, list[int]]:
    """Ids by what they slipped through, in the order of the log."""
    out: dict[str, list[int]] = {}
    for what, names in re.findall(r"particles passed through (a row of GLINE|a wall): (.*)", log):
        out.setdefault(what, []).extend(int(name) for name in re.findall(r"(\d+) at \(", names))
    return out


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.mpi)])
def test_those_that_slip_through_are_named_once(resident, tmp_path: Path, ranks: int) -> None:
    script = tmp_path / "slip.py"
    back = "INI yv 5.0 RANGE id 501 501\nCYC 1200\n"  # back through the row
    script.write_text(SCRIPT.format(more=back))
    done = resident(ranks, script, "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert named(done.stdout) == {"a row of GLINE": [501, 502], "a wall": [505]}
    places = dict(re.findall(r"(\d+) at \((\S+, \S+)\)", done.stdout))
    x, y = map(float, places["501"].split(", "))
    assert x == 2000.0 and 100.0 - 30.0 < y < 100.0  # below the row, at the first rebuild after


def test_rows_survive_a_checkpoint(resident, tmp_path: Path) -> None:
    """Saved before the row is passed, gone on with after."""
    script = tmp_path / "slip.py"
    script.write_text(SCRIPT.format(more="").replace("CYC 4500", "CYC 1000\nSAV here.sav"))
    assert resident(1, script, "--no-figure", cwd=tmp_path).returncode == 0
    (tmp_path / "on.py").write_text("RES here.sav\nCYC 3500\nSTOP\n")
    done = resident(1, tmp_path / "on.py", "--no-figure", cwd=tmp_path)
    assert named(done.stdout) == {"a row of GLINE": [501, 502], "a wall": [505]}
