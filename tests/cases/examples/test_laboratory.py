"""The examples of the laboratory: hello_drop, biaxial, angle_of_repose. Quick runs of shortened texts, and whole runs
against what their heads claim."""

from __future__ import annotations

import re
from pathlib import Path

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


@pytest.mark.mpi
def test_short_biaxial_is_the_same_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    """Peaks and last state of a small, quick press, with its servo and its restored specimen."""
    one, two = (biaxial(launch, n, tmp_path / str(n)) for n in (1, 2))
    assert number(one, r"s3 20 MPa: peak of s1 - s3 is (\S+) MPa") > 5.0
    assert one == two
    frames = [list_frames(tmp_path / str(n) / "data")[-1].path.with_suffix(".dat").read_bytes() for n in (1, 2)]
    assert frames[0] == frames[1]


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
