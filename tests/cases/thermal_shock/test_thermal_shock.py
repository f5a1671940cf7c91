"""`hpcdem case thermal-shock`: an ensemble of slabs, each with another field of strength, one with another mesh, beside
the theory of cracks that leave each other behind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.cases.cracking import study
from tests.cases.thermal_shock import exact
from tests.conftest import Launcher

WIDTH = 0.24
MEMBERS = {"1": {"seed": 1}, "2": {"seed": 2}, "3": {"seed": 3}, "coarser": {"seed": 5, "size": 0.004}}


@pytest.mark.slow
def test_critical_spacings_do_not_depend_on_the_elements() -> None:
    """Their ratios at three thermal lengths, the middle one by half as many elements."""
    found = exact.critical_spacings(np.array([0.75, 1.0, 1.25]))
    assert found[:, 1] == pytest.approx([5.83, 16.4, 62.2], rel=0.01)
    assert found[:, 2] == pytest.approx([0.385, 0.761, 1.285], rel=0.01)
    finer = exact.critical_spacings(np.array([1.0]), range(6, 54, 4), across=36)
    assert finer[0, 1:] == pytest.approx(found[1, 1:], rel=0.05)


@pytest.fixture(scope="module")
def slabs(tmp_path_factory: pytest.TempPathFactory) -> list[dict]:
    folder = tmp_path_factory.mktemp("shock")
    return [study(Launcher(), Path(folder / name), "thermal-shock", timeout=3600, **given).result
            for name, given in MEMBERS.items()]  # fmt: skip


@pytest.mark.slow
def test_spacing_and_depth_of_cracks(slabs: list[dict]) -> None:
    """Cracks that are at least half as deep as the deepest one are as far apart, in the mean of the ensemble, as those
    that grow can be: the critical spacing to twice that, for thermal lengths from 29 to 72 Griffith lengths. The
    deepest ones are as deep as cracks of the critical spacing."""
    theory = exact.critical_spacings(np.array([0.75, 1.0, 1.25]))
    for b in (0.032, 0.048, 0.064, 0.08):
        spacings, depths = [], []
        for one in slabs:
            rows = np.array([(depth, n) for at, depth, n in one["counts"] if abs(at - b) < 1e-9])
            deepest = rows[rows[:, 1] > 0, 0].max()
            spacings.append(WIDTH / np.interp(0.5 * deepest, *rows.T))
            depths.append(deepest)
        length = one["griffith"]
        critical = length * np.exp(np.interp(np.log(b / length), np.log(theory[:, 0]), np.log(theory[:, 1])))
        assert critical < np.mean(spacings) < 2.0 * critical, (b, critical, spacings)
        ratio = np.interp(np.log(b / length), np.log(theory[:, 0]), theory[:, 2])
        assert np.mean(depths) == pytest.approx(ratio * critical, rel=0.25), (b, depths)


@pytest.mark.slow
def test_energy_of_the_cracks(slabs: list[dict]) -> None:
    """They never take more than the stress in the slab without cracks has, and less and less of it."""
    for one in slabs:
        part = np.array(one["curve"])[:, 2]
        assert (part < 1.0).all() and (np.diff(part[3:]) < 0.0).all()
        assert one["energy_error"] < 0.01
