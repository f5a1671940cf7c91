"""Free faces that water stands before: who says so, what pushes on them then, on any mesh; and fluid that is kept as it
is while blocks come to rest."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hpcdem.commands.fdem import frame_tables
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import PRESSURE, RATE
from hpcdem.pre.mesh import structured
from tests.blocks.support import JOINT, model, near, rectangle
from tests.flow.support import WATER, at, hold, inner, over, run
from tests.flow.test_coupling import split
from tests.pcdc.fake import Noted
from tests.pcdc.test_time import Rock
from tests.space.support import body, box, hexes

STRONG = {**JOINT, "cohesion": 3e8, "tensile_strength": 1e8, "gf1": 500.0, "gf2": 2000.0, "penalty_normal": 2e12}
SOFT = {**WATER, "fluid_bulk": 1e6, "aperature_initial": 1e-4, "aperature_minumum": 1e-5}
TOTAL, P = -5e6, 1e6


def square(cells: int, kind: str = "quad", diagonal: str = "alternate") -> Mesh:
    lines = np.linspace(0.0, 1.0, cells + 1)
    return structured.rectangle(lines, lines, kind, diagonal)


MESHES: dict[str, Callable[[], Mesh]] = {
    "3 x 3 both": lambda: square(3, "tri", "both"),
    "3 x 3 triangles": lambda: square(3, "tri"),
    "3 x 3 quads": lambda: square(3),
    "5 x 5 quads": lambda: square(5),
    "tetrahedra": lambda: box((2, 2, 2), (1.0, 1.0, 1.0)),
    "hexahedra": lambda: hexes((2, 2, 2), (1.0, 1.0, 1.0)),
}


def soaked(mesh: Mesh) -> tuple[Blocks, Flow]:
    """A unit square, or cube, with water in all of its joints, which lies on one corner."""
    sim = model(mesh) if mesh.dim == 2 else body(mesh)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", STRONG)
    flow = Flow.of(sim)
    flow.assign(None, SOFT)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.flow_clock(dt=1e-9)
    corners = np.eye(4, mesh.dim, -1)
    for k, axes in enumerate(("xyz", "yz", "z")[: mesh.dim]):
        node = np.flatnonzero((np.abs(mesh.points - corners[k]) < 1e-9).all(axis=1))
        sim.velocity_condition(node, **{f"v{axis}": 0.0 for axis in axes if axis in "xyz"[: mesh.dim]})
    return sim, flow


def outside(mesh: Mesh) -> np.ndarray:
    edges = mesh.edges()
    return edges.faces[~edges.inner, 0]


@pytest.mark.parametrize(
    ("mesh", "how"),
    [
        *((mesh, "static") for mesh in MESHES),
        *(pytest.param(mesh, "implicit", marks=[pytest.mark.slow] * (k % 2)) for k, mesh in enumerate(MESHES)),
        ("3 x 3 quads", "steps"),
    ],
)
def test_a_total_stress_on_the_outside_is_all_that_acts_there(mesh: str, how: str) -> None:
    """Water at p in all joints: elements carry the total stress, joints the total and p, on any mesh."""
    made = MESHES[mesh]()
    sim, flow = soaked(made)
    sim.stress_condition(outside(made), normal=TOTAL)
    flow.fill(None, pressure=P)
    hold(flow, None, P)
    if how == "steps":
        convergence.solve(sim, ratio=1e-5)
    elif how == "static":
        equilibrium.solve_elastic(sim)
    else:
        over(sim, 1e-3, 1)
    for name in ("stress_xx", "stress_yy"):
        found = diagnostics.values(sim, name)
        assert found.mean() == pytest.approx(TOTAL, rel=2e-4) and found == pytest.approx(TOTAL, rel=1e-2)
    assert np.nanmean(diagnostics.values(sim, "normal_stress")) == pytest.approx(TOTAL + P, rel=2e-2)
    assert not len(flow.wet_faces()["number"])


@pytest.mark.parametrize("mesh", ["3 x 3 both", "3 x 3 quads", "tetrahedra", "hexahedra"])
def test_a_body_under_water_carries_its_pressure(mesh: str) -> None:
    """The pressure is said of all nodes by their numbers, corners without channels too: all of the outside is wet."""
    made = MESHES[mesh]()
    sim, flow = soaked(made)
    flow.fill(None, pressure=P)
    hold(flow, np.arange(len(made.points)), P)
    equilibrium.solve_elastic(sim)
    for name in ("stress_xx", "stress_yy"):
        assert diagnostics.values(sim, name) == pytest.approx(-P, rel=1e-4)
    found = flow.wet_faces()
    assert found["number"].tolist() == outside(made).tolist() and found["pressure"] == pytest.approx(P)
    sim.stress_condition(outside(made)[:1], normal=-P)
    assert len(flow.wet_faces()["number"]) == len(found["number"]) - 1


def hollow(cells: int = 5, kind: str = "quad", gravity: bool = False) -> tuple[Blocks, Flow, np.ndarray]:
    """A square with a square hole of 0.2 m to 0.4 m below the middle of its sides; channels along y = 0.6 alone, where
    the hole begins; the points of its wall."""
    mesh = square(cells, kind)
    sim = model(mesh)
    flow = Flow.of(sim)
    if gravity:
        sim.gravity(0.0, -10.0)
    joints = near(mesh, 1, 0.6, inner=True)
    flow.assign(np.unique(np.minimum(joints, sim.partner[joints])), SOFT)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.flow_clock(dt=1e-9)
    middle = mesh.centroids()
    changes.null(sim, np.flatnonzero((np.abs(middle - (0.5, 0.5)) < 0.1).all(axis=1)))
    x, y = mesh.points.T
    wall = np.flatnonzero(np.abs(np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) - 0.1) < 1e-9)
    return sim, flow, wall


def forces(sim: Blocks, flow: Flow) -> np.ndarray:
    """Sum of what fluid applies [N/m]."""
    sim.close_model()
    out = np.zeros_like(sim.local.loads.applied)
    flow.add_to(out)
    return out.reshape(len(out), 4, 2).sum(axis=(0, 1))


@pytest.mark.parametrize(("cells", "kind"), [(5, "quad"), (10, "quad"), (5, "tri")])
def test_water_in_a_hole_pushes_on_all_of_its_wall(cells: int, kind: str) -> None:
    """However many channels end there."""
    sim, flow, wall = hollow(cells, kind)
    assert not len(flow.wet_faces()["number"])
    hold(flow, wall, P)
    found = flow.wet_faces()
    assert found["size"].sum() == pytest.approx(0.8) and len(found["size"]) == 4 * cells // 5
    run(sim, 1)
    assert flow.wet_faces()["pressure"] == pytest.approx(P, rel=1e-12)
    hold(flow, None, 2e6)  # said of the fluid in joints, so of the nodes of the wall too
    run(sim, 1)
    assert flow.wet_faces()["pressure"] == pytest.approx(2e6, rel=1e-12)
    flow.remove_conditions(wall[:1])
    assert len(flow.wet_faces()["number"]) == 4 * cells // 5 - 2
    flow.prescribe(wall, kernels.RATE, 1e-9)
    assert not len(flow.wet_faces()["number"])


def test_water_before_a_dam() -> None:
    """rho g h^2 / 2 on the side on which a level is said, though a channel ends at one of its nodes alone."""
    mesh = square(5)
    sim = model(mesh)
    sim.gravity(0.0, -10.0)
    flow = Flow.of(sim)
    joints = near(mesh, 1, 0.2, inner=True)
    flow.assign(np.unique(np.minimum(joints, sim.partner[joints])), SOFT)
    sim.option(dynamic=False, collision=False)
    sim.flow_clock(dt=1e-9)
    flow.prescribe(at(sim, x=0.0), kernels.SURFACE, 0.8)
    run(sim, 1)
    assert forces(sim, flow)[0] == pytest.approx(0.5 * 1000.0 * 10.0 * 0.8**2, rel=1e-6)


@pytest.mark.parametrize("implicit", [False, True])
def test_a_well_fills_its_hole(implicit: bool) -> None:
    """Water of one head: what it presses on the wall is its weight, in steps and in implicit ones."""
    sim, flow, wall = hollow(10, gravity=True)
    flow.fill(None, saturation=1.0)
    flow.drill("w", wall)
    flow.stage("w", PRESSURE, 1e5, math.inf, math.inf)
    sim.velocity_condition(outer(sim), vx=0.0, vy=0.0)
    if implicit:
        over(sim, 1e-3, 1)
    else:
        run(sim, 3)
    found = flow.wet_faces()
    assert len(found["number"]) == 8 and found["pressure"].min() == pytest.approx(1e5, rel=1e-6)
    assert found["pressure"].max() == pytest.approx(1e5 + 1000.0 * 10.0 * 0.2, rel=1e-6)
    assert forces(sim, flow) == pytest.approx([0.0, -1000.0 * 10.0 * 0.04], abs=0.5)


def outer(sim: Blocks) -> np.ndarray:
    x, y = sim.mesh.points.T
    return np.flatnonzero((np.abs(x - 0.5) > 0.49) | (np.abs(y - 0.5) > 0.49))


def test_a_well_that_is_pumped_presses_on_its_wall_by_derivatives() -> None:
    """Implicit steps find the pressure of a hole whose wall gives way in few iterations."""
    sim, flow, wall = hollow(10, gravity=True)
    flow.fill(None, saturation=1.0)
    flow.drill("w", wall)
    flow.stage("w", RATE, 1e-6, math.inf, math.inf)
    sim.velocity_condition(outer(sim), vx=0.0, vy=0.0)
    count = over(sim, 1.0, 4).count
    assert count.iterations <= 4 * count.steps and flow.wet_faces()["pressure"].min() > 1e4


def test_nobody_says_that_it_is_wet() -> None:
    """Water in all joints: the outside is dry, and the log says how it gets wet."""
    sim, flow = soaked(square(3, "tri", "both"))
    sim.log = Noted()
    flow.fill(None, pressure=P)
    sim.close_model()
    assert not len(flow.wet_faces()["number"])
    (line,) = [line for line in sim.log.lines if "are dry" in line]
    assert "12 free faces between flow nodes" in line and "well create" in line
    sim.stress_condition(near(sim.mesh, 1, 0.0), normal=TOTAL)
    hold(flow, np.union1d(at(sim, x=0.0), at(sim, y=0.0)), P)
    sim.close_model()
    line = sim.log.lines[-1]
    assert "loads 3 free faces" in line and "3 with water have a prescribed stress" in line
    assert "6 free faces between flow nodes are dry" in line


def test_a_wall_that_is_dug_later_is_as_wet_as_was_said() -> None:
    mesh = square(3)
    sim, flow = soaked(mesh)
    x, y = mesh.points.T
    wall = np.flatnonzero(np.abs(np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) - 1.0 / 6.0) < 1e-9)
    hold(flow, wall, P)
    assert not len(flow.wet_faces()["number"])
    changes.null(sim, np.array([4]))
    found = flow.wet_faces()
    assert len(found["number"]) == 4 and (found["number"] // 4 != 4).all()


def test_wet_faces_are_kept_by_files(tmp_path) -> None:
    sim, flow, wall = hollow(10, gravity=True)
    flow.fill(None, saturation=1.0)
    flow.drill("w", wall)
    flow.stage("w", PRESSURE, 1e5, math.inf, math.inf)
    flow.prescribe(at(sim, x=0.0), kernels.SURFACE, 0.8)
    run(sim, 2)
    saved_state.save(sim, tmp_path / "wet.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "wet.sav")
    run(sim, 2)
    run(again, 2)
    one, other = flow.wet_faces(), Flow.of(again).wet_faces()
    assert len(one["number"]) == 18
    for name in one:
        assert one[name].tolist() == other[name].tolist()
    for name in ("position_x", "stress_yy"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(again, name), equal_nan=True)


@pytest.mark.parametrize("seed", range(9))
def test_assignments_in_any_order(seed: int) -> None:
    """Random meshes, channels, cracks, pits, ranges, wells and stresses, beside a plain loop over all faces: wet are
    free ones, no sides of channels, without a stress, all of whose points a statement names that still holds."""
    rng = np.random.default_rng(seed)
    n = rng.integers(2, 4, 3)
    mesh = (
        rectangle(*n[:2], 1.0, 1.0, kind=("cross", "quad", "mixed")[seed % 3])
        if seed % 2
        else box(tuple(n), (1.0,) * 3)
    )
    sim = model(mesh) if mesh.dim == 2 else body(mesh)
    flow, joints = Flow.of(sim), inner(mesh)
    channels = np.sort(rng.choice(joints, len(joints) - len(joints) // 4, replace=False))
    flow.assign(channels, SOFT)
    changes.crack(sim, np.sort(rng.choice(joints, len(joints) // 5, replace=False)))
    sim.option(dynamic=False, collision=False)
    sim.flow_clock(dt=1e-9)
    faces = [f for f in range(4 * len(mesh.cells)) if mesh.dim == 3 or mesh.cells[f // 4, f % 4] >= 0]
    of = {f: set(mesh.face_points(np.array([f]))[0].tolist()) for f in faces}
    held, drilled, stressed = set(), set(), set()
    for k in range(12):
        there = np.unique(mesh.cells[sim.alive])
        there = there[there >= 0]
        low = rng.uniform(-0.5, 0.6, mesh.dim)
        chosen = there[((mesh.points[there] >= low) & (mesh.points[there] <= low + 0.9)).all(axis=1)]
        names = set(chosen.tolist())
        if not names:
            continue
        what = rng.choice(["pressure", "pressure", "rate", "remove", "well", "pit", "stress"])
        try:
            if what == "pressure":
                hold(flow, chosen, 1e4)
                held |= {f for f in faces if of[f] <= names}
            elif what == "rate":
                flow.prescribe(chosen, kernels.RATE, 1e-9)
                held -= {f for f in faces if of[f] & names}
            elif what == "remove":
                flow.remove_conditions(chosen)
                held -= {f for f in faces if of[f] & names}
            elif what == "well":
                flow.drill(f"w{k}", chosen)
                drilled |= {f for f in faces if of[f] <= names}
            elif what == "pit":
                changes.null(sim, rng.choice(np.flatnonzero(sim.alive), 1))
            else:
                some = np.intersect1d(rng.choice(outside(mesh), 2), [f for f in faces if sim.alive[f // 4]])
                sim.stress_condition(some, normal=-1e3)
                stressed |= set(some.tolist())
        except CommandError:  # no flow node in the range, or a node of a well
            continue
    wanted = []
    for f in faces:
        other = int(sim.partner[f])
        beside = other >= 0 and bool(sim.alive[other // 4])
        free = not beside or (bool(sim.open[f]) and min(f, other) not in channels)
        if sim.alive[f // 4] and free and f in held | drilled and f not in stressed:
            wanted.append(f)
    found = flow.wet_faces()
    assert found["number"].tolist() == (wanted if len(flow.network.channels) else [])  # with the last goes the fluid
    assert np.isfinite(found["pressure"]).all() and (found["pressure"] >= 0.0).all()


SCRIPT = """
pcdc mesh structured (0,0) (1,1) cells 5 5 type quad
pcdc element c-model mech-iso-e property density 2000 young 20e9 poisson-ratio 0.2
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 1e6 viscosity 1e-6 aperature-initial 1e-4 \\
    aperature-minumum 1e-5
