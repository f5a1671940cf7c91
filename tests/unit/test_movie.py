"""`hpcdem movie`: films of frames and of pages."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.movie import movie, work
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io import colours
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.post import movie as films
from tests.unit.io_synthetic import make_frame
from tests.unit.test_zdem2jpg import Silent

pytestmark = pytest.mark.figures
image = pytest.importorskip("PIL.Image")


def make(folder: Path, *words: str) -> list[str]:
    """Run the program in this process; its lines."""
    log = Silent()
    chosen = read_command_line(movie, "hpcdem movie", [str(folder), "--max_workers=1", *words])
    work(SerialComm(), log, chosen)  # type: ignore[arg-type]
    return log.lines


def gif(path: Path) -> tuple[list[np.ndarray], list[int], Any]:
    """Frames (height, width, 3) of bytes, durations [ms], and how often it runs (0: for ever)."""
    with image.open(path) as film:
        frames, durations = [], []
        for k in range(film.n_frames):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB")))
            durations.append(film.info["duration"])
        return frames, durations, film.info.get("loop")


@pytest.fixture
def no_ffmpeg(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(films, "ffmpeg", lambda: None)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four frames in which the blue wall goes to the right; in the last one the red one is out of the BOX."""
    made = tmp_path / "data"
    made.mkdir()
    for k in range(4):
        frame = make_frame(60)
        frame.step = 1000 * k
        frame.walls["p1"][5, 0] = frame.walls["p2"][5, 0] = 10010.0 + 9000.0 * k
        frame.walls["p1"][6, 0] = frame.walls["p2"][6, 0] = 46000.0 if k == 3 else 40010.0
        write_vtkhdf(made / f"all_{frame.step:010d}.vtkhdf", frame, SerialComm())
    return made


def test_a_gif_of_frames_that_do_not_jump(folder: Path, no_ffmpeg: None) -> None:
    lines = make(folder, "--fps=8", "--size=500", "--surfaceshow=false")
    assert sorted(p.name for p in folder.glob("movie*")) == ["movie.gif"] and not list(folder.glob(".movie*"))
    frames, durations, loop = gif(folder / "movie.gif")
    assert "4 frames, 0.5 s" in lines[-1]
    assert len(frames) == 4 and sum(durations) == 500 and loop == 0
    assert {f.shape for f in frames} == {frames[0].shape} and frames[0].shape[1] == 500
    # Frame of the axes and particles stand still, the blue wall does not.
    still = np.abs(np.stack(frames).astype(int) - frames[0]).max(axis=(0, 3)) < 30
    assert still.mean() > 0.97
    blue = [np.flatnonzero(((f[:60, :, 2] > 200) & (f[:60, :, 0] < 160)).any(0)) for f in frames]
    places = [b.mean() for b in blue]
    steps = np.diff(places)
    assert 70 < steps.min() and np.ptp(steps) < 3
    # Colours of particles are exact in the palette.
    red = (np.round(255 * colours.RGB[3])).astype(np.uint8)
    assert (frames[0] == red).all(-1).sum() > 50 and (frames[0] == 255).all(-1).mean() > 0.4


def test_time_is_kept_where_frames_are_alike(folder: Path, no_ffmpeg: None) -> None:
    make(folder, "--wallshow=false", "--fps=3", "--size=200")
    frames, durations, _ = gif(folder / "movie.gif")
    assert len(frames) == 1 and sum(np.atleast_1d(durations)) == pytest.approx(1330, abs=10)
    make(folder, "--wallshow=false", "--fps=3", "--size=200", "--showlable=true")  # the step tells them apart
    frames, durations, _ = gif(folder / "movie.gif")
    assert len(frames) == 4 and sum(durations) == pytest.approx(1330, abs=10)


@pytest.mark.slow
def test_the_same_frames_give_the_same_film(folder: Path, no_ffmpeg: None) -> None:
    make(folder, "--size=200")
    first = (folder / "movie.gif").read_bytes()
    make(folder, "--size=200", "--max_workers=2", "-o", str(folder / "other.gif"))
    assert (folder / "other.gif").read_bytes() == first


