"""Liners on bodies of tetrahedra and hexahedra: bond, stages, energy, scripts; what shells alone do is in
tests/liners/test_shells.py, and what they share with beams in tests/liners."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError, ScriptError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.structures import REMOVED, VELOCITY
from hpcdem.physics.liners import kernels
from hpcdem.physics.liners.model import Liners
from hpcdem.physics.liners.shells import Shells
from hpcdem.post.view.moment import of_blocks
from hpcdem.post.view.scene import default_view, scene
from hpcdem.post.view.screen import paint
from tests.liners.support import SHOTCRETE, state
from tests.pcdc.fake import Bench
from tests.space.support import ROCK, body, box, faces_on, hexes, nodes_on

BOND = {**SHOTCRETE, "bond_tensile_strength": 0.5e6, "bond_cohesion": 0.2e6, "bond_friction": 30.0}
EVERY = {f"does_{part}": VELOCITY for part in ("x", "y", "z", "turn_x", "turn_y", "turn")}


def slab(dynamic: bool = False, young: float = 50e9, of=box, **bond: float) -> tuple[Blocks, Liners]:
    """A block of 1 m x 1 m x 0.5 m on a fixed base, with a liner on its top."""
    mesh = of((2, 2, 1), (1.0, 1.0, 0.5))
    sim = body(mesh, dynamic, young=young)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    liners = Liners.of(sim)
    _, elements = liners.create(faces_on(mesh, "top"))
    liners.assign(elements, {**BOND, **bond})
    return sim, liners


def drawn(sim: Blocks, liners: Liners, steps: int, **velocity: float) -> None:
    """All nodes of a liner moved with these ways per step."""
    liners.condition(np.arange(len(liners)), **EVERY, **velocity)
    convergence.advance(sim, steps)


@pytest.mark.parametrize("of", [box, pytest.param(hexes, marks=pytest.mark.slow)])
def test_it_parts_and_slips_as_in_the_plane(of) -> None:
    """The figures of tests/liners/test_bond.py, drawn along the diagonal of the face."""
    sim, liners = slab(young=1e15, of=of)
    assert len(liners) == 9 and len(liners.elements["row"]) == 8
    drawn(sim, liners, 100, at_z=-1e-6)
    assert liners.values("liner-element", "bond_pressure") == pytest.approx(1e6, rel=1e-3)
    drawn(sim, liners, 300, at_z=0.0, at_x=0.6e-6, at_y=0.8e-6)
    limit = 0.2e6 + 1e6 * np.tan(np.pi / 6.0)
    assert liners.values("liner-element", "bond_shear") == pytest.approx(limit, rel=1e-3)
    assert (liners.elements["bond_state"] == kernels.SLIPS | kernels.SLIPPED).all()
    assert liners.values("liner-element", "slip") == pytest.approx(3e-4 - limit / 1e10, rel=1e-3)
    force = liners._on_rock.sum(axis=0)
    assert force[:2] == pytest.approx(np.array([0.6, 0.8]) * limit, rel=1e-3)
    drawn(sim, liners, 200, at_x=0.0, at_y=0.0, at_z=1e-6)
    assert (liners.elements["bond_state"] & kernels.PARTED).all() and not liners.elements["shear"].any()
    assert not liners.elements["pressure"].any()
    assert liners.values("liner-element", "gap") == pytest.approx(1e-4, rel=1e-3)


def test_hosts_release_supports_elements_are_deleted_and_put_back() -> None:
    sim, liners = slab(young=1e9)
    drawn(sim, liners, 50, at_z=-1e-6)
    liners.remove_conditions(np.arange(len(liners)))
    host = liners.elements["host"]
    changes.null(sim, host[[0]])
    gone = host < 0
    assert gone.any() and not liners.elements["pressure"][gone].any() and liners.elements["pressure"][~gone].all()
    last = int(np.flatnonzero(~gone)[-1])
    face, ends = int(liners.elements["face"][last]), liners.elements["ends"][last].copy()
    liners.delete(np.array([last]))
    assert liners.elements["state"][last] & REMOVED and not liners.elements["force"][last].any()
    convergence.advance(sim, 100)
    assert np.isfinite(liners.nodes["x"]).all()
    _, elements = liners.create(np.array([face]))
    again = liners.elements["ends"][elements[0]]
    known = liners.alive("liner-node")[ends]
    assert again[known].tolist() == ends[known].tolist()


def test_the_account_of_energy_closes() -> None:
    """Drawn off with yield, slip and parting, in motion, under gravity; what commands change is theirs. With small
    strains forces of the rock are exactly those of its energy, with large ones to the order of the strain (4e-5 here,
    docs/blocks.md)."""
    sim, liners = slab(True, 5e9, tensile_strength=0.3e6, compressive_strength=1e6, bond_tensile_strength=1e5,
                       bond_cohesion=5e4)  # fmt: skip
    sim.option(large_strain=False)
    sim.gravity(0.0, 0.0, -9.81)
    liners.condition(np.array([0]), does_z=VELOCITY, at_z=0.6, does_x=VELOCITY, at_x=0.5)
    liners.condition(np.array([8]), force_z=-3e4, moment_y=200.0)
    convergence.advance(sim, 20)
    diagnostics.account_energy(sim)  # in motion
    for steps in (40, 540, 0, 0, 20):
        convergence.advance(sim, steps)
        found, rock = liners.energies(), diagnostics.energies(sim)
        assert found["work_of_conditions"] > 1.0 and found["relative"] < 1e-4
        assert rock["work_liners"] == found["work_on_rock"] != 0.0 and rock["relative"] < 1e-9
        if steps == 540:
            assert min(found["lost_in_beams"], found["lost_in_bond"]) > 0.01
            assert (liners.elements["bond_state"] & kernels.PARTED).any()
            liners.delete(np.flatnonzero((liners.elements["ends"] == 0).any(axis=1))[:1])
        elif steps == 0:
            sim.time_step(0.5 * sim.clock.dt)


@pytest.mark.parametrize("at", [0, 60, 200])
def test_a_saved_model_continues(at: int, tmp_path: Path) -> None:
    sim, liners = slab(True, 5e9, tensile_strength=0.3e6, compressive_strength=1e6, bond_tensile_strength=1e5)
    sim.table("pull", [(0.0, 0.0), (1e-3, 0.5)])
    liners.condition(np.array([0]), does_z=VELOCITY, at_z="pull", does_turn_x=VELOCITY, at_turn_x=3.0)
    convergence.advance(sim, at)
    if at == 60:
        changes.null(sim, liners.elements["host"][[2]])
        liners.delete(np.array([3]))
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 60)
    for name, found in state(liners).items():
        assert np.array_equal(found, state(Liners.of(again))[name]), name
    position = [diagnostics.values(one, "position_z") for one in (sim, again)]
    assert np.array_equal(*position, equal_nan=True)


def test_what_makes_no_sense_is_refused() -> None:
    sim, liners = slab()
    with pytest.raises(CommandError, match="has a liner already"):
        liners.create(faces_on(sim.mesh, "top"))
    with pytest.raises(CommandError, match="in space a liner is a shell with a thickness: it has no inertia"):
        liners.assign(np.arange(8), {**SHOTCRETE, "inertia": 1e-4})
    with pytest.raises(CommandError, match="there is no quantity axial_force of a liner-element"):
        liners.values("liner-element", "axial_force")


# ---- scripts ---------------------------------------------------------------------------------------------------------

WORDS = "density 2400 young 20e9 poisson-r 0.2 thickness 0.1 n-s 1e10 s-s 1e10"
CUBE = f"""\
pcdc model new dim 3
pcdc mesh structured (0,0,0) (1,1,1) cells 3 3 3
pcdc element c-model mech-iso-elastic property density {ROCK["density"]} young 5e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 1 range z 0 0
pcdc model option dynamic off collision off
"""
LINED = CUBE + f"""\
pcdc liner create group 'top' set 's' range boundary z 1 1
pcdc liner create group 'side' set 's' range boundary x 1 1
pcdc liner c-model shell property {WORDS} range group 'top' set 's'
pcdc liner c-model beam property {WORDS} b-c 1e6 b-f 20 range group 'side' set 's'
"""  # fmt: skip


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))


def test_commands_histories_frames_pictures_and_going_on(bench: Bench, tmp_path: Path) -> None:
    bench(LINED + """\
