"""Tetrahedra and hexahedra that yield after Mohr and Coulomb: the return against the plain loop, closed forms of one
way of loading, what they remember, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.numerics.lanes import CAPACITY
from hpcdem.physics.fdem import changes, convergence, diagnostics, reference
from hpcdem.physics.fdem.kernels import plasticity
from hpcdem.physics.fdem.kernels.plasticity import SHEAR_NOW
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from tests.blocks.test_plasticity import FLOWS
from tests.space.support import box, faces_on, hexes, nodes_on

MOHR_COULOMB = "mech_mohr_coulomb"
SOIL = {
    "density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "dilation": 10.0, "cohesion": 3.45e6,
    "tensile": 1e6,
}  # fmt: skip
A, B = SOIL["bulk"] + 4.0 / 3.0 * SOIL["shear"], SOIL["bulk"] - 2.0 / 3.0 * SOIL["shear"]
COMPONENTS = ("xx", "yy", "xy", "zz", "xz", "yz")
TET = Mesh.of([(0.0, 0.0, 0.0), (1.0, 0.1, 0.0), (0.2, 0.9, 0.1), (0.1, 0.2, 0.8)], [(0, 1, 2, 3)])


def meshed(name: str) -> Mesh | None:
    return {"tetrahedron": TET, "hexahedra": hexes((2, 2, 2), (1.0, 1.0, 1.0), 0.2), "cube": None}[name]


def steepness(degrees: float) -> float:
    """N of an angle."""
    return math.tan(math.pi / 4.0 + 0.5 * math.radians(degrees)) ** 2


N, M = steepness(SOIL["friction"]), steepness(SOIL["dilation"])
K = 2.0 * SOIL["cohesion"] * math.sqrt(N)


def soil(mesh: Mesh | None = None, **other) -> Blocks:
    """A body at rest."""
    sim = Blocks(SerialComm())
    sim.take_mesh(box((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2) if mesh is None else mesh)
    for name in [name for name, value in other.items() if isinstance(value, list)]:
        sim.table(name, other[name])
        other[name] = Over(name, PLASTIC_STRAIN)
    changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, **other})
    sim.option(dynamic=False, collision=False)
    return sim


def deform(sim: Blocks, gradient: np.ndarray) -> None:
    """All nodes go to their places in the mesh times this deformation gradient (3, 3), and elements flow there once."""
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.open_model()
    places = sim.mesh.points @ np.asarray(gradient).T
    sim.x.reshape(-1, 4, 4)[:, :, :3] = places[sim.mesh.cells[sim.number]]
    sim.step()


def matrices(sim: Blocks) -> np.ndarray:
    """Stresses (ne, 3, 3) [Pa]."""
    s = np.array([diagnostics.values(sim, f"stress_{c}") for c in COMPONENTS])
    return s[[0, 2, 4, 2, 1, 5, 4, 5, 3]].T.reshape(-1, 3, 3)


def trials(count: int, rock: reference.MohrCoulomb, seed: int = 1) -> np.ndarray:
    """Stresses (count, 3, 3) [Pa] in all regions, some with two or three principal values that are equal, or differ by
    rounding only, of any axes."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(count, 1)) * rng.choice([0.3e6, 3e6, 30e6], (count, 1))
    s = mean + rng.normal(size=(count, 3)) * rng.choice([1e5, 2e6, 20e6], (count, 1))
    kind = rng.integers(0, 8, count)
    s[kind == 4, 1] = s[kind == 4, 0]
    s[kind == 5, 2] = s[kind == 5, 0] * (1.0 + 1e-15)
    s[kind == 6] = mean[kind == 6]
    turn = Rotation.random(count, random_state=seed).as_matrix()
    turn[kind == 7] = np.eye(3)
    found = turn @ (s[:, :, None] * np.swapaxes(turn, 1, 2))
    return 0.5 * (found + np.swapaxes(found, 1, 2))


