"""Rock bolts in bodies of tetrahedra: the closed form of pulling out along any line, installed, tensioned, excavated;
the rest they share with those in the plane (tests/bolts)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError, ScriptError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.bolts import kernels, layout
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.post.view.moment import of_blocks
from hpcdem.post.view.scene import THROUGH, default_view, scene
from hpcdem.post.view.screen import paint
from tests.bolts import exact
from tests.bolts.support import STEEL, head, state
from tests.pcdc.fake import Bench
from tests.space.support import ROCK, body, box, nodes_on

EA = exact.axial_stiffness(200e9, 0.025)
STRENGTH = math.pi * 0.025 * 2e6
HEAD = np.array([0])
BEGIN = (0.05, 0.06, 0.04)
LINES = {"diagonal": (1.0, 1.0, 1.0), "z": (0.0, 0.0, 1.0), "askew": (0.2, -0.3, 0.8)}


def bolt(sim: Blocks, *points: tuple[float, float, float], **more: object) -> Bolts:
    bolts = Bolts.of(sim)
    of_bolt = {name: more.pop(name) for name in ("segments", "length", "grout", "plate") if name in more}
    _, elements = bolts.create(points, **of_bolt)
    bolts.assign(elements, {**STEEL, **more})
    return bolts


def in_fixed_rock(way: Sequence[float], **changes_: float) -> tuple[Blocks, Bolts, np.ndarray]:
    """A bolt of 1 m in this direction in rock that is held everywhere, static mode, and the unit vector along it."""
    sim = body(box((4, 4, 5), (0.8, 0.8, 1.1), shaken=0.2), dynamic=False)
    sim.move_constraint(None, 1)
    along = np.array(way) / np.linalg.norm(way)
    first = np.array(BEGIN) if along[1] >= 0.0 else np.array([0.05, 0.75, 0.04])
    bolts = bolt(sim, tuple(first), tuple(first + along), segments=40, **changes_)
    return sim, bolts, along


def held(sim: Blocks, bolts: Bolts, along: np.ndarray, force: float) -> float:
    """Displacement of the head against the bolt [m] at equilibrium with this pull [N]."""
    bolts.condition(HEAD, **{f"force_{axis}": -force * along[k] for k, axis in enumerate("xyz")})
    assert convergence.solve(sim, ratio=1e-8, cycles=100_000).reason == "ratio"
    return -sum(head(bolts, f"displacement_{axis}") * along[k] for k, axis in enumerate("xyz"))


@pytest.mark.slow
@pytest.mark.parametrize("way", ["diagonal", "z", "askew"])
def test_stiffness_slip_and_ultimate_load(way: str) -> None:
    """The figures of the bolt along x in the plane, along any line."""
    sim, bolts, along = in_fixed_rock(LINES[way])
    assert 10e3 / held(sim, bolts, along, 10e3) == pytest.approx(3.123e8, rel=0.01)
    held(sim, bolts, along, 49.05e3 * 0.995)
    assert not (bolts.nodes["bond_state"] & kernels.SLIPPED).any()
    held(sim, bolts, along, 49.05e3 * 1.005)
    assert (bolts.nodes["bond_state"] & kernels.SLIPPED > 0).tolist() == [True] + 40 * [False]
    held(sim, bolts, along, 157.08e3 * 0.995)
    bolts.condition(HEAD, **{f"force_{axis}": -157.08e3 * 1.005 * along[k] for k, axis in enumerate("xyz")})
    assert convergence.solve(sim, ratio=1e-8, cycles=2000).reason == "cycles"  # it slides out
    assert (bolts.nodes["bond_state"] & kernels.SLIPS).all() and (bolts.nodes["slip"] < 0.0).all()


def test_yield_and_rupture_along_the_diagonal() -> None:
    sim, bolts, along = in_fixed_rock(LINES["diagonal"], tensile_yield_force=100e3, tension_failure_strain=0.02)
    speed = {f"does_{axis}": kernels.VELOCITY for axis in "xyz"}
    bolts.condition(HEAD, **speed, **{f"at_{axis}": -2e-7 * along[k] for k, axis in enumerate("xyz")})
    convergence.advance(sim, 3000)
    assert bolts.values("bolt-element", "axial_force")[0] == 100e3
    load = -sum(head(bolts, f"reaction_{axis}") * along[k] for k, axis in enumerate("xyz"))
    assert load == pytest.approx(100e3 + STRENGTH / 80.0, rel=1e-3)
    convergence.advance(sim, 1500)
    assert (bolts.elements["state"] & kernels.RUPTURED != 0).tolist() == [True] + 39 * [False]
    assert bolts.values("bolt-element", "axial_force")[0] == 0.0


@pytest.mark.slow
def test_pressure_across_the_bar_adds_friction() -> None:
    """sigma_n = (tr sigma - t . sigma t) / 2, worked out for a bar along z, x and the diagonal."""
    stress = {"xx": -1e6, "yy": -3e6, "zz": -8e6, "xy": 5e5, "xz": -4e5, "yz": 3e5}
    normal = {"z": -2e6, "x": -5.5e6, "diagonal": 0.5 * (-12e6 - (-12e6 + 2.0 * (5e5 - 4e5 + 3e5)) / 3.0)}
    for name, way in (("z", LINES["z"]), ("x", (1.0, 0.0, 0.0)), ("diagonal", LINES["diagonal"])):
        sim = body(box((4, 4, 4), (1.2, 1.2, 1.2), shaken=0.2), dynamic=False)
        sim.move_constraint(None, 1)
        sim.initial_stress(None, **stress)
        along = np.array(way) / np.linalg.norm(way)
        friction = {"friction_grout_bolt": 30.0, "friction_rock_grout": 30.0, "tensile_yield_force": 1e9}
        bolts = bolt(sim, BEGIN, tuple(np.array(BEGIN) + along), segments=20, **friction)
        speed = {f"does_{axis}": kernels.VELOCITY for axis in "xyz"}
        bolts.condition(HEAD, **speed, **{f"at_{axis}": -2e-6 * along[k] for k, axis in enumerate("xyz")})
        convergence.advance(sim, 3000)
        found = np.abs(bolts.values("bolt-node", "bond_force"))
        wanted = math.pi * 0.025 * (2e6 - normal[name] * math.tan(math.pi / 6.0))
        assert found == pytest.approx(wanted, rel=1e-6), name


def test_crossed_faces_divide_it_as_a_plain_search_does() -> None:
    """Between two nodes the line stays in one element; each node but the ends is on a face."""
    mesh = box((3, 3, 3), (1.0, 1.0, 1.0), shaken=0.25)
    corners = mesh.points[mesh.cells]
    line = layout.checked([(0.1, 0.2, 0.07), (0.9, 0.73, 0.81)], 3)
    nodes = layout.split(line, corners, mesh.cells, 1e-9, None, None)
    assert len(nodes) == 10
    inner = np.concatenate(
        [
            layout.hosts(
                nodes[:-1] + part * np.diff(nodes, axis=0), corners, mesh.cells, np.ones(len(mesh.cells), bool)
            )[0][None]
            for part in (0.01, 0.5, 0.99)
        ]
    )
    assert (inner == inner[0]).all() and (inner[0] >= 0).all() and (np.diff(inner[0]) != 0).all()
    for at in nodes[1:-1]:
        weights = [layout.coordinates(at, corners[e], False) for e in range(len(corners))]
        assert any(abs(w.min()) < 1e-9 for w in weights)
    assert np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum() == pytest.approx(np.linalg.norm(line[1] - line[0]))


@pytest.mark.slow
def test_a_block_hangs_on_a_bolt_and_a_plate() -> None:
    """A block under a void hangs on one bolt: all of its weight is in the bar where it crosses the void."""
    sim = body(box((2, 2, 12), (0.4, 0.4, 1.2)), dynamic=False)
    sim.gravity(0.0, 0.0, -9.81)
    sim.velocity_condition(nodes_on(sim.mesh, "top"), vz=0.0)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    bolts = bolt(sim, (0.2, 0.2, 0.0), (0.2, 0.2, 1.1), plate=True, segments=22, grout=(0.6, 1.1))
    middle = sim.mesh.centroids()[:, 2]
    changes.null(sim, np.flatnonzero((middle > 0.4) & (middle < 0.6)))
    assert convergence.solve(sim, ratio=1e-7, cycles=200_000).reason == "ratio"
    weight = 2700.0 * 9.81 * 0.4**3
    assert bolts.values("bolt-element", "axial_force")[1:12] == pytest.approx(weight, rel=1e-4)
    assert bolts.nodes["bond"].sum() == pytest.approx(weight, rel=1e-4)
    assert diagnostics.total(sim, "reaction_z") == pytest.approx(2700.0 * 9.81 * 0.16 * 1.0, rel=1e-4)


def test_bolts_bring_no_force_or_moment_from_nowhere() -> None:
    """A tensioned bolt with a kink in a free body: what it does to the rock adds up to nothing."""
    sim = body(box((3, 3, 3), (1.0, 1.0, 1.0)), young=1e9)
    points = (0.13, 0.2, 0.97), (0.31, 0.5, 0.41), (0.83, 0.6, 0.22)
    bolts = bolt(sim, *points, plate=True, pretension_force=50e3, grout=(0.4, 2.0))
    convergence.advance(sim, 300)
    force = bolts._on_rock
    bar = (bolts._total * bolts._tangent).sum(axis=1) + bolts.nodes["bond"]
    free = bolts.nodes["plate"] == 0
    missing = (bar[free, None] * bolts._tangent[free]).sum(axis=0)
    assert np.abs(force).max() > 1e4
    assert np.allclose(force.sum(axis=0) + missing, 0.0, atol=1e-9 * np.abs(force).sum())
    assert diagnostics.values(sim, "stress_zz").min() < -1e5


@pytest.mark.parametrize("at", [20, *(pytest.param(n, marks=pytest.mark.slow) for n in (0, 150))])
def test_a_saved_model_continues(at: int, tmp_path: Path) -> None:
    """Before the first step, in mid-run with hosts taken out, after rupture."""
    sim = body(box((3, 3, 3), (1.0, 1.0, 1.0)), young=5e9)
    sim.velocity_condition(nodes_on(sim.mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    bolts = bolt(sim, (0.5, 0.52, 1.0), (0.42, 0.3, 0.2), segments=20, tensile_yield_force=8e3,
                 tension_failure_strain=0.05, friction_rock_grout=30.0, cohesion_grout_bolt=2e5)  # fmt: skip
    bolts.condition(HEAD, does_z=kernels.VELOCITY, at_z=0.5, force_x=100.0)
    convergence.advance(sim, at)
    assert (bolts.elements["state"] & kernels.RUPTURED > 0).any() == (at == 150)
    if at == 20:
        changes.null(sim, np.array([int(bolts.nodes["host"][2])]))
        assert not bolts.hosted[2]
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 60)
    for name, values in state(bolts).items():
        assert np.array_equal(values, state(Bolts.of(again))[name]), name
    one, other = (diagnostics.values(model, "position_z") for model in (sim, again))
    assert np.array_equal(one, other, equal_nan=True)


def test_what_makes_no_sense_is_refused() -> None:
    sim = body(box((2, 2, 2), (1.0, 1.0, 1.0)))
    bolts = Bolts.of(sim)
    with pytest.raises(CommandError, match="vectors of 3 numbers"):
        bolts.create([(0.5, 0.5), (0.5, 0.9)])
    with pytest.raises(CommandError, match=r"coincide, \(0.5,0.5,0.5\)"):
        bolts.create([(0.5, 0.5, 0.5), (0.5, 0.5, 0.5)])
    with pytest.raises(CommandError, match="no node of the bolt lies in an element"):
        bolts.create([(2.0, 2.0, 2.0), (3.0, 3.0, 3.0)])
    _, elements = bolts.create([(0.5, 0.5, 0.5), (0.5, 0.5, 0.9)])
    with pytest.raises(CommandError, match="spacing must be 1, got 2"):
        bolts.assign(elements, {**STEEL, "spacing": 2.0})
    bolts.assign(elements, {**STEEL, "spacing": 1.0})
    sim.step()


# ---- scripts ---------------------------------------------------------------------------------------------------------

WORDS = "density 7850 young 200e9 diameter 0.025 s-s-r-b 1e9 g-t 0.0125 c-r-g 1.5e6 c-g-b 2e6"
CUBE = f"""\
pcdc model new dim 3
pcdc mesh structured (0,0,0) (1,1,1) cells 3 3 3
pcdc element c-model mech-iso-elastic property density {ROCK["density"]} young 5e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 1 range z 0 0
pcdc model option dynamic off collision off
"""
BOLTED = (
    CUBE
    + f"""\
