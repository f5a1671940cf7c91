"""Checkpoints in the middle of any command that steps change nothing: neither in the run that writes them, nor in the
one that goes on from them. Frames, series and the last state are compared bit by bit."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.commands.fdem import checkpoints
from hpcdem.core.errors import StoppedWithCheckpoint
from hpcdem.io import checkpoint
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.flow.model import Flow
from hpcdem.runtime.stop_requests import AUTO, NONE, STOP, StopRequests
from tests.pcdc.test_time import Rock
from tests.pcdc.test_whole import tables

ROCK = "pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-r 0.25"
WATER = "pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 2.2e9 vis 1e-6 a-initial 1e-5 a-min 1e-6"
SEEN = """
pcdc output vtk 'f' every EVERY
pcdc history create 'x' node id 7 value displacement-x every EVERY
pcdc history create 'r' node value reaction-y sum every 2
"""
CRACK = f"""
pcdc mesh structured (0,-1) (4,1) cells 12 8
{ROCK}
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e8 tensile-strength 2e6 gf1 2 gf2 20 \\
    penalty-normal 5e12 range y 0 0
{WATER} range y 0 0
pcdc element initial stress-yy -1e6
pcdc model option dynamic off OPTIONS
for y in (-1, 1):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [y] [y]
for x in (0, 4):
    pcdc node boundary mech-vel-b-c velocity-x 0 range x [x] [x] y -0.99 0.99
pcdc model solve elastic
SEEN
pcdc history create 'v' flow-node value volume sum
pcdc history create 'p' flow-node value pressure max
pcdc node boundary hydra-c-f-b flow-rate 5e-5 range x 0 0 y 0 0
pcdc model solve hydraulic time 1 dt 0.2
pcdc node boundary hydra-c-f-b flow-rate -5e-5 range x 0 0 y 0 0
pcdc model solve hydraulic time 0.5 dt 0.1
"""
SCRIPTS = {
    # Joints break and press again; elements are condensed once, with large strains where blocks are then.
    "a crack": CRACK.replace("OPTIONS", "collision off large-strain off"),
    "a crack in contact": CRACK.replace("OPTIONS", ""),
    "channels everywhere": f"""
pcdc mesh structured (0,0) (2,1) cells 6 3 diagonal alternate
{ROCK}
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e7 tensile-strength 1e6 gf1 50 gf2 500
{WATER}
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc model option dynamic off collision off
pcdc model gravity (0,-9.81)
pcdc flow-node initial pressure 1e5
SEEN
pcdc well create 'w' range x 1 1 y 0.3 0.7
pcdc well stage 'w' rate 1e-5 time 0.4 limit 8e5
pcdc well stage 'w' shut-in
pcdc model solve hydraulic time 0.8 dt 0.1
""",
    "tetrahedra": f"""
pcdc model new dim 3
pcdc mesh structured (0,0,0) (0.6,0.4,0.4) cells 3 2 2
{ROCK}
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e8 tensile-strength 1e6 gf1 2 gf2 20 \\
    penalty-normal 5e12 range z 0.2 0.2
{WATER} range z 0.2 0.2
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range z 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range z 0.4 0.4
pcdc model option dynamic off
SEEN
pcdc node boundary hydra-c-f-b flow-rate 1e-6 range x 0 0 y 0 0 z 0.2 0.2
pcdc model solve hydraulic time 2 dt 0.2
""",
    "flow alone": f"""
pcdc mesh structured (0,0) (4,2) cells 8 4
{ROCK}
{WATER}
pcdc model option mechanical off
pcdc flow-node initial saturation 0.3
pcdc node boundary hydra-c-f-b pressure 1e6 range x 0 0
SEEN
pcdc model solve hydraulic time 20 dt 1
""",
    "grains": f"""
pcdc model gravity (0,-9.81)
pcdc mesh structured (0,0) (0.4,2) cells 2 10
{ROCK}
pcdc face-joint c-model hydr-p-p-m property f-den 1000 f-bulk 2.2e9 vis 1e-6 a-initial 1e-2 a-min 1e-3 p-den 2650 \\
    p-s 5e-4 p-c-l 0.6 range x 0.2 0.2
pcdc flow-node initial pressure 1e5
pcdc model option mechanical off
pcdc node boundary hydra-c-f-b flow-rate 1e-4 range y 0 0
pcdc node boundary hydra-c-f-b pressure 1e5 range y 2 2
pcdc node boundary hydra-p-b p-v-c 0.1 range y 0 0
SEEN
pcdc history create 'sand' model value proppant-stored
pcdc model solve hydraulic time 10 dt 1
""",
    "heat": """
pcdc mesh structured (0,0) (2,0.5) cells 6 2 diagonal both
pcdc element c-model mech-m-c property density 2400 young 20e9 poisson-ratio 0.24 cohesion 3e6 friction 30 tensile 1.2e6
pcdc element c-model therm-iso-h property conductivity 3 capacity 800 expansion-coeficient 9e-6
pcdc node initial temperature 50
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 2 2
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc model option dynamic off
pcdc node boundary therm-s-b-c temperature 35 range y 0.5 0.5
SEEN
pcdc model solve thermal time 5e5 dt 5e4
""",
    "creep": """
pcdc mesh structured (0,0) (1,1) cells 3 3
pcdc element c-model mech-burgers property den 2500 bulk 20e9 m-s 10e9 m-v 1e16 k-s 5e9 k-v 1e14
pcdc model option dynamic off collision off
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x 0 0
pcdc element-face boundary m-s-b-c stress-xx 5e6 range x 1 1
pcdc model solve elastic
SEEN
pcdc model creep on dt 2e3 change 0.1
pcdc model solve elastic time 1e4
pcdc model solve ratio 1e-4 time 5e3
""",
    "a block breaks": """