def flowed(stress: np.ndarray, rock: reference.MohrCoulomb) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stresses (n, 3, 3) after the return of these, their plastic strain (n, 3, 3), and bits (n,): the kernel's."""
    n, lame, two_mu = len(stress), rock.bulk - 2.0 / 3.0 * rock.shear, 2.0 * rock.shear
    apex = rock.cohesion / math.tan(rock.friction) if rock.friction > 0.0 else math.inf
    n_phi = steepness(math.degrees(rock.friction))
    law = n_phi, steepness(math.degrees(rock.dilation)), 2.0 * rock.cohesion * math.sqrt(n_phi), min(rock.tensile, apex)
    ends, strains, bits = np.empty_like(stress), np.empty_like(stress), np.empty(n)
    for first in range(0, n, CAPACITY):
        part = slice(first, min(first + CAPACITY, n))
        lanes, many = np.zeros(plasticity.LANES * CAPACITY), part.stop - part.start
        of = lanes.reshape(-1, CAPACITY)[:, :many]

        def row(lane: np.uint64) -> int:
            return int(lane) // CAPACITY

        at = row(plasticity.T11)
        for k, (i, j) in enumerate(((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))):
            of[at + k] = stress[part, i, j]
        of[row(plasticity.P_PHI) : row(plasticity.P_PHI) + 7] = np.array([*law, lame, two_mu, 1.0])[:, None]
        plasticity.find_axes(many, lanes)
        plasticity.return_in_space(many, lanes)
        at = row(plasticity.P11)
        e = of[at : at + 6][[0, 2, 4, 2, 1, 5, 4, 5, 3]].T.reshape(-1, 3, 3)
        strains[part], bits[part] = e, of[row(plasticity.HOW)]
        trace = np.trace(e, axis1=1, axis2=2)[:, None, None]
        ends[part] = stress[part] - (lame * trace * np.eye(3) + two_mu * e)
    return ends, strains, bits


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[pytest.mark.slow] * (one not in ("usual", "no tension", "sand"))) for one in FLOWS],
)
def test_the_return_is_that_of_the_plain_loop(name: str) -> None:
    """Against Koiter's rule with every choice of planes, in all regions of the pyramid, its edges and its apex."""
    rock, regions = FLOWS[name], set()
    stress = trials(250, rock)
    for trial, end, e, how in zip(stress, *flowed(stress, rock)):
        size = np.abs(trial).max() + rock.cohesion
        assert np.abs(end - reference.returned_stress(trial, rock)).max() < 1e-8 * size, trial
        assert (end * e).sum() >= -1e-12 * size * np.abs(e).max()
        regions.add((how, *(np.abs(np.diff(np.linalg.eigvalsh(end))) < 1e-9 * size).tolist()))
    assert len(regions) >= {"clay": 4, "sand": 3}.get(name, 6), regions


@pytest.mark.parametrize("name", list(FLOWS))
def test_what_may_be_outside(name: str) -> None:
    """The bound of how far a stress is outside is never below the exact value, and equal to it for some directions."""
    rock = FLOWS[name]
    apex = rock.cohesion / math.tan(rock.friction) if rock.friction > 0.0 else math.inf
    n_phi, tensile = steepness(math.degrees(rock.friction)), min(rock.tensile, apex)
    least = math.inf
    for s in trials(3000, rock, seed=2):
        k = 2.0 * rock.cohesion * math.sqrt(n_phi)
        bound = plasticity.most_outside(s[0, 0], s[1, 1], s[0, 1], s[2, 2], s[0, 2], s[1, 2], n_phi, k, tensile)
        exact = reference.yield_functions(np.linalg.eigvalsh(s), rock).max()
        size = np.abs(s).max() + rock.cohesion
        assert bound >= exact - 1e-14 * size * n_phi
        least = min(least, (bound - exact) / size)
    assert least < 1e-3


