"""zdem2jpg: every option by what it changes in the picture."""

from __future__ import annotations

import io
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.pictures import as_usual, style_of
from hpcdem.cli.zdem2jpg import of_field, work, zdem2jpg
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, ScriptError, UsageError
from hpcdem.io import colours
from hpcdem.io.dat import write_dat
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.post.plots import Style, frame_figure, seen_of
from hpcdem.post.series import Job, Progress, draw_all
from tests.conftest import Launcher
from tests.unit.io_synthetic import make_frame

pytestmark = pytest.mark.figures
image = pytest.importorskip("PIL.Image")


class Silent:
    """A log that keeps its lines."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)


def options(*words: str, folder: Path | str = "x") -> dict[str, Any]:
    return read_command_line(zdem2jpg, "zdem2jpg", ["--dir", str(folder), *words])


def style(*words: str, folder: Path | str = "x") -> Style:
    chosen = options(*words, folder=folder)
    return style_of(chosen, Path(folder), chosen["pagesize"], chosen["dpi"])


def axes(*words: str, frame: Any = None) -> Any:
    """The axes of the picture of a synthetic frame."""
    chosen = style(*words)
    return frame_figure(make_frame(200) if frame is None else frame, chosen.what, chosen).axes[0]


def draw(folder: Path, *words: str) -> np.ndarray:
    """The first picture of a folder, drawn in this process; (height, width, 3) from 0 to 1."""
    work(SerialComm(), Silent(), options("--dpi=100", "--max_workers=1", *words, folder=folder))  # type: ignore[arg-type]
    return picture(sorted(folder.glob("all_*.jpg"))[0])


def picture(path: Path) -> np.ndarray:
    with image.open(path) as opened:
        return np.asarray(opened.convert("RGB")) / 255.0


def like(pixels: np.ndarray, shade: Any) -> int:
    """How many pixels have about this colour."""
    return int((np.abs(pixels - np.asarray(shade)).max(axis=-1) < 0.12).sum())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with one frame."""
    made = tmp_path / "data"
    made.mkdir()
    write_vtkhdf(made / "all_0000001000.vtkhdf", make_frame(300), SerialComm())
    return made


# --- reading the command line --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        ["--dir", "./data", "--xmove", "-1000.0"],
        ["--dir=./data", "--xmove=-1000.0"],
        ["--dir=", "./data", "--xmove=", "-1000.0"],
        ["-dir=./data", "-xmove=-1000.0"],
        ["-d", "./data", "--xmove", "-1000.0"],
        ["--xmove=-1000.0", "--", "--dir=", "./data"],
    ],
)
def test_the_manuals_ways_of_writing_are_understood(words: list[str]) -> None:
    read = read_command_line(zdem2jpg, "zdem2jpg", words)
    assert read["folder"] == Path("./data") and read["xmove"] == -1000.0


def test_the_manuals_defaults() -> None:
    read = options()
    assert read["dpi"] == 600 and read["pagesize"] == 14 and read["fontsize"] == 9 and read["linewidth"] == 0.8
    assert all(read[f"{name}show"] for name in ("left", "right", "bottom", "top", "wall", "surface"))
    assert read["ballplot"] and not read["bondplot"] and read["xmove"] == read["ymove"] == 0.0
    assert options("--dpi=300.0", "--max_workers=24.0")["max_workers"] == 24


def test_pictures_of_several_kinds(folder: Path) -> None:
    """--format: each frame in each kind, the same picture; a JPG where nothing is said."""
    heads = {"png": b"\x89PNG", "tiff": b"II*\0", "pdf": b"%PDF", "svg": b"<?xml", "jpg": b"\xff\xd8"}
    work(SerialComm(), Silent(), options("--dpi=80", "--format=PNG,tif,pdf, svg", folder=folder))  # type: ignore[arg-type]
    found = {path.suffix[1:]: path for path in folder.iterdir() if path.suffix != ".vtkhdf"}
    assert set(found) == {"png", "tiff", "pdf", "svg"}
    assert all(path.stem == "all_0000001000" and path.read_bytes().startswith(heads[k]) for k, path in found.items())
    np.testing.assert_array_equal(picture(found["png"]), picture(found["tiff"]))
    work(SerialComm(), Silent(), options("--dpi=80", folder=folder))  # type: ignore[arg-type]
    assert (folder / "all_0000001000.jpg").read_bytes().startswith(heads["jpg"])


