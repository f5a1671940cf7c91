"""Frames that an earlier run has left in a folder are not of the present run: what counts, and who says so."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli import info, measure, movie, strain_stress, zdem2jpg, zdemss
from hpcdem.cli.common import read_command_line
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import vtkhdf_mesh
from hpcdem.io.frames import left_out, list_frames, list_mesh_frames
from hpcdem.io.run_record import read
from hpcdem.runtime import run_folder
from hpcdem.runtime.run_folder import Job
from tests.unit.measured import frame, lattice, write

COMM = SerialComm()
FORMS = ("vtkhdf", "dat")


@pytest.fixture(autouse=True)
def _free():
    yield
    run_folder.release_all()


class Log:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)

    warn = info


def begin(folder: Path, resumed: bool = False, restored: tuple[Path, int] | None = None) -> None:
    """What a new process does before its first file."""
    run_folder.release_all()
    run_folder.enter(folder, COMM, Job("a.py", "zdem"), "1", resumed, restored)


def put(folder: Path, *names: str) -> None:
    """Frames in both forms, written now."""
    for name in names:
        for kind in FORMS:
            (folder / f"{name}.{kind}").write_text(f"written {os.urandom(4).hex()}")


def all_(step: int, ini: bool = False) -> str:
    return f"all_{step:010d}" + "_ini" * ini


def stems(folder: Path) -> list[str]:
    return [file.path.stem for file in list_frames(folder)]


# -- which frames count -------------------------------------------------------------------------------------------


def test_frames_of_a_longer_run_before_do_not_count(tmp_path: Path) -> None:
    begin(tmp_path)
    put(tmp_path, *(all_(step) for step in range(0, 600, 100)))
    run_folder.leave(tmp_path, COMM, "done", 500)
    assert len(stems(tmp_path)) == 6 and left_out(tmp_path) == ""
    begin(tmp_path)
    assert stems(tmp_path) == []
    put(tmp_path, all_(0), all_(100), all_(200))
    run_folder.leave(tmp_path, COMM, "done", 200)
    assert stems(tmp_path) == [all_(0), all_(100), all_(200)]
    assert left_out(tmp_path).startswith("3 frames of steps 300 to 500 in ")


def test_in_a_copy_of_the_folder_neither(tmp_path: Path) -> None:
    """The times of all files are those of copying."""
    folder = tmp_path / "data"
    folder.mkdir()
    put(folder, *(all_(step) for step in range(0, 600, 100)))
    begin(folder)
    put(folder, all_(0), all_(100), all_(200))
    run_folder.leave(folder, COMM, "done", 200)
    shutil.copytree(folder, tmp_path / "copy", copy_function=shutil.copyfile)
    for path in (tmp_path / "copy").iterdir():
        os.utime(path, ns=(10**18, 10**18))
    assert stems(tmp_path / "copy") == [all_(0), all_(100), all_(200)]


def test_a_frame_in_another_form_does_not_stand_in(tmp_path: Path) -> None:
    (tmp_path / f"{all_(100)}.vtkhdf").write_text("of the run before")
    begin(tmp_path)
    (tmp_path / f"{all_(100)}.dat").write_text("of this one")
    assert [file.path.suffix for file in list_frames(tmp_path)] == [".dat"]


@pytest.mark.parametrize("text", [None, "{", json.dumps({"script": "a.py", "state": "done", "step": 10})])
def test_without_a_word_on_frames_all_count(tmp_path: Path, text: str | None) -> None:
    """No run.json, a damaged one, and one of an earlier version of the program."""
    put(tmp_path, all_(0), all_(100))
    if text is not None:
        (tmp_path / "run.json").write_text(text)
    assert len(stems(tmp_path)) == 2 and left_out(tmp_path) == ""


def test_a_resumed_run_keeps_its_frames_and_no_others(tmp_path: Path) -> None:
    put(tmp_path, all_(300), all_(900))
    begin(tmp_path)
    put(tmp_path, all_(0), all_(100), all_(200))
    run_folder.leave(tmp_path, COMM, "stopped", 200)
    begin(tmp_path, resumed=True)
    put(tmp_path, all_(300))
    assert stems(tmp_path) == [all_(0), all_(100), all_(200), all_(300)]


def test_a_script_that_restores_continues_from_the_frames_before(tmp_path: Path) -> None:
    """RES of a checkpoint of the folder at step 200: what led there is the beginning of this run, what came after it in
    the other one is not, nor is the first frame of the command after."""
    put(tmp_path, all_(0), all_(100), all_(200), all_(200, True), all_(300))
    (tmp_path / "0000000200.sav").write_text("state")
    beside = tmp_path / "elsewhere"
    beside.mkdir()
    shutil.copy(tmp_path / "0000000200.sav", beside)
    for path in (tmp_path / "0000000200.sav", beside / "0000000200.sav"):  # a copy beside the script is the same
        begin(tmp_path, restored=(path, 200))
        assert stems(tmp_path) == [all_(0), all_(100), all_(200)]
    (beside / "0000000200.sav").write_text("a state of another run")
    begin(tmp_path, restored=(beside / "0000000200.sav", 200))
    assert stems(tmp_path) == []
    begin(tmp_path, restored=(tmp_path / "gone.sav", 200))
    assert stems(tmp_path) == []


def test_two_models_of_one_run_are_one_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Particles and blocks of a coupled run, and several simulations of a program, enter the folder one after the
    other."""
    monkeypatch.setattr(vtkhdf_mesh, "is_mesh_frame", lambda path: True)
    put(tmp_path, all_(700), "rock_0000000700")
    begin(tmp_path)
    put(tmp_path, all_(0))
    run_folder.enter(tmp_path, COMM, Job("a.sc", "pcdc"), "1", False)
    put(tmp_path, all_(100), "rock_0000000100")
    assert stems(tmp_path) == [all_(0), all_(100)]
    assert [file.step for file in list_mesh_frames(tmp_path, "rock")] == [100]
    assert left_out(tmp_path).startswith("2 frames of step 700 in ")
    record = read(tmp_path)
    assert record is not None and set(record.older) == {f"{n}_{700:010d}.{k}" for n in ("all", "rock") for k in FORMS}


