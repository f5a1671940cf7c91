"""Properties that differ from place to place: random fields, tables over coordinates, numbers one by one."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.numerics import rng
from hpcdem.numerics.random_field import GAUSSIAN, LOGNORMAL, NORMAL, WEIBULL, RandomField
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import Drawn, Over
from tests.blocks.support import JOINT, ROCK, model, rectangle
from tests.tables import each

COHESIVE, CONTACT, ELASTIC = "classic_intrinsic_cohesive_interface", "contact_mohr_coulomb", "mech_iso_elastic"
N = 200_000


def sample(**about) -> np.ndarray:
    return RandomField.of(**about).values("element", np.arange(N), np.zeros((N, 2)))


def test_arrays_of_random_numbers_are_the_scalar_ones():
    counters = np.array([0, 1, 2, 77, 10**9, 2**40])
    for seed, stream in ((0, 1), (7, 3), (2**52 - 1, 6)):
        assert rng.uniforms(seed, stream, counters).tolist() == [
            rng.uniform(seed, stream, c) for c in counters.tolist()
        ]


@pytest.mark.parametrize(("scale", "shape"), [(5e6, 4.0), (12.0, 1.3)])
def test_weibull(scale, shape):
    """Mean, scale and shape: moments by the gamma function; F(scale) = 1 - 1/e; the slope of the Weibull plot."""
    x = sample(distribution=WEIBULL, first=scale, second=shape, seed=11)
    mean = scale * math.gamma(1 + 1 / shape)
    variance = scale**2 * (math.gamma(1 + 2 / shape) - math.gamma(1 + 1 / shape) ** 2)
    assert x.mean() == pytest.approx(mean, abs=4 * math.sqrt(variance / N))
    assert x.var() == pytest.approx(variance, rel=0.02)
    assert (x <= scale).mean() == pytest.approx(1 - math.exp(-1), abs=4 * 0.5 / math.sqrt(N))
    ordered = np.sort(x)
    p = (np.arange(N) + 0.5) / N
    inner = (p > 0.01) & (p < 0.99)
    slope, start = np.polyfit(np.log(ordered[inner]), np.log(-np.log1p(-p[inner])), 1)
    assert slope == pytest.approx(shape, rel=0.01) and math.exp(-start / slope) == pytest.approx(scale, rel=0.005)


@pytest.mark.parametrize(("distribution", "mean", "spread"), [(NORMAL, -3.0, 2.0), (LOGNORMAL, 40e9, 12e9)])
def test_normal_and_lognormal_have_the_mean_and_deviation_they_say(distribution, mean, spread):
    x = sample(distribution=distribution, first=mean, second=spread, seed=5)
    assert x.mean() == pytest.approx(mean, abs=5 * spread / math.sqrt(N)) and x.std() == pytest.approx(spread, rel=0.02)
    y = np.log(x) if distribution == LOGNORMAL else x
    z = (y - y.mean()) / y.std()
    assert abs((z**3).mean()) < 0.03 and (z**4).mean() == pytest.approx(3.0, abs=0.06)


def test_a_cut_distribution_keeps_its_form_between_the_bounds():
    x = sample(distribution=NORMAL, first=0.0, second=1.0, seed=2, least=-0.5, greatest=2.0)
    assert x.min() >= -0.5 and x.max() <= 2.0
    phi = lambda v: 0.5 * math.erfc(-v / math.sqrt(2))  # noqa: E731
    for v in (-0.2, 0.3, 1.1):
        assert (x < v).mean() == pytest.approx((phi(v) - phi(-0.5)) / (phi(2.0) - phi(-0.5)), abs=0.005)


def test_seeds_and_kinds_are_independent():
    f = RandomField.of(WEIBULL, 1.0, 2.0, 3)
    at, nowhere = np.arange(5000), np.zeros((5000, 2))
    base = f.values("element", at, nowhere)
    for other in (f.values("face-joint", at, nowhere), f.values("element-face", at, nowhere),
                  RandomField.of(WEIBULL, 1.0, 2.0, 4).values("element", at, nowhere)):  # fmt: skip
        assert abs(np.corrcoef(base, other)[0, 1]) < 0.06
    some = np.array([4, 900, 17])
    assert f.values("element", some, nowhere[:3]).tolist() == base[some].tolist()  # whoever else is asked for


@pytest.mark.parametrize(("seeds", "near"), [(8, 0.1), pytest.param(40, 0.035, marks=pytest.mark.slow)])
@pytest.mark.parametrize("covariance", [pytest.param("exponential", marks=pytest.mark.slow), "gaussian"])
def test_the_variogram_of_a_correlated_field(covariance, seeds, near):
    """gamma(h) = 1 - C(h), over many seeds; along x, along y and across."""
    length = 0.4
    form = (lambda h: math.exp(-h / length)) if covariance == "exponential" else (
        lambda h: math.exp(-((h / length) ** 2)))  # fmt: skip
    at = np.random.default_rng(0).uniform(0, 10, (400, 2))
    lags = (0.05, 0.2, 0.4, 0.8)
    for way in ((1.0, 0.0), (0.0, 1.0), (0.6, 0.8)):
        found = np.zeros(len(lags))
        for seed in range(seeds):
            f = RandomField.of(NORMAL, 0.0, 1.0, seed, length, covariance)
            here = f.gaussian(at)
            found += [0.5 * ((f.gaussian(at + h * np.array(way)) - here) ** 2).mean() for h in lags]
        assert found / seeds == pytest.approx([1 - form(h) for h in lags], abs=near)


def test_a_correlated_field_has_the_distribution_too():
    """Weibull quantiles of places far apart, and of one realisation of a wide field."""
    f = RandomField.of(WEIBULL, 3.0, 2.5, 9, 0.05)
    x = f.values("element", np.arange(20000), np.random.default_rng(1).uniform(0, 50, (20000, 2)))
    assert x.mean() == pytest.approx(3.0 * math.gamma(1.4), rel=0.02)
    assert (x <= 3.0).mean() == pytest.approx(1 - math.exp(-1), abs=0.015)
    assert np.quantile(x, 0.01) == pytest.approx(3.0 * (-math.log(0.99)) ** 0.4, rel=0.1)


def test_a_correlated_field_is_one_of_places():
    """The same on another mesh, for elements and joints, and whoever is asked for besides."""
    f = RandomField.of(LOGNORMAL, 5.0, 2.0, 1, 0.3, GAUSSIAN)
    at = np.random.default_rng(2).uniform(0, 1, (9000, 2))
    whole = f.values("element", np.arange(9000), at)
    assert f.values("face-joint", np.arange(3), at[[8000, 5, 4096]]).tolist() == whole[[8000, 5, 4096]].tolist()


@pytest.mark.parametrize(
    ("about", "message"),
    [(("weibull", 1.0, 0.0, 1), "shape of a Weibull"), (("weibull", -1.0, 2.0, 1), "must be positive"),
     (("lognormal", 0.0, 1.0, 1), "mean of a lognormal"), (("normal", 0.0, -1.0, 1), "must be positive"),
     (("normal", math.nan, 1.0, 1), "finite"), (("normal", 0.0, 1.0, 1, -1.0), "length"),
     (("beta", 0.0, 1.0, 1), "unknown random field beta"), (("normal", 0.0, 1.0, -1), "seed"),
     (("normal", 0.0, 1.0, 1, 0.0, "exponential", 40.0, 50.0), "no value of normal"),
     (("normal", 0.0, 1.0, 1, 0.0, "exponential", 2.0, 1.0), "no value of normal")],
)  # fmt: skip
def test_what_is_no_field_is_refused(about, message):
    with pytest.raises(CommandError, match=message):
        RandomField.of(*about)


# ---- properties ----------------------------------------------------------------------------------------------------


def rock() -> Blocks:
    sim = model(rectangle(6, 4, 6.0, 4.0))
    sim.joint_model(None, COHESIVE, JOINT)
    sim.face_model(None, CONTACT, {"friction": 20.0, "penalty_normal": 1e11})
    sim.random_field("f", RandomField.of(LOGNORMAL, 1.0, 0.3, 8))
    sim.table("t", [(0.0, 1.0), (4.0, 3.0)])
    return sim


OBJECTS = [
    ("element", ELASTIC, ROCK, name, low)
    for name, low in (("density", 1e3), ("young", 1e9), ("poisson_ratio", 0.05), ("damp_factor", 0.1),
                      ("friction", 10.0), ("penalty", 1e10))
] + [
    ("joint", COHESIVE, JOINT, name, low)
    for name, low in (("friction", 10.0), ("cohesion", 1e6), ("tensile_strength", 1e6), ("gf1", 10.0), ("gf2", 10.0),
                      ("penalty_normal", 1e11), ("penalty_overlay", 1e11), ("penalty_shear", 1e11))
] + [
    ("face", CONTACT, {"penalty_normal": 1e11}, name, low)
    for name, low in (("friction", 10.0), ("penalty_normal", 1e11), ("penalty_shear", 1e11), ("damping_t", 1e6),
                      ("damping_b", 2.0))
]  # fmt: skip


@each("way", ["property", "model"])
@each(("on", "name", "given", "one", "unit"), OBJECTS, ids=[f"{o[0]} {o[3]}" for o in OBJECTS])
def test_every_property_of_everything_takes_fields_tables_and_numbers(on, name, given, one, unit, way):
    """One mechanism: what each object gets is the value of the rule at its place."""
    sim = rock()
    numbers = {"element": sim.numbers_of_elements, "joint": sim.numbers_of_joints, "face": sim.numbers_of_faces}[on](
        None
    )
    kind = {"element": "element", "joint": "face-joint", "face": "element-face"}[on]
    places = sim._places(kind, numbers)
    sim.table("t", [(0.0, unit), (4.0, 3 * unit)])
    sim.random_field("f", RandomField.of(LOGNORMAL, 2 * unit, 0.3 * unit, 8, least=unit, greatest=4 * unit))
    rows, column = getattr(sim, f"{on}_rows"), getattr(sim, f"{on}_row")
    wanted = {
        "table": (Over("t", 1), np.interp(places[:, 1], [0, 4], [unit, 3 * unit])),
        "field": (Drawn("f"), sim.fields["f"].values(kind, numbers, places)),
        "numbers": (unit * (1 + numbers / numbers.max()), unit * (1 + numbers / numbers.max())),
    }
    for rule, values in wanted.values():
        if way == "property":
            getattr(sim, f"{on}_property")(None, {one: rule})
        else:
            base = {k: v for k, v in given.items() if k != one}
            assign = partial(changes.element_model, sim) if on == "element" else getattr(sim, f"{on}_model")
            assign(None, name, {**base, one: rule})
        assert np.array_equal(rows.column(one)[column[numbers]], values)
        if on == "joint":
            assert np.array_equal(column[sim.partner[numbers]], column[numbers])
        if on == "element" and one == "young":  # what follows from it is made again, per element
            nu = rows.column("poisson_ratio")[column[numbers]]
            assert rows.column("shear")[column[numbers]] == pytest.approx(values / (2 * (1 + nu)), rel=1e-14)
    sim.step()


def test_stiffness_over_a_coordinate():
    """Young's modulus linear over y, without lateral strain, pressed: 1/E' is added up layer by layer."""
    sim = model(rectangle(2, 8, 1.0, 4.0, kind="quad"))
    sim.table("E", [(0.0, 10e9), (4.0, 40e9)])
    sim.element_property(None, {"young": Over("E", 1), "poisson_ratio": 0.0})
    sim.option(dynamic=False, collision=False)
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 4 - 1e-9), vy=-1e-4)
    equilibrium.solve_elastic(sim)
    centres = 0.25 + 0.5 * np.arange(8)
    young = np.interp(centres, [0, 4], [10e9, 40e9])
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-1e-4 / (0.5 / young).sum(), rel=1e-4)
    assert np.unique(diagnostics.values(sim, "young")).tolist() == young.tolist()


def test_the_weakest_joint_breaks_first():
    """Tensile strength alone is a field: of a bar that is stretched evenly the weakest section goes."""
    sim = model(rectangle(12, 1, 12.0, 1.0, kind="quad"))
    upright = np.array([j for j in sim.numbers_of_joints(None)
                        if np.ptp(sim.mesh.points[_ends(sim, j)][:, 0]) < 1e-9])  # fmt: skip
    sim.joint_model(upright, COHESIVE, {**JOINT, "gf1": 5.0, "gf2": 1e4, "cohesion": 1e9})
    sim.random_field("strength", RandomField.of(WEIBULL, 2e6, 6.0, 21))
    sim.joint_property(upright, {"tensile_strength": Drawn("strength")})
    strength = diagnostics.values(sim, "tensile_strength", upright)
    assert len(np.unique(strength)) == len(upright) == 11
    sim.option(dynamic=False)
    x = sim.mesh.points[:, 0]
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(x > 12 - 1e-9), vx=2e-7)
    while not diagnostics.joint_counts(sim)[2]:
        convergence.advance(sim, 200)
    assert diagnostics.events(sim)["joint"].tolist() == [int(upright[np.argmin(strength)])]


def _ends(sim: Blocks, joint: int) -> np.ndarray:
    e, k = divmod(joint, 4)
    n = 4 if sim.mesh.cells[e, 3] >= 0 else 3
    return sim.mesh.cells[e, [k, (k + 1) % n]]


@pytest.mark.parametrize(
    ("call", "message"),
    [(lambda s: s.element_property(None, {"young": Drawn("none")}), r"young: there is no field 'none' \(fields: 'f'\)"),
     (lambda s: s.element_property(None, {"young": Over("none", 0)}), r"young: there is no table 'none'"),
     (lambda s: s.element_property(None, {"young": np.ones(3)}), "young: 48 numbers are needed, one for each element"),
     (lambda s: s.element_property([7, 9], {"density": np.array([1.0, -2.0])}), "element 9: density must be > 0"),
     (lambda s: s.joint_property(None, {"tensile_strength": Over("low", 0)}), r"face-joint \d+: tensile_strength must"),
     (lambda s: changes.element_model(s, None, ELASTIC, {"density": Drawn("f")}), "element 0: an elastic model needs"),
     (lambda s: s.remove_field("g"), "there is no field 'g'")],
)  # fmt: skip
def test_what_cannot_be_is_refused_and_changes_nothing(call, message):
    sim = rock()
    sim.table("low", [(0.0, 1e6), (6.0, -1e6)])
    before = [np.copy(a) for a in (sim.element_row, sim.joint_row, sim.face_row)]
    with pytest.raises(CommandError, match=message):
        call(sim)
    assert all(np.array_equal(a, b) for a, b in zip(before, (sim.element_row, sim.joint_row, sim.face_row)))


def test_fields_come_back_from_a_file(tmp_path):
    """Values, and fields that are drawn from later; elements that come back are drawn like all others."""
    sim = rock()
    sim.random_field("g", RandomField.of(NORMAL, 20e9, 3e9, 4, 0.7, GAUSSIAN, least=5e9))
    sim.element_property(None, {"young": Drawn("g")})
    changes.null(sim, [5, 6])
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        changes.element_model(one, [5, 6], ELASTIC, {**ROCK, "young": Drawn("g")})
        one.joint_property(None, {"cohesion": Drawn("f")})
        convergence.advance(one, 30)
    assert again.fields == sim.fields and again.varied == sim.varied
    for name in ("young", "cohesion", "position_x", "stress_yy"):
        assert np.array_equal(diagnostics.values(again, name), diagnostics.values(sim, name), equal_nan=True), name
    where = sim.mesh.centroids()[[5, 6]]
    assert (
        diagnostics.values(sim, "young", [5, 6]).tolist()
        == sim.fields["g"].values("element", np.array([5, 6]), where).tolist()
    )