@pytest.mark.slow
def test_pages_of_zdemss_become_a_film(folder: Path, no_ffmpeg: None) -> None:
    pages = folder / "ss"
    with pytest.raises(HpcdemError, match="cannot read the folder"):
        make(folder, "--from", "ss")
    pages.mkdir()
    with pytest.raises(HpcdemError, match="make them with zdemss first"):
        make(folder, "--from", "ss")
    for name, shade, size in (
        ("all_0000002000", "lime", (300, 200)),
        ("all_0000001000", "red", (300, 200)),
        ("all_0000001000_ini", "blue", (300, 260)),
        ("series", "black", (300, 200)),
    ):
        image.new("RGB", size, shade).save(pages / f"{name}.jpg", quality=95)
    make(folder, "--from", "ss", "--size=150", "--fps=2", "-o", str(folder / "pages.gif"))
    frames, durations, _ = gif(folder / "pages.gif")
    assert durations == [500] * 3 and frames[0].shape == (130, 150, 3)
    for frame, channel in zip(frames, (0, 2, 1)):
        assert frame[20, 20, channel] > 240 > 20 > np.delete(frame[20, 20], channel).max()
    assert frames[0][120].min() > 250  # white below the lower page


def test_without_ffmpeg_mp4_is_refused_at_once(folder: Path, no_ffmpeg: None) -> None:
    for words in (["--format=mp4"], ["--format=both"], ["-o", str(folder / "a.mp4")]):
        with pytest.raises(HpcdemError, match="MP4 needs ffmpeg"):
            make(folder, *words)
    with pytest.raises(HpcdemError, match="ffmpeg was not found"):
        films.write_mp4([], folder / "a.mp4", 10.0)
    assert not list(folder.glob("*.gif"))


FAKE = """\
import sys
data = sys.stdin.buffer.read()
words = sys.argv[1:]
if "{codec}" not in words:
    print("Unknown encoder", file=sys.stderr)
    sys.exit(1)
open(words[-1], "w").write(f"{{len(data)}} {{words[words.index('-s') + 1]}} {{words[words.index('-r') + 1]}}")
"""


@pytest.mark.parametrize("codec", ["libx264", "mpeg4"])
def test_what_ffmpeg_is_given(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, codec: str) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\n" + FAKE.format(codec=codec))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    make(folder, "--size=201", "--fps=12.5")
    with image.open(folder / "movie.gif") as film:
        assert film.size[0] == 201
    count, size, fps = (folder / "movie.mp4").read_text().split()
    width, height = map(int, size.split("x"))
    assert (width, fps) == (202, "12.5") and height % 2 == 0 and int(count) == 4 * width * height * 3


def test_what_ffmpeg_says_is_passed_on(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\n" + FAKE.format(codec="none"))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(HpcdemError, match="ffmpeg reports: Unknown encoder"):
        make(folder, "--format=mp4", "--size=100")
    assert not list(folder.glob("movie*"))


@pytest.mark.skipif(films.ffmpeg() is None, reason="no ffmpeg here")
def test_a_real_mp4(folder: Path) -> None:
    make(folder, "--format=mp4", "--size=200", "--fps=5")
    said = subprocess.run(
        [films.ffmpeg() or "", "-i", folder / "movie.mp4", "-f", "null", "-"],
        capture_output=True,
        text=True,
        check=True,
    ).stderr
    assert "200x" in said and "frame=    4" in said


def test_errors(folder: Path, tmp_path: Path, no_ffmpeg: None) -> None:
    with pytest.raises(UsageError, match="--format mp4 does not make"):
        make(folder, "--format=mp4", "-o", "a.gif")
    with pytest.raises(HpcdemError, match="folder not found"):
        make(tmp_path / "none")
    with pytest.raises(HpcdemError, match="the folder does not exist"):
        make(folder, "-o", str(tmp_path / "none" / "a.gif"))
    with pytest.raises(HpcdemError, match="no frame all_"):
        make(tmp_path)
    with pytest.raises(HpcdemError, match="cannot read the colours"):
        make(folder, "--colormap=none.txt")
    assert not list(folder.glob(".movie*"))
