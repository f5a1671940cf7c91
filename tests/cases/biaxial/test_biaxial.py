"""A6-A8: strength of sand and of bonded and unbonded rock in a biaxial press, against published calibrations.

The press is rig.py. Samples of 1458 or 1500 grains are packed without friction, then given the friction of the test;
the same sample serves all confining pressures of a series. Inertial number of the loading 1e-3 (A7: 5e-4).

What must hold: the friction angle grows with the friction of grains, peaks lie on a Mohr-Coulomb line, bonds give
cohesion, unbonded grains have hardly any, half the speed gives nearly the same peak.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hpcdem import Simulation
from tests.cases.biaxial.rig import Curve, Grains, Press, mohr_coulomb, serial
from tests.conftest import ROOT, Launcher

# Li et al. 2021: discs of a sandbox, rotation fixed as in their scripts.
SAND = Grains(
    radii=[0.1e-3, 0.1e-3, 0.2e-3, 0.2e-3, 0.25e-3, 0.3e-3],
    density=1.3e3,
    law={"kn": 1.5e4, "ks": 1.5e4},
    disk="hex",
    step={"frac": 0.4},
    stiff=lambda force: 7.5e3,
    wall={"kn": 1.5e4, "ks": 1.5e4},
    fixed=True,
    grid=True,
)
# Li et al. 2022 and the ZDEM manual: Hertz spheres of 60 and 80 m.
HERTZ = 2.0 * 2.9e9 * math.sqrt(2.0 * 68.57) / (3.0 * (1.0 - 0.2))
ROCK = Grains(
    radii=[60.0, 80.0],
    density=2.5e3,
    law={"shear": 2.9e9, "poiss": 0.2, "hertz": True},
    disk="off",
    step={"dt": 0.04},
    stiff=lambda force: 1.5 * (HERTZ**2 * force) ** (1.0 / 3.0),
)
BOND = {"ebmod": 2e8, "gbmod": 2e8, "tstrength": 1e7, "sstrength": 2e7}
MPA = 1e6


@pytest.fixture
def press_folder(tmp_path: Path) -> Iterator[Path]:
    """Simulations of this process on one rank, without MPI."""
    with serial(tmp_path):
        yield tmp_path


def report(what: str, stress: float, curve: Curve, unit: float = 1.0, published: float = math.nan) -> None:
    """One line of the comparison (pytest -s)."""
    print(
        f"{what}: s3 {stress / unit:g}, peak {curve.peak / unit:.1f} (published {published}), "
        f"residual {curve.residual / unit:.1f}, volume {100 * curve.volume[-1]:+.1f} %, "
        f"side {curve.side.mean() / stress:.3f} +- {curve.side.std() / stress:.3f}"
    )


# --- the servo, quickly ----------------------------------------------------------------------------------------------

SMALL = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
import hashlib
from hpcdem import Simulation
from tests.cases.biaxial.rig import Press
from tests.cases.biaxial.test_biaxial import SAND
sim = Simulation(log=False)
press = Press(sim, SAND, 150)
press.confine(200.0)
stress = press.stress()
sim.prop(fric=0.3)
curve = press.shear(200.0, inertial=5e-3, strain=0.02)
x, y = sim.gather("x", "y")
if sim.rank == 0:
    print("stress", *stress.values())
    print("sides", curve.side[len(curve.side) // 2 :].mean())
    print("state", sim.steps, hashlib.sha256(x.tobytes() + y.tobytes() + curve.q.tobytes()).hexdigest())
"""


