"""Starting processes: our own ranks and threads, and other programs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

LIBRARY = Path(__file__).resolve().parent.parent
ROOT = LIBRARY.parent.parent
TIMEOUT = 3600.0


@dataclass(frozen=True)
class Layout:
    """Ranks and threads per rank."""

    ranks: int = 1
    threads: int = 1

    @property
    def cores(self) -> int:
        """All together."""
        return self.ranks * self.threads

    def __str__(self) -> str:
        return f"{self.ranks}x{self.threads}"

    @classmethod
    def read(cls, text: str) -> Layout:
        """From "2x1"."""
        ranks, _, threads = text.partition("x")
        return cls(int(ranks), int(threads or 1))


class Failed(Exception):
    """A program did not do its work; the message says which and why."""


def mpiexec() -> str:
    """The launcher of this interpreter's MPI: a wheel puts it beside python, a system into PATH."""
    return launcher_beside(Path(sys.executable)) or "mpiexec"


def launcher_beside(program: Path) -> str | None:
    """mpiexec or mpirun from the folder of a program, else from PATH: it must belong to the program's MPI."""
    for name in ("mpiexec", "mpirun"):
        if (program.parent / name).exists():
            return str(program.parent / name)
    return shutil.which("mpirun") or shutil.which("mpiexec")


def environment(**more: str) -> dict[str, str]:
    """This process's variables, and those without which Open MPI does not start where we are root."""
    env = dict(os.environ, **more)
    if os.geteuid() == 0:
        env.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
        env.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
    env.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")  # layouts may have more ranks than this machine has cores
    env.setdefault("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")  # the same for Open MPI 5
    env.setdefault("OMPI_MCA_btl_vader_single_copy_mechanism", "none")  # containers forbid it, with a long complaint
    return env


def call(command: list[str], folder: Path, timeout: float = TIMEOUT, **more: str) -> tuple[str, float]:
    """Run a program to its end: its output and wall time [s]. Failed with the end of what it printed."""
    began = time.perf_counter()
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment(**more),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=timeout,
        )
    except subprocess.TimeoutExpired:
        raise Failed(f"{command[0]}: not at its end after {timeout:g} s") from None
    except OSError as error:
        raise Failed(f"{command[0]}: {error}") from None
    if done.returncode:
        raise Failed(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-2000:]}")
    return done.stdout, time.perf_counter() - began


def ours(task: str, layout: Layout, **job: Any) -> dict[str, Any]:
    """Run a task of worker.py on our ranks: what it returns, and `output`, what was printed."""
    with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as name:
        folder = Path(name)
        job |= {"task": task, "threads": layout.threads, "folder": name}
        (folder / "job.json").write_text(json.dumps(job))
        path = os.pathsep.join(filter(None, (str(LIBRARY), os.environ.get("PYTHONPATH"))))
        bind = ["--bind-to", "none"] if layout.threads > 1 and is_open_mpi() else []
        command = [mpiexec(), *bind, "-n", str(layout.ranks), sys.executable, "-m", "bench.worker", "job.json"]
        output, _ = call(command, folder, PYTHONPATH=path)
        try:
            return json.loads((folder / "result.json").read_text()) | {"output": output}
        except OSError:
            raise Failed(f"{task}: no result\n{output[-2000:]}") from None


@cache
def is_open_mpi() -> bool:
    """Whether our mpiexec is Open MPI's, which ties a rank and all its threads to one core."""
    return "Open" in subprocess.run([mpiexec(), "--version"], capture_output=True, text=True, check=False).stdout