def test_a_blank_after_the_sign_does_not_eat_an_option() -> None:
    assert as_usual(["--colormap=", "--dpi=3"], {"--colormap", "--dpi"}) == ["--colormap=", "--dpi=3"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--dri=x"], "--dir"),
        (["--dir", "x", "--fontsze=3"], "--fontsize"),
        (["--dir", "x", "-bondplt=true"], "such option"),
        (["--dir", "x", "--format=gif"], "'gif' is not a picture format"),
        (["--dir", "x", "--dpi=many"], "'many' is not a valid float"),
        (["--dir", "x", "--dpi=-3"], "-3 is not a number above 0"),
        (["--dir", "x", "--pagesize=nan"], "nan is not a number above 0"),
        (["--dir", "x", "--xmax=inf"], "inf is not a number"),
        (["--dir", "x", "--wallshow=perhaps"], "'perhaps' is not a valid boolean"),
        (["--dpi=3"], "Missing option"),
        (["--dir", "x", "more"], "unexpected extra argument"),
    ],
)
def test_what_is_not_understood_is_named(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        read_command_line(zdem2jpg, "zdem2jpg", words)
    assert left.value.code == 2 and message in " ".join(capsys.readouterr().err.split())


def test_every_option_is_explained() -> None:
    assert all(p.help for p in zdem2jpg.params if isinstance(p, click.Option))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--xmin=5000", "--xmax=4000"], "--xmax=4000 is not above --xmin=5000"),
        (["--major_locator=10", "--minor_locator=20"], "--minor_locator=20 is larger"),
        (["--ymax=-5"], "limits contain nothing"),
        (["--major_locator=1"], "more than 1000 ticks"),
        (["--pagesize=2", "--fontsize=30"], "too small for numbers"),
    ],
)
def test_values_that_do_not_go_together(words: list[str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        axes(*words)


# --- what the options do -------------------------------------------------------------------------------------------


def test_page_and_dpi_give_the_pixels(folder: Path) -> None:
    draw(folder, "--pagesize=10", "--dpi=150")
    with image.open(folder / "all_0000001000.jpg") as opened:
        assert opened.size[0] == pytest.approx(10 / 2.54 * 150, abs=1) and opened.info["dpi"] == (150, 150)
    assert draw(folder, "--dpi=100").shape[1] == pytest.approx(14 / 2.54 * 100, abs=1)


def test_limits() -> None:
    ax = axes("--xmin=5000", "--xmax=30000", "--ymin=1000", "--ymax=9000")
    assert ax.get_xlim() == (5000, 30000) and ax.get_ylim() == (1000, 9000)
    ax = axes("--xmax=50000")
    assert ax.get_xlim() == (0, 50000) and ax.get_ylim() == (0, 11000)


def test_the_model_is_moved_under_the_limits(folder: Path) -> None:
    ax = axes("--xmove=-1000", "--ymove=-500", "--xmax=30000")
    assert (ax.get_xlim() == (0, 30000) and ax.get_ylim() == (-500, 10500)) or ax.get_ylim() == (0, 10500)
    (discs,) = [c for c in ax.collections if hasattr(c, "places")]
    np.testing.assert_allclose(discs.places[:, 0], make_frame(200).tables["particles"].columns["x"] - 1000.0)
    still, moved = (
        draw(folder, "--surfaceshow=false", *w, "--xmin=0", "--xmax=41000") for w in ([], ["--xmove=-9000"])
    )
    left_wall = [np.flatnonzero((np.abs(p - colours.RGB[7]).max(-1) < 0.2).sum(axis=0) > 20)[0] for p in (still, moved)]
    width = (still.shape[1] - 60) / 41000  # pixels per metre, about
    assert left_wall[0] - left_wall[1] == pytest.approx(9000 * width, rel=0.1)


def test_lower_limits_are_zero_unless_particles_lie_below() -> None:
    frame = make_frame(100)
    frame.settings |= {"left": -3000.0, "right": 41000.0}
    frame.walls["p1"][0] = frame.walls["p2"][3] = (-3000.0, 0.0)
    assert seen_of(frame, style()).left == 0.0
    frame.tables["particles"].columns["x"][0] = -2500.0
    assert seen_of(frame, style()).left == -3000.0
    frame = make_frame(100)
    frame.settings["left"] = 8000.0  # a model that begins far from zero is not shown as a speck
    frame.walls = {name: values[5:] for name, values in frame.walls.items()}
    assert seen_of(frame, style()).left == 8000.0


def all_steps(ax: Any) -> np.ndarray:
    """Steps between ticks along x, with numbers or not."""
    return np.diff(np.unique(np.round([*ax.get_xticks(), *ax.get_xticks(minor=True)], 3)))


def test_locators() -> None:
    ax = axes("--major_locator=5000", "--minor_locator=2500")
    assert np.diff(ax.get_xticks()) == pytest.approx(5000) and np.diff(ax.get_yticks()) == pytest.approx(5000)
    assert all_steps(ax) == pytest.approx(2500)
    assert [t.get_text() for t in ax.get_xticklabels()][:3] == ["0", "5", "10"]
    ax = axes()
    assert np.diff(ax.get_xticks()) == pytest.approx(10000) and all_steps(ax) == pytest.approx(1000)
    assert list(ax.get_yticks()) == [0, 10000]
    assert all_steps(axes("--minor_locator=2000")) == pytest.approx(2000)
    small = axes(frame=make_frame(30, scale=1e-3))  # a box of 41 m has ticks as well
    assert len(small.get_xticks()) > 2


def test_fontsize_and_linewidth() -> None:
    ax = axes("--fontsize=14", "--linewidth=2.5")
    assert {t.get_fontsize() for t in (*ax.get_xticklabels(), ax.xaxis.label)} == {14.0}
    assert {s.get_linewidth() for s in ax.spines.values()} == {2.5}
    assert 2.5 in {w for c in ax.collections for w in c.get_linewidths()}


def test_large_letters_stay_on_the_page() -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    ax = axes("--fontsize=20")
    FigureCanvasAgg(ax.figure).draw()
    page = ax.figure.bbox
    for text in (*ax.get_xticklabels(), *ax.get_yticklabels(), ax.xaxis.label, ax.yaxis.label):
        box = text.get_window_extent()
        assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1, text


@pytest.mark.parametrize("side", ["left", "right", "bottom", "top"])
def test_each_side_of_the_frame_can_be_left_out(side: str, folder: Path) -> None:
    ax = axes(f"--{side}show=false")
    assert {name for name, spine in ax.spines.items() if not spine.get_visible()} == {side}
    box = axes().get_position()
    both = [draw(folder, *words, "--wallshow=false", "--linewidth=2") for words in ([], [f"--{side}show=false"])]
    for pixels, shown in zip(both, (True, False)):
        height, width, _ = pixels.shape
        row, column = int((1 - (box.y0 + 0.955 * box.height)) * height), int((box.x0 + 0.0366 * box.width) * width)
        at = {"left": box.x0, "right": box.x1, "bottom": 1 - box.y0, "top": 1 - box.y1}[side]
        around = round(at * (width if side in ("left", "right") else height))
        line = slice(around - 2, around + 3)
        here = pixels[row - 1 : row + 2, line] if side in ("left", "right") else pixels[line, column - 1 : column + 2]
        assert (here.min() < 0.3) == shown


def test_walls(folder: Path) -> None:
    with_walls, without = (draw(folder, f"--wallshow={word}", "--ballplot=false") for word in ("true", "false"))
    for number in (7, 3):  # the blue and the red wall
        assert like(with_walls, colours.RGB[number]) > 50 > like(without, colours.RGB[number]) == 0
    assert axes("--wallshow=false", "--xmax=30000").get_xlim() == (0, 30000)


def test_surface_particles_and_bonds(folder: Path) -> None:
    nothing = ["--wallshow=false", "--surfaceshow=false", "--ballplot=false"]
    empty = draw(folder, *nothing)
    surface = draw(folder, "--wallshow=false", "--ballplot=false")
    assert (surface.min(-1) < 0.5).sum() > (empty.min(-1) < 0.5).sum() + 100
    balls = draw(folder, "--wallshow=false", "--surfaceshow=false")
    assert like(balls, colours.RGB[3]) > 300 and like(empty, colours.RGB[3]) == 0
    bonds = draw(folder, *nothing, "-bondplot=true")
    assert (bonds.min(-1) < 0.7).sum() > (empty.min(-1) < 0.7).sum() + 300


def test_bonds_are_black_red_and_blue(folder: Path) -> None:
    frame = make_frame(300)
    bonds, contacts = frame.tables["bonds"].columns, frame.tables["contacts"].columns
    bonds["fn"] = np.where(np.arange(len(bonds["fn"])) % 3 == 0, -1.0, 1.0)
    lines = axes(
        "--bondplot=true", "--ballplot=false", "--wallshow=false", "--surfaceshow=false", frame=frame
    ).collections
    counts = {tuple(np.round(c.get_colors()[0][:3], 1)): len(c.get_segments()) for c in lines}
    pulled = int((bonds["fn"] < 0).sum())
    glued = {*zip(bonds["id1"], bonds["id2"])}
    free = sum(pair not in glued for pair in zip(contacts["id1"], contacts["id2"]))
    assert counts == {(0.0, 0.0, 0.0): free, (0.8, 0.1, 0.1): pulled, (0.1, 0.2, 0.7): len(bonds["fn"]) - pulled}
    assert min(counts.values()) > 20


def test_a_text_frame_without_bonds_can_be_plotted(tmp_path: Path) -> None:
    frame = make_frame(50)
    for name in ("contacts", "bonds"):
        table = frame.tables[name]
        table.columns, table.total = {k: v[:0] for k, v in table.columns.items()}, 0
    write_dat(tmp_path / "all_0000001000.dat", frame, SerialComm())
    draw(tmp_path, "--bondplot=true")


def test_labels(folder: Path) -> None:
    assert not len(axes().texts) and not len(axes("--showlable=OFF").texts)
    assert axes("--showlable=ON").texts[0].get_text() == "step 46000"
    assert axes("--showable=abc").texts[0].get_text() == "abc"
    assert axes("--showlabel={time} s").texts[0].get_text() == "2300.05 s"


# --- colours -------------------------------------------------------------------------------------------------------

PALETTE = "\n".join(f"{k / 10} 0.5, {1 - k / 10}  # number {k}" for k in range(10)) + "\n\n"


def test_a_colour_file_is_searched_here_then_in_the_folder_then_at_home(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, home = tmp_path / "here", tmp_path / "home"
    here.mkdir(), home.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setenv("HOME", str(home))
    for place in (home, folder, here):  # each found before the one before
        (place / "my.txt").write_text(PALETTE)
        assert colours.find_palette("my.txt", folder).resolve() == place / "my.txt"
    # With a folder in the name it is that file or none.
    assert colours.find_palette("./my.txt", folder).resolve() == here / "my.txt"
    assert colours.find_palette(str(home / "my.txt"), folder) == home / "my.txt"
    (here / "my.txt").unlink()
    with pytest.raises(HpcdemError, match=r"\./my\.txt: file not found"):
        colours.find_palette("./my.txt", folder)
    with pytest.raises(HpcdemError, match=r"neither here, nor in .*data, nor in .*home"):
        colours.find_palette("other.txt", folder)


def test_the_colours_of_a_file_are_drawn(folder: Path) -> None:
    (folder / "my.txt").write_text(PALETTE)
    pixels = draw(folder, "--colormap=", "my.txt", "--surfaceshow=false", "--wallshow=false")
    assert like(pixels, (0.3, 0.5, 0.7)) > 300 and like(pixels, colours.RGB[3]) == 0


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("0 0 0\n0 0\n", 2, "expected three numbers"),
        ("0 0 0\n\n# x\n0 red 0\n", 4, "green and blue, not '0 red 0'"),
        ("255 0 0\n", 1, "from 0 to 1"),
        ("0 0 nan\n", 1, "from 0 to 1"),
        ("0 0 0\n" * 9, 9, "expected 10 colours, the file ends after 9"),
        ("0 0 0\n" * 11, 11, "more than 10"),
    ],
)
def test_a_broken_colour_file_is_refused_by_line(text: str, line: int, message: str, tmp_path: Path) -> None:
    file = tmp_path / "my.txt"
    file.write_text(text)
    with pytest.raises(ScriptError, match=message) as refused:
        colours.read_palette(file)
    assert str(refused.value).startswith(f"{file}:{line}: ")


# --- many frames ---------------------------------------------------------------------------------------------------


@pytest.fixture
def three(tmp_path: Path) -> Path:
    """Three frames, one of them in both formats."""
    made = tmp_path / "three"
    made.mkdir()
    write_dat(made / "all_0000000000_ini.dat", make_frame(40, seed=2), SerialComm())
    write_dat(made / "all_0000001000.dat", make_frame(40), SerialComm())
    write_vtkhdf(made / "all_0000001000.vtkhdf", make_frame(40), SerialComm())
    write_dat(made / "all_0000002000.dat", make_frame(40, seed=3), SerialComm())
    return made


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.glob("*.jpg")}


