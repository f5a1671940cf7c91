"""A script of three dimensions whose rock yields and creeps: frames, histories and checkpoints on several ranks, and of
a run that goes on from one on others."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import Launcher
from tests.pcdc.test_whole import history, tables

BEGIN = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (2,0.5,0.5) cells 12 3 3 split 5
pcdc table create 'soft' values (0,2e5) (5e-3,2e4)
pcdc element c-model mech-m-c property density 2000 young 1e8 poisson-ratio 0.3 friction 25 tensile 1e5 &
    dilation 5 cohesion table 'soft' over plastic-strain
pcdc element c-model mech-bur property density 2000 young 1e8 poisson-ratio 0.3 kelvin-shear 5e7 &
    kelvin-viscosity 1e5 maxwell-viscosity 1e6 kelvin-strain-xz 1e-5 kelvin-strain-zz 0 range x 1.2 2
pcdc model gravity (0,0,-9.81)
pcdc model option collision off
pcdc node boundary mech-m-b-c type 1 range x 0 0
pcdc element-face boundary m-s-b-c stress-normal -3e5 range x 2 2
pcdc model creep on
pcdc history create 'way' node nearest (2,0.5,0.5) value displacement-z every 20
pcdc history create 'flow' element value plastic-shear-strain maximum every 20 range x 0 1.2
pcdc history create 'creep' element value creep-strain-zz mean every 20 range x 1.2 2
pcdc output vtk 'f' every 100
pcdc model step 200
pcdc model save 'half.sav'
"""
END = """
pcdc element reset state range x 0 0.3
pcdc element reset kelvin-strain range x 1.8 2
pcdc model step 200
pcdc model save 'end.sav'
"""


def run(folder: Path, ranks: int, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "rock.sc").write_text(text.replace(" &\n   ", ""))
    done = Launcher()(ranks, "rock.sc", cwd=folder, timeout=1200)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run on one rank."""
    return run(tmp_path_factory.mktemp("rock") / "one", 1, BEGIN + END)


def test_it_yields_and_creeps(alone: Path) -> None:
    """And the script, the frame and the history know the same of it."""
    flow, creep = (history(alone, name)[:, 2] for name in ("flow", "creep"))
    assert flow[-1] > 1e-3 and abs(creep[-1]) > 1e-4
    found = tables(alone / "data" / "f_0000000400.vtkhdf")
    for name in ("plastic_state", "plastic_work", "creep_strain_yz", "kelvin_strain_zz", "creep_work"):
        assert any(found[f"VTKHDF/CellData/{name}"])


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_files_on_several_ranks(alone: Path, tmp_path: Path) -> None:
    """The whole run, and its second half gone on with on other ranks."""
    other = run(tmp_path / "many", 4, BEGIN + END)
    frames = sorted(path.name for path in (alone / "data").glob("*.vtkhdf"))
    assert len(frames) == 5
    for name in frames:
        assert tables(alone / "data" / name) == tables(other / "data" / name), name
    for name in ("way", "flow", "creep"):
        assert (history(alone, name) == history(other, name)).all()
    assert tables(alone / "end.sav") == tables(other / "end.sav")
    again = tmp_path / "again"
    again.mkdir()
    (again / "half.sav").write_bytes((alone / "half.sav").read_bytes())
    run(again, 4, "pcdc model restore 'half.sav'\n" + END)
    assert tables(alone / "end.sav") == tables(again / "end.sav")
