"""What frames hold besides elements and joints: contacts, conditions and flow nodes, with the values that they were
given, and the same on any ranks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.vtkhdf_mesh import TABLES, read_mesh_frame
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.flow import kernels
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.scene import default_view
from tests.pcdc.test_excavation import Desk
from tests.pcdc.test_whole import tables

SCRIPT = """
pcdc model gravity (0,-9.81)
pcdc mesh structured (0,0) (2,0.6) cells 8 3 group 'base'
pcdc mesh structured (0.5,0.60001) (1.5,1.1) cells 4 2 group 'top'
pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-ratio 0.25 damp-factor 0.1 friction 30
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2e8 viscosity 1e-6 aperature-initial 1e-4 \\
    aperature-minumum 1e-6 range y 0.1 0.5
pcdc element c-model therm-iso-h property conductivity 3 capacity 900
pcdc table create 'push' values (0,1) (1e-9,3) (1,3)
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.001 0.001
pcdc node boundary mech-vel-b-c velocity-x table 'push' range y -0.001 0.001 x -0.001 0.001
pcdc node boundary mech-m-b-c type 1 range y -0.001 0.001 x 1.999 2.001
pcdc node boundary mech-f-b-c force-x 1e3 range x 1.49 1.51 y 1.09 1.11
pcdc node boundary therm-s-b-c temperature 50 range y -0.001 0.001 x 0.9 1.1
pcdc element-face boundary m-s-b-c stress-normal -1e4 range y 1.09 1.11
pcdc element-face boundary m-s-b-c quiet on range x 1.999 2.001
pcdc element-face boundary therm-c-h transfer-coeficient 25 environment-temperature 10 range y 1.09 1.11
pcdc node boundary hydra-c-f-b pressure 2e5 range x 0.99 1.01 y 0.39 0.41
pcdc node initial velocity (0,-0.5) range y 0.600005 2
pcdc model step 10
pcdc output vtk 'two'
"""


def test_frames_hold_what_was_said_and_what_touches(tmp_path: Path):
    blocks = Desk(tmp_path)(SCRIPT).blocks
    moment = read_moment(next((tmp_path / "data").glob("two_*.vtkhdf")))
    hidden = {layer.object for layer in default_view(moment).layers if not layer.visible}
    assert hidden == {"contacts", "node-conditions", "face-conditions", "flow-nodes"}

    nodes = moment.of("node-conditions")
    x, y = nodes.centres().T
    low = y < 0.01
    assert nodes.count == 9 + 1 and np.allclose(x[low], np.linspace(0.0, 2.0, 9), atol=1e-3)
    assert nodes.fields["fixed"][low].tolist() == [3] + [2] * 7 + [3]  # bits of x and y
    assert nodes.fields["constraint"][low].tolist() == [0] * 8 + [1]
    assert nodes.vectors["velocity"][low][:2].tolist() == [[3.0, 0.0], [0.0, 0.0]]
    assert nodes.vectors["nodal_force"][~low].tolist() == [[1e3, 0.0]]
    held = np.isfinite(nodes.fields["temperature"])
    assert np.allclose(x[held], 1.0) and (nodes.fields["temperature"][held] == 50.0).all() and held.sum() == 1

    faces = moment.of("face-conditions")
    x, y = faces.centres().T
    top = y > 1.0
    assert top.sum() == 4 and (~top).sum() == 3 and np.allclose(x[~top], 2.0, atol=1e-3)
    assert faces.fields["quiet"].tolist() == (~top).astype(int).tolist()
    assert (faces.fields["normal_stress"] == np.where(top, -1e4, 0.0)).all()
    assert np.array_equal(faces.fields["environment_temperature"][top], [10.0] * 4)
    assert np.isnan(faces.fields["transfer_coefficient"][~top]).all() and (faces.fields["heat_flux"] == 0.0).all()

    fluid = moment.of("flow-nodes")
    given = fluid.fields["condition"] == kernels.PRESSURE
    assert given.sum() == 1 and fluid.fields["fluid_pressure"][given] == pytest.approx(2e5)
    assert np.allclose(fluid.centres()[given], (1.0, 0.4), atol=1e-3) and fluid.fields["inflow"][given][0] > 0.0
    assert (fluid.fields["fluid_pressure"][~given] < 1e5).all()

    touching, found = moment.of("contacts"), diagnostics.contacts(blocks)
    pairs = {*zip(touching.fields["element_1"].tolist(), touching.fields["element_2"].tolist())}
    assert len(pairs) == touching.count > 3
    assert pairs == {*zip(found["element_1"].tolist(), found["element_2"].tolist())}
    total = [found["force_x"].sum(), found["force_y"].sum()]
    np.testing.assert_allclose(touching.vectors["contact_force"].sum(axis=0), total, rtol=1e-12)
    assert total[1] < -1e3  # on the base
    ends = touching.read()[0]
    assert (ends[:, 0, 1] < 0.6).all() and (ends[:, 1, 1] > 0.6).all()


def test_bodies_in_space(tmp_path: Path):
    Desk(tmp_path)("""
pcdc model new dim 3
pcdc mesh structured (0,0,0) (2,1,0.5) cells 2 1 1 group 'base'
pcdc mesh structured (0.5,0.2,0.50001) (1.5,0.8,1.0) cells 1 1 1 group 'top'
pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-ratio 0.25 friction 30
pcdc node boundary mech-vel-b-c velocity-z 0 range z -0.001 0.001
pcdc node boundary mech-f-b-c force-y -7 range x 1.49 1.51 y 0.79 0.81 z 0.99 1.01
pcdc element-face boundary m-s-b-c stress-zz -1e4 range z 0.99 1.01
pcdc node initial velocity (0,0,-0.5) range z 0.500005 2
pcdc model step 2
pcdc output vtk 'three'
""")
    moment = read_moment(next((tmp_path / "data").glob("three_*.vtkhdf")))
    nodes, faces, touching = (moment.of(name) for name in ("node-conditions", "face-conditions", "contacts"))
    assert nodes.fields["fixed"].tolist() == [4] * 6 + [0]
    assert nodes.vectors["nodal_force"][-1].tolist() == [0.0, -7.0, 0.0]
    np.testing.assert_allclose(nodes.centres()[-1], (1.5, 0.8, 1.0), atol=1e-3)
    assert faces.count == 2 and (faces.fields["stress_zz"] == -1e4).all()
    np.testing.assert_allclose(faces.centres()[:, 2], 1.0, atol=1e-3)
    assert touching.count > 0 and touching.vectors["contact_force"][:, 2].sum() < 0.0


def test_a_model_without_them_has_none(tmp_path: Path):
    Desk(tmp_path)(
        "pcdc mesh structured (0,0) (2,1) cells 2 1\n"
        "pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-ratio 0.25\npcdc output vtk 'a'\n"
    )
    assert read_mesh_frame(next((tmp_path / "data").glob("a_*.vtkhdf"))).tables == {}


@pytest.mark.mpi
def test_the_same_on_two_ranks(resident, tmp_path: Path):
    found = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.sc").write_text(SCRIPT)
        done = resident(ranks, "a.sc", "--no-figure", cwd=folder, timeout=600)
        assert done.returncode == 0, done.stderr
        found.append(tables(next((folder / "data").glob("two_*.vtkhdf"))))
    assert found[0] == found[1] and {name.split("/")[0] for name in found[0]} >= set(TABLES)
