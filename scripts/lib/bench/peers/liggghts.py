"""LIGGGHTS: Hertz with tangential history. The pushing wall is a moving mesh, which works in three dimensions only:
the particles then lie in a plane that no force drives them out of."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from bench import launch
from bench.peers.base import Case, Found, Options, Peer
from bench.peers.lammps import data_text, read_log
from bench.workloads import MATERIAL as M


class Liggghts(Peer):
    """Each core an MPI rank."""

    name = "liggghts"
    install = "apt-get install liggghts"
    rate = 5e6

    def missing(self) -> str:
        """Whether it is in PATH."""
        return "" if shutil.which("liggghts") else "no liggghts in PATH"

    def version(self, options: Options) -> str:
        """Its version."""
        with tempfile.TemporaryDirectory() as folder:  # it leaves a log even so
            said = subprocess.run(["liggghts", "-h"], cwd=folder, capture_output=True, text=True, check=False).stdout
        found = re.search(r"LIGGGHTS-PUBLIC ([\d.]+)", said)
        return f"LIGGGHTS {found.group(1) if found else '?'}"

    def choices(self, case: Case) -> list[list[Options]]:
        """newton, then the skin."""
        skins: list[Options] = [{"skin": skin} for skin in (0.1, 0.2, 0.4)]
        return [[{"newton": newton, "skin": 0.2} for newton in ("off", "on")], skins]

    def describe(self, options: Options) -> str:
        """In its own words."""
        return f"newton {options['newton']}, skin {options['skin']:g} R"

    def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
        """Data file, mesh, input, run; the loop time is its own."""
        (folder / "bed.data").write_text(data_text(case, types=2, margin=2.0 * M.radius, discs=not case.pushed))
        (folder / "push.stl").write_text(mesh_text(case))
        (folder / "in.bed").write_text(input_text(case, options, warm, steps))
        program = shutil.which("liggghts") or "liggghts"
        command = [
            program,
            "-in",
            "in.bed",
            "-log",
            "log.bed",
            "-screen",
            "said.bed",
        ]  # mesh/surface writes there without asking
        if case.cores > 1:
            command = [launch.launcher_beside(Path(program)) or "mpirun", "-n", str(case.cores), *command]
        launch.call(command, folder)
        return read_log((folder / "log.bed").read_text(), steps)


def mesh_text(case: Case) -> str:
    """The left wall as two triangles (STL), inside the box."""
    top, deep = float((case.y + 2.0 * case.r).max()), 0.9 * float(case.r.max())
    low = [(0.0, 0.0, -deep), (0.0, top, -deep), (0.0, top, deep)]
    high = [(0.0, 0.0, -deep), (0.0, top, deep), (0.0, 0.0, deep)]
    facets = "".join(
        "facet normal 1 0 0\n outer loop\n"
        + "".join(f"  vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle)
        + " endloop\nendfacet\n"
        for triangle in (low, high)
    )
    return f"solid wall\n{facets}endsolid wall\n"


def input_text(case: Case, options: Options, warm: int, steps: int) -> str:
    """The input script.

    In two dimensions its particles are discs: see data_text. Its walls take Reff = R where ours take Rt = R; a second
    material, softer by sqrt(2) in pairs with the first, makes them equal.
    """
    soft = M.young / (2.0 * math.sqrt(2.0) - 1.0)
    model = "model hertz tangential history"
    if case.pushed:
        left = (
            "fix left all mesh/surface file push.stl type 2\n"
            f"fix mesh all wall/gran {model} mesh n_meshes 1 meshes left\n"
            f"fix push all move/mesh mesh left linear {M.speed:g} 0.0 0.0\n"
        )
    else:
        left = f"fix left all wall/gran {model} primitive type 2 xplane 0.0\n"

    def pairs(value: float) -> str:
        return f"peratomtypepair 2 {value:g} {value:g} {value:g} {value:g}"

    return (
        "units si\n"
        f"dimension {3 if case.pushed else 2}\n"
        "atom_style granular\n"
        "hard_particles yes\n"
        "atom_modify map array\n"
        f"boundary f f {'f' if case.pushed else 'p'}\n"
        f"newton {options['newton']}\n"
        "communicate single vel yes\n"
        f"processors {case.cores} 1 1\n"
        "read_data bed.data\n"
        f"neighbor {options['skin'] * M.radius:g} bin\n"
        "neigh_modify delay 0 every 1 check yes\n"
        f"fix young all property/global youngsModulus peratomtype {M.young:.8g} {soft:.8g}\n"
        f"fix poisson all property/global poissonsRatio peratomtype {M.poiss:g} {M.poiss:g}\n"
        f"fix bounce all property/global coefficientRestitution {pairs(M.restitution)}\n"
        f"fix rub all property/global coefficientFriction {pairs(M.fric)}\n"
        f"pair_style gran {model}\n"
        "pair_coeff * *\n"
        f"timestep {M.dt:g}\n"
        f"fix weight all gravity {M.gravity:g} vector 0.0 -1.0 0.0\n"
        f"{left}"
        f"fix right all wall/gran {model} primitive type 2 xplane {case.bed.length!r}\n"
        f"fix floor all wall/gran {model} primitive type 2 yplane 0.0\n"
        "fix motion all nve/sphere\n"
        f"{'' if case.pushed else 'fix plane all enforce2d'}\n"
        f"thermo {steps}\n"
        "thermo_style custom step atoms\n"
        f"run {warm}\n"
        f"run {steps}\n"
        "compute touching all contact/atom\n"
        "compute total all reduce sum c_touching\n"
        "thermo_style custom step c_total\n"
        "variable total equal c_total\n"
        "run 0\n"
        'print "ends touching ${total}"\n'
    )
