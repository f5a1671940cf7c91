"""Liners in space: flat shells without rock against their closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.structures import VELOCITY
from hpcdem.physics.liners import kernels, kernels_space, layout, shells
from hpcdem.physics.liners.model import Liners
from tests.blocks.support import model, rectangle
from tests.liners.sheets import at_rest, done, grid, pressed, ring, sheet, sphere, stiffness
from tests.liners.support import SHOTCRETE
from tests.space.support import body, hexes

YOUNG, NU, THICK = SHOTCRETE["young"], SHOTCRETE["poisson_ratio"], SHOTCRETE["thickness"]
PLATE = YOUNG * THICK**3 / (12.0 * (1.0 - NU**2))
X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z = range(6)


def values(liners, name: str) -> np.ndarray:
    return liners.values("liner-element", name)


def test_kernels_and_stiffness_are_the_same() -> None:
    """Forces of small displacements are those of the stiffness, which knows six rigid movements and no more; no force
    or moment comes from nowhere; masses hold for the time step."""
    _, liners = sheet(*grid(3, 3, 1.0, 1.2, 0.2))
    k = stiffness(liners)
    eigen = np.linalg.eigvalsh(k)
    assert (np.abs(eigen) < 1e-12 * eigen[-1]).sum() == 6 and eigen[0] > -1e-12 * eigen[-1]
    bound = np.repeat(2.0 * np.column_stack([liners._stiffness, liners._turning]), 3, axis=1).reshape(-1) ** -0.5
    assert 0.5 < np.linalg.eigvalsh(bound[:, None] * k * bound)[-1] < 1.0
    moved = 1e-7 * np.random.default_rng(1).normal(size=(len(liners), 6))
    done(liners, moved)
    force = -liners._total
    assert force == pytest.approx((k @ moved.reshape(-1)).reshape(-1, 6), abs=1e-5 * np.abs(force).max())
    size = np.abs(force).sum()
    assert np.abs(force[:, :3].sum(axis=0)).max() < 1e-12 * size
    assert np.abs((np.cross(liners.nodes["x"], force[:, :3]) + force[:, 3:]).sum(axis=0)).max() < 1e-11 * size
    assert liners._stored() == pytest.approx(0.5 * float(moved.reshape(-1) @ k @ moved.reshape(-1)), rel=1e-4)


def test_patch_of_constant_curvature_and_of_constant_strain() -> None:
    """On any mesh: w = (a x^2 + b y^2 + c x y) / 2 bends all of it alike, a linear field strains all of it alike."""
    _, liners = sheet(*grid(4, 3, 1.0, 1.2, 0.25))
    x, y, _ = liners.nodes["x"].T
    a, b, c = 1e-5, -2e-5, 3e-5
    moved = np.zeros((len(liners), 6))
    moved[:, Z] = 0.5 * (a * x * x + b * y * y + c * x * y)
    moved[:, ABOUT_X], moved[:, ABOUT_Y] = b * y + 0.5 * c * x, -(a * x + 0.5 * c * y)
    done(liners, moved)
    # The normal leans by -dw/dx: the side away from the rock is in tension where w'' is below 0.
    for name, moment in (("xx", a + NU * b), ("yy", b + NU * a), ("xy", 0.5 * (1.0 - NU) * c)):
        assert values(liners, f"bending_{name}") == pytest.approx(-PLATE * moment, abs=1e-6 * PLATE * 3e-5)
    for name in ("xx", "yy", "xy"):
        assert values(liners, f"membrane_{name}") == pytest.approx(0.0, abs=YOUNG * THICK * 1e-9)  # slope^2
    assert values(liners, "transverse_shear") == pytest.approx(0.0, abs=1e-6 * PLATE * 3e-5)
    _, liners = sheet(*grid(4, 3, 1.0, 1.2, 0.25))
    moved[:] = 0.0
    moved[:, X], moved[:, Y], moved[:, ABOUT_Z] = a * x + c * y, b * y, -0.5 * c
    done(liners, moved)
    part = YOUNG * THICK / (1.0 - NU**2)
    for name, strain in (("xx", a + NU * b), ("yy", b + NU * a), ("xy", 0.5 * (1.0 - NU) * c)):
        assert values(liners, f"membrane_{name}") == pytest.approx(part * strain, rel=2e-4)
    mean, half = 0.5 * part * (1.0 + NU) * (a + b), 0.5 * part * (1.0 - NU) * math.hypot(a - b, c)
    assert values(liners, "membrane_largest") == pytest.approx(mean + half, rel=2e-4)
    assert values(liners, "membrane_smallest") == pytest.approx(mean - half, rel=2e-4)
    assert np.abs(values(liners, "bending_largest")).max() < 1e-6 * PLATE * 1e-5


def deflection(count: int, clamped: bool) -> float:
    """In the middle of a square plate of 4 m under a uniform load, over q a^4 / D."""
    _, liners = sheet(*grid(count, count, 4.0, 4.0))
    x, y, _ = liners.nodes["x"].T
    sides, ends = (x == 0.0) | (x == 4.0), (y == 0.0) | (y == 4.0)
    held = np.zeros((len(liners), 6), bool)
    held[:, [X, Y, ABOUT_Z]] = True
    held[sides | ends, Z] = True
    held[sides, ABOUT_X] = held[ends, ABOUT_Y] = True
    if clamped:
        held[sides | ends, ABOUT_X] = held[sides | ends, ABOUT_Y] = True
    moved = at_rest(liners, pressed(liners, 10.0), held)
    return float(-moved[(x == 2.0) & (y == 2.0), Z][0] * PLATE / (10.0 * 4.0**4))


@pytest.mark.parametrize(("clamped", "exact", "coarse"), [(False, 0.00406235, -0.047), (True, 0.00126532, 0.093)])
def test_square_plates(clamped: bool, exact: float, coarse: float) -> None:
    """Timoshenko's w D / (q a^4), on supports and clamped, 4 x 4 and 8 x 8: the error falls by the square."""
    four, eight = (deflection(count, clamped) / exact - 1.0 for count in (4, 8))
    assert four == pytest.approx(coarse, abs=0.002)
    assert 3.0 < four / eight < 5.0


