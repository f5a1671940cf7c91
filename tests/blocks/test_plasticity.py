"""The return of stresses after Mohr and Coulomb: closed forms, the flow rule, and the plain loop of reference.py."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.numerics.lanes import lane
from hpcdem.physics.fdem import reference
from hpcdem.physics.fdem.kernels import plasticity
from hpcdem.physics.fdem.kernels.plasticity import SHEAR_NOW, TENSION_NOW
from hpcdem.physics.fdem.reference import MohrCoulomb

ROCK = MohrCoulomb(10e9, 6e9, math.radians(30.0), math.radians(10.0), 1e6, 0.5e6)
FLOWS = {
    "usual": ROCK,
    "associated": ROCK._replace(dilation=ROCK.friction),
    "no dilation": ROCK._replace(dilation=0.0),
    "clay": MohrCoulomb(10e9, 1e9, 0.0, 0.0, 1e6, 1e6),
    "up to the apex": ROCK._replace(tensile=1e9),
    "sand": ROCK._replace(cohesion=0.0, tensile=0.0),
    "no tension": ROCK._replace(tensile=0.0),
    "auxetic": ROCK._replace(bulk=3e9),
}


def constants(rock: MohrCoulomb) -> tuple[float, ...]:
    """N_phi, N_psi, 2 c sqrt(N_phi), tensile strength, Lame's lambda, 2 mu."""
    n = math.tan(math.pi / 4.0 + 0.5 * rock.friction) ** 2
    m = math.tan(math.pi / 4.0 + 0.5 * rock.dilation) ** 2
    apex = rock.cohesion / math.tan(rock.friction) if rock.friction > 0.0 else math.inf
    shear = 2.0 * rock.cohesion * math.sqrt(n)
    return n, m, shear, min(rock.tensile, apex), rock.bulk - 2.0 / 3.0 * rock.shear, 2.0 * rock.shear


def principal(s: tuple[float, float, float], rock: MohrCoulomb) -> tuple[float, float, float, int]:
    n, m, k, t, lame, two_mu = constants(rock)
    return plasticity.principal_return(*s, n, m, k, t, lame + two_mu, lame)


def flow(stress: np.ndarray, rock: MohrCoulomb) -> tuple[np.ndarray, np.ndarray, int]:
    """Stress 11, 22, 12, 33 after the return, plastic strain of the same components, and bits."""
    lame, two_mu = constants(rock)[-2:]
    *strain, bits = plasticity.plastic_strain(*stress, *constants(rock))
    e = np.array(strain)
    volume = e[0] + e[1] + e[3]
    return stress - (lame * volume * np.array([1.0, 1.0, 0.0, 1.0]) + two_mu * e), e, bits


def matrix(stress: np.ndarray) -> np.ndarray:
    return np.array([[stress[0], stress[2], 0.0], [stress[2], stress[1], 0.0], [0.0, 0.0, stress[3]]])


def trials(count: int, seed: int = 1) -> np.ndarray:
    """Stresses (count, 4) 11, 22, 12, 33 [Pa] in all regions: near the apex and far from it, some with two principal
    stresses that are equal, in the plane or one of them out of it."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(count, 1)) * rng.choice([0.3e6, 3e6, 30e6], (count, 1))
    s = mean + rng.normal(size=(count, 3)) * rng.choice([1e5, 2e6, 20e6], (count, 1))
    kind = rng.integers(0, 6, count)
    s[kind == 4, 1] = s[kind == 4, 0]
    s[kind == 5, 2] = s[kind == 5, 0]
    angle = rng.uniform(0.0, math.pi, count)
    half, middle = 0.5 * (s[:, 0] - s[:, 1]), 0.5 * (s[:, 0] + s[:, 1])
    turned = half * np.cos(2.0 * angle), half * np.sin(2.0 * angle)
    return np.column_stack([middle + turned[0], middle - turned[0], turned[1], s[:, 2]])


@pytest.mark.parametrize(
    "trial, end, bits",
    [
        ((-20.0, -8.0, -1.0), (-18.118062, -8.500679, -4.884654), SHEAR_NOW),
        ((-1.0, 0.0, 2.0), (-1.5, -0.5, 0.5), TENSION_NOW),
        ((-5.0, -2.0, 0.2), (-4.703039, -2.079005, -0.412979), SHEAR_NOW),
    ],
)
def test_published_points(trial, end, bits):
    """Of the planes alone: FLAC's formulas (K 10, G 6 GPa, c 1, T 0.5 MPa, 30 and 10 degrees)."""
    *found, seen = principal(tuple(1e6 * np.array(trial)), ROCK)
    assert np.array(found) / 1e6 == pytest.approx(end, abs=2e-6)
    assert seen == bits


