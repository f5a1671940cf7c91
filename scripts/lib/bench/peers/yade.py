"""Yade: Hertz-Mindlin spheres held in a plane."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

from bench import launch
from bench.peers.base import Case, Found, Options, Peer
from bench.workloads import MATERIAL as M

SCRIPT = """\
import json, math, os, time
import numpy as np
from yade import O, utils, wrapper
from yade.wrapper import *

job = json.load(open("job.json"))
m = job["material"]
x, y, r = np.load("bed.npy")
O.materials.append(FrictMat(
    young=job["young"], poisson=m["poiss"], frictionAngle=math.atan(m["fric"]), density=m["density"], label="rock"))
spheres = [utils.sphere((a, b, 0.0), c, material="rock") for a, b, c in zip(x, y, r)]
for body in spheres:
    body.state.blockedDOFs = "zXY"
O.bodies.append(spheres)
left = utils.wall(0.0, axis=0, sense=1, material="rock")
right = utils.wall(job["length"], axis=0, sense=-1, material="rock")
floor = utils.wall(0.0, axis=1, sense=1, material="rock")
O.bodies.append([left, right, floor])
if job["pushed"]:
    left.state.vel = (m["speed"], 0.0, 0.0)
O.dt = m["dt"]
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=job["skin"] * m["radius"]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys()],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(damping=m["damp"], gravity=(0.0, -m["gravity"], 0.0)),
]
O.run(job["warm"], True)
began = time.perf_counter()
O.run(job["steps"], True)
seconds = time.perf_counter() - began
pairs = sum(1 for i in O.interactions if i.isReal and i.id1 < len(x) and i.id2 < len(x) and i.geom.penetrationDepth > 0)
json.dump({"seconds": seconds, "pairs": pairs}, open("found.json", "w"))
os._exit(0)  # its own end takes a while
"""


class Yade(Peer):
    """Each core a thread."""

    name = "yade"
    install = "apt-get install yade"
    rate = 0.8e6
    same_steps = False

    def missing(self) -> str:
        """Whether it is in PATH."""
        return "" if shutil.which("yade") else "no yade in PATH"

    def version(self, options: Options) -> str:
        """Its version."""
        said = subprocess.run(["yade", "--version"], capture_output=True, text=True, check=False)
        found = re.search(r"version: *(\S+)", said.stdout + said.stderr)
        return f"Yade {found.group(1) if found else '?'}"

    def choices(self, case: Case) -> list[list[Options]]:
        """The skin."""
        return [[{"skin": 0.1}, {"skin": 0.3}]]

    def describe(self, options: Options) -> str:
        """In its own words."""
        return f"verletDist {options['skin']:g} R"

    def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
        """Script, run; timed by the script."""
        np.save(folder / "bed.npy", np.stack([case.x, case.y, case.r]))
        names = ("radius", "density", "poiss", "fric", "damp", "gravity", "dt", "speed")
        job = {
            "material": {name: getattr(M, name) for name in names}, "young": M.young, "length": case.bed.length,
            "pushed": case.pushed, "skin": options["skin"], "warm": warm, "steps": steps,
        }  # fmt: skip
        (folder / "job.json").write_text(json.dumps(job))
        (folder / "bed.py").write_text(SCRIPT)
        launch.call(["yade", "-n", "-x", f"-j{case.cores}", "bed.py"], folder)
        try:
            found = json.loads((folder / "found.json").read_text())
        except OSError:
            raise launch.Failed("yade: no result") from None
        n = len(case.x)
        return Found(n, steps, found["seconds"], found["pairs"] / n)
