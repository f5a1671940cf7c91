"""Elements that yield after Mohr and Coulomb, asked of all kinds alike: closed forms of one way of loading, what they
remember, the account of energy; and that one path comes to the same in all of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.kernels.plasticity import SHEAR_NOW, SHEAR_PAST, TENSION_NOW
from hpcdem.physics.fdem.simulation import Blocks
from tests.elements.bodies import KINDS, MOHR_COULOMB, NAMES, SOIL, body, deform, matrices, steepness

N, M = steepness(SOIL["friction"]), steepness(SOIL["dilation"])
K = 2.0 * SOIL["cohesion"] * math.sqrt(N)
A, B = SOIL["bulk"] + 4.0 / 3.0 * SOIL["shear"], SOIL["bulk"] - 2.0 / 3.0 * SOIL["shear"]
COUNTED = ("plastic_shear_strain", "plastic_volume_strain", "plastic_state")
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def loaded(sim: Blocks, strain: tuple[float, float, float], parts: int, turn: np.ndarray = TURN) -> None:
    """These principal strains in equal parts, along the axes of a turned frame; the third one is 0 in the plane."""
    for k in range(1, parts + 1):
        deform(sim, turn @ np.diag(1.0 + np.array(strain) * k / parts) @ turn.T)


# ---- one path, all kinds -------------------------------------------------------------------------------------------


def path(sheared: float = 8e-3) -> list[np.ndarray]:
    """In the plane: compression with shear, back again, a turn, drawn apart along one axis, along both (the apex), and
    pressed together again."""
    found = [np.eye(3)]
    for ends in (
        [[1.0, sheared, 0.0], [0.0, 0.994, 0.0]], [[1.001, 0.0, 0.0], [0.0, 0.9985, 0.0]],
        [[0.8012, -0.5991, 0.0], [0.6, 0.8, 0.0]], [[1.003, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[1.004, 0.0, 0.0], [0.001, 1.004, 0.0]], [[0.999, 0.002, 0.0], [0.0, 0.991, 0.0]],
    ):  # fmt: skip
        end, start = np.eye(3), found[-1]
        end[:2] = ends
        found += [start + (end - start) * k / 6 for k in range(1, 7)]
    return found[1:]


def account(sim: Blocks, small: bool, **stress: float) -> np.ndarray:
    """What elements have after each part of the path (parts, columns), equal in all of them: stress, what is counted,
    work of flow, energy that is stored, over the size of a body."""
    sim.option(large_strain=not small)
    sim.initial_stress(None, **stress)
    rows = []
    for gradient in path():
        if small and abs(gradient[1, 0]) > 0.3:
            continue  # a turn
        deform(sim, gradient)
        s, counted = matrices(sim), [diagnostics.values(sim, name) for name in COUNTED]
        assert np.abs(s - s[0]).max() < 1e-9 * np.abs(s).max() + 1.0
        assert all(np.abs(one - one[0]).max() <= 1e-12 for one in counted)
        size = diagnostics.total(sim, "volume" if sim.dim == 3 else "area")
        energy = [diagnostics.total(sim, name) / size for name in ("plastic_work", "strain_energy")]
        rows.append([*s[0].reshape(-1), *(one[0] for one in counted), *energy])
    return np.array(rows)


@pytest.mark.some_of_each
@pytest.mark.parametrize("small", [False, True], ids=["large", "small"])
@pytest.mark.parametrize("what", [pytest.param("plain", marks=pytest.mark.slow), "stressed", "softens"])
def test_one_path_comes_to_the_same_in_all_kinds(what: str, small: bool) -> None:
    soft = {"cohesion": [(0.0, 3.45e6), (4e-3, 1e6)], "tensile": [(0.0, 1e6), (2e-3, 1e5)]} if what == "softens" else {}
    stress = {} if what == "plain" else {"xx": -1e6, "yy": -3e6, "zz": -2e6, "xy": 0.5e6}
    found = [account(body(name, **soft), small, **stress) for name in NAMES]
    sizes = np.abs(found[0]).max(axis=0)
    assert (sizes[:2] > 1e5).all() and (sizes[9:] > 0.0).all()
    states = set(found[0][:, 11].astype(int).tolist())
    assert {SHEAR_NOW, SHEAR_PAST} <= states and any(state & TENSION_NOW for state in states)
    for name, other in zip(NAMES[1:], found[1:]):
        assert (np.abs(other - found[0]) <= 1e-8 * sizes + 1e-6 * (sizes == 0.0)).all(), name


# ---- closed forms --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("parts", [1, 20])
@pytest.mark.parametrize("dilation", [0.0, 10.0, 30.0])
def test_uniaxial_strain(name: str, parts: int, dilation: float) -> None:
    """Pressed along one axis between stiff walls both lateral stresses are equal, an edge of the surface: with the
    plastic strain l (-1, m / 2, m / 2) s_1 = -a e + l (a - b m), s_3 = -b e + l (b - (a + b) m / 2), s_1 = N s_3 -
    k."""
    m, e, sim = steepness(dilation), 0.01, body(name, dilation=dilation)
    loaded(sim, (-e, 0.0, 0.0), parts)
    lag = (A * e - N * B * e - K) / (A - B * m - N * (B - 0.5 * (A + B) * m))
    s1, s3 = -A * e + lag * (A - B * m), -B * e + lag * (B - 0.5 * (A + B) * m)
    assert lag > 0.0 and s1 == pytest.approx(N * s3 - K, rel=1e-12)
    assert np.abs(matrices(sim) - TURN @ np.diag([s1, s3, s3]) @ TURN.T).max() < 1e-9 * abs(s1)
    many = len(sim.mesh.cells)
    assert diagnostics.values(sim, "plastic_volume_strain") == pytest.approx(np.full(many, lag * (m - 1.0)), abs=1e-11)
    shear = lag * (1.0 + 0.5 * m) / math.sqrt(3.0)
    assert diagnostics.values(sim, "plastic_shear_strain") == pytest.approx(np.full(many, shear), rel=1e-9)
    assert (diagnostics.values(sim, "plastic_state") == SHEAR_NOW).all()
    if parts == 1:
        size = diagnostics.total(sim, "volume" if sim.dim == 3 else "area")
        assert diagnostics.total(sim, "plastic_work") == pytest.approx(lag * (-s1 + m * s3) * size, rel=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_tension_and_the_apex(name: str) -> None:
    """Drawn along one axis, two, in space three: as many stresses stay at the tensile strength."""
    t = SOIL["tensile"]
    for many in range(1, body(name).dim + 1):
        sim = body(name)
        loaded(sim, tuple(2e-3 if k < many else 0.0 for k in range(3)), 5)
        rest = {1: B / A * t, 2: 2.0 * B / (A + B) * t, 3: t}[many]
        want = TURN @ np.diag([t if k < many else rest for k in range(3)]) @ TURN.T
        assert np.abs(matrices(sim) - want).max() < 1e-9 * t
        assert (diagnostics.values(sim, "plastic_state") == TENSION_NOW).all()


# ---- what is remembered --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KINDS)
def test_what_is_released_and_reset(name: str) -> None:
    """Unloaded an element is elastic, keeps the strain of its flow, and remembers that it has yielded; element reset
    state forgets what is counted, stresses stay. Another model keeps them too, and rock that is made weaker flows at
    once."""
    sim = body(name)
    loaded(sim, (0.0, -0.01, 0.0), 4, np.eye(3))
    before, strain = matrices(sim), diagnostics.values(sim, "plastic_shear_strain")
    deform(sim, np.diag([1.0, 0.9901, 1.0]))
    assert np.abs(matrices(sim) - before - np.diag([B * 1e-4, A * 1e-4, B * 1e-4])).max() < 10.0
    assert diagnostics.values(sim, "plastic_shear_strain") == pytest.approx(strain, rel=1e-12)
    assert (diagnostics.values(sim, "plastic_state") == SHEAR_PAST).all()
    before, work = matrices(sim), diagnostics.values(sim, "plastic_work")
    some = np.arange(6)  # of hexahedra one
    changes.reset_state(sim, some)
    assert np.array_equal(matrices(sim), before) and np.array_equal(diagnostics.values(sim, "plastic_work"), work)
    for counted in COUNTED:
        found = diagnostics.values(sim, counted)
        assert (found[some] == 0.0).all() and (found[6:] != 0.0).all()
    changes.element_model(sim, None, "mech_iso_elastic", {key: SOIL[key] for key in ("density", "bulk", "shear")})
    assert np.abs(matrices(sim) - before).max() < 1e-12 * np.abs(before).max()
    deform(sim, np.diag([1.0, 0.985, 1.0]))
    assert np.abs(matrices(sim)[:, 1, 1] - (before[:, 1, 1] - 0.0051 * A)).max() < 1e-9 * A
    changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, "cohesion": 1e6})
    found = matrices(sim)
    assert found[:, 1, 1] == pytest.approx(N * found[:, 0, 0] - 2e6 * math.sqrt(N), rel=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_looking_changes_nothing(name: str) -> None:
    ends = []
    for look in (False, True):
        sim = body(name)
        sim.option(dynamic=True)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 1] > 0.5), *(0.0, -20.0, 0.0)[: sim.dim])
        for _ in range(40):
            convergence.advance(sim, 1)
            if look:
                diagnostics.values(sim, "stress_max")
                diagnostics.unbalanced_ratio(sim)
                diagnostics.values(sim, "plastic_state")
        ends.append(np.concatenate([diagnostics.values(sim, "position_y"), diagnostics.values(sim, "plastic_work")]))
    assert np.array_equal(*ends) and ends[0][-len(sim.mesh.cells) :].max() > 0.0


@pytest.mark.parametrize("name", KINDS)
def test_before_it_yields_it_is_the_elastic_element(name: str) -> None:
    """The same bits, in motion."""
    ends, rock = [], {"density": 2500.0, "young": 30e9, "poisson_ratio": 0.3, "damp_factor": 0.1}
    strong = {"friction": 30.0, "dilation": 5.0, "cohesion": 1e12, "tensile": 1e12}
    for law, more in ((MOHR_COULOMB, strong), ("mech_iso_elastic", {})):
        sim = body(name, "mech_iso_elastic", **rock)
        changes.element_model(sim, None, law, rock | more)
        sim.option(dynamic=True)
        sim.initial_stress(None, yy=-1e6, xy=2e5)
        changes.set_velocity(sim, np.arange(6), *(2.0, 1.0, -1.0)[: sim.dim])
        convergence.advance(sim, 100)
        ends.append(np.concatenate([diagnostics.values(sim, n) for n in ("position_x", "stress_xy", "strain_energy")]))
    assert np.array_equal(*ends)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("small", [False, True], ids=["large", "small"])
def test_the_account_of_energy_closes(name: str, small: bool) -> None:
    """A body is thrown against a wall and yields: work of flow and what is stored add up to what it had."""
    sim = body(name, cohesion=1e6, tensile=5e5, damp_factor=0.02)
    sim.option(dynamic=True, large_strain=not small)
    sim.initial_stress(None, xx=-1e5, yy=-2e5, zz=-1e5)
    changes.set_velocity(sim, None, *(-2.0, 0.0, 0.0)[: sim.dim])
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0)
    convergence.advance(sim, 20)
    diagnostics.account_energy(sim)
    for _ in range(4):
        convergence.advance(sim, 60)
        found = diagnostics.energies(sim)
        assert found["relative"] < 0.01, found
    assert 0.05 * 0.5 * SOIL["density"] * 4.0 < found["plastic_lost"] <= diagnostics.total(sim, "plastic_work")
