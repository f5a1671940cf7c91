"""Strength that follows tables of plastic strain: closed forms of one way of loading, each table alone, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import AXES, Over
from tests.blocks.support import rectangle, shaken
from tests.blocks.test_yielding import MOHR_COULOMB, SOIL, STRESSES, A, B, M, N, deform, kind, stresses

__all__ = ["kind"]

FALL, END = 2e8, 0.01
"""Of cohesion or tensile strength [Pa] per plastic strain, and the strain at which it stays."""
SHEAR = math.sqrt((1.0 + M + M * M) / 3.0)
"""k_s per multiplier on the plane f_s."""


def over(table: str) -> Over:
    return Over(table, AXES.index("plastic-strain"))


def soil(kind: str, tables: dict[str, list[tuple[float, float]]], **other: float) -> Blocks:
    """A square metre at rest; tables: of properties over plastic strain."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
    for name, points in tables.items():
        sim.table(f"{name} table", points)
    given = {**SOIL, **other, **{name: over(f"{name} table") for name in tables}}
    changes.element_model(sim, None, MOHR_COULOMB, given)
    sim.option(dynamic=False, collision=False)
    return sim


def at_rest(sim: Blocks, gradient: np.ndarray) -> None:
    """All nodes go to their places and stay there until nothing flows any more."""
    deform(sim, gradient)
    convergence.advance(sim, 150)


def test_cohesion_of_a_sheared_element(kind):
    """Compressed along y and drawn along x by as much, s_z = 0 is the middle stress: one plane, one way of flow, l (-1,
    1) without dilation, s_x = -s_y = 2 c sqrt(N) / (N + 1). With c = c0 - h k, k = l, and the trial stress s_x = 2 G e
    the multiplier is l = f / (p - 2 h sqrt(N)), f = (N + 1) 2 G e - 2 c0 sqrt(N), p = (N + 1) 2 G, so that stress goes
    down linearly with strain; where c stays at its end it does, too."""
    c0 = SOIL["cohesion"]
    end = c0 - FALL * END
    sim = soil(kind, {"cohesion": [(0.0, c0), (END, end)]}, tensile=1e12, dilation=0.0)
    root, two_g = math.sqrt(N), A - B
    p, curve = (N + 1.0) * two_g, []
    for e in (0.0003, 0.002, 0.004, 0.008, 0.012, 0.014):
        at_rest(sim, np.diag([1.0 + e, 1.0 - e]))
        f = p * e - 2.0 * c0 * root
        lag = max(f, 0.0) / (p - 2.0 * FALL * root)
        if lag > END:
            lag = (f + 2.0 * (c0 - end) * root) / p
        stress = two_g * (e - lag)
        found = stresses(sim)
        assert found == pytest.approx(np.tile([stress, -stress, 0.0, 0.0], (len(found), 1)), rel=1e-8, abs=1.0)
        assert diagnostics.values(sim, "plastic_shear_strain") == pytest.approx(np.full(len(found), lag), abs=1e-12)
        curve.append(stress)
    assert curve == pytest.approx([1.68e6, 2.72568e6, 2.36821e6, 1.65328e6, 1.25574e6, 1.25574e6], rel=1e-5)


def test_tension_of_a_drawn_element(kind):
    """T = T0 - h k_t along y, k_t = l: a e - a l = T0 - h l."""
    t0 = SOIL["tensile"]
    sim = soil(kind, {"tensile": [(0.0, t0), (t0 / FALL, 0.0)]})
    for e in (0.0001, 0.0005, 0.001, 0.004, 0.008):
        at_rest(sim, np.diag([1.0, 1.0 + e]))
        lag = max(A * e - t0, 0.0) / (A - FALL)
        stress = min(A * e, t0 - FALL * lag)
        if lag > t0 / FALL:
            lag, stress = e, 0.0
        found = stresses(sim)
        assert found[:, 1] == pytest.approx(np.full(len(found), stress), rel=1e-8, abs=1.0)
        assert diagnostics.values(sim, "plastic_volume_strain") == pytest.approx(np.full(len(found), lag), abs=1e-12)


@pytest.mark.parametrize("name", ["friction", "dilation", "cohesion", "tensile"])
def test_each_table_alone(kind, name):
    """On the surface of the strength at the end; another table, or none, another end."""
    ends = []
    for last in (0.5, 0.4, None):
        value = SOIL[name]
        sim = soil(kind, {name: [(0.0, value), (0.001, last * value)]} if last else {})
        at_rest(sim, np.diag([1.0, 1.001]))
        for e in (0.01, 0.014, 0.017):
            deform(sim, np.diag([0.9995, 1.0 - e]))
        at_rest(sim, np.diag([0.9995, 0.98]))
        if name == "tensile":
            at_rest(sim, np.diag([1.001, 1.01]))
        found = stresses(sim)
        ends.append(found)
        if last and name in ("friction", "cohesion"):
            friction = math.radians(SOIL["friction"] * (last if name == "friction" else 1.0))
            n = math.tan(math.pi / 4.0 + 0.5 * friction) ** 2
            c = SOIL["cohesion"] * (last if name == "cohesion" else 1.0)
            high, low = (diagnostics.values(sim, f"stress_{one}") for one in ("max", "min"))
            least, most = np.minimum(low, found[:, 3]), np.maximum(high, found[:, 3])
            assert n * most - least == pytest.approx(np.full(len(found), 2.0 * c * math.sqrt(n)), rel=1e-6)
    for i, one in enumerate(ends):
        assert not any(np.allclose(one, other, rtol=1e-5) for other in ends[:i])


