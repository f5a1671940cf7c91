"""The kernel cache: where it is, who fills it, and what happens when it cannot be used."""

from __future__ import annotations

import importlib
import importlib.util
import io
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hpcdem import session
from hpcdem.halo.comm import SerialComm
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant
from hpcdem.runtime import compilers
from hpcdem.runtime import kernels as kernels_
from hpcdem.runtime.progress import Log
from hpcdem.session import OF_BLOCKS, OF_PARTICLES
from tests.conftest import until

KERNELS = """
import numba

@numba.njit(cache=True)
def twice(x):
    return 2 * x
"""


@pytest.fixture
def base(tmp_path, monkeypatch) -> Path:
    """A cache of our own."""
    import numba

    folder = tmp_path / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setattr(kernels_.launch, "mask", lambda: frozenset({0}))  # closures stay in this process
    monkeypatch.setattr(kernels_, "_loaded", {})
    return folder


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """A module with one kernel: `kernels()` imports it again and calls it, as a fresh process would."""
    source = tmp_path / "kernels_of_a_test.py"
    source.write_text(KERNELS)
    calls = []

    def fresh() -> None:
        if "hpcdem.kernels_of_a_test" not in sys.modules:
            spec = importlib.util.spec_from_file_location("hpcdem.kernels_of_a_test", source)
            module = importlib.util.module_from_spec(spec)
            monkeypatch.setitem(sys.modules, "hpcdem.kernels_of_a_test", module)
            spec.loader.exec_module(module)
        calls.append(sys.modules["hpcdem.kernels_of_a_test"].twice(21))

    def again() -> object:
        sys.modules.pop("hpcdem.kernels_of_a_test", None)
        return fresh

    again.calls = calls
    again.hits = lambda: sum(sys.modules["hpcdem.kernels_of_a_test"].twice.stats.cache_hits.values())
    return again


def prepare(kernels) -> tuple[Path, str]:
    out = io.StringIO()
    return kernels_.prepare_kernels(SerialComm(), Log(stream=out), {"": kernels()}), out.getvalue()


def files(folder: Path) -> list[str]:
    return sorted(p.suffix for p in folder.rglob("*.nb?"))


def test_the_folder_is_filled_once_and_then_read(base, kernels):
    folder, said = prepare(kernels)
    assert folder.parent == base and files(folder) == [".nbc", ".nbi"]
    assert "compiling" in said and kernels.hits() == 0
    again, said = prepare(kernels)
    assert again == folder and said == "" and kernels.hits() == 1
    assert [p.name for p in base.iterdir()] == [folder.name]


def test_who_waits_is_told_how_long(base, kernels, monkeypatch):
    monkeypatch.setattr(kernels_, "QUIET_SECONDS", 0.0)
    monkeypatch.setitem(kernels_.KERNELS, "", 4)
    out, fresh = io.StringIO(), kernels()

    def warm() -> None:
        fresh()
        sys.modules["hpcdem.kernels_of_a_test"].twice(1.5)

    kernels_.prepare_kernels(SerialComm(), Log(stream=out), {"": warm})
    first, second = out.getvalue().splitlines()
    assert first == "compiling about 4 kernels (first run of this version on this machine)"
    assert re.fullmatch(r"1 of about 4 kernels are compiled, some \d+ s left", second)
    assert prepare(kernels)[1] == ""


ALONE = """
import sys
from hpcdem.runtime import launch
launch.prepare_environment(1)
from functools import partial
from numba.core import event
from hpcdem.halo.comm import SerialComm
from hpcdem.runtime import kernels
from hpcdem.runtime.progress import Log
from hpcdem.session import warm_up
launch.mask = lambda: frozenset({0, 1})
for kind in sys.argv[1:]:
    kernels.KERNELS[kind] = 1000  # in several processes, however few there are
    with event.install_recorder("numba:compile") as seen:
        folder = kernels.prepare_kernels(SerialComm(), Log(), {kind: partial(warm_up, kind, 1)})
print(kernels.late, len(list(folder.rglob("*.nbc"))), sum(one.is_end for _, one in seen.buffer))
"""


