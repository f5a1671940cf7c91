"""Proppant in models that are made by scripts: commands, histories, frames, accounts, what cannot be done."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.proppant.model import Proppant
from hpcdem.post import blocks
from hpcdem.post.measure import report
from hpcdem.post.measure.scene import Request
from tests.flow.test_pictures import Quiet, coloured
from tests.pcdc.fake import Bench, Noted

MEDIUM = "f-den 1000 f-bulk 2.2e9 vis 1e-6 a-initial 1e-2 a-min 1e-3 p-den 2650 p-s 5e-4 p-c-l 0.6"
SCRIPT = """
pcdc model new
pcdc model gravity (0,-9.81)
pcdc mesh structured (0,0) (0.4,2) cells 2 20
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model hydr-p-p-m property MEDIUM range x 0.2 0.2
pcdc flow-node initial pressure 1e5
pcdc model option mechanical off
""".replace("MEDIUM", MEDIUM)


def bench(tmp_path: Path, more: str) -> Bench:
    return Bench(tmp_path, blocks=Blocks(SerialComm()))(f"{SCRIPT}{more}\n")


FLOW = """
pcdc node group 'low' set 'end' range y 0 0
pcdc node group 'high' set 'end' range y 2 2
pcdc node boundary hydra-c-f-b flow-rate 1e-4 range group 'low' set 'end'
pcdc node boundary hydra-c-f-b pressure 1e5 range group 'high' set 'end'
pcdc node boundary hydra-p-b p-v-c 0.1 range group 'low' set 'end'
pcdc history create 'sand' model value proppant-stored
pcdc history create 'top' flow-node value concentration nearest (0.2,2)
"""


def test_slurry_is_pumped_through_a_slot(tmp_path: Path) -> None:
    found = bench(tmp_path, FLOW + "pcdc model solve hydraulic time 100 dt 1\naccount = pcdc.proppant")
    model, account = found.project, found["account"]
    assert account["came"] == pytest.approx(0.1 * 1e-4 * 100.0, rel=1e-6)
    assert account["relative"] < 1e-12 and account["stored"] == pytest.approx(account["came"], rel=1e-12)
    rows = {name: np.array(history.rows)[:, 2] for name, history in model.histories.items()}
    assert rows["sand"][-1] == account["stored"] and rows["sand"][0] < account["stored"] and rows["top"][-1] < 0.01
    frame = frames.whole(model)
    number, c = frame.of_joints["number"], frame.of_joints["proppant_concentration"]
    channels = fdem.queries.numbers(model, CHANNEL)
    assert c[np.isin(number, channels)] == pytest.approx(fdem.queries.values(model, CHANNEL, "concentration"))
    assert "concentration" in blocks.panels_of(frame)
    (seen,) = coloured(blocks.draw(frame, blocks.Appearance(("concentration",))))
    assert np.sort(np.asarray(seen)) == pytest.approx(np.sort(c[np.isfinite(c)]))
    assert np.nanmax(c) > 0.05 and not np.nanmax(frame.of_joints["pack_pressure"]) > 0.0
    assert fdem.queries.values(model, FLOW_NODE, "proppant").sum() == pytest.approx(account["stored"])


def test_a_diagram_shows_where_it_is(tmp_path: Path) -> None:
    chart = """
pcdc model solve hydraulic time 100 dt 1
pcdc chart create 'sand'
pcdc chart add 'sand' profile concentration range x 0.2 0.2
pcdc chart export 'sand' 'sand.png' fluid concentration
"""
    found = bench(tmp_path, FLOW + chart)
    (curve,) = found.project.charts["sand"].curves
    along, c = np.array(curve.points).T
    assert (along[0], along[-1]) == (0.0, 2.0) and c[0] > 0.09 > 0.01 > c[-1]
    assert found.project.result("sand.png").stat().st_size > 10_000
    frames.vtk(found.project, "sand")
    frames.settle(found.project)
    report.run(SerialComm(), Quiet(), Request(found.project.outdir, ("fluid",)))
    rows = list(csv.DictReader((found.project.outdir / "measure" / "fluid_last.csv").open()))
    assert max(float(row["concentration"]) for row in rows) > 0.09 and "temperature[K]" not in rows[0]
    assert {float(row["pack_pressure[Pa]"]) for row in rows} == {0.0}


@pytest.mark.slow
def test_a_well_brings_it_too(tmp_path: Path) -> None:
    well = """
