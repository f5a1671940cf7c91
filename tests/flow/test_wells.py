"""Wells: by hand, by stages, in nothing (on several ranks and across restarts: test_ranks.py)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import PRESSURE, RATE, SHUT, Stage, Well
from tests.blocks.support import rectangle
from tests.flow.support import at, line, run, standing
from tests.pcdc.fake import Bench

STEP = 1e-6


def pumping(n: int = 4, **changed: float) -> tuple[Blocks, Flow]:
    """A channel of 1 m that is full, in sub-steps of 1 us, with a well at its left end."""
    sim, flow = line(n, 1.0, aperature_initial=1e-4, **changed)
    flow.fill(None, saturation=1.0)
    sim.flow_clock(dt=STEP)
    flow.drill("w", at(sim, 0.0, 0.0))
    return sim, flow


def test_a_rate_is_that_of_a_condition() -> None:
    """One node: the same as a rate that is prescribed there, to rounding."""
    sim, flow = pumping()
    flow.stage("w", RATE, 2e-5, math.inf, math.inf)
    other, beside = line(4, 1.0, aperature_initial=1e-4)
    beside.fill(None, saturation=1.0)
    other.flow_clock(dt=STEP)
    beside.prescribe(at(other, 0.0, 0.0), kernels.RATE, 2e-5)
    run(sim, 200)
    run(other, 200)
    assert flow.nodes[:, kernels.W] == pytest.approx(beside.nodes[:, kernels.W], rel=1e-13)
    assert flow.well_value("w", "injected") == pytest.approx(2e-5 * flow.time, rel=1e-9)
    assert flow.well_value("w", "rate") == pytest.approx(2e-5, rel=1e-9)
    assert flow.well_value("w", "pressure") == pytest.approx(float(flow.state[0, kernels.P]), rel=1e-9)
    assert flow.account()["given"] - flow.account()["stored"] == pytest.approx(0.0, abs=1e-18)


def test_stages_follow_each_other() -> None:
    """So much for so long, then nothing, then a pressure: volumes to rounding, though sub-steps do not end with
    stages."""
    sim, flow = pumping()
    for does, value, duration in ((RATE, 2e-5, 100.5 * STEP), (SHUT, 0.0, 50 * STEP), (RATE, -1e-5, 20.25 * STEP),
                                  (PRESSURE, 3e5, 40 * STEP)):  # fmt: skip
        flow.stage("w", does, value, duration, math.inf)
    given = flow.account()["given"]
    run(sim, 101)
    assert flow.well_value("w", "injected") == pytest.approx(2e-5 * 100.5 * STEP, rel=1e-9)
    assert flow.well_value("w", "stage") == 2.0
    run(sim, 49)
    assert flow.well_value("w", "rate") == 0.0
    run(sim, 20)
    drawn = 2e-5 * 100.5 * STEP - 1e-5 * 19.5 * STEP
    assert flow.well_value("w", "injected") == pytest.approx(drawn, rel=1e-9) and flow.well_value("w", "stage") == 3.0
    run(sim, 10)
    assert flow.well_value("w", "pressure") == 3e5 == pytest.approx(float(flow.state[0, kernels.P]), rel=1e-9)
    run(sim, 60)
    assert flow.well_value("w", "stage") == 0.0 and flow.well_value("w", "rate") == 0.0  # after the last: shut in
    assert flow.account()["given"] - given == pytest.approx(flow.well_value("w", "injected"), rel=1e-9)
    assert flow.account()["relative"] < 1e-13


def test_a_stage_said_later_ends_one_without_end() -> None:
    sim, flow = pumping()
    flow.stage("w", RATE, 2e-5, math.inf, math.inf)
    with pytest.raises(CommandError, match="stage 1 of well 'w' has no time, so no other stage can follow"):
        flow.stage("w", SHUT, 0.0, math.inf, math.inf)
    run(sim, 30)
    flow.stage("w", SHUT, 0.0, math.inf, math.inf)
    run(sim, 30)
    assert flow.well_value("w", "injected") == pytest.approx(2e-5 * 30 * STEP, rel=1e-9)
    flow.stage("w", PRESSURE, 1e4, 5 * STEP, math.inf)
    run(sim, 20)
    flow.stage("w", RATE, 1e-5, 10 * STEP, math.inf)  # after one that is over: from now on
    before = flow.well_value("w", "injected")
    run(sim, 20)
    assert flow.well_value("w", "injected") - before == pytest.approx(1e-5 * 10 * STEP, rel=1e-9)


def test_tables_are_over_the_time_of_flow() -> None:
    sim, flow = pumping()
    sim.table("ramp", [(0.0, 0.0), (1.0, 1.0)])
    flow.stage("w", PRESSURE, "ramp", math.inf, math.inf)
    run(sim, 100)
    assert flow.well_value("w", "pressure") == pytest.approx(100 * STEP)
    with pytest.raises(CommandError, match="table 'ramp' is used"):
        sim.remove_table("ramp")


def test_a_limit_holds_the_pressure() -> None:
    """A rate into a channel with a closed end: without a limit the pressure rises with what comes in."""
    found = {}
    for limit in (math.inf, 2e5):
        sim, flow = pumping()
        flow.stage("w", RATE, 1e-3, math.inf, limit)
        run(sim, 400)
        found[limit] = flow.well_value("w", "pressure"), flow.well_value("w", "injected")
    assert found[math.inf][0] > 1e6 and found[math.inf][1] == pytest.approx(1e-3 * 400 * STEP, rel=1e-9)
    assert found[2e5][0] == pytest.approx(2e5, rel=1e-9) and found[2e5][1] < 0.3 * found[math.inf][1]


def test_a_limit_holds_to_the_end_of_its_stage() -> None:
    """Also in the sub-step in which the next one begins."""
    sim, flow = pumping()
    flow.stage("w", RATE, 1e-1, 100.75 * STEP, 2e5)
    flow.stage("w", SHUT, 0.0, math.inf, math.inf)
    pressures = []
    for _ in range(110):
        sim.step()
        pressures.append(flow.well_value("w", "pressure"))
    assert max(pressures) == pytest.approx(2e5, rel=1e-9) and pressures[-1] < 1.9e5


def test_a_well_cannot_draw_what_is_not_there() -> None:
    sim, flow = pumping()
    flow.stage("w", RATE, -1.0, math.inf, math.inf)
    run(sim, 100)
    assert flow.nodes[:, kernels.W].min() >= 0.0 and -flow.well_value("w", "injected") < 1e-4
    assert flow.account()["relative"] < 1e-12


def test_nodes_of_a_well_share_one_volume() -> None:
    """Four corners of a square hole, two channels at each, of which some are dry: one pressure, and it is that of all
    the fluid in their room."""
    sim, flow = standing(rectangle(2, 2, 1.0, 1.0), fluid_bulk=1e6)
    points = flow.numbers("flow-node")
    flow.fill(points[:2], pressure=1e4)
    flow.drill("w", points)
    room, fluid = flow.nodes[:, kernels.V].sum(), flow.nodes[:, kernels.W].sum()
    run(sim, 1)
    assert np.ptp(flow.state[:, kernels.S]) < 1e-12 and flow.state[0, kernels.S] == pytest.approx(fluid / room)
    flow.stage("w", RATE, (1.2 * room - fluid) / flow.dt, flow.dt, math.inf)
    run(sim, 3)
    assert flow.state[:, kernels.P] == pytest.approx(0.2e6, rel=1e-9) and flow.account()["relative"] < 1e-13


def test_in_a_well_the_pressure_grows_downwards() -> None:
    """Upright, 2 m: rho g depth, by hand; and half full of pressure only below a level."""
    sim, flow = standing(rectangle(1, 4, 0.5, 2.0, y0=0.0), fluid_bulk=1e6)
    sim.gravity(0.0, -9.81)
    sim.close_model()
    points = np.intersect1d(at(sim, 0.0), flow.numbers("flow-node"))
    flow.fill(None, saturation=1.0)
    flow.drill("w", points)
    flow.stage("w", PRESSURE, 5e4, math.inf, math.inf)
    run(sim, 2)
    y = sim.mesh.points[points, 1]
    p = flow.state[np.searchsorted(flow.number, points), kernels.P]
    assert p == pytest.approx(5e4 + 9810.0 * (y.max() - y), rel=1e-9) and flow.well_value("w", "pressure") == 5e4
    # Two nodes, 1 m apart, room 1 and 3; 100 Pa / K of 4 more: only the lower one is under pressure.
    well = Well("x", np.array([0, 1]))
    room = np.array([[1.0, 3.0 + 3e-3], [1.0, 3.0], [9810.0, 0.0]])
    found = well.filled(room, 0.0, 1.0, 1e6, lambda value, time: float(value))
    assert found == pytest.approx([1.0, 3.003], rel=1e-12) and well.pressure == 0.0


def test_flow_from_a_well_is_steady_between_two_pressures() -> None:
    """Doublet: what one pumps in the other takes out, and pressures differ by q 12 mu L / delta^3."""
    sim, flow = line(4, 1.0, aperature_initial=1e-4, fluid_bulk=1e6)
    flow.fill(None, pressure=1e4)
    flow.drill("in", at(sim, 0.0, 0.0))
    flow.drill("out", at(sim, 1.0, 0.0))
    flow.stage("in", RATE, 1e-8, math.inf, math.inf)
    flow.stage("out", PRESSURE, 1e4, math.inf, math.inf)
    run(sim, 4000)
    drop = flow.well_value("in", "pressure") - flow.well_value("out", "pressure")
    assert drop == pytest.approx(1e-8 * 12.0 * 1e-3 / 1e-12, rel=1e-6)
    assert flow.well_value("out", "rate") == pytest.approx(-1e-8, rel=1e-5)


# ---- what makes no sense ---------------------------------------------------------------------------------------------


def test_a_stage_without_an_end_that_begins_now_never_acts_if_another_follows() -> None:
    well = Well("w", np.array([0]), [Stage(RATE, 1.0, 2.0)])
    with pytest.raises(CommandError, match="stage 1 of well 'w' has no time"):
        well.add(Stage(SHUT), 2.0)
    well.add(Stage(SHUT), 3.0)
    assert [(one.begin, one.end) for one in well.stages] == [(2.0, 3.0), (3.0, math.inf)]


def test_a_well_in_nothing() -> None:
    sim, flow = line(4, 1.0)
    away = at(sim, 0.0, 0.25)
    with pytest.raises(CommandError, match=rf"well 'w' has no flow node: node {away[0]} .*not at the end of a channel"):
        flow.drill("w", away)
    assert not flow.wells
    flow.drill("w", at(sim, 1.0, 0.0))
    flow.stage("w", RATE, 1e-6, math.inf, math.inf)
    run(sim, 2)
    changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] > 0.7))
    with pytest.raises(CommandError, match="well 'w' has no flow nodes left"):
        sim.step()


def test_what_a_well_refuses() -> None:
    sim, flow = pumping()
    node = at(sim, 0.0, 0.0)
    with pytest.raises(CommandError, match="well 'w' exists already"):
        flow.drill("w", at(sim, 1.0, 0.0))
    with pytest.raises(CommandError, match=rf"node {node[0]} belongs to well 'w' already"):
        flow.drill("v", node)
    with pytest.raises(CommandError, match=rf"node {node[0]} belongs to well 'w', whose stages"):
        flow.prescribe(None, kernels.PRESSURE, 1.0)
    flow.prescribe(at(sim, 1.0, 0.0), kernels.PRESSURE, 1.0)
    with pytest.raises(CommandError, match="has a condition: use node boundary remove first"):
        flow.drill("v", at(sim, 1.0, 0.0))
    for does, value, duration, limit, said in (
        (PRESSURE, -1.0, 1.0, math.inf, "must not be negative"), (RATE, math.nan, 1.0, math.inf, "must be finite"),
        (RATE, 1.0, 0.0, math.inf, "must be positive"), (PRESSURE, 1.0, 1.0, 5.0, "needs a rate"),
        (RATE, 1.0, 1.0, -5.0, "not negative"), (RATE, "t", 1.0, math.inf, "there is no table 't'"),
    ):  # fmt: skip
        with pytest.raises(CommandError, match=said):
            flow.stage("w", does, value, duration, limit)
    with pytest.raises(CommandError, match="there is no well 'x'; available: 'w'"):
        flow.stage("x", SHUT, 0.0, 1.0, math.inf)
    with pytest.raises(CommandError, match="there is no quantity depth of a well"):
        flow.well_value("w", "depth")


def test_saved_stages_are_the_same() -> None:
    well = Well("w", np.array([3, 5]), [Stage(RATE, "t", 0.0, 1.0, 5e6), Stage(SHUT, 0.0, 1.0)], 1.5, -2.0, 3.0)
    well.wall = np.array([1, 4])
    again = Well.restored(json.loads(json.dumps(well.saved())))
    assert again.points.tolist() == [3, 5] and again.wall.tolist() == [1, 4]
    assert {**vars(again), "points": 0, "wall": 0} == {**vars(well), "points": 0, "wall": 0}


# ---- the language ----------------------------------------------------------------------------------------------------

SCRIPT = """
pcdc model new
pcdc mesh structured (0,-0.25) (1,0.25) cells 4 2
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 1e6 vis 1e-6 a-initial 1e-4 a-min 1e-6 range y 0 0
pcdc model option mechanical off
pcdc model time-step hydraulic 1e-6
pcdc flow-node initial saturation 1
pcdc node group 'left' range x 0 0 y 0 0
pcdc well create 'w' range group 'left'
"""


def test_a_script_with_wells(tmp_path: Path) -> None:
    bench = Bench(tmp_path, blocks=Blocks(SerialComm()))
    bench(
        SCRIPT + "pcdc well stage 'w' rate 2e-6 time 1e-5 limit 1e5\npcdc well stage 'w' shut-in time 5e-6\n"
        "pcdc table create 't' values (0,1e3) (1,1e3)\npcdc well stage 'w' pressure table 't'\n"
        "pcdc history create 'v' well value injected well 'w'\npcdc history create 'p' well value pressure well 'w'\n"
        "pcdc model step 20\nfound = pcdc.wells['w']\n"
    )
    rows = bench.project.histories["v"].rows
    assert rows[4][2] == pytest.approx(1e-11, rel=1e-9) and rows[13][2] == pytest.approx(2e-11, rel=1e-9)
    assert bench.project.histories["p"].rows[-1][2] == 1e3 == bench["found"]["pressure"]
    assert bench["found"]["stage"] == 3.0


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("well stage 'w' rate 1 pressure 2", "one of rate, pressure and shut-in, not rate and pressure"),
        ("well stage 'w'", "one of rate, pressure and shut-in, not none"),
        ("well stage 'w' pressure 2 limit 3", "limit, a pressure, needs rate"),
        ("well stage 'w' rate 2 time 0", "time"),
        ("well stage 'x' rate 2", "there is no well 'x'; available: 'w'"),
        ("well stage 'w' rate table 'q'", "there is no table 'q'"),
        ("well create 'v' range y 0.25 0.25", "well 'v' has no flow node: node"),
        ("history create 'h' well value pressure", "object well and well, its name, are both required"),
        ("history create 'h' model value time well 'w'", "object well and well, its name, are both required"),
        ("history create 'h' well value opening well 'w'", "a history of well can follow pressure, rate"),
        ("history create 'h' well id 3 value rate well 'w'", "a history of a well does not accept id"),
        ("history create 'h' well value rate well 'x'", "there is no well 'x'"),
    ],
)
def test_lines_about_wells_that_are_wrong(tmp_path: Path, line: str, said: str) -> None:
    with pytest.raises(HpcdemError, match=said):
        Bench(tmp_path, blocks=Blocks(SerialComm()))(f"{SCRIPT}pcdc {line}\n")