@pytest.mark.parametrize(
    "kinds",
    [
        ("shared",),
        pytest.param(("shared", ""), marks=pytest.mark.slow),
        pytest.param(("shared", "blocks"), marks=pytest.mark.slow),
        pytest.param(("shared", "", *OF_PARTICLES), marks=pytest.mark.slow),
        pytest.param(("shared", "", "energy", "blocks", "coupled"), marks=pytest.mark.slow),
        pytest.param(("shared", "blocks", *OF_BLOCKS), marks=pytest.mark.slow),
    ],
)
def test_processes_know_what_to_compile(tmp_path, kinds):
    """The process that loads the kernels has next to nothing to compile; the folder has as many as is said before."""
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path))
    command = [sys.executable, "-c", ALONE, *kinds]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    late, count, compiled = done.stdout.splitlines()[-1].rsplit(maxsplit=2)
    assert late == "[]" and "warning" not in done.stdout
    assert int(count) == pytest.approx(kernels_.KERNELS[kinds[-1]], rel=0.15, abs=5)
    assert int(compiled) <= 6


READ_PCDC = """
from hpcdem.lang.pcdc import check, trial
text = '''
pcdc geometry create polyline (0,0) (1,1) as-layer 'line'
pcdc geometry create polygon (0,0) (1,0) (1,1) as-layer 'polygon'
pcdc geometry create rectangle (0,0) (1,1) as-layer 'rectangle'
pcdc geometry create circle (0,0) 1 as-layer 'circle'
pcdc geometry create arc (0,0) 1 0 90 as-layer 'arc'
pcdc geometry create point (0,0) as-layer 'point'
pcdc geometry create fractures orientation fixed 0 length fixed 1 p21 1 inside 'circle' seed 1 as-layer 'cracks'
pcdc mesh structured (0,0) (2,1) cells 2 1
pcdc mesh equilateral (0,0) (2,1) size 0.5
pcdc bolt create polyline (0,0) (1,1) length 0.1
pcdc table create 'times' values (0,0) (1,1)
pcdc history create 'time' model value time
pcdc chart export 'chart' 'chart.svg'
pcdc output vtk 'frames'
pcdc model new dim 3
pcdc geometry create box (0,0,0) (1,1,1) as-layer 'cube'
pcdc geometry create sphere (0,0,0) 1 as-layer 'ball'
pcdc geometry create cylinder (0,0,0) (0,0,1) 1 as-layer 'core'
pcdc geometry create cone (0,0,0) (0,0,1) 1 0.5 as-layer 'cone'
pcdc geometry create disc (0,0,0) (0,0,1) 1 as-layer 'disc'
pcdc geometry create plane (0,0,0) (0,0,1) as-layer 'plane'
'''
read = {statement.command.name for statement in check.read(text, "script.sc").statements}
assert trial._TRIALS.keys() | {"model new"} == read
"""
READ_ZDEM = """
from hpcdem.lang.zdem import execute, parser, plan
script = parser.parse_text(b"LOAD io_zdem_2.2.dat\\nCYC 3\\nSTOP\\n", "script.py")
execute.refuse_unexecuted(script.statements)
assert plan.expected_steps(script.statements) == 3
"""


@pytest.mark.parametrize(
    "program",
    [READ_PCDC, READ_ZDEM, "from hpcdem import Simulation, couple, element_law\nimport hpcdem.cases"],
    ids=["pcdc", "zdem", "python"],
)
def test_what_comes_before_the_kernels_does_not_bring_them(program):
    """A script is read, a program imports: numba settles the folder of a kernel when its module is imported."""
    command = [sys.executable, "-c", f"{program}\nimport sys\nassert 'numba' not in sys.modules"]
    done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


FACTORY = """
import sys
import numba

def times(factor):
    @numba.njit(cache=True)
    def product(x):  # divisions by what may be zero raise errors: too long to be put into its caller
        for k in range(3):
            x = x / (k + 1) + x // (k + 2) + x % (k + 3)
        return 0.0 * x + factor
    return product

@numba.njit(cache=True)
def double(x):
    return double_(x) + double_(x + 1.0)

@numba.njit(cache=True)
def treble(x):
    return treble_(x) + treble_(x + 1.0)

double_, treble_ = times(2), times(3)

def compiled(apart):
    if apart:
        from hpcdem.runtime.compilers import name_kernels_apart
        name_kernels_apart()
    print([globals()[name](1.0) for name in sys.argv[1:]])
"""


@pytest.mark.parametrize("apart", [True, False])
def test_kernels_of_two_processes_are_told_apart(tmp_path, apart):
    """Without names of their own they are not: then this precaution is no longer needed."""
    (tmp_path / "factory.py").write_text(FACTORY)
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path / "cache"))

    def called(*names: str) -> str:
        command = [sys.executable, "-c", f"import factory; factory.compiled({apart})", *names]
        return subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.strip()

    assert called("double") == "[4.0]" and called("treble") == "[6.0]"
    assert (called("double", "treble") == "[4.0, 6.0]") == apart


