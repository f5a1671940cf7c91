"""What is equal on all ranks is in memory once per node, and nothing of the size of the mesh is a rank's own."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.conftest import Launcher

SHARED = """\
import mmap, os, resource, sys, tempfile
from pathlib import Path
import numpy as np
from mpi4py import MPI
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.halo import shared
from hpcdem.halo.comm import MpiComm

comm = MpiComm(MPI.COMM_WORLD)
calls = []


def make():
    calls.append(comm.rank)
    return {"large": np.arange(50_000), "twice": [np.ones((3, 9000), order="F")] * 2, "text": "a", "none": np.empty(0)}


def inode(array):
    at = array.ctypes.data
    for line in Path("/proc/self/maps").read_text().splitlines():
        first, last = (int(text, 16) for text in line.split()[0].split("-"))
        if first <= at < last:
            return tuple(line.split()[3:5])


made = comm.per_node(make)
assert calls == [0] * (comm.rank == 0), calls
inodes = comm.allgather(inode(made["large"]))
assert len(set(inodes)) == 1 and inodes[0] is not None, inodes
assert made["twice"][0] is made["twice"][1] and made["twice"][0].flags.f_contiguous and made["text"] == "a"
assert made["large"].flags.writeable and made["large"].flags.aligned
# A rank that is killed while others map its files leaves none behind: they have no names.
usual, folder = comm.nodes.folders, comm.bcast(tempfile.mkdtemp(dir="/dev/shm") if comm.rank == 0 else None)
comm.nodes.folders, mapped, names = (folder,), shared._map, []
shared._map = lambda *of: names.append(os.listdir(folder)) or mapped(*of)
assert inode(comm.per_node(make)["large"])[1] != "0"
assert names and not any(names), names
comm.barrier()
if comm.rank == 0:
    os.rmdir(folder)
comm.nodes.folders, shared._map = usual, mapped
# In a container with processes of its own the number of a process may be that of another one there.
known = shared._identity
shared._identity = lambda file: (0, 0) if comm.rank == 1 else known(file)
made = comm.per_node(make)
assert (made["large"] == np.arange(50_000)).all() and inode(made["large"])[1] == "0"
shared._identity = known
comm.barrier()
if comm.rank == 1:
    made["large"][:] = -1  # its own pages from here on
comm.barrier()
assert (made["large"] == (-1 if comm.rank == 1 else np.arange(50_000))).all()
# Many large arrays, as of groups, each keep a file open.
resource.setrlimit(resource.RLIMIT_NOFILE, (100, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
comm = MpiComm(MPI.COMM_WORLD)
many = comm.per_node(lambda: [np.full(10_000, k) for k in range(150)])
assert inode(many[-1])[1] != "0" and (many[-1] == 149).all()
# From inside of another `make` there is nobody to share with.
assert comm.per_node(lambda: comm.per_node(lambda: 7) + 1) == 8


def wrong(error):
    raise error


for error, kind in (
    (CommandError("no"), CommandError), (ScriptError("f", 1, "no"), CommandError), (ValueError("no"), ValueError),
):
    for once in (False, True):
        try:
            comm.per_node(lambda: wrong(error), once=once)
        except Exception as found:
            assert isinstance(found, kind) or comm.rank == 0 and found is error, found
            assert "no" in str(found)
        else:
            sys.exit("no error")

said = []
comm.warns_by(said.append)
comm.nodes.folders = ("/nowhere", "/proc")
for _ in range(2):
    made = comm.per_node(make)
    assert (made["large"] == np.arange(50_000)).all() and made["large"].flags.writeable
    assert inode(made["large"])[1] == "0"  # a copy of its own
assert len(said) == 1 and "/nowhere or /proc" in said[0] and f"{comm.size} ranks" in said[0], said
"""

MODEL = """\
import numpy as np
from bench.block_memory import KINDS, listed
from hpcdem import session
from hpcdem.physics.fdem import changes
from hpcdem.runtime import kept

kept.install()
of_process = session.current(1)
comm, project = of_process.comm, of_process.project()
for kind, dim in (("triangles", 2), ("jointed-tetrahedra", 3)):
    project.clear(dim)
    KINDS[kind](project, 12_000, 8)
    blocks = project.ready()
    changes.crack(blocks, comm.per_node(lambda: np.flatnonzero(blocks.joint_exists())[::50]))
    blocks.step()
    blocks.rebuild()
    blocks.step()
    mesh = blocks.the_mesh()
    whole = {len(mesh.cells), 4 * len(mesh.cells), len(mesh.points), len(blocks.shared_nodes)}
    assert blocks.n_own < 0.6 * len(mesh.cells)
    shared = set()
    for name, array, of_node in listed(project):
        if of_node:
            shared.add(name.rsplit(".", 1)[1])
        elif whole & {len(array), array.size}:
            assert not array.any(), (kind, name, array.shape)  # zeros that nobody has written to take no memory
    assert {"partner", "cells", "joint_row", "node", "where"} <= shared, shared
"""


@pytest.mark.mpi
def test_ranks_of_a_node_share_one_copy_and_keep_what_they_write(launch: Launcher, tmp_path: Path):
    (tmp_path / "program.py").write_text(SHARED)
    ran = launch.python(3, "program.py", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.mpi
def test_no_array_of_the_size_of_the_mesh_is_a_ranks_own(launch: Launcher, tmp_path: Path, monkeypatch):
    root = Path(__file__).parents[2]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(root / "scripts/lib"), os.environ.get("PYTHONPATH", "")]))
    (tmp_path / "program.py").write_text(MODEL)
    ran = launch.python(2, "program.py", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
