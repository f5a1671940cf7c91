"""The static solve: the same bits on any number of ranks where it is solved directly, to 1e-9 by PETSc."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.conftest import Launcher

WORKER = Path(__file__).with_name("equilibrium_worker.py")


def run(folder: Path, ranks: int, solver: str, *more: str) -> dict[str, np.ndarray]:
    done = Launcher().python(ranks, WORKER, solver, f"{solver}{ranks}.npz", *more, cwd=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    with np.load(folder / f"{solver}{ranks}.npz") as found:
        return dict(found)


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> dict[str, np.ndarray]:
    return run(tmp_path_factory.mktemp("alone"), 1, "direct")


def test_both_stages_are_in_balance(alone):
    assert alone["ratios"].max() < 1e-8
    assert alone["counts"][2] > 1000 and np.isnan(alone["stress_xx"]).sum() > 5
    assert np.nanmax(np.abs(alone["later_velocity_x"])) < 1e-12


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.slow), 3, pytest.param(4, marks=pytest.mark.slow)])
def test_the_same_bits(alone, ranks, tmp_path):
    found = run(tmp_path, ranks, "direct")
    assert set(found) == set(alone)
    for name, values in alone.items():
        assert np.array_equal(found[name], values, equal_nan=True), name


@pytest.mark.mpi
@pytest.mark.petsc
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow)])
def test_petsc_on_several_ranks(alone, ranks, tmp_path):
    found = run(tmp_path, ranks, "petsc")
    for name in ("stress_xx", "stress_yy", "stress_xy", "displacement_x", "displacement_y", "opening"):
        assert np.nanmax(np.abs(found[name] - alone[name])) < 1e-9 * np.nanmax(np.abs(alone[name])), name


@pytest.fixture(scope="module")
def yielding(tmp_path_factory) -> dict[str, np.ndarray]:
    return run(tmp_path_factory.mktemp("yielding"), 1, "direct", "yields")


def test_rock_that_yields_is_in_balance(yielding):
    assert yielding["ratios"].max() < 1e-8 and yielding["counts"][1] >= 3
    assert np.nanmax(yielding["plastic_shear_strain"]) > 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_the_same_bits_of_rock_that_yields(yielding, ranks, tmp_path):
    found = run(tmp_path, ranks, "direct", "yields")
    assert set(found) == set(yielding)
    for name, values in yielding.items():
        assert np.array_equal(found[name], values, equal_nan=True), name


@pytest.mark.mpi
@pytest.mark.petsc
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_rock_that_yields_by_petsc_on_several_ranks(yielding, ranks, tmp_path):
    found = run(tmp_path, ranks, "petsc", "yields")
    for name in ("stress_xx", "stress_yy", "displacement_x", "displacement_y", "plastic_shear_strain", "plastic_work"):
        assert np.nanmax(np.abs(found[name] - yielding[name])) < 1e-9 * np.nanmax(np.abs(yielding[name])), name