pcdc bolt create polyline (0.3,0.4,1) (0.6,0.5,0.3) plate grout 0.2 9 group 'a' set 's'
pcdc bolt create polyline (0.7,0.4,1) (0.7,0.8,0.6) (0.7,0.8,0.2) length 0.1 group 'b' set 's'
pcdc bolt c-model mech-e-p property {WORDS} pre-f 50e3 range group 'a' set 's'
pcdc bolt c-model mech-e-p property {WORDS} range group 'b' set 's'
"""
)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))


def test_commands_histories_frames_pictures_and_going_on(bench: Bench, tmp_path: Path) -> None:
    bench(BOLTED + """\
pcdc bolt-node group 'heads' range z 0.99 1.01
pcdc bolt-node boundary b-n-f-b-c force-z 20e3 range group 'b' set 's' z 0.99 1
pcdc history create 'most' bolt-element value axial-force max range group 'a' set 's'
pcdc history create 'near' bolt-node value displacement-z nearest (0.7,0.4,1) every 5
pcdc history create 'bond' bolt-node value bond-force id 3 every 5
pcdc model step 20
a = pcdc.values('bolt-element', 'axial-force', group='a', set='s')
n = pcdc.numbers('bolt-node', group='heads')
pcdc model save 'a.sav'
pcdc output vtk 'f'
pcdc model step 10
""")  # fmt: skip
    bolts = Bolts.of(bench.blocks)
    assert bench["n"].tolist() == np.flatnonzero(bolts.nodes["arc"] == 0.0).tolist()
    most, near = (np.array(bench.project.histories[name].rows) for name in ("most", "near"))
    assert most[19, 2] == bench["a"].max() > 30e3
    assert near[-1, 2] == bolts.values("bolt-node", "displacement_z")[bench["n"][1]] > 0.0
    assert (tmp_path / "data" / "history_bond.csv").read_text().startswith("step,time [s],bond_force [N/m]")
    kept = read_mesh_frame(tmp_path / "data" / "f_0000000020.vtkhdf", solid=True)
    assert np.array_equal(kept.supports["bolts"]["nodes"]["position_z"][bench["n"]] > 0.99, [True, True])
    again = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "more"))
    again("pcdc model restore 'a.sav'\npcdc model step 10\nv = pcdc.values('bolt-element', 'axial-force', set='s')\n")
    assert np.array_equal(again["v"], bolts.values("bolt-element", "axial_force"))
    moment = of_blocks(kept)
    view = default_view(moment)
    assert [layer.opacity for layer in view.layers if layer.object == "elements"] == [THROUGH]
    with_them = paint(scene(moment, view), 600, 450)
    number = [layer.object for layer in view.layers].index("bolts")
    shown = with_them.row[with_them.layer == number]
    assert set(np.unique(shown)) == set(range(len(bolts.elements["force"])))  # each bar is seen
    less = moment.objects.pop("bolts")
    assert less.centres().shape == (len(bolts.elements["force"]), 3)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("bolt create polyline (0.5,1) (0.5,0.3)", "vector"),
        ("bolt create polyline (5,5,5) (6,6,6)", "no node of the bolt lies in an element"),
    ],
)
def test_errors_name_file_and_line(bench: Bench, line: str, message: str) -> None:
    with pytest.raises((HpcdemError, ScriptError), match=rf"script\.sc:6: .*{message}"):
        bench(CUBE + f"pcdc {line}\n")
    assert Bolts.there(bench.blocks) is None


def test_what_is_for_space_is_refused_in_the_plane(tmp_path: Path) -> None:
    flat = (
        "pcdc mesh structured (0,0) (2,1) cells 4 2\npcdc element c-model mech-iso-e property den 2700 y 5e9 p-r 0.2\n"
    )
    flat += f"pcdc bolt create polyline (0.5,1) (0.6,0.3)\npcdc bolt c-model mech-e-p property {WORDS}\n"
    for line, message in (
        ("bolt-node boundary b-n-c velocity-z 1", "velocity-z.* is for three dimensions"),
        ("history create 'h' bolt-node value position-z id 0", "no quantity position-z of a bolt-node"),
    ):
        with pytest.raises((HpcdemError, ScriptError), match=message):
            Bench(tmp_path, blocks=Blocks())(flat + f"pcdc {line}\n")
