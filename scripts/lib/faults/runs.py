"""Starting and ending runs: their processes, output and environment."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

LIBRARY = Path(__file__).resolve().parent.parent
ROOT = LIBRARY.parent.parent
HOOKS = LIBRARY / "faults" / "hooks"
LONGEST = 60.0
"""Longest time from a fault to the end of the job [s]."""


@cache
def mpiexec() -> str | None:
    """The launcher that belongs to this interpreter's MPI: a wheel puts it beside python, a system into PATH."""
    beside = Path(sys.executable).parent / "mpiexec"
    return str(beside) if beside.exists() else shutil.which("mpiexec")


@cache
def is_open_mpi() -> bool:
    """Whether it is Open MPI's."""
    if mpiexec() is None:
        return False
    return "Open" in subprocess.run([mpiexec() or "", "--version"], capture_output=True, text=True, check=False).stdout


def environment(plan: dict[str, Any] | None = None, **more: str) -> dict[str, str]:
    """Variables of a run; plan: see hooks/sitecustomize.py."""
    env = dict(os.environ)
    path = [*([str(HOOKS)] if plan else []), str(ROOT), *filter(None, [env.get("PYTHONPATH")])]
    env |= {"PYTHONPATH": os.pathsep.join(path), "FAULTS_PLAN": json.dumps(plan or {})}
    env.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    if is_open_mpi():
        for name, value in {
            "OMPI_ALLOW_RUN_AS_ROOT": "1",
            "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
            "OMPI_MCA_rmaps_base_oversubscribe": "1",
            "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
            "OMPI_MCA_hwloc_base_binding_policy": "none",
            "OMPI_MCA_mpi_yield_when_idle": "1",
            "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
        }.items():
            env.setdefault(name, value)
    return env | more


@cache
def has_resume() -> bool:
    """Whether there is a command `hpcdem resume`."""
    return find_spec("hpcdem.cli.resume") is not None


@cache
def has_option(name: str) -> bool:
    """Whether hpcdem knows an option."""
    done = subprocess.run(
        [sys.executable, "-m", "hpcdem", "--help"], env=environment(), capture_output=True, text=True, check=False
    )
    return name in done.stdout


def resume_words(script: Path, data: Path) -> list[str]:
    """The command that goes on with the run that wrote into a folder, or begins if nothing is there."""
    if has_resume() and any(data.glob("*.sav")):
        return ["resume", str(data)]
    return [str(script), "--resume", "--outdir", str(data)]


@dataclass
class End:
    """How a job ended. code: None if it had to be killed by us as it would not."""

    code: int | None
    out: str
    err: str
    seconds: float

    @property
    def said(self) -> str:
        """All that it printed."""
        return self.out + self.err


@dataclass
class Job:
    """A run on n ranks, in a session of its own."""

    process: subprocess.Popen[bytes]
    ranks: int
    output: Path
    errors: Path

    def ended(self) -> bool:
        return self.process.poll() is not None

    def at_work(self) -> bool:
        """Whether it has said where it begins: signals are answered from then on."""
        said = self.output.read_bytes()
        return b"resuming from" in said or b"starting at the beginning" in said

    def rank_pids(self) -> list[int]:
        """Process ids of the ranks in their order; those that are there."""
        if self.ranks == 1:
            return [] if self.ended() else [self.process.pid]
        found: dict[int, int] = {}
        for pid in session(self.process.pid):
            try:
                variables = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
                words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            of = [v.partition(b"=")[2] for v in variables if v.startswith((b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK="))]
            if of and b"hpcdem" in words and not words[0].endswith((b"mpiexec", b"mpirun", b"prterun", b"proxy")):
                found.setdefault(int(of[0]), pid)
        return [found[rank] for rank in sorted(found)]

    def signal(self, pid: int, number: int) -> None:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            pass

    def end(self, timeout: float = LONGEST) -> End:
        """Wait for the end, of all its processes; kill what is left then."""
        began = time.monotonic()
        code: int | None
        try:
            code = self.process.wait(timeout)
            while session(self.process.pid):  # ranks whose launcher was killed
                if time.monotonic() - began > timeout:
                    code = None
                    break
                time.sleep(0.02)
        except subprocess.TimeoutExpired:
            code = None
        self.kill()
        out, err = (path.read_text(errors="replace") for path in (self.output, self.errors))
        return End(code, out, err, time.monotonic() - began)

    def kill(self) -> None:
        """All its processes."""
        for pid in session(self.process.pid):
            self.signal(pid, signal.SIGKILL)
        self.process.wait()


def session(leader: int) -> list[int]:
    """Process ids of a session, without those that only wait to be counted."""
    found = []
    for entry in os.scandir("/proc"):
        if entry.name.isdigit():
            try:
                with open(f"/proc/{entry.name}/stat") as file:
                    fields = file.read().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == leader and fields[0] not in "ZX":
                found.append(int(entry.name))
    return found


def start(
    words: list[str],
    ranks: int,
    folder: Path,
    plan: dict[str, Any] | None = None,
    limit: int | None = None,
    name: str = "log",
    **variables: str,
) -> Job:
    """`hpcdem WORDS` on so many ranks, in the background. limit: on the size of files [KiB]."""
    command = [*([mpiexec() or "mpiexec", "-n", str(ranks)] if ranks > 1 else []), sys.executable, "-m", "hpcdem"]
    command += [*words, "--no-figure"]
    output, errors = folder / f"{name}.out", folder / f"{name}.err"
    if limit is not None:  # the files of the log are not meant
        text = f'exec > >(cat) 2> >(cat >&2); ulimit -f {limit}; exec "$@"'
        command = ["bash", "-c", text, "bash", *command]
    with open(output, "wb") as out, open(errors, "wb") as err:
        process = subprocess.Popen(
            command, cwd=folder, env=environment(plan, **variables), stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            start_new_session=True,
        )  # fmt: skip
    return Job(process, ranks, output, errors)


def mpi_name() -> str:
    """Name and version of the launcher, for the report."""
    if mpiexec() is None:
        return "no MPI"
    done = subprocess.run([mpiexec() or "", "--version"], capture_output=True, text=True, check=False)
    words = " ".join(done.stdout.split())
    if "Open" in words:
        return "Open MPI " + words.rpartition(")")[2].split()[0]
    version = words.partition("Version: ")[2].split()
    return f"MPICH {version[0]}" if version else "MPI"
