"""V21: the contact bond (model 2): the contact's own springs hold in tension up to N and in shear up to S.

With the pair stiffnesses kn, ks of the linear law (two equal springs in series, half of either):

    Fn = kn U for either sign of U, breaks if -Fn > N: at the gap N / kn nothing is left
    Fs = ks x way, no slip while bonded; breaks if |Fs| > S; then mu Fn is left if Fn > 0, else nothing

Between Hertz particles the springs of the open bond are the tangents at the overlap U0 at which it was made, 3/2 K
sqrt(U0) and that of Mindlin; U0 is not taken below Rt / 1000, so that a bond of just touching particles has a
stiffness.
"""

from __future__ import annotations

import math

import pytest

from hpcdem.commands.dem import bonds, particles, properties
from tests.support import carry, force, model, only, pair, steps

R, KN, KS, N, S, MU = 1.0, 4e6, 2e6, 3e4, 2e4, 0.5
GAP, WAY = N / (0.5 * KN), S / (0.5 * KS)
"""Where it breaks: 15 mm apart, 20 mm of shear."""
ALMOST, BEYOND = 1.0 - 5e-7, 1e-6


def bonded(folder, u: float = 0.0, **keys):
    """Two balls with overlap u, bonded, held."""
    sim = model(folder)
    particles.ball(sim, 1, 0.0, 0.0, R)
    particles.ball(sim, 2, 2.0 * R - u, 0.0, R)
    properties.prop(sim, kn=KN, ks=KS, fric=MU)
    properties.fix(sim, ("x", "y", "spin"))
    assert bonds.bond(sim, **(keys or {"n_bond": N, "s_bond": S})) == 1
    steps(sim, 1)
    return sim


def contact(sim):
    return pair(sim, 1, 2)


def shear(sim, way: float, n: int = 100) -> None:
    """Slide the surfaces by `way` [m] by turning ball 2."""
    carry(sim, 2, angle=-way / (R - 0.5 * contact(sim).overlap), n=n)


def test_v21_pull(tmp_path):
    sim = bonded(tmp_path)
    carry(sim, 2, x=GAP * ALMOST)
    assert contact(sim).fn == pytest.approx(-N, rel=1e-6) and sim.bonds_left() == 1
    assert force(sim, 1)[0] == pytest.approx(N, rel=1e-6)
    carry(sim, 2, x=GAP * BEYOND, n=1)
    assert contact(sim) is None and not force(sim, 1).any()
    assert sim.broken() == (1, 0) and sim.bonds_left() == 0


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("u", [1e-3, 0.0, -5e-3])
def test_v21_shear(tmp_path, u, sense):
    """S is the whole limit: the normal force does not add to it. What is left is friction, if the pair touches."""
    sim = bonded(tmp_path)
    carry(sim, 2, x=-u)
    shear(sim, sense * WAY * ALMOST)
    assert sense * contact(sim).fs == pytest.approx(S, rel=1e-6) and sim.bonds_left() == 1
    shear(sim, sense * WAY * BEYOND, n=1)
    assert sim.broken() == (0, 1)
    left = contact(sim)
    if u > 0.0:
        assert left.fn == pytest.approx(0.5 * KN * u, rel=1e-9)
        assert sense * left.fs == pytest.approx(MU * left.fn, rel=1e-9)
    else:
        assert left is None or (left.fn == pytest.approx(0.0, abs=1e-6) and left.fs == pytest.approx(0.0, abs=1e-6))


def test_v21_after_the_break_an_ordinary_contact(tmp_path):
    sim = bonded(tmp_path)
    carry(sim, 2, x=2.0 * GAP)
    carry(sim, 2, x=-2.0 * GAP - 1e-3)
    assert contact(sim).fn == pytest.approx(0.5 * KN * 1e-3, rel=1e-9)
    shear(sim, 1e-3)
    assert contact(sim).fs == pytest.approx(MU * contact(sim).fn, rel=1e-9), "friction limits it now"
    carry(sim, 2, x=2e-3)
    assert contact(sim) is None, "no tension"


