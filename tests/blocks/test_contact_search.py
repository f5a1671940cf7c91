"""Who is in contact with whom: every open face with its other side, to the tip of the crack; and the search against
all pairs tried one by one."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.engine import rebuild
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.kernels import detect
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, joined, jointed, model, rectangle


def partners(sim: Blocks) -> set[tuple[int, int]]:
    """Pairs of elements on the contact list."""
    sim.close_model()
    pairs = sim.local.pairs
    return {(int(a), int(b)) for a, b in zip(pairs.element[pairs.first], pairs.element[pairs.second])}


def upright(sim: Blocks, x: float, low: float, high: float) -> np.ndarray:
    """Joints on the vertical line x between two heights."""
    edges = sim.mesh.edges()
    ends = sim.mesh.points[edges.points[edges.inner]]
    on = (np.abs(ends[:, :, 0] - x) < 1e-9).all(axis=1) & (ends[:, :, 1] > low).all(axis=1)
    return edges.faces[edges.inner][on & (ends[:, :, 1] < high).all(axis=1), 0]


@EVERY_KIND
@pytest.mark.parametrize("with_joints", [False, True])
def test_faces_of_a_crack_are_paired_up_to_its_tips(kind, with_joints):
    """A crack inside a body, its ends closed: each face is listed with the one across, those at the ends too."""
    sim = model(rectangle(6, 6, 0.6, 0.6, kind=kind))
    if with_joints:
        jointed(sim)
    faces = upright(sim, 0.3, 0.09, 0.51)
    assert len(faces) == 4
    changes.crack(sim, faces)
    found = partners(sim)
    for face in faces.tolist():
        e, f = face // 4, int(sim.partner[face]) // 4
        assert (min(e, f), max(e, f)) in found


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_nobody_touches_who_hangs_on_him(kind):
    """Elements that share a point are paired only across a crack from side to side, which makes two bodies."""
    sim = jointed(model(rectangle(4, 4, 0.4, 0.4, kind=kind)))
    cells = sim.mesh.cells

    def meet() -> list[tuple[int, int]]:
        return [(a, b) for a, b in partners(sim) if set(cells[a]) & set(cells[b]) - {-1}]

    assert not meet()
    changes.crack(sim, upright(sim, 0.2, -1.0, 1.0))
    left = sim.mesh.centroids()[:, 0] < 0.2
    assert meet() and all(left[a] != left[b] for a, b in meet())


def test_a_sheared_crack_does_not_store_energy_out_of_nothing():
    """A body with a pressed crack whose tip element faces would sink into each other if they did not touch: their
    overlap stays what the pressure makes it, sigma h / P."""
    sim = model(rectangle(8, 8, 0.8, 0.8))
    sim.face_model(None, "contact_mohr_coulomb", {"friction": 0.0, "penalty_normal": 5e11})
    edges = sim.mesh.edges()
    ends = sim.mesh.points[edges.points[edges.inner]]
    flat = (np.abs(ends[:, :, 1] - 0.4) < 1e-9).all(axis=1) & (np.abs(ends[:, :, 0].mean(axis=1) - 0.4) < 0.2)
    changes.crack(sim, edges.faces[edges.inner][flat, 0])
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    top = edges.faces[~edges.inner][(sim.mesh.points[edges.points[~edges.inner]][:, :, 1] > 0.8 - 1e-9).all(axis=1), 0]
    sim.stress_condition(top, normal=-10e6)
    sim.option(dynamic=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=20000).reason == "ratio"
    touching = diagnostics.contacts(sim)
    assert len(touching["x"]) >= 4
    x = diagnostics.values(sim, "element_position_x")
    assert touching["x"].min() < 0.4 - 0.1 and touching["x"].max() > 0.4 + 0.1  # both outermost faces, too
    # Above the crack the stress is nearly that without it.
    above = (np.abs(x - 0.4) < 0.15) & (np.abs(diagnostics.values(sim, "element_position_y") - 0.45) < 0.05)
    assert diagnostics.values(sim, "stress_yy")[above].mean() == pytest.approx(-10e6, rel=0.1)


def test_the_search_finds_what_trying_all_pairs_finds():
    """Random triangles of sizes 1 : 20, no connection, some with few or no free edges: the same pairs as by comparing
    all boxes."""
    rng = np.random.default_rng(8)
    n = 200
    middle, size = rng.uniform(0.0, 5.0, (n, 1, 2)), rng.uniform(0.02, 0.4, (n, 1, 1))
    x = np.zeros((n, 8))
    x[:, :6] = (middle + size * rng.normal(size=(n, 3, 2))).reshape(n, 6)
    box = np.empty((n, 4))
    around = np.empty((n, 4))
    detect.boxes(8 * np.arange(n), np.full(n, 7), x, 0.05, box, around)
    assert (around == box).all()  # every edge is free
    around[::3, 2:] = around[::3, :2] + rng.uniform(0.0, 0.3, (len(around[::3]), 2))
    around[::5] = np.inf, np.inf, -np.inf, -np.inf
    cells = np.column_stack([np.arange(3 * n).reshape(n, 3), np.full(n, -1)])
    owned = rng.uniform(size=n) < 0.7
    element = rng.permutation(n)
    partner = np.full(4 * n, -1)
    first, second = detect.find(box, around, element, 2 * element, owned, cells, partner, np.zeros(4 * n, bool))
    found = set(zip(element[first].tolist(), element[second].tolist()))
    near, expected = set(), set()
    for i in range(n):
        for j in range(n):
            apart = (box[i, :2] > box[j, 2:]).any() or (box[j, :2] > box[i, 2:]).any()
            if element[i] < element[j] and (owned[i] or owned[j]) and not apart:
                near.add((int(element[i]), int(element[j])))
                if any(
                    (np.maximum(a[:2], b[:2]) <= np.minimum(a[2:], b[2:])).all()
                    for a, b in ((around[i], box[j]), (around[j], box[i]))
                ):
                    expected.add((int(element[i]), int(element[j])))
    assert found == expected and len(near) > len(found) + 20 and len(found) == len(first) > 50
    assert (np.diff(element[first]) >= 0).all()


def test_rubble_without_friction_and_damping_keeps_its_energy():
    """25 pieces shaken in a box, 6000 steps at 0.4 of the stability limit: what is stored, contact included, stays.
    (Potential contact gives back what it took; near the limit such rubble gains energy unless something damps.)"""
    pieces = [rectangle(1, 1, 0.09, 0.09, x0=0.1 * i, y0=0.1 * j) for i in range(5) for j in range(5)]
    walls = [rectangle(7, 1, 0.7, 0.05, x0=-0.1, y0=y) for y in (-0.06, 0.501)]
    walls += [rectangle(1, 5, 0.05, 0.49, x0=x, y0=0.0) for x in (-0.06, 0.501)]
    mesh = joined(*pieces, *walls)
    sim = model(mesh)
    inside = sum(len(piece.points) for piece in pieces)
    sim.velocity_condition(np.arange(inside, len(mesh.points)), vx=0.0, vy=0.0)
    rng = np.random.default_rng(3)
    for k in range(25):
        vx, vy = (3.0 * rng.normal(size=2)).tolist()
        changes.set_velocity(sim, np.arange(4 * k, 4 * k + 4), vx, vy)
    sim.time_step(safety=0.4)
    diagnostics.account_energy(sim)
    sim.step()
    start = diagnostics.energies(sim)["kinetic"]
    least, most = np.inf, 0.0
    for _ in range(60):
        convergence.advance(sim, 100)
        found = diagnostics.energies(sim)
        least, most = min(least, found["contact"]), max(most, found["strain"])
        assert found["relative"] < 1e-3
        assert found["kinetic"] + found["strain"] < 1.02 * start
    assert most > 0.2 * start  # they did meet
    assert least > -0.01 * start


@pytest.mark.parametrize("glances, late", [(True, 0), (False, 1)])
def test_who_speeds_up_between_two_checks_is_seen(monkeypatch, glances, late):
    """A body that is set in motion unseen, by half the skin of the lists in thirty steps: they are made again in time,
    as somebody glances every few steps."""
    if not glances:
        monkeypatch.setattr(rebuild, "GLANCE", 10**9)
    sim = model(rectangle(2, 2, 0.2, 0.2))
    convergence.advance(sim, 3)
    sim.rebuild_state.countdown = 60
    sim.v[:, 0::2] = sim.rebuild_state.skin / (60.0 * sim.clock.dt)
    convergence.advance(sim, 61)
    assert sim.rebuild_state.late == late
