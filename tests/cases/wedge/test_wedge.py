"""A wedge that two joints cut out of a slope slides where limit equilibrium says, along the line of the joints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.cases.ready import results
from tests.cases.wedge import exact

A, B = (40.0, 165.0), (70.0, 285.0)
"""Planes of the worked example of the friction charts in Hoek & Bray (1981): A 1.5, B 0.7, F 1.30 with 35 and 20
degrees. The face of the default case dips towards 210 degrees."""


def test_the_published_example() -> None:
    assert exact.factors(A, B) == pytest.approx((1.5, 0.7), abs=0.02)
    assert exact.factor(A, B, 35.0, 20.0) == pytest.approx(1.30, abs=0.01)


def test_a_wedge_as_flat_as_a_plane() -> None:
    """Two planes alike but for a hair: a block on a plane, tan(phi) / tan(dip). Mirrored ones share the weight."""
    assert exact.factor((30.0, -0.1), (30.0, 0.1), 40.0, 40.0) == pytest.approx(
        np.tan(np.radians(40.0)) / np.tan(np.radians(30.0)), rel=1e-4
    )
    one, other = exact.factors((50.0, -60.0), (50.0, 60.0))
    assert one == pytest.approx(other)


def found(resident: Any, folder: Any, **given: Any) -> Any:
    from hpcdem.cases import Wedge

    return results(resident, folder, Wedge(**given))


def check(got: Any, a: tuple[float, float], b: tuple[float, float], frictions: tuple[float, float]) -> None:
    factor = exact.factor(a, b, *frictions)
    assert got.equilibrium == pytest.approx(factor, rel=1e-9)
    assert got.factor == pytest.approx(factor, rel=0.05)
    assert abs(got.trend_moved - got.trend) < 2.0
    way = exact.line(a, b)
    assert got.trend == pytest.approx(np.degrees(np.arctan2(way[0], way[1])))
    assert got.plunge == pytest.approx(np.degrees(np.arcsin(-way[2])))


@pytest.mark.slow
def test_the_factor_of_safety_of_the_default(resident: Any, tmp_path: Any) -> None:
    got = found(resident, tmp_path, size=3.0, coarse=6.0)
    check(got, (40.0, -45.0), (70.0, 75.0), (35.0, 20.0))


@pytest.mark.slow
def test_another_wedge(resident: Any, tmp_path: Any) -> None:
    """Mirrored joints with one friction, a steeper face; both joints carry alike, it slides straight out."""
    got = found(resident, tmp_path, dip_a=50.0, towards_a=-60.0, dip_b=50.0, towards_b=60.0, friction_a=30.0,
                friction_b=30.0, face=75.0, height=6.0, size=1.5, coarse=3.0)  # fmt: skip
    check(got, (50.0, -60.0), (50.0, 60.0), (30.0, 30.0))


def test_joints_that_make_no_wedge_are_refused() -> None:
    from hpcdem.cases import Wedge
    from hpcdem.core.errors import ScriptError

    with pytest.raises(ScriptError, match=r"plunges by .* degrees against the face"):
        Wedge(towards_a=135.0, towards_b=-135.0)
    with pytest.raises(ScriptError, match="expected more than 0 and less than face, 20"):
        Wedge(face=20.0)
    with pytest.raises(ScriptError, match="at most half of height"):
        Wedge(size=6.0, coarse=7.0)
