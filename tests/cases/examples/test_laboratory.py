"""The examples of the laboratory: hello_drop, biaxial, angle_of_repose. Quick runs of shortened texts, and whole runs
against what their heads claim."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.frames import list_frames, read_frame
from tests.cases.angle_of_repose.test_angle_of_repose import slope
from tests.conftest import ROOT, Launcher

EXAMPLES = ROOT / "examples"


def shortened(name: str, folder: Path, **changes: str) -> Path:
    """A copy of an example in which lines `KEY = ...` or commands `KEY ...` are replaced; each must be there."""
    text = (EXAMPLES / f"{name}.py").read_text()
    for key, new in changes.items():
        text, found = re.subn(rf"^{key}\b.*$", new, text, flags=re.MULTILINE)
        assert found, key
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(text)
    return folder / f"{name}.py"


def number(text: str, pattern: str) -> float:
    """The number in the first match of a pattern."""
    found = re.search(pattern, text)
    assert found, f"{pattern} is not in\n{text}"
    return float(found[1])


def test_hello_drop(launch: Launcher, tmp_path: Path) -> None:
    """The whole of it, started by hpcdem: the fall equals the closed form to the digits printed."""
    done = launch(1, "--outdir", tmp_path, EXAMPLES / "hello_drop.py")
    assert done.returncode == 0, done.stdout + done.stderr
    fallen, theory = number(done.stdout, r"fallen (\S+) m"), number(done.stdout, r"theory (\S+) m")
    assert fallen == theory == pytest.approx(0.5 * 9.8 * 0.8**2, rel=1e-3)
    assert (tmp_path / "hello_drop.jpg").stat().st_size > 10_000


def biaxial(launch: Launcher, ranks: int, folder: Path) -> str:
    """What the biaxial test of 150 grains at two stresses says, started as a plain Python program."""
    script = shortened(
        "biaxial", folder, GRAINS="GRAINS = 150", CONFINING="CONFINING = 20e6, 40e6", STRAIN="STRAIN, RATE = 0.03, 3e-3"
    )
    done = launch.python(ranks, script, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (folder / "data" / "biaxial.jpg").stat().st_size > 10_000
    # Under mpiexec the progress bar may stand before a line.
    return "\n".join(re.findall(r"(?:s3 \d+ MPa: peak|friction angle) [^\r\n]*", done.stdout))


@pytest.mark.slow
@pytest.mark.mpi
def test_short_biaxial_is_the_same_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    """Peaks and last state of a small, quick press, with its servo and its restored specimen."""
    one, two = (biaxial(launch, n, tmp_path / str(n)) for n in (1, 2))
    assert number(one, r"s3 20 MPa: peak of s1 - s3 is (\S+) MPa") > 5.0
    assert one == two
    frames = [list_frames(tmp_path / str(n) / "data")[-1].path.with_suffix(".dat").read_bytes() for n in (1, 2)]
    assert frames[0] == frames[1]


def triangles(launch: Launcher, ranks: int, folder: Path) -> str:
    """What the test of 60 round and 60 triangular grains says."""
    script = shortened(
        "biaxial_triangles",
        folder,
        GRAINS="GRAINS, SIZES = 60, (4e-3, 5e-3, 6e-3)",
        STRESS="STRESS, STRAIN, INERTIAL = 100e3, 0.03, 1e-2",
    )
    done = launch.python(ranks, script, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (folder / "data" / "biaxial_triangles.jpg").stat().st_size > 10_000
    return "\n".join(re.findall(r"(?:round|triangle): void ratio [^\r\n]*", done.stdout))


@pytest.mark.mpi
@pytest.mark.slow
def test_short_triangles_are_the_same_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    """Clumps under a servo: what is printed and the last state."""
    one, two = (triangles(launch, n, tmp_path / str(n)) for n in (1, 2))
    assert one == two and one.count("peak of") == 2
    frames = [list_frames(tmp_path / str(n) / "data")[-1].path.with_suffix(".dat").read_bytes() for n in (1, 2)]
    assert frames[0] == frames[1]


def test_the_triangle_is_what_it_says(tmp_path: Path) -> None:
    """Area and moment of the rounded triangle of the example against a polygon of 30 000 corners; all discs lie inside
    it, and leave out little of the outline."""
    text = (EXAMPLES / "biaxial_triangles.py").read_text()
    names: dict = {"math": math}
    exec(text[text.index("def triangle") : text.index("def write_grains")], names)  # the function of the example
    area, corner = 2.0, 0.22
    discs, moment = names["triangle"](area, corner)
    r = min(disc[2] for disc in discs)
    inner = max(disc[2] for disc in discs) - r
    turn = (np.arange(30_000) + 0.5) / 30_000 * 2.0 * math.pi
    way = math.pi / 2 + np.round((turn - math.pi / 2) / (2 * math.pi / 3)) * 2 * math.pi / 3
    x, y = (2 * inner * f(way) + r * f(turn) for f in (np.cos, np.sin))
    x2, y2 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y2 - x2 * y
    assert 0.5 * cross.sum() == pytest.approx(area, rel=1e-7)
    assert (cross * (x * x + x * x2 + x2 * x2 + y * y + y * y2 + y2 * y2)).sum() / 12 == pytest.approx(moment, rel=1e-7)
    gap = np.min([np.hypot(x - dx, y - dy) - dr for dx, dy, dr in discs], axis=0)
    assert gap.min() > -1e-6
    along = np.linspace(-1.0, 1.0, 2001) * math.sqrt(3) * inner  # the lower edge, which has no corner between its ends
    gap = np.min([np.hypot(along - dx, -inner - r - dy) - dr for dx, dy, dr in discs], axis=0)
    assert 0.0 < gap.max() < 0.04 * math.sqrt(area)


@pytest.mark.slow
def test_short_angle_of_repose_collapses(launch: Launcher, tmp_path: Path) -> None:
    """A smaller column, the wall drawn back by a few millimetres: sand follows it."""
    script = shortened(
        "angle_of_repose",
        tmp_path,
        GEN="GEN grid rad discrete 0.2e-3 0.3e-3 x (0.0, 15e-3) y (0.0, 15e-3)",
        CYC="CYC 4000",
        IMPLE="IMPLE wall id 3 xmove 6e-3 print 3e-3",
    )
    done = launch(1, script)
    assert done.returncode == 0, done.stdout + done.stderr
    frames = [read_frame(f.path).tables["particles"].columns for f in list_frames(tmp_path / "data")]
    assert frames[0]["x"].max() < 15e-3 < 16e-3 < frames[-1]["x"].max()
    assert len(frames[0]["x"]) == len(frames[-1]["x"]) == 625
    figure = re.findall(r"^figure: (\S+)$", done.stdout, flags=re.MULTILINE)
    assert figure and Path(figure[0]).stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.nightly
def test_whole_biaxial_gives_a_rock(launch: Launcher, tmp_path: Path) -> None:
    """The head claims about 16 degrees and 11 MPa; peaks grow with the confining stress."""
    done = launch(1, "--outdir", tmp_path, EXAMPLES / "biaxial.py", timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    peaks = [number(done.stdout, rf"s3 {s3} MPa: peak of s1 - s3 is (\S+) MPa") for s3 in (10, 20, 40)]
    assert peaks == sorted(peaks)
    assert number(done.stdout, r"friction angle (\S+) degrees") == pytest.approx(16.0, abs=1.0)
    assert number(done.stdout, r"cohesion (\S+) MPa") == pytest.approx(11.0, abs=1.0)
    assert (tmp_path / "biaxial.jpg").stat().st_size > 30_000


@pytest.mark.slow
@pytest.mark.nightly
def test_whole_triangles_are_stronger(launch: Launcher, tmp_path: Path) -> None:
    """The head claims that triangles are stronger and swell more."""
    done = launch(1, "--outdir", tmp_path, EXAMPLES / "biaxial_triangles.py", timeout=1800)
    assert done.returncode == 0, done.stdout + done.stderr
    seen = {
        name: [number(done.stdout, rf"{name}: .*{what}") for what in (r"peak of s1 - s3 (\S+)", r"volume strain (\S+)")]
        for name in ("round", "triangle")
    }
    assert seen["triangle"][0] > 1.3 * seen["round"][0]
    assert seen["triangle"][1] > seen["round"][1] > 0.0
    assert (tmp_path / "biaxial_triangles.jpg").stat().st_size > 30_000


@pytest.mark.slow
@pytest.mark.nightly
def test_whole_angle_of_repose(launch: Launcher, tmp_path: Path) -> None:
    """The head claims 41 degrees; the slope hardly changes any more when the wall stops."""
    done = launch(1, "--outdir", tmp_path, EXAMPLES / "angle_of_repose.py", timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    angles = []
    for frame in list_frames(tmp_path)[-2:]:
        p = read_frame(frame.path).tables["particles"].columns
        angles.append(slope(p["x"], p["y"], p["radius"]))
    assert angles[-1] == pytest.approx(41.0, abs=2.0)
    assert angles[-1] == pytest.approx(angles[-2], abs=1.5)