pcdc mesh structured (0,0) (0.4,0.2) cells 6 3 diagonal alternate
pcdc mesh structured (0,-0.2) (0.4,-0.01) cells 4 2
pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-r 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 6e5 tensile-strength 2e5 gf1 1 gf2 4
pcdc node initial velocity (0.5,-8) range y 0 1
pcdc node boundary mech-m-b-c type 1 range y -0.3 -0.15
pcdc model option energy on large-strain off
SELDOM
pcdc history create 'e' model value kinetic-energy every 40
pcdc model step 900
""",
    "a plastic slope": """
pcdc mesh structured (0,0) (4,2) cells 6 3
pcdc element c-model mech-m-c property density 2000 young 1e8 poisson-r 0.3 friction 20 cohesion 1e4 tensile 5e3
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc model option dynamic off
pcdc model gravity (0,-9.81)
SELDOM
pcdc model solve ratio 1e-3 cycles 400
pcdc model solve elastic ratio 1e-6
""",
    "bolts": f"""
pcdc mesh structured (0,0) (2,1) cells 10 5
{ROCK}
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc model option dynamic off collision off
pcdc bolt create polyline (0.5,1) (0.6,0.3) plate grout 0.2 9
pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 s-s-r-b 1e9 g-t 0.0125 c-r-g 1.5e6 \\
    c-g-b 2e6 pre-f 50e3 spac 1.5
pcdc model gravity (0,-9.81)
SELDOM
pcdc model solve cycles 300
""",
}


class Asking(StopRequests):
    """The same is asked for at every look, or at the n-th one only."""

    def __init__(self, what: int, nth: int = 0) -> None:
        super().__init__()
        self.what, self.nth, self.looks = what, nth, 0

    def local_request(self) -> int:
        self.looks += 1
        return self.what if self.looks == self.nth or not self.nth else NONE

    def overdue_request(self) -> int:
        return NONE


def done(folder: Path, script: str, stop: StopRequests | None, past: bool = False) -> Rock:
    """A script to its end, or to the stop; with `past` from the checkpoint there."""
    rock = Rock(folder, "")
    rock.blocks.stop = rock.project.blocks.stop = stop
    entries = checkpoints.take_up(rock.project) if past else None
    for word, every in (("SEEN", 4), ("SELDOM", 100)):
        script = script.replace(word, SEEN.replace("EVERY", str(every)))
    text = script + "pcdc model save 'end.sav'\n"
    rock.interpreter.run(rock.interpreter.read(text, "script.sc"), entries or ())
    return rock


def assert_alike(one: Path, other: Path) -> None:
    """Frames, series, cracks, and all of the last state but how often lists were made."""
    names = {path.name for path in (one / "data").iterdir() if path.suffix in (".csv", ".vtkhdf")}
    assert names == {path.name for path in (other / "data").iterdir() if path.suffix in (".csv", ".vtkhdf")}
    assert sum(name.endswith(".vtkhdf") for name in names) >= 2
    for name in sorted(names):
        if name.endswith(".csv"):
            assert (one / "data" / name).read_bytes() == (other / "data" / name).read_bytes(), name
        else:
            assert tables(one / "data" / name) == tables(other / "data" / name), name
    (first, rows), (second, others) = (checkpoint.read(folder / "end.sav") for folder in (one, other))
    for state in (first, second):
        del state["rebuilds"]
    assert first == second
    assert {name: list(table) for name, table in rows.items()} == {name: list(table) for name, table in others.items()}
    for name, table in rows.items():
        for column, values in table.items():
            assert values.tobytes() == others[name][column].tobytes(), (name, column)


QUICK = ("heat",)


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in SCRIPTS])
def test_checkpoints_change_nothing(tmp_path: Path, name: str) -> None:
    """One at every look, after which the run goes on; a stop at one of them, and what follows it."""
    script, straight, saved, stopped = SCRIPTS[name], *(tmp_path / one for one in ("straight", "saved", "stopped"))
    done(straight, script, looks := Asking(NONE))
    done(saved, script, asking := Asking(AUTO))
    assert asking.looks == looks.looks > 3
    assert_alike(straight, saved)
    with pytest.raises(StoppedWithCheckpoint):
        done(stopped, script, Asking(STOP, 1 + looks.looks // 2))
    done(stopped, script, None, past=True)
    assert_alike(straight, stopped)
    if "crack" in name or "breaks" in name:
        assert len((straight / "data" / "cracks.csv").read_text().splitlines()) >= 4


def test_a_checkpoint_in_the_middle_is_a_model_of_its_own(tmp_path: Path) -> None:
    """Restored by name, and not gone on with, it is what the command leaves that was stopped there: broken joints that
    press on each other meanwhile are free faces."""
    with pytest.raises(StoppedWithCheckpoint) as stop:
        done(tmp_path, SCRIPTS["a crack in contact"], asking := Asking(STOP, 20))
    (path,) = (tmp_path / "data").glob("*.sav")
    assert asking.looks == 20 and path.name in str(stop.value)
    rock = Rock(tmp_path / "again", "")(f"pcdc model restore '{path}'\n")
    restored, flow = rock.blocks, Flow.of(rock.blocks)
    assert not flow.implicit and flow.condensed is None
    assert diagnostics.joint_counts(restored)[2] == len(restored.event_rows) > 2
    assert not (restored.local.slot_state == BROKEN).any() and restored.slid and restored.open.any()
    rock("pcdc model solve hydraulic time 0.2 dt 0.1\n")
    assert not flow.implicit
