"""The MPI library and the launcher, and whether they belong together."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from hpcdem.runtime import launch
from hpcdem.runtime.doctor.findings import Finding, ok, problem, warning
from hpcdem.runtime.doctor.scene import Scene

TRIAL = "from mpi4py import MPI; print('hpcdem sees', MPI.COMM_WORLD.Get_size())"
"""What two ranks are asked to do."""


def library(scene: Scene) -> Iterator[Finding]:
    """The library, who started these ranks, how many there are and where."""
    if scene.refusal:
        cure = launch.launcher_of(scene.library, scene.environ) if scene.library else "pip install mpich"
        yield problem("MPI", scene.refusal, cure)
        return
    name, error = scene.mpi_library
    if error:
        yield warning("MPI", f"mpi4py finds no MPI library, so there is one rank only: {error}", "pip install mpich")
        return
    ranks, hosts = len(scene.places), scene.hosts
    who = f"started by {scene.launcher.name}" if scene.launcher is not None else "started without a launcher"
    where = hosts[0] if len(hosts) == 1 else f"{len(hosts)} hosts"
    yield ok("MPI", f"{name}; {ranks} rank{'s' * (ranks > 1)} on {where}, {who}")


def trial(scene: Scene) -> Iterator[Finding]:
    """Where no launcher is at work: whether the one in the PATH starts ranks that know each other."""
    if scene.launcher is not None or scene.refusal or "SLURM_JOB_ID" in scene.environ or scene.mpi_library[1]:
        return
    if len(scene.places[scene.rank].mask) < 2:  # not every launcher starts more ranks than cores
        return
    own = Path(sys.executable).parent / "mpiexec"
    program = scene.which("mpiexec") or (str(own) if own.exists() else None)
    if program is None:
        yield warning("MPI", "there is no mpiexec in the PATH", "pip install mpich, or load the cluster's MPI module")
        return
    code, out, err = scene.run([program, "-n", "2", sys.executable, "-c", TRIAL], 30.0)
    if "hpcdem sees 2" in out:
        cure = "" if scene.which("mpiexec") else f"export PATH={own.parent}:$PATH"
        yield ok("MPI", f"{program} -n 2 starts two ranks", cure)
    elif "hpcdem sees 1" in out:
        better, say = launch.launcher_of(scene.mpi_library[0], {}), problem
        if own.exists() and str(own) != program:
            better, say = f"{own} -n 2 hpcdem ...", warning
        yield say(
            "MPI",
            f"{program} does not belong to the MPI library of mpi4py ({scene.mpi_library[0]}): with it each process is "
            "rank 0 of 1",
            better,
        )
    else:
        said = " ".join(line.strip() for line in err.splitlines() if line.strip(" -\t"))
        cure = "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1" if "run as root" in said else ""
        yield warning("MPI", f"{program} -n 2 does not start: {said[:200] or f'exit code {code}'}", cure)