pcdc well create 'pump' range y 0 0
pcdc well stage 'pump' rate 1e-4 time 50
pcdc node boundary hydra-c-f-b pressure 1e5 range y 2 2
pcdc node boundary hydra-p-b p-v-c 0.1 range y 0 0
"""
    explicit = "pcdc face-joint property fluid-bulk 1e4 viscosity 1e-4\npcdc model solve time 60\n"
    found = bench(tmp_path, well + explicit + "account = pcdc.proppant")["account"]
    assert found["came"] == pytest.approx(0.1 * 1e-4 * 50.0, rel=2e-2) and found["relative"] < 1e-12


def test_properties_initial_values_and_conditions_are_changed(tmp_path: Path) -> None:
    more = """
pcdc flow-node initial concentration 0.1 range y 0.5 1
pcdc face-joint property proppant-size 1e-3 proppant-modulus 1e8
pcdc node boundary hydra-p-b p-v-f-r 1e-6 range y 0 0
pcdc model option proppant off
pcdc model solve hydraulic time 1 dt 0.5
one = pcdc.proppant
pcdc model option proppant on
pcdc model solve hydraulic time 1 dt 0.5
two = pcdc.proppant
pcdc node boundary remove
pcdc model solve hydraulic time 1 dt 0.5
three = pcdc.proppant
"""
    found = bench(tmp_path, more)
    values = Proppant.of(found.project.blocks).values
    assert values["proppant_size"] == 1e-3 and values["proppant_modulus"] == 1e8 and values["proppant_density"] == 2650
    assert found["one"]["came"] == pytest.approx(0.1 * 6 * 0.1 * 1e-2, rel=1e-3)
    assert found["two"]["came"] - found["one"]["came"] == pytest.approx(1e-6, rel=1e-9)
    assert found["three"]["came"] == found["two"]["came"]


def test_stokes_is_reported_apart(tmp_path: Path) -> None:
    """Both laws are in the log, with the Reynolds number."""
    said = {}
    for stokes in ("off", "on"):
        sim = Blocks(SerialComm())
        sim.log = Noted()
        more = f"pcdc face-joint property proppant-stokes {stokes}\npcdc model solve hydraulic time 1 dt 1\n"
        Bench(tmp_path, blocks=sim)(SCRIPT + more)
        said[stokes] = "\n".join(sim.log.lines)
    assert "after Schiller and Naumann, Reynolds number" in said["off"] and "does not hold" not in said["off"]
    assert "Stokes' law does not hold; after Schiller and Naumann a grain settles by" in said["on"]


WRONG = {
    "no proppant": ("pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 1e6 vis 1e-6 a-initial 1e-5 a-min "
                    "1e-6\npcdc node boundary hydra-p-b p-v-c 0.1", "no proppant"),
    "both": ("pcdc node boundary hydra-p-b p-v-c 0.1 p-v-f-r 1e-6", "cannot be combined"),
    "neither": ("pcdc node boundary hydra-p-b", "hydraulic-proppant-boundary"),
    "range": ("pcdc face-joint property proppant-size 1e-3 range y 0 1", "without a range"),
    "power": ("pcdc face-joint property viscosity-power -4", "viscosity"),
    "limit": ("pcdc face-joint property proppant-concentration-limit 0.8", "proppant-concentration-limit"),
    "beyond": ("pcdc flow-node initial concentration 0.61", "between 0 and that of a pack, 0.6"),
    "no flow node": ("pcdc flow-node initial concentration 0.1 range x 0 0", "not at the end of a channel"),
    "dry": ("pcdc flow-node initial saturation 0\npcdc flow-node initial concentration 0.1", "are dry"),
    "plain channel": ("pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 2.2e9 vis 1e-6 a-initial 1e-2 a-min "
                      "1e-3 range y 1.5 2 x 0.2 0.2\npcdc flow-node initial concentration 0.1 range y 1.7 2",
                      "at the end of a channel that carries proppant"),
    "plain channels": ("pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 2.2e9 vis 1e-6 a-initial 1e-2 "
                       "a-min 1e-3 range x 0.2 0.2\npcdc node boundary hydra-p-b p-v-c 0.1",
                       "at the end of a channel that carries proppant"),
    "table": ("pcdc node boundary hydra-p-b p-v-c table 'no'", "no table"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(WRONG))
def test_what_a_script_cannot_do(tmp_path: Path, name: str) -> None:
    script, message = WRONG[name]
    if name == "no proppant":
        more = SCRIPT[: SCRIPT.index("pcdc face-joint")] + script
        with pytest.raises(HpcdemError, match=message):
            Bench(tmp_path, blocks=Blocks(SerialComm()))(more + "\n")
        return
    with pytest.raises(HpcdemError, match=message):
        bench(tmp_path, script)
