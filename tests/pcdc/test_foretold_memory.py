"""--check says what memory a model of blocks will take, and refuses one that cannot fit."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc import check
from hpcdem.physics.fdem import footprint

BOX = "pcdc model new dim 3\npcdc mesh structured (0,0,0) (1,1,1) cells 100 100 100\n"


@pytest.mark.parametrize(("line", "elements"), [
    ("mesh structured (0,0) (1,1) cells 30 20", 1200),
    ("mesh structured (0,0) (1,1) cells 30 20 type quad", 600),
    ("element create brick p0 (0,0) p1 (1,0) p2 (0,1) n 5 4", 40),
    ("model new dim 3\npcdc mesh structured (0,0,0) (1,1,1) cells 3 2 4 split 5", 120),
    ("model new dim 3\npcdc mesh structured (0,0,0) (1,1,1) cells 3 2 4 type hex", 144),
])  # fmt: skip
def test_elements_are_counted(line: str, elements: int):
    assert f" {elements} elements on 1 rank take" in check.memory(f"pcdc {line}\n", "a.py", 1, 1, None)


def test_a_model_that_cannot_fit_is_refused_with_what_it_takes():
    one = footprint.expected(6_000_000, 3, 8, 8)
    said = check.memory(BOX, "a.py", 8, 8, one.node)
    assert f"{one.rank * 1e-6:.0f} MB per rank" in said and f"{one.shared * 1e-6:.0f} MB shared" in said
    with pytest.raises(HpcdemError, match=r"does not fit: \d+ MB are free here"):
        check.memory(BOX, "a.py", 8, 8, 0.99 * one.node)


def test_models_one_after_another_and_ranks_of_other_nodes_take_no_memory_here():
    one = footprint.expected(6_000_000, 3, 8, 8)
    assert check.memory(BOX + BOX, "a.py", 8, 8, one.node) == check.memory(BOX, "a.py", 8, 8, one.node)
    free = 0.9 * footprint.expected(6_000_000, 3, 64, 64).node
    assert f"of {free * 1e-6:.0f} MB" in check.memory(BOX, "a.py", 64, 8, free)
    with pytest.raises(HpcdemError, match="does not fit"):
        check.memory(BOX, "a.py", 64, 64, free)


def test_of_meshes_of_unknown_size_nothing_is_foretold():
    unknown = "pcdc geometry create rectangle (0,0) (1,1) as-layer 'o'\npcdc mesh create from-layer 'o' size 0.1\n"
    assert check.memory("n = 3\npcdc mesh structured (0,0) (1,1) cells [n] [n]\n", "a.py", 1, 1, 1.0) == ""
    assert check.memory(unknown, "a.py", 1, 1, 1.0) == ""
    both = check.memory(f"{unknown}pcdc mesh structured (2,0) (3,1) cells 30 20\n", "a.py", 1, 1, None)
    assert "without the mesh of line 2" in both


def test_joints_and_ghosts_of_the_curve_take_memory():
    """Joints by themselves, ghosts the more the smaller the pieces are; one rank has none."""
    law = "property friction 30 cohesion 1e6 tensile-strength 1e6 gf1 5 gf2 9"
    jointed = f"{BOX}pcdc face-joint c-model classic-i-c-i {law}\n"
    said, plain = (check.memory(text, "a.py", 16, 16, None) for text in (jointed, BOX))
    each, with_joints = footprint.expected(6_000_000, 3, 16, 16), footprint.expected(6_000_000, 3, 16, 16, True)
    assert f"{with_joints.rank * 1e-6:.0f} MB per rank" in said and f"{each.rank * 1e-6:.0f} MB per rank" in plain
    share = 6e6 / 16
    more = (footprint.GHOST[True] - footprint.GHOST[False]) * footprint.ghosts(share, 16)
    assert with_joints.rank - each.rank == pytest.approx(footprint.OF_JOINTS * share + more)
    assert footprint.ghosts(1e6, 1) == 0.0
    shares = [footprint.ghosts(1e6 / ranks, ranks) * ranks for ranks in (2, 4, 16, 64)]
    assert shares == sorted(shares) and 1.5 < shares[3] / shares[2] < 3.0


@pytest.mark.parametrize(("elements", "ranks", "counted"), [(105_456, 4, 6494), (998_250, 16, 24_900)])
def test_ghosts_of_the_curve_are_foretold(elements: int, ranks: int, counted: int):
    """Mean per rank, counted in cubes of tetrahedra (docs/scaling.md)."""
    assert footprint.ghosts(elements / ranks, ranks) == pytest.approx(counted, rel=0.2)


@pytest.mark.parametrize(("elements", "ranks", "joints", "own", "most"), [
    (998_250, 2, False, 352e6, 449e6), (998_250, 2, True, 414e6, 506e6), (1_971_054, 2, False, 718e6, 944e6),
])  # fmt: skip
def test_memory_is_foretold_as_it_was_measured(elements: int, ranks: int, joints: bool, own: float, most: float):
    """Of the busiest rank, beyond an empty one (docs/scaling.md)."""
    one = footprint.expected(elements, 3, ranks, ranks, joints)
    assert one.rank - footprint.EMPTY == pytest.approx(own, rel=0.1)
    assert one.most - footprint.EMPTY == pytest.approx(most, rel=0.1)
