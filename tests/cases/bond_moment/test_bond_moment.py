"""Bonds with a moment: bending stiffness, the stress that breaks them, a cantilever, energy."""

from __future__ import annotations

import math

import pytest

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties
from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Ids
from hpcdem.physics.dem import diagnostics
from tests.cases.bond_moment import exact
from tests.cases.bond_moment.exact import E, G, R, T
from tests.support import force, model, steps, value

NEVER = 1e30


def bonded(folder, gap: float = 0.0, disk: str = "on", radii=(R, R), **changes):
    """Two held bodies with this gap between them, bonded with a moment; the first can be turned by the tests."""
    sim = model(folder, 1e-3, energy=10**6, disk=disk)
    particles.ball(sim, 0, 0.0, 0.0, radii[0])
    particles.ball(sim, 1, sum(radii) + gap, 0.0, radii[1])
    properties.prop(sim, density=1000.0, kn=1e9, ks=1e9)
    properties.fix(sim, ("x", "y", "spin"))
    keys = {"ebmod": E, "gbmod": G, "tstrength": T, "sstrength": NEVER, "tolerate": gap + 1e-6, "moment": True}
    assert bonds.bond(sim, **{**keys, **changes}) == 1
    return sim


def turn(sim, angle: float, n: int = 100) -> None:
    """Turn the two bodies against each other, half each, so that the contact does not shear (equal radii)."""
    for gid, sign in ((0, 0.5), (1, -0.5)):
        properties.prop(sim, Ids(gid, gid), spin=sign * angle / (n * sim.settings.dt))
    cycles.cycle(sim, n)


@pytest.mark.parametrize("disk", ["on", "off"])
@pytest.mark.parametrize("gap", [0.0, 2e-3])
def test_bending_stiffness_and_the_angle_at_which_it_breaks(tmp_path, disk, gap):
    """Pure bending, and with the tension of an open bond, E gap/L = 4e5 of T = 1e6 Pa."""
    sim = bonded(tmp_path, gap, disk)
    area, inertia = exact.section(disk == "off")
    length = 2.0 * R
    limit = (T - E * gap / length) * length / (E * R)
    assert limit == pytest.approx(0.01 if gap == 0.0 else 0.006)
    turn(sim, 0.9 * limit)
    torque = E * inertia / length * 0.9 * limit
    seen = sim.energy.evaluate(sim)
    tension = 0.5 * E * area / length * gap**2
    assert force(sim, 0)[2] == pytest.approx(-torque) and force(sim, 1)[2] == pytest.approx(torque)
    assert seen.elastic_bonds == pytest.approx(0.5 * torque * 0.9 * limit + tension) and sim.broken() == (0, 0)
    turn(sim, 0.098 * limit, 98)
    assert sim.broken() == (0, 0)
    turn(sim, 0.004 * limit, 4)
    seen = sim.energy.evaluate(sim)
    assert sim.broken() == (1, 0) and sim.bonds_left() == 0 and not force(sim, 0)[2]
    stored = 0.5 * E * inertia / length * limit**2 + tension
    assert seen.loss_bonds == pytest.approx(stored, rel=5e-3)
    assert seen.elastic_bonds == 0.0 and abs(seen.closing) < 3e-3 * stored


def test_unlike_radii_and_other_ways_to_break(tmp_path):
    """Rt = 2 Ra Rb/(Ra + Rb) = 2/3; BOND break leaves no torque behind, and the budget closes."""
    sim = bonded(tmp_path, radii=(0.5, 1.0), tstrength=NEVER)
    turn(sim, 0.01)
    inertia = exact.section(False, 2.0 / 3.0)[1]
    shear = force(sim, 0)[1]
    assert force(sim, 0)[2] - shear * 0.5 == pytest.approx(-E * inertia / 1.5 * 0.01, rel=1e-6)
    assert force(sim, 1)[2] - shear * 1.0 == pytest.approx(E * inertia / 1.5 * 0.01, rel=1e-6)
    bonds.break_bonds(sim)
    turn(sim, 0.0, 2)
    seen = sim.energy.evaluate(sim)
    assert not force(sim, 0).any() and seen.elastic_bonds == 0.0 and abs(seen.relative) < 1e-9


