"""Liners as scripts say them: commands, ranges, histories, frames, figures, errors with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.liners.beams import Beams
from hpcdem.physics.liners.model import Liners
from hpcdem.post import blocks as pictures
from hpcdem.post import liners as of_liners
from tests.pcdc.fake import Bench

CONCRETE = "density 2400 young 20e9 poisson-r 0.2 thickness 0.1 n-s 1e10 s-s 1e10"
BLOCK = """\
pcdc mesh structured (0,0) (2,1) cells 10 5
pcdc element c-model mech-iso-elastic property density 2700 young 5e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc model option dynamic off collision off
"""
LINED = (
    BLOCK
    + f"""\
pcdc liner create group 'top' set 's' range boundary y 1 1
pcdc liner create group 'side' set 's' range geometry 'right'
pcdc liner c-model beam property {CONCRETE} range group 'top' set 's'
pcdc liner c-model beam property {CONCRETE} b-c 1e6 b-f 20 range group 'side' set 's'
"""
)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))


def test_ranges_histories_values_and_going_on(bench: Bench, tmp_path: Path) -> None:
    bench(LINED + """\
pcdc liner-node group 'crown' range x 0.9 1.1 y 1 1
pcdc liner-node boundary l-n-f-b-c force-y -20e3 moment 1e3 range group 'crown'
pcdc liner-node boundary l-n-c velocity-x 0 spin 0 range id 0
pcdc history create 'most' liner-element value moment-first max range group 'top' set 's'
pcdc history create 'near' liner-node value displacement-y nearest (1,1) every 5
pcdc model step 20
m = pcdc.values('liner-element', 'moment-first', group='top', set='s')
n = pcdc.numbers('liner-node', group='crown')
pcdc liner delete range group 'side' set 's'
left = pcdc.numbers('liner-element')
pcdc model save 'a.sav'
pcdc model step 10
""")  # fmt: skip
    liners = Liners.of(bench.blocks)
    assert len(liners.elements["row"]) == 15 and bench["left"].tolist() == list(range(10))
    assert liners.nodes["origin"][bench["n"]] == pytest.approx(np.array([[1.0, 1.0]]))
    assert np.flatnonzero(liners.nodes["condition"]).tolist() == sorted([0, *bench["n"].tolist()])
    most = np.array(bench.project.histories["most"].rows)
    assert most[19, 2] == bench["m"].max() > 100.0
    near = np.array(bench.project.histories["near"].rows)
    assert near[-1, 2] == liners.values("liner-node", "displacement_y")[bench["n"][0]] < 0.0
    text = (tmp_path / "data" / "history_most.csv").read_text()
    assert text.startswith("step,time [s],moment_first [N m/m]")
    moment = liners.values("liner-element", "moment_first")[:10]
    again = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "more"))
    again("pcdc model restore 'a.sav'\npcdc model step 10\nv = pcdc.values('liner-element', 'moment-first', set='s')\n")
    assert np.array_equal(again["v"], moment)


def test_frames_hold_a_table_and_figures_show_it(bench: Bench, tmp_path: Path) -> None:
    bench(LINED + "pcdc liner-node boundary l-n-f-b-c force-y -2e4 force-x 1e4 range id 5\npcdc model step 30\n"
          "pcdc output vtk 'f'\n")  # fmt: skip
    liners = Liners.of(bench.blocks)
    state = read_mesh_frame(tmp_path / "data" / "f_0000000030.vtkhdf")
    for kind, name in (("liner-node", "nodes"), ("liner-element", "elements")):
        for quantity in Beams.quantities[kind]:
            assert np.array_equal(state.supports["liners"][name][quantity], liners.values(kind, quantity)), quantity
    first, last = (state.supports["liners"]["elements"][f"{end}_node"] for end in ("first", "last"))
    assert np.array_equal(np.column_stack([first, last]), liners.elements["ends"])
    # Beside an element its moments over the largest, away from the rock where they are positive.
    corners, moment = of_liners.areas(state, "moment_first", "moment_last")
    along, out = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    right = out[:, 0] * along[:, 1] - out[:, 1] * along[:, 0]
    extent = np.ptp(liners.nodes["x"], axis=0).max()
    assert np.hypot(*out.T) == pytest.approx(of_liners.HEIGHT * extent * np.abs(moment[:, 0]) / np.abs(moment).max())
    assert (np.sign(right) == np.sign(moment[:, 0])).all()
    labels = [handle.get_label() for handle in of_liners.draw(pictures.draw(state).axes[0], state)]
    force = liners.values("liner-element", "axial_force")
    assert labels == [f"N up to {force[np.abs(force).argmax()] / 1e3:.3g} kN/m",
                      f"M up to {np.abs(moment).max():.3g} N m/m"]  # fmt: skip
    pictures.plot(state, tmp_path / "a.png")
    drawn = (tmp_path / "a.png").read_bytes()
    state.supports = {}
    pictures.plot(state, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() != drawn  # the liners alone make the difference


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (f"liner c-model beam property {CONCRETE}", "no liners yet: use liner create first"),
        ("liner create", r"face 1 is not free"),
        ("history create 'h' liner-node value gap id 0", "a history of liner-node can follow"),
        ("liner delete", "no liners yet"),
        ("liner c-model beam property density 1 young 1 n-s 1 s-s 0", "needs its thickness"),
    ],
)
def test_errors_name_file_and_line(bench: Bench, line: str, message: str) -> None:
    with pytest.raises(ScriptError, match=rf"script\.sc:5: .*{message}"):
        bench(BLOCK + f"pcdc {line}\n")
    assert Liners.there(bench.blocks) is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("model step 1", r"liner-element 0 has no model \(10 in all\): assign liner c-model first"),
        ("liner create range boundary y 1 1", "face [0-9]+ has a liner already"),
        ("liner-node boundary l-n-f-b-c moment table 'q'", "there is no table 'q'"),
        ("model solve elastic", "the static solve does not support liners"),
    ],
)
def test_errors_of_liners_that_are_there(bench: Bench, line: str, message: str) -> None:
    with pytest.raises(HpcdemError, match=rf"script\.sc:6: .*{message}"):
        bench(BLOCK + f"pcdc liner create range boundary y 1 1\npcdc {line}\n")


def test_deleted_elements_are_no_longer_chosen(bench: Bench) -> None:
    bench(LINED + "pcdc liner delete range id 3\npcdc model step 1\nn = pcdc.numbers('liner-element')\n")
    assert bench["n"].tolist() == [0, 1, 2, *range(4, 15)]
    with pytest.raises(ScriptError, match=r"liner-element 3 was removed \(liner delete\)"):
        bench("pcdc liner delete range id 3\n")
