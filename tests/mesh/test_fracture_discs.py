"""Networks of discs: their statistics against what was asked for, and meshes that are cut along them.

Seeds are fixed; bounds of 3.29 standard deviations are exceeded once in a thousand tests.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import fill, snap
from hpcdem.pre.mesh.cracks import between_sides, faces_on, with_cracks
from hpcdem.pre.mesh.disc_sets import DiscSet, Poles
from hpcdem.pre.mesh.fracture_discs import area, area_inside, discs
from hpcdem.pre.mesh.fracture_sets import Length
from hpcdem.pre.mesh.solids import made
from tests.space.support import box

CONFIDENCE = 3.29
CUBE = made("box", (0, 0, 0), (4, 4, 4))
RADII = Length("power", 3.0, least=0.3, greatest=1.2)
U = np.random.default_rng(11).random((20_000, 2))


@pytest.mark.parametrize("kappa", [0.0, 0.5, 8.0, 300.0])
def test_normals_after_fisher(kappa: float) -> None:
    """Mean resultant length coth k - 1 / k, the cosine after the distribution function, the same all round."""
    poles = Poles("fisher", 40.0, 120.0, kappa)
    n = poles.normals(U)
    assert np.abs(np.linalg.norm(n, axis=1) - 1.0).max() < 1e-12
    cosine = n @ poles.mean()
    length = 1.0 / math.tanh(kappa) - 1.0 / kappa if kappa else 0.0
    assert cosine.mean() == pytest.approx(length, abs=CONFIDENCE * cosine.std() / math.sqrt(len(U)))
    if kappa:
        below = np.expm1(-kappa * (1.0 - cosine)) / np.expm1(-2.0 * kappa)
        assert scipy.stats.kstest(1.0 - below, "uniform").pvalue > 1e-3
    turned = n - cosine[:, None] * poles.mean()
    assert np.linalg.norm(turned.mean(axis=0)) < CONFIDENCE * math.sqrt(2.0 / len(U))


def test_dip_and_its_direction() -> None:
    """Dipping by 30 degrees to the east (90 degrees from y): the normal leans to the east."""
    assert Poles("fixed", 30.0, 90.0).mean() == pytest.approx([0.5, 0.0, math.sqrt(0.75)])
    assert Poles("fixed", 90.0, 0.0).mean() == pytest.approx([0.0, 1.0, 0.0])


def test_mean_cosines() -> None:
    """1/2 if all directions are alike, the cosine itself of a fixed one."""
    assert Poles("fisher", 0.0, 0.0, 0.0).mean_cosine((1, 2, 3)) == pytest.approx(0.5, rel=1e-4)
    assert Poles("fixed", 60.0).mean_cosine((0, 0, 2)) == pytest.approx(0.5)
    k = 1e6  # narrow: the mean of the cosine itself
    assert Poles("fisher", 0.0, 0.0, k).mean_cosine((0, 0, 1)) == pytest.approx(1.0 - 1.0 / k, rel=1e-7)


def test_densities_hold_in_the_mean() -> None:
    """P30 by centres, P32 by area inside, P10 by discs on scan lines, over many seeds; P32 = P30 E[pi r2]."""
    one = DiscSet(Poles("fisher", 50.0, 200.0, 6.0), RADII, "p32", 1.2)
    # density ~ r^-3 from a to b: E[r2] = 2 ln(b / a) / (a^-2 - b^-2)
    square = 2.0 * math.log(4.0) / (0.3**-2 - 1.2**-2)
    assert RADII.mean(2) == pytest.approx(square, rel=1e-5)
    assert one.p30() == pytest.approx(1.2 / (math.pi * square), rel=1e-5)
    counts, areas, met = [], [], []
    rng = np.random.default_rng(5)
    for seed in range(30):
        made_ = discs(one, [CUBE], seed)
        centre = np.array([disc.centre for disc in made_])
        counts.append(((centre > 0.0) & (centre < 4.0)).all(axis=1).sum() / 64.0)
        areas.append(math.fsum(area_inside(disc, [CUBE]) for disc in made_) / 64.0)
        lines = 4.0 * rng.random((40, 2))  # upright ones through the cube
        hits = 0
        for disc in made_:
            c, n = disc.plane()
            z = c[2] - ((lines - c[:2]) @ n[:2]) / n[2]
            at = np.column_stack([lines, z])
            hits += int(((np.linalg.norm(at - c, axis=1) < disc.radius) & (z > 0.0) & (z < 4.0)).sum())
        met.append(hits / (40 * 4.0))
    p10 = 1.2 * one.poles.mean_cosine((0, 0, 1))
    for found, exact in ((counts, one.p30()), (areas, 1.2), (met, p10)):
        error = np.std(found, ddof=1) / math.sqrt(len(found))
        assert np.mean(found) == pytest.approx(exact, abs=CONFIDENCE * error)
        assert error < 0.06 * exact
    assert scipy.stats.poisson(64.0 * one.p30()).sf(64.0 * max(counts)) > 1e-4
    p30 = DiscSet(one.poles, RADII, "p10", p10).p30()
    assert p30 == pytest.approx(one.p30(), rel=1e-6)


@pytest.mark.parametrize("measure", ["p30", "p32"])
def test_densities_that_are_reached(measure: str) -> None:
    one = DiscSet(Poles("fisher", 50.0, 0.0, 6.0), RADII, measure, 0.8, reached=True)
    found = discs(one, [CUBE], 4)
    if measure == "p30":
        got = sum(0.0 < min(d.centre) and max(d.centre) < 4.0 for d in found) / 64.0
        assert abs(got - 0.8) <= 0.5 / 64.0
    else:
        got = math.fsum(area_inside(d, [CUBE]) for d in found) / 64.0
        assert abs(got - 0.8) <= 0.5 * math.pi * 1.44 / 64.0
    assert found == discs(one, [CUBE], 4) != discs(one, [CUBE], 5)


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (DiscSet(Poles("normal", 0.0), RADII, "p32", 1.0), "fixed or fisher, not normal"),
        (DiscSet(Poles("fixed", 0.0, 0.0, 5.0), RADII, "p32", 1.0), "has no spread"),
        (DiscSet(Poles("fixed", 90.0), RADII, "p10", 1.0), "meets none of them"),
        (DiscSet(Poles("fixed", 0.0), RADII, "p10", 1.0, reached=True), "p10 holds on average"),
        (DiscSet(Poles("fixed", 0.0), RADII, "p32", 1e7), "discs expected"),
    ],
)
def test_what_makes_no_sense(one: DiscSet, said: str) -> None:
    with pytest.raises(CommandError, match=said):
        discs(one, [CUBE], 1)


# --- in the mesh ------------------------------------------------------------------------------------------------------


def test_discs_are_cut_in_exactly(gmsh: object) -> None:
    """Two that cross, and a plane: the faces of the mesh on them have their area, and lie in their planes."""
    one, two = made("disc", (0.5, 0.5, 0.5), (1, 0.3, 0.5), 0.3), made("disc", (0.4, 0.5, 0.5), (0, 0.3, 0.5), 0.3)
    plane = made("plane", (0.5, 0.5, 0.15), (0.1, 0, 1))
    cube = made("box", (0, 0, 0), (1, 1, 1))
    found = fill.filled(fill.MeshSettings([cube], 0.15, surfaces=[("discs", [one, two]), ("plane", [plane])]), "rock")
    mesh = Mesh.of(found.points, found.cells, layers=found.faces)
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(1.0, rel=1e-9) and not found.notes
    for layer, surfaces, exact, error in (
        ("discs", [one, two], 2.0 * math.pi * 0.09, 0.05), ("plane", [plane], math.sqrt(1.01), 1e-6)
    ):  # fmt: skip
        edges = mesh.edges()
        rows = mesh.find_edges(edges, mesh.layers[layer])
        assert edges.inner[rows].all()
        assert mesh.face_sizes(edges.faces[rows, 0]).sum() == pytest.approx(exact, rel=error)
        on = {tuple(row) for row in faces_on(mesh, surfaces).tolist()}
        assert on == {tuple(row) for row in mesh.layers[layer].tolist()}
    cracked = with_cracks(mesh, mesh.layers["discs"], 3)
    check(cracked)
    assert len(cracked.cracks) == len(mesh.layers["discs"]) and set(cracked.crack_sets) == {3}


def test_a_plane_outside_is_refused(gmsh: object) -> None:
    wishes = fill.MeshSettings([CUBE], 2.0, surfaces=[("plane", [made("plane", (0, 0, 9), (0, 0, 1))])])
    with pytest.raises(CommandError, match="layer 'plane' does not cut the body"):
        fill.filled(wishes, "rock")
    with pytest.raises(CommandError, match="layer 'ball' has bodies"):
        fill.filled(fill.MeshSettings([CUBE], 2.0, surfaces=[("ball", [made("sphere", (2, 2, 2), 1)])]), "rock")


def test_faces_between_elements_on_both_sides_follow_a_disc() -> None:
    """Rough, so of more area than the disc: about 1.75 times. It parts what is above from what is below."""
    mesh = box((12, 12, 12), (1.0, 1.0, 1.0), 6, 0.2)
    disc = made("disc", (0.5, 0.52, 0.47), (0.3, 0.2, 1.0), 0.35)
    faces = between_sides(mesh, [disc])
    edges = mesh.edges()
    rows = mesh.find_edges(edges, faces)
    assert edges.inner[rows].all()
    ratio = mesh.face_sizes(edges.faces[rows, 0]).sum() / area([disc])
    assert 1.28 < ratio < 2.16
    assert np.abs((mesh.points[faces].mean(axis=1) - disc.plane()[0]) @ disc.plane()[1]).max() < 1.0 / 12.0
    whole = between_sides(mesh, [made("plane", (0.5, 0.5, 0.47), (0, 0, 1))])
    apart = np.isin(np.arange(len(edges)), mesh.find_edges(edges, whole)) & edges.inner
    above = mesh.centroids()[:, 2] >= 0.47
    sides = edges.faces[edges.inner & ~apart] // 4
    assert (above[sides[:, 0]] == above[sides[:, 1]]).all()


def test_discs_that_would_leave_slivers_are_moved() -> None:
    size = 0.2
    first = made("disc", (2, 2, 2), (0, 0, 1), 1.0)
    steep = made("disc", (2, 2, 2.1), (1, 0, 1), 1.0)
    shallow = made("disc", (2.0, 2, 2.08), (0.1, 0, 1), 1.0)
    far = made("disc", (2, 2, 3.2), (0.1, 0, 1), 0.5)
    rim = made("disc", (3.03, 2, 1.0), (0, 0, 1), 1.0)
    out = made("disc", (3.5, 2, 1.0), (0, 0, 1), 1.0)
    gone = made("disc", (9, 2, 1.0), (0, 0, 1), 1.0)
    ((_, kept),), notes = snap.snapped([("d", [first, steep, shallow, far, rim, out, gone])], [CUBE], size)
    assert kept[:2] == [first, steep] and kept[3] == far and kept[5] == out and len(kept) == 6
    assert kept[2].normal == pytest.approx((0, 0, 1)) and kept[2].centre == pytest.approx((2.0, 2, 2.08))
    assert kept[4].radius == pytest.approx(4.0 - 3.03 - 0.25 * size, rel=1e-3)
    assert [note.split(" discs ")[0] for note in notes] == ["1", "1", "1"]
    near = made("disc", (2.2, 2, 2.02), (0.1, 0, 1), 1.0)
    ((_, (_, moved)),), _ = snap.snapped([("d", [first, near])], [CUBE], size)
    assert moved.centre == pytest.approx((2.2, 2, 2.0))
