"""Small pieces of blocks by themselves: rows of histories, edges, areas of faces, principal stresses."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from hpcdem.physics.fdem import connectivity, node_conditions, tetrahedra
from hpcdem.physics.fdem.histories import FIRST, KEY, STATE, WORDS, Histories
from hpcdem.physics.fdem.kernels import joint_law, joints
from hpcdem.physics.fdem.principal import principal
from tests.blocks.support import model, rectangle
from tests.space.support import body, box


def some() -> Histories:
    """Rows of four elements in any order: two, none, three and one."""
    rows = np.zeros((6, WORDS))
    rows.view(np.int64)[:, KEY] = 7, -2, 9, 3, -1, -4
    rows[:, STATE] = joints.BROKEN, joints.BROKEN + joint_law.COULOMB, 0.0, 0.0, joints.BROKEN, joints.BROKEN
    rows[:, FIRST + joint_law.OWN] = np.arange(1.0, 7.0)
    return Histories.of(4, np.array([2, 0, 2, 0, 3, 2]), rows)


def told(found: Histories) -> list[tuple[int, int, float]]:
    """Element, key and a number of each row."""
    numbers = found.rows[:, FIRST + joint_law.OWN]
    return list(zip(found.owners().tolist(), found.keys().tolist(), numbers.tolist()))


def test_histories_by_elements_and_keys() -> None:
    all_of_them = some()
    assert all_of_them.ptr.tolist() == [0, 2, 2, 5, 6]
    assert told(all_of_them) == [(0, -2, 2.0), (0, 3, 4.0), (2, -4, 6.0), (2, 7, 1.0), (2, 9, 3.0), (3, -1, 5.0)]
    assert told(all_of_them.take(np.array([3, 1, 0]))) == [(0, -1, 5.0), (2, -2, 2.0), (2, 3, 4.0)]
    assert told(all_of_them.take(np.array([1]))) == [] and Histories.empty(2).take(np.array([1])).ptr.tolist() == [0, 0]
    more = all_of_them.joined(np.array([0, 1]), all_of_them.rows[3:4])
    assert told(more)[-2:] == [(3, -1, 5.0), (5, 7, 1.0)] and more.ptr.tolist() == [0, 2, 2, 5, 6, 6, 7]
    kept = all_of_them.keep(np.array([True, False, False, True, False, True]))
    assert told(kept) == [(0, -2, 2.0), (2, 7, 1.0), (3, -1, 5.0)] and kept.ptr.tolist() == [0, 1, 1, 2, 3]


def test_histories_forget_partners_and_joints() -> None:
    """Contacts with elements that go, in space by another key; joints on faces, but those that slide forget only that
    they are torn."""
    gone = np.array([False, True, False, False])
    assert [key for _, key, _ in told(some().without_partners(gone, 2))] == [-2, 3, -4, 9, -1]
    assert [key for _, key, _ in told(some().without_partners(gone, 3))] == [-2, 3, -4, 7, -1]
    forget, number = np.zeros(48, bool), np.array([5, 6, 9, 11])
    forget[[4 * 5 + 1, 4 * 9 + 3, 4 * 11 + 1]] = True
    found = told(some().without_joints(number, forget))
    assert found == [(0, -2, 0.0), (0, 3, 4.0), (2, 7, 1.0), (2, 9, 3.0), (3, -1, 5.0)]


def test_each_edge_is_reported_once_also_across_the_first_face() -> None:
    cells = np.array([[0, 1, 2, -1], [1, 0, 3, 4]])
    edges = connectivity.edges_of(cells, 5)
    assert edges.faces.tolist() == [[0, 4], [1, -1], [2, -1], [5, -1], [6, -1], [7, -1]]
    assert edges.points.tolist() == [[0, 1], [1, 2], [2, 0], [0, 3], [3, 4], [4, 1]]
    solid = tetrahedra.face_partners(np.array([[0, 1, 2, 3], [0, 2, 1, 4], [5, 6, 7, 8]]))
    assert sorted(np.flatnonzero(solid >= 0).tolist()) == sorted(solid[solid >= 0].tolist()) and (solid >= 0).sum() == 2


def test_areas_of_faces() -> None:
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]])
    cells = np.array([[0, 1, 2, 3]])
    slanted = 0.5 * np.linalg.norm(np.cross(points[2] - points[1], points[3] - points[1]))
    assert sorted(tetrahedra.face_areas(points, cells)[0].tolist()) == pytest.approx(sorted([3.0, 4.0, 6.0, slanted]))
    assert tetrahedra.volumes(points, np.concatenate([cells, cells[:, [0, 2, 1, 3]]])).tolist() == [4.0, -4.0]


@pytest.mark.parametrize("points_of_face", [2, 3])
def test_faces_with_equal_points_are_paired_and_three_of_them_reported(points_of_face: int) -> None:
    """In every order of what lies between them, with gaps for faces that do not exist."""
    rng = np.random.default_rng(points_of_face)
    known = np.unique(np.sort(rng.integers(0, 9, (400, points_of_face)), axis=1), axis=0)
    known = known[(np.diff(known, axis=1) > 0).all(axis=1)]
    rows = rng.permutation(np.concatenate([known, known[::2], np.full((5, points_of_face), -1)])).astype(np.int32)
    partner = np.empty(len(rows), np.int64)
    assert connectivity.pair_equal(rows, 9, partner) == -1
    same = (rows[:, None] == rows).all(axis=2) & (rows[:, 0] >= 0) & ~np.eye(len(rows), dtype=bool)
    assert partner.tolist() == np.where(same.any(axis=1), same.argmax(axis=1), -1).tolist()
    rows = np.concatenate([rows, rows[partner >= 0][:1]])
    assert connectivity.pair_equal(rows, 9, np.empty(len(rows), np.int64)) == np.flatnonzero(partner >= 0)[0]


def test_cross_products_in_the_plane_and_in_space() -> None:
    rng = np.random.default_rng(1)
    one, two = rng.normal(size=(2, 3))
    assert node_conditions._cross(one, two) == pytest.approx(np.cross(one, two), rel=1e-14)
    assert node_conditions._cross(one[:2], two[:2]) == pytest.approx([one[0] * two[1] - one[1] * two[0]], rel=1e-14)


@pytest.mark.parametrize("size", [1e-20, 1.0, 1e9])
def test_principal_stresses_of_any_size(size: float) -> None:
    rng = np.random.default_rng(9)
    stress = size * rng.normal(size=(5, 3, 3))
    stress += stress.transpose(0, 2, 1)
    stress[4] = size * np.diag([3.0, 1.0, 2.0])
    values, axes = principal(stress)
    assert values == pytest.approx(np.linalg.eigvalsh(stress), rel=1e-12, abs=1e-13 * size)
    assert axes @ (values[:, :, None] * axes.transpose(0, 2, 1)) == pytest.approx(stress, rel=1e-12, abs=1e-13 * size)


def test_tables_of_the_last_storage_are_gone_when_it_is_made_again() -> None:
    """At once, not when Python next collects circles of references: they would be there besides the new ones."""
    for sim in (model(rectangle(3, 2, 3.0, 2.0)), body(box((2, 2, 1), (1.0, 1.0, 0.5)))):
        sim.close_model()
        tables = weakref.ref(sim.local)
        gc.disable()
        try:
            sim.rebuild()
            assert tables() is None
        finally:
            gc.enable()
