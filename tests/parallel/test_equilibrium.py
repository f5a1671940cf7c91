"""The static solve: the same bits on any number of ranks where it is solved directly, to 1e-9 by PETSc."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import Launcher

WORKER = Path(__file__).with_name("equilibrium_worker.py")


pytestmark = pytest.mark.ranks
SLOW = pytest.mark.slow
QUICK = ("", "-cooled", "-crushed")
"""Of joints, heat, rock that yields, in the plane and in space."""
KINDS = (*QUICK, "-yields", "-propped", "-seam", "-pumped", "-rinsed", "-solid", "-burst", "-sides")
Found = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def runs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[[int, str], Found]:
    """What a run on so many ranks found; all runs on these ranks are done by one start, by PETSc those asked for."""
    items = [item for item in request.session.items if getattr(item, "module", None) is request.module]
    names = [item for item in items if item.name.startswith("test_petsc_on_several_ranks")]
    petsc = {item.callspec.params["kind"] for item in names if isinstance(item, pytest.Function)}
    direct = KINDS if any(item.get_closest_marker("slow") for item in items) else QUICK

    @cache
    def started(ranks: int, *names: str) -> dict[str, Found]:
        folder = tmp_path_factory.mktemp(f"on{ranks}")
        done = Launcher().python(ranks, WORKER, *names, cwd=folder)
        assert done.returncode == 0, done.stderr[-2000:]
        found = {}
        for name in names:
            with np.load(folder / f"{name}.npz") as values:
                found[name] = dict(values)
        return found

    def found(ranks: int, name: str) -> Found:
        solver = name.split("-")[0]
        return started(ranks, *(solver + kind for kind in KINDS if kind in (direct if solver == "direct" else petsc)))[
            name
        ]

    return found


@pytest.fixture(scope="module")
def alone(runs) -> Found:
    return runs(1, "direct")


@pytest.fixture(scope="module")
def yielding(runs) -> Found:
    return runs(1, "direct-yields")


def test_both_stages_are_in_balance(alone):
    assert alone["ratios"].max() < 1e-8
    assert alone["counts"][2] > 400 and np.isnan(alone["stress_xx"]).sum() > 5
    assert np.nanmax(np.abs(alone["later_velocity_x"])) < 1e-12


@SLOW
def test_rock_that_yields_is_in_balance(yielding):
    assert yielding["ratios"].max() < 1e-8 and yielding["counts"][1] >= 3
    assert np.nanmax(yielding["plastic_shear_strain"]) > 1e-3


@SLOW
def test_fluid_opens_the_joint(runs):
    found = runs(1, "direct-pumped")
    assert found["joints"][2] > 3 and found["pressure"].max() > 1e6 and found["saturation"].min() < 0.5
    pressure, rate, injected, stage = found["wells"]
    assert pressure > 1e5 and (rate, stage) == (0.0, 2.0) and injected == pytest.approx(5e-5 * 0.83, rel=1e-12)


@pytest.mark.parametrize("kind", ["pumped", "propped"])
@SLOW
def test_a_file_in_mid_injection_continues_with_the_same_bits(runs, kind):
    """Written by as many ranks as go on from it; on more of them: test_the_same_bits."""
    found = runs(1, f"direct-{kind}")
    for name in ("pressure", "saturation", "fluid"):
        assert np.array_equal(found[f"again_{name}"], found[name])


@SLOW
def test_slurry_opens_it_too(runs):
    found, water = runs(1, "direct-propped"), runs(1, "direct-pumped")
    stored, packed, came, left, removed = found["sand"]
    assert abs(came - stored - left - removed) < 1e-12 * came and came > 0.15 * water["account"][1]
    assert found["concentration"].max() > 0.19 and found["pressure"].max() > 1.01 * water["pressure"].max()
    assert found["pack_pressure"].max() > 0.25 * 4e5 and packed > 0.0


def test_cold_strains_the_joints(runs):
    found = runs(1, "direct-cooled")
    assert found["joints"][0] > 10 and np.ptp(found["temperature"]) > 5.0
    assert np.nanmax(found["stress_xx"]) > 1e6 and np.nanmax(found["opening"]) > 1e-7


@SLOW
def test_cold_water_cools_the_rock(runs):
    found = runs(1, "direct-rinsed")
    given, commands, stored, fluid, removed = found["account"]
    assert abs(given + commands - stored - fluid - removed) < 1e-12 * stored and given < -1e5
    assert found["water"].min() == 10.0 and 30.0 < found["water"].max() < 60.0 + 1e-5
    assert found["temperature"].max() > 59.0 and found["temperature"].min() < 40.0
    assert found["steady"] == pytest.approx(10.0, abs=1e-6)


def test_tetrahedra_yield(runs):
    crushed = runs(1, "direct-crushed")
    assert crushed["ratios"].max() < 1e-8 and np.nanmax(crushed["plastic_shear_strain"]) > 1e-3


@SLOW
def test_tetrahedra_and_hexahedra_break(runs):
    for solid in (runs(1, "direct-solid"), runs(1, "direct-sides")):
        assert solid["ratios"].max() < 1e-8 and solid["joints"][1:].sum() > 3


@pytest.mark.parametrize("kind", ["burst", "seam"])
@SLOW
def test_fluid_opens_joints_of_tetrahedra_and_hexahedra(runs, kind):
    found = runs(1, f"direct-{kind}")
    assert found["joints"][1:].sum() > 5 and found["pressure"].max() > 1e6 and found["saturation"].min() < 0.5
    pressure, rate, injected, stage = found["wells"]
    assert pressure > 1e5 and (rate, stage) == (0.0, 2.0) and injected == pytest.approx(1e-5 * 0.43, rel=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("name", [pytest.param(f"direct{kind}", marks=() if kind in QUICK else SLOW) for kind in KINDS])
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=SLOW)])
def test_the_same_bits(runs, name, ranks):
    alone, found = runs(1, name), runs(ranks, name)
    assert set(found) == set(alone)
    for quantity, values in alone.items():
        assert np.array_equal(found[quantity], values, equal_nan=True), quantity


ELASTIC = ("stress_xx", "stress_yy", "stress_xy", "displacement_x", "displacement_y", "opening")
PUMPED = ("stress_yy", "displacement_y", "opening", "pressure", "saturation", "fluid", "joints", "account")
PROPPED = (*PUMPED, "concentration", "proppant", "pack_pressure", "sand")
COOLED = ("stress_xx", "displacement_x", "temperature", "account")
PLASTIC = ("stress_xx", "stress_yy", "displacement_x", "displacement_y", "plastic_shear_strain", "plastic_work")


SOLID = ("stress_xx", "displacement_x", "displacement_z", "opening", "joints")
BURST = ("stress_xx", "displacement_z", "opening", "pressure", "saturation", "fluid", "joints", "account")
CRUSHED = ("stress_xx", "displacement_x", "displacement_z", "plastic_shear_strain", "plastic_work")


@pytest.mark.mpi
@pytest.mark.petsc
@pytest.mark.parametrize(
    ("kind", "quantities"),
    [
        ("", ELASTIC),
        *(
            pytest.param(*one, marks=SLOW)
            for one in (
                ("-cooled", COOLED),
                ("-propped", PROPPED),
                ("-crushed", CRUSHED),
                ("-yields", PLASTIC),
                ("-pumped", PUMPED),
                ("-solid", SOLID),
                ("-burst", BURST),
                ("-sides", SOLID),
            )
        ),
    ],
)
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=SLOW)])
def test_petsc_on_several_ranks(runs, kind, quantities, ranks):
    alone, found = runs(1, f"direct{kind}"), runs(ranks, f"petsc{kind}")
    for name in quantities:
        assert np.nanmax(np.abs(found[name] - alone[name])) < 1e-9 * np.nanmax(np.abs(alone[name])), name
