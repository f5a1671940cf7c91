"""Laws of pairs of discs in files of users: what they are given and return, what contacts remember, what is refused."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, history, particles, properties, settings
from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Group, Ids
from hpcdem.physics.dem import diagnostics
from tests import support

HERE = Path(__file__).resolve().parent
LINEAR, STICKY, UNTOLD = "pairs.py:linear", "pairs.py:sticky", "pairs.py:untold"


def two(tmp_path, speed=0.0, spin=0.0, apart=0.98, **given):
    """Two discs of radius 0.5 m that overlap by 20 mm unless `apart` says else; the left one moves to the right."""
    sim = support.model(tmp_path, dt=1e-4, disk="off")
    for gid in range(2):
        particles.ball(sim, gid, apart * gid, 0.0, 0.5)
    properties.prop(sim, density=1000.0, kn=2e5, ks=1e5, fric=0.5, folder=HERE, **given)
    sim.particles["vx"][sim.particles["gid"] == 0] = speed
    sim.particles["spin"][:] = spin
    properties.fix(sim, ("x", "y", "spin"))
    return sim


def force(sim):
    """On the right one (fx, fy, torque)."""
    return sim.lists.owned_forces()[sim.particles["gid"] == 1][0]


def memory(sim):
    """State variables of the only contact; None if nothing is remembered."""
    hist = sim.lists.histories(sim.particles.ihot, float(sim.stamp))
    return hist.memory[0, 1:].tolist() if len(hist.rows) else None


@pytest.mark.slow
def test_a_heap_with_the_linear_law_has_the_bits_of_the_built_in_one(tmp_path):
    """Wherever discs lie, slide and part; with one thread and with three."""
    found = []
    for law, threads in ((None, 1), (LINEAR, 1), (LINEAR, 3)):
        sim = heap(tmp_path, threads, law=law)
        support.steps(sim, 200)
        order = np.argsort(sim.particles["gid"])
        hist = sim.lists.histories(sim.particles.ihot, float(sim.stamp))
        found.append((sim.particles.hot[sim.particles.n_left :][: len(order)][order].copy(), np.sort(hist.fs)))
    for hot, fs in found[1:]:
        assert hot.tobytes() == found[0][0].tobytes() and np.array_equal(fs[fs != 0.0], found[0][1][found[0][1] != 0.0])
    assert (found[0][1] != 0.0).sum() > 300


def test_pairs_with_other_laws_beside_it(tmp_path):
    """Two materials with the law, and one apart that has the linear one: each pair has its own."""
    sim = support.model(tmp_path, dt=1e-4, disk="off")
    for gid in range(4):
        particles.ball(sim, gid, 0.98 * (gid % 2) + 5.0 * (gid // 2), 0.0, 0.5)
    properties.prop(sim, density=1000.0, kn=2e5, ks=1e5, fric=0.5)
    far = Ids(2, 3)
    properties.prop(sim, far, law=STICKY, parameter={"pull": 1e9}, folder=HERE)
    properties.fix(sim, ("x", "y", "spin"))
    support.steps(sim, 1)
    fx = dict(zip(sim.particles["gid"].tolist(), sim.lists.owned_forces()[:, 0].tolist()))
    assert fx[1] == pytest.approx(2000.0) and fx[3] == pytest.approx(2000.0)
    sim.particles["vx"][sim.particles["gid"] % 2 == 1] = 1.0  # by 5 mm apart
    support.steps(sim, 50)
    fx = dict(zip(sim.particles["gid"].tolist(), sim.lists.owned_forces()[:, 0].tolist()))
    assert fx[1] == pytest.approx(1500.0, rel=1e-6) and fx[3] == pytest.approx(1000.0, rel=1e-3)


HEAP = {"density": 1000.0, "kn": 1e5, "ks": 8e4, "fric": 0.4, "damp": 0.3}


def heap(tmp_path, threads=1, **given):
    """300 discs that fall apart and against each other; half of them are group 1."""
    sim = support.model(tmp_path, dt=2e-4, disk="off")
    sim.threads = threads
    rng = np.random.default_rng(5)
    for gid, (x, y) in enumerate(rng.uniform(0.0, 12.0, (300, 2)).tolist()):
        particles.ball(sim, gid, x, y, 0.3 + 0.2 * rng.random())
    properties.prop(sim, **HEAP, **given, folder=HERE)
    properties.prop(sim, Ids(0, 149), group="one")
    return sim


def bits(sim):
    order = np.argsort(sim.particles["gid"])
    return sim.particles.hot[sim.particles.n_left :][: len(order)][order][:, :6].tobytes()


def test_two_laws_with_the_arithmetic_of_the_built_in_one_have_its_bits(tmp_path):
    """Of two files, and where they meet the built-in one, or one of them."""
    shutil.copy(HERE / "pairs.py", tmp_path / "own.py")
    plain = heap(tmp_path)
    support.steps(plain, 200)
    for meet in ("linear", LINEAR):
        sim = heap(tmp_path)
        properties.prop(sim, law="own.py:linear", folder=tmp_path)
        properties.prop(sim, Group("one"), law=LINEAR, folder=HERE)
        properties.prop(sim, law=meet, between=(LINEAR, "own.py:linear"), folder=HERE)
        support.steps(sim, 200)
        assert bits(sim) == bits(plain)


def test_what_discs_of_two_laws_do(tmp_path):
    """Each two alike follow their law with properties of their own; those that meet the law that is said for them,
    with the properties that are said; until then they have none in common."""
    sim = support.model(tmp_path, dt=1e-4, disk="off")
    for gid in range(8):
        particles.ball(sim, gid, 0.98 * (gid % 2) + 5.0 * (gid // 2), 0.0, 0.5)
    properties.prop(sim, density=1000.0, kn=2e5, ks=1e5, fric=0.5)
    shutil.copy(HERE / "pairs.py", tmp_path / "own.py")
    for of in (Ids(0, 1), Ids(4, 4)):
        properties.prop(sim, of, law=STICKY, parameter={"pull": 500.0}, folder=HERE)
    for of in (Ids(2, 3), Ids(5, 6)):
        properties.prop(sim, of, law="own.py:sticky", parameter={"pull": 300.0, "stiffening": 3.0}, folder=tmp_path)
    with pytest.raises(CommandError, match=r"have several laws, pairs\.py:sticky, own\.py:sticky; select the"):
        properties.prop(sim, Ids(0, 5), parameter={"pull": 2.0})
    properties.fix(sim, ("x", "y", "spin"))
    with pytest.raises(CommandError, match=r"4 and 5 are in contact, .* the law pairs.py:sticky and the other own.py"):
        cycles.cycle(sim, 1)
    properties.prop(
        sim, law=STICKY, between=("own.py:sticky", STICKY), parameter={"pull": 100.0, "stiffening": 4.0}, folder=HERE
    )
    with pytest.raises(CommandError, match=r"6 and 7 are in contact, .* the law own.py:sticky and the other linear"):
        cycles.cycle(sim, 1)
    properties.prop(sim, law="linear", between=("own.py:sticky", "linear"))
    cycles.cycle(sim, 1)
    sim.particles["vx"][sim.particles["gid"] % 2 == 1] = 1.0
    support.steps(sim, 50)  # by 5 mm apart
    fx = dict(zip(sim.particles["gid"].tolist(), sim.lists.owned_forces()[:, 0].tolist()))
    wanted = {1: 2000.0 - 2 * 500.0, 3: 2000.0 - 3 * 500.0, 5: 2000.0 - 4 * 500.0, 7: 1500.0}
    assert [fx[k] for k in wanted] == pytest.approx(list(wanted.values()), abs=1.0)
    support.steps(sim, 100)
    fx = dict(zip(sim.particles["gid"].tolist(), sim.lists.owned_forces()[:, 0].tolist()))
    wanted = {1: -500.0, 3: -300.0, 5: -100.0, 7: 500.0}
    assert [fx[k] for k in wanted] == pytest.approx(list(wanted.values()), abs=1.0)


def test_a_contact_that_gets_another_law_has_forgotten(tmp_path):
    shutil.copy(HERE / "pairs.py", tmp_path / "own.py")
    sim = two(tmp_path, law=STICKY, parameter={"pull": 1e9})
    support.steps(sim, 10)
    assert memory(sim) == pytest.approx([0.02, 1.001])
    properties.prop(sim, law="own.py:sticky", parameter={"pull": 1e9}, folder=tmp_path)
    support.steps(sim, 3)
    assert memory(sim) == pytest.approx([0.02, 1.0003])
    properties.prop(sim, law=STICKY, parameter={"pull": 1e9}, folder=HERE)
    support.steps(sim, 2)
    assert memory(sim) == pytest.approx([0.02, 1.0002])


def test_between_refuses_what_makes_no_sense(tmp_path):
    sim = two(tmp_path, law=LINEAR)
    for given, said in (
        ({"law": LINEAR, "between": (LINEAR, LINEAR)}, "both are pairs.py:linear"),
        (
            {"law": LINEAR, "between": (LINEAR, STICKY)},
            "no disc has the law pairs.py:sticky; available:",
        ),
        ({"law": STICKY, "between": (LINEAR, "linear")}, "needs pull"),
        (
            {"law": "linear", "between": (LINEAR, "linear"), "parameter": {"pull": 1.0}},
            "parameter applies to a user law",
        ),
        ({"law": LINEAR, "between": (LINEAR, "linear"), "kn": 1.0}, "between accepts only a law and its parameter"),
        ({"between": (LINEAR, "linear")}, "between accepts only a law and its parameter"),
    ):
        with pytest.raises(CommandError, match=said):
            properties.prop(sim, folder=HERE, **given)


def test_the_account_of_the_linear_law_is_that_of_the_built_in_one(tmp_path):
    """What it loses is what slips, and what was strained where contacts open; both close alike."""
    found = []
    for law in (None, LINEAR):
        sim = heap(tmp_path, law=law)
        properties.prop(sim, damp=0.0)
        settings.set_option(sim, "energy", 50)
        cycles.cycle(sim, 300)
        found.append(sim.energy.evaluate(sim))
    plain, own = found
    for name in ("kinetic_translation", "elastic_normal", "elastic_shear"):
        assert getattr(own, name) == pytest.approx(getattr(plain, name), rel=1e-12), name
    assert plain.loss_laws == own.loss_friction == own.loss_opened == 0.0 < plain.loss_friction
    assert own.loss_laws == pytest.approx(plain.loss_friction + plain.loss_opened, rel=1e-9)
    assert own.closing == pytest.approx(plain.closing, abs=1e-9 * own.loss_laws)
    assert abs(own.closing) < 1e-3 * plain.kinetic_translation


def test_the_account_of_a_law_that_unloads_along_another_line(tmp_path):
    """Two discs that meet with 2 m/s: loading up to the overlap m stores and loses k m^2 / 2 together; of it k m^2 / (2
    s) comes back, as their speed, and the rest is lost: their speed after it is sqrt(1 / s) of that before."""
    sim = support.model(tmp_path, dt=1e-5, disk="off")
    for gid in range(2):
        particles.ball(sim, gid, 1.001 * gid, 0.0, 0.5)
    given = {"density": 1000.0, "kn": 2e6, "ks": 1e6, "fric": 0.0, "law": STICKY}
    properties.prop(sim, **given, parameter={"pull": 0.0, "stiffening": 4.0}, folder=HERE)
    sim.particles["vx"][:] = np.where(sim.particles["gid"] == 0, 1.0, -1.0)
    settings.set_option(sim, "energy", 100)
    cycles.cycle(sim, 50)
    before = sim.energy.evaluate(sim).kinetic_translation
    cycles.cycle(sim, 10000)
    seen = sim.energy.evaluate(sim)
    assert seen.elastic_normal == 0.0 and seen.kinetic_translation == pytest.approx(before / 4.0, rel=1e-3)
    assert seen.loss_laws == pytest.approx(0.75 * before, rel=1e-3)
    assert abs(seen.closing) < 1e-3 * before


def test_what_a_law_is_given(tmp_path):
    """Stiffness 1e5 of both in series; unloading is twice as stiff, down to -pull; a dashpot sees dt and 2 Rt."""
    sim = two(tmp_path, law=STICKY, parameter={"pull": 800.0})
    support.steps(sim, 1)
    assert force(sim)[0] == pytest.approx(1e5 * 0.02)
    assert memory(sim) == pytest.approx([0.02, 1.0 + 1e-4])
    sim.particles["vx"][sim.particles["gid"] == 0] = -1.0
    support.steps(sim, 50)  # 5 mm back
    dashpot = 1e-3 * 1e5 * 1e-4 * -1.0 / 1.0
    assert force(sim)[0] == pytest.approx(1e5 * 0.02 - 2e5 * 0.005 + dashpot)
    support.steps(sim, 100)
    assert force(sim)[0] == pytest.approx(-800.0 + dashpot)
    assert memory(sim) == pytest.approx([0.02, 1.0 + 151e-4])


def test_shear_and_friction(tmp_path):
    """Both turn alike: ks dt (w Ra + w Rb) per step, up to the law's limit."""
    sim = two(tmp_path, spin=0.1, law=STICKY, parameter={"pull": 0.0})
    support.steps(sim, 10)
    assert abs(force(sim)[1]) == pytest.approx(10 * 5e4 * 0.1 * 2 * 0.49 * 1e-4)
    sim.particles["spin"][:] = 100.0
    support.steps(sim, 20)
    assert abs(force(sim)[1]) == pytest.approx(0.5 * 1e5 * 0.02)


