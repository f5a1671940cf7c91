"""A script of three dimensions with heat: frames, histories, accounts and checkpoints on several ranks, and of a run
that goes on from one on others; pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.pcdc.test_whole import history, tables
from tests.property.workers import Resident

BEGIN = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (2,0.5,0.5) cells 12 3 3 split 5
pcdc table create 'weaker' values (0,2e6) (400,2e5)
pcdc element c-model mech-iso-e property density 2500 young 1e9 poisson-ratio 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 4e6 gf1 2 gf2 20 penalty-normal 1e10 &
    tensile-strength table 'weaker' over temperature
pcdc element c-model therm-iso-h property conductivity 3 capacity 1000 expansion-coeficient 1e-4 &
    conductivity-across 1 conductivity-angle 30 conductivity-dip 60 transfer-coeficient 50
pcdc node initial temperature 20
pcdc table create 'oven' values (0,20) (400,320)
pcdc node boundary therm-s-b-c temperature table 'oven' range x 0.9 1.1
pcdc element-face boundary therm-c-h transfer-coeficient 25 environment-temperature 10 range boundary
pcdc element-face boundary therm-c-h heat-flux 500 range x 2 2
pcdc node boundary mech-m-b-c type 1 range x 0 0
pcdc model time-step thermal 4
pcdc model sub-step mechanical 2 thermal 1
pcdc history create 'cold' node nearest (1.5,0.5,0.5) value temperature every 20
pcdc history create 'hot' node nearest (1,0.5,0.5) value temperature every 20
pcdc history create 'mean' element value mean-temperature mean every 20
pcdc history create 'given' model value heat-given every 20
pcdc output vtk 'f' every 100
pcdc model step 200
pcdc model save 'half.sav'
"""
END = """
pcdc element property conductivity 4 range x 0 0.5
pcdc node boundary remove range x 0.9 1.1 y 0 0.1
pcdc model step 200
pcdc model option thermal off
pcdc model step 10
pcdc model save 'end.sav'
pcdc output image 'heat' field 'temperature' section 'y=0.25'
account = pcdc.heat
assert account['relative'] < 1e-12 and account['given'] > 0
pcdc model option mechanical off thermal on
pcdc model solve thermal time 1e5 dt 1e4
pcdc model solve thermal steady
"""


def run(resident: Resident, folder: Path, ranks: int, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "rock.sc").write_text(text.replace(" &\n   ", ""))
    done = resident(ranks, "rock.sc", cwd=folder, timeout=1200)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run on one rank."""
    return run(resident, tmp_path_factory.mktemp("rock") / "one", 1, BEGIN + END)


@pytest.mark.slow
def test_it_gets_warm_and_cracks(alone: Path) -> None:
    """And the frame and the histories know the same of it. Heat goes sqrt(4 k t / rho c) = 6 cm far in 800 s: at half a
    metre from the oven the surface only cools down to the air; in the oven it has its temperature."""
    cold, hot, given = (history(alone, name)[:, 2] for name in ("cold", "hot", "given"))
    assert 10.0 < cold[-1] < 12.0 and (np.diff(cold) <= 0.0).all() and cold[0] < 20.0
    assert hot[-1] == pytest.approx(320.0, rel=1e-12) and (np.diff(hot) >= 0.0).all() and given[-1] > 0.0
    found = tables(alone / "data" / "f_0000000400.vtkhdf")
    assert np.nanmax(np.frombuffer(found["VTKHDF/PointData/temperature"])) > 200.0
    assert any(found["VTKHDF/CellData/mean_temperature"])
    assert list((alone / "data").glob("heat_*.png"))


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_on_several_ranks(alone: Path, resident: Resident, tmp_path: Path) -> None:
    """The whole run, and its second half gone on with on other ranks: every bit until implicit steps, then 1e-9."""
    other = run(resident, tmp_path / "many", 4, BEGIN + END)
    frames = sorted(path.name for path in (alone / "data").glob("f_*.vtkhdf"))
    for name in frames:
        assert tables(alone / "data" / name) == tables(other / "data" / name), name
    for name in ("cold", "hot", "mean", "given"):
        assert history(alone, name) == pytest.approx(history(other, name), rel=1e-9), name
    assert tables(alone / "end.sav") == tables(other / "end.sav")
    again = tmp_path / "again"
    again.mkdir()
    (again / "half.sav").write_bytes((alone / "half.sav").read_bytes())
    run(resident, again, 4, "pcdc model restore 'half.sav'\n" + END)
    assert tables(alone / "end.sav") == tables(again / "end.sav")