def small(launch: Launcher, ranks: int, folder: Path) -> dict[str, list[str]]:
    """What the small press printed on so many ranks."""
    folder.mkdir()
    (folder / "small.py").write_text(SMALL)
    done = launch.python(ranks, folder / "small.py", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    return {line[0]: line[1:] for line in lines if line and line[0] in ("stress", "sides", "state")}


def test_servo_reaches_an_isotropic_stress(launch: Launcher, tmp_path: Path) -> None:
    """All four walls within 2 % of 200 Pa, and the sides while the sample is being shortened."""
    told = small(launch, 1, tmp_path / "one")
    assert [float(s) for s in told["stress"]] == pytest.approx([200.0] * 4, rel=0.02)
    assert float(told["sides"][0]) == pytest.approx(200.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.mpi
def test_servo_is_the_same_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    """Wall forces are exact sums, so the feedback does not depend on ranks: the same bits after all of it."""
    assert small(launch, 1, tmp_path / "one") == small(launch, 2, tmp_path / "two")


def test_line_of_mohr_and_coulomb() -> None:
    """q = (K - 1) s3 + 2 c sqrt(K) gives back phi and c."""
    k = math.tan(math.radians(45.0 + 16.0)) ** 2
    s3 = [50.0, 100.0, 300.0]
    q = [(k - 1.0) * s + 2.0 * 67.4 * math.sqrt(k) for s in s3]
    assert mohr_coulomb(s3, q) == pytest.approx((32.0, 67.4, 1.0))


# --- A6 --------------------------------------------------------------------------------------------------------------

SAND_PEAKS = {50.0: 350.9, 100.0: 475.5, 200.0: 728.5, 300.0: 920.2}
"""Li et al. 2021: peak s1 - s3 [Pa]; 32.3 degrees and 67.4 Pa."""


def _peaks(seed: int) -> list[float]:
    """Peaks [Pa] of another packing of the sand, loaded slowly."""
    sim = Simulation(log=False)
    press = Press(sim, SAND, 1500, seed)
    found = []
    for s3 in SAND_PEAKS:
        press.confine(s3)
        sim.save("other.sav")
        sim.prop(fric=0.3)
        found.append(press.shear(s3).peak)
        sim.restore("other.sav")
    return found


@pytest.mark.slow
def test_sand(press_folder: Path) -> None:
    """Slowly: the published friction angle, but hardly any cohesion. With the lattice-solid damping of the published
    sandbox: the published peaks, too.

    The published peaks exceed ours by 160-195 Pa at every confining pressure. That is what the damping -eta v gives:
    in a sample of n grains per area, shortened at the rate r, it adds about eta r n H^2 / 8 to the axial stress and
    eta r n W^2 / 8 to the confining one at the centre. Speed and size of the published test are not known; here
    r H^2 = 40 mm/s x 70 mm: the speed of the wall in their sandbox, and the height of a sample that is then needed.
    """
    sim = Simulation(log=False)
    press = Press(sim, SAND, 1500)
    slow, half, drag, free = {}, {}, {}, {}
    for s3, published in SAND_PEAKS.items():
        press.confine(s3)
        sim.save("sample.sav")
        sim.prop(fric=0.3)
        slow[s3] = press.shear(s3)
        report("sand", s3, slow[s3], published=published)
        if s3 == 100.0:
            sim.restore("sample.sav")
            sim.prop(fric=0.3)
            half[s3] = press.shear(s3, inertial=5e-4)
            report("sand, half the speed", s3, half[s3], published=published)
        if s3 in (50.0, 300.0):
            sim.restore("sample.sav")
            sim.prop(fric=0.3)
            sim.free("spin")
            free[s3] = press.shear(s3)
            report("sand, free to rotate", s3, free[s3], published=published)
        sim.restore("sample.sav")
        sim.prop(fric=0.3, damp=0.0)
        sim.set(lsm=0.04)
        rate = 40e-3 * 70e-3 / press.size()[1] ** 2
        drag[s3] = press.shear(s3, inertial=rate * press.diameter * math.sqrt(SAND.density / s3))
        report("sand, lattice-solid damping", s3, drag[s3], published=published)
        sim.restore("sample.sav")
        sim.set(lsm=0.0)

    peaks = np.mean([[c.peak for c in slow.values()], *(_peaks(seed) for seed in (2, 3))], axis=0)
    phi, cohesion, r2 = mohr_coulomb(list(slow), peaks.tolist())
    print(f"sand, mean of three packings: {np.round(peaks)}, r2 {r2:.4f}")
    print(f"sand: {phi:.1f} degrees (published 32.3), {cohesion:.1f} Pa")
    assert phi == pytest.approx(32.3, abs=2.0)
    assert r2 > 0.99  # of single packings, 1 to 5: 0.988 to 0.998, 31.3 to 32.3 degrees, 18 to 26 Pa
    assert 0.0 < cohesion < 25.0
    assert all(abs(c.side.mean() / s3 - 1.0) < 0.01 for s3, c in slow.items())
    assert half[100.0].peak == pytest.approx(slow[100.0].peak, rel=0.08)
    weaker, _, _ = mohr_coulomb(list(free), [c.peak for c in free.values()])
    print(f"sand, free to rotate: {weaker:.1f} degrees")
    assert weaker < phi - 5.0

    phi, cohesion, r2 = mohr_coulomb(list(drag), [c.peak for c in drag.values()])
    print(f"sand, lattice-solid damping: {phi:.1f} degrees, {cohesion:.1f} Pa (published 67.4), r2 {r2:.4f}")
    for s3, published in SAND_PEAKS.items():
        assert drag[s3].peak == pytest.approx(published, rel=0.15), s3
    assert cohesion == pytest.approx(67.4, abs=15.0)
    assert phi == pytest.approx(32.3, abs=3.0)


# --- A7, A8 ----------------------------------------------------------------------------------------------------------

ROCK_PEAKS = {10.0: 38.0, 20.0: 47.7, 40.0: 69.7, 60.0: 80.1, 80.0: 105.7}
"""Li et al. 2022: peak s1 - s3 against s3 [MPa]; 18.5 degrees and 10.5 MPa."""
LAYERS = {0.0: 6.0, 0.1: 15.0, 0.2: 18.0, 0.3: 20.0}
"""Friction angle [degrees] of unbonded layers against friction (abstract of 2017)."""


@pytest.mark.slow
def test_bonded_rock(press_folder: Path) -> None:
    """One specimen, bonded at 10 MPa, then put under each confining pressure, as in the laboratory."""
    sim = Simulation(log=False)
    press = Press(sim, ROCK, 1500)
    press.confine(10.0 * MPA)
    bonds = sim.bond(**BOND)
    sim.prop(fric=0.3)
    sim.save("specimen.sav")
    curves, left = {}, {}
    for s3, published in ROCK_PEAKS.items():
        sim.restore("specimen.sav")
        press.confine(s3 * MPA)
        curves[s3] = press.shear(s3 * MPA, inertial=5e-4, strain=0.14)
        left[s3] = sim.bonds_left / bonds
        report("rock", s3 * MPA, curves[s3], MPA, published)
    sim.restore("specimen.sav")
    press.confine(20.0 * MPA)
    slower = press.shear(20.0 * MPA, inertial=2.5e-4, strain=0.1)
    report("rock, half the speed", 20.0 * MPA, slower, MPA, ROCK_PEAKS[20.0])
    peaks = [curve.peak / MPA for curve in curves.values()]
    phi, cohesion, r2 = mohr_coulomb(list(curves), peaks)
    print(f"rock: {phi:.1f} degrees (published 18.5), {cohesion:.1f} MPa (published 10.5), r2 {r2:.4f}; bonds {left}")
    for s3, published in ROCK_PEAKS.items():
        assert curves[s3].peak / MPA == pytest.approx(published, rel=0.20), s3
    assert cohesion == pytest.approx(10.5, abs=2.0)
    assert phi == pytest.approx(18.5, abs=2.0)
    assert r2 > 0.99
    assert slower.peak == pytest.approx(curves[20.0].peak, rel=0.08)
    assert all(0.3 < share < 0.95 for share in left.values())
    assert curves[10.0].peak > 1.4 * curves[10.0].residual  # bonds break: strength is lost


@pytest.mark.slow
def test_unbonded_layers(press_folder: Path) -> None:
    """The friction angle grows with the friction of the grains; without any it is a few degrees."""
    sim = Simulation(log=False)
    press = Press(sim, ROCK, 1500)
    stress = (20.0, 60.0)
    peaks: dict[float, list[float]] = {friction: [] for friction in LAYERS}
    for s3 in stress:
        press.confine(s3 * MPA)
        sim.save("sample.sav")
        for friction in LAYERS:
            sim.restore("sample.sav")
            sim.prop(fric=friction)
            curve = press.shear(s3 * MPA, strain=0.13)
            report(f"layer of friction {friction}", s3 * MPA, curve, MPA)
            peaks[friction].append(curve.peak / MPA)
        sim.restore("sample.sav")
    lines = {friction: mohr_coulomb(list(stress), q) for friction, q in peaks.items()}
    angles = {friction: line[0] for friction, line in lines.items()}
    print("layers:", {f: f"{a:.1f} degrees, {lines[f][1]:.2f} MPa, published {LAYERS[f]}" for f, a in angles.items()})
    for friction, published in LAYERS.items():
        assert angles[friction] == pytest.approx(published, abs=3.0), friction
        assert abs(lines[friction][1]) < 2.5  # no bonds, hardly any cohesion
    assert np.all(np.diff(list(angles.values())) > 2.0)
