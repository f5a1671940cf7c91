"""Quads in bending: the stiffness of two overlays of two triangles with the volume strain averaged over each overlay,
put together here from their strain matrices, is what the forces show; it is too high in bending by a known factor."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, diagnostics, equilibrium
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh import structured
from tests.blocks.support import ROCK, model
from tests.conftest import ROOT

PAGE = ROOT / "docs" / "blocks.md"
OVERLAYS = (((0, 1, 2), (0, 2, 3)), ((0, 1, 3), (1, 2, 3)))


def strains(points: np.ndarray, corners: tuple[int, ...]) -> tuple[float, np.ndarray]:
    """Area and strain matrix (3, 8) (xx, yy, engineering xy) of a triangle of a quad (Zienkiewicz & Taylor)."""
    x, y = points[list(corners)].T
    area = 0.5 * ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]))
    matrix = np.zeros((3, 8))
    for k, corner in enumerate(corners):
        i, j = (k + 1) % 3, (k + 2) % 3
        b, c = (y[i] - y[j]) / (2.0 * area), (x[j] - x[i]) / (2.0 * area)
        matrix[:, 2 * corner : 2 * corner + 2] = [[b, 0.0], [0.0, c], [c, b]]
    return area, matrix


def quad_stiffness(points: np.ndarray, young: float, nu: float) -> np.ndarray:
    """(8, 8) in plane strain [N/m per m]; Marti & Cundall (1982): in an overlay the sum of the strains xx and yy is the
    mean by area, half of the difference goes to either."""
    lame, mu = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu))
    law = np.array([[lame + 2.0 * mu, lame, 0.0], [lame, lame + 2.0 * mu, 0.0], [0.0, 0.0, mu]])
    out = np.zeros((8, 8))
    for overlay in OVERLAYS:
        parts = [strains(points, corners) for corners in overlay]
        volume = sum(area * (b[0] + b[1]) for area, b in parts) / sum(area for area, _ in parts)
        for area, b in parts:
            mixed = b.copy()
            mixed[:2] += 0.5 * (volume - (b[0] + b[1]))
            out += 0.5 * area * mixed.T @ law @ mixed
    return out


def force_of(points: np.ndarray, nu: float, moved: np.ndarray) -> np.ndarray:
    """Force (8,) [N/m] that one quad puts on its corners when they are moved by (8,) [m], small strains."""
    sim = model(Mesh.of(points, [(0, 1, 2, 3)]))
    sim.element_property(None, {"poisson_ratio": nu})
    sim.option(large_strain=False, collision=False, dynamic=False)
    sim.open_model()
    sim.x[:, :8] += moved
    changes.repeat(sim, sim.x)
    return sim.evaluate().force[0]


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45])
def test_forces_are_those_of_the_overlays(nu):
    rng = np.random.default_rng(11)
    for _ in range(4):
        points = np.array([[0.0, 0.0], [1.0, 0.1], [1.2, 0.9], [-0.1, 1.0]]) + rng.uniform(-0.15, 0.15, (4, 2))
        moved = 1e-3 * rng.normal(size=8)
        expected = -quad_stiffness(points, ROCK["young"], nu) @ moved
        assert force_of(points, nu, moved) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def factor(width: float, height: float, nu: float) -> float:
    """Stiffness of a rectangle against bending over the exact one. Corners move by u = k x y: both triangles of an
    overlay have xx = -+ k h / 2, xy = -+ k w / 2 (engineering). The mean volume strain is zero, so half of xx is left
    in either of xx and yy: energy density mu k^2 (h^2 + w^2) / 8; exact: E / (1 - nu^2) k^2 h^2 / 24."""
    return 1.5 * (1.0 - nu) * (1.0 + (width / height) ** 2)


@pytest.mark.parametrize(
    ("width", "height", "nu"), [(1.0, 1.0, 0.25), (2.0, 1.0, 0.25), (0.3, 0.8, 0.1), (1.0, 1.0, 0.45)]
)
def test_a_bent_rectangle(width, height, nu):
    points = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    x, y = (points - [0.5 * width, 0.5 * height]).T
    moved = np.zeros(8)
    moved[0::2] = 1e-3 * x * y
    exact = ROCK["young"] / (1.0 - nu**2) * width * height**3 / 12.0 * 1e-6
    assert -moved @ force_of(points, nu, moved) / exact == pytest.approx(factor(width, height, nu), rel=1e-9)


def bent_bar(n: int, kind: str, diagonal: str = "both", nu: float = 0.25, aspect: float = 1.0) -> float:
    """Moment of a bar of height 1, n elements over it, whose ends are turned against each other, over the exact one,
    E / (1 - nu^2) k / 12."""
    length, k = 6.0, 1e-4
    x, y = np.linspace(0.0, length, round(length * n / aspect) + 1), np.linspace(-0.5, 0.5, n + 1)
    mesh = structured.rectangle(x, y, kind, diagonal)
    sim = model(mesh)
    sim.element_property(None, {"poisson_ratio": nu})
    sim.option(large_strain=False, collision=False, dynamic=False)
    left, right = (np.flatnonzero(np.abs(mesh.points[:, 0] - at) < 1e-9) for at in (0.0, length))
    sim.velocity_condition(left, vx=0.0)
    sim.velocity_condition(left[:1], vy=0.0)
    for point in right:
        sim.velocity_condition([point], vx=k * length * float(mesh.points[point, 1]))
    equilibrium.solve_elastic(sim)
    return float(
        diagnostics.values(sim, "reaction_x", right)
        @ mesh.points[right, 1]
        * 12.0
        * (1.0 - nu**2)
        / (ROCK["young"] * k)
    )


@pytest.mark.some_of_each
@pytest.mark.parametrize(("nu", "aspect"), [(0.25, 1.0), (0.4, 1.0), (0.25, 2.0)])
@pytest.mark.parametrize("n", [2, 4, 8])
def test_a_bar_of_quads_is_too_stiff_by_a_known_factor(n, nu, aspect):
    """Layers are stretched as they should be and bent too stiffly: 1 + (factor - 1) / n^2."""
    expected = 1.0 + (factor(aspect, 1.0, nu) - 1.0) / n**2
    assert bent_bar(n, "quad", nu=nu, aspect=aspect) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("kind", "diagonal", "four", "eight"),
    [("quad", "both", 0.078, 0.020), ("tri", "both", 0.043, 0.011), ("tri", "alternate", 0.148, 0.037)],
)
def test_the_figures_of_the_page(kind, diagonal, four, eight):
    """docs/blocks.md: square cells, nu = 0.25."""
    found = bent_bar(4, kind, diagonal) - 1.0, bent_bar(8, kind, diagonal) - 1.0
    assert found == pytest.approx((four, eight), abs=5e-4)
    page = PAGE.read_text(encoding="utf-8").splitlines()
    lines = {line.split("|")[1].strip(): line for line in page if line.startswith("|") and " % |" in line}
    name = (
        "quads" if kind == "quad" else "triangles, both diagonals" if diagonal == "both" else "triangles, one diagonal"
    )
    assert f"| {100 * four:.1f} % | {100 * eight:.1f} % |" in lines[name]
