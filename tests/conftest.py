"""Shared by all tests: starting the program on n ranks, and saying why a test cannot run here."""

from __future__ import annotations

import contextlib
import gc
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from hpcdem.runtime import kept
from hpcdem.runtime.launch import openmp_runtime_found

pytest_plugins = ["tests.browser", "tests.suite"]
ROOT = Path(__file__).resolve().parent.parent
BIN = Path(sys.executable).parent
PATIENCE = 300.0
"""Seconds after which what has not come is given up. Whatever a test waits for comes within seconds on a quiet machine;
on a busy one it comes later, which is no failure."""


def sources(folder: str, pattern: str = "*") -> list[Path]:
    """Files of the project below a folder of it, as git knows them: what runs and users leave there is none."""
    try:
        known = subprocess.run(["git", "ls-files", "-z", folder], cwd=ROOT, capture_output=True, text=True, check=False)
        names = known.stdout.split("\0")[:-1]
    except OSError:  # no git
        names = []
    if names:
        found = [ROOT / name for name in names]
    else:  # an archive of the sources
        found = [p for p in (ROOT / folder).rglob("*") if not {"data", "__pycache__"} & {*p.relative_to(ROOT).parts}]
    return sorted(path for path in found if path.is_file() and path.match(pattern))


if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # `nohup ... &`: programs that are started would ignore it too
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Programs that tests start are those of this tree, whatever tree the environment was made for.
others = [place for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place not in ("", str(ROOT))]
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *others])

# A ZDEM script that runs alone takes all cores unless this is set; tests run side by side.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Kernels that tests call in this process are those of the programs they start.
os.environ.setdefault("NUMBA_DISABLE_INTEL_SVML", "1")
os.environ.setdefault("NUMBA_THREADING_LAYER", "omp" if openmp_runtime_found() else "workqueue")
kept.install()

# --- what this machine has -------------------------------------------------------------------------------------


def absent(what: str, reason: str) -> None:
    """Skip; fail instead where HPCDEM_TEST_REQUIRE names it (scripts/test sets that for what it installed itself)."""
    if what in os.environ.get("HPCDEM_TEST_REQUIRE", "").split(","):
        pytest.fail(f"{what} is required here: {reason}", pytrace=False)
    pytest.skip(reason)


@cache
def mpiexec() -> str | None:
    """The launcher that belongs to this interpreter's MPI: a wheel puts it beside python, a system into PATH."""
    beside = BIN / "mpiexec"
    return str(beside) if beside.exists() else shutil.which("mpiexec")


@cache
def is_open_mpi() -> bool:
    """Whether mpiexec is Open MPI's (MPICH's needs no coaxing)."""
    version = subprocess.run([mpiexec() or "", "--version"], capture_output=True, text=True, check=False)
    return "Open" in version.stdout


def mpi_environment() -> dict[str, str]:
    """The variables of this process, and those without which ranks do not start or crawl on a small machine.

    A copy of os.environ on purpose: a test that initialises MPI in pytest's own process leaves variables in the C
    environment that a new job must not inherit.
    """
    env = dict(os.environ)
    env.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    env.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # tests run side by side: a thread that waits must let go of its core
    if mpiexec() and is_open_mpi():
        env.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
        env.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        env.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
        env.setdefault("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")  # the same for Open MPI 5
        env.setdefault("OMPI_MCA_hwloc_base_binding_policy", "none")
        # More ranks than cores: a waiting rank must let go of its core.
        env.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
        # Containers forbid reading another process's memory; without this Open MPI complains on every start.
        env.setdefault("OMPI_MCA_btl_vader_single_copy_mechanism", "none")
    return env


@cache
def why_no_mpi() -> str:
    """Empty if two ranks can be started and see each other, otherwise the reason."""
    if mpiexec() is None:
        return "no mpiexec here: install the extra [mpi] or an MPI of the system"
    program = "from mpi4py import MPI; MPI.COMM_WORLD.rank or print('ranks', MPI.COMM_WORLD.size)"
    try:
        probe = run([*mpi_command(2), sys.executable, "-c", program], timeout=60)
    except pytest.fail.Exception as error:
        return str(error)
    if probe.returncode or probe.stdout.split() != ["ranks", "2"]:
        return f"mpiexec -n 2 does not start two ranks of one job: {(probe.stderr or probe.stdout)[-300:]}"
    return ""


@cache
def why_no_parallel_hdf5() -> str:
    """Empty if h5py was built with MPI, otherwise the reason."""
    probe = run([sys.executable, "-c", "import h5py; print(h5py.get_config().mpi)"], timeout=120)
    return "" if probe.stdout.strip() == "True" else "h5py was built without MPI"


@pytest.fixture
def needs_mpi() -> None:
    """For tests that start several ranks; the mark `mpi` does the same."""
    if why_no_mpi():
        absent("mpi", why_no_mpi())