# -- the programs -------------------------------------------------------------------------------------------------

STEPS, LATE = (0, 1000, 2000), (3000, 4000)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Frames of a run of 4000 steps, then of one of 2000."""
    x, y = lattice(4000.0, 1500.0)
    for step in (*STEPS, *LATE):
        write(tmp_path / "data", frame(step, x + 0.01 * step, y, 0.01 * step))
    begin(tmp_path / "data")
    for step in STEPS:
        write(tmp_path / "data", frame(step, x + 0.02 * step, y, 0.02 * step))
    run_folder.leave(tmp_path / "data", COMM, "done", 2000)
    return tmp_path / "data"


def say(module: Any, name: str, folder: Path, *words: str) -> str:
    """A program on one rank; its log."""
    log = Log()
    options = read_command_line(getattr(module, name), name, [*words, str(folder)])
    module.work(COMM, log, options)
    return "\n".join(log.lines)


def test_every_program_takes_the_frames_of_the_run_and_says_so(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "2 frames of steps 3000 to 4000"
    log = say(strain_stress, "strain_stress", folder, "-g", "300", "-s")
    assert said in log and "3 of 3 frames" in log
    names = {path.stem for path in (folder / "ss" / "data").glob("*.npz")}
    assert names == {all_(step) for step in STEPS}
    log = say(zdemss, "zdemss", folder, "--format", "jpg", "--width", "6", "--max_workers", "1", "-d")
    assert "3 sections" in log
    log = say(zdem2jpg, "zdem2jpg", folder, "--dpi=40", "--max_workers=1", "--dir")
    assert said in log and {path.stem for path in folder.glob("*.jpg")} == names
    log = say(movie, "movie", folder, "--format", "gif", "--size", "100", "--max_workers", "1")
    assert said in log and "movie.gif: 3 frames" in log
    measured = Log()
    options = read_command_line(measure.measure, "measure", [str(folder), "surface", "--format", "none", "--from", "0"])
    measure.work(COMM, measured, options)  # type: ignore[arg-type]
    assert any(said in line for line in measured.lines)
    steps = np.genfromtxt(folder / "measure" / "surface.csv", delimiter=",", skip_header=1)[:, 0]
    assert set(steps) == set(STEPS)
    capsys.readouterr()
    facts = info.of_folder(folder)
    assert facts["frames"] == "3, steps 0 to 2000" and said in facts["older_frames"]


@pytest.mark.slow
def test_sections_and_pages_of_the_run_before_are_left_out(folder: Path) -> None:
    """Of `hpcdem -s` and zdemss after the longer run, nothing of which was made again."""
    record = folder / "run.json"
    text = record.read_text()
    record.unlink()
    say(strain_stress, "strain_stress", folder, "-g", "300", "-s")
    say(zdemss, "zdemss", folder, "--format", "jpg", "--width", "6", "--max_workers", "1", "-d")
    record.write_text(text)
    log = say(zdemss, "zdemss", folder, "--format", "jpg", "--width", "6", "--max_workers", "1", "-d")
    assert "2 of 5 sections are ignored" in log and "3 sections of" in log
    log = say(movie, "movie", folder, "--format", "gif", "--size", "100", "--from", "ss")
    assert "2 frames of steps 3000 to 4000" in log and "movie.gif: 3 frames" in log
    os.utime(folder / f"{all_(1000)}.vtkhdf")
    log = say(zdemss, "zdemss", folder, "--format", "jpg", "--width", "6", "--max_workers", "1", "-d")
    assert f"1 frames are newer than their sections, first {all_(1000)}" in log
    for step in STEPS:
        (folder / "ss" / "data" / f"{all_(step)}.npz").unlink()
    with pytest.raises(HpcdemError, match="sections of an earlier run only: run `hpcdem -s"):
        say(zdemss, "zdemss", folder, "-d")


def test_a_frame_that_is_named_is_inspected(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = next(folder.glob(f"{all_(4000)}.*"))
    info.work(COMM, Log(), {"paths": [path], "as_json": False, "every": False})  # type: ignore[arg-type]
    assert ", complete" in capsys.readouterr().out


SCRIPT = """
START
SET disk on
BOX left 0 right 10 bottom 0 height 10 kn=1e6 ks=1e6 fric 0
BALL id 1 rad 0.5 x 3 y 0.6
PROP density 2000 kn 1e6 ks 1e6 damp 0.3
SET DT 1e-4 GRAVITY 0 -10
SET print 10
SET save 20
CYC {steps}
STOP
"""


def test_runs_one_after_the_other(resident: Any, tmp_path: Path) -> None:
    """A long one, a short one, and one that goes on from the checkpoint of the short one."""

    def run(name: str, text: str) -> list[int]:
        (tmp_path / name).write_text(text)
        done = resident(1, "--no-figure", name, cwd=tmp_path, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        return sorted({file.step for file in list_frames(tmp_path / "data")})

    assert run("long.py", SCRIPT.format(steps=60)) == [0, 10, 20, 30, 40, 50, 60]
    assert run("short.py", SCRIPT.format(steps=40)) == [0, 10, 20, 30, 40]
    more = "RES data/0000000020.sav\nSET print 10\nCYC 10\nSTOP\n"
    assert run("more.py", more) == [0, 10, 20, 30]
