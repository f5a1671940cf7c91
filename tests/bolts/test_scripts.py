"""Bolts as scripts say them: commands, ranges, histories, frames, figures, errors with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.bolts.model import QUANTITIES, Bolts
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.post import blocks as pictures
from hpcdem.post import bolts as of_bolts
from tests.pcdc.fake import Bench

STEEL = "density 7850 young 200e9 diameter 0.025 s-s-r-b 1e9 g-t 0.0125 c-r-g 1.5e6 c-g-b 2e6"
BLOCK = """\
pcdc mesh structured (0,0) (2,1) cells 10 5
pcdc element c-model mech-iso-elastic property density 2700 young 5e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc model option dynamic off collision off
"""
BOLTED = (
    BLOCK
    + f"""\
pcdc bolt create polyline (0.5,1) (0.6,0.3) plate grout 0.2 9 group 'a' set 's'
pcdc bolt create polyline (1.5,1) (1.4,0.3) length 0.1 group 'b' set 's'
pcdc bolt c-model mech-e-p property {STEEL} pre-f 50e3 spac 1.5 range group 'a' set 's'
pcdc bolt c-model mech-e-p property {STEEL} range group 'b' set 's'
"""
)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))


def test_ranges_histories_values_and_going_on(bench: Bench, tmp_path: Path) -> None:
    bench(BOLTED + """\
pcdc bolt-node group 'heads' range y 0.99 1.01
pcdc bolt-node boundary b-n-f-b-c force-y 20e3 range group 'b' set 's' y 0.99 1
pcdc history create 'most' bolt-element value axial-force max range group 'a' set 's'
pcdc history create 'one' bolt-element value axial-strain id 0 every 5
pcdc history create 'near' bolt-node value displacement-y nearest (1.5,1) every 5
pcdc model step 20
a = pcdc.values('bolt-element', 'axial-force', group='a', set='s')
n = pcdc.numbers('bolt-node', group='heads')
s = pcdc.total('bolt-node', 'bond-force')
pcdc model save 'a.sav'
pcdc model step 10
""")  # fmt: skip
    bolts = Bolts.of(bench.blocks)
    assert bench["n"].tolist() == np.flatnonzero(bolts.nodes["arc"] == 0.0).tolist()
    most = np.array(bench.project.histories["most"].rows)
    assert most[:20, 0].tolist() == list(range(1, 21)) and most[19, 2] == bench["a"].max() > 30e3
    near = np.array(bench.project.histories["near"].rows)
    assert near[-1, 2] == bolts.values("bolt-node", "displacement_y")[bench["n"][1]] > 0.0
    assert (tmp_path / "data" / "history_most.csv").read_text().startswith("step,time [s],axial_force [N]")
    force = bolts.values("bolt-element", "axial_force")
    again = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "more"))
    again("pcdc model restore 'a.sav'\npcdc model step 10\nv = pcdc.values('bolt-element', 'axial-force', set='s')\n")
    assert np.array_equal(again["v"], force)


def test_frames_hold_a_table_and_figures_show_it(bench: Bench, tmp_path: Path) -> None:
    bench(BOLTED + "pcdc model step 30\npcdc output vtk 'f'\n")
    bolts = Bolts.of(bench.blocks)
    state = read_mesh_frame(tmp_path / "data" / "f_0000000030.vtkhdf")
    for kind, name in (("bolt-node", "nodes"), ("bolt-element", "elements")):
        assert not any(quantity.endswith("_z") for quantity in state.supports["bolts"][name])
        for quantity in [quantity for quantity in QUANTITIES[kind] if not quantity.endswith("_z")]:
            assert np.array_equal(state.supports["bolts"][name][quantity], bolts.values(kind, quantity)), quantity
    assert np.array_equal(state.supports["bolts"]["elements"]["first_node"], bolts.first)
    assert np.array_equal(state.supports["bolts"]["nodes"]["bolt"], bolts.nodes["bar"])
    # The area beside an element: as wide as its force over the largest, to the left of the bar in tension.
    corners, force = of_bolts.areas(state)
    along, out = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    longest = bolts.nodes["arc"].max()
    left = along[:, 0] * out[:, 1] - along[:, 1] * out[:, 0]
    assert np.hypot(*out.T) == pytest.approx(of_bolts.HEIGHT * longest * np.abs(force) / np.abs(force).max(), rel=1e-6)
    assert (np.sign(left) == np.sign(force)).all()
    labels = [handle.get_label() for handle in of_bolts.draw(pictures.draw(state).axes[0], state)]
    assert labels[0] == f"tension up to {force.max() / 1e3:.3g} kN"
    pictures.plot(state, tmp_path / "a.png")
    drawn = (tmp_path / "a.png").read_bytes()
    state.supports = {}
    pictures.plot(state, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() != drawn  # the bolts alone make the difference


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (f"bolt c-model mech-e-p property {STEEL}", "no bolts yet: use bolt create first"),
        ("bolt create polyline (5,5) (6,6)", "no node of the bolt lies in an element"),
        ("bolt create polyline (0.5,1) (0.5,[0.5+0.5])", "two consecutive points of the bolt coincide"),
        ("history create 'h' bolt-node value slip id 0", "no bolts yet"),
        ("history create 'h' bolt-node value axial-force id 0", "a history of bolt-node can follow"),
        ("history create 'h' bolt-element value axial-force nearest (1,1)", "no bolts yet"),
    ],
)
def test_errors_name_file_and_line(bench: Bench, line: str, message: str) -> None:
    with pytest.raises(ScriptError, match=rf"script\.sc:5: .*{message}"):
        bench(BLOCK + f"pcdc {line}\n")
    assert Bolts.there(bench.blocks) is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("model step 1", r"bolt-element 0 has no model \(7 in all\): assign bolt c-model first"),
        (
            f"bolt c-model mech-e-p property {STEEL} range id 99",
            "there is no bolt-element 99; numbers range from 0 to 6",
        ),
        ("bolt-node boundary b-n-f-b-c force-x 1 range group 'q'", "there is no set 'default' of bolt-nodes"),
        ("bolt-node boundary b-n-f-b-c force-x table 'q'", "there is no table 'q'"),
        ("model solve elastic", "the static solve does not support bolts"),
    ],
)
def test_errors_of_bolts_that_are_there(bench: Bench, line: str, message: str) -> None:
    with pytest.raises(HpcdemError, match=rf"script\.sc:6: .*{message}"):
        bench(BLOCK + f"pcdc bolt create polyline (0.5,1) (0.5,0.3) length 0.1\npcdc {line}\n")


def test_a_new_model_has_no_bolts(bench: Bench) -> None:
    bench(BOLTED + "pcdc model step 5\npcdc model new\n" + BLOCK + "pcdc model step 5\n")
    assert Bolts.there(bench.blocks) is None and not bench.project.groups["bolt-node"].sets