def test_v21_a_later_command_sets_new_strengths(tmp_path):
    """N, then 2 N: 2 N holds (the change of ZDEM 2.2), also for a pair that is stretched by now; S is kept."""
    sim = bonded(tmp_path)
    carry(sim, 2, x=0.5 * GAP)
    assert bonds.bond(sim, n_bond=2.0 * N) == 0, "none is new"
    assert sim.bonds_left() == 1
    carry(sim, 2, x=GAP)
    assert contact(sim).fn == pytest.approx(-1.5 * N, rel=1e-6)
    shear(sim, WAY * ALMOST)
    assert contact(sim).fs == pytest.approx(S, rel=1e-6) and sim.bonds_left() == 1
    shear(sim, -WAY * ALMOST)
    carry(sim, 2, x=0.5 * GAP * ALMOST)
    assert contact(sim).fn == pytest.approx(-2.0 * N, rel=1e-6)
    carry(sim, 2, x=2.0 * GAP * BEYOND, n=1)
    assert contact(sim) is None


def test_v21_a_pair_has_one_kind_of_bond(tmp_path):
    """Elastic keys given to a contact bond make it an elastic one: A = 2 R x 1 m between disks, L = 2 R."""
    sim = bonded(tmp_path)
    assert bonds.bond(sim, ebmod=1e7, tstrength=1e9, sstrength=1e9) == 0
    carry(sim, 2, x=1e-2)
    assert contact(sim).fn == pytest.approx(-1e7 * 2.0 * R * 1.0 / (2.0 * R) * 1e-2, rel=1e-9)
    assert sim.bonds_left() == 1


def test_bonds_of_a_selection_only(tmp_path):
    """Both ends must be chosen."""
    sim = model(tmp_path)
    for gid in range(4):
        particles.ball(sim, gid, 2.0 * gid, 0.0, R)
    properties.prop(sim, kn=KN, ks=KS)
    assert bonds.bond(sim, only(0) | only(1) | only(3), n_bond=N, s_bond=S) == 1
    assert sim.bonds_left() == 1
    assert bonds.break_bonds(sim, only(0)) == 0
    assert bonds.break_bonds(sim, only(0) | only(1)) == 1 and sim.bonds_left() == 0


@pytest.mark.parametrize(("u_made", "u_counts"), [(0.0, 1e-3), (1e-4, 1e-3), (0.02, 0.02)])
def test_v21_between_hertz_particles(tmp_path, u_made, u_counts):
    """u_counts: overlap at which the tangents are taken; the floor is Rt / 1000 = 1 mm."""
    g, nu = 1e8, 0.25
    sim = model(tmp_path)
    particles.ball(sim, 1, 0.0, 0.0, R)
    particles.ball(sim, 2, 2.0 * R - u_made, 0.0, R)
    properties.prop(sim, shear=g, poiss=nu, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    bonds.bond(sim, n_bond=1e12, s_bond=1e12)
    steps(sim, 1)
    k = 2.0 * g * math.sqrt(2.0 * R) / (3.0 * (1.0 - nu))
    assert contact(sim).fn == pytest.approx(k * u_made**1.5, rel=1e-9, abs=1e-9 * k)
    carry(sim, 2, x=u_made + 1e-2)
    assert contact(sim).fn == pytest.approx(-1.5 * k * math.sqrt(u_counts) * 1e-2, rel=1e-9)
    before = contact(sim).fs
    shear(sim, 1e-2)
    ks = 2.0 * (3.0 * g**2 * (1.0 - nu) * R * k * u_counts**1.5) ** (1.0 / 3.0) / (2.0 - nu)
    assert contact(sim).fs - before == pytest.approx(ks * 1e-2, rel=1e-9)
