"""Heat and thermal stress in spheres of tetrahedra against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence, equilibrium
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from hpcdem.pre.mesh import fill, solids, structured_space
from tests.heat import exact
from tests.heat.support import temperatures
from tests.space.support import body, faces_on, nodes_on
from tests.space.test_solutions import spherical_stresses

ROCK = {"density": 2700.0, "young": 50e9, "poisson_ratio": 0.25}
TABLE = {
    0.1: (0.2929, 0.35338, 0.52551, 0.76808), 0.2: (0.72292, 0.75035, 0.82313, 0.91647),
    0.4: (0.96141, 0.96525, 0.97543, 0.98842),
}  # fmt: skip
"""Temperature of a sphere at r / R = 0, 0.25, 0.5, 0.75 over that of its surface, by Fourier number."""


def eighth(size: float) -> Mesh:
    """Of a full sphere of radius 1."""
    cube, rim = solids.made("box", (0, 0, 0), (1.0, 1.0, 1.0)), solids.made("sphere", (0, 0, 0), 1.0)
    found = fill.filled(fill.MeshSettings([rim], size, regions=[("eighth", [cube])]), "rest")
    used, numbers = np.unique(found.cells[found.groups["eighth"]], return_inverse=True)
    return Mesh.of(found.points[used], numbers.reshape(-1, 4))


def test_a_sphere_that_is_heated() -> None:
    """Explicit steps; 1 % of the surface's temperature everywhere; the table of values is the series."""
    mesh = eighth(0.11)
    sim = body(mesh)
    sim.parts(mechanical=False)
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 2.7, "capacity": 1000.0})
    r = np.linalg.norm(mesh.points, axis=1)
    heat.prescribe(np.flatnonzero(r > 1.0 - 1e-6), 100.0)
    diffusivity = 2.7 / (ROCK["density"] * 1000.0)
    for fourier, values in TABLE.items():
        time = fourier / diffusivity
        series = exact.sphere(np.array([0.0, 0.25, 0.5, 0.75]), time, 1.0, diffusivity)
        assert series == pytest.approx(values, abs=6e-6)
        sim.close_model()
        steps = math.ceil((time - heat.time) / (0.5 * heat.limit()))
        sim.heat_clock(dt=(time - heat.time) / steps)
        for _ in range(steps):
            sim.step()
        error = temperatures(sim) / 100.0 - exact.sphere(r, time, 1.0, diffusivity)
        assert np.abs(error).max() < 0.01, fourier
    assert heat.account()["relative"] < 1e-12


def part_of_a_shell(kind: str, across: int, along: int, inner: float = 0.1, outer: float = 0.5) -> Mesh:
    """Where x >= y >= 0 and x >= z >= 0, a 24th of it: four planes through the middle and two spheres (left, right)."""
    line = np.linspace(0.0, 1.0, across + 1)
    lines = np.geomspace(inner, outer, along + 1), line, line
    made = structured_space.box(lines, 12) if kind == "tet" else structured_space.hexes(lines)
    r, a, b = made.points.T
    way = np.column_stack([np.ones(len(r)), np.tan(0.25 * math.pi * a), np.tan(0.25 * math.pi * b)])
    points = r[:, None] * way / np.linalg.norm(way, axis=1)[:, None]
    return Mesh.of(points, made.cells, made.groups, made.layers, macros=made.hexes)


def hold_by_symmetry(sim: Blocks) -> None:
    """The four planes stay planes, their edges lines."""
    x, y, z = sim.mesh.points.T
    planes = {
        (0.0, 1.0, 0.0): np.abs(y) < 1e-9, (0.0, 0.0, 1.0): np.abs(z) < 1e-9, (1.0, -1.0, 0.0): np.abs(x - y) < 1e-9,
        (1.0, 0.0, -1.0): np.abs(x - z) < 1e-9,
    }  # fmt: skip
    for normal, on in planes.items():
        sim.move_constraint(np.flatnonzero(on), 3, normal)
    normals = list(planes)
    for i, j in ((0, 1), (0, 3), (1, 2), (2, 3)):
        both = planes[normals[i]] & planes[normals[j]]
        sim.move_constraint(np.flatnonzero(both), 2, tuple(np.cross(normals[i], normals[j]).tolist()))


