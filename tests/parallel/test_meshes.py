"""Meshes and fracture networks are the same on all ranks, and errors reach them all."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh import optional
from tests.conftest import Launcher, absent

PROGRAM = """\
import hashlib, math, sys
import numpy as np
from mpi4py import MPI
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.comm import SerialComm
from hpcdem.halo.comm import MpiComm
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.fracture_sets import FractureSet, Length, Orientation
from hpcdem.pre.mesh.fractures import network
from hpcdem.pre.mesh.regions import polygon_of
from hpcdem.pre.mesh.sizes import Refinement
from hpcdem.pre.mesh.triangulate import Region, MeshSettings, triangulate

comm = MpiComm(MPI.COMM_WORLD) if MPI.COMM_WORLD.size > 1 else SerialComm()
layers = geometry.Layers()
layers.add("o", geometry.rectangle((0.0, 0.0), (10.0, 6.0)))
layers.add("h", geometry.circle((5.0, 3.0), 1.0))


def make(kind, size=0.3):
    assert comm.rank == 0, "made on the first rank only"
    one = FractureSet(Orientation("fisher", 40.0, 20.0), Length("exponential", 1.5), "p21", 0.7)
    traces = network([one], polygon_of(layers, ["o"], 0.3, ["h"]), seed=4)
    settings = MeshSettings(
        [Region("o", "rock")], size, kind, holes=["h"], fractures=traces, refine=[Refinement("h", 0.1)]
    )
    return triangulate(layers, settings)


for kind in ("tri", "quad"):
    made = comm.per_node(lambda: make(kind), once=True)
    mesh = made.mesh
    text = hashlib.sha256()
    for array in (mesh.points, mesh.cells, mesh.cracks, mesh.crack_sets, *mesh.layers.values()):
        text.update(np.ascontiguousarray(array).tobytes())
    text.update(repr((made.notes, list(mesh.layers), mesh.groups["default"]["rock"].tolist())).encode())
    every = comm.allgather((text.hexdigest(), len(mesh.cells), len(mesh.cracks)))
    assert len(set(every)) == 1
    if comm.rank == 0:
        print(*every[0])
for wrong in (lambda: make("hex"), lambda: make("tri", size=math.nan)):
    try:
        comm.per_node(wrong, once=True)
    except CommandError as error:
        said = comm.allgather(str(error))
        assert len(set(said)) == 1
        if comm.rank == 0:
            print(said[0])
    else:
        sys.exit("no error")


def unreadable():
    raise HpcdemError("m.msh: no")


try:
    comm.per_node(unreadable, once=True)
except HpcdemError as error:
    assert str(error) == "m.msh: no" and not isinstance(error, CommandError)
else:
    sys.exit("no error")
"""


@pytest.fixture(scope="module")
def printed() -> dict[int, str]:
    """What the program printed, by number of ranks."""
    return {}


@pytest.mark.mpi
@pytest.mark.parametrize("n", [1, 3, pytest.param(4, marks=pytest.mark.slow)])
def test_meshes_are_equal_on_any_number_of_ranks(n: int, launch: Launcher, tmp_path: Path, printed: dict[int, str]):
    try:
        optional.gmsh(), optional.shapely()
    except HpcdemError as error:
        absent("gmsh", str(error))
    (tmp_path / "program.py").write_text(PROGRAM)
    ran = launch.python(n, "program.py", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    printed[n] = ran.stdout.strip()
    lines = printed[n].split("\n")
    assert len(lines) == 4 and "'hex'" in lines[2] and "positive" in lines[3]
    assert printed[n] == printed.get(1, printed[n])
