"""Whole files or none: what goes wrong is one sentence, and what was there before stays."""

from __future__ import annotations

import errno
import os
import resource
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path, make_folder
from hpcdem.io.disk import explain
from hpcdem.io.files import write_sections
from hpcdem.io.textnum import TextTable, sci

ROOT = Path(__file__).resolve().parents[2]
COMM = SerialComm()


def test_a_file_appears_under_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_sections(path, COMM, lambda: [b"head\n", TextTable([(sci("x", 3), np.array([1.0, 2.0]))]), b"tail\n"])
    assert path.read_text() == "head\n   1.00e+00\n   2.00e+00\ntail\n"
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("failure", [OSError(errno.EDQUOT, "?"), HpcdemError("no"), KeyboardInterrupt()])
def test_a_failure_keeps_the_old_file_and_leaves_nothing(tmp_path: Path, failure: BaseException) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    expected = KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else HpcdemError
    with pytest.raises(expected):
        with atomic_path(path, COMM) as temporary:
            Path(temporary).write_text("half")
            raise failure
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_full_disk_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    (tmp_path / "a.txt.tmp").symlink_to("/dev/full")
    with pytest.raises(HpcdemError, match=r"^cannot write .*a\.txt: no space left on the disk$"):
        write_sections(path, COMM, lambda: [b"x" * 100])
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.parametrize(
    ("name", "cause"), [("no/a.txt", "the folder does not exist"), ("b", "a folder with this name exists")]
)
def test_other_causes_are_named(tmp_path: Path, name: str, cause: str) -> None:
    (tmp_path / "b").mkdir()
    with pytest.raises(HpcdemError, match=cause):
        write_sections(tmp_path / name, COMM, lambda: [b"x"])
    assert os.listdir(tmp_path) == ["b"]


def test_a_table_that_cannot_be_written_names_the_file(tmp_path: Path) -> None:
    def build() -> Any:
        raise ValueError("column x: too wide")

    with pytest.raises(HpcdemError, match=r"cannot write .*a\.txt: column x: too wide"):
        write_sections(tmp_path / "a.txt", COMM, build)
    assert os.listdir(tmp_path) == []


def test_make_folder(tmp_path: Path) -> None:
    make_folder(tmp_path / "a" / "b", COMM)
    make_folder(tmp_path / "a" / "b", COMM)
    (tmp_path / "file").write_text("")
    with pytest.raises(HpcdemError, match="cannot make the folder"):
        make_folder(tmp_path / "file" / "c", COMM)


def test_errno_is_found_in_the_messages_of_hdf5() -> None:
    error = OSError("Can't write data (file write failed: errno = 28, error message = 'No space left on device')")
    assert explain("a.sav", error) == "cannot write a.sav: no space left on the disk"


# A limit on the size of files stands in for a full disk or quota: it needs no mount and no root.
LIMITED = """
import resource, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import hpcdem.io.dat, hpcdem.io.ps, hpcdem.io.vtk, hpcdem.io.vtkhdf
from hpcdem.core.errors import HpcdemError
from hpcdem.core.comm import SerialComm
from hpcdem.halo.comm import MpiComm
from tests.unit.io_synthetic import make_frame

comm = SerialComm()
if sys.argv[2] == "mpi":
    from mpi4py import MPI
    comm = MpiComm(MPI.COMM_WORLD)
frame = make_frame(2000, comm)
hpcdem.io.dat.write_dat("warm.dat", frame, comm)
hpcdem.io.vtkhdf.write_vtkhdf("warm.vtkhdf", frame, comm)
resource.setrlimit(resource.RLIMIT_FSIZE, (30000, resource.RLIM_INFINITY))
for name, write in (
    ("all_1.vtkhdf", hpcdem.io.vtkhdf.write_vtkhdf),
    ("all_1.dat", hpcdem.io.dat.write_dat),
    ("all_1.vtk", hpcdem.io.vtk.write_vtk),
    ("all_1.ps", hpcdem.io.ps.write_ps),
):
    if comm.rank == 0:
        Path(name).write_text("old")
    comm.barrier()
    try:
        write(name, frame, comm)
    except HpcdemError as error:
        print(f"rank {comm.rank}: {error}\\n", end="", flush=True)
    assert Path(name).read_text() == "old"
comm.barrier()
assert not list(Path().glob("*.tmp"))
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
hpcdem.io.vtkhdf.write_vtkhdf("all_1.vtkhdf", frame, comm)  # and the process is still sound
"""


@pytest.mark.parametrize("ranks", [1, pytest.param(3, marks=pytest.mark.mpi)])
def test_every_writer_reports_a_file_that_cannot_grow_on_all_ranks(launch: Any, tmp_path: Path, ranks: int) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    if hard != resource.RLIM_INFINITY:
        pytest.skip("the size of files is already limited here")
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(LIMITED))
    done = launch.python(ranks, program, ROOT, "mpi" if ranks > 1 else "serial", cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    lines = sorted(line for line in done.stdout.splitlines() if line.startswith("rank"))
    cause = "the file would exceed the allowed size"
    assert lines == sorted(
        f"rank {r}: cannot write all_1.{kind}: {cause}" for r in range(ranks) for kind in ("vtkhdf", "dat", "vtk", "ps")
    )
    assert (tmp_path / "all_1.vtkhdf").stat().st_size > 30000