def test_a_contact_that_begins_again_has_forgotten(tmp_path):
    sim = two(tmp_path, law=STICKY, parameter={"pull": 1e9})
    support.steps(sim, 10)
    assert memory(sim) == pytest.approx([0.02, 1.001])
    left = sim.particles["gid"] == 0
    sim.particles["x"][left] -= 0.021
    support.steps(sim, 1)
    assert memory(sim) is None and force(sim)[0] == 0.0
    sim.particles["x"][left] += 0.011
    support.steps(sim, 1)
    assert memory(sim) == pytest.approx([0.01, 1.0001]) and force(sim)[0] == pytest.approx(1e5 * 0.01)


def test_properties_are_mixed_as_the_law_says(tmp_path):
    """kn in series, the least pull, the greatest stiffening; a change acts from the next step."""
    sim = two(tmp_path, law=STICKY, parameter={"pull": 800.0})
    properties.prop(sim, Ids(1, 1), kn=6e5, parameter={"pull": 100.0, "stiffening": 10.0})
    support.steps(sim, 1)
    assert force(sim)[0] == pytest.approx(1.5e5 * 0.02)
    sim.particles["vx"][sim.particles["gid"] == 0] = -1.0
    support.steps(sim, 10)
    assert force(sim)[0] == pytest.approx(1.5e5 * 0.02 - 1.5e6 * 0.001, rel=1e-3)
    support.steps(sim, 60)
    assert force(sim)[0] == pytest.approx(-100.0, abs=0.1)
    properties.prop(sim, law="linear")
    support.steps(sim, 1)
    assert force(sim)[0] == pytest.approx(1.5e5 * (0.02 - 0.0071), rel=1e-2)


