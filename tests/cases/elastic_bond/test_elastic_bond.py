"""V19, V20, V22: pulling, shearing, compressing a bonded pair of fixed spheres."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, particles, properties
from hpcdem.runtime.progress import Log
from tests.cases.elastic_bond import exact
from tests.support import carry, force, model, only, pair, steps, value, watch


def bonded(folder, u: float = 0.0, disk: str = "off", **changes):
    """Two spheres with overlap u [m], bonded; the second is moved by the tests."""
    sim = model(folder, disk=disk)
    particles.ball(sim, 0, 0.0, 0.0, exact.RADIUS)
    particles.ball(sim, 1, 2.0 * exact.RADIUS - u, 0.0, exact.RADIUS)
    properties.prop(sim, shear=exact.SHEAR, poiss=exact.NU, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    keys = {"ebmod": exact.E, "gbmod": exact.G, "tstrength": exact.T, "sstrength": exact.C, "fric": exact.MU}
    assert bonds.bond(sim, **{**keys, **changes}) == 1
    steps(sim, 1)
    return sim


def shear(sim, way: float, n: int = 200) -> None:
    """Turn particle 1 so that the surfaces slide by `way` [m]; the geometry stays as it is. Fs grows by ks way."""
    carry(sim, 1, angle=-way / (exact.RADIUS - 0.5 * pair(sim).overlap), n=n)


@pytest.mark.smoke
def test_v19_pull(tmp_path):
    sim = bonded(tmp_path)
    carry(sim, 1, x=exact.GAP * (1.0 - 1e-6))
    assert exact.GAP == pytest.approx(12.0, rel=1e-12)
    last = pair(sim)
    assert last.fn == pytest.approx(-2.26195e11, rel=0.005) == -exact.STRENGTH * (1.0 - 1e-6)
    assert -last.fn / (value(sim, "x", 1) - 120.0) == pytest.approx(1.88496e10, rel=0.005)
    assert last.fn == pytest.approx(exact.STIFFNESS * last.overlap, rel=1e-12)
    assert force(sim, 0)[0] == -last.fn == -force(sim, 1)[0], "the bond pulls them together"
    assert sim.broken() == (0, 0) and sim.bonds_left() == 1
    carry(sim, 1, x=exact.GAP * 2e-6, n=1)
    assert pair(sim) is None and not force(sim, 0).any() and not force(sim, 1).any()
    assert sim.broken() == (1, 0) and sim.bonds_left() == 0


def test_a_broken_bond_does_not_heal(tmp_path):
    sim = bonded(tmp_path)
    carry(sim, 1, x=13.0)
    carry(sim, 1, x=-14.0)
    assert pair(sim).fn == pytest.approx(exact.normal_force(1.0), rel=1e-10), "an ordinary contact"
    carry(sim, 1, x=2.0)
    assert pair(sim) is None
    carry(sim, 1, x=-2.0)
    assert bonds.bond(sim, ebmod=exact.E, tstrength=exact.T, sstrength=exact.C) == 1, "a new command bonds it again"
    carry(sim, 1, x=4.0)
    assert pair(sim).fn == pytest.approx(-3.0 * exact.STIFFNESS, rel=1e-10)


def test_a_long_bond_is_not_lost_by_the_search(tmp_path):
    """Stretched to 270 m between centres, more than twice what touching spheres have; bystanders fill the plane
    between."""
    sim = bonded(tmp_path, tstrength=1e9)
    for gid, (x, y) in enumerate([(60.0, 250.0), (-150.0, 0.0), (420.0, 10.0), (150.0, -200.0)], start=2):
        particles.ball(sim, gid, x, y, exact.RADIUS)
    properties.fix(sim, ("x", "y", "spin"))
    rebuilds = sim.rebuilds
    seen = watch_pull(sim, 150.0, 300)
    assert sim.rebuilds > rebuilds + 5
    assert seen == pytest.approx(-exact.STIFFNESS * 0.5 * np.arange(301), abs=1e-6 * exact.STIFFNESS)


def watch_pull(sim, way: float, n: int) -> np.ndarray:
    """Normal force at each of n steps of a pull [N]."""
    properties.prop(sim, only(1), xv=way / (n * sim.settings.dt))
    return watch(sim, n, lambda sim: pair(sim).fn)


@pytest.mark.parametrize("disk", ["on", "hex"])
def test_bonds_between_disks_have_a_strip_as_cross_section(tmp_path, disk):
    sim = bonded(tmp_path, disk=disk)
    carry(sim, 1, x=exact.GAP * (1.0 - 1e-6))
    area = 2.0 * exact.RADIUS
    assert pair(sim).fn == pytest.approx(-exact.T * area, rel=2e-6)
    carry(sim, 1, x=exact.GAP * 2e-6, n=1)
    assert pair(sim) is None


def test_unlike_spheres(tmp_path):
    """Rt = 2 Ra Rb / (Ra + Rb), L = Ra + Rb."""
    sim = model(tmp_path, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 60.0)
    particles.ball(sim, 1, 140.0, 0.0, 80.0)
    properties.prop(sim, shear=exact.SHEAR, poiss=exact.NU, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    bonds.bond(sim, ebmod=exact.E, tstrength=exact.T, sstrength=exact.C)
    carry(sim, 1, x=1.0)
    rt = 2.0 * 60.0 * 80.0 / 140.0
    assert pair(sim).fn == pytest.approx(-exact.E * math.pi * rt**2 / 140.0, rel=1e-10)


@pytest.mark.some_of_each
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("u", [0.2, 1.0, 3.0])
def test_v20_shear_of_a_pressed_pair(tmp_path, u, sense):
    sim = bonded(tmp_path, u)
    fn, ks = exact.normal_force(u), exact.shear_stiffness(u)
    limit = 4.52389e11 + 0.3 * fn
    assert exact.C * exact.AREA + exact.MU * fn == pytest.approx(limit, rel=1e-5)
    way = sense * (exact.C * exact.AREA + exact.MU * fn) / ks
    shear(sim, way * (1.0 - 1e-6))
    held = pair(sim)
    assert sense * held.fs == pytest.approx(limit, rel=0.005) and sim.bonds_left() == 1
    assert held.fs == pytest.approx(ks * way * (1.0 - 1e-6), rel=1e-9)
    assert abs(held.fs) > exact.MU * held.fn, "no Coulomb slip while the bond holds"
    shear(sim, way * 2e-6, n=1)
    assert sim.broken() == (0, 1) and sim.bonds_left() == 0
    left = pair(sim)
    assert left.fn == pytest.approx(fn, rel=1e-10)
    assert sense * left.fs == pytest.approx(0.3 * fn, rel=0.005)
    assert abs(left.fs) == pytest.approx(exact.MU * fn, rel=1e-12)
    shear(sim, way * 0.1)
    assert pair(sim).fs == left.fs, "it slides"


@pytest.mark.parametrize("gap", [0.5, 6.0])
def test_v20_shear_of_an_open_pair(tmp_path, gap):
    sim = bonded(tmp_path)
    carry(sim, 1, x=gap)
    way = exact.C * exact.AREA / exact.shear_stiffness(-gap)
    shear(sim, way * (1.0 - 1e-6))
    assert pair(sim).fs == pytest.approx(exact.C * exact.AREA, rel=2e-6) and sim.bonds_left() == 1
    assert pair(sim).fn == pytest.approx(-exact.STIFFNESS * gap, rel=1e-10)
    shear(sim, way * 2e-6, n=1)
    assert pair(sim) is None and not force(sim, 0).any() and sim.broken() == (0, 1)


def test_v22_press_return_open(tmp_path):
    """Overlap 1 m -> 2 m -> -5 m -> 1 m, the second sphere turning all the time: Fn and Fs at every step."""
    sim = bonded(tmp_path, 1.0)
    spin = -0.02
    properties.prop(sim, only(1), spin=spin)
    fs, n_steps = 0.0, 0
    for u_from, u_to in ((1.0, 2.0), (2.0, -5.0), (-5.0, 1.0)):
        n = round(abs(u_to - u_from) / 0.01)
        properties.prop(sim, only(1), xv=(u_from - u_to) / (n * 1e-3))

        def look(sim):
            contact = pair(sim)
            return contact.fn, contact.fs, 120.0 - value(sim, "x", 1) + value(sim, "x", 0), contact.overlap

        fn_seen, fs_seen, u, reported = watch(sim, n, look)[1:].T
        assert reported == pytest.approx(u, abs=1e-12)
        scale = exact.normal_force(2.0)
        for k in range(n):
            assert fn_seen[k] == pytest.approx(exact.normal_force(u[k]), rel=1e-10, abs=1e-12 * scale)
            fs += exact.shear_stiffness(u[k]) * -spin * (60.0 - 0.5 * u[k]) * 1e-3
            assert fs_seen[k] == pytest.approx(fs, rel=1e-9)
        n_steps += n
    assert n_steps == 1400 and sim.bonds_left() == 1


def test_v22_the_law_is_continuous(tmp_path):
    """On either side of U = 0 the force is small, positive (pushing) or negative (pulling)."""
    sim = bonded(tmp_path, 1e-6)
    assert 0.0 < pair(sim).fn < 1e-7 * exact.K
    carry(sim, 1, x=2e-6, n=1)
    assert -1.1e-6 * exact.STIFFNESS < pair(sim).fn < 0.0


def test_break_command_leaves_an_ordinary_contact(tmp_path):
    sim = bonded(tmp_path, 1.0)
    shear(sim, 1.0)
    before = pair(sim)
    assert abs(before.fs) > exact.MU * before.fn
    assert bonds.break_bonds(sim) == 1 and sim.bonds_left() == 0
    steps(sim, 1)
    assert pair(sim).fs == pytest.approx(math.copysign(exact.MU * before.fn, before.fs), rel=1e-12)
    assert sim.broken() == (0, 0), "the counters are for bonds that failed"
    carry(sim, 1, x=1.5)
    assert pair(sim) is None


def test_a_broken_bond_leaves_no_trace_but_the_shear_force(tmp_path):
    """What a contact remembers is the same whether its bond broke before or after a restart."""
    sim = bonded(tmp_path, 1.0)
    shear(sim, 1.0)
    assert sim.lists.histories(sim.particles.ihot).extra.all(), "bonds remember the overlap they were made at"
    bonds.break_bonds(sim)
    steps(sim, 1)
    remembered = sim.lists.histories(sim.particles.ihot)
    assert remembered.counts().tolist() == [1, 1] and not remembered.extra.any()


def test_a_bond_made_across_a_gap_starts_in_tension(tmp_path):
    sim = model(tmp_path, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, exact.RADIUS)
    particles.ball(sim, 1, 123.0, 0.0, exact.RADIUS)
    particles.ball(sim, 2, 0.0, 123.5, exact.RADIUS)
    properties.prop(sim, shear=exact.SHEAR, poiss=exact.NU, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    keys = {"ebmod": exact.E, "tstrength": exact.T, "sstrength": exact.C}
    assert bonds.bond(sim, **keys) == 0, "the default tolerance is a micrometre"
    assert bonds.bond(sim, tolerate=3.2, **keys) == 1
    steps(sim, 1)
    assert pair(sim, 0, 1).fn == pytest.approx(-3.0 * exact.STIFFNESS, rel=1e-10)
    assert pair(sim, 0, 2) is None


class Warned(list):
    """A log that keeps warnings."""

    def warn(self, text: str) -> None:
        self.append(text)

    def info(self, text: str) -> None:
        pass

    def warn_once(self, key: str, text: str) -> None:
        pass


@pytest.mark.parametrize("disk", ["off", "on"])
@pytest.mark.parametrize("keys", [{"ebmod": 3e8, "tstrength": 2.1e7}, {"n_bond": 2e9}], ids=["elastic", "contact"])
def test_bonds_that_break_at_once_are_announced(tmp_path, keys, disk):
    """As many as then break, of like and unlike pairs; the widest gap that would hold is T/E (Ra + Rb), or N/kn; one
    that is a little narrower holds, and nothing is said if all do."""
    sim = model(tmp_path, disk=disk)
    sim.log = log = Warned()
    gaps = np.linspace(2.0, 14.0, 25)
    for k, gap in enumerate(gaps):
        radius = 40.0 + 20.0 * (k % 2)
        particles.ball(sim, 2 * k, 0.0, 1000.0 * k, 60.0)
        particles.ball(sim, 2 * k + 1, 60.0 + radius + gap, 1000.0 * k, radius)
    properties.prop(sim, density=1.0, kn=4e8, ks=1e8)
    properties.fix(sim, ("x", "y", "spin"))
    last = np.where(np.arange(25) % 2, 120.0, 100.0) * 0.07 if "ebmod" in keys else np.full(25, 10.0)
    breaks = int((gaps > last).sum())
    bonds.bond(sim, **keys, tolerate=20.0)
    assert len(log) == 1 and log[0].startswith(f"{breaks} of these bonds exceed their tensile limit")
    widest = float(log[0].split()[-2])
    assert widest == pytest.approx(last[gaps > last].max(), rel=1e-5)
    steps(sim, 1)
    assert sim.broken() == (breaks, 0) and 0 < breaks < 25
    again = bonds.bond(sim, **keys, tolerate=float(last.min()) - 1e-9)
    assert again == 0 and len(log) == 1


@pytest.mark.parametrize("keys, kn, number", [
    ({"tstrength": exact.T, "sstrength": exact.C}, 1e9, 1), ({"n_bond": 1e6}, 0.0, 1),
    ({"ebmod": exact.E, "tstrength": exact.T}, 1e9, 0), ({"n_bond": 1e6}, 1e9, 0),
])  # fmt: skip
def test_bonds_without_normal_stiffness_are_named_before_the_run(tmp_path, keys, kn, number):
    sim = model(tmp_path)
    said = io.StringIO()
    sim.log = Log(stream=said)
    for gid in range(2):
        particles.ball(sim, gid, 2.0 * gid, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=kn, ks=1e9)
    bonds.bond(sim, **keys)
    cycles.cycle(sim, 1)
    text = "bonds have no normal stiffness, for example that of particles 0 and 1"
    assert (f"{number} {text}" in " ".join(said.getvalue().split())) == bool(number)
