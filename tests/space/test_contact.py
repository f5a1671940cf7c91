"""Bodies in space that touch: slopes, impacts, whose properties count, what is found, what is refused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, connectivity, convergence, diagnostics, overlaps
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.pairs import Kinds
from hpcdem.physics.fdem.pairs_space import AllPairs, ContactSpace, Surface
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tetrahedra import FACES, face_areas
from hpcdem.pre.mesh import fill, solids
from tests.pcdc.test_time import Rock
from tests.space.support import ROCK, box, faces_on

SOFT = {**ROCK, "young": 1e8, "damp_factor": 0.3}


def joined(*parts: tuple[Mesh, tuple[float, float, float]]) -> Mesh:
    """One mesh of bodies, each moved."""
    points = [mesh.points + np.array(away) for mesh, away in parts]
    begin = np.cumsum([0, *map(len, points)])
    return Mesh.of(
        np.concatenate(points), np.concatenate([mesh.cells + k for (mesh, _), k in zip(parts, begin)])
    )  # fmt: skip


def on_a_plate(block: Mesh, away: tuple[float, float, float], **properties: float) -> tuple[Blocks, np.ndarray]:
    """A block over a plate that is held, its top at z = 0.2; and the points of the block."""
    plate = box((8, 3, 2), (1.6, 0.6, 0.2), shaken=0.1)
    mesh = joined((plate, (0.0, 0.0, 0.0)), (block, away))
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**SOFT, **properties})
    sim.velocity_condition(np.arange(len(plate.points)), vx=0.0, vy=0.0, vz=0.0)
    return sim, np.arange(len(plate.points), len(mesh.points))


def way(sim: Blocks, nodes: np.ndarray) -> np.ndarray:
    return np.array([diagnostics.values(sim, f"displacement_{axis}", nodes).mean() for axis in "xyz"])


def run_to(sim: Blocks, time: float) -> None:
    while sim.clock.time < time:
        sim.step()


def slide(slope: float, friction: float, turn: float, **options: str) -> tuple[np.ndarray, np.ndarray]:
    """Ways (3,) of a block on a slope after 0.25 and 0.5 s; turn: of the way down against x in the plate [degrees]."""
    sim, block = on_a_plate(box((3, 2, 2), (0.4, 0.3, 0.2)), (0.21, 0.11, 0.2), friction=friction)
    if options:
        sim.option(**options)
    a, b = np.radians(slope), np.radians(turn)
    sim.gravity(9.81 * np.sin(a) * np.cos(b), 9.81 * np.sin(a) * np.sin(b), -9.81 * np.cos(a))
    run_to(sim, 0.25)
    half = way(sim, block)
    run_to(sim, 0.5)
    return half, way(sim, block)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("slope", "friction", "turn", "expected"), [
        (30.0, 20.0, 0.0, 0.226602),
        pytest.param(40.0, 30.0, 0.0, 0.245877, marks=pytest.mark.slow),
        pytest.param(30.0, 20.0, 25.0, 0.226602, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_a_block_slides_down_a_slope(slope: float, friction: float, turn: float, expected: float) -> None:
    """a = g (sin - tan(phi) cos): 1.812815 m/s2 at 30 degrees with phi 20, 1.967019 at 40 with 30; the way after 0.5 s,
    and none across it."""
    _, end = slide(slope, friction, turn)
    down = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn)), 0.0])
    assert end @ down == pytest.approx(expected, rel=0.01)
    assert abs(end @ (-down[1], down[0], 0.0)) < 1e-3 * expected


def test_a_block_stays_below_the_angle_of_friction() -> None:
    sim, block = on_a_plate(box((3, 2, 2), (0.4, 0.3, 0.2)), (0.21, 0.11, 0.2), friction=35.0)
    sim.gravity(9.81 * 0.5, 0.0, -9.81 * np.cos(np.radians(30.0)))
    run_to(sim, 0.1)
    before = way(sim, block)
    run_to(sim, 0.2)
    assert np.abs(way(sim, block) - before).max() < 1e-6  # what slips freely goes 0.07 m


@pytest.mark.parametrize(
    ("potential", "ripple"), [("distance", 1e-4), pytest.param("munjiza", 2e-3, marks=pytest.mark.slow)]
)
def test_a_block_moved_over_a_plate_with_other_elements(potential: str, ripple: float) -> None:
    """Both rigid. At one depth its force all but stays, less so by Munjiza's potential; along a closed way in and out
    no work is done; what one takes the other gives."""
    plate, block = box((8, 6, 2), (8.0, 6.0, 2.0), shaken=0.15), box((3, 3, 2), (3.0, 3.0, 2.0), 12, shaken=0.15)
    mesh = joined((plate, (0.0, 0.0, 0.0)), (block, (2.3, 1.2, 2.001)))
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "penalty": 1.0})
    sim.option(potential=potential)
    sim.close_model()
    moved, start = sim.number >= len(plate.cells), sim.x.copy()
    sim.rebuild_state.skin = 2.5
    pairs = ContactSpace(sim, *ContactSpace.remembered(sim))

    def force(way: np.ndarray) -> np.ndarray:
        sim.x[:] = start
        sim.x.reshape(-1, 4, 4)[moved, :, :3] += way
        out = np.zeros((len(sim.number), 16))
        pairs.forces(sim.x, sim.v, 0.0)
        pairs.add_to(out)
        of_corners = out.reshape(-1, 4, 4)[:, :, :3]
        assert np.abs(of_corners.sum(axis=(0, 1))).max() <= 1e-14 * np.abs(of_corners).sum()
        return of_corners[moved].sum(axis=(0, 1))

    at_depth = np.array([force(np.array([0.8 * t, 0.6 * t, -0.011]))[2] for t in np.linspace(0.0, 1.0, 25)])
    assert 0.0 < at_depth.std() < ripple * at_depth.mean()
    n = 400
    angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    place = np.column_stack([0.5 * np.cos(angle), 0.4 * np.sin(angle), 0.04 * np.sin(2.0 * angle + 0.3) - 0.02])
    along = np.column_stack([-0.5 * np.sin(angle), 0.4 * np.cos(angle), 0.08 * np.cos(2.0 * angle + 0.3)])
    work = np.array([force(at) @ step for at, step in zip(place, 2.0 * np.pi / n * along)])
    assert abs(work.sum()) < 2e-5 * np.abs(work).sum()


def pressed(potential: str = "distance", top: float = 10.0, **face: float) -> float:
    """How far a body of one box sinks into another one under a stress on its top, after bodies of any penalty: the ways
    of its lowest points [m]."""
    cube = box((2, 2, 2), (1.0, 1.0, 1.0), 5)
    mesh = joined((cube, (0.0, 0.0, 0.0)), (cube, (1e-3, 7e-4, 1.0)))
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.option(dynamic=False, potential=potential)
    if face:
        sim.face_model(None, "contact_mohr_coulomb", face)
    lower = np.flatnonzero(np.abs(mesh.points[:27, 2]) < 1e-9)
    sim.velocity_condition(lower, vx=0.0, vy=0.0, vz=0.0)
    edges = mesh.edges()
    points = mesh.points[edges.points]
    high = edges.faces[~edges.inner & (np.abs(points[:, :, 2] - 2.0) < 1e-9).all(axis=1), 0]
    sim.stress_condition(high, normal=-top)
    convergence.solve(sim, ratio=1e-7)
    z = diagnostics.values(sim, "position_z")
    above, below = np.arange(27, 54), np.arange(27)
    contact = np.abs(mesh.points[:, 2] - 1.0) < 1e-9
    return float(z[below][contact[:27]].mean() - z[above][contact[27:]].mean())


def test_a_flat_contact_yields_by_its_penalty() -> None:
    """p = P d (1 / h_1 + 1 / h_2), h the median altitude of a body, P = 10 E; 4 P d (1 / H_1 + 1 / H_2) of Munjiza's
    potential, H the altitudes on the surface of the elements that touch. Both lose at the rims of elements."""
    cube = box((2, 2, 2), (1.0, 1.0, 1.0), 5)
    altitudes = 3.0 * cube.areas()[:, None] / face_areas(cube.points, cube.cells)
    h, p = float(np.median(altitudes)), 1e4
    usual = pressed(top=p)
    assert usual == pytest.approx(p * h / (2.0 * 10.0 * ROCK["young"]), rel=0.05)
    assert pressed(top=p, penalty_normal=5.0 * ROCK["young"]) == pytest.approx(2.0 * usual, rel=0.05)
    of_side = float(altitudes[np.abs(altitudes - 0.5) < 1e-9].mean())  # those with a face on the surface are 0.5 high
    assert pressed("munjiza", p) == pytest.approx(p * of_side / (8.0 * 10.0 * ROCK["young"]), rel=0.1)


def test_penalty_in_shear_and_friction_of_faces() -> None:
    """A block that is pushed sideways by its weight sticks and is bent back by the shear penalty: a tenth of it lets it
    go farther; without friction it goes."""
    found = []
    for shear, friction in ((1e9, 40.0), (1e7, 40.0), (1e9, 0.0)):
        sim, block = on_a_plate(box((3, 2, 2), (0.4, 0.3, 0.2)), (0.21, 0.11, 0.2))
        sim.face_model(None, "contact_mohr_coulomb",
                       {"penalty_normal": 1e9, "penalty_shear": shear, "friction": friction})  # fmt: skip
        sim.gravity(3.0, 0.0, -9.81)
        run_to(sim, 0.06)
        found.append(way(sim, block)[0])
    assert found[1] > 1.5 * found[0]
    assert found[2] == pytest.approx(0.5 * 3.0 * 0.06**2, rel=0.05)


def bounce(**properties: float) -> float:
    """Speed after over speed before of a block that falls flat onto a plate."""
    sim, block = on_a_plate(box((2, 2, 1), (0.3, 0.3, 0.15)), (0.6, 0.15, 0.201), damp_factor=0.0)
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 5e6, **properties})
    changes.set_velocity(sim, block, 0.0, 0.0, -0.5)
    mass = np.bincount(sim.the_mesh().cells.reshape(-1), np.repeat(sim.areas, 4))[block]
    fastest = -1.0
    for _ in range(20000):
        sim.step()
        if sim.clock.step % 20 == 0:
            speed = float((diagnostics.values(sim, "velocity_z", block) * mass).sum() / mass.sum())
            fastest = max(fastest, speed)
            if speed > 0.0 and not sim.local.pairs.touching.any():
                return speed / 0.5
    raise AssertionError("it does not come up again")


def test_normal_damping() -> None:
    """Of a block on a contact that is soft beside it: without damping it comes up nearly as fast as it fell, with each
    kind of damping slower."""
    free = bounce()
    assert 0.97 < free <= 1.001
    assert bounce(damping_ratio=0.5) < 0.9 * free
    assert bounce(damping_b=3.0) < 0.9 * free
    assert bounce(damping_t=2e4) < 0.9 * free


@pytest.mark.parametrize("lies", ["top", pytest.param("right", marks=pytest.mark.slow)])
def test_whose_friction_it_is(lies: str) -> None:
    """A block on the top of a slab, or pressed against its side: it rubs with the friction of the face that it touches,
    though the elements along the edges have faces with another one."""
    slab, block = box((4, 2, 1), (0.8, 0.4, 0.2)), box((2, 2, 2), (0.2, 0.2, 0.12))
    away, gravity, along = {
        "top": ((0.55, 0.1, 0.2), (2.0, 0.0, -9.81), 0), "right": ((0.8, 0.1, 0.04), (-9.81, 0.0, -2.0), 2),
    }[lies]  # fmt: skip
    found = {}
    for where, friction in itertools.product((lies, "others"), (0.0, 40.0)):
        mesh = joined((slab, (0.0, 0.0, 0.0)), (block, away))
        sim = Blocks(SerialComm())
        sim.take_mesh(mesh)
        changes.element_model(sim, None, "mech_iso_elastic", SOFT)
        sim.velocity_condition(np.arange(len(slab.points)), vx=0.0, vy=0.0, vz=0.0)
        nodes = np.arange(len(slab.points), len(mesh.points))
        sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 1e9, "friction": 89.0})
        names = [lies] if where == lies else [name for name in slab.layers if name != lies]
        sim.face_property(np.concatenate([faces_on(slab, name) for name in names]), {"friction": friction})
        assert Surface.of(sim).several(sim_kinds(sim))[: len(slab.cells)].any()
        sim.gravity(*gravity)
        run_to(sim, 0.05)
        found[where, friction] = abs(way(sim, nodes)[along])
    assert found[lies, 0.0] == pytest.approx(0.5 * 2.0 * 0.05**2, rel=0.05)
    assert found[lies, 40.0] < 0.2 * found[lies, 0.0]
    assert found["others", 0.0] == found["others", 40.0]


def sim_kinds(sim: Blocks):
    sim.close_model()
    return Kinds.of(sim)


def brute_force(sim: Blocks, skin: float) -> set[tuple[int, int]]:
    """Pairs (face, element) with boxes that overlap, of elements without a common point, that no normal of a side of
    the element or of the face sets apart."""
    mesh = sim.the_mesh()
    edges = mesh.edges()
    free = edges.faces[~edges.inner, 0]
    x = diagnostics.corner_values(sim, "position").reshape(-1, 4, 3)
    on_surface = np.zeros(len(mesh.points), bool)
    on_surface[mesh.face_points(free)] = True
    found = set()
    for f, c in zip(free.tolist(), x.reshape(-1, 3)[mesh.face_corners(free)]):
        apart = ~np.isin(mesh.cells, mesh.cells[f // 4]).any(axis=1)
        for e in np.flatnonzero(on_surface[mesh.cells].any(axis=1) & apart).tolist():
            if (c.min(axis=0) - skin > x[e].max(axis=0)).any() or (c.max(axis=0) + skin < x[e].min(axis=0)).any():
                continue
            sides = np.array([c, *x[e][FACES]])
            normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            mine, other = normals @ c.T, normals @ x[e].T
            between = np.maximum(mine.min(axis=1) - other.max(axis=1), other.min(axis=1) - mine.max(axis=1))
            if between.max() <= skin:
                found.add((f, e))
    return found


def test_all_pairs_are_found() -> None:
    """As by comparing everything with everything; in ascending order, each once. They are all that touch once the block
    has sunk in by half the buffer."""
    sim, _ = on_a_plate(box((2, 2, 2), (0.3, 0.3, 0.2), 12, shaken=0.2), (0.31, 0.17, 0.201))
    sim.close_model()
    pairs = sim.local.pairs
    found = list(zip(pairs.face[pairs.first].tolist(), pairs.element[pairs.second].tolist()))
    assert found == sorted(set(found)) and len(found) > 100
    skin = sim.rebuild_state.skin
    assert set(found) == brute_force(sim, skin)
    number = sim.number >= 8 * 3 * 2 * 6
    sim.x.reshape(-1, 4, 4)[number, :, 2] -= 0.499 * skin
    (everything,) = AllPairs.of(sim)
    deep = np.flatnonzero(everything.depths()[:, 0] > 0.0)
    faces, elements = everything.face[everything.first[deep]], everything.element[everything.second[deep]]
    touching = set(zip(faces.tolist(), elements.tolist()))
    assert len(touching) > 20 and touching <= set(found)


def meeting(sim: Blocks) -> set[tuple[int, int]]:
    """Pairs of the list that have a point of the mesh in common."""
    sim.close_model()
    pairs, cells = sim.local.pairs, sim.the_mesh().cells
    every = zip(pairs.face[pairs.first].tolist(), pairs.element[pairs.second].tolist())
    return {(f, e) for f, e in every if np.isin(cells[e], cells[f // 4]).any()}


def test_neighbours_touch_across_open_faces_only() -> None:
    """Elements of one body do not touch each other. A body that is cut in two by open faces is two, which press each
    other as they did, and elements that hang together around a point of the cut do not."""
    mesh = box((2, 3, 3), (2.0, 3.0, 3.0))
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    assert not meeting(sim)
    edges = mesh.edges()
    at = mesh.points[edges.points]
    cut = edges.inner & (np.abs(at[:, :, 0] - 1.0) < 1e-9).all(axis=1)
    inside = cut & ((at[:, :, 1:] > 0.5) & (at[:, :, 1:] < 2.5)).all(axis=(1, 2))
    changes.crack(sim, edges.faces[inside, 0][:1])
    sides = edges.faces[inside][0].tolist()
    assert meeting(sim) == {(f, g // 4) for f, g in itertools.permutations(sides, 2)}
    changes.crack(sim, edges.faces[cut, 0])
    one = connectivity.bodies(np.where(sim.closed_faces(), sim.partner, -1))
    assert one.max() == 1
    assert len(meeting(sim)) > 4 and all(one[f // 4] != one[e] for f, e in meeting(sim))


def test_bodies_that_overlap_at_first_are_named() -> None:
    sim, block = on_a_plate(box((1, 1, 1), (0.2, 0.2, 0.2)), (0.4, 0.2, 0.19))
    with pytest.raises(CommandError, match=r"pairs of elements overlap before the first step, elements \d+ and \d+ by"):
        sim.step()
    found = overlaps.deepest(sim, sim.local)
    assert found[0, 0] == pytest.approx(0.01, rel=0.2) and found.shape[1] == 6
    assert (np.abs(found[:, 3] - 0.195) < 0.006).all()
    sim.option(overlap="keep")
    sim.step()
    inside, _ = on_a_plate(box((1, 1, 1), (0.01, 0.01, 0.01)), (0.43, 0.27, 0.1))
    with pytest.raises(CommandError, match="overlap before the first step"):
        inside.step()


def test_the_potential_is_for_space() -> None:
    sim = Blocks(SerialComm())
    with pytest.raises(CommandError, match="one of distance, munjiza, got other"):
        sim.option(potential="other")
    sim.option(potential="munjiza")
    sim.take_mesh(Mesh.of([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [(0, 1, 2)]))
    with pytest.raises(CommandError, match="model option potential is for three dimensions"):
        sim.option(potential="munjiza")
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    with pytest.raises(CommandError, match="model option potential is for three dimensions"):
        sim.step()


def test_what_is_dug_out_touches_no_more() -> None:
    """A block that rests on a plate falls when what carries it is taken out, without a word of the contacts that
    were."""
    sim, block = on_a_plate(box((2, 2, 1), (0.2, 0.2, 0.2)), (0.51, 0.21, 0.2), friction=30.0)
    sim.gravity(0.0, 0.0, -9.81)
    run_to(sim, 0.02)
    rest = diagnostics.contacts(sim)
    assert rest["force_z"][rest["element_1"] >= 8 * 3 * 2 * 6].sum() > 0.0
    below = np.flatnonzero(sim.the_mesh().centroids()[: 8 * 3 * 2 * 6, 0] > 0.3)
    changes.null(sim, below)
    start, time = way(sim, block)[2], sim.clock.time
    run_to(sim, time + 0.05)
    assert not len(diagnostics.contacts(sim)["face"])
    assert way(sim, block)[2] - start == pytest.approx(-0.5 * 9.81 * 0.05**2, rel=0.05)


def test_contact_limits_the_time_step() -> None:
    """k = P A (1 / h_1 + 1 / h_2) / 3 of a corner: a hundredfold penalty asks for a tenth of the time step, and a run
    with it is stable."""
    steps = []
    for penalty in (1e8, 1e12, 1e14):
        sim, block = on_a_plate(box((2, 2, 1), (0.2, 0.2, 0.2)), (0.5, 0.2, 0.2005), damp_factor=0.0)
        sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": penalty})
        sim.close_model()
        steps.append(diagnostics.critical_time_step(sim))
        changes.set_velocity(sim, block, 0.0, 0.0, -1.0)
        for _ in range(300):
            sim.step()
        kinetic = 0.5 * ROCK["density"] * 0.2**3
        assert diagnostics.total(sim, "kinetic_energy") < 1.01 * kinetic
    assert steps[1] / steps[2] == pytest.approx(10.0, rel=0.01)
    assert steps[0] > 3.0 * steps[1]


@pytest.mark.slow
def test_a_ball_bounces_off_a_plate() -> None:
    """Hertz: a ball of radius 50 mm, E = 10 GPa, nu = 0.25, rho = 2700, at 1 m/s on a plate that does not give way:
    8899 N, 0.19858 mm, 0.58446 ms; and what was stored is given back. A quarter of it, with facets for its round."""
    radius, fine = 0.05, 7e-4
    cube, ball = solids.made("box", (0, 0, 0), (0.1, 0.1, 0.1)), solids.made("sphere", (0, 0, radius), radius)
    near = solids.made("box", (-0.0043, -0.0041, -0.0011), (0.0043, 0.0042, 0.0013))
    whole = fill.filled(fill.MeshSettings([ball], 0.012, [], [("quarter", [cube])], [([near], fine, 0.03)]), "rest")
    used, cells = np.unique(whole.cells[whole.groups["quarter"]], return_inverse=True)
    points = whole.points[used] - [0.0, 0.0, whole.points[used][:, 2].min() - 1e-7]
    plate = box((3, 3, 1), (0.015, 0.015, 0.005))
    n = len(plate.points)
    mesh = Mesh.of(
        np.concatenate([plate.points - [0.003, 0.003, 0.005], points]),
        np.concatenate([plate.cells, cells.reshape(-1, 4) + n]),
    )
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(
        sim, None, "mech_iso_elastic", {"density": 2700.0, "young": 1e10, "poisson_ratio": 0.25, "penalty": 1e11}
    )
    sim.velocity_condition(np.arange(n), vx=0.0, vy=0.0, vz=0.0)
    moving = np.arange(n, len(mesh.points))
    sim.velocity_condition(moving[np.abs(points[:, 0]) < 1e-9], vx=0.0)
    sim.velocity_condition(moving[np.abs(points[:, 1]) < 1e-9], vy=0.0)
    changes.set_velocity(sim, moving, 0.0, 0.0, -1.0)
    mass = np.bincount(mesh.cells.reshape(-1), np.repeat(2700.0 * sim.areas / 4.0, 4))[n:]
    rows, end = [], 0.0
    while not end:
        for _ in range(20):
            sim.step()
        contacts = diagnostics.contacts(sim)
        up = contacts["force_z"] * np.where(contacts["element_1"] < len(plate.cells), -1.0, 1.0)
        z, speed = (
            float((diagnostics.values(sim, name, moving) * mass).sum() / mass.sum())
            for name in ("displacement_z", "velocity_z")
        )
        rows.append((4.0 * up.sum(), -z))
        if speed > 0.0 and not len(up):
            end = sim.clock.time
        assert sim.clock.time < 1e-3
    force, depth = np.array(rows).max(axis=0)
    assert force == pytest.approx(8899.0, rel=0.1)
    assert depth == pytest.approx(0.19858e-3, rel=0.1)
    assert end == pytest.approx(0.58446e-3, rel=0.1)
    assert 0.97 < speed <= 1.0
    energy = diagnostics.total(sim, "kinetic_energy") + diagnostics.total(sim, "strain_energy")
    assert energy == pytest.approx(0.5 * mass.sum(), rel=1e-3)


def test_a_script_of_falling_blocks(tmp_path) -> None:
    """A layer is taken out, what was above it falls on what was below and stays there."""
    found = []
    for potential in ("distance", "munjiza"):
        rock = Rock(
            tmp_path,
            f"""