def test_the_time_step_follows_its_stiffness(tmp_path):
    plain, stiff = two(tmp_path, law=LINEAR), two(tmp_path, law=STICKY, parameter={"pull": 1.0, "stiffening": 9.0})
    for sim in (plain, stiff):
        support.steps(sim, 1)
    properties.free(plain, ("x",)), properties.free(stiff, ("x",))
    assert diagnostics.critical_dt(plain) == pytest.approx(3.0 * diagnostics.critical_dt(stiff))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def soft(u, fs):\n    return u, fs\n", r"law.py:3: 'soft' is not declared as a law: write @pair_law\(\)"),
        ("@pair_law()\ndef soft(u):\n    return u, 0.0\n", "law.py:3: the law does not accept fs"),
        ("@pair_law()\ndef soft(u, fs, e11):\n    return u, fs\n", "law.py:3: 'e11' is not an argument of a law"),
        ("@pair_law()\ndef soft(u, fs):\n    return u\n", r"law.py:3: the law must return 2 numbers \(fn, fs\)"),
        ("@pair_law()\ndef soft(u, fs):\n    return 1, fs\n", "law.py:3: the law must return fn as a float"),
        ("@pair_law()\ndef soft(u, fs):\n    return u.what, fs\n", "law.py:5: numba"),
        ("@element_law()\ndef soft(e11, e22, e12):\n    return e11\n", "law.py:3: 'soft' is not declared as a law"),
        ("@pair_law(properties=[Property('a', 'N', '')])\ndef soft(u, fs, a):\n    return u, fs\n",
         r"law.py:3: a property is declared by PairProperty"),
        ("@pair_law(properties=[PairProperty('a', 'N', mix='max')])\ndef soft(u, fs, a):\n    return u, fs\n",
         "law.py:3: property 'a': mix is 'max', expected mean, series, least, greatest"),
        ("@pair_law(properties=[PairProperty('a', 'N')])\ndef soft(u, fs):\n    return u, fs\n",
         "law.py:3: property 'a' is declared, but neither"),
        ("@pair_law()\ndef hard(u, fs):\n    return u, fs\n", "law.py: there is no law 'soft' in it; available: hard"),
        ("@pair_law(\n", "law.py:3: "),
        ("def kept(u, dt):\n    return u, 0.0\n\n@pair_law(energy=kept)\ndef soft(u, fs):\n    return u, fs\n",
         "law.py:3: 'dt' is not an argument of an energy function; available: u, fs, two_rt, kn"),
        ("def kept(u):\n    return u\n\n@pair_law(energy=kept)\ndef soft(u, fs):\n    return u, fs\n",
         r"law.py:3: the energy must return 2 numbers \(normal, shear\)"),
        ("@pair_law(energy=1.0)\ndef soft(u, fs):\n    return u, fs\n", "law.py:3: energy must be a function, got 1.0"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file_is_reported_with_its_line(tmp_path, text, said):
    (tmp_path / "law.py").write_text("from hpcdem import PairProperty, Property, element_law, pair_law\n\n" + text)
    sim = support.model(tmp_path, dt=1e-4, disk="off")
    with pytest.raises(CommandError, match=said):
        properties.prop(sim, law="law.py:soft", folder=tmp_path)


def test_what_makes_no_sense_is_refused(tmp_path):
    sim = two(tmp_path)
    for given, said in (
        ({"law": STICKY}, "needs pull"),
        ({"law": STICKY, "parameter": {"pull": -1.0}}, "pull is -1, expected a number from 0"),
        ({"law": STICKY, "parameter": {"pull": 1.0, "push": 1.0}}, "has no property 'push'; it has pull, stiffening"),
        ({"law": "linear", "parameter": {"pull": 1.0}}, "applies to a user law"),
        ({"parameter": {"pull": 1.0}}, "some particles have no user law"),
        ({"law": "pairs.py"}, "is named 'file.py:function'"),
        ({"law": "none.py:linear"}, "none.py cannot be read"),
    ):
        with pytest.raises(CommandError, match=said):
            properties.prop(sim, folder=HERE, **given)
    bonds.bond(sim, n_bond=1.0, s_bond=1.0)
    with pytest.raises(CommandError, match="a user law does not support bonds"):
        properties.prop(sim, law=LINEAR, folder=HERE)
    sim = two(tmp_path, law=LINEAR)
    with pytest.raises(CommandError, match=r"bonds are not supported with the user law pairs\.py:linear"):
        bonds.bond(sim, n_bond=1.0, s_bond=1.0)


def test_energy_is_refused_by_name_where_a_law_does_not_define_it(tmp_path):
    sim = two(tmp_path, law=LINEAR)
    settings.set_option(sim, "energy", 10)
    history.hist(sim, 1, 10, "energy")
    with pytest.raises(CommandError, match=r"SET energy: the stored energy of the law pairs\.py:untold is not known"):
        properties.prop(sim, law=UNTOLD, folder=HERE)
    settings.set_option(sim, "energy", 0)
    with pytest.raises(CommandError, match=r"HIST energy: the stored energy of the law pairs\.py:untold is not known"):
        properties.prop(sim, law=UNTOLD, folder=HERE)
    sim = two(tmp_path, law=UNTOLD)
    with pytest.raises(CommandError, match=r"SET energy: the stored energy of the law pairs\.py:untold is not known"):
        settings.set_option(sim, "energy", 10)
    with pytest.raises(CommandError, match=r"^energy: the stored energy of the law pairs\.py:untold is not known"):
        history.hist(sim, 1, 10, "energy")


def test_a_law_that_is_stiffer_than_it_says_is_refused(tmp_path):
    (tmp_path / "law.py").write_text(
        "from hpcdem import pair_law\n\n@pair_law()\ndef hard(u, fs, kn):\n    return 2.0 * kn * u, fs\n\n"
        "@pair_law()\ndef lost(u, fs, kn, two_rt):\n    return kn * (u - 1.0) / u, fs\n"
    )
    for law, said in (
        ("hard", "law.py:3: law 'hard': dFn/du is 200000 N/m where discs begin to touch, with kn 100000, above its"),
        ("lost", "law.py:7: law 'lost' gives fn -inf"),
    ):
        sim = support.model(tmp_path, dt=1e-4, disk="off")
        particles.ball(sim, 0, 0.0, 0.0, 0.5)
        properties.prop(sim, density=1.0, kn=2e5, law=f"law.py:{law}", folder=tmp_path)
        with pytest.raises(CommandError, match=said):
            cycles.cycle(sim, 1)


def test_mixed_pairs_stop_the_run(tmp_path):
    """A law of the user beside a built-in one: such discs have no common law when they meet, unless one is said."""
    sim = two(tmp_path)
    properties.prop(sim, Ids(1, 1), law=LINEAR, folder=HERE)
    with pytest.raises(Exception, match="law"):
        support.steps(sim, 70)


def test_the_file_can_lie_anywhere(tmp_path):
    shutil.copy(HERE / "pairs.py", tmp_path / "own.py")
    sim = support.model(tmp_path, dt=1e-4, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 0.5)
    properties.prop(sim, law="own.py:linear", folder=tmp_path)
    assert sim.own_laws.titles == "own.py:linear" and math.isclose(sim.stamp, 1)
