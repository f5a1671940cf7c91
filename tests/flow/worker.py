"""Runs wet blocks, on any number of ranks and threads, and writes what became of them.

python worker.py KIND THREADS STEPS OUT [SAVE_AT SAVE_PATH | resume SAVE_PATH]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import PRESSURE, QUANTITIES, RATE, SHUT
from tests.blocks.support import ROCK, rectangle, shaken
from tests.blocks.worker import COHESIVE, WEAK, communicator
from tests.flow.support import WATER, inner

LEAKS = {
    "leak_off": 1.0, "matrix_permeability": 1e-14, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9,
}  # fmt: skip
WIDE = {**WATER, "fluid_bulk": 1e7, "aperature_initial": 2e-4, "aperature_minumum": 5e-5, "aperature_maximum": 5e-3}


def bursting(sim: Blocks) -> None:
    """A jointed block is torn apart by fluid that is pumped into it, while it flies to the right, through the strips
    of the ranks."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    joints = inner(sim.mesh)
    sim.joint_model(joints, COHESIVE, WEAK)
    sim.gravity(3.0, -9.81)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=150.0 + 6.0 * one, vy=4.0 * one)
    flow = Flow.of(sim)
    flow.assign(joints[joints % 7 > 0], {**WIDE, **LEAKS})
    flow.fill(np.flatnonzero(x < 0.5), pressure=3e4)
    flow.fill(np.flatnonzero(x > 1.1), saturation=0.6)
    sim.table("pump", [(0.0, 0.0), (2e-3, 2e6), (1.0, 2e6)])
    flow.prescribe(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.12), kernels.PRESSURE, "pump")
    flow.prescribe(np.flatnonzero(x > 1.55), kernels.SURFACE, 0.4)
    flow.prescribe(np.flatnonzero(x < 0.05), kernels.RATE, 1e-3)


def more(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 300:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 1] < 0.1)[3:9])
    if sim.clock.step == 600:
        Flow.of(sim).assign(np.flatnonzero(sim.joint_exists())[:40:3], {**WIDE, **LEAKS, "aperature_initial": 1e-4})
        sim.flow_clock(every=3)


def pumped(sim: Blocks) -> None:
    """The same with wells across the strips of the ranks in place of conditions, in channels that slip opens further;
    stages end where steps do not, one of them after the checkpoint."""
    bursting(sim)
    flow = Flow.of(sim)
    flow.remove_conditions(None)
    flow.adjust(None, {"shear_dilation": 20.0, "shear_dilation_limit": 4e-3})
    points = sim.mesh.points
    flow.drill("long", np.flatnonzero((np.abs(points[:, 1] - 0.3) < 0.03) & (points[:, 0] > 0.3)))
    flow.drill("short", np.flatnonzero(points[:, 0] < 0.05))
    flow.stage("long", RATE, 10.0, 1.23e-3, 2e6)
    flow.stage("long", SHUT, 0.0, 2.1e-4, math.inf)
    flow.stage("long", RATE, 10.0, math.inf, 1e6)
    flow.stage("short", PRESSURE, "pump", 1.7e-3, math.inf)
    flow.stage("short", RATE, -1e-2, math.inf, math.inf)


def seeping(sim: Blocks) -> None:
    """Water rises in a block that stands still, then moves."""
    sim.take_mesh(shaken(rectangle(20, 6, 2.0, 0.6), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    flow = Flow.of(sim)
    flow.assign(None, {**WATER, "fluid_bulk": 1e5})
    sim.gravity(0.0, -9.81)
    x = sim.mesh.points[:, 0]
    flow.prescribe(np.flatnonzero(x == 0.0), kernels.SURFACE, 0.5)
    flow.prescribe(np.flatnonzero(x == 2.0), kernels.SURFACE, 0.2)
    sim.parts(mechanical=False)


def move(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 900:
        sim.option(dynamic=False, collision=False)
        sim.parts(mechanical=True)
        sim.flow_clock(dt=0.01)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)


KINDS = {"bursting": (bursting, more), "pumped": (pumped, more), "seeping": (seeping, move)}


def main() -> None:
    kind, threads, steps, out, *rest = sys.argv[1:]
    sim = Blocks(communicator(), int(threads))
    if rest[:1] == ["resume"]:
        assert saved_state.restore(sim, rest[1]) == {"kind": kind}
    else:
        KINDS[kind][0](sim)
    while sim.clock.step < int(steps):
        if len(rest) == 2 and rest[0] != "resume" and sim.clock.step == int(rest[0]):
            saved_state.save(sim, rest[1], {"kind": kind})
        KINDS[kind][1](sim)
        convergence.advance(sim, 1)
    found = {name: diagnostics.values(sim, name) for name in ("position_x", "velocity_y", "stress_xx")}
    flow = Flow.of(sim)
    for on in ("flow-node", "flow-channel"):
        found[f"numbers_{on}"] = flow.numbers(on)
        for name in ("pressure", "saturation"):
            found[f"{on}_{name}"] = flow.values(on, name)
    for name in ("fluid", "volume", "inflow"):
        found[f"flow-node_{name}"] = flow.values("flow-node", name)
    for name in ("aperture", "flow_rate"):
        found[f"flow-channel_{name}"] = flow.values("flow-channel", name)
    found.update({f"account_{name}": np.array(value) for name, value in flow.account().items()})
    for name in (well.name for well in flow.wells):
        for value in QUANTITIES:
            found[f"well_{name}_{value}"] = np.array(flow.well_value(name, value))
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["clock"] = np.array([flow.time, flow.dt, flow.sub_steps, flow.cycles, sim.clock.time])
    found["about"] = np.array([sim.rebuilds])
    if sim.comm.rank == 0:
        np.savez(out, **found)


if __name__ == "__main__":
    main()