def cantilever(folder, n: int, load: float, tensile: float = NEVER):
    """n + 1 discs in a row, bonded; the first is held, `load` [N] acts down on the last. At rest after the steps."""
    sim = model(folder, 1.5e-4)
    for gid in range(n + 1):
        particles.ball(sim, gid, 2.0 * R * gid, 0.0, R)
    properties.prop(sim, density=1000.0, kn=4e8, ks=2e8, damp=0.8)
    properties.fix(sim, ("x", "y", "spin"), where=Ids(0, 0))
    bonds.bond(sim, ebmod=E, gbmod=G, tstrength=tensile, sstrength=NEVER, conserving=True, moment=True)
    properties.prop(sim, Ids(n, n), yp=-load / (2.0 * R))
    return sim


def test_deflection_of_a_cantilever(tmp_path):
    """Four bonds, E I/L 1.667e7 N m, P 100 N: tip by the sum over the bonds 1.30e-4 m, of the beam 1.32e-4 m."""
    n, load = 4, 100.0
    sim = cantilever(tmp_path, n, load)
    steps(sim, 6000)
    inertia = exact.section(False)[1]
    beam = load * n**3 / (3.0 * E * inertia) + load * n / G
    assert exact.tip(n, load) == pytest.approx(1.30e-4) and exact.tip(n, load) == pytest.approx(
        beam, rel=1.0 / (4 * n * n)
    )
    assert -value(sim, "y", n) == pytest.approx(exact.tip(n, load), rel=2e-3)


@pytest.mark.parametrize("share", [0.93, 1.05])
def test_a_cantilever_breaks_at_its_root(tmp_path, share):
    """sigma_max = P (l - L/2) Rt/I; the load is raised in steps, so that it swings little."""
    n = 3
    inertia = exact.section(False)[1]
    load = T * inertia / (R * (n - 0.5) * 2.0 * R) * share
    sim = cantilever(tmp_path, n, 0.0, T)
    for part in range(1, 21):
        properties.prop(sim, Ids(n, n), yp=-load * part / 20.0 / (2.0 * R))
        steps(sim, 300)
    assert sim.broken()[0] == (share > 1.0)
    _, ids = diagnostics.contact_rows(sim)
    left = {(int(a), int(b)) for a, b, kind in ids if kind}
    assert left == {(0, 1), (1, 2), (2, 3)} - ({(0, 1)} if share > 1.0 else set())


@pytest.mark.parametrize("bond", [True, False])
def test_a_half_turn_of_the_whole_keeps_the_torques(tmp_path, bond):
    """The later one in storage is then the earlier one."""
    sim = bonded(tmp_path)
    if not bond:
        bonds.break_bonds(sim)
        properties.prop(sim, rfric=0.5)
        sim.particles["x"][:] *= 0.99
    turn(sim, 1e-3)
    before = force(sim, 0)[2], force(sim, 1)[2]
    assert before[0] < 0.0 < before[1]
    order = sim.particles["gid"].tolist()
    properties.prop(sim, spin=0.0)
    sim.open_model()
    sim.particles["x"][:] = R - sim.particles["x"]
    cycles.cycle(sim, 1)
    assert sim.particles["gid"].tolist() == order[::-1]
    assert (force(sim, 0)[2], force(sim, 1)[2]) == pytest.approx(before)
    assert abs(sim.energy.evaluate(sim).relative) < 1e-9


def test_refusals(tmp_path):
    sim = bonded(tmp_path)
    for keys in ({"n_bond": 1.0, "moment": True}, {"tstrength": T, "moment": True}):
        with pytest.raises(CommandError, match="bending stiffness follows from ebmod"):
            bonds.bond(sim, **keys)
    for change in (bonds.bond, lambda sim, **keys: bonds.renew(sim, None, [], **keys)):
        with pytest.raises(CommandError, match="bonds with a moment have their bending stiffness from ebmod"):
            change(sim, ebmod=0.0)
    particles.ball(sim, 2, 50.0, 0.0, R)
    particles.ball(sim, 3, 51.0, 0.0, R)
    properties.prop(sim, Ids(2, 3), density=1000.0, kn=1e9)
    clumps.join(sim, Ids(2, 3))
    with pytest.raises(CommandError, match=r"PROP moment .bonds. does not support clumps"):
        cycles.cycle(sim, 1)
    assert math.isfinite(value(sim, "x", 1))
