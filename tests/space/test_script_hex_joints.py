"""Joints of hexahedra in a script: what ranges choose, what is written while they break, what a file brings back."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.fdem.groups import DEFAULT, JOINT
from tests.pcdc.test_plastic import run

SCRIPT = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (0.4,0.2,0.2) cells 4 2 2 type hex
pcdc geometry create polygon (0.2,0,0.1) (0.4,0,0.1) (0.4,0.2,0.1) (0.2,0.2,0.1) as-layer 'cut'
pcdc mesh intersect layer 'cut'
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 2e6 gf1 1 gf2 4 penalty-normal 5e11
pcdc face-joint group 'weak' range x 0.1 0.1
pcdc face-joint group 'part' range x 0.15 0.35 y -1 0.15
pcdc face-joint property tensile-strength 1e6 range group 'weak'
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0.1 range x 0.4 0.4
pcdc model option energy on
pcdc history create 'lost' model value joint-loss every 50
pcdc history create 'open' joint value opening every 50 nearest (0.1,0.05,0.05)
pcdc model step 300
pcdc model save 'half.sav'
"""
REST = "pcdc output vtk 'bar' every 300\npcdc model step 300\n"


def test_a_bar_breaks_where_it_is_weak(tmp_path: Path) -> None:
    whole = run(tmp_path, SCRIPT + REST)
    mesh, joints = whole.project.mesh, whole.project.blocks.numbers_of_joints(None)
    assert len(joints) == 2 * (3 * 4 + 4 * 2 * 2)  # two halves of each side
    groups = whole.project.groups[JOINT]
    assert len(groups.members("weak", DEFAULT)) == 8
    part = groups.members("part", DEFAULT)
    assert len(part) == 14 and not set(part) - set(joints)  # no half without the other one
    with (tmp_path / "data" / "cracks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8 and np.allclose([float(row["x [m]"]) for row in rows], 0.1)
    assert sum(float(row["joint_area [m2]"]) for row in rows) == pytest.approx(0.04)
    opened, lost = (whole.namespace["pcdc"].history(name)[:, 2] for name in ("open", "lost"))
    assert opened[0] > 0.0 and 0.0 <= lost[0] < 1e-3 and 0.04 < lost[-1] < 0.1
    path = next((tmp_path / "data").glob("bar*600.vtkhdf"))
    state = read_mesh_frame(path, solid=True)
    gone = state.of_joints["state"] == 3
    assert gone.sum() == 8 and np.allclose(state.of_joints["joint_area"][gone], 0.005)
    x = state.points - state.of_points["displacement"]
    assert np.allclose(x[state.joints[gone]][:, :, 0], 0.1) and mesh.dim == 3
    path.unlink()
    run(tmp_path, "pcdc model restore 'half.sav'\n" + REST)
    again = read_mesh_frame(next((tmp_path / "data").glob("bar*600.vtkhdf")), solid=True)
    assert (again.points == state.points).all()
    for name, values in state.of_joints.items():
        assert np.array_equal(values, again.of_joints[name], equal_nan=True), name


def test_what_is_inside_a_hexahedron_is_no_joint(tmp_path: Path) -> None:
    """Nor does `split` cut hexahedra."""
    with pytest.raises(HpcdemError, match="split is for tetrahedra"):
        run(tmp_path, SCRIPT.replace("type hex", "type hex split 5"))
    model = run(tmp_path, SCRIPT[: SCRIPT.index("pcdc geometry")])
    sim = model.project.whole_mesh()
    inside = np.flatnonzero(sim.inside_macros(np.arange(4 * len(sim.cells))))
    assert len(inside) == 12 * 16
    with pytest.raises(HpcdemError, match="there is no face-joint"):
        run(tmp_path, SCRIPT.replace("range x 0.1 0.1", f"range id {inside[0]}"))


def test_a_disc_is_followed_by_whole_sides(tmp_path: Path) -> None:
    """Both halves of a side become cracks, none of its hexahedra is cut."""
    text = SCRIPT[: SCRIPT.index("pcdc geometry")].replace("0.4,0.2,0.2", "0.4,0.4,0.4").replace("4 2 2", "6 6 6")
    disc = "pcdc geometry create disc (0.21,0.2,0.19) (0.3,0.2,1) 0.13 as-layer 'd'\n"
    mesh = run(tmp_path, text + disc + "pcdc mesh intersect layer 'd' follow\n").project.whole_mesh()
    edges = mesh.edges()
    faces = edges.faces[mesh.find_edges(edges, mesh.cracks)]
    _, fourth, *_ = mesh.on_sides(faces[:, 0])
    assert len(faces) > 20 and len(fourth) == len(faces) and not mesh.inside_macros(faces[:, 0]).any()
    sides = {tuple(sorted({*row, p})) for row, p in zip(mesh.cracks.tolist(), mesh.cells.reshape(-1)[fourth].tolist())}
    assert 2 * len(sides) == len(faces)