@pytest.mark.parametrize(
    "trial, end, bits",
    [
        ((5.0, 5.0, 5.0), (0.5, 0.5, 0.5), TENSION_NOW),  # the corner of tension
        ((-1.0, 3.0, 3.0), (-2.25, 0.5, 0.5), SHEAR_NOW | TENSION_NOW),  # both planes, s2 = s3
    ],
)
def test_corners(trial, end, bits):
    *found, seen = principal(tuple(1e6 * np.array(trial)), ROCK)
    low = 3.0 * 0.5 - 2.0 * math.sqrt(3.0)
    want = [low if value == -2.25 else value for value in end]
    assert np.array(found) / 1e6 == pytest.approx(want, abs=1e-9)
    assert seen == bits


@pytest.mark.parametrize(
    "name",
    [n if n == "usual" else pytest.param(n, marks=pytest.mark.slow) for n in FLOWS],
)
def test_as_the_plain_loop(name):
    """Against Koiter's rule with every choice of planes, in all regions."""
    rock = FLOWS[name]
    regions = set()
    for stress in trials(500):
        end, _, bits = flow(stress, rock)
        size = np.abs(stress).max() + rock.cohesion
        assert matrix(end) == pytest.approx(reference.returned_stress(matrix(stress), rock), abs=1e-8 * size), stress
        equal = np.abs(np.diff(np.linalg.eigvalsh(matrix(end)))) < 1e-9 * size
        regions.add((bits, *equal.tolist()))
    assert len(regions) >= {"clay": 4, "sand": 3}.get(name, 6), regions


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[pytest.mark.slow] * (one not in ("usual", "no tension", "sand"))) for one in FLOWS],
)
def test_nothing_is_outside_and_work_is_lost(name):
    """f <= 0 afterwards, plastic work >= 0, and a stress that is inside stays as it is, bit for bit."""
    rock = FLOWS[name]
    inside = 0
    for stress in trials(4000, seed=2):
        end, e, bits = flow(stress, rock)
        size = np.abs(stress).max() + rock.cohesion
        before = reference.yield_functions(np.linalg.eigvalsh(matrix(stress)), rock).max()
        assert reference.yield_functions(np.linalg.eigvalsh(matrix(end)), rock).max() <= 1e-9 * size
        assert end[0] * e[0] + end[1] * e[1] + 2.0 * end[2] * e[2] + end[3] * e[3] >= -1e-12 * size * np.abs(e).max()
        if before < -1e-9 * size:
            inside += 1
            assert bits == 0 and not e.any() and np.array_equal(end, stress)
        elif before > 1e-9 * size:
            assert bits != 0
    assert inside > 100 or name == "sand"


@pytest.mark.parametrize("degrees", [0.0, 10.0, 30.0])
def test_dilation(degrees):
    """On the plane the volume grows by (N_psi - 1) of the compression, the middle stress does not flow, and the return
    is along the flow rule."""
    rock = ROCK._replace(dilation=math.radians(degrees))
    _, e, bits = flow(np.array([-20e6, -1e6, 0.0, -8e6]), rock)
    assert bits == SHEAR_NOW and e[0] < 0.0 and abs(e[3]) < 1e-12 * abs(e[0])
    assert e[1] / -e[0] == pytest.approx(math.tan(math.pi / 4.0 + 0.5 * rock.dilation) ** 2, rel=1e-9)