def test_nobody_sees_a_folder_that_is_not_complete(base, kernels):
    def fails() -> None:
        kernels()()
        assert not (base / kernels_.cache_key()).exists()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kernels_.prepare_kernels(SerialComm(), Log(stream=io.StringIO()), {"": fails})
    assert not (base / kernels_.cache_key()).exists()


def test_the_faster_of_two_jobs_wins(base, kernels):
    def warm() -> None:
        kernels()()
        other = base / kernels_.cache_key()
        other.mkdir()
        (other / "theirs.nbi").write_text("complete")

    kernels_.prepare_kernels(SerialComm(), Log(stream=io.StringIO()), {"": warm})
    (left,) = base.iterdir()
    assert [p.name for p in left.iterdir()] == ["theirs.nbi"]


@pytest.mark.parametrize("damage", [b"", b"nonsense"])
def test_a_damaged_cache_is_given_up_with_one_warning(base, kernels, damage):
    folder, _ = prepare(kernels)
    for file in folder.rglob("*.nb?"):
        file.write_bytes(damage)
    _, said = prepare(kernels)
    assert kernels.calls[-1] == 42
    assert said.count("warning") == 1 and "damaged" in said
    assert not folder.exists()
    _, said = prepare(kernels)
    assert files(folder) == [".nbc", ".nbi"] and "warning" not in said


def test_an_error_of_the_kernels_themselves_comes_through(base):
    def wrong() -> None:
        raise TypeError("a kernel that cannot be compiled")

    with pytest.raises(TypeError):
        kernels_.prepare_kernels(SerialComm(), Log(stream=io.StringIO()), {"": wrong})


def test_a_cache_that_cannot_be_written_moves_to_a_temporary_folder(tmp_path, monkeypatch, kernels, base):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/proc/nobody/may/write/here")
    monkeypatch.setattr(kernels_.tempfile, "tempdir", str(tmp_path))
    folder, said = prepare(kernels)
    assert folder.parent == tmp_path / f"hpcdem-{os.getuid()}"
    assert folder.parent.stat().st_mode & 0o777 == 0o700
    assert said.count("warning") == 1 and "/proc/nobody" in said
    assert files(folder) == [".nbc", ".nbi"]


def test_a_temporary_folder_of_somebody_else_is_not_trusted(tmp_path, monkeypatch):
    monkeypatch.setattr(kernels_.tempfile, "tempdir", str(tmp_path))
    mine = tmp_path / f"hpcdem-{os.getuid()}"
    mine.mkdir(mode=0o777)
    mine.chmod(0o777)
    assert kernels_.temporary_base() != mine
    mine.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    mine.symlink_to(tmp_path / "elsewhere")
    assert kernels_.temporary_base() != mine


def test_the_key_knows_the_settings_of_the_compiler(monkeypatch):
    key = kernels_.cache_key()
    assert key == kernels_.cache_key() and "numba" in key and "/" not in key
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert kernels_.cache_key() != key


