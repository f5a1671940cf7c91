"""Fields and tables over coordinates in scripts: what the commands say is what the objects get, on any ranks."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from tests.pcdc.test_excavation import Desk
from tests.pcdc.test_whole import tables

SCRIPT = """
pcdc mesh structured (0,0) (3,2) cells 12 8 diagonal both group 'rock' set 'domain'
pcdc table create 'E_of_depth' values (0,60e9) (2,20e9)
pcdc field create 'strength' weibull 4e6 5 seed 7
pcdc field create 'rho' lognormal [2000 + 500] 200 seed [3] correlation 0.4 covariance gaussian least 1500
pcdc element c-model mech-iso-e property density field 'rho' young table 'E_of_depth' over y p-r 0.2 d-f 0.05
pcdc face-joint c-model c-i-c-i property cohesion 9e6 tensile-s field 'strength' gf1 20 gf2 90 friction 30
pcdc element-face c-model contact-m-c property friction field 'phi'
pcdc face-joint property cohesion field 'strength' range x 0 1.5
pcdc node boundary mech-vel-b-c velocity-x -0.4 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0.4 range x 3 3
""".replace(
    "pcdc element c-model", "pcdc field create 'phi' normal 30 5 seed 1 least 10 great 60\npcdc element c-model", 1
)
RUN = (
    SCRIPT
    + """
pcdc output vtk 'bar'
pcdc model step 300
pcdc model save 'middle.sav'
pcdc model step 500
pcdc model save 'end.sav'
print('joints', *(int((pcdc.values('joint', 'state') == k).sum()) for k in (1, 2, 3)))
"""
)
GO_ON = "pcdc model restore 'middle.sav'\npcdc model step 500\npcdc model save 'end.sav'\n"


def test_what_they_say_is_what_the_objects_get(tmp_path):
    desk = Desk(tmp_path)(SCRIPT)
    blocks, pcdc = desk.blocks, desk.pcdc
    centres = blocks.mesh.centroids()
    assert np.array_equal(pcdc.values("element", "young"), np.interp(centres[:, 1], [0, 2], [60e9, 20e9]))
    rho = pcdc.values("element", "density")
    assert np.array_equal(rho, blocks.fields["rho"].values("element", np.arange(len(rho)), centres))
    near = np.corrcoef(rho[0::4], rho[1::4])[0, 1]  # triangles of one square
    assert near > 0.85 and rho.min() >= 1500 and rho.std() > 50
    joints = pcdc.numbers("joint")
    strength, cohesion = pcdc.values("joint", "tensile-strength"), pcdc.values("joint", "cohesion")
    left = np.isin(joints, pcdc.numbers("joint", x=(0, 1.5)))
    assert np.array_equal(cohesion[left], strength[left]) and (cohesion[~left] == 9e6).all() and left.any()
    assert strength.mean() == pytest.approx(4e6 * 0.918, rel=0.05) and len(np.unique(strength)) == len(strength)
    friction = blocks.face_rows.column("friction")[blocks.face_row[blocks.face_exists()]]
    assert len(np.unique(friction)) > 300 and friction.min() >= 10
    penalty = pcdc.values("joint", "penalty-normal")  # 10 E of the softer side
    both = blocks.element_rows.column("young")[
        blocks.element_row[np.column_stack([joints, blocks.partner[joints]]) // 4]
    ]
    assert np.array_equal(penalty, 10 * both.min(axis=1))


@pytest.fixture(scope="module")
def alone(resident, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fields") / "one"
    return run(resident, folder, 1, RUN)


def run(resident, folder: Path, ranks: int, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "a.sc").write_text(text)
    done = resident(ranks, "a.sc", "--no-figure", cwd=folder, timeout=600)
    assert done.returncode == 0, done.stderr
    if "joints" in text:
        assert int(done.stdout.split("joints ")[-1].split()[2]) > 3  # something broke
    return folder


def test_frames_show_what_varies(alone):
    with h5py.File(next((alone / "data").glob("bar_*.vtkhdf"))) as file:
        written = set(file["VTKHDF/CellData"])
    assert {"young", "density", "tensile_strength", "cohesion"} <= written and not {"gf1", "poisson_ratio"} & written


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_ranks_and_a_restart_do_not_change_a_bit(resident, alone, tmp_path, ranks):
    run(resident, tmp_path, ranks, RUN)
    assert tables(tmp_path / "end.sav") == tables(alone / "end.sav")
    run(resident, tmp_path, ranks, GO_ON)
    assert tables(tmp_path / "end.sav") == tables(alone / "end.sav")


@pytest.mark.parametrize(
    ("line", "message"),
    [("field create 'a' seed 1", "a field has one distribution, weibull, normal or lognormal, not none"),
     ("field create 'a' weibull 1 2 normal 1 2 seed 1", "not weibull and normal"),
     ("field create 'a' weibull 1 2", "lacks seed"), ("field create 'a' weibull 1 -2 seed 1", "above 0"),
     ("element property young table 'E'",
      "where 'over x' or 'over y' or 'over temperature' or 'over moisture' is expected"),
     ("element property young table 'E' along y", "read 'along', expected 'over x' or 'over y'"),
     ("element property young table 'E' over z", "expected one of x, y"),
     ("element property young table 'none' over y", "young: there is no table 'none'"),
     ("face-joint property gf1 field 'none'", "gf1: there is no field 'none'"),
     ("element property poisson-ratio field 'strength'", r"element 0: poisson-ratio must be > -1"),
     ("node boundary mech-vel-b-c velocity-x field 'strength'", "expected a number, table"),
     ("field delete 'none'", "there is no field 'none'")],
)  # fmt: skip
def test_refusals(tmp_path, line, message):
    with pytest.raises(HpcdemError, match=message):
        Desk(tmp_path)(SCRIPT + f"pcdc {line}\n")