@pytest.mark.some_of_each
@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("threads", [1, 3])
def test_flow_as_the_plain_loop(large: bool, threads: int) -> None:
    """Random tetrahedra, of which some are elastic, some soften, flow once: stresses and forces follow."""
    mesh = box((3, 3, 3), (1.0, 1.0, 1.0), 5, shaken=0.2)
    sim = soil(mesh, dilation=20.0)
    sim.threads = threads
    changes.element_model(
        sim, np.arange(0, 40, 3), "mech_iso_elastic", {"density": 2e3, "young": 5e9, "poisson_ratio": 0.2}
    )
    sim.option(large_strain=large)
    initial = np.array([[-3e6, 1e6, 0.5e6], [1e6, -5e6, -1e6], [0.5e6, -1e6, -2e6]])
    sim.initial_stress(None, **{c: initial["xyz".index(c[0]), "xyz".index(c[1])] for c in COMPONENTS})
    rock = reference.MohrCoulomb(
        SOIL["bulk"], SOIL["shear"], math.radians(30.0), math.radians(20.0), SOIL["cohesion"], SOIL["tensile"]
    )
    sim.close_model()
    rng, several = np.random.default_rng(5), 0
    start = sim.x.copy()
    for size in (1e-4, 2e-3, 5e-3):
        at = mesh.points + size * rng.normal(size=mesh.points.shape)
        sim.x.reshape(-1, 4, 4)[:, :, :3] = at[mesh.cells[sim.number]]
        force, found, state = sim.evaluate().force, matrices(sim), diagnostics.values(sim, "plastic_state")
        for r, e in enumerate(sim.number):
            solid = reference.Solid(B, 2.0 * SOIL["shear"], 0.0, initial, not large)
            corners = mesh.cells[e]
            if sim.element_rows.name(sim.element_row[e]) == MOHR_COULOMB:
                want, stress, flows = reference.yielded_tetrahedron(mesh.points[corners], at[corners], solid, rock)
                several += flows
                assert (state[e] > 0.0) == flows
            else:
                two_mu = 5e9 / 1.2
                solid = solid._replace(lame=two_mu * 0.2 / 0.6, two_mu=two_mu)
                want = reference.tetrahedron_forces(mesh.points[corners], at[corners], np.zeros((4, 3)), solid)
                stress = found[e]
                assert state[e] == 0.0
            assert force[r].reshape(4, 4)[:, :3] == pytest.approx(want, abs=1e-9 * np.abs(want).max())
            assert found[e] == pytest.approx(stress, abs=1e-9 * np.abs(stress).max())
    assert several > 60
    assert not sim.cold["plastic"].any()  # looking at it changed nothing
    sim.x[:] = start


@pytest.mark.slow
@pytest.mark.parametrize("large", [False, True])
def test_flow_of_hexahedra_as_the_plain_loop(large: bool) -> None:
    """Of more than a block of them, some elastic, on several threads: stresses and forces follow."""
    mesh = hexes((4, 3, 3), (1.0, 1.0, 1.0), 0.2)
    sim = soil(mesh, dilation=20.0)
    sim.threads = 2
    elastic = {"density": 2e3, "young": 5e9, "poisson_ratio": 0.2}
    changes.element_model(sim, np.arange(30, 60), "mech_iso_elastic", elastic)
    sim.option(large_strain=large)
    initial = np.array([[-3e6, 1e6, 0.5e6], [1e6, -5e6, -1e6], [0.5e6, -1e6, -2e6]])
    sim.initial_stress(None, **{c: initial["xyz".index(c[0]), "xyz".index(c[1])] for c in COMPONENTS})
    rock = reference.MohrCoulomb(
        SOIL["bulk"], SOIL["shear"], math.radians(30.0), math.radians(20.0), SOIL["cohesion"], SOIL["tensile"]
    )
    sim.close_model()
    rng, several, own = np.random.default_rng(5), 0, sim.local.hexes
    for size in (1e-4, 2e-3, 5e-3):
        at = mesh.points + size * rng.normal(size=mesh.points.shape)
        sim.x.reshape(-1, 4, 4)[:, :, :3] = at[mesh.cells[sim.number]]
        force, found, state = sim.evaluate().force.reshape(-1), matrices(sim), diagnostics.values(sim, "plastic_state")
        for i, (nodes, e) in enumerate(zip(own.nodes, own.number)):
            solid = reference.Solid(B, 2.0 * SOIL["shear"], 0.0, initial, not large)
            if sim.element_rows.name(sim.element_row[e]) == MOHR_COULOMB:
                want, stress, flows = reference.yielded_hexahedron(mesh.points[nodes], at[nodes], solid, rock)
                several += flows
                assert (state[e : e + 6] > 0.0).all() == flows
            else:
                two_mu = 5e9 / 1.2
                solid = solid._replace(lame=two_mu * 0.2 / 0.6, two_mu=two_mu)
                want = reference.hexahedron_forces(mesh.points[nodes], at[nodes], np.zeros((8, 3)), solid)
                stress = found[e]
                assert not state[e : e + 6].any()
            here = force[own.place[i][:, None] + np.arange(3)]
            assert here == pytest.approx(want, abs=1e-9 * np.abs(want).max())
            assert found[e + 5] == pytest.approx(stress, abs=1e-9 * np.abs(stress).max())
    assert several > 60 and not sim.cold["plastic"].any()


AXES = {"z": np.eye(3), "turned": Rotation.from_euler("zxy", (20.0, -50.0, 35.0), degrees=True).as_matrix()}