@pytest.mark.slow
@pytest.mark.parametrize(("clamped", "exact"), [(False, 0.00406235), (True, 0.00126532)])
def test_square_plates_on_a_fine_mesh(clamped: bool, exact: float) -> None:
    assert deflection(16, clamped) == pytest.approx(exact, rel=0.01)


def test_cantilever_strip() -> None:
    """P L^3 / (3 E I) and P L^2 / (2 E I) without Poisson's ratio, 100 N."""
    _, liners = sheet(*grid(4, 1, 2.0, 0.5), poisson_ratio=0.0)
    x, held, force = liners.nodes["x"][:, 0], np.zeros((len(liners), 6), bool), np.zeros((len(liners), 6))
    held[x == 0.0] = True
    force[x == 2.0, Z] = -50.0
    moved, ei = at_rest(liners, force, held), YOUNG * 0.5 * THICK**3 / 12.0
    assert moved[x == 2.0, Z].mean() == pytest.approx(-100.0 * 8.0 / (3.0 * ei), rel=0.003)
    assert moved[x == 2.0, ABOUT_Y].mean() == pytest.approx(100.0 * 4.0 / (2.0 * ei), rel=1e-6)
    moment = 0.5 * values(liners, "bending_xx").reshape(2, 4).mean(axis=0)  # of both triangles of a cell
    assert moment == pytest.approx([175.0, 125.0, 75.0, 25.0], rel=1e-3)
    assert 0.5 * values(liners, "transverse_shear").mean() == pytest.approx(100.0, rel=0.3)  # of single triangles


def test_rotation_by_any_angle_strains_nothing() -> None:
    """A bent and stretched sheet is turned as a whole, by 2.5 rad in five steps: its forces turn with it."""
    _, liners = sheet(*grid(3, 3, 1.0, 1.2, 0.2))
    rng, axis = np.random.default_rng(5), np.array([1.0, -2.0, 0.5]) / math.sqrt(5.25)
    done(liners, 1e-3 * rng.normal(size=(len(liners), 6)))
    force, total = liners.elements["force"].copy(), liners._total.copy()
    turn = np.empty((3, 3))
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(5):
        one = np.array([1.0, 0.0, 0.0, 0.0])
        kernels_space.turned(one, axis, 0.5)
        kernels_space.turned(q, axis, 0.5)
        kernels_space.matrix(one, turn)
        x = liners.nodes["x"]
        moved = np.column_stack([x @ turn.T + [0.1, 0.2, -0.3] - x, np.tile(0.5 * axis, (len(x), 1))])
        done(liners, moved)
    kernels_space.matrix(q, turn)
    assert liners.elements["force"] == pytest.approx(force, abs=1e-9 * np.abs(force).max())
    for part in (slice(0, 3), slice(3, 6)):
        assert liners._total[:, part] == pytest.approx(total[:, part] @ turn.T, abs=1e-9 * np.abs(total).max())
    assert shells.rotations(liners.nodes["posture"]).mean(axis=0) == pytest.approx(2.5 * axis, abs=1e-3)


