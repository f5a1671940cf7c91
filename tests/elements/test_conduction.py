"""Conduction in elements of each kind: what flows between their corners."""

import numpy as np
import pytest

from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, QUAD, TETRAHEDRON, TRIANGLE, Kind
from hpcdem.physics.field.elements import CONDUCT, PAIRS, conductances, matrices, of_kinds
from tests.blocks.support import rectangle
from tests.space.support import hexes

CORNERS = {
    3: [(0.0, 0.0), (1.0, 0.1), (0.2, 0.9)],
    4: [(0.0, 0.0), (1.0, 0.1), (1.1, 0.9), (-0.1, 0.8)],
    8: [(0, 0, 0), (1, 0.1, 0), (1.1, 0.9, 0.1), (0, 1, -0.1), (0.1, 0, 1.2), (1, 0, 1), (1, 1.1, 1), (-0.1, 1, 0.9)],
}
TENSOR = np.array([[2.0, 0.3, -0.2], [0.3, 1.5, 0.4], [-0.2, 0.4, 1.0]])


def corners_of(kind: Kind) -> np.ndarray:
    if kind.dim == 3 and kind.corners == 4:
        return np.array([(0.0, 0.0, 0.0), (1.0, 0.1, 0.0), (0.2, 0.9, 0.1), (0.1, -0.1, 1.1)])
    return np.array(CORNERS[kind.corners], float)


@pytest.mark.parametrize("kind", CONDUCT, ids=lambda kind: kind.name)
def test_a_linear_field_flows_as_its_gradient_says(kind: Kind) -> None:
    """t . K t of linear values is V grad t . k . grad t, and what flows to all corners is nothing."""
    x, d = corners_of(kind), kind.dim
    k = TENSOR[[0, 1, 0, 2, 0, 1], [0, 1, 1, 2, 2, 2]][None]
    g = conductances(kind, x, np.arange(kind.corners)[None], k[:, : 3 * d - 3])
    assert g.shape == (1, len(PAIRS[kind.corners]))
    matrix = matrices(kind, g)[0]
    parts = x[np.array(kind.parts)]
    volume = np.linalg.det(parts[:, 1:] - parts[:, :1]).sum() / (kind.overlays * (2 if d == 2 else 6))
    for slope in np.eye(d)[:, None] * 3.0 + np.eye(d):
        for gradient in slope:
            t = x @ gradient
            assert t @ matrix @ t == pytest.approx(volume * gradient @ TENSOR[:d, :d] @ gradient, rel=1e-13)
    assert np.abs(matrix - matrix.T).max() == 0.0 and np.abs(matrix.sum(axis=1)).max() < 1e-14


def test_ranks_have_the_same_kinds_whichever_elements_they_hold() -> None:
    """Pieces of matrices are gathered kind by kind: a rank with triangles alone has no quads, but their place."""
    mixed, triangles = rectangle(4, 2, 4.0, 2.0, kind="mixed"), rectangle(2, 2, 1.0, 1.0)
    every = np.arange(len(mixed.cells))
    for some in (every, every[mixed.cells[:, 3] < 0], every[mixed.cells[:, 3] >= 0], every[:0]):
        found = {kind: at for kind, at, _ in of_kinds(mixed, some)}
        assert list(found) == [TRIANGLE, QUAD] and sum(map(len, found.values())) == len(some)
    assert [kind for kind, *_ in of_kinds(triangles, every[:0])] == [TRIANGLE]
    solid = hexes((2, 1, 1), (2.0, 1.0, 1.0))
    for some in (np.arange(len(solid.cells)), np.arange(0)):
        assert [kind for kind, *_ in of_kinds(solid, some)] == [HEXAHEDRON, TETRAHEDRON]
