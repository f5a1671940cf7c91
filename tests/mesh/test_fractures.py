"""Fracture networks: distributions and densities against what they were asked for.

Where chance decides, the seeds are fixed and the bounds hold with the confidence said: 3.29 standard deviations are
exceeded once in a thousand tests (two-sided normal), p < 0.001 likewise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.fracture_sets import FractureSet, Length, Orientation
from hpcdem.pre.mesh.fractures import Fractures, clipped, crossings, network, of_curves, poisson
from hpcdem.pre.mesh.regions import polygon_of
from tests.tables import each

CONFIDENCE = 3.29
RANDOM = (np.arange(20_000) + 0.5) / 20_000


@pytest.fixture
def field(shapely):
    """A field of 20 by 10 metres."""
    layers = geometry.Layers()
    layers.add("field", geometry.rectangle((0.0, 0.0), (20.0, 10.0)))
    return polygon_of(layers, ["field"], 1.0)


# --- distributions -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("length", "mean"),
    [
        (Length("fixed", 3.0), 3.0),
        (Length("exponential", 2.0), 2.0),
        # Cut off: E = (a + m) e^(-a/m) - (b + m) e^(-b/m), over e^(-a/m) - e^(-b/m).
        (
            Length("exponential", 2.0, least=1.0, greatest=5.0),
            (3.0 * math.exp(-0.5) - 7.0 * math.exp(-2.5)) / (math.exp(-0.5) - math.exp(-2.5)),
        ),
        (Length("lognormal", 4.0, 2.0), 4.0),
        # Density ~ l^-n from a to b: E = (n-1)/(n-2) (a^(2-n) - b^(2-n)) / (a^(1-n) - b^(1-n)).
        (Length("power", 2.5, least=1.0, greatest=16.0), 3.0 * (1.0 - 0.25) / (1.0 - 1.0 / 64.0)),
        (Length("power", 1.0, least=1.0, greatest=math.e), math.e - 1.0),  # E = (b - a) / ln(b / a)
        (Length("power", 2.0, least=1.0, greatest=math.e), 1.0 / (1.0 - math.exp(-1.0))),
        (Length("power", 0.0, least=1.0, greatest=3.0), 2.0),  # even
    ],
)
def test_mean_lengths(length, mean):
    length.check("set")
    assert math.isclose(length.mean(), mean, rel_tol=1e-6)


@pytest.mark.parametrize(
    ("length", "reference"),
    [
        (Length("exponential", 2.0), lambda: scipy.stats.expon(scale=2.0)),
        (
            Length("lognormal", 4.0, 2.0),
            lambda: scipy.stats.lognorm(math.sqrt(math.log(1.25)), scale=4.0 / math.sqrt(1.25)),
        ),
        (Length("power", 3.5, least=2.0, greatest=1e9), lambda: scipy.stats.pareto(2.5, scale=2.0)),
    ],
)
def test_lengths_are_distributed_as_named(length, reference):
    """The inverse distribution at even steps against the distribution of another library."""
    np.testing.assert_allclose(reference().cdf(length.lengths(RANDOM)), RANDOM, atol=1e-9)


def test_cut_off_lengths_stay_inside_and_keep_their_shape():
    whole = scipy.stats.expon(scale=2.0)
    cut = Length("exponential", 2.0, least=1.0, greatest=5.0)
    got = cut.lengths(RANDOM)
    assert got.min() >= 1.0 and got.max() <= 5.0
    share = (whole.cdf(got) - whole.cdf(1.0)) / (whole.cdf(5.0) - whole.cdf(1.0))
    np.testing.assert_allclose(share, RANDOM, atol=1e-12)


@pytest.mark.parametrize(
    ("orientation", "reference"),
    [
        (Orientation("normal", 30.0, 10.0), lambda: scipy.stats.norm(30.0, 10.0)),
        (Orientation("uniform", 30.0, 10.0), lambda: scipy.stats.uniform(20.0, 20.0)),
        (Orientation("fisher", 0.0, 0.0), lambda: scipy.stats.uniform(-180.0, 360.0)),
    ],
)
def test_angles(orientation, reference):
    np.testing.assert_allclose(reference().cdf(np.degrees(orientation.angles(RANDOM))), RANDOM, atol=1e-6)


@pytest.mark.parametrize("kappa", [0.5, 5.0, 60.0, 1e4])
def test_fisher_in_the_plane_is_von_mises(kappa):
    angle = Orientation("fisher", 0.0, kappa).angles(RANDOM)
    np.testing.assert_allclose(scipy.stats.vonmises(kappa).cdf(angle), RANDOM, atol=2e-4)
    # Mean resultant length I1 / I0.
    ratio = scipy.special.ive(1, kappa) / scipy.special.ive(0, kappa)
    assert math.isclose(np.cos(angle).mean(), ratio, rel_tol=1e-4)


def test_poisson_inverse():
    for mean in (0.3, 4.0, 250.0, 1e5):
        for u in (1e-9, 0.1, 0.5, 0.9, 1.0 - 1e-9):
            assert poisson(mean, u) == int(scipy.stats.poisson(mean).ppf(u))
    assert poisson(3.0, 0.0) == 0


# --- densities ---------------------------------------------------------------------------------------------------

JOINTS = FractureSet(Orientation("normal", 60.0, 15.0), Length("exponential", 2.0, greatest=20.0), "p21", 0.8)
SEEDS = 60


def mean_and_error(values: list[float]) -> tuple[float, float]:
    """Mean of independent values, and its standard error from their scatter."""
    return float(np.mean(values)), float(np.std(values, ddof=1) / math.sqrt(len(values)))


def test_p21_is_met_in_the_mean_up_to_the_rim(field):
    """60 networks; traces cut by the rim count with what is inside. The mean is as likely above as below 0.8."""
    got = [network([JOINTS], field, seed).lengths().sum() / field.area for seed in range(SEEDS)]
    mean, error = mean_and_error(got)
    assert error < 0.02 and abs(mean - 0.8) < CONFIDENCE * error
    # The rim is no different from the middle: a strip of 1 m along it has the same density.
    strip = field.difference(field.buffer(-1.0))
    at_rim = []
    for seed in range(SEEDS):
        ends, _ = clipped(network([JOINTS], field, seed).ends, strip)
        at_rim.append(np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() / strip.area)
    mean, error = mean_and_error(at_rim)
    assert error < 0.03 and abs(mean - 0.8) < CONFIDENCE * error


def test_p20_counts_centres(field):
    """Centres inside are Poisson: the sum of 60 counts has the mean 60 * 0.5 * 200 and its root as deviation."""
    sets = [replace(JOINTS, measure="p20", density=0.5, length=Length("fixed", 0.01))]
    count = sum(len(network(sets, field, seed)) for seed in range(SEEDS))
    expected = SEEDS * 0.5 * field.area
    assert abs(count - expected) < CONFIDENCE * math.sqrt(expected) + SEEDS * 0.5 * 60 * 0.01  # rim: perimeter x l


@pytest.mark.parametrize("scanline", [0.0, *(pytest.param(angle, marks=pytest.mark.slow) for angle in (45.0, 90.0))])
def test_p10_counts_what_a_scan_line_meets(field, scanline):
    """A line of 8 m through the middle meets P10 * 8 traces in the mean, whatever its direction."""
    one = replace(JOINTS, measure="p10", density=1.5, scanline=scanline)
    way = 4.0 * np.array([math.cos(math.radians(scanline)), math.sin(math.radians(scanline))])
    middle = np.array([10.0, 5.0])
    met = [len(crossings(middle - way, middle + way, network([one], field, s).ends)[0]) for s in range(SEEDS)]
    expected = SEEDS * 12.0
    assert abs(sum(met) - expected) < CONFIDENCE * math.sqrt(expected)


def test_lengths_and_angles_of_a_network(field):
    """Whole traces of one network (centres anywhere in the window) follow the distributions: Kolmogorov-Smirnov."""
    tiny = replace(JOINTS, measure="p20", density=5.0, length=Length("exponential", 0.02))
    made = network([tiny], field, 3)
    inside = ((made.ends > 0.1) & (made.ends < (19.9, 9.9))).all(axis=(1, 2))
    way = made.ends[inside, 1] - made.ends[inside, 0]
    assert inside.sum() > 800
    assert scipy.stats.kstest(np.hypot(*way.T), scipy.stats.expon(scale=0.02).cdf).pvalue > 1e-3
    assert (
        scipy.stats.kstest(np.degrees(np.arctan2(way[:, 1], way[:, 0])), scipy.stats.norm(60.0, 15.0).cdf).pvalue > 1e-3
    )
    x, y = made.ends[inside].mean(axis=1).T
    assert scipy.stats.kstest(x, scipy.stats.uniform(0.1, 19.8).cdf).pvalue > 1e-3
    assert scipy.stats.kstest(y, scipy.stats.uniform(0.1, 9.8).cdf).pvalue > 1e-3


def test_a_density_that_is_to_be_reached_is(field):
    for seed in range(5):
        p21 = replace(JOINTS, stop="reached", length=Length("power", 2.5, least=1.0, greatest=8.0))
        made = network([p21], field, seed)
        assert abs(made.lengths().sum() - 0.8 * field.area) <= 4.0  # half the longest trace
        p20 = replace(JOINTS, stop="reached", measure="p20", density=0.35, length=Length("fixed", 1e-3))
        assert abs(len(network([p20], field, seed)) - 70) <= 1


def test_traces_end_at_others(field):
    """All end where they first meet an earlier trace; so no trace crosses an earlier one."""
    first = replace(JOINTS, density=0.6)
    second = FractureSet(Orientation("normal", -30.0, 5.0), Length("fixed", 5.0), "p21", 0.8, ends_at=1.0)
    free = network([first, replace(second, ends_at=0.0)], field, 8)
    ended = network([first, second], field, 8)
    np.testing.assert_array_equal(free.of_set(0).ends, ended.of_set(0).ends)
    older = ended.of_set(0).ends

    def crossed(traces: np.ndarray) -> int:
        hits = [crossings(a, b, older)[0] for a, b in traces]
        return sum(int(((t > 1e-9) & (t < 1 - 1e-9)).sum()) for t in hits)

    assert crossed(free.of_set(1).ends) > 50
    assert crossed(ended.of_set(1).ends) == 0
    assert ended.of_set(1).lengths().sum() < 0.8 * free.of_set(1).lengths().sum()
    half = network([first, replace(second, ends_at=0.5)], field, 8)
    assert 0 < crossed(half.of_set(1).ends) < crossed(free.of_set(1).ends)


def test_a_function_of_the_seed(field):
    sets = [JOINTS, replace(JOINTS, orientation=Orientation("fixed", -10.0))]
    one, again, other = (network(sets, field, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(one.ends, again.ends)
    assert len(one) != len(other) or not np.array_equal(one.ends, other.ends)
    # A set does not change when another is added behind it.
    np.testing.assert_array_equal(network(sets[:1], field, 5).ends, one.of_set(0).ends)
    assert set(one.sets) == {0, 1} and set(network(sets, field, 5, first=4).sets) == {4, 5}


def test_traces_are_cut_by_outline_and_holes(shapely):
    layers = geometry.Layers()
    layers.add("o", geometry.rectangle((0.0, 0.0), (10.0, 10.0)))
    layers.add("h", geometry.rectangle((4.0, 4.0), (6.0, 6.0)))
    region = polygon_of(layers, ["o"], 1.0, holes=["h"])
    assert region.area == 96.0
    ends, origin = clipped(np.array([[(-5.0, 5.0), (15.0, 5.0)], [(1, 1), (2, 2)], [(20, 0), (30, 0)]]), region)
    assert origin.tolist() == [0, 0, 1]
    np.testing.assert_allclose(ends, [[(0, 5), (4, 5)], [(6, 5), (10, 5)], [(1, 1), (2, 2)]])
    made = network([JOINTS], region, 1, least=0.5)
    assert made.lengths().min() > 0.5
    middle = made.ends.mean(axis=1)
    assert not ((middle > 4.0) & (middle < 6.0)).all(axis=1).any()


def test_traces_of_curves():
    made = of_curves(
        [geometry.rectangle((0, 0), (2, 1)), geometry.point((5, 5)), geometry.arc((0, 0), 1, 0, 90)], 7, 0.1
    )
    assert len(made) == 4 + 16 and set(made.sets) == {7}
    assert math.isclose(made.lengths()[:4].sum(), 6.0) and math.isclose(
        made.lengths()[4:].sum(), math.pi / 2, rel_tol=1e-3
    )
    assert len(Fractures()) == 0 and len(of_curves([], 0, 1.0)) == 0


@each(
    ("change", "message"),
    [
        ({"density": 0.0}, "fracture set 0: the density must be positive"),
        ({"density": math.nan}, "density must be positive"),
        ({"density": 1e9}, "traces expected, at most"),
        ({"measure": "p32"}, "'p32' is not known"),
        ({"stop": "never"}, "'never' is not known"),
        ({"stop": "reached", "measure": "p10"}, "p10 holds on average"),
        ({"stop": "reached", "ends_at": 0.5}, "cannot be reached"),
        ({"ends_at": 1.5}, "from 0 to 1"),
        ({"orientation": Orientation("bingham", 0.0)}, "'bingham' is not known"),
        ({"orientation": Orientation("normal", 0.0, -1.0)}, "not be negative"),
        ({"orientation": Orientation("normal", math.inf)}, "must be finite"),
        ({"orientation": Orientation("fixed", 20.0), "measure": "p10", "scanline": 200.0}, "along the fractures"),
        ({"length": Length("gamma", 1.0)}, "'gamma' is not known"),
        ({"length": Length("fixed", 0.0)}, "must be positive"),
        ({"length": Length("power", 2.0, greatest=5.0)}, "least length above 0"),
        ({"length": Length("power", 2.0, least=5.0, greatest=1.0)}, "not a valid range"),
        ({"length": Length("lognormal", 2.0)}, "standard deviation"),
        ({"length": Length("exponential", 1.0, least=100.0)}, "hardly any length"),
    ],
)
def test_nonsense_is_refused(field, change, message):
    with pytest.raises(CommandError, match=message):
        network([replace(JOINTS, **change)], field, 0)


def test_a_negative_seed_is_refused(field):
    with pytest.raises(CommandError, match="seed"):
        network([JOINTS], field, -1)