def test_turned_stresses():
    """The answer turns with the stress, and is symmetric to the axes."""
    for name, rock in FLOWS.items():
        for stress in trials(200, seed=3):
            end, _, bits = flow(stress, rock)
            size = np.abs(stress).max() + rock.cohesion
            mirrored, _, other = flow(stress[[1, 0, 2, 3]] * (1.0, 1.0, -1.0, 1.0), rock)
            assert mirrored[[1, 0, 2, 3]] * (1.0, 1.0, -1.0, 1.0) == pytest.approx(end, abs=1e-10 * size), name
            assert bits == other
            turn = np.eye(3)
            turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
            s = turn @ matrix(stress) @ turn.T
            there, _, _ = flow(np.array([s[0, 0], s[1, 1], s[0, 1], s[2, 2]]), rock)
            assert matrix(there) == pytest.approx(turn @ matrix(end) @ turn.T, abs=1e-8 * size), name


def test_every_number_of_the_law_counts():
    stress = np.array([-3e6, 4e6, 0.1e6, -1e6])  # to the line of both planes
    ends = [flow(stress, ROCK._replace(**{name: 0.9 * value}))[0] for name, value in ROCK._asdict().items()]
    ends.append(flow(stress, ROCK)[0])
    for i, one in enumerate(ends):
        assert not any(np.array_equal(one, other) for other in ends[:i])


def test_measures_of_what_flows_in_space():
    """Of a tile of four stresses by their principal values and axes: strain, its shear, volume, work and shortening."""
    rng, n = np.random.default_rng(8), 4
    n_phi, n_psi, k, t, lame, two_mu = constants(FLOWS["usual"])
    lanes = np.zeros(int(plasticity.LANES * lane(1)))
    principal = k * np.array([[-0.5, -3.0, -0.1], [0.5, 2.0, 1.0], [-2.0, -1.5, 0.3], [1e-3, 2e-3, 3e-3]])
    axes = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(n)]
    constants_of = (
        ("P_PHI", n_phi),
        ("P_PSI", n_psi),
        ("P_STRENGTH", k),
        ("P_TENSILE", t),
        ("P_LAM", lame),
        ("P_MU2", two_mu),
    )
    for e in range(n):
        for name, value in (*constants_of, ("P_SIZE", 2.0 + e)):
            lanes[int(getattr(plasticity, name)) + e] = value
        for q in range(3):
            lanes[int((plasticity.T11, plasticity.T22, plasticity.T33)[q]) + e] = principal[e, q]
            for r, axis in enumerate("XYZ"):
                lanes[int(getattr(plasticity, f"{axis}{q + 1}")) + e] = axes[e][r, q]
    plasticity.return_in_space(n, lanes)

    def found(e: int, *names: str) -> list[float]:
        return [float(lanes[int(getattr(plasticity, name)) + e]) for name in names]

    for e in range(n):
        order = np.argsort(principal[e])
        s, way = principal[e][order], axes[e][:, order]
        *r, how = plasticity.principal_return(*s, n_phi, n_psi, k, t, lame + two_mu, lame)
        change = s - np.array(r)
        strain = (change - lame / (3.0 * lame + two_mu) * change.sum()) / two_mu
        whole = way @ np.diag(strain) @ way.T
        expected = whole[[0, 1, 0, 2, 0, 1], [0, 1, 1, 2, 2, 2]]
        assert found(e, "P11", "P22", "P12", "P33", "P13", "P23") == pytest.approx(expected, rel=1e-10, abs=1e-16)
        aside = strain - strain.mean()
        measures = (
            math.sqrt(0.5 * (aside @ aside)),
            strain.sum(),
            r @ strain * (2.0 + e),
            -np.minimum(strain, 0.0).sum(),
        )
        assert found(e, "P_SHEAR", "P_VOLUME", "P_WORK", "P_SHORT") == pytest.approx(measures, rel=1e-10, abs=1e-16)
        assert found(e, "HOW") == [how] and (how > 0.0) == (e < 3)
