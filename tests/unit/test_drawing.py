"""The layers of a picture, and the DRAW command that makes one every so many steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.post.layers import LAYERS, MOST_LABELS
from hpcdem.post.plots import frame_figure
from tests.conftest import Launcher
from tests.property.workers import Resident
from tests.unit.io_synthetic import make_frame


@pytest.mark.parametrize("word", LAYERS)
def test_every_layer_draws_something(word: str) -> None:
    frame = make_frame(30)
    alone, empty = (frame_figure(frame, what).axes[0] for what in ((word,), ()))
    assert len(alone.collections) + len(alone.texts) > len(empty.collections) + len(empty.texts) == 0


@pytest.mark.parametrize("word", LAYERS)
def test_no_layer_minds_an_empty_model(word: str) -> None:
    frame = make_frame(30)
    for table in frame.tables.values():
        table.columns = {name: values[:0] for name, values in table.columns.items()}
    frame_figure(frame, (word,))


def test_bonds_are_coloured_by_the_sign_of_their_force() -> None:
    frame = make_frame(30)
    fn = frame.tables["bonds"].columns["fn"]
    fn[:] = np.where(np.arange(len(fn)) % 2, 1.0, -1.0)
    (lines,) = frame_figure(frame, ("bondc",)).axes[0].collections
    shades = lines.get_colors()
    assert len(shades) == len(fn) > 2
    assert (shades[fn < 0, 0] > 0.7).all() and (shades[fn > 0, 2] > 0.6).all()


def test_ids_are_left_out_where_nobody_could_read_them() -> None:
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    LAYERS["bid"](make_frame(MOST_LABELS + 1), ax)
    assert not ax.texts


SCRIPT = """\
START
BOX left 0.0 right 20.0 bottom 0.0 height 20.0 kn 1e6 ks 1e6
GEN num 30 rad discrete 1.0 x 0.0 20.0 y 0.0 20.0 color red
PROP density 2000.0 kn 1e6 ks 1e6
SET dt 1e-3 gravity 0.0 -9.8
DRAW interval 100 {what}
CYC 250
STOP
"""


@pytest.mark.mpi
def test_draw_makes_pictures_if_asked(resident: Resident, tmp_path: Path) -> None:
    pictures = {}
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.py").write_text(SCRIPT.format(what="bfill, wall bang cforce"))
        done = resident(ranks, "--draw", "--no-figure", "a.py", cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        pictures[ranks] = {p.name: p.read_bytes() for p in (folder / "data").glob("draw_*")}
    assert sorted(pictures[1]) == ["draw_0000000100.jpg", "draw_0000000200.jpg"]
    assert pictures[1] == pictures[2]
    assert min(map(len, pictures[1].values())) > 5000


@pytest.mark.slow
def test_draw_is_only_noted_without_the_option(launch: Launcher, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(SCRIPT.format(what=""))
    done = launch(1, "--no-figure", "a.py", cwd=tmp_path)
    assert done.returncode == 0 and "no pictures without the option --draw" in done.stdout
    assert not list((tmp_path / "data").glob("draw_*"))
