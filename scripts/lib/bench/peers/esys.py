"""ESyS-Particle: Hertz-Mindlin spheres held in a plane; its planar walls are linear springs without friction."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

from bench import launch
from bench.peers.base import Case, Found, Options, Peer
from bench.workloads import MATERIAL as M

SCRIPT = """\
import json, time
from esys.lsm import *
from esys.lsm.util import BoundingBox, Vec3

job = json.load(open("job.json"))
steps, top = job["warm"] + job["steps"], job["top"]
sim = LsmMpi(numWorkerProcesses=job["workers"], mpiDimList=[job["workers"], 1, 1])
sim.initNeighbourSearch(particleType=job["kind"], gridSpacing=job["grid"], verletDist=job["verlet"])
sim.setNumTimeSteps(steps)
sim.setTimeStepSize(job["dt"])
deep = job["grid"]
sim.setSpatialDomain(BoundingBox(Vec3(-deep, -deep, -deep), Vec3(job["length"] + deep, top, deep)))
sim.readGeometry("bed.geo")
sim.setParticleDensity(tag=0, mask=-1, Density=job["density"])
sim.createInteractionGroup(HertzMindlinPrms(
    name="contact", youngsModulus=job["modulus"], poissonsRatio=job["poiss"], dynamicMu=job["fric"]))
sim.createInteractionGroup(GravityPrms(name="weight", acceleration=Vec3(0.0, -job["gravity"], 0.0)))
sim.createInteractionGroup(LocalDampingPrms(name="damping", viscosity=job["damp"]))
for name, at, normal in (
    ("floor", Vec3(0.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0)),
    ("left", Vec3(0.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0)),
    ("right", Vec3(job["length"], 0.0, 0.0), Vec3(-1.0, 0.0, 0.0)),
):
    sim.createWall(name=name, posn=at, normal=normal)
    sim.createInteractionGroup(NRotElasticWallPrms(name=name + "_contact", wallName=name, normalK=job["spring"]))
for step in range(steps):
    if step == job["warm"]:
        began = time.perf_counter()
    sim.runTimeStep()
    if job["way"]:
        sim.moveWallBy("left", Vec3(job["way"], 0.0, 0.0))
seconds = time.perf_counter() - began
places = [(p.getPosn()[0], p.getPosn()[1], p.getRadius()) for p in sim.getParticleList()]
json.dump({"seconds": seconds, "places": places}, open("found.json", "w"))
sim.exit()
"""


class Esys(Peer):
    """Each core a worker; a master hands out work besides."""

    name = "esys-particle"
    install = "apt-get install esys-particle"
    rate = 0.5e6
    same_steps = False

    def missing(self) -> str:
        """Whether it and an MPI are in PATH."""
        if not shutil.which("esysparticle"):
            return "no esysparticle in PATH"
        return "" if launch.launcher_beside(Path(shutil.which("esysparticle") or "")) else "no mpirun in PATH"

    def version(self, options: Options) -> str:
        """Version of the package: the program does not say."""
        try:
            done = subprocess.run(
                ["dpkg-query", "-W", "-f", "${Version}", "esys-particle"], capture_output=True, text=True, check=False
            )
        except OSError:
            return "ESyS-Particle"
        found = re.match(r"[\d.]+\d", done.stdout)
        return f"ESyS-Particle {found.group(0) if found else '?'}"

    def choices(self, case: Case) -> list[list[Options]]:
        """The skin."""
        return [[{"skin": 0.1}, {"skin": 0.2}]]

    def describe(self, options: Options) -> str:
        """In its own words."""
        return f"HertzMindlinPrms, verletDist {options['skin']:g} R"

    def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
        """Script and geometry, run; timed by the script."""
        largest = float(case.r.max())
        skin = options["skin"] * M.radius
        low = case.r - case.y
        overlap = float(low[low > 0.0].mean()) if (low > 0.0).any() else 0.01 * M.radius
        job = {
            "workers": case.cores, "kind": "NRotSphere", "grid": 2.0 * largest + 2.0 * skin, "verlet": skin,
            "dt": M.dt, "length": case.bed.length, "top": float((case.y + 4.0 * case.r).max()), "density": M.density,
            # What it multiplies by 4/3 sqrt(R) U^1.5 is the modulus of the contact, G / (1 - nu) for equal materials.
            "modulus": M.shear / (1.0 - M.poiss), "poiss": M.poiss, "fric": M.fric, "gravity": M.gravity,
            "damp": M.damp, "spring": math.sqrt(0.5) * M.kn_hertz * math.sqrt(M.radius * overlap),
            "way": M.speed * M.dt if case.pushed else 0.0, "warm": warm, "steps": steps,
        }  # fmt: skip
        (folder / "job.json").write_text(json.dumps(job))
        (folder / "bed.geo").write_text(geometry_text(case, job["grid"]))
        (folder / "bed.py").write_text(SCRIPT)
        program = shutil.which("esysparticle") or "esysparticle"
        mpirun = launch.launcher_beside(Path(program)) or "mpirun"
        # The master waits most of the time and shares a core with a worker.
        command = [mpirun, "--oversubscribe", "-n", str(case.cores + 1), program, "bed.py"]
        launch.call(command, folder, OMPI_MCA_mpi_yield_when_idle="1", OMPI_MCA_hwloc_base_binding_policy="none")
        try:
            found = json.loads((folder / "found.json").read_text())
        except OSError:
            raise launch.Failed("esys-particle: no result") from None
        n = len(case.x)
        return Found(n, steps, found["seconds"], touching(np.array(found["places"])) / n)


def geometry_text(case: Case, room: float) -> str:
    """Particles in the format of readGeometry: x y z r id tag."""
    low, top = -room, float((case.y + 4.0 * case.r).max())
    head = (
        "LSMGeometry 1.2\n"
        f"BoundingBox {low!r} {low!r} {low!r} {case.bed.length + room!r} {top!r} {room!r}\n"
        f"PeriodicBoundaries 0 0 0\nDimension 3D\nBeginParticles\nSimple\n{len(case.x)}\n"
    )
    rows = zip(case.x.tolist(), case.y.tolist(), case.r.tolist(), strict=True)
    body = "".join(f"{x!r} {y!r} 0.0 {r!r} {i} 0\n" for i, (x, y, r) in enumerate(rows))
    return head + body + "EndParticles\nBeginConnect\n0\nEndConnect\n"


def touching(rows: np.ndarray) -> int:
    """Pairs of rows x, y, r that overlap."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(rows[:, :2]).query_pairs(2.0 * rows[:, 2].max(), output_type="ndarray")
    a, b = rows[pairs[:, 0]], rows[pairs[:, 1]]
    return int((np.hypot(*(a[:, :2] - b[:, :2]).T) < a[:, 2] + b[:, 2]).sum())