@pytest.mark.parametrize(("around", "close"), [(16, 0.03), (32, 0.008)])
def test_tube_under_pressure(around: int, close: float) -> None:
    """N = p R around it, u = p R^2 (1 - nu^2) / (E t) where it is held along its axis."""
    p, r = 1e5, 2.5
    _, liners = sheet(*ring(around, r, 0.6))
    held = np.zeros((len(liners), 6), bool)
    held[:, [Y, ABOUT_X, ABOUT_Z]] = True
    x = liners.nodes["x"].copy()
    moved = at_rest(liners, pressed(liners, p), held, weak=True)  # the free side is inside
    outwards = (moved[:, [0, 2]] * x[:, [0, 2]]).sum(axis=1) / r
    assert outwards == pytest.approx(p * r**2 * (1.0 - NU**2) / (YOUNG * THICK), rel=close)
    assert values(liners, "membrane_largest") == pytest.approx(p * r, rel=close)
    assert values(liners, "membrane_yy") == pytest.approx(NU * p * r, rel=close)


def test_slice_of_a_ring_bends_as_beams_do() -> None:
    """A slice in plane strain under p cos 2 theta: w = p R^4 / (9 E I) and M = p R^2 / 3 of a ring that does not
    stretch, with E / (1 - nu^2) as beams have it."""
    error, p, r = [], 1e3, 2.5
    for around in (24, 48):
        _, liners = sheet(*ring(around, r, math.pi * r / around))
        x = liners.nodes["x"].copy()
        held = np.zeros((len(liners), 6), bool)
        held[:, [Y, ABOUT_X, ABOUT_Z]] = True
        wave = np.cos(2.0 * np.arctan2(x[:, 2], x[:, 0]))
        force = np.zeros((len(liners), 6))
        force[:, [X, Z]] = p * (math.pi * r / around) ** 2 * (wave / r)[:, None] * x[:, [X, Z]]
        moved = at_rest(liners, force, held, weak=True)
        outwards = (moved[:, [X, Z]] * x[:, [X, Z]]).sum(axis=1) / r
        error.append(2.0 * (outwards * wave).mean() / (p * r**4 / (9.0 * PLATE)) - 1.0)
        middle = x[liners.elements["ends"]].mean(axis=1)
        around_it = liners._element_value("bending_xx") + liners._element_value("bending_zz")
        moment = 2.0 * (around_it * np.cos(2.0 * np.arctan2(middle[:, 2], middle[:, 0]))).mean()
        assert abs(moment) == pytest.approx(p * r**2 / 3.0, rel=0.03 if around == 24 else 0.01)
    assert abs(error[1]) < 0.01 and abs(error[1]) < 0.5 * abs(error[0])


def test_sphere_under_pressure() -> None:
    """N = p R / 2, u = p R^2 (1 - nu) / (2 E t), on two meshes of unequal triangles."""
    p, r, error = 1e5, 2.0, []
    for times in (2, 3):
        _, liners = sheet(*sphere(times, r))
        assert len(liners) == 2 + 4 * 4**times and not (liners.nodes["liner"] > 0).any()  # closed, and one
        x = liners.nodes["x"].copy()
        moved = at_rest(liners, pressed(liners, p), np.zeros((len(liners), 6), bool), weak=True)
        inwards = -(moved[:, :3] * x).sum(axis=1) / r
        exact = p * r**2 * (1.0 - NU) / (2.0 * YOUNG * THICK)
        error.append(inwards.mean() / exact - 1.0)
        force = 0.5 * (values(liners, "membrane_largest") + values(liners, "membrane_smallest"))
        assert force.mean() == pytest.approx(-0.5 * p * r, rel=0.06 if times == 2 else 0.016)
    assert abs(error[1]) < 0.02 and 3.0 < error[0] / error[1] < 5.0


