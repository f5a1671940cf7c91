"""Heat from surface to surface where they touch: resistances in series, faces that do not match, cracks, parting."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.heat import model as heat_model
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.reference import through_contacts
from tests.blocks.support import model, rectangle
from tests.flow.support import at, inner
from tests.heat.support import GRANITE, standing, temperatures, until

K = GRANITE["conductivity"]


def joined(*parts: Mesh) -> Mesh:
    """Bodies side by side in one mesh, which do not hang together."""
    points, cells, n = [], [], 0
    for part in parts:
        points.append(part.points)
        cells.append(np.where(part.cells >= 0, part.cells + n, -1))
        n += len(part.points)
    return Mesh.of(np.concatenate(points), np.concatenate(cells))


def moved(mesh: Mesh, x: float, y: float) -> Mesh:
    return Mesh.of(mesh.points + [x, y], mesh.cells)


def two(kind: str = "tri", gap: float = 1e-6) -> Mesh:
    """Two blocks of 1 m side by side, whose faces do not match."""
    return joined(rectangle(4, 4, 1.0, 1.0, kind=kind), moved(rectangle(3, 7, 1.0, 1.0, kind=kind), 1.0 + gap, 0.0))


@pytest.mark.parametrize(("gap", "kind"), [(1e-6, "tri"), (1e-4, "mixed"), (-1e-3, "quad")])
def test_resistances_are_in_series(gap: float, kind: str) -> None:
    """Between 100 K and 0: 1 m of rock, the contact, 1 m of rock; coefficients of 10 and 40 make 16, their harmonic
    mean. The flux is 100 / (2 / k + 1 / 16)."""
    mesh = two(kind, gap)
    sim, heat = standing(mesh, transfer_coeficient=10.0)
    heat.adjust(np.flatnonzero(mesh.centroids()[:, 0] > 1.0), {"transfer_coeficient": 40.0})
    x = mesh.points[:, 0]
    heat.prescribe(np.flatnonzero(x == 0.0), 100.0)
    heat.prescribe(np.flatnonzero(x > 1.9), 0.0)
    run = Implicit(sim)
    run.steady()
    run.close()
    flux = 100.0 / (2.0 / K + 1.0 / 16.0)
    left = np.arange(len(x)) < 25
    t = temperatures(sim)
    assert t[left] == pytest.approx(100.0 - flux / K * x[left], rel=1e-9)
    assert t[~left] == pytest.approx(flux / K * (2.0 + gap - x[~left]), abs=1e-7)
    assert heat.account()["relative"] < 1e-12


def test_explicit_steps_come_to_the_same() -> None:
    """The heat of a body goes over to the other one, down to the means; the account closes. The limit of steps knows
    of the contact."""
    sim, heat = standing(two(), transfer_coeficient=500.0, conductivity=20.0)
    heat.initial(np.arange(25), 80.0)
    sim.close_model()
    limit = heat.limit()
    start = heat.account()["stored"]
    until(sim, 400.0 * limit)
    assert heat.account()["relative"] < 1e-13 and heat.account()["stored"] == pytest.approx(start, rel=1e-12)
    t = temperatures(sim)
    assert 0.0 < t.min() and t.max() < 80.0 and t[25:].max() > 5.0
    until(sim, 2e4 * limit)
    assert temperatures(sim) == pytest.approx(40.0, abs=2.0)
    heat.adjust(None, {"transfer_coeficient": 5e4})
    sim.heat_clock(dt=0.0)
    sim.close_model()
    assert heat.limit() < 0.1 * limit
    heat.initial(np.arange(25), 80.0)
    until(sim, heat.time + 200.0 * heat.limit())
    assert temperatures(sim).max() < 80.1 and temperatures(sim).min() > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tri", "mixed"])
def test_kernel_against_plain_sums(kind: str) -> None:
    """Bodies that lie crooked on each other, apart on one side, deep in each other on the other."""
    turn = np.array([[np.cos(0.004), -np.sin(0.004)], [np.sin(0.004), np.cos(0.004)]])
    other = rectangle(3, 5, 0.9, 1.3, kind=kind)
    mesh = joined(rectangle(4, 4, 1.0, 1.0, kind=kind), Mesh.of(other.points @ turn + [0.9985, -0.1], other.cells))
    sim, heat = standing(mesh, transfer_coeficient=25.0)
    sim.close_model()
    rng = np.random.default_rng(4)
    values = rng.uniform(0.0, 100.0, len(mesh.points))
    heat.t[:] = values[mesh.cells[sim.number, : heat.t.shape[1]]]
    heat._q[:] = 0.0
    heat_model.kernels.through_contacts(*heat.contacts, heat.t.reshape(-1), heat._q.reshape(-1))
    found = np.zeros(len(mesh.points))
    cells = mesh.cells[sim.number, : heat.t.shape[1]]
    np.add.at(found, cells[cells >= 0], heat._q[cells >= 0])
    edges = mesh.edges()
    edge = float(sim.mean_edge)
    wanted = through_contacts(
        mesh.points, _outward(mesh, edges.faces[~edges.inner, 0]), values, 25.0, heat_model.NEAR * edge,
        heat_model.DEEP * edge,
    )  # fmt: skip
    assert np.abs(wanted).max() > 10.0 and found == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())
    assert found.sum() == pytest.approx(0.0, abs=1e-11)


def _outward(mesh: Mesh, faces: np.ndarray) -> np.ndarray:
    e, k = faces // 4, faces % 4
    n = np.where(mesh.cells[e, 3] >= 0, 4, 3)
    return np.column_stack([mesh.cells[e, k], mesh.cells[e, (k + 1) % n]])


def test_cracks_pass_heat_while_their_sides_touch() -> None:
    """A crack in a bar insulates without a coefficient, holds heat up with one; parted by 1 mm it insulates again."""
    ends = []
    for h, apart in ((0.0, 0.0), (5.0, 0.0), (50.0, 0.0), (50.0, 1e-3)):
        mesh = rectangle(8, 2, 2.0, 0.5)
        crack = [j for j in inner(mesh) if np.allclose(mesh.points[_outward(mesh, np.array([j]))[0]][:, 0], 1.0)]
        sim, heat = standing(mesh, **({"transfer_coeficient": h} if h else {}))
        changes.crack(sim, np.array(crack))
        heat.prescribe(at(sim, x=0.0), 100.0)
        sim.close_model()
        if apart:
            right = mesh.centroids()[sim.number, 0] > 1.0
            sim.x[np.ix_(right, [0, 2, 4])] += apart
            sim.rebuild()
        until(sim, 4e5)
        ends.append(temperatures(sim)[at(sim, x=2.0)].mean())
    assert ends[0] == ends[3] == 0.0 < 1.5 * ends[1] < ends[2]


def test_blocks_that_fly_apart_stop_to_pass_heat() -> None:
    """In motion, with a clock of heat that runs ahead."""
    sim = model(two())
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "transfer_coeficient": 100.0})
    heat.initial(np.arange(25), 50.0)
    right = np.arange(25, len(sim.mesh.points))
    changes.set_velocity(sim, right, vx=10.0)
    sim.heat_clock(dt=50.0)
    content = []
    for _ in range(40):
        sim.step()
        content.append(float(temperatures(sim)[right].sum()))
    rises = np.flatnonzero(np.diff(content) > 1e-9)
    gone = heat_model.NEAR * float(sim.mean_edge) / (10.0 * sim.clock.dt)
    assert 3 < len(rises) < len(content) - 5 and abs(rises[-1] - gone) <= 3
    assert heat.account()["relative"] < 1e-13


def test_without_contact_a_coefficient_is_refused() -> None:
    sim = model(two())
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "transfer_coeficient": 100.0})
    sim.option(collision=False)
    with pytest.raises(
        CommandError,
        match=r"element 0 has a transfer-coeficient, but no face .* contact is off: use model option collision on",
    ):
        sim.step()


def test_a_body_that_touches_nothing_held_has_no_steady_state() -> None:
    mesh = joined(rectangle(2, 2, 1.0, 1.0), moved(rectangle(2, 2, 1.0, 1.0), 1.000001, 0.0),
                  moved(rectangle(2, 2, 1.0, 1.0), 3.0, 0.0))  # fmt: skip
    sim, heat = standing(mesh, transfer_coeficient=100.0)
    heat.prescribe(np.flatnonzero(mesh.points[:, 0] == 0.0), 9.0)
    with pytest.raises(CommandError, match="in the body of element 16 no temperature"):
        Implicit(sim).steady()
    changes.null(sim, np.flatnonzero(mesh.centroids()[:, 0] > 2.5))
    Implicit(sim).steady()
    assert np.nanmax(np.abs(temperatures(sim) - 9.0)) < 1e-9