def loaded(sim: Blocks, turn: np.ndarray, strain: tuple[float, float, float], parts: int) -> None:
    """These principal strains in equal parts, along the axes of the turned frame."""
    for k in range(1, parts + 1):
        deform(sim, turn @ np.diag(1.0 + np.array(strain) * k / parts) @ turn.T)


@pytest.mark.some_of_each
@pytest.mark.parametrize("turned", list(AXES))
@pytest.mark.parametrize("mesh", ["tetrahedron", "cube", "hexahedra"])
@pytest.mark.parametrize("parts", [1, 10])
@pytest.mark.parametrize(
    ("strain", "what"),
    [((-9e-3, -2e-3, 1e-3), "plane"), ((-9e-3, 1e-3, 1e-3), "compression"), ((-6e-3, -6e-3, 2e-3), "extension")],
)
def test_strains_of_three_sizes(
    strain: tuple[float, float, float], what: str, parts: int, mesh: str, turned: str
) -> None:
    """Proportional strain from no stress: on the plane s_1 = N s_3 - k with the plastic strain l (-1, 0, m); triaxial
    compression goes along the edge s_2 = s_3, extension along s_1 = s_2."""
    sim, turn = soil(meshed(mesh)), AXES[turned]
    loaded(sim, turn, strain, parts)
    d = np.full((3, 3), B) + (A - B) * np.eye(3)
    ways = {
        "plane": [(-1.0, 0.0, M)], "compression": [(-1.0, 0.5 * M, 0.5 * M)], "extension": [(-0.5, -0.5, M)],
    }[what]  # fmt: skip
    normal, way = np.array([-1.0, 0.0, N]), np.array(ways[0])
    lag = (normal @ d @ strain - K) / (normal @ d @ way)
    want = d @ (np.array(strain) - lag * way)
    assert lag > 0.0
    if what != "plane":
        pair = want[1:] if what == "compression" else want[:2]
        assert pair[0] == pytest.approx(pair[1], rel=1e-12)
    assert np.abs(matrices(sim) - turn @ np.diag(want) @ turn.T).max() < 1e-9 * np.abs(want).max()