def test_frequency_of_a_square_plate() -> None:
    """omega = 2 pi^2 / a^2 sqrt(D / (rho t)) of a plate on four supports, in motion, 6 x 6 and 12 x 12."""
    exact = 2.0 * math.pi**2 * math.sqrt(PLATE / (2400.0 * THICK)) / 4.0**2
    error = []
    for count in (6, 12):
        _, liners = sheet(*grid(count, count, 4.0, 4.0))
        x, y, _ = liners.nodes["x"].T
        sides, ends = (x == 0.0) | (x == 4.0), (y == 0.0) | (y == 4.0)
        free = np.ones((len(liners), 6), bool)
        free[:, [X, Y, ABOUT_Z]] = False
        free[sides | ends, Z] = False
        free[sides, ABOUT_X] = free[ends, ABOUT_Y] = False
        mass = np.repeat(np.column_stack([liners._true_mass, liners._true_inertia]), 3, axis=1)[free] ** -0.5
        k = stiffness(liners)[np.ix_(free.reshape(-1), free.reshape(-1))]
        lowest = math.sqrt(np.linalg.eigvalsh(mass[:, None] * k * mass)[0])
        error.append(lowest / exact - 1.0)
    assert abs(error[1]) < 0.012 and 3.0 < error[0] / error[1] < 5.5


def test_a_plate_swings_as_its_stiffness_says() -> None:
    """Half a period of the first wave of a 4 x 4 plate in motion."""
    sim, liners = sheet(*grid(4, 4, 4.0, 4.0), dynamic=True)
    sim.time_step(2e-5)
    x, y, _ = liners.nodes["x"].T
    sides, ends = (x == 0.0) | (x == 4.0), (y == 0.0) | (y == 4.0)
    liners.condition(np.arange(len(x)), does_x=VELOCITY, does_y=VELOCITY, does_turn=VELOCITY)
    liners.condition(np.flatnonzero(sides | ends), does_z=VELOCITY)
    liners.condition(np.flatnonzero(sides), does_turn_x=VELOCITY)
    liners.condition(np.flatnonzero(ends), does_turn_y=VELOCITY)
    wave = np.sin(0.25 * math.pi * x) * np.sin(0.25 * math.pi * y)
    lean = 0.25 * math.pi * np.sin(0.25 * math.pi * np.stack([x, y])) * np.cos(0.25 * math.pi * np.stack([y, x]))
    liners.nodes["v"][:, 2] = 1e-3 * wave
    liners.nodes["spin"][:, :2] = 1e-3 * lean[[0, 1]].T * [1.0, -1.0]
    middle, height = int(np.flatnonzero((x == 2.0) & (y == 2.0))[0]), [0.0]
    while height[-1] >= 0.0 and len(height) < 3000:
        sim.step()
        height.append(float(liners.nodes["x"][middle, 2]))
    exact = 2.0 * math.pi**2 * math.sqrt(PLATE / (2400.0 * THICK)) / 4.0**2
    assert math.pi / (exact * 2e-5 * len(height)) == pytest.approx(0.93, abs=0.03)
    assert max(height) == pytest.approx(1e-3 / exact, rel=0.15)


@pytest.mark.slow
def test_a_strip_rolls_up() -> None:
    """A moment M = E I theta / L at the end of a strip of 12 x 1 makes a quarter of an arc of it, which stretches
    nothing: the end lies on the polygon of the arc."""
    sim, liners = sheet(*grid(12, 1, 2.0, 0.25), poisson_ratio=0.0)
    x, theta = liners.nodes["x"][:, 0].copy(), 0.5 * math.pi
    liners.condition(np.flatnonzero(x == 0.0), does_x=VELOCITY, does_y=VELOCITY, does_z=VELOCITY,
                     does_turn_x=VELOCITY, does_turn_y=VELOCITY, does_turn=VELOCITY)  # fmt: skip
    end, ei = np.flatnonzero(x == 2.0), YOUNG * 0.25 * THICK**3 / 12.0
    for part in np.linspace(0.1, 1.0, 10):  # in steps, so that it is not thrown round
        liners.condition(end, moment_y=float(-0.5 * part * theta * ei / 2.0))
        convergence.advance(sim, 1000)
    assert convergence.solve(sim, ratio=1e-7, cycles=60_000).reason == "ratio"
    assert -liners.values("liner-node", "rotation_y")[end] == pytest.approx(theta, rel=0.01)
    chord = 2.0 / 12.0 * math.sin(theta / 2.0) / math.sin(theta / 24.0)
    at = liners.nodes["x"][end].mean(axis=0)
    assert math.hypot(at[0], at[2]) == pytest.approx(chord, rel=0.005)
    assert np.abs(values(liners, "membrane_largest")).max() < 1e-4 * YOUNG * THICK