def warmer_inside(mesh: Mesh) -> Blocks:
    """100 and 0 K at its walls, in the steady state."""
    sim = body(mesh, dynamic=True)
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 3.0, "capacity": 1000.0, "expansion_coeficient": 1e-5})
    heat.prescribe(nodes_on(mesh, "left"), 100.0)
    heat.prescribe(nodes_on(mesh, "right"), 0.0)
    sim.parts(mechanical=False)
    run = Implicit(sim)
    run.steady()
    run.close()
    return sim


@pytest.mark.parametrize("kind", ["tet", "hex"])
def test_heat_through_a_hollow_sphere(kind: str) -> None:
    """Radii 0.1 and 0.5 m, 100 and 0 K: the steady state within 0.5 %, 471.24 W through it."""
    mesh = part_of_a_shell(kind, 7, 28)
    sim = warmer_inside(mesh)
    heat, left, right = Heat.of(sim), nodes_on(mesh, "left"), nodes_on(mesh, "right")
    r = np.linalg.norm(mesh.points, axis=1)
    assert np.abs(temperatures(sim) - 100.0 * exact.hollow_sphere(r, 0.1, 0.5)).max() < 0.5
    for at, value in ((0.15, 58.33), (0.2, 37.5), (0.3, 16.67)):
        assert 100.0 * exact.hollow_sphere(np.array(at), 0.1, 0.5) == pytest.approx(value, abs=5e-3)
    before = heat.account()["given"]
    sim.heat_clock(dt=1.0)
    heat.remove_conditions(right)
    heat.prescribe(right, 0.0)  # an explicit step of the steady state: what comes in at one wall goes out at the other
    stored = heat.account()["stored"]
    sim.step()
    assert heat.account()["stored"] == pytest.approx(stored, rel=1e-9)
    assert heat.account()["given"] == pytest.approx(before, rel=1e-9)
    heat.remove_conditions(left)
    heat.remove_conditions(right)
    heat.expose(faces_on(mesh, "left"), flux=471.24 / (4.0 * math.pi * 0.01))
    heat.expose(faces_on(mesh, "right"), environment=0.0, transfer=1e7)
    run = Implicit(sim)
    run.steady()
    run.close()
    inside = temperatures(sim)[left].mean()
    assert inside == pytest.approx(100.0, rel=0.01)


@pytest.mark.parametrize("kind", ["tet", "hex"])
def test_thermal_stress_of_a_hollow_sphere(kind: str) -> None:
    """Within 2 % of the largest: at r 0.15, 0.2, 0.3 radial -19.514, -17.137, -9.16, tangential -21.605, -8.905, 0.996
    MPa, -59.14 at the inner wall."""
    sim = warmer_inside(part_of_a_shell(kind, 5, 18))
    sim.parts(mechanical=True, thermal=False)
    sim.option(dynamic=False)
    hold_by_symmetry(sim)
    if kind == "tet":
        assert convergence.solve(sim, ratio=1e-5).reason == "ratio"
    else:
        equilibrium.solve_elastic(sim)
    radius, radial, tangential, volume = spherical_stresses(sim)
    unit = ROCK["young"] * 1e-5 * 100.0 / (1.0 - ROCK["poisson_ratio"])
    for at, first, second in ((0.15, -19.514, -21.605), (0.2, -17.137, -8.905), (0.3, -9.16, 0.996)):
        assert 1e-6 * unit * np.array(exact.hollow_sphere_stress(np.array(at), 0.1, 0.5)) == pytest.approx(
            (first, second), abs=1e-3
        )
    largest = 59.14e6
    edges = np.geomspace(0.1, 0.5, 12)
    for low, high in pairwise(edges):
        shell = (radius >= low) & (radius < high)
        wanted = [np.average(part[shell], weights=volume[shell]) for part in exact_at(radius, unit)]
        found = [np.average(part[shell], weights=volume[shell]) for part in (radial, tangential)]
        assert np.abs(np.array(found) - wanted).max() < 0.02 * largest, (low, found, wanted)


def exact_at(radius: np.ndarray, unit: float) -> list[np.ndarray]:
    return [unit * part for part in exact.hollow_sphere_stress(radius, 0.1, 0.5)]
