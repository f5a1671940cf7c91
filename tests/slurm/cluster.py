"""A real Slurm of one node for the tests: own munge, own controller, own slurmd, own ports, all in one folder.

Nothing of a Slurm that may be configured on the machine is read or touched, and root is not needed: the daemons
belong to the user who runs the tests. They run in the foreground as our children, so that they can be ended by
their handles.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from getpass import getuser
from pathlib import Path

from tests.conftest import mpi_environment

PROGRAMS = ("munged", "slurmctld", "slurmd", "srun", "sbatch", "scontrol", "scancel", "sinfo", "squeue")
CPUS = 4
"""CPUs the node claims to have, whatever the machine has: the tests are about ranks, not about speed."""

CONFIGURATION = """\
ClusterName=tests
SlurmctldHost=localhost
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge/socket
MpiDefault={mpi}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
ReturnToService=2
KillWait=10
SlurmdParameters=config_overrides
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
NodeName=localhost CPUs={cpus} RealMemory=4000
PartitionName=tests Nodes=localhost Default=YES MaxTime=60 DefaultTime=10 State=UP OverSubscribe=YES
"""


OVER = ("COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "OUT_OF_MEMORY")
"""States of a job that will not change any more."""


class CannotStart(Exception):
    """Slurm is not installed, or does not come up; the message says which."""


def program(name: str) -> str:
    """Path of a program of munge or Slurm; daemons live in sbin, which is not in everybody's PATH."""
    path = shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")
    if path is None:
        raise CannotStart(f"{name} is not installed (Debian: slurmctld slurmd slurm-client munge libpmix-dev)")
    return path


def free_ports(n: int) -> list[int]:
    """Ports that nobody listens on just now."""
    sockets = [socket.socket() for _ in range(n)]
    for s in sockets:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


@dataclass(frozen=True)
class Job:
    """How a job stands: Slurm's state, exit code of the batch script, and how often it was started again."""

    state: str
    exit_code: int
    restarts: int


