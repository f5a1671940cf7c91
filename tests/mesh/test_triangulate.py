"""Meshes by gmsh against closed forms: areas, counts of edges, sizes, groups, cracks as edges; and hostile input."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import connectivity as cn
from hpcdem.physics.fdem.mesh import Mesh, check, crack_rows, edge_rows
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.fractures import Fractures
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.pre.mesh.quality import corner_angles, quality
from hpcdem.pre.mesh.sizes import Refinement, SizeField
from hpcdem.pre.mesh.triangulate import Meshed, MeshSettings, Region, triangulate
from tests.mesh.areas import enclosed_area
from tests.tables import each

pytestmark = pytest.mark.usefixtures("gmsh")

BOX = geometry.rectangle((0.0, 0.0), (10.0, 6.0))
ROCK = [Region("o", "rock")]


def layers(**curves: geometry.Curve | list[geometry.Curve]) -> Layers:
    made = Layers()
    for name, some in curves.items():
        made.add(name, *(some if isinstance(some, list) else [some]))
    return made


def meshed(curves: dict, regions: list[Region] | None = None, size: float = 0.5, **wishes) -> Meshed:
    made = triangulate(layers(**curves), MeshSettings(regions or ROCK, size, **wishes))
    check(made.mesh)
    return made


def length(mesh: Mesh, pairs: np.ndarray) -> np.ndarray:
    return np.hypot(*(mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]]).T)


def holes(mesh: Mesh) -> int:
    """Euler: V - E + F = bodies - holes."""
    bodies = cn.bodies(cn.face_partners(mesh.cells, len(mesh.points))).max() + 1
    return int(bodies - (len(mesh.points) - len(mesh.edges()) + len(mesh.cells)))


# --- outlines and areas ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_a_plate_with_a_hole(kind):
    """The hole is a regular polygon of n = 2 ceil(pi r / h) corners on the circle: area n r2 sin(2 pi / n) / 2."""
    made = meshed(
        {"o": BOX, "h": geometry.circle((4.0, 3.0), 1.3)}, holes=["h"], kind=kind, refine=[Refinement("h", 0.1)]
    )
    mesh = made.mesh
    n = 2 * math.ceil(math.pi * 1.3 / 0.1)
    assert len(mesh.layers["h"]) == n and made.notes == [] and holes(mesh) == 1
    assert math.isclose(mesh.areas().sum(), 60.0 - 0.5 * n * 1.69 * math.sin(2.0 * math.pi / n), rel_tol=1e-12)
    on_rim = mesh.points[np.unique(mesh.layers["h"])]
    np.testing.assert_allclose(np.hypot(*(on_rim - (4.0, 3.0)).T), 1.3, rtol=1e-14)
    loops = cn.boundary_loops(mesh.cells, cn.face_partners(mesh.cells, len(mesh.points)))
    assert sorted(map(len, loops)) == sorted([n, len(mesh.layers["o"])])
    assert {g: len(rows) for g, rows in mesh.groups["default"].items()} == {"rock": len(mesh.cells)}
    quads = cn.corner_counts(mesh.cells) == 4
    assert quads.mean() > 0.8 if kind == "quad" else not quads.any()
    assert np.nanmax(corner_angles(mesh)) < 165.0


def test_corners_of_the_outline_are_exact():
    ugly = geometry.polygon([(0.1, 0.2), (9.7, 0.3), (10.1, 5.7), (3.3, 6.1)])
    mesh = meshed({"o": ugly}).mesh
    have = set(map(tuple, mesh.points.tolist()))
    assert set(map(tuple, ugly.points.tolist())) <= have
    assert math.isclose(mesh.areas().sum(), enclosed_area(ugly), rel_tol=1e-13)


def test_regions_in_regions_become_groups():
    """The later region takes over; a second set is independent of the first."""
    curves = {
        "o": BOX,
        "p": geometry.rectangle((2.0, 1.0), (8.0, 4.0)),
        "q": geometry.rectangle((5.0, 3.0), (9.0, 5.0)),
    }
    regions = [Region("o", "rock"), Region("p", "clay"), Region("q", "ore"), Region("p", "wet", "water")]
    mesh = meshed(curves, regions).mesh
    area = {(s, g): mesh.areas()[rows].sum() for s, of in mesh.groups.items() for g, rows in of.items()}
    assert area[("default", "clay")] == pytest.approx(18.0 - 3.0, rel=1e-12)
    assert area[("default", "ore")] == pytest.approx(8.0, rel=1e-12)
    assert area[("default", "rock")] == pytest.approx(60.0 - 15.0 - 8.0, rel=1e-12)
    assert area[("water", "wet")] == pytest.approx(18.0, rel=1e-12)
    edges = mesh.edges()
    assert edges.inner[edge_rows(mesh, edges, "q")].all() and not edges.inner[edge_rows(mesh, edges, "o")].any()
    assert length(mesh, mesh.layers["p"]).sum() == pytest.approx(18.0, rel=1e-12)


def test_bodies_that_touch_and_bodies_that_do_not():
    """Platens on a specimen: one mesh, whose common edges can crack; a third body has no connection."""
    curves = {
        "o": geometry.rectangle((0, 0), (5, 10)),
        "low": geometry.rectangle((-1, -1), (6, 0)),
        "far": geometry.circle((20, 0), 1),
    }
    regions = [Region("o", "rock"), Region("low", "steel"), Region("far", "ball")]
    mesh = meshed(curves, regions, cracks=[("low", 9)]).mesh
    assert length(mesh, mesh.cracks).sum() == pytest.approx(5.0) and set(mesh.crack_sets) == {9}
    partner = cn.face_partners(mesh.cells, len(mesh.points))
    assert cn.bodies(partner).max() == 1
    edges = mesh.edges()
    partner[edges.faces[crack_rows(mesh, edges)]] = -1
    assert cn.bodies(partner).max() == 2


# --- sizes -------------------------------------------------------------------------------------------------------


def test_edges_follow_the_size_field():
    """Lines keep to h exactly (no edge is longer); inside, edges are near h: mean of length / h within 10 %."""
    curves = {"o": BOX, "h": geometry.circle((4.0, 3.0), 1.0), "f": geometry.polyline([(6.0, 1.0), (9.0, 5.0)])}
    refine = [Refinement("h", 0.08, growth=0.15), Refinement("f", 0.2, distance=1.5)]
    mesh = meshed(curves, size=0.6, holes=["h"], cracks=[("f", 0)], refine=refine).mesh
    sizes = SizeField(0.6, [(r, [curves[r.layer]]) for r in refine])
    edges = mesh.edges()
    ratio = length(mesh, edges.points) / sizes(mesh.points[edges.points].mean(axis=1))
    assert abs(ratio.mean() - 1.0) < 0.1 and ratio.max() < 1.8 and ratio.min() > 0.4
    for name in ("o", "h", "f"):
        assert ratio[edge_rows(mesh, edges, name)].max() < 1.03
    assert len(mesh.layers["h"]) == 2 * math.ceil(math.pi / 0.08)


def test_a_region_with_a_size_of_its_own():
    curves = {
        "o": BOX,
        "p": geometry.rectangle((2.0, 2.0), (4.0, 4.0)),
        "c": geometry.polyline([(2.5, 3.0), (3.5, 3.0)]),
    }
    mesh = meshed(curves, [Region("o", "rock"), Region("p", "ore", size=0.1)], cracks=[("c", 0)]).mesh
    ore = mesh.groups["default"]["ore"]
    # An equilateral triangle of edge h has the area sqrt(3) / 4 h2.
    assert len(ore) == pytest.approx(4.0 / (math.sqrt(3.0) / 4.0 * 0.01), rel=0.15)
    assert len(mesh.cracks) == 10 and len(mesh.layers["p"]) == 80


def test_kirsch_mesh():
    """96 edges on a hole of radius 1 in a disc of radius 20, growing by 8 %."""
    curves = {"o": geometry.circle((0, 0), 20.0), "h": geometry.circle((0, 0), 1.0)}
    refine = [Refinement("h", 2.0 * math.pi / 96, growth=0.08)]
    mesh = meshed(curves, size=2.0, holes=["h"], refine=refine).mesh
    assert len(mesh.layers["h"]) == 96 and quality(mesh).angle_least > 30.0


# --- cracks and lines inside -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_a_straight_crack_is_a_chain_of_inner_edges(kind):
    fault = geometry.polyline([(1.0, 1.0), (8.5, 4.6)])
    mesh = meshed({"o": BOX, "f": fault}, kind=kind, cracks=[("f", 2)]).mesh
    whole = math.hypot(7.5, 3.6)
    n = math.ceil(whole / 0.5)
    assert len(mesh.cracks) == n and set(mesh.crack_sets) == {2}
    np.testing.assert_allclose(length(mesh, mesh.cracks), whole / n, rtol=1e-12)
    assert geometry.distance(fault, mesh.points[np.unique(mesh.cracks)]).max() < 1e-14
    edges = mesh.edges()
    jointed = np.zeros(4 * len(mesh.cells), bool)
    jointed[edges.faces[crack_rows(mesh, edges), 0]] = True
    # Both tips hang together, so n edges open n - 1 points.
    _, lead = cn.corner_clusters(mesh.cells, cn.face_partners(mesh.cells, len(mesh.points)), jointed)
    assert len(lead) == len(mesh.points) + n - 1


def test_cracks_cross_and_end_on_each_other():
    """A cross and a T: length is kept, and points are shared where they meet."""
    curves = {
        "o": BOX,
        "a": geometry.polyline([(1.0, 3.0), (9.0, 3.0)]),
        "b": geometry.polyline([(4.1, 1.0), (4.1, 5.0)]),
        "c": geometry.polyline([(7.3, 3.0), (7.3, 5.0)]),
    }
    mesh = meshed(curves, cracks=[("a", 1), ("b", 2), ("c", 3)]).mesh
    for number, whole in ((1, 8.0), (2, 4.0), (3, 2.0)):
        assert length(mesh, mesh.cracks[mesh.crack_sets == number]).sum() == pytest.approx(whole, rel=1e-12)
    degree = dict(zip(*np.unique(mesh.cracks, return_counts=True)))
    at = {tuple(mesh.points[p]): d for p, d in degree.items() if d > 2}
    assert sorted((round(x, 9), round(y, 9), int(d)) for (x, y), d in at.items()) == [(4.1, 3.0, 4), (7.3, 3.0, 3)]


def test_lines_that_come_too_near_are_moved_together_but_not_far():
    """One move is 0.3 of the mesh size at most, and two in a row are rare; no angle is smaller than some 17 degrees."""
    curves = {
        "o": BOX,
        "long": geometry.polyline([(0.5, 3.0), (9.5, 3.0)]),
        "almost": geometry.polyline([(3.0, 3.05), (3.0, 5.5)]),  # ends just above
        "acute": geometry.polyline([(5.0, 3.0), (9.0, 3.6)]),  # leaves at 8.5 degrees
        "close": geometry.polyline([(1.0, 3.1), (2.5, 3.1)]),  # beside, at a fifth of the size
        "rim": geometry.polyline([(0.5, 5.9), (3.0, 5.95)]),
    }
    names = ["long", "almost", "acute", "close", "rim"]
    made = meshed(curves, cracks=[(n, k) for k, n in enumerate(names)])
    mesh, worst = made.mesh, 0.0
    assert quality(mesh).angle_least > 15.0
    for k, name in enumerate(names):
        if (mesh.crack_sets == k).any():
            far = geometry.distance(curves[name], mesh.points[np.unique(mesh.cracks[mesh.crack_sets == k])])
            worst = max(worst, far.max())
    assert 0.1 < worst <= 2 * 0.3 * 0.5 and made.notes[0].startswith("lines close to each other were merged")
    assert f"by at most {worst:g} m" in made.notes[0]
    assert len(mesh.layers["close"]) and not (mesh.crack_sets == 3).any()  # it runs along the long one, which was first
    edges = mesh.edges()
    assert not edges.inner[edge_rows(mesh, edges, "rim")].any() and not (mesh.crack_sets == 4).any()
    tip = mesh.points[np.unique(mesh.cracks[mesh.crack_sets == 1])]
    assert tip[:, 1].min() == 3.0


def test_traces_are_cut_by_outline_and_hole():
    curves = {"o": BOX, "h": geometry.circle((5.0, 3.0), 1.0), "f": geometry.polyline([(-3.0, 3.0), (15.0, 3.0)])}
    made = meshed(curves, holes=["h"], cracks=[("f", 0)])
    assert length(made.mesh, made.mesh.cracks).sum() == pytest.approx(8.0, rel=1e-12)
    fr = Fractures(np.array([[(-5, 1), (-1, 1)], [(1, 1), (1.05, 1.05)], [(1, 5), (3, 5)]]), np.array([4, 4, 6]))
    made = meshed({"o": BOX}, fractures=fr)
    assert set(made.mesh.crack_sets) == {6} and made.notes[0].startswith("1 of 3 traces lie outside")
    assert made.notes[1].startswith("1 traces shorter than 0.3 of the mesh size are omitted")


def test_points_and_lines_inside_without_cracks():
    curves = {
        "o": BOX,
        "bed": geometry.polyline([(0, 2), (10, 2.5)]),
        "p": [geometry.point((3.3, 4.4)), geometry.point((99, 0))],
    }
    mesh = meshed(curves, inside=["bed", "p"]).mesh
    assert (3.3, 4.4) in set(map(tuple, mesh.points.tolist()))
    assert length(mesh, mesh.layers["bed"]).sum() == pytest.approx(math.hypot(10, 0.5)) and not len(mesh.cracks)


def test_a_thousand_traces_at_random():
    """Every crack edge is inside, groups and layers are right, and the mesh is fit: `check` passes in `meshed`."""
    rng = np.random.default_rng(3)
    middle, angle, half = (
        rng.uniform((0, 0), (10, 6), (1000, 2)),
        rng.uniform(0, math.pi, 1000),
        rng.uniform(0.1, 0.8, 1000),
    )
    way = (half * (np.cos(angle), np.sin(angle))).T
    made = meshed(
        {"o": BOX}, size=0.25, fractures=Fractures(np.stack([middle - way, middle + way], axis=1), np.arange(1000) % 3)
    )
    found = quality(made.mesh)
    assert found.crack_edges > 2500 and found.angle_least > 5.0
    assert made.mesh.edges().inner[crack_rows(made.mesh, made.mesh.edges())].all()


# --- the same again ----------------------------------------------------------------------------------------------


def same(one: Mesh, other: Mesh) -> None:
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.cells, other.cells)
    np.testing.assert_array_equal(one.cracks, other.cracks)
    np.testing.assert_array_equal(one.crack_sets, other.crack_sets)
    assert list(one.layers) == list(other.layers) and list(one.groups) == list(other.groups)


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_the_same_input_makes_the_same_mesh(kind):
    curves = {"o": BOX, "h": geometry.circle((5.0, 3.0), 1.0), "f": geometry.polyline([(1.0, 1.0), (9.0, 5.0)])}
    one, other = (
        meshed(curves, holes=["h"], cracks=[("f", 0)], refine=[Refinement("h", 0.1)], kind=kind) for _ in range(2)
    )
    same(one.mesh, other.mesh)


def test_quads_in_a_circle_do_not_depend_on_what_the_process_did_before():
    """Gmsh decides ties of its fronts by addresses in memory: in this process every second mesh was another one."""
    square = geometry.rectangle((-2.0, -2.0), (2.0, 2.0))
    curves = {"o": square, "h": geometry.circle((0.0, 0.0), 0.6)}
    regions = [*ROCK, Region("h", "core")]
    first, *others = (meshed(curves, regions, 1.0, kind="quad", refine=[Refinement("h", 0.12)]).mesh for _ in range(3))
    for other in others:
        same(first, other)


def test_a_closed_pipe_is_an_error_after_meshing(gmsh):
    """Gmsh resets SIGPIPE to its default, which would end the process without a message."""
    meshed({"o": BOX})
    reading, writing = os.pipe()
    os.close(reading)
    with pytest.raises(BrokenPipeError):
        os.write(writing, b"a word")
    os.close(writing)


def test_gmsh_is_left_as_it_was_found(gmsh):
    """In a Python program that uses gmsh itself, with options that would spoil our mesh."""
    alone = meshed({"o": BOX}).mesh
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFactor", 0.2)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.model.add("theirs")
        gmsh.model.geo.addPoint(1, 2, 3)
        same(alone, meshed({"o": BOX}).mesh)
        with pytest.raises(CommandError):
            meshed({"o": BOX}, size=math.nan)
        assert gmsh.model.getCurrent() == "theirs" and gmsh.option.getNumber("Mesh.ElementOrder") == 2
        assert gmsh.option.getNumber("Mesh.MeshSizeFactor") == 0.2
    finally:
        gmsh.finalize()
    same(alone, meshed({"o": BOX}).mesh)
    assert not gmsh.isInitialized()


# --- hostile -----------------------------------------------------------------------------------------------------

STAR = [geometry.polyline([(5, 3), (5 + 2 * math.cos(a), 3 + 2 * math.sin(a))]) for a in np.arange(40) * math.pi / 20]
HOSTILE = {
    "forty cracks from one point": ({"o": BOX, "c": STAR}, {}),
    "thirty parallel cracks in half an edge": (
        {"o": BOX, "c": [geometry.polyline([(1, 1 + 0.01 * i), (9, 1 + 0.01 * i)]) for i in range(30)]},
        {},
    ),
    "the same crack three times": ({"o": BOX, "c": [geometry.polyline([(1, 1), (9, 5)])] * 3}, {}),
    "a crack on the rim": ({"o": BOX, "c": geometry.polyline([(0, 0), (10, 0)])}, {}),
    "a crack all around": ({"o": BOX, "c": BOX}, {}),
    "a ring": ({"o": BOX, "c": geometry.circle((5, 3), 2)}, {}),
    "a zigzag finer than the mesh": (
        {"o": BOX, "c": geometry.polyline([(1 + 0.02 * i, 3 + 0.1 * (i % 2)) for i in range(400)])},
        {},
    ),
    "geographic": (
        {
            "o": geometry.rectangle((512345.1, 4123456.7), (512355.1, 4123462.7)),
            "c": geometry.polyline([(512346, 4123457), (512354, 4123462)]),
        },
        {},
    ),
    "an outline that crosses itself": ({"o": geometry.polyline([(0, 0), (9, 6), (9, 0), (0, 6)], True), "c": []}, {}),
    "a hole across the rim": ({"o": BOX, "h": geometry.circle((0, 3), 1), "c": []}, {"holes": ["h"]}),
    "a hole that touches the rim": ({"o": BOX, "h": geometry.circle((1, 3), 1), "c": []}, {"holes": ["h"]}),
    "a hole outside": ({"o": BOX, "h": geometry.circle((99, 3), 1), "c": []}, {"holes": ["h"]}),
    "a hole that cuts in two": ({"o": BOX, "h": geometry.rectangle((4, -1), (5, 7)), "c": []}, {"holes": ["h"]}),
    "larger edges than the model": ({"o": BOX, "c": geometry.polyline([(1, 1), (9, 5)])}, {"size": 50.0}),
    "a gap of 1e-9": ({"o": geometry.polyline([(0, 0), (10, 0), (10, 6), (0, 6), (0, 1e-9)]), "c": []}, {}),
}  # fmt: skip


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", ["tri", "quad"])
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_geometry_makes_a_mesh_that_passes(name, kind):
    curves, wishes = HOSTILE[name]
    cracks = [("c", 0)] if curves.get("c") else []
    mesh = meshed(curves, cracks=cracks, kind=kind, **wishes).mesh
    assert quality(mesh).angle_least > 5.0
    edges = mesh.edges()
    assert edges.inner[crack_rows(mesh, edges)].all()


def test_scale_does_not_matter():
    def at(scale: float) -> Mesh:
        curves = {
            "o": geometry.rectangle((0, 0), (10 * scale, 6 * scale)),
            "h": geometry.circle((3 * scale, 3 * scale), scale),
        }
        return meshed(curves, size=0.5 * scale, holes=["h"], refine=[Refinement("h", 0.1 * scale)]).mesh

    metres = at(1.0)
    for scale in (2.0**-20, 2.0**20):
        other = at(scale)
        assert math.isclose(other.areas().sum(), metres.areas().sum() * scale**2, rel_tol=1e-9)
        assert len(other.cells) == pytest.approx(len(metres.cells), rel=0.02)


def test_slivers_of_the_outline_are_reported():
    made = meshed(
        {"o": BOX, "p": geometry.polygon([(0, 3), (10, 3), (10, 3.02)])}, [Region("o", "a"), Region("p", "b")]
    )
    assert len(made.notes) == 1 and made.notes[0].startswith("the smallest angle is 0.1 degrees, in element ")


@each(
    ("curves", "regions", "wishes", "message"),
    [
        ({"o": BOX}, [Region("zz")], {}, "no geometry layer 'zz'"),
        ({"o": BOX}, [], {}, "at least one layer"),
        ({"o": BOX}, ROCK, {"kind": "hex"}, "'hex'"),
        ({"o": BOX}, ROCK, {"size": 0.0}, "mesh size must be positive, not 0"),
        ({"o": BOX}, ROCK, {"size": math.nan}, "mesh size must be positive"),
        ({"o": BOX}, ROCK, {"size": 1e-5}, r"would cut lines into about 3\.2e\+06 edges"),
        ({"o": BOX}, ROCK, {"size": 1e-3}, r"would make about 1\.4e\+08 elements"),
        ({"o": BOX}, ROCK, {"holes": ["zz"]}, "no geometry layer 'zz'"),
        ({"o": BOX}, ROCK, {"refine": [Refinement("o", 0.7)]}, "does not refine"),
        ({"o": BOX}, ROCK, {"refine": [Refinement("o", 1e-9)]}, "too small for its length"),
        ({"o": BOX}, ROCK, {"refine": [Refinement("o", 0.1, growth=-1.0)]}, "growth .* must be positive"),
        ({"o": BOX}, [Region("o", "a", size=3.0)], {}, "larger than 0.5"),
        ({"o": BOX, "e": []}, ROCK, {"cracks": [("e", 0)]}, "layer 'e' is empty"),
        ({"o": geometry.point((0, 0))}, ROCK, {}, "has no lines"),
        (
            {"o": geometry.polyline([(0, 0), (9, 0), (9, 6), (0, 6), (0, 0.1)])},
            ROCK,
            {},
            r"ends at \(0, 0\.1\).* 0\.1 away",
        ),
        ({"o": [BOX, geometry.polyline([(1, 1), (2, 2)])]}, ROCK, {}, "cannot bound a region: a line ends at"),
        ({"o": BOX, "h": geometry.rectangle((-1, -1), (11, 7))}, ROCK, {"holes": ["h"]}, "cover the regions"),
        (
            {"o": BOX},
            ROCK,
            {"fractures": Fractures(np.array([[(0.0, 0.0), (math.nan, 1.0)]]), np.array([0]))},
            "must be finite",
        ),
    ],
)
def test_nonsense_is_refused(curves, regions, wishes, message):
    wishes = {"size": 0.5} | wishes
    with pytest.raises(CommandError, match=message):
        triangulate(layers(**curves), MeshSettings(regions, wishes.pop("size"), **wishes))


def test_what_gmsh_says_is_passed_on(gmsh, monkeypatch):
    def fails(dim):
        raise Exception("Unable to recover the edge 7")

    monkeypatch.setattr(gmsh.model.mesh, "generate", fails)
    with pytest.raises(HpcdemError, match=r"gmsh could not make the mesh: .*Unable to recover the edge 7"):
        triangulate(layers(o=BOX), MeshSettings(ROCK, 0.5))
    assert not gmsh.isInitialized()


@pytest.mark.slow
def test_two_hundred_thousand_triangles():
    """Some 10 s on one core; the bound leaves room for a busy machine."""
    import time

    start = time.process_time()
    mesh = meshed({"o": geometry.rectangle((0, 0), (1, 1))}, size=0.0034).mesh
    assert 190_000 < len(mesh.cells) < 210_000 and time.process_time() - start < 60.0
    assert quality(mesh).angle_least > 30.0