@pytest.mark.parametrize(
    "stresses",
    [(-2e6, -2e6), (-2e6, -5e6), pytest.param((0.0, -1e6), marks=pytest.mark.slow)],
    ids=["triaxial", "true triaxial", "two unequal"],
)
def test_strength_of_a_pressed_cube(stresses: tuple[float, float]) -> None:
    """Between plates without friction, with two pressures on its sides: 2 c sqrt(N) + N p of the smaller one, whatever
    the mesh (shaken), and the middle stress stays."""
    mesh = box((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2)
    sim = soil(mesh)
    for side, axis in (("left", "x"), ("front", "y"), ("bottom", "z")):
        sim.velocity_condition(nodes_on(mesh, side), **{f"v{axis}": 0.0})
    for side, pressure in zip(("right", "back"), stresses):
        sim.stress_condition(faces_on(mesh, side), normal=pressure)
    sim.velocity_condition(nodes_on(mesh, "top"), vz=-2e-6)
    convergence.advance(sim, 3000)
    sim.velocity_condition(nodes_on(mesh, "top"), vz=-2e-8)  # as slow as that it is in balance
    convergence.advance(sim, 2000)
    want = np.diag([*stresses, N * max(stresses) - K])
    mean = np.average(matrices(sim), axis=0, weights=sim.mesh.areas())
    assert np.abs(mean - want).max() < 1e-4 * abs(want[2, 2])
    assert (diagnostics.values(sim, "plastic_state") == SHEAR_NOW).all()


def test_a_turned_body_does_the_same() -> None:
    """In motion, and turned about an axis of its own: the same flow to rounding, in the turned frame."""
    turn, found = Rotation.from_euler("zxy", (20.0, -50.0, 35.0), degrees=True).as_matrix(), []
    for way in (np.eye(3), turn):
        mesh = box((3, 2, 2), (1.0, 0.7, 0.5), shaken=0.2)
        sim = soil(Mesh.of(mesh.points @ way.T, mesh.cells), cohesion=1e5, tensile=5e4, damp_factor=0.1)
        sim.option(dynamic=True)
        changes.set_velocity(sim, [0, 5, 9], *(way @ (1.0, -2.0, 3.0)))
        convergence.advance(sim, 60)
        places = np.array([diagnostics.values(sim, f"displacement_{axis}") for axis in "xyz"]).T
        found.append((places @ way, diagnostics.values(sim, "plastic_shear_strain")))
    assert (found[0][1] > 0.0).sum() > 10
    for one, other in zip(*found):
        assert np.abs(other - one).max() < 1e-9 * np.abs(one).max()


@pytest.mark.slow
@pytest.mark.parametrize("mesh", ["cube", "hexahedra"])
def test_energy_of_flow(mesh: str) -> None:
    """Work of the walls = what is stored and what flow has lost, of proportional strain in small parts."""
    sim = soil(meshed(mesh), dilation=20.0)
    initial = -1e6
    sim.initial_stress(None, xx=initial, yy=initial, zz=initial)
    sim.option(large_strain=False)
    sim.close_model()
    before, work, strain, parts = diagnostics.total(sim, "strain_energy"), 0.0, np.array([-8e-3, 6e-3, 2e-3]), 200
    last = matrices(sim).mean(axis=0)
    for k in range(1, parts + 1):
        deform(sim, np.eye(3) + np.diag(strain) * k / parts)
        now = matrices(sim).mean(axis=0)
        work += float((0.5 * (last + now) * np.diag(strain / parts)).sum())
        last = now
    lost = diagnostics.total(sim, "plastic_work")
    stored = diagnostics.total(sim, "strain_energy") - before
    assert lost > 0.3 * work and stored + lost == pytest.approx(work, rel=2e-3)


@pytest.mark.parametrize(
    ("name", "mesh"),
    [
        ("tensile", "cube"),
        ("cohesion", "hexahedra"),
        *(pytest.param(name, "cube", marks=pytest.mark.slow) for name in ("cohesion", "friction", "dilation")),
    ],
)
def test_strength_that_follows_plastic_strain(name: str, mesh: str) -> None:
    """A table of each property alone: the end is that of the value that belongs to the strain, found by a plain loop
    of small steps."""
    ends = {"cohesion": (3.45e6, 1e6), "friction": (30.0, 15.0), "dilation": (10.0, 0.0), "tensile": (1e6, 2e5)}[name]
    table = [(0.0, ends[0]), (4e-3, ends[1])]
    way = np.array([6e-3, 1e-3, 0.0]) if name == "tensile" else np.array([-0.02, 3e-3, 1e-3])
    sim, parts = soil(meshed(mesh), **{name: table}), 60
    loaded(sim, AXES["turned"], tuple(way), parts)
    law, strain, d = dict(SOIL), np.zeros(2), np.full((3, 3), B) + (A - B) * np.eye(3)
    e_p = np.zeros(3)
    for k in range(1, parts + 1):
        angles = [math.radians(law[n]) for n in ("friction", "dilation")]
        rock = reference.MohrCoulomb(SOIL["bulk"], SOIL["shear"], *angles, law["cohesion"], law["tensile"])
        trial = d @ (way * k / parts - e_p)
        end = np.diag(reference.returned_stress(np.diag(trial), rock))
        step = np.linalg.solve(d, trial - end)
        e_p += step
        third = step.sum() / 3.0
        which = 1 if name == "tensile" else 0
        strain[which] += step.sum() if which else math.sqrt(0.5 * ((step - third) ** 2).sum())
        law[name] = float(np.interp(strain[which], *zip(*table)))
    want = AXES["turned"] @ np.diag(end) @ AXES["turned"].T
    assert np.abs(matrices(sim) - want).max() < 1e-8 * np.abs(want).max()
    plain = soil(meshed(mesh))
    loaded(plain, AXES["turned"], tuple(way), parts)
    assert np.abs(matrices(plain) - want).max() > 1e-3 * np.abs(want).max()
    again = sim.cold["softening"].copy()
    sim.rebuild()
    sim.close_model()
    assert np.array_equal(again, sim.cold["softening"])
    loaded(sim, AXES["turned"], tuple(way), 1)
    assert np.abs(matrices(sim) - want).max() < 2e-2 * np.abs(want).max()


def test_every_number_of_the_law_counts() -> None:
    ends = []
    for name in (None, "friction", "dilation", "cohesion", "tensile", "bulk", "shear"):
        sim = soil(**({} if name is None else {name: 0.9 * SOIL[name]}))
        loaded(sim, AXES["turned"], (-9e-3, 5e-3, 1e-3), 10)
        ends.append(matrices(sim)[0])
    for i, one in enumerate(ends):
        assert all(np.abs(one - other).max() > 1e3 for other in ends[:i])


def test_refusals() -> None:
    sim = soil()
    with pytest.raises(CommandError, match="dilation must not be above friction"):
        sim.element_property(None, {"dilation": 40.0})
