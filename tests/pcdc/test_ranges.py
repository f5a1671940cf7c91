"""Groups and ranges: which objects are chosen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.api.arguments import chosen_by
from hpcdem.commands.fdem import meshes
from hpcdem.commands.fdem.choices import chosen, points
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.groups import Groups

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right group 'rock' set 'domain'\n"


def numbers(bench, kind: str, *terms: g.Term) -> list[int]:
    found = points(bench.project, terms) if kind == g.NODE else chosen(bench.project, kind, terms)
    return [] if found is None else found.tolist()


def test_an_object_is_in_one_group_of_a_set():
    groups = Groups(g.ELEMENT)
    groups.assign([5, 3, 3, 1], "a")
    groups.assign([3, 7], "b")
    groups.assign([3], "a", "other")
    assert groups.members("a").tolist() == [1, 5] and groups.members("b").tolist() == [3, 7]
    assert groups.members("a", "other").tolist() == [3]
    groups.assign([1], "b")
    assert groups.members("a").tolist() == [5] and groups.members("b").tolist() == [1, 3, 7]


def test_groups_come_back_from_json():
    groups = Groups(g.NODE)
    groups.assign([0, 1, 2, 9, 11, 12], "a", "s")
    groups.assign([], "empty", "s")
    assert groups.state() == {"s": {"a": [[0, 2], [9, 9], [11, 12]], "empty": []}}
    again = Groups.restored(g.NODE, groups.state())
    assert again.members("a", "s").tolist() == [0, 1, 2, 9, 11, 12] and again.members("empty", "s").tolist() == []


def test_names_that_are_not_there():
    groups = Groups(g.NODE, {"bc": {"top": np.array([1])}})
    with pytest.raises(CommandError, match="set 'bc' has no group 'tip' of nodes; it has 'top'"):
        groups.members("tip", "bc")
    with pytest.raises(CommandError, match="there is no set 'cb' of nodes; available: 'bc'"):
        groups.members("top", "cb")
    groups.assign([3], "x")
    with pytest.raises(CommandError, match="There is a group 'top' in set 'bc'"):
        groups.members("top")


def test_a_group_of_elements_is_not_one_of_their_joints(bench):
    bench(BOX)
    for kind in (g.JOINT, g.FACE, g.NODE):
        with pytest.raises(
            CommandError, match=rf"no set 'domain' of .*'rock' is a group of elements: use face-of .*{kind}s"
        ):
            numbers(bench, kind, g.InGroup("rock", "domain"))
        assert numbers(bench, kind, g.OfElements("rock", "domain"))


def test_places(bench):
    bench(BOX)
    # Two triangles per square, rows of four squares; the centres of a pair lie at 1/3 and 2/3 of its side.
    assert numbers(bench, g.ELEMENT, g.Span(0, 0, 1)) == [0, 1, 8, 9]
    assert numbers(bench, g.ELEMENT, g.Span(0, 0, 1), g.Span(1, 1, 2)) == [8, 9]
    assert numbers(bench, g.NODE, g.Span(1, 2, 2)) == [10, 11, 12, 13, 14]
    assert numbers(bench, g.NODE, g.Span(0, 4, 99)) == [4, 9, 14]
    assert numbers(bench, g.NODE, g.Ids(3, 5)) == [3, 4, 5] and numbers(bench, g.NODE, g.Ids(14, 14)) == [14]
    # Faces and joints lie in a range with both ends: on x = 2 there are two edges, each with a face on both sides.
    assert len(numbers(bench, g.FACE, g.Span(0, 2, 2))) == 4 and len(numbers(bench, g.JOINT, g.Span(0, 2, 2))) == 2
    assert len(numbers(bench, g.FACE, g.Span(1, 2, 2))) == 4 and not chosen_or_none(bench, g.JOINT, g.Span(1, 2, 2))


def chosen_or_none(bench, kind: str, *terms: g.Term) -> list[int]:
    try:
        return numbers(bench, kind, *terms)
    except CommandError:
        return []


def test_numbers_of_objects(bench):
    bench(BOX)
    edges = bench.project.mesh.edges()
    assert len(numbers(bench, g.FACE, g.Ids(0, 999))) == 3 * 16
    assert len(numbers(bench, g.JOINT, g.Ids(0, 999))) == int(edges.inner.sum()) == (3 * 16 - 12) // 2


def test_rounded_coordinates_are_found(bench):
    bench("pcdc mesh structured (0,0) (0.3,0.1) cells 3 1\n")
    x = bench.project.mesh.points[:, 0]
    assert 0.1 + 0.2 != 0.3 and x.max() == 0.3
    assert len(numbers(bench, g.NODE, g.Span(0, 0.1 + 0.2, 1.0))) == 2


def test_places_in_the_mesh_count_unless_the_range_says_present(bench):
    bench(BOX + "pcdc model step 100\n")  # nodes have moved by (1, 2)
    assert numbers(bench, g.NODE, g.Span(0, 1, 1)) == [1, 6, 11]
    assert numbers(bench, g.NODE, g.Span(0, 1, 1), g.Present()) == [0, 5, 10]
    assert numbers(bench, g.NODE, g.Present(), g.Span(1, 4, 4))[0] == 10
    assert numbers(bench, g.ELEMENT, g.Span(0, 1, 2), g.Present()) == numbers(bench, g.ELEMENT, g.Span(0, 0, 1))
    assert numbers(bench, g.JOINT, g.Span(0, 3, 3), g.Present()) == numbers(bench, g.JOINT, g.Span(0, 2, 2))


def test_layers_of_the_mesh_and_of_the_drawing(bench):
    bench(BOX + "pcdc geometry create polyline (1,0) (1,2) (3,2) as-layer 'line'\n"
          "pcdc geometry create rectangle (0.9,-1) (3.1,3) as-layer 'middle'\n"
          "pcdc geometry create circle (2,1) 1.5 as-layer 'ring'\n")  # fmt: skip
    assert numbers(bench, g.NODE, g.OnLayer("top")) == [10, 11, 12, 13, 14]
    assert len(numbers(bench, g.FACE, g.OnLayer("left"))) == 2
    assert numbers(bench, g.NODE, g.OnLayer("line")) == [1, 6, 11, 12, 13]
    # Two inner edges with two faces each, and two edges of the top.
    assert len(numbers(bench, g.FACE, g.OnLayer("line"))) == 6 and len(numbers(bench, g.JOINT, g.OnLayer("line"))) == 2
    assert numbers(bench, g.ELEMENT, g.OnLayer("middle")) == [2, 3, 4, 5, 10, 11, 12, 13]
    centres = bench.project.mesh.centroids()
    inside = np.flatnonzero(np.hypot(centres[:, 0] - 2, centres[:, 1] - 1) < 1.5).tolist()
    assert numbers(bench, g.ELEMENT, g.OnLayer("ring")) == inside and 0 < len(inside) < 16
    with pytest.raises(CommandError, match="no closed line"):
        chosen(bench.project, g.ELEMENT, (g.OnLayer("line"),))


def test_boundary_and_what_excavation_does_to_it(bench):
    bench(BOX)
    assert len(numbers(bench, g.FACE, g.OnBoundary())) == 12 and len(numbers(bench, g.NODE, g.OnBoundary())) == 12
    bench("pcdc element c-model null range x 0 1\n")
    faces = numbers(bench, g.FACE, g.OnBoundary())
    assert len(faces) == 10 and all(bench.project.alive[f // 4] for f in faces)
    assert sorted(numbers(bench, g.NODE, g.OnBoundary())) == [1, 2, 3, 4, 6, 9, 11, 12, 13, 14]


def test_what_belongs_to_elements(bench):
    bench(BOX + "pcdc element group 'left' set 'half' range x 0 2\npcdc element group 'right' set 'half' range x 2 4\n")
    assert numbers(bench, g.NODE, g.OfElements("left", "half")) == [0, 1, 2, 5, 6, 7, 10, 11, 12]
    assert len(numbers(bench, g.FACE, g.OfElements("left", "half"))) == 24
    both = numbers(bench, g.JOINT, g.Between("left", "right", "half"))
    assert both == numbers(bench, g.JOINT, g.Span(0, 2, 2))
    inside = [len(numbers(bench, g.JOINT, g.OfElements(side, "half"))) for side in ("left", "right")]
    assert sum(inside) + len(both) == 18
    assert numbers(bench, g.ELEMENT, g.InSet("half")) == list(range(16))


def test_cracks(bench):
    bench(BOX + "pcdc geometry create polyline (2,0) (2,2) as-layer 'fault'\npcdc mesh intersect layer 'fault'\n")
    assert numbers(bench, g.JOINT, g.OnCrack()) == numbers(bench, g.JOINT, g.Span(0, 2, 2))
    bench("pcdc node reset velocity\npcdc geometry create polyline (1,0) (1,2) as-layer 'other'\n"
          "pcdc mesh intersect layer 'other'\n")  # fmt: skip
    ((args, _),) = bench.blocks.told(
        "crack"
    )  # the simulation has the mesh already, and is told of the new cracks alone
    assert args[0].tolist() == numbers(bench, g.JOINT, g.Span(0, 1, 1))


def test_a_crack_that_is_no_line_of_the_mesh_follows_its_edges(bench):
    bench(BOX + "pcdc geometry create polyline (0,0.9) (4,1.1) as-layer 'fault'\n")
    with pytest.raises(CommandError, match="follow uses the nearest edges"):
        meshes.intersect(bench.project, "fault")
    bench("pcdc mesh intersect layer 'fault' follow\n")
    assert numbers(bench, g.JOINT, g.OnCrack()) == numbers(bench, g.JOINT, g.Span(1, 1, 1))


def test_several_bodies_are_one_mesh(bench):
    bench(BOX + "pcdc mesh structured (0,3) (4,4) cells 2 1 type quad group 'platen' set 'domain'\n")
    mesh = bench.project.mesh
    assert len(mesh.cells) == 18 and len(mesh.points) == 15 + 6 and math.isclose(mesh.areas().sum(), 12.0)
    assert numbers(bench, g.ELEMENT, g.InGroup("platen", "domain")) == [16, 17]
    assert numbers(bench, g.NODE, g.OfElements("platen", "domain")) == list(range(15, 21))
    assert numbers(bench, g.NODE, g.OnLayer("top")) == [10, 11, 12, 13, 14, 18, 19, 20]
    assert len(numbers(bench, g.FACE, g.OnBoundary())) == 12 + 6


@pytest.mark.parametrize(
    ("terms", "message"),
    [((g.Ids(3, 2),), "the first number is above the last"),
     ((g.Span(0, 2, 1),), "the first bound is above the second"),
     ((g.Span(0, 0, 1), g.Span(0, 2, 3)), "selects no element; each of its terms alone selects some"),
     ((g.OnCrack(),), "does not apply to elements")],
)  # fmt: skip
def test_ranges_that_make_no_sense(bench, terms, message):
    bench(BOX)
    with pytest.raises(CommandError, match=message):
        chosen(bench.project, g.ELEMENT, terms)


def by_words(bench, kind: str, words: str) -> list[int]:
    """What a range of a script chooses."""
    return numbers(bench, kind, *chosen_by(words, kind))


def test_one_number_not_and_in_circle(bench):
    bench(BOX)
    assert by_words(bench, g.NODE, "x 0") == by_words(bench, g.NODE, "x 0 0") != []
    every, left = by_words(bench, g.ELEMENT, "x 0 4"), by_words(bench, g.ELEMENT, "x 0 2")
    assert by_words(bench, g.ELEMENT, "not x 0 2") == sorted(set(every) - set(left))
    bench("pcdc element group 'left' range x 0 2\n")
    assert by_words(bench, g.ELEMENT, "y 0 1 not group 'left'") == sorted(
        set(by_words(bench, g.ELEMENT, "y 0 1")) - set(left)
    )
    at = bench.project.whole_mesh().points
    near = np.flatnonzero(np.hypot(*(at - (1.0, 1.0)).T) <= 1.0 + 1e-9).tolist()
    for words in ("in-circle (1,1) 1", "in-circle center 1,1 radius 1", "in-c c (1,1) rad 1"):
        assert by_words(bench, g.NODE, words) == near and len(near) == 5
    assert by_words(bench, g.NODE, "not in-circle (1,1) 1") == sorted(set(range(len(at))) - set(near))
    for wrong, why in (
        ("x 0 2 not", "not must precede"), ("not not x 0 2", "not must precede"), ("in-circle (1,1)", "a radius"),
        ("in-circle rad 1", "a centre and a radius"),
    ):  # fmt: skip
        with pytest.raises(CommandError, match=why):
            by_words(bench, g.NODE, wrong)


def test_nodes_that_a_group_does_not_mean_are_on_the_other_side(bench):
    bench(BOX + "pcdc element group 'left' range x 0 2\n")
    sides, others = (chosen(bench.project, g.NODE, chosen_by(words, g.NODE))
                     for words in ("face-of 'left' x 2", "not face-of 'left' x 2"))  # fmt: skip
    assert not set(sides.tolist()) & set(others.tolist())


def test_area(bench):
    bench(
        "pcdc mesh structured (0,0) (2,1) cells 2 1 type quad\npcdc mesh structured (5,0) (9,4) cells 2 2 type quad\n"
    )
    assert by_words(bench, g.ELEMENT, "area 0.5 2") == [0, 1]
    assert by_words(bench, g.ELEMENT, "area 3.9 4.1") == [2, 3, 4, 5]
    with pytest.raises(CommandError, match="area selects elements in 2 dimensions"):
        by_words(bench, g.FACE, "area 0 9")


def test_along_near_and_inside_of_a_layer(bench):
    bench(
        BOX + "pcdc geometry create polyline (0,1) (4,1) as-layer 'line'\n"
        "pcdc geometry create polygon (0,0) (3,0) (3,2) (2,2) (2,1) (1,1) (1,2) (0,2) as-layer 'u'\n"
    )
    on = by_words(bench, g.JOINT, "geometry 'line'")
    assert by_words(bench, g.JOINT, "geometry-along 'line'") == on and len(on) == 4
    # joints half a metre away at most: with all ends within 1 m those across, too, unless the angle forbids it
    wide = by_words(bench, g.JOINT, "geometry-along 'line' distance-offset 1 angle-offset 0")
    assert wide == on
    assert len(by_words(bench, g.JOINT, "geom-a 'line' dis-offset 1 ang-offset 45")) > len(on)
    assert len(by_words(bench, g.JOINT, "geom-a 'line' dis-offset 1 ang-offset 90")) == len(
        by_words(bench, g.JOINT, "geom-d 'line' within 1")
    )
    at = bench.project.whole_mesh().points
    assert by_words(bench, g.NODE, "geometry-distance 'line' within 0.5") == np.flatnonzero(at[:, 1] == 1.0).tolist()
    # a ray from the left arm of the u crosses it three times, one from the opening twice
    inside = by_words(bench, g.ELEMENT, "geometry 'u'")
    for way in ("", " ray-direction (1,0.01)", " ray-direction (0.3,-1) count 1"):
        assert by_words(bench, g.ELEMENT, f"geometry-location 'u'{way}") == inside
    centres = bench.project.whole_mesh().centroids()
    opening = np.flatnonzero((np.abs(centres[:, 0] - 1.5) < 0.5) & (centres[:, 1] > 1.0)).tolist()
    assert by_words(bench, g.ELEMENT, "geometry-location 'u' count 2") == opening
    three = by_words(bench, g.ELEMENT, "geom-l 'u' ray-dir (1,0) count 3")
    assert three and set(three) < set(inside)
    with pytest.raises(CommandError, match="there is no geometry layer 'v'"):
        by_words(bench, g.NODE, "geometry-distance 'v' within 1")
    with pytest.raises(CommandError, match="ray-direction"):
        by_words(bench, g.ELEMENT, "geometry-location 'u' ray-direction (0,0)")


def test_terms_of_space(bench):
    bench(
        "pcdc model new dim 3\npcdc mesh structured (0,0,0) (2,1,1) cells 2 1 1\n"
        "pcdc geometry create sphere (0,0,0) 1 as-layer 's'\n"
    )
    at = bench.project.whole_mesh().points
    away = np.abs(np.sqrt((at**2).sum(axis=1)) - 1.0)
    assert by_words(bench, g.NODE, "geometry-distance 's' within 0.1") == np.flatnonzero(away <= 0.1).tolist() != []
    inside = np.flatnonzero(np.sqrt((at**2).sum(axis=1)) <= 1.2).tolist()
    assert by_words(bench, g.NODE, "in-circle (0,0,0) 1.2") == inside != []
    faces = by_words(bench, g.FACE, "area 0.4 0.6")
    assert faces and set(faces) < set(by_words(bench, g.FACE, "area 0 9"))
    with pytest.raises(ScriptError, match="geometry-location' is for two dimensions"):
        bench("pcdc element group 'a' range geometry-location 's'\n")
