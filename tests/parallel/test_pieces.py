"""Blocks in space on pretended ranks that own pieces of a curve: the same bits as on one, wherever it is cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import UsageError
from hpcdem.halo.exchange import Halo
from hpcdem.halo.ownership import Curve
from hpcdem.physics.fdem import changes, overlaps, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.pairs_space import Surface
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.models import COHESIVE
from tests.pretended import Pretended, Ranks
from tests.space.support import ROCK, box, faces_on

STEPS = 12
"""Before a checkpoint, and again after it."""
WEAK = {
    "tensile_strength": 1e3, "cohesion": 3e3, "friction": 30.0, "gf1": 0.05, "gf2": 0.1, "penalty_normal": 1e9,
    "penalty_shear": 1e9,
}  # fmt: skip


def shattering(comm: Any) -> Blocks:
    """A cube with a joint on each face, torn from a corner."""
    sim = Blocks(comm)
    sim.take_mesh(box((5, 4, 4), (1.0, 0.8, 0.8), shaken=0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "damp_factor": 0.1, "friction": 30.0})
    sim.joint_model(None, COHESIVE, WEAK)
    changes.set_velocity(sim, np.arange(60), 6.0, 2.0, 6.0)
    return sim


def run(sim: Blocks, steps: int) -> dict[int, tuple[bytes, bytes]]:
    """Positions and velocities of the owned elements by their numbers; storage is made again on the way."""
    for step in range(steps):
        sim.step()
        if step % 5 == 3:
            sim.rebuild()
    own = sim.owned
    return {
        number: (x.tobytes(), v.tobytes()) for number, x, v in zip(sim.number[own].tolist(), sim.x[own], sim.v[own])
    }


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path, dict]:
    """After `STEPS`, the checkpoint of then, and after as many more."""
    sim, path = shattering(SerialComm()), tmp_path_factory.mktemp("pieces") / "half.sav"
    half = run(sim, STEPS)
    saved_state.save(sim, path)
    end = run(sim, STEPS)
    assert len(sim.event_rows) > 50
    return half, path, end


@pytest.fixture
def any_cuts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each time storage is made the curve is cut at other cells, and some ranks own nothing."""
    renew = Curve.renew

    def elsewhere(self: Curve, place: np.ndarray, side: float, step: int, *more: Any) -> None:
        renew(self, place, side, step, *more)
        if self.comm.size == 1:
            return
        cells = np.unique(np.concatenate(self.comm.allgather(np.unique(place))))
        cuts = np.sort(np.random.default_rng(step).choice(cells, self.comm.size - 1))
        cuts[2:4] = cuts[2]
        self.borders = np.concatenate([cells[:1], cuts, cells[-1:] + 1])

    monkeypatch.setattr(Curve, "renew", elsewhere)


def together(parts: list[dict]) -> dict:
    assert sum(map(len, parts)) == len({number for part in parts for number in part})
    return {number: row for part in parts for number, row in part.items()}


def test_pieces_of_the_curve_come_to_the_same_bits(alone: tuple[dict, Path, dict]) -> None:
    parts = Ranks(6).run(lambda comm: run(shattering(comm), STEPS))
    assert together(parts) == alone[0] and min(map(len, parts)) > 0


def test_cuts_that_jump_and_ranks_that_own_nothing_change_no_bit(
    alone: tuple[dict, Path, dict], any_cuts: None
) -> None:
    parts = Ranks(7).run(lambda comm: run(shattering(comm), STEPS))
    assert together(parts) == alone[0] and not parts[3]


def test_a_checkpoint_resumes_on_pieces(alone: tuple[dict, Path, dict], any_cuts: None) -> None:
    def resumed(comm: Pretended) -> dict:
        sim = Blocks(comm)
        saved_state.restore(sim, alone[1])
        return run(sim, STEPS)

    assert together(Ranks(5).run(resumed)) == alone[2]