class Cluster:
    """`start()` it, run things, `stop()` it."""

    def __init__(self, mpi: str) -> None:
        # Not pytest's folder: slurmstepd's sockets need a short path.
        self.folder = Path(tempfile.mkdtemp(prefix="hpcdem-slurm-"))
        self.mpi = mpi
        self.daemons: list[subprocess.Popen[bytes]] = []

    # -- up and down -----------------------------------------------------------------------------------------

    def start(self) -> None:
        """Returns when the node takes jobs; CannotStart otherwise, with nothing left running."""
        try:
            for name in PROGRAMS:
                program(name)
            self._configure()
            munge = self.folder / "munge"
            self._daemon(
                "munged", "--foreground", f"--socket={munge}/socket", f"--key-file={munge}/key",
                f"--pid-file={munge}/pid", f"--seed-file={munge}/seed",
            )  # fmt: skip
            self._wait((munge / "socket").exists, "munged")
            self._daemon("slurmctld", "-D")
            self._daemon("slurmd", "-D", "-N", "localhost")
            self._wait(lambda: self._ask("sinfo", "-h", "-o", "%T").strip() == "idle", "the node to be idle")
        except CannotStart:
            self.stop()
            raise

    def stop(self) -> None:
        """Ends jobs and daemons and removes the folder."""
        if self.daemons and self._ask("squeue", "-h", "-o", "%i"):
            self._ask("scancel", "--user", getuser())
            deadline = time.monotonic() + 20
            while self._ask("squeue", "-h", "-o", "%i") and time.monotonic() < deadline:
                time.sleep(0.2)
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        self.daemons.clear()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _configure(self) -> None:
        self.folder.chmod(0o755)  # munge wants its socket to be within everyone's reach
        for name in ("munge", "state", "spool"):
            (self.folder / name).mkdir(mode=0o755)
        key = self.folder / "munge" / "key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(1024))
        text = CONFIGURATION.format(user=getuser(), folder=self.folder, ports=free_ports(2), cpus=CPUS, mpi=self.mpi)
        (self.folder / "slurm.conf").write_text(text)

    def _daemon(self, name: str, *args: str) -> None:
        with open(self.folder / f"{name}.out", "wb") as out:
            self.daemons.append(
                subprocess.Popen(
                    [program(name), *args], env=self.env(), stdin=subprocess.DEVNULL, stdout=out, stderr=out
                )
            )

    def _wait(self, ready: Callable[[], object], what: str, timeout: float = 30.0) -> None:
        deadline = time.monotonic() + timeout
        while not ready():
            ended = [d.args[0] for d in self.daemons if d.poll() is not None]  # type: ignore[index]
            if ended or time.monotonic() > deadline:
                said = "\n".join(
                    f"{path.name}: {path.read_text(errors='replace')[-600:]}"
                    for path in sorted(self.folder.glob("*.out")) + sorted(self.folder.glob("*.log"))
                )
                why = f"{ended} ended" if ended else f"waited {timeout} s"
                raise CannotStart(f"no Slurm here ({why}, waiting for {what})\n{said}")
            time.sleep(0.1)

    # -- use -------------------------------------------------------------------------------------------------

    def env(self, **more: str) -> dict[str, str]:
        """The environment in which Slurm's commands find this cluster and none other."""
        ours = mpi_environment().items()
        env = {name: value for name, value in ours if not name.startswith(("SLURM_", "SBATCH_", "SRUN_"))}
        return env | {"SLURM_CONF": str(self.folder / "slurm.conf")} | more

    def _ask(self, name: str, *args: str) -> str:
        """What a command of Slurm prints; empty if it fails."""
        done = subprocess.run([program(name), *args], env=self.env(), capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else ""

    def srun(
        self, n: int, *command: object, cwd: Path, timeout: float = 300.0, **env: str
    ) -> subprocess.CompletedProcess[str]:
        """`srun -n N command`, to its end; srun itself ends the job after the timeout."""
        limit = f"--time={max(1, round(timeout / 60))}"
        return subprocess.run(
            [program("srun"), "-n", str(n), limit, *map(str, command)],
            cwd=cwd, env=self.env(**env), stdin=subprocess.DEVNULL, capture_output=True, text=True,
            timeout=timeout + 60, check=False,
        )  # fmt: skip

    def sbatch(self, *args: object, cwd: Path, **env: str) -> int:
        """Submit a job; returns its number."""
        done = subprocess.run(
            [program("sbatch"), "--parsable", *map(str, args)],
            cwd=cwd, env=self.env(**env), capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return int(done.stdout.split(";")[0])

    def job(self, number: int | str) -> Job:
        """How the job stands now; of an array, N_K is one task."""
        text = self._ask("scontrol", "show", "job", str(number))
        found = {key: re.search(rf"\b{key}=(\w+)", text) for key in ("JobState", "ExitCode", "Restarts")}
        assert all(found.values()), f"job {number} is unknown: {text}"
        state, code, restarts = (match.group(1) for match in found.values() if match)
        return Job(state, int(code), int(restarts))

    def wait(self, number: int | str, timeout: float = 300.0) -> Job:
        """Until the job is over; it is cancelled, and the test fails, when that takes too long."""
        deadline = time.monotonic() + timeout
        while (job := self.job(number)).state not in OVER:
            if time.monotonic() > deadline:
                self._ask("scancel", str(number))
                raise AssertionError(f"job {number} still {job.state} after {timeout} s")
            time.sleep(0.2)
        return job

    def signal(self, number: int | str, name: str) -> None:
        """Send a signal to all tasks of a job's steps (not to its batch script), as the queue itself would."""
        self._ask("scancel", f"--signal={name}", str(number))

    def start_again(self, number: int | str) -> None:
        """Slurm lets a requeued job rest for two minutes; the tests wait only until the node has forgotten it."""
        deadline = time.monotonic() + 60
        while self.job(number).state != "PENDING" and time.monotonic() < deadline:
            time.sleep(0.2)
        time.sleep(3)  # slurmd turns down what looks like the job it has just ended: it compares whole seconds
        self._ask("scontrol", "update", f"JobId={number}", "StartTime=now")
