"""Elastic bodies in space against closed forms. Values of a box 10 x 1 x 1, of a hollow sphere and of a cavity were
computed from the solutions that are named."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.pre.mesh import fill, solids
from tests.space.support import LAME, ROCK, SHEAR, body, box, faces_on, nodes_on

YOUNG, POISSON, DENSITY = ROCK["young"], ROCK["poisson_ratio"], ROCK["density"]


def vector(sim, name: str, where=None) -> np.ndarray:
    return np.array([diagnostics.values(sim, f"{name}_{axis}", where) for axis in "xyz"]).T


@pytest.mark.parametrize("held", ["sides", "sides across", "nothing"])
def test_the_speed_of_waves(held: str) -> None:
    """A step of velocity runs along a bar: a P wave where nothing moves across, an S wave where only one direction
    across is free, a bar wave with free sides (long beside the width). sqrt of (lambda + 2 mu) / rho 4714.05 m/s, mu /
    rho 2721.66, E / rho 4303.31."""
    n, step = 100, 0.1
    mesh = box((n, 1, 1), (n * step, step, step), 12)
    sim = body(mesh, damp_factor=0.1)
    moves = {"sides": "x", "sides across": "z", "nothing": "x"}[held]
    still = {"sides": "yz", "sides across": "xy", "nothing": ""}[held]
    if still:
        sim.velocity_condition(None, **{f"v{axis}": 0.0 for axis in still})
    sim.velocity_condition(nodes_on(mesh, "left"), **{f"v{moves}": 0.01})
    expected = {"sides": (LAME + 2.0 * SHEAR), "sides across": SHEAR, "nothing": YOUNG}[held]
    speed = np.sqrt(expected / DENSITY)
    far, near = nodes_near(mesh, 7.0), nodes_near(mesh, 3.0)
    came = {}
    while len(came) < 2:
        sim.step()
        for where, nodes in (("near", near), ("far", far)):
            if where not in came and diagnostics.values(sim, f"velocity_{moves}", nodes).mean() > 0.005:
                came[where] = sim.clock.time
        assert sim.clock.time < 1.2 * n * step / speed
    assert 4.0 / (came["far"] - came["near"]) == pytest.approx(speed, rel=0.01)


def nodes_near(mesh: Mesh, x: float) -> np.ndarray:
    return np.flatnonzero(np.abs(mesh.points[:, 0] - x) < 1e-9)


def test_a_column_under_its_weight() -> None:
    """u(H) = rho g H^2 / 2E on rollers, stress rho g (H - z), reaction the whole weight."""
    mesh = box((2, 2, 10), (0.4, 0.4, 2.0))
    sim = body(mesh, dynamic=False)
    for side, axis in (("bottom", "z"), ("left", "x"), ("front", "y")):
        sim.velocity_condition(nodes_on(mesh, side), **{f"v{axis}": 0.0})
    sim.gravity(0.0, 0.0, -9.81)
    assert convergence.solve(sim, ratio=1e-8).reason == "ratio"
    top = diagnostics.values(sim, "displacement_z", nodes_on(mesh, "top")).mean()
    assert top == pytest.approx(-DENSITY * 9.81 * 4.0 / (2.0 * YOUNG), rel=0.01)
    weight = DENSITY * 0.4 * 0.4 * 2.0 * 9.81
    assert diagnostics.total(sim, "reaction_z") == pytest.approx(weight, rel=1e-6)
    z = diagnostics.values(sim, "element_position_z")
    rho_g = DENSITY * 9.81
    assert np.abs(diagnostics.values(sim, "stress_zz") + rho_g * (2.0 - z)).max() < 0.06 * rho_g * 2.0


@pytest.mark.parametrize("component", ["xx", "yy", "zz"])
def test_stress_on_faces(component: str) -> None:
    """Each component of a stress on all faces of a body that nothing holds is the stress in it, and pressure along the
    normal the same as three of them."""
    mesh = box((3, 2, 2), (1.2, 0.8, 0.9), shaken=0.2)
    sim = body(mesh, dynamic=False)
    faces = np.concatenate([faces_on(mesh, side) for side in mesh.layers])
    sim.stress_condition(faces, **{component: -2e6, "normal": -1e6})
    convergence.solve(sim, ratio=1e-9)
    for name in ("xx", "yy", "zz", "xy", "xz", "yz"):
        expected = (-3e6 if name == component else -1e6) if name[0] == name[1] else 0.0
        assert np.abs(diagnostics.values(sim, f"stress_{name}") - expected).max() < 2e-4 * 3e6, name


def test_a_cantilever_is_as_stiff_as_constant_strains_are() -> None:
    """10 x 1 x 1 m, 100 kN across its end: 8.0590 mm by beam theory with shear; so much of it with two boxes of six
    tetrahedra across, as of other programs with these elements. Finer, at once: tests/cases/solids."""
    mesh = box((20, 2, 2), (10.0, 1.0, 1.0))
    sim = body(mesh, dynamic=False)
    sim.move_constraint(nodes_on(mesh, "left"), 1)
    sim.stress_condition(faces_on(mesh, "right"), xz=-1e5)
    convergence.solve(sim, ratio=1e-6, limit=0, window=0)
    end = diagnostics.values(sim, "displacement_z", nodes_on(mesh, "right")).mean()
    assert -end / 8.0590e-3 == pytest.approx(0.527, abs=0.01)


def octant(inner: float, outer: float, size: float, fine: float) -> Mesh:
    """An eighth of a hollow sphere."""
    cube, hole = solids.made("box", (0, 0, 0), (outer, outer, outer)), solids.made("sphere", (0, 0, 0), inner)
    rim = solids.made("sphere", (0, 0, 0), outer)
    wishes = fill.MeshSettings([rim], size, [hole], [("eighth", [cube])], [([hole], fine, 2.0)])
    found = fill.filled(wishes, "rest")
    points, keep = found.points, found.cells[found.groups["eighth"]]
    used, numbers = np.unique(keep, return_inverse=True)
    return Mesh.of(points[used], numbers.reshape(-1, 4))


@pytest.mark.slow
def test_a_hollow_sphere_under_pressure() -> None:
    """Lame: radii 1 and 3, pressure 10 MPa inside. Walls s_t 5.57692 and 0.57692 MPa, u 1.33654e-4 and 2.59615e-5 m; at
    r 1.5 s_r -2.69231, s_t 1.92308, at 2 -0.91346, 1.03365."""
    mesh = octant(1.0, 3.0, 0.3, 0.045)
    sim = body(mesh, dynamic=False)
    inner = held_by_symmetry(sim)
    sim.stress_condition(inner, normal=-10e6)
    assert convergence.solve(sim, ratio=1e-6).reason == "ratio"
    walls = wall_displacements(sim)
    assert walls == pytest.approx([1.33654e-4, 2.59615e-5], rel=0.01)
    radius, rr, tt, volume = spherical_stresses(sim)
    for at, radial, tangential in ((1.5, -2.69231e6, 1.92308e6), (2.0, -0.91346e6, 1.03365e6)):
        shell = np.abs(radius - at) < 0.1
        cube = (radius[shell] / at) ** 3  # both stresses are a constant and a part that falls with r^-3
        exact = [np.average(a + b / cube, weights=volume[shell]) for a, b in _parts(at, radial, tangential)]
        found = [np.average(part[shell], weights=volume[shell]) for part in (rr, tt)]
        assert np.allclose(found, exact, rtol=0.02)


def held_by_symmetry(sim: Blocks) -> np.ndarray:
    """The planes of an eighth of a hollow sphere of the inner radius 1 stay planes; the faces of its inner wall."""
    mesh = sim.mesh
    for k, axis in enumerate("xyz"):
        sim.velocity_condition(np.flatnonzero(np.abs(mesh.points[:, k]) < 1e-9), **{f"v{axis}": 0.0})
    edges = mesh.edges()
    free = edges.faces[~edges.inner, 0]
    r = np.linalg.norm(mesh.points[mesh.face_points(free)], axis=2)
    return free[(np.abs(r - 1.0) < 1e-6).all(axis=1)]


def wall_displacements(sim: Blocks) -> list[float]:
    """Mean radial displacements of the walls of radii 1 and 3 [m]."""
    place = np.linalg.norm(sim.mesh.points, axis=1)
    out = (vector(sim, "displacement") * sim.mesh.points).sum(axis=1) / place
    return [float(out[np.abs(place - r) < 1e-6].mean()) for r in (1.0, 3.0)]


def spherical_stresses(sim: Blocks) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Radius [m] of the middle of each element, radial and mean tangential stress [Pa] there, volume [m3]."""
    middle = sim.mesh.centroids()
    radius = np.linalg.norm(middle, axis=1)
    n = middle / radius[:, None]
    s = {c: diagnostics.values(sim, f"stress_{c}") for c in ("xx", "yy", "zz", "xy", "xz", "yz")}
    rr = sum(s[a + a] * n[:, k] ** 2 for k, a in enumerate("xyz")) + 2.0 * (
        s["xy"] * n[:, 0] * n[:, 1] + s["xz"] * n[:, 0] * n[:, 2] + s["yz"] * n[:, 1] * n[:, 2]
    )
    return radius, rr, 0.5 * (s["xx"] + s["yy"] + s["zz"] - rr), diagnostics.values(sim, "volume")


