"""Fractures beside each other under one pressure shade each other: the stress beside a crack after Sneddon 1946;
openings and slip of two and three cracks with those of displacement discontinuities (Crouch 1976), and where they would
turn."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.flow.model import Flow
from tests.conftest import ROOT, absent
from tests.pcdc.test_time import Rock

YOUNG, POISSON, PRESSURE, HALF, CELLS = 30e9, 0.25, 1e6, 1.0, 20
"""HALF: length [m] of a wing, of so many edges."""
PLANE = YOUNG / (1.0 - POISSON**2)
SCRIPT = """
heights, a, n, far = HEIGHTS, 1.0, CELLS, 15.0
pcdc geometry create polygon (0,[-far]) ([far],[-far]) ([far],[far]) (0,[far]) as-layer 'outline'
for y in heights:
    pcdc geometry create polyline (0,[y]) ([a],[y]) as-layer 'cracks'
pcdc mesh create from-layer 'outline' size [far/6] refine-layer 'cracks' size [a/n] distance [far] \\
    crack 'cracks' irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young YOUNG poisson-r POISSON
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2e9 viscosity 1e-6 aperature-initial 1e-6 \\
    aperature-minumum 1e-6 range geometry 'cracks'
pcdc model option dynamic off large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x [far] [far]
for y in (-far, far):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [y] [y]
pcdc flow-node initial pressure PRESSURE
pcdc model solve elastic
"""


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A model with cracks at these heights, half of it by symmetry: a function."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")

    @cache
    def made(heights: tuple[float, ...]) -> Rock:
        text = SCRIPT.replace("HEIGHTS", repr(heights)).replace("CELLS", str(CELLS))
        for name, value in (("YOUNG", YOUNG), ("POISSON", POISSON), ("PRESSURE", PRESSURE)):
            text = text.replace(name, repr(value))
        return Rock(tmp_path_factory.mktemp("cracks"), text)

    return made


def parted(rock: Rock, height: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Along a crack: middles of its joints, their openings and slips (what is above over what is below) [m]."""
    sim = rock.blocks
    mesh, lower = sim.mesh, Flow.of(sim).network.channels
    places, moved, above = [], [], []
    for faces in (lower, sim.partner[lower]):
        e, k = np.divmod(faces, 4)
        corners = np.stack([k, (k + 1) % 3], axis=1)
        points = mesh.points[mesh.cells[e[:, None], corners]]
        now = np.stack([sim.x[sim.where[e][:, None], 2 * corners + axis] for axis in range(2)], axis=2)
        places.append(points.mean(axis=1))
        moved.append((now - points).mean(axis=1))
        above.append(mesh.centroids()[e, 1] > places[-1][:, 1])
    assert np.allclose(*places) and (above[0] != above[1]).all()
    apart = np.where(above[0][:, None], 1.0, -1.0) * (moved[0] - moved[1])
    on = np.flatnonzero(np.abs(places[0][:, 1] - height) < 1e-6)
    on = on[np.argsort(places[0][on, 0])]
    assert len(on) == CELLS
    return places[0][on, 0], apart[on, 1], apart[on, 0]