def colliding(comm: Any) -> Blocks:
    """Two soft bodies without joints, the upper one thrown at the lower one, across its edges."""
    lower, upper = box((4, 4, 2), (1.0, 1.0, 0.5), shaken=0.2), box((3, 3, 3), (0.8, 0.7, 0.6), shaken=0.2)
    upper_points = upper.points + (0.35, 0.25, 0.501)
    n = len(lower.points)
    sim = Blocks(comm)
    sim.take_mesh(Mesh.of(np.concatenate([lower.points, upper_points]), np.concatenate([lower.cells, upper.cells + n])))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e7, "friction": 20.0})
    changes.set_velocity(sim, np.arange(n, n + len(upper_points)), 3.0, 1.0, -8.0)
    return sim


def test_bodies_without_joints_collide_to_the_same_bits(any_cuts: None) -> None:
    """Inside of them ghosts are only what shares corners; at the surface what may touch before the next storage."""

    def collide(comm: Any) -> tuple[dict, int]:
        sim = colliding(comm)
        return run(sim, 60), int(sim.local.pairs.touching.sum())

    (alone, touching), parts = collide(SerialComm()), Ranks(5).run(collide)
    assert touching > 3 and together([part for part, _ in parts]) == alone


def faulted(comm: Any) -> Blocks:
    """A cube with joints on the plane in its middle, whose halves are torn apart."""
    sim, mesh = Blocks(comm), box((8, 6, 6), (1.0, 0.8, 0.8))
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "friction": 30.0})
    joints = sim.numbers_of_joints(None)
    middle = (np.abs(mesh.points[mesh.face_points(joints)][:, :, 0] - 0.5) < 1e-9).all(axis=1)
    sim.joint_model(joints[middle], COHESIVE, WEAK)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] < 0.4), -6.0, 0.0, 0.0)
    return sim


def test_a_fault_breaks_to_the_same_bits(any_cuts: None) -> None:
    """Away from it elements have no joints, so that a rank has forces of its neighbours' elements only."""

    def torn(comm: Any) -> tuple[dict, int]:
        sim = faulted(comm)
        return run(sim, 40), len(sim.event_rows)

    (alone, cracks), parts = torn(SerialComm()), Ranks(6).run(torn)
    assert cracks > 5 and together([part for part, _ in parts]) == alone


@pytest.mark.parametrize("collision", [True, False])
def test_loads_and_a_hole_come_to_the_same_bits(any_cuts: None, collision: bool) -> None:
    """Loads at common nodes, added masses, forces left by a hole and its fill reach elements of other ranks."""

    def dug(comm: Any) -> tuple[dict, int]:
        sim = faulted(comm)
        mesh = sim.the_mesh()
        sim.option(collision=collision)
        sim.time_step(mass_scaling=3e-4)
        sim.stress_condition(faces_on(mesh, "top"), normal=-3e5, xz=5e4)
        sim.stress_condition(faces_on(mesh, "right"), quiet=True, incoming_y=0.5)
        run(sim, 15)
        hole = np.flatnonzero((np.abs(mesh.centroids() - (0.6, 0.4, 0.4)) < 0.2).all(axis=1))
        changes.null(sim, hole, relax=20.0 * sim.clock.dt)
        run(sim, 8)
        changes.element_model(sim, hole[:40], "mech_iso_elastic", {**ROCK, "young": 5e7})
        return run(sim, 10), len(sim.event_rows)

    (alone, cracks), parts = dug(SerialComm()), Ranks(6).run(dug)
    assert cracks > 5 and together([part for part, _ in parts]) == alone