pcdc liner-node group 'crown' range x 0.6 0.7 y 0.6 0.7 z 1 1
pcdc liner-node boundary l-n-f-b-c force-z -20e3 moment-x 1e3 range group 'crown'
pcdc liner-node boundary l-n-c velocity-z 0 spin-x 0 range id 0
pcdc history create 'most' liner-element value bending-largest max range group 'top' set 's'
pcdc history create 'near' liner-node value displacement-z nearest (0.6,0.6,1) every 5
pcdc history create 'held' liner-node value reaction-moment-x id 0 every 5
pcdc model step 20
m = pcdc.values('liner-element', 'bending-largest', group='top', set='s')
n = pcdc.numbers('liner-node', group='crown')
pcdc model save 'a.sav'
pcdc output vtk 'f'
pcdc model step 10
""")  # fmt: skip
    liners = Liners.of(bench.blocks)
    assert len(liners.elements["row"]) == 36 and len(liners) == 16 + 12  # one edge together
    assert liners.nodes["origin"][bench["n"]] == pytest.approx(np.array([[2.0 / 3.0, 2.0 / 3.0, 1.0]]))
    most, near = (np.array(bench.project.histories[name].rows) for name in ("most", "near"))
    assert most[19, 2] == bench["m"].max() > 100.0
    assert near[-1, 2] == liners.values("liner-node", "displacement_z")[bench["n"][0]] < 0.0
    for name, title in (("most", "bending_largest [N m/m]"), ("held", "reaction_moment_x [N m]")):
        assert (tmp_path / "data" / f"history_{name}.csv").read_text().startswith(f"step,time [s],{title}")
    frame = read_mesh_frame(tmp_path / "data" / "f_0000000020.vtkhdf", solid=True)
    again = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "more"))
    again("pcdc model restore 'a.sav'\nm = pcdc.values('liner-element', 'bending-largest', group='top', set='s')\n")
    before = Liners.of(again.blocks)
    for kind, name in (("liner-node", "nodes"), ("liner-element", "elements")):
        for quantity in Shells.quantities[kind]:
            assert np.array_equal(frame.supports["liners"][name][quantity], before.values(kind, quantity)), quantity
    again("pcdc model step 10\n")
    for name, found in state(liners).items():
        assert np.array_equal(found, state(before)[name]), name
    moment = of_blocks(frame)
    view = default_view(moment)
    with_them = paint(scene(moment, view), 600, 450)
    number = [layer.object for layer in view.layers].index("liners")
    shown = np.unique(with_them.row[with_them.layer == number])
    assert len(shown) > 15  # the faces that look this way
    assert moment.objects["liners"].centres().shape == (36, 3)
    assert moment.unit_of("bending_smallest") == "N m/m" and moment.unit_of("membrane_xx") == "N/m"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (f"liner c-model beam property {WORDS}", "no liners yet: use liner create first"),
        ("liner create range z 0.3 0.4", "is not free"),
    ],
)
def test_errors_name_file_and_line(bench: Bench, line: str, message: str) -> None:
    with pytest.raises((HpcdemError, ScriptError), match=rf"script\.sc:6: .*{message}"):
        bench(CUBE + f"pcdc {line}\n")
    assert Liners.there(bench.blocks) is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("liner-node boundary l-n-c spin 0", "spin.* is for two dimensions"),
        (f"liner c-model beam property {WORDS} inertia 1e-4", "inertia.* is for two dimensions"),
        ("history create 'h' liner-element value moment-first id 0", "no quantity moment-first of a liner-element"),
        ("model solve elastic", "the static solve does not support liners"),
    ],
)
def test_words_of_the_plane_are_refused(bench: Bench, line: str, message: str) -> None:
    with pytest.raises((HpcdemError, ScriptError), match=message):
        bench(LINED + f"pcdc {line}\n")
