"""Fluid in tetrahedra in a script: what is written, what comes back from a checkpoint on several ranks."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from tests.property.workers import Resident

SCRIPT = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (0.6,0.2,0.2) cells 6 2 2
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-ratio 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 2e6 gf1 5 gf2 20 penalty-normal 5e11
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 1e7 viscosity 1e-6 \\
    aperature-initial 1e-4 aperature-minumum 1e-5
pcdc model gravity (0,0,-9.81)
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range z 0 0
pcdc node group 'out' range x 0.6 0.6
pcdc node boundary hydra-c-f-b flow-surface 0.1 range group 'out'
pcdc node boundary hydra-c-f-b pressure 1e5 range x 0.3 0.3
pcdc flow-node initial saturation 0.5
pcdc well create 'hole' range x 0 0
pcdc well stage 'hole' rate 1e-2 time 2e-4 limit 5e6
pcdc well stage 'hole' shut-in
pcdc model sub-step hydraulic 2
pcdc history create 'out' flow-node value inflow sum every 50 range group 'out'
pcdc history create 'wide' flow-channel value aperture maximum every 50
pcdc history create 'flux' flow-channel value flow-rate maximum every 50
pcdc history create 'pump' well value injected well 'hole' every 50
pcdc history create 'given' model value fluid-given every 50
pcdc output vtk 'wet' every 150
pcdc model step 150
pcdc model save 'half.sav'
pcdc model step 150
"""


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of one rank."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "wet.sc").write_text(SCRIPT, encoding="utf-8")
    done = resident(1, "wet.sc", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_histories_are_volumes(alone: Path) -> None:
    heads = {name: (alone / "data" / f"history_{name}.csv").read_text().splitlines()[0] for name in
             ("out", "wide", "flux", "pump", "given")}  # fmt: skip
    units = {name: head.rsplit("[")[-1].rstrip("]") for name, head in heads.items()}
    assert units == {"out": "m3/s", "wide": "m", "flux": "m2/s", "pump": "m3", "given": "m3"}
    pump = np.loadtxt(alone / "data" / "history_pump.csv", delimiter=",", skiprows=1)
    assert pump[-1, 2] == pytest.approx(min(2e-4, pump[-1, 1]) * 1e-2, rel=1e-9) and np.diff(pump[:, 2]).min() > -1e-15


def test_frames_have_the_fluid_of_triangles(alone: Path) -> None:
    state = read_mesh_frame(alone / "data" / "wet_0000000300.vtkhdf", solid=True)
    wet = np.isfinite(state.of_joints["fluid_pressure"])
    assert wet.sum() > 100 and state.of_joints["fluid_pressure"][wet].max() > 9e4
    assert state.of_joints["aperture"][wet].min() >= 1e-5 and state.of_joints["flow_rate"][wet].max() > 0.0
    assert (state.of_joints["saturation"][wet] <= 1.0).all()


def test_ranks_and_a_restart_come_to_the_same(
    alone: Path, resident: Resident, tmp_path: Path, needs_parallel_hdf5: None
) -> None:
    shutil.copy(alone / "half.sav", tmp_path)
    (tmp_path / "go.sc").write_text("pcdc model restore 'half.sav'\npcdc model step 150\n", encoding="utf-8")
    done = resident(2, "go.sc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    name = "wet_0000000300.vtkhdf"
    one, other = (read_mesh_frame(folder / "data" / name, solid=True) for folder in (alone, tmp_path))
    assert (one.points == other.points).all()
    for column, values in one.of_joints.items():
        assert np.array_equal(values, other.of_joints[column], equal_nan=True)
    for history in ("out", "pump", "given"):
        file = f"history_{history}.csv"
        assert (alone / "data" / file).read_text() == (tmp_path / "data" / file).read_text()