@cache
def discontinuities(heights: tuple[float, ...], n: int = 200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """n elements of constant opening and slip on each crack: places (n,), openings and slips (cracks, n) under the
    pressure, by the stresses that an element makes (Crouch and Starfield 1983, chapter 5)."""
    step = 2.0 * HALF / n
    x = -HALF + step * (np.arange(n) + 0.5)
    at = np.concatenate([np.column_stack([x, np.full(n, h)]) for h in heights])
    way = at[:, None] - at
    x1, x2, y = way[..., 0] + 0.5 * step, way[..., 0] - 0.5 * step, way[..., 1]
    one, two = x1**2 + y**2, x2**2 + y**2
    c, g = 1.0 / (4.0 * math.pi * (1.0 - POISSON)), YOUNG / (1.0 + POISSON)
    fyy = -c * (x2 / two - x1 / one)
    fxyy = c * ((x2**2 - y**2) / two**2 - (x1**2 - y**2) / one**2)
    fyyy = 2.0 * c * y * (x2 / two**2 - x1 / one**2)
    m = len(at)
    matrix = g * np.block([[fyy + y * fyyy, -y * fxyy], [-y * fxyy, fyy - y * fyyy]])
    found = -np.linalg.solve(matrix, np.concatenate([np.zeros(m), np.full(m, -PRESSURE)]))
    return x, found[m:].reshape(-1, n), found[:m].reshape(-1, n)


def turned(slip: float, opening: float) -> float:
    """Angle [degrees] at which a crack would leave its line, by slip and opening beside its right tip: that of the
    greatest hoop stress (Erdogan and Sih 1963)."""
    ratio = slip / opening
    return math.degrees(-2.0 * math.atan2(2.0 * ratio, 1.0 + math.sqrt(1.0 + 8.0 * ratio**2)))


def test_the_stress_beside_a_crack(pressed) -> None:
    """Sneddon 1946, by the function of Westergaard: on the axis of symmetry -p (1 - y^3 / (a^2 + y^2)^(3/2)) across the
    crack. Everywhere from 0.15 a to 4 a away from it and 0.3 a from its tip."""
    sim = pressed((0.0,)).blocks
    x, y = sim.mesh.centroids().T
    near = (np.abs(y) > 0.15) & (np.hypot(x, y) < 4.0) & (np.hypot(x - HALF, y) > 0.3)
    z = x[near] + 1j * np.abs(y[near])
    root = np.sqrt(z - HALF) * np.sqrt(z + HALF)
    real, turn = PRESSURE * (z / root - 1.0).real, np.abs(y[near]) * (-PRESSURE * HALF**2 / root**3).imag
    corners = sim.mesh.points[sim.mesh.cells[near, :3]]
    size = 0.5 * np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    # Means over squares of a / 2: stresses of neighbouring triangles differ, as strains are constant in each.
    _, box = np.unique(np.floor(np.column_stack([x[near], np.abs(y[near])]) / 0.5), axis=0, return_inverse=True)
    box = box.reshape(-1)
    many = np.bincount(box) >= 8
    errors = {}
    for name, wanted in (("stress_yy", real + turn), ("stress_xx", real - turn)):
        off = diagnostics.values(sim, name)[near] - wanted
        errors[name] = np.abs(np.bincount(box, size * off) / np.bincount(box, size))[many] / PRESSURE
    print({name: (each.mean(), each.max()) for name, each in errors.items()}, many.sum())
    assert many.sum() > 20
    for each in errors.values():
        assert each.mean() < 0.015 and each.max() < 0.04


@pytest.mark.parametrize("heights", [(-0.5, 0.5), (-1.0, 0.0, 1.0), (-0.5, 0.0, 0.5)])
def test_cracks_shade_each_other(pressed, heights) -> None:
    """Openings over that of a crack by itself; the middle one is the narrowest; the outer ones would turn away."""
    x, openings, slips = discontinuities(heights)
    single = parted(pressed((0.0,)), 0.0)[1][0]
    alone = discontinuities((0.0,))[1].max()
    assert alone == pytest.approx(4.0 * PRESSURE * HALF / PLANE, rel=3e-3)
    last = 0.8 * HALF  # four joints: those at the tip feel on which sides their triangles lie
    found, wanted, angles, expected = [], [], [], []
    for height, opening, slip in zip(heights, openings, slips):
        at, own, along = parted(pressed(heights), height)
        found.append(own[0] / single)
        wanted.append(np.interp(at[0], x, opening) / alone)
        angles.append(turned(along[at > last].sum(), own[at > last].sum()))
        expected.append(turned(slip[x > last].sum(), opening[x > last].sum()))
    print(heights, found, wanted, angles, expected)
    assert found == pytest.approx(wanted, abs=0.02)
    assert angles == pytest.approx(expected, abs=2.0)
    assert angles[0] < -10.0 and angles[-1] > 10.0
    if len(heights) == 3:
        assert found[1] < 0.6 * found[0] and abs(angles[1]) < 2.0


def draw(pressed, path: Path) -> None:
    """Left: stress across one crack on its axis of symmetry; right: openings of three cracks."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.0), layout="constrained")
    sim = pressed((0.0,)).blocks
    x, y = sim.mesh.centroids().T
    near = (x < 0.2) & (y > 0.1) & (y < 4.0)
    away = np.linspace(0.0, 4.0, 200)
    left.plot(
        y[near], -diagnostics.values(sim, "stress_yy")[near] / PRESSURE, "o", ms=3, color="0.4", label="triangles"
    )
    left.plot(away, 1.0 - away**3 / (1.0 + away**2) ** 1.5, "k", lw=1, label="Sneddon")
    left.set(xlabel="distance from the crack, over a", ylabel="compression across it, over p", ylim=(0.0, 1.02))
    heights, middle = (-0.5, 0.0, 0.5), 4e6 * PRESSURE * HALF / PLANE
    for row, (name, colour) in enumerate((("outer cracks", "C0"), ("middle crack", "C1"))):
        at, own, _ = parted(pressed(heights), heights[row])
        right.plot(at, 1e6 * own, "o", ms=3, color=colour, label=name)
        right.plot(discontinuities(heights)[0], 1e6 * discontinuities(heights)[1][row], color=colour, lw=1)
    right.plot(x0 := np.linspace(0.0, 1.0, 200), middle * np.sqrt(1.0 - x0**2), "k--", lw=1, label="one by itself")
    right.set(xlabel="distance from the well, over a", ylabel="opening (µm)", xlim=(0.0, 1.02), ylim=(0.0, None))
    for axes, letter in ((left, "a"), (right, "b")):
        axes.legend(frameon=False, fontsize=8)
        axes.set_title(f"({letter})", loc="left", fontsize=9)
    figure.savefig(path, dpi=200)
    plt.close(figure)


@pytest.mark.figures
def test_the_figure(pressed, tmp_path) -> None:
    draw(pressed, tmp_path / "stress_shadow.png")
    assert (tmp_path / "stress_shadow.png").stat().st_size > 20000
    assert "figures/stress_shadow.png" in (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert (ROOT / "docs" / "figures" / "stress_shadow.png").is_file()