def test_runs_with_threads_have_a_folder_of_their_own(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    key = kernels_.cache_key()
    keys = []
    for n in ("2", "8"):
        monkeypatch.setenv("NUMBA_NUM_THREADS", n)
        keys.append(kernels_.cache_key())
    assert keys[0] == keys[1] != key


def test_folders_that_nobody_uses_are_removed(base):
    base.mkdir()
    now = time.time()
    for name, days in (("0-numba1-used", 1), ("0-numba1-old", 90), ("0-numba1-x.building-a-1", 3), ("other", 999)):
        (base / name).mkdir()
        os.utime(base / name, (now, now - 86400 * days))
    mine = base / "0-numba1-mine"
    mine.mkdir()
    os.utime(mine, (now, now - 86400 * 90))
    kernels_.tidy(mine)
    assert sorted(p.name for p in base.iterdir()) == ["0-numba1-mine", "0-numba1-used", "other"]


MODULE = """
import numba
from numba.extending import intrinsic

@intrinsic
def one(typingctx):
    return numba.types.float64(), lambda context, builder, signature, args: context.get_constant(numba.float64, 1.0)

@numba.njit(cache=True)
def inner(x):
    return 2 * x

@numba.njit(cache=True)
def twice(x, y=1):
    return inner(x) * y

@numba.njit(cache=True)
def of_an_intrinsic(x):
    return x / one()  # by zero, where functions are plain
"""
WARM = """
import os, sys, time
from pathlib import Path
HERE = Path(__file__).parent

def warm():
    import kernels_of_processes as k
    assert k.twice(21) == 42
    k.twice(1.5, y=k.of_an_intrinsic(4))

def curious():
    warm()
    names = [name for name in os.environ if name.startswith(("OMPI_", "PMI_"))]
    HERE.joinpath(f"seen-{os.getpid()}").write_text(repr((names, "mpi4py" in sys.modules, os.sched_getaffinity(0))))

def fails():
    if os.environ["PARENT"] != str(os.getpid()):
        raise SystemExit("no such thing")
    warm()

def hangs():
    if os.environ["PARENT"] != str(os.getpid()):
        HERE.joinpath(f"seen-{os.getpid()}").touch()
        time.sleep(600)
    warm()
"""


@pytest.fixture
def processes(base, tmp_path, monkeypatch):
    """`processes("warm")`: two processes compile what this warm-up calls."""
    (tmp_path / "kernels_of_processes.py").write_text(MODULE)
    (tmp_path / "warm_ups_of_processes.py").write_text(WARM)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PARENT", str(os.getpid()))
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "3")
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setattr(kernels_, "late", [])
    monkeypatch.setitem(kernels_.KERNELS, "", 96)
    some = sorted(os.sched_getaffinity(0))[0]
    monkeypatch.setattr(kernels_.launch, "mask", lambda: frozenset({some, 100000}))
    monkeypatch.setattr(kernels_.cgroups, "cpu_quota", lambda root: None)

    def run(name: str) -> str:
        out = io.StringIO()
        warm = getattr(importlib.import_module("warm_ups_of_processes"), name)
        kernels_.prepare_kernels(SerialComm(), Log(stream=out), {"": warm})
        return out.getvalue()

    yield run
    for name in ("kernels_of_processes", "warm_ups_of_processes"):
        sys.modules.pop(name, None)


def hits() -> dict[str, tuple[int, int]]:
    """Of each kernel: read from the folder, compiled here."""
    module = sys.modules["kernels_of_processes"]
    stats = {name: getattr(module, name).stats for name in ("twice", "of_an_intrinsic")}
    return {name: (sum(s.cache_hits.values()), sum(s.cache_misses.values())) for name, s in stats.items()}


def test_several_processes_fill_a_folder(processes, base, tmp_path):
    said = processes("curious")
    first, *later = said.splitlines()
    assert first == "compiling about 96 kernels (first run of this version on this machine)"
    assert all(re.match(r"\d of about 96 kernels are compiled", line) for line in later)  # on a busy machine
    # The second call of `twice` depends on what only the compiler can do: it was left to this process.
    assert hits() == {"twice": (1, 1), "of_an_intrinsic": (1, 0)}
    (folder,) = base.iterdir()
    assert len(list(folder.rglob("*.nbc"))) == 5 and not list(folder.rglob("*.tmp*"))
    seen = [path.read_text() for path in tmp_path.glob("seen-*") if path.name != f"seen-{os.getpid()}"]
    assert len(seen) == 2
    for text in seen:
        names, mpi, cores = eval(text)
        assert names == [] and not mpi and cores == {min(os.sched_getaffinity(0))}


def test_who_waits_for_processes_is_told_how_long(processes, monkeypatch):
    monkeypatch.setattr(kernels_, "QUIET_SECONDS", 0.0)
    assert re.search(r"^[1-5] of about 96 kernels are compiled, some \d+ s left$", processes("warm"), re.MULTILINE)


@pytest.mark.parametrize(
    ("limit", "value", "alone"),
    [("cpu_quota", 1.2, True), ("cpu_quota", 2.0, False), ("memory", 9 * 10**8, True), ("memory", 2 * 10**9, False)],
)
def test_as_many_processes_as_the_control_group_allows(processes, monkeypatch, limit, value, alone):
    monkeypatch.setattr(kernels_.cgroups, limit, lambda root: value)
    processes("warm")
    assert hits()["of_an_intrinsic"] == ((0, 1) if alone else (1, 0))


def test_few_kernels_are_not_worth_processes(processes, monkeypatch):
    monkeypatch.setitem(kernels_.KERNELS, "", kernels_.FEW)
    processes("warm")
    assert hits()["of_an_intrinsic"] == (0, 1)