def test_yield_of_the_membrane_is_nearest_by_energy() -> None:
    """By trying: nothing that is allowed lies nearer, by the energy of the elastic difference."""
    rng, nu = np.random.default_rng(2), 0.3
    grid_ = np.linspace(0.0, 1.0, 21)
    for _ in range(300):
        low, low_2 = -rng.uniform(0.5, 3.0, 2)
        high, high_2 = rng.uniform(0.1, 1.0, 2)
        first, second = rng.uniform(-6.0, 6.0, 2)
        p, q = kernels_space.returned(first, second, low, high, low_2, high_2, nu)
        assert low <= p <= high and low_2 <= q <= high_2

        def energy(a, b, first=first, second=second):
            return (first - a) ** 2 + (second - b) ** 2 - 2.0 * nu * (first - a) * (second - b)

        others = energy((low + grid_ * (high - low))[:, None], (low_2 + grid_ * (high_2 - low_2))[None])
        assert energy(p, q) <= others.min() + 1e-12


@pytest.mark.parametrize(
    ("along", "yields", "bit"), [(1.0, 0.2e6, kernels.IN_TENSION), (-1.0, -3e6, kernels.IN_COMPRESSION)]
)
def test_a_strip_yields(along: float, yields: float, bit: int) -> None:
    """ft t = 0.2 MN/m, fc t = 3 MN/m, pulled and pressed; then bent: with force, ft fc t^2 / (2 (ft + fc)) = 9.375
    kN m/m without, and what of the work is not stored is lost."""
    strength = {"tensile_strength": 2e6, "compressive_strength": 30e6, "poisson_ratio": 0.0}
    _, liners = sheet(*grid(3, 1, 1.0, 0.5), **strength)
    moved = np.zeros((len(liners), 6))
    moved[:, X] = along * 4e-3 * liners.nodes["x"][:, 0]
    lost = sum(done(liners, part * moved)[kernels.IN_BEAMS] for part in [0.01] * 100)
    name = "membrane_largest" if along > 0.0 else "membrane_smallest"
    assert values(liners, name) == pytest.approx(yields, rel=1e-12)
    assert (liners.elements["state"] == bit | kernels.HAS_YIELDED).all()
    plastic = 4e-3 - abs(yields) / (YOUNG * THICK)
    assert values(liners, "plastic_strain") == pytest.approx(plastic, rel=0.01)
    assert lost == pytest.approx(0.5 * abs(yields) * plastic, rel=0.01)
    _, liners = sheet(*grid(3, 1, 1.0, 0.5), **strength)
    x, lost = liners.nodes["origin"][:, 0], 0.0
    for bent in np.linspace(4e-4, 0.02, 50):  # an arc of this curvature
        moved[:, X] = np.sin(bent * x) / bent - liners.nodes["x"][:, 0]
        moved[:, Z], moved[:, ABOUT_Y] = (np.cos(bent * x) - 1.0) / bent - liners.nodes["x"][:, 2], 4e-4 * x
        lost += done(liners, moved)[kernels.IN_BEAMS]
    assert values(liners, "bending_largest") == pytest.approx(9375.0, rel=0.02)
    assert (liners.elements["state"] & kernels.BENDS > 0).all()
    assert values(liners, "plastic_curvature") == pytest.approx(0.02 - 9375.0 / (YOUNG * THICK**3 / 12.0), rel=0.03)
    assert lost == pytest.approx(0.5 * 9375.0 * (0.02 - 9375.0 / (YOUNG * THICK**3 / 12.0)), rel=0.05)


