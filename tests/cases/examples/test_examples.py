"""The scripts of examples/: all can be read, and push.py runs from a shortened text to its figure."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from hpcdem.io.frames import list_frames, read_frame
from hpcdem.lang.detect import kind
from tests.conftest import ROOT, sources
from tests.property.workers import Resident

SCRIPTS = [p for p in sources("examples") if p.suffix in (".py", ".sc")]
EXAMPLES = [p for p in SCRIPTS if kind(p.read_bytes()) in ("zdem", "pcdc")]


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.name)
def test_every_example_passes_the_check(resident: Resident, script: Path, tmp_path: Path) -> None:
    """And leaves nothing beside it."""
    shutil.copy(script, tmp_path)
    done = resident(1, "--check", tmp_path / script.name)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == [script.name]


def test_push_with_fewer_steps_runs_to_its_figure(resident: Resident, tmp_path: Path) -> None:
    """The text of the example with a tenth of the settling and a hundredth of the way: every command is carried out."""
    text = (ROOT / "examples" / "push.py").read_text()
    text = re.sub(r"^CYC (\d+)", lambda m: f"CYC {int(m[1]) // 10}", text, flags=re.MULTILINE)
    text, found = re.subn(r"xmove \S+ print \S+ save \S+", "xmove 60.0 print 30.0 save 60.0", text)
    assert found == 1
    (tmp_path / "push.py").write_text(text)
    done = resident(1, tmp_path / "push.py")
    assert done.returncode == 0, done.stdout + done.stderr
    figure = re.findall(r"^figure: (\S+)$", done.stdout, flags=re.MULTILINE)
    assert figure and Path(figure[0]).stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.mpi
def test_whole_push_makes_thrust_sheets(resident: Resident, tmp_path: Path) -> None:
    """The figure of the README: the wedge at the wall is clearly thicker than the bed in front, and nothing was
    lost."""
    done = resident(2, ROOT / "examples" / "push.py", "--outdir", tmp_path / "data", timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    frames = list_frames(tmp_path / "data")
    first, last = read_frame(frames[0].path), read_frame(frames[-1].path)
    p = last.tables["particles"].columns
    wall = last.walls["p1"][last.walls["id"] == 1][0, 0]
    near, far = p["x"] < wall + 2000.0, p["x"] > 19000.0
    assert p["y"][near].max() > 1.4 * p["y"][far].max()
    assert len(p["x"]) <= len(first.tables["particles"].columns["x"])