@pytest.mark.slow
@pytest.mark.parametrize("dilation", [0.0, 20.0])
def test_a_hollow_sphere_that_yields(dilation: float) -> None:
    """Pressure inside a sphere of radii 1 and 3 that yields after Mohr and Coulomb up to the radius c = 1.6. There
    N s_t - s_r = k, so s_r = Y - (p + Y) r^(-2 (N - 1) / N), Y = k / (N - 1); outside Lame's stresses, which reach the
    strength at c. Both tangential plastic strains are half of m times the radial one without its sign, so m u' +
    2 u / r is that of the elastic strains. (Compare Hill 1950, V.2; Yu 2000, Cavity Expansion Methods, 3.2.)"""
    young, poisson, friction, cohesion, c, b = 10e9, 0.25, 30.0, 5e6, 1.6, 3.0
    n, m = (np.tan(np.pi / 4.0 + 0.5 * np.radians(angle)) ** 2 for angle in (friction, dilation))
    k = 2.0 * cohesion * np.sqrt(n)
    y, power = k / (n - 1.0), 2.0 * (n - 1.0) / n
    a = k / (n - 1.0 + (b / c) ** 3 * (1.0 + 0.5 * n))
    pressure = (y - a * (1.0 - (b / c) ** 3)) * c**power - y

    def stresses(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radial and tangential [Pa]."""
        inside = y - (pressure + y) * r**-power
        radial = np.where(r < c, inside, a * (1.0 - (b / r) ** 3))
        return radial, np.where(r < c, (k + inside) / n, a * (1.0 + 0.5 * (b / r) ** 3))

    def way(r: float) -> float:
        """Elastic displacement [m]."""
        radial, tangential = stresses(np.array(r))
        return float(r * (tangential * (1.0 - poisson) - poisson * radial) / young)

    r = np.linspace(1.0, c, 20001)
    radial, tangential = stresses(r)
    strains = (radial - 2.0 * poisson * tangential) / young, (tangential * (1.0 - poisson) - poisson * radial) / young
    rest = (m * strains[0] + 2.0 * strains[1]) * r ** (2.0 / m) / m
    exact = [c ** (2.0 / m) * way(c * (1.0 + 1e-12)) - float(scipy.integrate.trapezoid(rest, r)), way(b)]

    mesh = octant(1.0, b, 0.3, 0.06)
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    soil = {"density": DENSITY, "young": young, "poisson_ratio": poisson, "tensile": 1e12}
    changes.element_model(
        sim, None, "mech_mohr_coulomb", {**soil, "friction": friction, "cohesion": cohesion, "dilation": dilation}
    )
    sim.option(collision=False, dynamic=False)
    inner = held_by_symmetry(sim)
    for part in np.linspace(0.1, 1.0, 10):
        sim.stress_condition(inner, normal=-part * pressure)
        assert convergence.solve(sim, ratio=1e-5).reason == "ratio"
    walls = wall_displacements(sim)
    assert walls == pytest.approx(exact, rel=0.02)
    radius, rr, tt, volume = spherical_stresses(sim)
    yields = diagnostics.values(sim, "plastic_shear_strain") > 1e-7
    front = (1.0 + 6.0 / np.pi * volume[yields].sum()) ** (1.0 / 3.0)
    assert front == pytest.approx(c, rel=0.02)
    for at in (1.15, 1.35, 1.8, 2.2):
        shell = np.abs(radius - at) < 0.1
        expected = [np.average(part, weights=volume[shell]) for part in stresses(radius[shell])]
        found = [np.average(part[shell], weights=volume[shell]) for part in (rr, tt)]
        assert np.abs(np.array(found) - expected).max() < 0.02 * pressure


def _parts(at: float, radial: float, tangential: float) -> list[tuple[float, float]]:
    """Constants and what falls with (r / at)^-3 of both stresses: A - 2 B, A + B."""
    b = (tangential - radial) / 3.0
    a = tangential - b
    return [(a, -2.0 * b), (a, b)]
