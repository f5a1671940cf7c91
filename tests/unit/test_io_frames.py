"""Names of frames, and which ones a folder holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.dat import write_dat
from hpcdem.io.frames import frame_name, list_frames, read_frame
from hpcdem.io.vtkhdf import write_vtkhdf
from tests.unit.io_synthetic import make_frame


def test_names() -> None:
    assert frame_name(46000, "vtkhdf") == "all_0000046000.vtkhdf"
    assert frame_name(0, ".dat", ini=True) == "all_0000000000_ini.dat"
    assert frame_name(5, "vtk", stem="wall") == "wall_0000000005.vtk"


def test_frames_are_listed_by_step_the_initial_one_first(tmp_path: Path) -> None:
    for name in (
        "all_0000001000.dat",
        "all_0000001000_ini.dat",
        "all_0000001000_ini.vtkhdf",
        "all_0000000000_ini.vtkhdf",
        "all_12345678901.dat",
        "all_0000000500.vtkhdf",
        "all_0000000500.jpg",
        "all_0000000700.vtkhdf.tmp",
        "wall_0000000500.vtk",
        "0000000500.sav",
        "all_x.dat",
    ):
        (tmp_path / name).write_text("")
    assert [(f.path.name, f.step, f.ini) for f in list_frames(tmp_path)] == [
        ("all_0000000000_ini.vtkhdf", 0, True),
        ("all_0000000500.vtkhdf", 500, False),
        ("all_0000001000.dat", 1000, False),
        ("all_0000001000_ini.vtkhdf", 1000, True),
        ("all_12345678901.dat", 12345678901, False),
    ]
    with pytest.raises(HpcdemError, match="cannot read the folder"):
        list_frames(tmp_path / "none")


def test_a_frame_is_read_by_its_suffix(tmp_path: Path) -> None:
    frame = make_frame(10)
    write_vtkhdf(tmp_path / "a.vtkhdf", frame, SerialComm())
    write_dat(tmp_path / "a.dat", frame, SerialComm())
    assert read_frame(tmp_path / "a.vtkhdf").step == read_frame(tmp_path / "a.dat").step == 46000
    with pytest.raises(HpcdemError, match=r"frames end in \.vtkhdf or \.dat"):
        read_frame(tmp_path / "a.jpg")