pcdc model option dynamic off collision off
pcdc model time-step hydraulic 1e-9
pcdc element-face boundary m-s-b-c stress-normal -5e6 range y 1 1
"""


def test_a_script_asks_and_frames_show(tmp_path) -> None:
    """Faces under a prescribed stress are no wet ones; frames have both."""
    bench = Rock(tmp_path, SCRIPT)
    bench("pcdc node boundary hydra-c-f-b pressure 1e6\nfound = pcdc.wet_faces\n")
    assert not len(bench["found"]["number"])
    bench(
        "pcdc node boundary hydra-c-f-b pressure 1e6 range x 0 0\n"
        "pcdc node boundary hydra-c-f-b pressure 1e6 range y 1 1\npcdc model step 1\nfound = pcdc.wet_faces\n"
    )
    assert len(bench["found"]["number"]) == 5 and bench["found"]["pressure"] == pytest.approx(1e6)
    faces = frame_tables.tables(bench.blocks)["face-conditions"].columns
    assert len(faces["number"]) == 10 and np.isnan(faces["water_pressure"]).sum() == 5
    assert faces["water_pressure"][faces["normal_stress"] == 0.0] == pytest.approx(1e6)


# ---- fluid that is kept as it is -------------------------------------------------------------------------------------


def test_fluid_that_is_switched_off_continues_pushing() -> None:
    """Blocks come to rest at the pressures of that moment, stepped or at once, however stiff the fluid; it goes on with
    them, and no step shows that it was off."""
    found = {}
    for how in ("held", "off", "off, at once"):
        sim, flow = split(fluid_bulk=2.2e9)
        sim.flow_clock(dt=1e-9)
        flow.fill(None, pressure=1e6)
        if how == "held":
            hold(flow, flow.numbers("flow-node"), 1e6)
        else:
            sim.parts(hydraulic=False)
        if how == "off, at once":
            equilibrium.solve_elastic(sim)
        else:
            convergence.solve(sim, ratio=1e-9)
        found[how] = diagnostics.values(sim, "stress_yy").mean()
        time = flow.time
        sim.parts(hydraulic=True)
        assert flow.values("flow-node", "pressure") == pytest.approx(1e6, rel=1e-12)
        sim.close_model()
        assert flow.account()["relative"] < 1e-12
        run(sim, 1)
        assert flow.values("flow-node", "pressure") == pytest.approx(1e6, rel=1e-6)
        assert flow.time > time and (how == "held" or time == 0.0)
    assert found["off"] == pytest.approx(found["held"], rel=1e-6) and found["held"] < -5e4
    assert found["off, at once"] == pytest.approx(found["held"], rel=1e-5)


def test_a_file_in_mid_freeze(tmp_path) -> None:
    sim, flow = split(fluid_bulk=2.2e9)
    sim.flow_clock(dt=1e-9)
    flow.fill(None, pressure=1e6)
    sim.parts(hydraulic=False)
    run(sim, 40)
    saved_state.save(sim, tmp_path / "frozen.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "frozen.sav")
    for one in (sim, again):
        run(one, 40)
        one.parts(hydraulic=True)
        run(one, 20)
    one, other = flow, Flow.of(again)
    assert one.values("flow-node", "pressure").tolist() == other.values("flow-node", "pressure").tolist()
    assert one.account() == other.account() and one.account()["given"] > 0.0


# ---- sub-steps that cannot be ----------------------------------------------------------------------------------------


def test_a_sub_step_far_beyond_what_is_stable_is_refused() -> None:
    """Before the first one; not where all nodes are held, as then nothing can blow up."""
    sim, flow = soaked(square(3))
    sim.flow_clock(dt=1.0)
    with pytest.raises(CommandError, match=r"time-step hydraulic: sub-steps of 1 s are [0-9.e+]+ times what is"):
        run(sim, 1)
    hold(flow, None, P)
    run(sim, 1)
    sim, flow = soaked(square(3))
    sim.close_model()
    limit = 2.0 * flow.limit()
    sim.flow_clock(dt=1.2 * limit)
    run(sim, 1)  # with a warning


def test_a_well_whose_fluid_has_blown_up_says_so() -> None:
    sim, flow = soaked(square(3, "tri", "both"))
    flow.fill(None, pressure=P)
    flow.drill("w", flow.numbers("flow-node")[:3])
    flow.stage("w", RATE, 1e-6, math.inf, math.inf)
    run(sim, 1)
    flow.nodes[1, kernels.W] = math.nan
    with pytest.raises(PhysicsError, match="fluid at flow node 1 is not finite; the hydraulic time step"):
        run(sim, 1)