pcdc model new dim 3
pcdc mesh structured (0,0,0) (0.4,0.2,0.6) cells 2 1 3
pcdc element c-model mech-iso-e property den 2700 young 1e8 p-r 0.25 d-f 0.5 friction 20
pcdc element c-model null range z 0.2 0.4
pcdc element-face c-model contact-m-c property p-n 1e9 friction 30 range boundary
pcdc element-face property damping-r 0.5 range boundary
pcdc model option potential {potential}
pcdc model gravity (0,0,-9.81)
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range z -0.01 0.01
pcdc model solve time 0.4
""",
        )
        sim = rock.blocks
        top = np.flatnonzero(sim.the_mesh().points[:, 2] > 0.55)
        found.append(way(sim, top)[2])
    assert -0.201 < min(found) and max(found) < -0.195  # it still rings
    assert found[0] != found[1]


def test_bodies_that_overlap_are_moved_apart() -> None:
    """By a static stage, after which the dynamic one begins without a word."""
    sim, block = on_a_plate(box((1, 1, 1), (0.2, 0.2, 0.2)), (0.43, 0.21, 0.199))
    sim.option(overlap="relax")
    with pytest.raises(CommandError, match="relax separates them in a static stage"):
        sim.step()
    sim.option(dynamic=False)
    for _ in range(300):
        sim.step()
    assert len(overlaps.deepest(sim, sim.local)) == 0
    assert way(sim, block)[2] > 0.9e-3
    sim.option(dynamic=True, overlap="refuse")
    sim.step()
