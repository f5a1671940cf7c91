"""The search for contacts in space finds what trying all pairs finds."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hpcdem.physics.fdem.kernels import detect_space

BUFFER = 0.05


def meets(face: np.ndarray, tet: np.ndarray) -> bool:
    """Whether the boxes meet and no normal of five parts them, corners (3, 3) and (4, 3)."""
    low, high = np.maximum(face.min(axis=0), tet.min(axis=0)), np.minimum(face.max(axis=0), tet.max(axis=0))
    if (low - 0.5 * BUFFER > high + 0.5 * BUFFER).any():
        return False
    for a, b, c in (*itertools.combinations(tet, 3), face):
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        one, other = face @ n, tet @ n
        if one.min() - other.max() > BUFFER or other.min() - one.max() > BUFFER:
            return False
    return True


@pytest.mark.parametrize("per_face", [detect_space.PER_FACE, 0])
def test_the_search_finds_what_trying_all_pairs_finds(per_face: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tetrahedra of many sizes; some hang together at a point, two pairs by an open and a closed face,
    and some are another rank's; also where more pairs are found than were expected."""
    monkeypatch.setattr(detect_space, "PER_FACE", per_face)
    rng = np.random.default_rng(4)
    n = 40
    x = rng.uniform(-1.0, 1.0, (n, 1, 3)) + rng.uniform(0.05, 0.4, (n, 1, 1)) * rng.normal(size=(n, 4, 3))
    x[0] *= 3.0
    x[1] = x[2] + 0.01  # neighbours that overlap
    x[3] = x[4] + 0.01
    clusters, partner, closed = np.arange(4 * n).reshape(n, 4), np.full(4 * n, -1), np.zeros(4 * n, bool)
    for a, b, together in ((1, 2, True), (3, 4, False)):
        partner[4 * a], partner[4 * b + 2] = 4 * b + 2, 4 * a
        closed[4 * a] = closed[4 * b + 2] = together
    clusters[1::4, 1] = 1000
    clusters[3, 0] = clusters[4, 3]  # past an open face a common point does not count
    corner = 3 * (4 * np.arange(n)[:, None] + np.arange(3))
    target = 3 * (4 * np.arange(n)[:, None] + np.arange(4))
    owned = rng.uniform(size=n) < 0.6
    order = rng.permutation(n)
    first, second = detect_space.find(
        corner, 4 * np.arange(n) + 3, owned, target[order], order, owned[order], x, BUFFER, clusters, partner, closed
    )
    expected = []
    for i, j in itertools.product(range(n), range(n)):
        if {i, j} == {3, 4}:
            apart = True
        else:
            apart = i != j and {i, j} != {1, 2} and set(clusters[i]).isdisjoint(clusters[j])
        if apart and (owned[i] or owned[j]) and meets(x[i, :3], x[j]):
            expected.append((i, j))
    assert list(zip(first.tolist(), order[second].tolist())) == expected
    assert len(expected) > 30 and {(3, 4), (4, 3)} & set(expected)
