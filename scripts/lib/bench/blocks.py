"""Blocks: element-steps and contact pairs per second.

| workload | what |
|---|---|
| intact-20k, intact-200k | a joint before its peak on every inner edge, contact armed, in vibration |
| plastic-20k | intact-20k of a rock that can yield and does not: beside intact-20k the price of looking |
| flowing-20k | the same so weak that two thirds of it flow in a step |
| yielded-20k | the same with joints behind their peak |
| own-20k | intact-20k with the elastic law in a Python file of the user |
| quads-20k | quads as one body, contact armed, in vibration |
| own-quads-20k | the same with the elastic law in a Python file of the user |
| plastic-quads-20k, flowing-quads-20k | the same of a rock that can yield: none of it does, all of it flows |
| wet-20k | intact-20k with a channel in every joint, half of them full, and one sub-step of flow per step |
| soaked-20k | the same with eleven sub-steps of flow per step |
| sandy-20k | as wet-20k, with proppant in the fluid, which settles |
| warm-20k | intact-20k with heat and thermal stress, a cycle of heat every ten steps |
| stepwise-20k | the same with a cycle in each step |
| pairs-20k | 20 000 touching pairs with friction; counted in pairs per second of the contact stage alone |
| pairs-space-20k | 20 000 touching pairs of tetrahedra: two plates that lie on each other |
| tets-20k, tets-200k | tetrahedra as one body in vibration, 6 of a box |
| jointed-tets-20k, jointed-tets-200k | the same with a joint before its peak on every inner face |
| hexes-3k, hexes-33k | hexahedra as one body in vibration |
| plastic-hexes-3k | the same of a rock that can yield and does not |
| shattered-20k | every edge open, all neighbours pressed together: the whole step |
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench import launch
from bench.launch import Layout
from bench.tables import Lines, Spread, say
from hpcdem.physics.fdem import changes, convergence, diagnostics, user_laws
from hpcdem.physics.fdem.pairs_space import ContactSpace
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant

RATES = {
    "intact": 15e6, "plastic": 12e6, "flowing": 8e6, "yielded": 3e6, "quads": 10e6, "plastic-quads": 7e6,
    "flowing-quads": 3e6, "wet": 6e6, "soaked": 3e6, "sandy": 5e6, "warm": 12e6,
    "stepwise": 8e6, "pairs": 3e6, "pairs-space": 1.5e6, "tets": 8e6, "jointed-tets": 5e6, "hexes": 2e6,
    "plastic-hexes": 1e6,
    "shattered": 1e6, "own": 15e6, "own-quads": 10e6,
}  # fmt: skip
"""Element-steps per second from which the number of steps follows."""
MORE = 10
"""Sub-steps of flow that soaked-20k takes more than wet-20k."""


@dataclass(frozen=True)
class Workload:
    """kind: one of `RATES`; side: squares along a side, two triangles each, or a quad; in space boxes of six
    tetrahedra, two layers of them or a cube."""

    name: str
    kind: str
    side: int

    @property
    def elements(self) -> int:
        """Triangles, quads, tetrahedra or hexahedra."""
        if "tets" in self.kind or "hexes" in self.kind:
            return (6 if "tets" in self.kind else 1) * self.side**3
        return 12 * self.side**2 if self.kind == "pairs-space" else self.side**2 * (1 if "quads" in self.kind else 2)


WORKLOADS = {
    w.name: w
    for w in (
        Workload("intact-20k", "intact", 100),
        Workload("intact-200k", "intact", 316),
        Workload("plastic-20k", "plastic", 100),
        Workload("flowing-20k", "flowing", 100),
        Workload("yielded-20k", "yielded", 100),
        Workload("own-20k", "own", 100),
        Workload("quads-20k", "quads", 141),
        Workload("own-quads-20k", "own-quads", 141),
        Workload("plastic-quads-20k", "plastic-quads", 141),
        Workload("flowing-quads-20k", "flowing-quads", 141),
        Workload("wet-20k", "wet", 100),
        Workload("soaked-20k", "soaked", 100),
        Workload("sandy-20k", "sandy", 100),
        Workload("warm-20k", "warm", 100),
        Workload("stepwise-20k", "stepwise", 100),
        Workload("pairs-20k", "pairs", 141),
        Workload("pairs-space-20k", "pairs-space", 28),
        Workload("tets-20k", "tets", 15),
        Workload("tets-200k", "tets", 32),
        Workload("jointed-tets-20k", "jointed-tets", 15),
        Workload("jointed-tets-200k", "jointed-tets", 32),
        Workload("hexes-3k", "hexes", 15),
        Workload("hexes-33k", "hexes", 32),
        Workload("plastic-hexes-3k", "plastic-hexes", 15),
        Workload("shattered-20k", "shattered", 100),
    )
}


# ---- asked for by the driver ---------------------------------------------------------------------------------------


def blocks(names: list[str], layouts: list[Layout], repeats: int, seconds: float, lines: Lines) -> None:
    """Every workload on every layout, layouts in turn; a table of medians at the end."""
    for name in names:
        work = WORKLOADS[name]
        steps = max(10, round(seconds * RATES[work.kind] / work.elements))
        for repeat in range(repeats):
            for layout in layouts:
                found = launch.ours("blocks", layout, workload=name, steps=steps)
                found.pop("output")
                head = {
                    "code": "hpcdem", "workload": f"blocks-{name}", "ranks": layout.ranks, "threads": layout.threads,
                    "cores": layout.cores, "repeat": repeat,
                }  # fmt: skip
                row = lines.add(head | found)
                say(
                    f"{name} {layout} #{repeat}: {row['element_steps_per_s'] / 1e6:.3g} M element-steps/s, "
                    f"{row['pairs_per_s'] / 1e6:.3g} M touching pairs/s in the contact stage"
                )
        digests = {r["digest"] for r in lines.rows if r["workload"] == f"blocks-{name}"}
        if len(digests) > 1:
            say(f"{name}: layouts do not agree: {len(digests)} different ends")
    for name in names:
        for layout in layouts:
            rows = [
                r
                for r in lines.rows
                if r["workload"] == f"blocks-{name}" and (r["ranks"], r["threads"]) == (layout.ranks, layout.threads)
            ]
            speed = Spread.of(r["element_steps_per_s"] for r in rows)
            pairs = Spread.of(r["pairs_per_s"] for r in rows)
            own = Spread.of(r["element_steps_per_s"] / r["cpu_use"] for r in rows)
            say(
                f"{name:<14} {layout}: {speed.text(1e6)} M element-steps/s, {own.text(1e6)} M by processor time, "
                f"{pairs.text(1e6)} M pairs/s"
            )
    for layout in layouts:
        if math.isfinite(part := sub_step(lines.rows, layout)):
            say(f"{layout}: a sub-step of flow takes {part:.2f} of a step of intact-20k")


def sub_step(rows: list[dict[str, Any]], layout: Layout) -> float:
    """Processor time of a sub-step of flow over that of a step of intact-20k, medians; NaN where one was not run."""
    spent = {}
    for name in ("intact-20k", "wet-20k", "soaked-20k"):
        key = f"blocks-{name}", layout.ranks, layout.threads
        of = [r for r in rows if (r["workload"], r["ranks"], r["threads"]) == key]
        spent[name] = float(np.median([r["cpu_use"] * r["wall_s"] / r["steps"] for r in of])) if of else math.nan
    return (spent["soaked-20k"] - spent["wet-20k"]) / MORE / spent["intact-20k"]


# ---- on our ranks --------------------------------------------------------------------------------------------------


def work(job: dict[str, Any]) -> dict[str, Any]:
    """Make the model, step it by the clock; collective."""
    from bench.measured import versions
    from hpcdem import session
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.physics.fdem.warm_up import warm_up

    shared = session.current()
    warm_up(job["threads"])
    sim = Blocks(shared.comm, job["threads"])
    workload = WORKLOADS[job["workload"]]
    MAKERS[workload.kind](sim, workload.side)
    warm = max(3, job["steps"] // 10)
    convergence.advance(sim, warm)
    sim.close_model()
    sim.comm.allgather(0)
    before = {name: watch.ns for name, watch in sim.timers.watches.items()}
    cpu, began, rebuilds = time.process_time(), time.perf_counter(), sim.rebuilds
    convergence.advance(sim, job["steps"])
    sim.comm.allgather(0)
    seconds, used = time.perf_counter() - began, time.process_time() - cpu
    own = {name: (watch.ns - before.get(name, 0)) * 1e-9 for name, watch in sim.timers.watches.items()}
    sim.close_model()
    local = sim.local.pairs
    touching = sim.comm.allgather(_touching(local))
    ranks = sim.comm.allgather((seconds, used, own, sim.n_own))
    wall, n = max(r[0] for r in ranks), sum(r[3] for r in ranks)
    if sim.dim == 3:  # a hexahedron is stored as six tetrahedra
        n -= 5 * len(sim.the_mesh().hexes)
    contact = max(r[2].get("contact", 0.0) for r in ranks)
    stages = {
        name: {"mean": sum(r[2].get(name, 0.0) for r in ranks) / len(ranks),
               "largest": max(r[2].get(name, 0.0) for r in ranks)}
        for name in dict.fromkeys(name for r in ranks for name in r[2])
    }  # fmt: skip
    return {
        "elements": n, "steps": job["steps"], "wall_s": wall, "element_steps_per_s": n * job["steps"] / wall,
        "pairs_per_s": sum(touching) * job["steps"] / contact if contact > 0.0 else 0.0, "touching": sum(touching),
        "joints": diagnostics.joint_counts(sim), "stages": stages, "rebuilds": sim.rebuilds - rebuilds,
        "cpu_use": sum(r[1] for r in ranks) / (wall * len(ranks) * job["threads"]), "digest": digest(sim),
    } | versions()  # fmt: skip


def _touching(pairs: Any) -> int:
    """Pairs of bodies that touch now; in space rows of the list are pairs of a face and an element."""
    at = np.flatnonzero(pairs.touching)
    if not isinstance(pairs, ContactSpace):
        return len(at)
    both = np.column_stack([pairs.face[pairs.first[at]] // 4, pairs.element[pairs.second[at]]])
    return len(np.unique(np.sort(both, axis=1), axis=0))


def digest(sim: Any) -> str:
    """The same if the positions are, to the last bit, whatever the layout."""
    import hashlib

    return hashlib.sha256(
        diagnostics.values(sim, "position_x").tobytes() + diagnostics.values(sim, "position_y").tobytes()
    ).hexdigest()[:16]


ROCK = {"density": 2700.0, "young": 50e9, "poisson_ratio": 0.25, "friction": 30.0, "damp_factor": 0.1}
JOINT = {
    "friction": 30.0, "cohesion": 20e6, "tensile_strength": 10e6, "gf1": 100.0, "gf2": 500.0, "penalty_normal": 500e9,
}  # fmt: skip


def square(side: int, gap: float = 0.0, quads: bool = False) -> Any:
    """side x side squares of 1 cm, two triangles each, diagonals in turn; with a gap they are bodies of their own."""
    from hpcdem.physics.fdem.mesh import Mesh

    h = 0.01
    i, j = np.divmod(np.arange(side * side), side)
    even = (i + j) % 2 == 0
    corners = np.array([(0.0, 0.0), (h, 0.0), (h, h), (0.0, h)])
    if gap:
        points = (corners[None] + np.column_stack([i, j])[:, None] * (h + gap)).reshape(-1, 2)
        a, b, c, d = (4 * np.arange(side * side) + k for k in range(4))
    else:
        x, y = np.divmod(np.arange((side + 1) ** 2), side + 1)
        points = np.column_stack([x, y]) * h
        a = i * (side + 1) + j
        b, d = a + side + 1, a + 1
        c = b + 1
    if quads:
        return Mesh.of(points, np.column_stack([a, b, c, d]))
    first = np.where(even[:, None], np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    second = np.where(even[:, None], np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    return Mesh.of(points, np.stack([first, second], axis=1).reshape(-1, 3))


def intact(sim: Any, side: int) -> None:
    """In vibration, all joints before their peak."""
    sim.take_mesh(square(side))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    sim.close_model()
    x = sim.x[:, :6]
    sim.v[:, :6] = 0.02 * np.sin(300.0 * x + 1.0)


def plastic(sim: Any, side: int, strength: float = 1e9) -> None:
    """The same of a rock that yields beyond this cohesion and tensile strength [Pa]."""
    intact(sim, side)
    _yields(sim, strength)


def _yields(sim: Any, strength: float) -> None:
    law = {**ROCK, "dilation": 10.0, "cohesion": strength, "tensile": strength}
    changes.element_model(sim, None, "mech_mohr_coulomb", law)
    sim.close_model()


def flowing(sim: Any, side: int) -> None:
    """So weak that it flows."""
    plastic(sim, side, 1e3)


def _obeys(sim: Any) -> None:
    """The elastic law, of a file."""
    file = Path(__file__).with_name("elastic.py")
    changes.element_model(sim, None, user_laws.load(sim, file, "elastic.py:elastic").name, ROCK)
    sim.close_model()


def own(sim: Any, side: int) -> None:
    """The intact rock, with the same law of a file."""
    intact(sim, side)
    _obeys(sim)


def own_quads(sim: Any, side: int) -> None:
    """The quads, with the same law of a file."""
    quads(sim, side)
    _obeys(sim)


def yielded(sim: Any, side: int) -> None:
    """The same with joints so weak, and tough, that they soften throughout."""
    intact(sim, side)
    sim.joint_property(None, {"cohesion": 1e4, "tensile_strength": 1e4, "gf1": 10.0, "gf2": 10.0})
    sim.close_model()


def quads(sim: Any, side: int) -> None:
    """Quads without joints, in vibration."""
    sim.take_mesh(square(side, quads=True))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.close_model()
    x = sim.x[:, :12]
    sim.v[:, :12] = 0.02 * np.sin(300.0 * x + 1.0)


def plastic_quads(sim: Any, side: int) -> None:
    """The same of a rock that does not yield, but could."""
    quads(sim, side)
    _yields(sim, 1e9)


def flowing_quads(sim: Any, side: int) -> None:
    """So weak, and squeezed so fast, that all of it flows."""
    quads(sim, side)
    _yields(sim, 1e3)
    x, y = sim.x[:, 0:12:2], sim.x[:, 1:12:2]
    sim.v[:, 0:12:2], sim.v[:, 1:12:2] = -10.0 * x, 3.0 * y + 2.0 * x


def wet(sim: Any, side: int, sub_steps: int = 1) -> None:
    """The same with fluid in all joints, full on one side and half full on the other."""
    intact(sim, side)
    flow = Flow.of(sim)
    flow.assign(None, {
        "fluid_density": 1000.0, "fluid_bulk": 2.2e9, "viscosity": 1e-6, "aperature_initial": 1e-5,
        "aperature_minumum": 1e-6,
    })  # fmt: skip
    flow.fill(None, saturation=0.5)
    flow.fill(np.flatnonzero(sim.mesh.points[:, 0] < 0.5 * sim.mesh.points[:, 0].max()), pressure=1e4)
    sim.flow_clock(steps=sub_steps)
    sim.close_model()


def soaked(sim: Any, side: int) -> None:
    """The same with ten sub-steps more."""
    wet(sim, side, 1 + MORE)


def sandy(sim: Any, side: int) -> None:
    """The same with proppant in the fluid."""
    wet(sim, side)
    sim.gravity(0.0, -9.81)
    proppant = Proppant.of(sim)
    proppant.assign(None, {"proppant_density": 2650.0, "proppant_size": 1e-6, "proppant_concentration_limit": 0.6})
    proppant.fill(None, 0.2)
    sim.close_model()


def warm(sim: Any, side: int, sub_steps: int = 0) -> None:
    """Intact rock, warm on one side, with thermal stress."""
    intact(sim, side)
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 2.5, "capacity": 800.0, "expansion_coeficient": 1e-8})
    heat.prescribe(np.flatnonzero(sim.mesh.points[:, 0] == sim.mesh.points[:, 0].min()), 1.0)
    sim.heat_clock(steps=sub_steps)
    sim.close_model()


def stepwise(sim: Any, side: int) -> None:
    """The same with a cycle of heat in each step."""
    warm(sim, side, 1)


def pairs(sim: Any, side: int) -> None:
    """Each square is two triangles that lie on each other along its diagonal, pressed and sheared."""
    mesh = square(side, gap=0.01)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    inner = mesh.edges()
    changes.crack(sim, inner.faces[inner.inner, 0])
    _swell(sim, 1.0005)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.close_model()


def pairs_space(sim: Any, side: int) -> None:
    """Two plates of side x side boxes of six tetrahedra, one askew on the other, pressed and sheared."""
    from hpcdem.physics.fdem.mesh import Mesh
    from hpcdem.pre.mesh import structured_space

    h = 0.01
    plate = structured_space.box((h * np.arange(side + 1), h * np.arange(side + 1), np.array([0.0, h])), 6)
    points = np.concatenate([plate.points, plate.points + h * np.array([0.37, 0.23, 1.0 - 5e-4])])
    sim.take_mesh(Mesh.of(points, np.concatenate([plate.cells, plate.cells + len(plate.points)])))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.option(overlap="keep")
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.close_model()


def tets(sim: Any, side: int, joints: bool = False) -> None:
    """A cube of side x side x side boxes of six tetrahedra, in vibration."""
    from hpcdem.pre.mesh import structured_space

    line = 0.01 * np.arange(side + 1)
    _swing(sim, structured_space.box((line, line, line), 6), joints)


def jointed_tets(sim: Any, side: int) -> None:
    """The same with joints, all before their peak."""
    tets(sim, side, joints=True)


def hexes(sim: Any, side: int) -> None:
    """The same cube of hexahedra."""
    from hpcdem.pre.mesh import structured_space

    line = 0.01 * np.arange(side + 1)
    _swing(sim, structured_space.hexes((line, line, line)), False)


def plastic_hexes(sim: Any, side: int) -> None:
    """The same of a rock that is too strong to yield."""
    hexes(sim, side)
    _yields(sim, 1e9)


def _swing(sim: Any, mesh: Any, joints: bool) -> None:
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    if joints:
        sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    sim.option(collision=False)
    sim.close_model()
    corners = (slice(None), slice(None), slice(0, 3))
    sim.v.reshape(-1, 4, 4)[corners] = 0.02 * np.sin(300.0 * sim.x.reshape(-1, 4, 4)[corners] + 1.0)


def shattered(sim: Any, side: int) -> None:
    """Every element a body of its own, all pressed together by a frame that does not give way."""
    mesh = square(side)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.5})
    inner = mesh.edges()
    changes.crack(sim, inner.faces[inner.inner, 0])
    sim.velocity_condition(np.unique(inner.points[~inner.inner]), vx=0.0, vy=0.0)
    _swell(sim, 1.0005)
    changes.set_velocity(sim, None, 0.001, -0.001)
    sim.close_model()


def _swell(sim: Any, factor: float) -> None:
    """Every element grows about its middle."""
    sim.option(overlap="keep")
    sim.open_model()
    corners = sim.x[:, :6].reshape(-1, 3, 2)
    middle = corners.mean(axis=1, keepdims=True)
    sim.x[:, :6] = (middle + factor * (corners - middle)).reshape(-1, 6)
    sim.x[:, 6:] = sim.x[:, :2]
    assert math.isfinite(float(sim.x.sum()))


MAKERS = {
    "intact": intact, "plastic": plastic, "flowing": flowing, "yielded": yielded, "quads": quads,
    "plastic-quads": plastic_quads, "flowing-quads": flowing_quads, "wet": wet, "soaked": soaked, "sandy": sandy,
    "warm": warm, "stepwise": stepwise, "pairs": pairs, "pairs-space": pairs_space, "tets": tets,
    "jointed-tets": jointed_tets, "hexes": hexes, "plastic-hexes": plastic_hexes, "shattered": shattered, "own": own,
    "own-quads": own_quads,
}  # fmt: skip