@pytest.fixture
def needs_parallel_hdf5(needs_mpi: None) -> None:
    """For tests of parallel HDF5 itself; everything else must work without."""
    if why_no_parallel_hdf5():
        absent("parallel_hdf5", why_no_parallel_hdf5())


@pytest.fixture
def needs_petsc() -> None:
    """For tests that solve with PETSc; the mark `petsc` does the same."""
    probe = run([sys.executable, "-c", "from petsc4py import PETSc"], timeout=120)
    if probe.returncode:
        absent("petsc", f"petsc4py cannot be imported: {probe.stderr.strip().splitlines()[-1]}")


@pytest.fixture(scope="session")
def manual_scripts() -> Path:
    """Folder with the scripts printed in the ZDEM manual, which are not ours to ship."""
    folder = Path(os.environ.get("HPCDEM_MANUAL_SCRIPTS", ROOT.parent / "shared" / "manual_scripts"))
    if not folder.is_dir():
        absent("manual_scripts", "no scripts of the manual here: set HPCDEM_MANUAL_SCRIPTS to their folder")
    return folder


@pytest.fixture
def needs_manual_scripts(manual_scripts: Path) -> Path:
    """The same folder under the name of a condition."""
    return manual_scripts


_WATCHES = {"launch_once", "wait_until", "slurm"}
"""Fixtures of tests that look at a program while it runs: nothing else may keep it waiting."""

_RANKS = {"needs_mpi", "needs_parallel_hdf5"}
"""Fixtures of tests that start several ranks and wait for their end, however long it takes."""


_ELSEWHERE = {"browser", "slurm"}
"""Fixtures of tests that look at hpcdem from outside of it, through programs of others: scripts/test --nightly."""


def _leave_some_of_each(items: list[pytest.Item]) -> None:
    """Of a test that is marked so: some cases, which have each value of each parameter, stay quick, others are slow."""
    tests: dict[str, list[Any]] = {}
    for item in items:
        if hasattr(item, "callspec") and item.get_closest_marker("some_of_each"):
            if not item.get_closest_marker("slow"):
                tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in tests.values():
        values = {item: {(name, id(value)) for name, value in item.callspec.params.items()} for item in cases}
        left = set().union(*values.values())
        while left:
            chosen = max(values, key=lambda item: len(left & values[item]))
            left -= values.pop(chosen)
        for item in values:
            item.add_marker("slow")


def _spare_hypothesis_the_sources() -> None:
    """Hypothesis reads all modules that are loaded for numbers to try: seconds of each process, and examples that are
    said to be always the same would depend on which modules are there."""
    if "hypothesis" in sys.modules:
        with contextlib.suppress(ImportError, AttributeError):
            from hypothesis.internal.conjecture import providers

            none = providers._local_constants
            providers._get_local_constants = lambda: none


@pytest.hookimpl(tryfirst=True)  # before pytest sorts out what `-m` asks for
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A mark is a promise about the machine: let it check the machine too. And who needs how much of it."""
    _leave_some_of_each(items)
    _spare_hypothesis_the_sources()
    for item in items:
        if not isinstance(item, pytest.Function):
            continue
        marks = {mark.name for mark in item.iter_markers()}
        item.fixturenames[:0] = [f"needs_{mark}" for mark in ("petsc", "mpi") if mark in marks]
        if "slurm" in marks or not _ELSEWHERE.isdisjoint(item.fixturenames):
            item.add_marker("nightly")
        if "slurm" in marks or not _WATCHES.isdisjoint(item.fixturenames):
            item.add_marker("alone")
        elif "alone" not in marks and not _RANKS.isdisjoint(item.fixturenames):
            item.add_marker("ranks")
    shared: dict[Path, set[str]] = {}
    for item in items:
        if item.get_closest_marker("ranks"):
            shared.setdefault(item.path, set()).update(_made_once(item))
    for item in items:  # what is made once for a file is made in one of the two runs of pytest, not in both
        if not item.get_closest_marker("alone") and not shared.get(item.path, set()).isdisjoint(_made_once(item)):
            item.add_marker("ranks")

    if PARTS is not None:  # of all tests that there are; which of them run is sorted out later
        for part in ("ranks", "alone"):
            files = sorted({str(item.path) for item in items if item.get_closest_marker(part)})
            (PARTS / part).write_text("\n".join(files))

    if GREEN.is_file():
        passed = set(GREEN.read_text().splitlines())
        items[:] = [item for item in items if item.nodeid not in passed]


def pytest_sessionstart(session: pytest.Session) -> None:
    """Collecting tests makes a million objects that stay: no garbage. With xdist only its workers collect."""
    if hasattr(session.config, "workerinput") or session.config.getoption("dist", "no") == "no":
        gc.disable()


def pytest_collection_finish() -> None:
    """From here on there is garbage; what was collected is none of it, and is looked through no more."""
    gc.freeze()
    gc.enable()


def _made_once(item: pytest.Item) -> set[str]:
    """Fixtures of a test that are made once for its file."""
    found = item._fixtureinfo.name2fixturedefs if isinstance(item, pytest.Function) else {}
    return {name for name, fixtures in found.items() if fixtures[-1].scope == "module"}


PARTS = Path(os.environ["HPCDEM_TEST_PARTS"]) if "HPCDEM_TEST_PARTS" in os.environ else None
"""Folder for the names of the files with tests of several ranks, and with tests that want to be alone: scripts/test
lets each part read those only, as to read all takes a quarter of a minute of each process."""


# --- tests that go on after a break: scripts/test --go-on --------------------------------------------------------

GREEN = Path(os.environ.get("HPCDEM_TEST_GREEN", os.devnull))
"""The tests that have passed before; they are left out."""


@pytest.hookimpl(tryfirst=True)
def pytest_report_teststatus(report: pytest.TestReport) -> None:
    """Note what has passed, in the process that tells of all tests."""
    if report.when == "call" and report.passed:
        with GREEN.open("a") as file:
            file.write(f"{report.nodeid}\n")


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Nothing left to do is no failure then."""
    if GREEN.is_file() and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK


# --- starting the program --------------------------------------------------------------------------------------


def mpi_command(n: int) -> list[str]:
    """The words in front of a program that start n ranks of it."""
    return [mpiexec() or "mpiexec", "-n", str(n)]


def processes_of_session(session: int) -> list[int]:
    """Process ids of a session: launchers put their ranks into process groups of their own, but not into sessions."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


def end(process: subprocess.Popen) -> None:
    """End a process started with start_new_session, and all it has started: kindly, then firmly."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            pass
    for pid in processes_of_session(process.pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    process.wait()


def run(
    command: list[str], cwd: Path | None = None, timeout: float = 300.0, env: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, whatever its exit code; a test fails if it takes longer than `timeout` seconds."""
    process = popen(command, cwd, env)
    try:
        out, err = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        end(process)
        out, err = process.communicate()
        pytest.fail(f"not at its end after {timeout} s: {command}\n{out[-2000:]}\n{err[-2000:]}", pytrace=False)
    finally:
        end(process)
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def popen(command: list[str], cwd: Path | None = None, env: dict[str, str] | None = None) -> subprocess.Popen[str]:
    """Start a command in a session of its own, without input, output as text."""
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command,
        cwd=cwd,
        env=mpi_environment() | (env or {}),
        stdin=subprocess.DEVNULL,
        stdout=pipe,
        stderr=pipe,
        text=True,
        start_new_session=True,
    )


class Launcher:
    """Starts hpcdem, or any Python program, on n ranks: n = 1 is the plain program without mpiexec."""

    def __init__(self) -> None:
        self.started: list[subprocess.Popen[str]] = []

    def command(self, n: int, *args: object) -> list[str]:
        """The command line of hpcdem on n ranks."""
        return self._ranks(n, [str(BIN / "hpcdem")], args)

    def __call__(
        self,
        n: int,
        *args: object,
        cwd: Path | None = None,
        timeout: float = 300.0,
        env: dict[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """`hpcdem ARGS` on n ranks, to its end."""
        return run(self.command(n, *args), cwd, timeout, env)

    def python(
        self,
        n: int,
        *args: object,
        cwd: Path | None = None,
        timeout: float = 300.0,
        env: dict[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """`python ARGS` on n ranks, to its end."""
        return run(self._ranks(n, [], args), cwd, timeout, env)

    def start(
        self, n: int, *args: object, cwd: Path | None = None, env: dict[str, str] | None = None
    ) -> subprocess.Popen[str]:
        """`hpcdem ARGS` on n ranks in the background, for tests that send signals; ended with the test."""
        self.started.append(popen(self.command(n, *args), cwd, env))
        return self.started[-1]

    @staticmethod
    def _ranks(n: int, program: list[str], args: tuple[object, ...]) -> list[str]:
        return [*(mpi_command(n) if n > 1 else []), sys.executable, *program, *map(str, args)]


@pytest.fixture
def launch() -> Iterator[Launcher]:
    """`launch(n, "script.py", cwd=tmp_path)` runs hpcdem on n ranks; see Launcher."""
    launcher = Launcher()
    yield launcher
    for process in launcher.started:
        end(process)
        process.communicate()


@pytest.fixture(scope="session")
def resident() -> Iterator[Any]:
    """`resident(n, "script.py", cwd=tmp_path)` does what `launch` does, without a start of processes for each run."""
    from tests.property.workers import Resident

    programs = Resident()
    yield programs
    programs.stop()


@pytest.fixture
def wait_until() -> Callable[..., None]:
    """`wait_until(condition, what)`: poll until true; the test fails if that never comes."""
    return until


def until(condition: Callable[[], object], what: object = "it", pause: Callable[[float], object] = time.sleep) -> None:
    """Poll until true. what: to wait for, or a function that says what there is instead."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            found = what() if callable(what) else what
            pytest.fail(f"waited {PATIENCE:g} s for {found}", pytrace=False)
        pause(0.05)