@pytest.mark.parametrize("collision", [True, False])
def test_ghosts_are_at_the_surface_and_at_joints(collision: bool) -> None:
    def held(comm: Pretended) -> tuple[int, int]:
        sim = faulted(comm)
        sim.option(collision=collision)
        sim.step()
        mesh, own = sim.the_mesh(), sim.owned
        ghosts = np.delete(sim.number, np.arange(own.start, own.stop))
        points = mesh.points[mesh.cells[ghosts]]
        there = np.abs(points[..., 0] - 0.5) < 1e-9
        if collision:
            there |= ((points < 1e-9) | (points > (1.0 - 1e-9, 0.8 - 1e-9, 0.8 - 1e-9))).any(axis=2)
        assert there.any(axis=1).all() and not len(sim.beyond.number)
        of_others = np.setdiff1d(sim.local.nodes.wanted // 4, ghosts)
        assert len(sim.x) == len(sim.number) == sim.n_own + len(ghosts)
        return len(ghosts), len(of_others)

    found = Ranks(6).run(held)
    assert all(ghosts > 0 and others > 0 for ghosts, others in found)


def test_overlaps_in_the_inside_of_bodies_of_other_ranks_are_found() -> None:
    def overlaps_of(comm: Any) -> tuple[list, int]:
        lower, upper = box((6, 6, 6), (1.0, 1.0, 1.0)), box((3, 3, 3), (0.5, 0.5, 0.5))
        points = np.concatenate([lower.points, upper.points + (0.23, 0.26, 0.24)])
        sim = Blocks(comm)
        sim.take_mesh(Mesh.of(points, np.concatenate([lower.cells, upper.cells + len(lower.points)])))
        changes.element_model(sim, None, "mech_iso_elastic", ROCK)
        sim.close_model()
        found = overlaps.deepest(sim, sim.local)
        inside = Surface.of(sim).first[found[:, -2].astype(np.int64)] < 0
        return found.tolist(), int(inside.sum())

    (alone, inside), parts = overlaps_of(SerialComm()), Ranks(5).run(overlaps_of)
    assert inside > 20 and all(found == alone for found, _ in parts)


def test_ghosts_are_those_near_the_piece() -> None:
    """A long bar: ranks in its middle exchange ghosts with few others, and hold a part of it only."""

    def held(comm: Pretended) -> tuple[int, int, int]:
        sim = Blocks(comm)
        sim.take_mesh(box((40, 2, 2), (20.0, 1.0, 1.0)))
        changes.element_model(sim, None, "mech_iso_elastic", ROCK)
        sim.close_model()
        return sim.n_own, len(sim.number) - sim.n_own, len({rank for rank, *_ in sim.halo._pieces})

    for own, ghosts, neighbours in Ranks(8).run(held):
        assert 40 < own < 160 and 0 < ghosts < 160 and 1 <= neighbours <= 3


def test_more_ranks_than_cells_are_refused() -> None:
    def first(comm: Pretended) -> str:
        with pytest.raises(UsageError) as error:
            sim = Blocks(comm)
            sim.take_mesh(box((1, 1, 1), (1.0, 1.0, 1.0)))
            changes.element_model(sim, None, "mech_iso_elastic", ROCK)
            sim.close_model()
        return str(error.value)

    assert all("9 ranks are too many" in text and "at most" in text for text in Ranks(9).run(first))


def test_rows_go_to_several_neighbours() -> None:
    """Scattered rows for one neighbour and a range for the next, none for a third."""
    sends = {
        0: {1: np.array([0, 2]), 2: slice(0, 0)},
        1: {0: slice(0, 1), 2: slice(1, 3)},
        2: {0: np.array([1]), 1: np.array([0, 1, 2])},
    }

    def filled(comm: Pretended) -> list[list[float]]:
        halo = Halo(comm, 3, sends[comm.rank])
        rows = halo.storage(100.0 * comm.rank + np.arange(6.0).reshape(3, 2))
        numbers = np.full(len(rows), -1)
        numbers[halo.n_left :][:3] = 10 * comm.rank + np.arange(3)
        halo.fill(numbers)
        before = rows[:, 1].tolist()
        rows[halo.n_left :][:3] += 1000.0
        halo.refresh()
        assert rows[:, 1].tolist() == [value + 1000.0 for value in before]
        waited = sorted({row for first, last in halo.border for row in range(first, last)})
        assert not set(waited) & set(range(*halo.inside))
        halo.close()
        return numbers.tolist()

    assert Ranks(3).run(filled) == [
        [0, 1, 2, 10, 21], [0, 2, 10, 11, 12, 20, 21, 22], [11, 12, 20, 21, 22]
    ]  # fmt: skip
