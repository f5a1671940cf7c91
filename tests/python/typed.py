"""What an editor and mypy know of a program: this one is checked with the package (`modules` of [tool.mypy]), which
complains of a comment below whose mistake is not noticed. It is not run."""

from __future__ import annotations

from typing import assert_type

import numpy as np

import hpcdem
from hpcdem.api import Frame
from hpcdem.api.types import Piece

sim = hpcdem.Simulation("out", threads=2)


def blocks() -> None:
    sim.start(dim=2)
    sim.geometry.rectangle((0.0, 0.0), (10.0, 5.0), "out")
    sim.geometry.circle((5.0, 2.5), 1.0, as_layer="hole", segment_length=0.1)
    sim.geometry.fractures("set", "out", orientation=("fisher", 30.0), length=("power", 2.5), length_least=0.1, seed=7)
    sim.mesh.create("out", 0.5, "tri", refine_layer=[("hole", 0.05), ("set", 0.1, 2.0)], hole=["hole"],
                    region=["a", ("b", "rock")], group="rock", set="domain")  # fmt: skip
    sim.mesh.structured((0, 0), (4, 2), (4, 2), "quad", ratio=(1.5, 1), group="bar")
    sim.mesh.patch([{"layer": ["out"], "mesh_size": 1.0}], point=[Piece(array=[(2.0, 2.0)])])
    sim.mesh.glue(1e-3, ("a", "b"), set="domain", where="x 0 1")
    sim.option(dynamic=False, overlap="relax")
    sim.elements.model("mech-iso-elastic", density=2500.0, young=sim.tables.over("E", "y"), poisson_ratio=0.25)
    sim.elements.model("user", law="clay.py:clay", density=2000, young=1e9, parameter=[("limit", 2e5)])
    sim.elements.property(cohesion=sim.fields.drawn("c"), where="group 'rock'")
    sim.joints.model("c-i-c-i", friction=30, cohesion=1e7, tensile_strength=2e6, gf1=20, gf2=200)
    sim.faces.model("contact-m-c", friction=30, penalty_normal=1e9)
    sim.faces.stress(normal="blast", quiet=True, where="boundary")
    sim.nodes.velocity(vx=0.0, vy=sim.nodes.function("pump.py:wave"))
    sim.bolts.create([(0.0, 2.0), (0.0, 5.0)], length=0.1, grout=(0.5, 3.0), plate=True, group="roof")
    sim.bolts.model("mech-e-p", density=7850, young=200e9, diameter=0.025, tensile_yield_force=250e3,
                    shear_stiffness_rock_bolt=1e9, grout_thickness=0.0125, cohesion_rock_grout=1.5e6,
                    cohesion_grout_bolt=2e6, where="group 'roof'")  # fmt: skip
    sim.wells.stage("injection", rate=1e-4, time=60.0, limit=8e6)
    sim.histories.create("load", "node", "reaction-x", how="sum", every=5)
    sim.charts.add("c", x="way", y="load", style="points")
    sim.output.image("stress", field="stress-yy", limits=(-2e6, 0.0), colours="viridis")
    sim.solve(elastic=True, solver="direct")
    assert_type(sim.elements["stress-xx"], np.ndarray)
    assert_type(sim.solved["steps"], int)
    assert_type(sim.wet_faces["size"], np.ndarray)
    assert_type(sim.energies["relative"], float)


def discs() -> None:
    made = sim.particles.generate(2000, rad=[60.0, 80.0], x=(0.0, 20e3), y=(0.0, 10e3), group="sand")
    assert_type(made, int)
    sim.prop(density=2500.0, fric=0.3, where="group sand")
    sim.set(dt=1e-3, gravity=(0.0, -9.8), print=1000)
    sim.cycle(5000)
    assert_type(sim.walls[100].kn, float)
    assert_type(sim.frame(), Frame)
    sim.frame().picture("stress_yy", limits=(0.0, 1.0), log=True)
    assert_type(hpcdem.frames("data")[-1].table("elements")["x"], np.ndarray)


def mistakes() -> None:
    sim.geometry.circle((5.0, 2.5), as_layer="hole")  # type: ignore[call-arg]
    sim.mesh.structured((0, 0), (4, 2), (4, 2), diagnal="both")  # type: ignore[call-arg]
    sim.mesh.create("out", 0.5, "triangles")  # type: ignore[arg-type]
    sim.mesh.create("out", 0.5, refine_layer=["hole"])  # type: ignore[list-item]
    sim.mesh.patch([{"layers": ["out"]}])  # type: ignore[typeddict-unknown-key]
    sim.elements.model("mech-iso-elastic", density=1.0, yuong=1e9)  # type: ignore[call-overload]
    sim.elements.model("mech-iso-elastic", young=1e9, poisson_ratio=0.2)  # type: ignore[call-overload]
    sim.elements.model("elastic", density=1.0)  # type: ignore[call-overload]
    sim.elements.property(young="stiff")  # type: ignore[arg-type]
    sim.joints.property(young=1e9)  # type: ignore[call-arg]
    sim.step("many")  # type: ignore[arg-type]
    sim.solve(on_failure="go")  # type: ignore[arg-type]
    sim.nodes.move()  # type: ignore[call-arg]
    sim.charts.add("c", curve="load")  # type: ignore[call-arg]
    sim.meshes.create("out", 0.5)  # type: ignore[attr-defined]
    sim.solved["why"]  # type: ignore[typeddict-item]
    sim.ball(0.0, 0.0, radius=1.0)  # type: ignore[call-arg]
    sim.prop(densty=2500.0)  # type: ignore[call-arg]
    sim.frame().picture(colour_by="stress_yy")  # type: ignore[call-arg]
    hpcdem.Simulation(thread=2)  # type: ignore[call-arg]