def test_faces_are_joined_along_edges() -> None:
    """Two triangles at an edge have two nodes together, at a point alone none; three at an edge are parted; what was
    there keeps its nodes."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 2, 0), (1, 2, 0), (0, 0, 1)], np.float64)

    def nodes(faces, old=(), of_old=(), at=()):
        faces, old, of_old = (np.array(one, np.int64).reshape(-1, 3) for one in (faces, old, of_old))
        return layout.joined(faces, points[faces], old, of_old, np.array(at, np.float64).reshape(-1, 3))

    ends, label, parted = nodes([(0, 1, 2), (0, 2, 3), (2, 4, 5)])
    assert ends.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]] and label.tolist() == [0, 0, 1] and parted == 0
    ends, label, parted = nodes([(0, 1, 2), (0, 2, 3), (2, 0, 6)])
    assert len(np.unique(ends)) == 9 and parted == 1 and label.tolist() == [0, 1, 2]
    ends, _, parted = nodes([(0, 2, 3)], [(0, 1, 2)], [(0, 1, 2)], points[:3])
    assert ends.tolist() == [[0, 2, 3]] and parted == 0
    ends, _, parted = nodes([(0, 2, 3)], [(0, 1, 2)], [(0, 1, 2)], points[:3] + [0.0, 0.0, 0.5])
    assert ends.tolist() == [[3, 4, 5]] and parted == 1  # it has come apart


def polar(mesh: Mesh) -> Mesh:
    """Points of a box from 0 to 1 in x and y: a quarter of a ring from 2 m to 20 m about z."""
    points = mesh.points.copy()
    r, angle = 2.0 * 10.0 ** points[:, 0], 0.5 * math.pi * points[:, 1]
    points[:, 0], points[:, 1] = r * np.cos(angle), r * np.sin(angle)
    return Mesh.of(points, mesh.cells, macros=mesh.macros)


def quarter(mesh: Mesh) -> tuple[Liners, np.ndarray]:
    """A quarter of a tunnel in elastic rock under 100 kPa and half of it, lined before anything moves, at rest; the
    middles of its elements."""
    sim, dim = model(mesh) if mesh.dim == 2 else body(mesh), mesh.dim
    sim.element_property(None, {"young": 2e9, "poisson_ratio": 0.3})
    sim.option(dynamic=False, collision=False)
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(np.hypot(x, y) > 19.99), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    if dim == 3:
        sim.velocity_condition(None, vz=0.0)
    sim.initial_stress(None, xx=-5e4, yy=-1e5, xy=0.0)
    edges = mesh.edges()
    on = (np.hypot(*np.moveaxis(mesh.points[edges.points][:, :, :2], 2, 0)) < 2.0001).all(axis=1)
    liners = Liners.of(sim)
    _, elements = liners.create(edges.faces[on & ~edges.inner, 0])
    liners.assign(elements, {**SHOTCRETE, "thickness": 0.3, "normal_stiffness": 2e11, "shear_stiffness": 2e11})
    at = liners.nodes["origin"]
    if dim == 3:
        liners.condition(np.arange(len(at)), does_z=VELOCITY, does_turn_x=VELOCITY, does_turn_y=VELOCITY)
    liners.condition(np.flatnonzero(at[:, 1] < 1e-9), does_y=VELOCITY, does_turn=VELOCITY)
    liners.condition(np.flatnonzero(at[:, 0] < 1e-9), does_x=VELOCITY, does_turn=VELOCITY)
    assert convergence.solve(sim, ratio=1e-6, cycles=60_000).reason == "ratio"
    return liners, at[liners.elements["ends"]].mean(axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(("sides", "close"), [(12, 0.06), (24, 0.02)])
def test_a_lined_tunnel_is_that_of_the_plane(sides: int, close: float) -> None:
    """A slice of hexahedra and shells as quads and beams: thrust, its wave and that of the moment."""
    flat = quarter(polar(rectangle(sides, sides, 1.0, 1.0, kind="quad")))
    deep = quarter(polar(hexes((sides, sides, 1), (1.0, 1.0, 3.0 / sides))))
    found = []
    for liners, middle in (flat, deep):
        wave = np.cos(2.0 * np.arctan2(middle[:, 1], middle[:, 0]))
        if liners.blocks.dim == 2:
            thrust = liners.values("liner-element", "axial_force")
            ends = [liners.values("liner-element", f"moment_{end}") for end in ("first", "last")]
            moment = 0.5 * (ends[0] + ends[1])
        else:
            both = [[values(liners, f"{name}_{c}") for c in ("xx", "yy")] for name in ("membrane", "bending")]
            thrust, moment = np.sum(both, axis=1)
        found.append([thrust.mean(), 2.0 * (thrust * wave).mean(), 2.0 * (moment * wave).mean()])
    assert found[1] == pytest.approx(found[0], rel=close)