NAMES = ["all_0000000000_ini.jpg", "all_0000001000.jpg", "all_0000002000.jpg"]


@pytest.mark.slow
def test_the_same_bytes_by_one_and_two_processes(three: Path) -> None:
    made = {}
    for workers in ("1", "2"):
        log = Silent()
        words = options("--dpi=100", f"--max_workers={workers}", folder=three)
        work(SerialComm(), log, words)  # type: ignore[arg-type]
        made[workers] = bytes_of(three)
        assert "3 of 3" in log.lines[-1] and "s each" in log.lines[-1]
    assert sorted(made["1"]) == NAMES and made["1"] == made["2"]
    assert len({*made["1"].values()}) == 3
    assert not list(three.glob("*.tmp"))


PROGRAM = """\
import sys
from hpcdem.cli import common
from importlib import import_module
module = import_module("hpcdem.cli.zdem2jpg")
common.run_program(module.zdem2jpg, "zdem2jpg", sys.argv[1:], module.work)
"""


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_bytes_by_two_ranks_and_errors_on_both(three: Path, tmp_path: Path, launch: Launcher) -> None:
    work(SerialComm(), Silent(), options("--dpi=100", "--max_workers=1", folder=three))  # type: ignore[arg-type]
    alone = bytes_of(three)
    for p in three.glob("*.jpg"):
        p.unlink()
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    done = launch.python(2, program, "--dir", three, "--dpi=100")
    assert done.returncode == 0, done.stderr
    assert bytes_of(three) == alone and "3 of 3" in done.stdout
    (three / "all_0000002000.dat").write_text("nonsense\n")
    done = launch.python(2, program, "--dir", three, "--dpi=100")
    assert done.returncode == 1 and "all_0000002000.dat" in done.stderr
    (three / "broken.txt").write_text("1 2\n")
    done = launch.python(2, program, "--dir", three, "--colormap", "broken.txt")
    assert done.returncode == 2 and "broken.txt:1:" in done.stderr


