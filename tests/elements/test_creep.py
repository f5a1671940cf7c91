"""Creep after Burgers in each kind of element, beside the plain step of reference.py."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, reference
from hpcdem.physics.fdem.elements.kind import Kind
from hpcdem.physics.fdem.kernels import creep as kernels
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.test_creep import SALT
from tests.elements.support import MESHES, block, components, every_kind, move, shared, strains, tensor

LAW = np.array([[5e9, 1e-14, 1e-16], [0.0, 0.0, 2e-16], [8e9, 1e-13, 0.0]])
TIME = 1e4


def deformed(kind: Kind) -> Blocks:
    """A body that creeps, turned and strained unevenly."""
    sim = Blocks()
    sim.take_mesh(MESHES[kind]())
    changes.element_model(sim, None, "mech_burgers", SALT)
    sim.option(dynamic=False, collision=False)
    rng, n = np.random.default_rng(4), kind.dim
    turn = np.linalg.qr(rng.uniform(-1.0, 1.0, (n, n)))[0]
    turn[0] *= np.linalg.det(turn)
    points = sim.the_mesh().points
    move(
        sim, points @ (turn @ (np.eye(n) + rng.uniform(-1e-3, 1e-3, (n, n)))).T + rng.uniform(-1e-5, 1e-5, points.shape)
    )
    return sim


@every_kind
def test_a_creep_step_is_the_plain_one(kind: Kind) -> None:
    """Of random strains, turns and memories: reference.burgers_step in each part, of which the parts of an overlay have
    one pressure; in one piece and in three; and a look at it (keep) changes nothing."""
    sim = deformed(kind)
    of, rng = block(sim, kind), np.random.default_rng(5)
    parts, width = len(kind.parts), kernels.MEMORY[kind.dim]
    n = kind.dim * (kind.dim + 1) // 2 - (kind.dim == 3)
    crept, kelvin, before = (list(one[:n]) for one in (kernels.CREPT, kernels.IN_KELVIN, kernels.BEFORE))
    memory = rng.uniform(-1e-4, 1e-4, (sim.n_own, width * sim.element_parts))
    for first in range(0, memory.shape[1], width):
        memory[:, [first + k for k in before]] *= 1e11
        memory[:, first + kernels.LOST] = 0.0
    base = rng.uniform(-1e6, 1e6, of.s0.shape)
    pressure = [0, 1] if kind.dim == 2 else [0, 1, 3]
    base[:, :, pressure] -= base[:, :, pressure].mean(axis=2, keepdims=True)  # parts of an overlay have one pressure
    law = rng.integers(0, 3, of.count + 3).astype(np.int32)
    who = np.arange(0, of.count, 3)
    found = []
    for threads, keep in ((1, True), (3, True), (1, False)):
        mine, s0 = memory.copy(), np.zeros_like(base)
        kernels.creep(threads, who, of.tables, base, law, LAW, False, TIME, keep, mine, s0)
        found.append((mine, s0))
    assert all(np.array_equal(a, b) for a, b in zip(found[0], found[1]))
    assert np.array_equal(found[2][0], memory) and np.array_equal(found[2][1], found[0][1])
    old, new = of.histories(memory, width), of.histories(found[0][0], width)
    two_mu = 2.0 * SALT["maxwell_shear"]

    def deviator(columns: np.ndarray) -> np.ndarray:
        a, b, c, d, e = [*columns, 0.0, 0.0][:5]
        return np.array([[a, c, d], [c, b, e], [d, e, -a - b]])

    for i in who.tolist():
        e, volumes = strains(sim, of, i)
        free = base[i].copy()
        for p in range(parts):
            initial = tensor(kind, base[i, p])
            stress, strain, unit, lost = reference.burgers_step(
                e[p],
                initial,
                *(deviator(old[i, p, of_]) for of_ in (crept, kelvin, before)),
                TIME,
                two_mu,
                *LAW[law[i]],
            )
            assert deviator(new[i, p, crept]) == pytest.approx(strain, abs=1e-15)
            assert deviator(new[i, p, kelvin]) == pytest.approx(unit, abs=1e-15)
            assert deviator(new[i, p, before]) == pytest.approx(stress, abs=1e-3)
            free[p] -= two_mu * components(kind, strain)
            assert new[i, p, kernels.LOST] == pytest.approx(lost * volumes[p] / kind.overlays, rel=1e-9)
        shared(kind, free, volumes)
        used = len(kind.components)
        assert found[0][1][i, :, :used] == pytest.approx(free[:, :used], abs=1e-3)
    unmoved = np.setdiff1d(np.arange(of.count), who)
    assert np.array_equal(new[unmoved], old[unmoved]) and len(unmoved)


@every_kind
def test_a_rank_that_owns_no_element_has_no_histories(kind: Kind) -> None:
    sim = deformed(kind)
    sim.close_model()
    of, memory = block(sim, kind), sim.cold["creep"]
    of.stored = of.stored[:0]
    width = kernels.MEMORY[kind.dim]
    assert of.histories(memory[:0], width).shape == (0, len(kind.parts), width)
