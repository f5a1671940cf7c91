"""A network of discs that is cut into a bar: cracks that are there close, slide and grow, on any number of ranks and
across a restart with the same bits."""

from __future__ import annotations

import csv
import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.vtkhdf_mesh import MeshState, read_mesh_frame
from tests.conftest import absent
from tests.property.workers import Resident

HALF = """
pcdc model restore 'half.sav'
pcdc model step 500
"""
SCRIPT = """
pcdc model new dim 3
pcdc geometry create box (0,0,0) (4,0.8,0.8) as-layer 'rock'
pcdc geometry create fractures orientation fisher 60 spread 20 towards 90 radius power 3 least 0.2 greatest 0.5 \\
    p32 0.6 reached inside 'rock' seed 3 as-layer 'set'
pcdc mesh create from-layer 'rock' size 0.4 crack 'set' group 'rock'
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-ratio 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 2e6 gf1 20 gf2 100 p-n 5e11
pcdc element-face c-model contact-m-c property friction 20 penalty-normal 1e11 penalty-shear 1e11
pcdc node boundary mech-vel-b-c velocity-x 10 velocity-y 0 velocity-z 0 range x -0.001 0.001
pcdc node boundary mech-vel-b-c velocity-x -10 velocity-z 4 range x 3.999 4.001
pcdc model option energy on
pcdc output vtk 'bar' every 500
pcdc model step 500
pcdc model save 'half.sav'
pcdc model step 500
print('closing', pcdc.energies['relative'])
"""


def start(resident: Resident, folder: Path, text: str, ranks: int = 1) -> str:
    """What it said."""
    (folder / "bar.sc").write_text(text, encoding="utf-8")
    done = resident(ranks, "bar.sc", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of one rank."""
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")
    folder = tmp_path_factory.mktemp("alone")
    said = start(resident, folder, SCRIPT)
    (closing,) = [float(line.split()[-1]) for line in said.splitlines() if "closing " in line and "error" not in line]
    assert closing < 0.01
    return folder


def last(folder: Path) -> MeshState:
    return read_mesh_frame(folder / "data" / "bar_0000001000.vtkhdf", solid=True)


def same(one: Path, other: Path) -> None:
    first, second = last(one), last(other)
    assert (first.points == second.points).all()
    for some, others in ((first.of_joints, second.of_joints), (first.of_elements, second.of_elements)):
        assert set(some) == set(others)
        for column in some:
            assert np.array_equal(some[column], others[column], equal_nan=True), column
    assert (one / "data" / "cracks.csv").read_bytes() == (other / "data" / "cracks.csv").read_bytes()


def test_rock_breaks_beside_the_network(alone: Path) -> None:
    """Discs are no joints; those that break are in the rock, and sliding ones are among them."""
    with (alone / "data" / "cracks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 15 and max(float(row["mode"]) for row in rows) > 1.5
    assert len({row["step"] for row in rows}) > 5


@pytest.mark.slow
def test_the_whole_run_on_several_ranks(
    alone: Path, resident: Resident, tmp_path: Path, needs_parallel_hdf5: None
) -> None:
    start(resident, tmp_path, SCRIPT, 4)
    same(alone, tmp_path)


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_the_second_half_from_a_checkpoint(
    alone: Path, resident: Resident, tmp_path: Path, ranks: int, needs_parallel_hdf5: None
) -> None:
    shutil.copy(alone / "half.sav", tmp_path)
    start(resident, tmp_path, HALF, ranks)
    same(alone, tmp_path)