@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_a_broken_frame_is_named_and_the_others_are_drawn(three: Path, workers: str) -> None:
    (three / "all_0000001000.vtkhdf").write_bytes(b"not HDF5")
    with pytest.raises(HpcdemError, match=r"all_0000001000\.vtkhdf"):
        work(SerialComm(), Silent(), options("--dpi=60", f"--max_workers={workers}", folder=three))  # type: ignore[arg-type]
    assert sorted(bytes_of(three)) == [NAMES[0], NAMES[2]]


class Deadly:
    """Ends the process that receives it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os._exit, (9,)


@pytest.mark.slow
def test_a_process_that_is_killed_is_reported(three: Path) -> None:
    jobs = [Job(three / "all_0000001000.dat", three / f"{k}.jpg", Deadly()) for k in range(2)]  # type: ignore[arg-type]
    with pytest.raises(HpcdemError, match=r"lack of memory.*--max_workers"):
        draw_all(jobs, SerialComm(), 2)


def test_a_terminal_gets_a_bar_and_a_file_gets_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    with Progress(2, 2, lines.append) as progress:
        progress.done("first")
        progress.done("second")
    assert len(lines) == 2 and lines[-1].startswith("second: 2 of 2")
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.delenv("OMPI_COMM_WORLD_SIZE", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with Progress(2, 2, lines.append) as progress:
        progress.done("first")
        progress.done("second")
    assert len(lines) == 2 and "second" in terminal.getvalue() and "100%" in terminal.getvalue()


def test_processes_that_draw_do_not_take_themselves_for_ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    from hpcdem.post import series

    for name in ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_SIZE", "SLURM_PROCID"):
        monkeypatch.setenv(name, "1")
    series._alone()
    assert not {name for name in os.environ if name.startswith(("PMI", "OMPI", "SLURM"))}


def test_folders_without_frames(tmp_path: Path) -> None:
    for where, message in ((tmp_path, "no frame all_"), (tmp_path / "none", "cannot read the folder .*none")):
        with pytest.raises(HpcdemError, match=message):
            draw(where)
    shutil.rmtree(tmp_path)


# --- fields --------------------------------------------------------------------------------------------------------


def test_particles_in_the_colours_of_a_field(folder: Path) -> None:
    """--field, and --range and --colours with it, each change the picture; one range holds for all frames."""
    usual = draw(folder)
    by_field = draw(folder, "--field=radius")
    assert by_field.shape[1] == usual.shape[1] and not np.array_equal(by_field, usual)
    assert not np.array_equal(draw(folder, "--field=radius", "--range=0,1000"), by_field)
    assert not np.array_equal(draw(folder, "--field=radius", "--colours=plasma"), by_field)
    later = make_frame(300)
    later.tables["particles"].columns["radius"] *= 1.5
    write_vtkhdf(folder / "all_0000002000.vtkhdf", later, SerialComm())
    assert not np.array_equal(draw(folder, "--field=radius"), by_field)
    radii = make_frame(300).tables["particles"].columns["radius"]
    read = options("--field=radius", folder=folder)
    layer = of_field(read, sorted(folder.glob("*.vtkhdf")))
    assert layer is not None and layer.limits == (radii.min(), 1.5 * radii.max())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--field=nix"], "particles have no field nix"), (["--range=0,1"], "require --field"),
        (["--colours=plasma"], "require --field"), (["--field=vx", "--ballplot=false"], "--ballplot=false hides"),
        (["--field=vx", "--colours=jet"], "colours"), (["--field=vx", "--range=1,0"], "1 is not below 0"),
    ],
)  # fmt: skip
def test_fields_that_cannot_be(folder: Path, words: list[str], message: str) -> None:
    with pytest.raises(HpcdemError, match=message):
        draw(folder, *words)


def test_stress_of_frames_that_are_read_from_files(folder: Path) -> None:
    assert not np.array_equal(draw(folder, "--field=stress"), draw(folder, "--field=stress_xy"))
