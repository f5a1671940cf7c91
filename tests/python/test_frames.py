"""Frames and simulations in programs and notebooks: tables for pandas and xarray, pictures, what they show."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import hpcdem
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.runtime import notebook
from hpcdem.runtime.progress import Log
from tests.property.workers import Resident
from tests.view.frames import write_blocks, write_discs


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for step in (0, 10, 20):
        write_discs(tmp_path, step)
    return tmp_path


def test_frames_of_a_folder_in_order(folder: Path) -> None:
    frames = hpcdem.frames(folder)
    assert [frame.step for frame in frames] == [0, 10, 20] == [frame.step for frame in frames[0:3]]
    assert frames[-1].step == 20 and len(frames[1:]) == 2
    assert hpcdem.frames(frames.files[1].path)[0].step == 10
    table = frames[0].table()
    assert {"x", "y", "radius", "velocity_x", "gid"} <= set(table)
    assert len(table["x"]) == frames[0].objects["particles"]
    assert "steps 0 to 20" in repr(frames)


def test_tables_are_those_of_the_file(tmp_path: Path) -> None:
    path = write_blocks(tmp_path, 10, grown=0.02)
    frame, state = hpcdem.frames(tmp_path)[0], read_mesh_frame(path)
    assert np.array_equal(frame.table("elements")["stress_yy"], state.of_elements["stress_yy"])
    assert "stress_yy" in frame.fields() and len(frame.table("joints")["state"]) == frame.objects["joints"]
    with pytest.raises(HpcdemError, match="this frame has no particles"):
        frame.table("particles")


def test_kinds_have_to_be_said_apart(folder: Path) -> None:
    write_blocks(folder, 5)
    with pytest.raises(HpcdemError, match=r"frames of all, .*select one"):
        hpcdem.frames(folder)
    assert hpcdem.frames(folder, "all")[0].objects["particles"]
    with pytest.raises(HpcdemError, match="folder or file not found"):
        hpcdem.frames(folder / "nowhere")
    (folder / "empty").mkdir()
    with pytest.raises(HpcdemError, match="no frames found"):
        hpcdem.frames(folder / "empty")


def test_pictures_and_what_a_notebook_shows(folder: Path) -> None:
    frame = hpcdem.frames(folder)[-1]
    plain, by_field = (
        Image.open(io.BytesIO(png)) for png in (frame.picture(width=400), frame.picture("vx", width=300))
    )
    assert plain.width == 400 and by_field.width == 300
    assert frame._repr_png_()[:4] == b"\x89PNG"
    assert "data:image/png;base64," in frame._repr_html_() and "step 20" in frame._repr_html_()
    with pytest.raises(HpcdemError, match="has no field nonsense"):
        frame.picture("nonsense")


def test_pandas_and_xarray(folder: Path) -> None:
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    frames = hpcdem.frames(folder)
    one = frames[1].pandas()
    assert isinstance(one, pandas.DataFrame) and one.index.name == "gid"
    assert np.array_equal(one["x"], frames[1].table()["x"])
    every = frames.pandas()
    assert len(every) == sum(frame.objects["particles"] for frame in frames)
    data = frames.xarray()
    assert isinstance(data, xarray.Dataset) and list(data["step"]) == [0, 10, 20]
    assert np.array_equal(data["time"], [frame.time for frame in frames])
    assert data["x"].attrs["units"] == "m" and data["velocity_x"].attrs["units"] == "m/s"
    assert np.array_equal(data["x"].sel(step=10).dropna(one.index.name), one["x"])


def test_a_missing_package_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(UsageError, match="package pandas is not installed: pip install pandas"):
        hpcdem.frames(folder)[0].pandas()


PROGRAM = """\
import hpcdem

sim = hpcdem.Simulation(log=False)
assert "nothing yet" in repr(sim)
sim.set(dt=1e-3, gravity=(0.0, -9.8), disk="on")
sim.wall(0, nodes=((0.0, 0.0), (100.0, 0.0)))
sim.gen(30, rad=[1.0, 1.5], x=(0.0, 100.0), y=(2.0, 50.0))
sim.prop(density=2000.0, shear=1e7, poiss=0.2, hertz=True)
sim.cycle(20)
frame = sim.frame()
x, vy = sim.gather("x", "vy")
assert (frame.table()["x"] == x).all() and (frame.table()["velocity_y"] == vy).all() and frame.step == 20
assert "30 particles" in repr(sim) and "data:image/png" in sim._repr_html_() and sim._repr_png_()[:4] == b"\\x89PNG"
sim.mesh.structured((0, 60), (10, 70), cells=(2, 2), group="a")
sim.elements.model("mech-iso-elastic", density=2700, young=30e9, poisson_ratio=0.25)
assert sim.frame("blocks").objects["elements"] == 8 and "elements" not in sim.frame().objects
sim.frame("walls")
"""


@pytest.mark.parametrize(
    ("ranks", "line", "told"),
    [(1, 17, "of: expected 'particles' or 'blocks', got 'walls'"), (2, 10, "on one rank; on several .*hpcdem.frames")],
)
def test_frame_of_a_simulation(resident: Resident, tmp_path: Path, ranks: int, line: int, told: str) -> None:
    """As it is now: particles, blocks, and what it shows; on several ranks it is refused, with the way out."""
    (tmp_path / "study.py").write_text(PROGRAM)
    done = resident(ranks, "study.py", cwd=tmp_path)
    assert done.returncode == 2 and re.search(f"^hpcdem: study.py:{line}: frame: .*{told}", done.stderr), done.stderr


class Handle:
    """Of IPython's display: what was shown last."""

    shown: list[str] = []

    def update(self, text: str) -> None:
        self.shown.append(text)


def test_progress_in_a_notebook(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    """Bars move over themselves; lines stay lines."""
    display = type("display", (), {"HTML": str, "display": staticmethod(lambda text, display_id: Handle())})
    monkeypatch.setitem(__import__("sys").modules, "IPython", type("IPython", (), {"display": display}))
    monkeypatch.setitem(__import__("sys").modules, "IPython.display", display)
    monkeypatch.delitem(__import__("sys").modules, "ipykernel", raising=False)
    monkeypatch.setattr("hpcdem.runtime.progress.in_notebook", lambda: True)
    monkeypatch.setattr(notebook.NotebookBar, "REDRAW", -1.0)
    log = Log()
    log.command_started("CYC", 0, 100, 0)
    log.wants(25)
    log.info("a word")
    log.command_finished()
    assert 'value="25" max="100"' in Handle.shown[0] and "25 of 100 steps" in Handle.shown[0]
    assert "a word\n" in capsys.readouterr().out
    assert not notebook.in_notebook()
