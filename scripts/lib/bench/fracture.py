"""A plane hydraulic fracture by implicit steps (`hpcdem case hydraulic-fracture`, finer around its line: some 20 000
triangles): seconds to so much injected time, and where they go."""

from __future__ import annotations

import time
from typing import Any

from bench import launch
from bench.launch import Layout
from bench.tables import Lines, say

AWAY = 12
"""Edges along a side of the outline; the case has 6."""
PUMPING = """
for part in range(10):
    pcdc model solve hydraulic time [time/10] dt [5/200]
    pcdc output vtk 'fracture'
"""
SETTINGS = """
pcdc history create 'pressure' flow-node value pressure mean range group 'well' set 'wet'
pcdc history create 'given' model value fluid-given
"""

# ---- asked for by the driver ---------------------------------------------------------------------------------------


def fracture(layouts: list[Layout], seconds: float, lines: Lines, **case: Any) -> None:
    """Every layout once, with its stages. case: parameters that are not those of the case."""
    for layout in layouts:
        found = launch.ours("fracture", layout, seconds=seconds, case=case)
        found.pop("output")
        head = {
            "code": "hpcdem", "workload": "fracture", "ranks": layout.ranks, "threads": layout.threads,
            "cores": layout.cores, "repeat": 0,
        }  # fmt: skip
        row = lines.add(head | found)
        say(
            f"{layout}: {row['elements']} triangles, {row['channels']} channels, {seconds:g} s by {row['steps']} "
            f"steps: {row['wall_s']:.4g} s, {row['cpu_s']:.4g} s of processor time"
        )
        for name, spent in row["stages"].items():
            say(f"    {name:<10} {spent:8.2f} s  {100.0 * spent / row['wall_s']:5.1f} %")


# ---- on our ranks --------------------------------------------------------------------------------------------------


def work(job: dict[str, Any]) -> dict[str, Any]:
    """Make the model, pump by the clock; collective. stages: seconds of rank 0."""
    from bench.measured import versions
    from hpcdem.cases import HydraulicFracture
    from hpcdem.cases.run import Carrier
    from hpcdem.physics.flow.model import Flow

    case = HydraulicFracture(**job["case"])
    carrier = Carrier("fracture", job["folder"])
    given = "".join(f"{name} = {value!r}\n" for name, value in case.model_dump(exclude={"regime"}).items())
    carrier.carry_out("import math\n" + given + case.model().replace("[far/6]", f"[far/{AWAY}]") + SETTINGS)
    sim = carrier.interpreter.project.blocks
    flow = Flow.of(sim)
    before = {name: watch.ns for name, watch in sim.timers.watches.items()}
    first, cpu, began = sim.clock.step, time.process_time(), time.perf_counter()
    carrier.carry_out(f"time = {job['seconds']!r}\n" + PUMPING)
    wall, used = time.perf_counter() - began, time.process_time() - cpu
    own = {name: (watch.ns - before.get(name, 0)) * 1e-9 for name, watch in sim.timers.watches.items()}
    ranks = sim.comm.allgather((wall, used))
    wall = max(seconds for seconds, _ in ranks)
    stages = {name: spent for name, spent in own.items() if spent > 1e-4 * wall}
    stages["other"] = max(0.0, wall - sum(stages.values()))
    return {
        "elements": len(sim.the_mesh().cells), "channels": len(flow.network.channels), "steps": sim.clock.step - first,
        "wall_s": wall, "cpu_s": sum(used for _, used in ranks), "stages": stages,
        "account": flow.account()["relative"],
    } | versions()  # fmt: skip