def test_processes_that_fail_are_told_and_this_one_compiles(processes, base):
    said = processes("fails")
    assert said.count("warning: processes that compiled kernels failed") == 1
    assert "(exit codes 1, 1; no such thing)" in said
    assert hits() == {"twice": (0, 2), "of_an_intrinsic": (0, 1)}
    (folder,) = base.iterdir()
    assert len(list(folder.rglob("*.nbc"))) == 5 and kernels_.BUILDING not in folder.name


def test_a_warm_up_that_hangs_without_its_kernels_is_given_up(processes, monkeypatch):
    monkeypatch.setattr(compilers, "PATIENCE", 3.0)
    assert "failed, so one went on alone (exit codes 1, 1;" in processes("hangs")
    assert hits()["of_an_intrinsic"] == (0, 1)


def at_work(pid: str) -> bool:
    try:
        return " Z " not in Path("/proc", pid, "stat").read_text()
    except OSError:  # it has ended
        return False


def test_processes_end_with_the_one_that_started_them(processes, tmp_path):
    program = (
        "import os\nos.environ['PARENT'] = str(os.getpid())\n"
        "import warm_ups_of_processes as w\nfrom pathlib import Path\nfrom hpcdem.runtime.compilers import *\n"
        f"part = Part(Path({str(tmp_path / 'folder')!r}), w.hangs, True)\n"
        "compile_in_processes([part], 2, os.sched_getaffinity(0), lambda: None)"
    )
    parent = subprocess.Popen([sys.executable, "-c", program])
    try:
        while len(pids := [path.name.removeprefix("seen-") for path in tmp_path.glob("seen-*")]) < 2:
            assert parent.poll() is None
            time.sleep(0.05)
    finally:
        parent.kill()
        parent.wait()
    until(lambda: not any(at_work(pid) for pid in pids), "the end of the processes")


@pytest.mark.mpi
@pytest.mark.parametrize("cores", ["alone", "on the cores of all"])
def test_one_rank_of_a_host_compiles_and_the_others_read(launch, tmp_path, cores):
    """Bound to a core each, they compile in processes on all of these."""
    (tmp_path / "kernels_of_a_test.py").write_text(KERNELS)
    (tmp_path / "warm_up_of_a_test.py").write_text("def warm():\n    import kernels_of_a_test as k\n    k.twice(21)\n")
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\n"
        "from hpcdem.runtime import kernels, launch, shutdown\n"
        "from hpcdem.runtime.progress import Log\n"
        "from warm_up_of_a_test import warm\n"
        "comm = launch.start_mpi()\n"
        f"launch.mask = lambda: frozenset({{{'0' if cores == 'alone' else 'comm.rank'}}})\n"
        "def work():\n"
        "    kernels.prepare_kernels(comm, Log(comm.rank), {'': warm})\n"
        "    import kernels_of_a_test as k\n"
        "    hits = sum(k.twice.stats.cache_hits.values())\n"
        "    sys.stdout.write(f'rank {comm.rank} hits {hits}\\n')\n"
        "shutdown.leave(shutdown.run_together(comm, work))\n"
    )
    env = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
    for hits in ((0 if cores == "alone" else 1, 1, 1), (1, 1, 1)):
        done = launch.python(3, program, timeout=120, env=env)
        assert done.returncode == 0, done.stderr
        lines = sorted(line for line in done.stdout.splitlines() if line.startswith("rank"))
        assert lines == [f"rank {r} hits {h}" for r, h in enumerate(hits)]
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_the_key_knows_every_module_with_kernels_and_its_callers():
    """Whatever holds the word njit is in it, and so are constants that kernels use and modules that call kernels."""
    package = Path(kernels_.__file__).parent.parent
    found = {str(path.relative_to(package)) for path in kernels_.kernel_sources(package)}
    with_kernels = {str(p.relative_to(package)) for p in package.rglob("*.py") if "@njit" in p.read_text()}
    assert with_kernels and with_kernels <= found
    assert {
        "core/fields.py",
        "physics/dem/simulation.py",
        "physics/dem/diagnostics.py",
        "commands/dem/bonds.py",
        "commands/dem/particles.py",
        "io/textnum.py",
    } <= found
    assert not {"api.py", "commands/dem/walls.py"} & found


@pytest.mark.parametrize("load", [Bolts, Flow, Heat, Proppant])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_acts_on_blocks_has_kernels_of_a_known_kind(load, dim):
    """Liners are of the plane only."""
    assert load.kernel_kind + ("-space" if dim == 3 and not load.of_both else "") in session.KINDS