def test_shear_and_tension_at_once(kind):
    """To the line of both surfaces: k_s and k_t are those of the multipliers of the plain formula."""
    sim = soil(kind, {"cohesion": [(0.0, SOIL["cohesion"]), (1.0, SOIL["cohesion"])]})
    ex, ey = 0.005, -0.003
    deform(sim, np.diag([1.0 + ex, 1.0 + ey]))
    s = np.array([A * ex + B * ey, A * ey + B * ex])
    k, t = 2.0 * SOIL["cohesion"] * math.sqrt(N), SOIL["tensile"]
    shear, tension = N * s[0] - s[1] - k, s[0] - t
    p, det = A - B * M - B * N + A * N * M, A * A - B * B
    one, two = (A * shear - (N * A - B) * tension) / det, (p * tension - (A * M - B) * shear) / det
    assert one > 0.0 and two > 0.0
    found = sim.cold["softening"][:, :2]
    assert found == pytest.approx(np.tile([one * SHEAR, two], (len(found), 1)), rel=1e-9)


def test_a_constant_table_is_the_number(kind):
    """To the last digits of the functions of angles; and a reset of the state does not heal."""
    ends = []
    tables = {name: [(0.0, SOIL[name]), (0.01, SOIL[name])] for name in ("cohesion", "friction", "dilation", "tensile")}
    for of in ({}, tables):
        sim = soil(kind, of)
        for e in (0.002, 0.004, 0.006):
            deform(sim, np.diag([1.0, 1.0 - e]))
        ends.append(stresses(sim))
    assert ends[0] == pytest.approx(ends[1], rel=1e-10, abs=1e-3)
    ends = []
    for reset in (False, True):
        sim = soil(kind, {"cohesion": [(0.0, SOIL["cohesion"]), (0.01, 0.0)]})
        at_rest(sim, np.diag([1.002, 0.996]))
        if reset:
            changes.reset_state(sim)
        at_rest(sim, np.diag([1.003, 0.994]))
        ends.append(stresses(sim))
    assert np.array_equal(*ends)


def test_a_number_takes_the_place_of_a_table():
    """And a table that is replaced later acts where it is given again."""
    sim = soil("quad", {"cohesion": [(0.0, SOIL["cohesion"]), (0.001, 0.0)]})
    sim.table("cohesion table", [(0.0, 5e6)])
    at_rest(sim, np.diag([1.004, 0.996]))
    soft = stresses(sim)
    sim.element_property(None, {"cohesion": SOIL["cohesion"]})
    at_rest(sim, np.diag([1.006, 0.994]))
    n = len(soft)
    found = stresses(sim)
    assert N * found[:, 0] - found[:, 1] == pytest.approx(np.full(n, 2.0 * SOIL["cohesion"] * math.sqrt(N)), rel=1e-6)
    assert (N * soft[:, 0] - soft[:, 1] < 0.1 * SOIL["cohesion"]).all()


def test_looking_and_restart_change_nothing(kind, tmp_path):
    """A plate that softens in motion: looked at, and saved in the middle."""
    tables = {
        "cohesion": [(0.0, 1e6), (0.002, 1e5)],
        "friction": [(0.0, 30.0), (0.01, 20.0)],
        "tensile": [(0.0, 2e5), (1e-3, 0.0)],
    }
    ends = []
    for how in ("plain", "looked at", "saved"):
        sim = soil(kind, tables)
        sim.option(dynamic=True)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 1] > 0.5), 0.0, -20.0)
        diagnostics.account_energy(sim)
        for k in range(60):
            convergence.advance(sim, 1)
            if how == "looked at":
                diagnostics.values(sim, "stress_max")
                diagnostics.unbalanced_ratio(sim)
            if how == "saved" and k == 30:
                saved_state.save(sim, tmp_path / "a.sav")
                sim = Blocks()
                saved_state.restore(sim, tmp_path / "a.sav")
        ends.append(np.concatenate([diagnostics.values(sim, name) for name in (*STRESSES, "plastic_work")]))
        assert diagnostics.energies(sim)["relative"] < 0.01
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])
    assert ends[0][-len(sim.mesh.cells) :].max() > 0.0


def test_refusals():
    with pytest.raises(CommandError, match="cohesion must be >= 0"):
        soil("quad", {"cohesion": [(0.0, 1e6), (0.01, -1.0)]})
    with pytest.raises(CommandError, match=r"dilation is above friction at a plastic strain of 0\.01"):
        soil("quad", {"friction": [(0.0, 30.0), (0.01, 5.0)]})
    with pytest.raises(CommandError, match="begins at a negative plastic strain"):
        soil("quad", {"cohesion": [(-0.1, 1e6), (0.01, 1.0)]})
    sim = soil("quad", {})
    with pytest.raises(CommandError, match="there is no table 'none'"):
        sim.element_property(None, {"cohesion": over("none")})
    sim.table("t", [(0.0, 1e9)])
    with pytest.raises(CommandError, match="young of mech_mohr_coulomb cannot follow a table over plastic strain"):
        sim.element_property(None, {"young": over("t")})
