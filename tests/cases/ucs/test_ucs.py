"""Uniaxial compression: slope, strength and cracks of a specimen of rock."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.cases.cracking import Study, study
from tests.cases.ucs import exact
from tests.conftest import ROOT

YOUNG, POISSON, FRICTION, COHESION = 30e9, 0.25, 30.0, 10e6
WIDTH, HEIGHT = 0.052, 0.108


def test_formulas_at_places_worked_out_by_hand():
    assert exact.strongest(10e6, 30.0) == pytest.approx(20e6 * np.sqrt(3.0), rel=1e-12)  # tan 60 degrees
    # One joint across the load: it only closes, by h s / P over the height A / h.
    ends, area = np.array([[[0.0, 0.0], [0.05, 0.0]]]), 0.05 * 0.1
    body = (area, YOUNG, POISSON, COHESION, FRICTION, 10 * YOUNG, 100 * YOUNG)
    rock = 1e6 * (1 - POISSON**2) / YOUNG
    assert exact.strain(1e6, ends, *body) - rock == pytest.approx(0.05 * 1e6 / 3e12 / 0.1, rel=1e-9)
    # One at 45 degrees under a small load: it closes by h s / (2 P_o) and slides by s_p q / 2 = h s / (2 P_s).
    h = 0.05 * np.sqrt(2)
    tilted = np.array([[[0.0, 0.0], [0.05, 0.05]]])
    small = exact.strain(1.0, tilted, *body) - 1.0 * (1 - POISSON**2) / YOUNG
    assert small == pytest.approx(h * h / (4 * area) * (1 / 3e12 + 1 / 3e11), rel=1e-6)


def check(found: Study, cohesion: float = COHESION) -> None:
    """Slope and strength within their bounds, cracks of both kinds, energy accounted for."""
    result = found.result
    strongest = exact.strongest(cohesion, FRICTION)
    assert 0.6 * strongest <= result["peak"] <= strongest
    rock = YOUNG / (1 - POISSON**2)
    # A chain of rock and joints of penalty P has M / (1 + M / P), M of the rock; here P = 10 E, M = 1.2 E.
    assert result["modulus"] == pytest.approx(rock / (1 + 1.2 / 10), rel=0.05)
    ends = found.state.points[found.state.joints]  # the last frame: broken joints have moved by hundredths of an edge
    body = (WIDTH * HEIGHT, YOUNG, POISSON, cohesion, FRICTION, 10 * YOUNG, 100 * YOUNG)
    softest = exact.modulus(0.1 * result["peak"], 0.5 * result["peak"], ends, *body)
    assert result["modulus"] == pytest.approx(softest, rel=0.01)
    assert result["tension"] > 0 and result["shear"] > 0
    assert result["energy_error"] < 0.01
    assert found.curve[-1, 1] < 0.6 * result["peak"]


def test_coarse_specimen(launch, tmp_path):
    """Few elements: a crack has to go round them, so the strength is no bound."""
    found = study(launch, tmp_path, "ucs", size=0.009, transits=20)
    assert found.result["peak"] > 0.6 * exact.strongest(COHESION, FRICTION)
    found.result["peak"] = min(found.result["peak"], exact.strongest(COHESION, FRICTION))
    check(found)


@pytest.mark.slow
@pytest.mark.parametrize("overlay", [10.0, 100.0])
def test_a_cylinder(launch, tmp_path, overlay):
    """In space, coarse: stiffness of rock and joints, strength within its bounds, cracks of both kinds."""
    diameter, height = 0.05, 0.1
    found = study(launch, tmp_path, "ucs", 3600, dim=3, width=diameter, height=height, size=0.01, transits=10,
                  platens=False, penalty_overlay=overlay)  # fmt: skip
    strongest = exact.strongest(COHESION, FRICTION)
    assert 0.6 * strongest <= found.result["peak"] <= strongest
    body = np.pi / 4 * diameter**2 * height
    stiff = exact.modulus_in_space(found.state.points[found.state.joints], body, YOUNG, 10 * YOUNG, overlay * YOUNG)
    assert found.result["modulus"] == pytest.approx(stiff, rel=0.05)
    assert found.result["tension"] > 0 and found.result["shear"] > 0
    assert found.result["energy_error"] < 0.01 and found.curve[-1, 1] < 0.6 * found.result["peak"]


@pytest.mark.slow
def test_joints_across_and_askew_in_space():
    """One that lies across the load closes only; one at 45 degrees slides as well."""
    flat = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]])
    volume, area = 1e-3, 5e-3
    soft = 1.0 / exact.modulus_in_space(flat, volume, YOUNG, 3e11, 3e12) - 1.0 / YOUNG
    assert soft == pytest.approx(area**1.5 / 3e12 / volume, rel=1e-9)
    askew = flat[:, :, [0, 1, 2]] + np.array([0, 0, 1.0]) * flat[:, :, :1]
    soft = 1.0 / exact.modulus_in_space(askew, volume, YOUNG, 3e11, 3e12) - 1.0 / YOUNG
    assert soft == pytest.approx((area * 2**0.5) ** 1.5 / 4 * (1 / 3e12 + 1 / 3e11) / volume, rel=1e-9)


@pytest.mark.slow
def test_specimen_and_half_its_cohesion(launch, tmp_path):
    whole = study(launch, tmp_path / "whole", "ucs", 7200)
    check(whole)
    half = study(launch, tmp_path / "half", "ucs", 7200, cohesion=0.5 * COHESION)
    assert half.result["peak"] < 0.8 * whole.result["peak"]
    assert half.result["energy_error"] < 0.01


@pytest.mark.slow
def test_ends_that_are_moved_give_what_platens_without_friction_give(launch, tmp_path):
    one, two = (study(launch, tmp_path / str(p), "ucs", 3600, size=0.006, transits=20, platens=p)
                for p in (True, False))  # fmt: skip
    for name in ("peak", "modulus"):
        assert one.result[name] == pytest.approx(two.result[name], rel=0.05)


@pytest.mark.slow
def test_example_with_a_line_of_its_own(launch, tmp_path):
    """examples/ucs.sc, coarse: at the end the specimen is wider."""
    text = (ROOT / "examples" / "ucs.sc").read_text(encoding="utf-8")
    short = text.replace("UCS(cohesion", "UCS(size=0.009, transits=20, cohesion")
    assert short != text
    (tmp_path / "ucs.sc").write_text(short)
    done = launch(1, "ucs.sc", cwd=tmp_path, timeout=1200)
    assert done.returncode == 0, done.stderr
    (wider,) = re.findall(r"^at the end it is (\S+) mm wider", done.stdout, flags=re.MULTILINE)
    assert 0.01 < float(wider) < 1.0
    assert (tmp_path / "data" / "ucs.png").stat().st_size > 10_000
