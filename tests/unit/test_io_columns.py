"""Time series: what a restart keeps of them."""

from __future__ import annotations

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.columns import append_rows

HEADER = "step,time,value"


def series(path) -> list[str]:
    return path.read_text().splitlines()


@pytest.mark.parametrize(("since", "kept"), [(0, []), (150, ["100,4.0,1", "100,4.0,2"]), (200, None)])
def test_a_restart_keeps_the_rows_up_to_its_step(tmp_path, since, kept):
    path = tmp_path / "walls.csv"
    rows = ["100,4.0,1", "100,4.0,2", "200,8.0,3"]
    append_rows(path, HEADER, rows, 0, SerialComm())
    append_rows(path, HEADER, ["300,12.0,4"], since, SerialComm())
    assert series(path) == [HEADER, *(rows if kept is None else kept), "300,12.0,4"]


@pytest.mark.parametrize("piece", ["1", "12", "120", "1200", "1200,48.0,", "1200,48.0,1.234"])
def test_a_piece_of_a_row_is_dropped(tmp_path, piece):
    """A full disk takes the beginning of a row; "12" is not step 12."""
    path = tmp_path / "walls.csv"
    path.write_text(f"{HEADER}\n1000,40.0,1\n{piece}")
    append_rows(path, HEADER, ["1300,52.0,2"], 1250, SerialComm())
    assert series(path) == [HEADER, "1000,40.0,1", "1300,52.0,2"]


def test_bytes_that_are_no_text_are_dropped(tmp_path):
    path = tmp_path / "walls.csv"
    path.write_bytes(HEADER.encode() + b"\n1000,40.0,1\n\xff\xfe\x00\n")
    append_rows(path, HEADER, ["1300,52.0,2"], 1250, SerialComm())
    assert series(path) == [HEADER, "1000,40.0,1", "1300,52.0,2"]


def test_a_folder_in_its_place_is_an_error_of_one_sentence(tmp_path):
    path = tmp_path / "walls.csv"
    path.mkdir()
    with pytest.raises(HpcdemError, match="a folder with this name exists"):
        append_rows(path, HEADER, ["100,4.0,1"], 0, SerialComm())
    assert not list(tmp_path.glob("*.tmp"))
