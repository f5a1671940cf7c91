"""The store of kernels: where it is, who fills it, and what happens when it cannot be used."""

from __future__ import annotations

import ast
import errno
import importlib
import importlib.util
import io
import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hpcdem import session
from hpcdem.core.comm import SerialComm
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant
from hpcdem.runtime import compilers, kept
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
def base(tmp_path, monkeypatch):
    """A cache of our own."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setattr(kernels_.launch, "mask", lambda: frozenset({0}))  # closures stay in this process
    kept.store.cache_clear()
    yield folder
    monkeypatch.undo()
    kept.install()


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


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.nbc"))


def test_the_store_is_filled_once_and_then_read_on_demand(base, kernels):
    late = list(kernels_.late)
    folder, _ = prepare(kernels)
    assert folder.parent == base and len(files(folder)) == 1 and kernels.calls == [42] and kernels.hits() == 0
    again, said = prepare(kernels)
    assert again == folder and said == "" and kernels.calls == [42]  # nothing is loaded before it is called
    kernels()()
    assert kernels.hits() == 1 and kernels_.late == late


def test_kernels_are_known_by_what_they_are_made_of(base, tmp_path, monkeypatch, kernels):
    """Their module, those that it imports, its own place in the text; not where the package is."""
    package = tmp_path / "hpcdem"
    package.mkdir()
    monkeypatch.setattr(kept, "_PACKAGE", package)
    source = tmp_path / "kernels_of_a_test.py"

    def digest() -> str:
        for known in (kept._digest, kept._reached, kept._sources, kept._files, kept._code):
            known.cache_clear()
        return kept._digest(source)

    first = digest()
    source.write_text(KERNELS + "from hpcdem.constants import (\n    A,\n)\n")
    (package / "constants.py").write_text("from hpcdem.inner import B\nA = B\n")
    (package / "inner.py").write_text("B = 1\n")
    second = digest()
    (package / "inner.py").write_text("B = 2\n")
    (package / "other.py").write_text("C = 2\n")
    third = digest()
    assert len({first, second, third}) == 3
    (package / "other.py").write_text("C = 3\n")
    assert digest() == third
    (package / "inner.py").write_text(
        '"""Words."""\n\n# why\nB = 2  # another unit\n"""More words,\nof two lines."""\n'
    )
    assert digest() == third
    (package / "inner.py").write_text('B = "2"\n')
    assert digest() != third
    (package / "inner.py").write_text('def f():\n    """A."""  # why\n    return 1\n"""Words."""\n')
    fourth = digest()
    (package / "inner.py").write_text('def f():\n    """A."""  # why\n    return 2\n"""Words."""\n')
    assert digest() != fourth, "code between two docstrings counts, whatever follows the first"
    for known in (kept._digest, kept._reached, kept._sources, kept._files, kept._code):
        known.cache_clear()


def test_docstrings_and_comments_change_no_digest_of_kernels() -> None:
    """What the digest omits are docstrings, comments and blank lines, in all modules on which kernels depend."""

    def parsed(text: str) -> str:
        tree = ast.parse(text)
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            if isinstance(body, list):
                rest = [
                    line for line in body if not (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))
                ]
                body[:] = rest or [ast.Pass()]
        return ast.dump(tree)

    for name in kept.deciding():
        text = (kept._PACKAGE / name).read_text(encoding="utf-8")
        code = kept._WORDS.sub(
            lambda words: words[0][: words[0].find('"""')] + '""' if '"""' in words[0] else "", "\n" + text
        )
        assert parsed(code) == parsed(text), name
        kernels = [line for line, words in enumerate(text.splitlines(), 1) if words.startswith(("def ", "@"))]
        lines = kept._code(kept._PACKAGE / name)[0].split("\n")
        assert [lines[kept._line(kept._PACKAGE / name, line)] for line in kernels] == [
            re.sub(r"  #[^\"']*$", "", text.splitlines()[line - 1]) for line in kernels
        ], name


def test_kernels_of_a_factory_are_reported_apart_by_what_was_put_into_them(base):
    import numba

    kept.install()

    def made(factor, inner=None):
        @numba.njit
        def part(x):
            return factor * x

        def kernel(x):
            return part(x) + factor

        kernel.__module__ = "hpcdem.anything"
        return numba.njit(cache=True)(kernel)

    one, same, other = made(2), made(2), made(3)
    assert one(1) == 4 and same(1) == 4 and other(1) == 6
    hits = [sum(kernel.stats.cache_hits.values()) for kernel in (one, same, other)]
    assert hits == [0, 1, 0]


def test_a_kernel_of_a_factory_is_made_anew_when_a_kernel_that_it_was_given_changes(base, tmp_path, monkeypatch):
    """A constant of the law is no part of the factory's module, nor of the law's byte code."""
    kept.install()
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python tells texts of one size and second not apart
    factory = "from numba import njit\ndef loop(law):\n    @njit(cache=True)\n    def run(x):\n        return law(x)\n"
    law = "from numba import njit\n@njit(cache=True)\ndef law(x):\n    return {} * x\n"

    def module(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        spec = importlib.util.spec_from_file_location(f"hpcdem.{name}", tmp_path / f"{name}.py")
        found = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, f"hpcdem.{name}", found)
        spec.loader.exec_module(found)
        return found

    def value(factor):
        for known in (kept._digest, kept._reached, kept._sources, kept._code):
            known.cache_clear()
        run = module("factory", factory + "    return run\n").loop(module("law", law.format(factor)).law)
        return run(1.0), sum(run.stats.cache_hits.values())

    assert [value(factor) for factor in (2.0, 2.0, 3.0)] == [(2.0, 0), (2.0, 1), (3.0, 0)]


ALONE = """
import sys
from hpcdem.runtime import launch
launch.prepare_environment(1)
from functools import partial
from numba.core import event
from hpcdem.core.comm import SerialComm
from hpcdem.runtime import kernels
from hpcdem.runtime.progress import Log
from hpcdem.session import warm_up
launch.mask = lambda: frozenset({0, 1})
for kind in sys.argv[1:]:
    with event.install_recorder("numba:compile") as seen:
        folder = kernels.prepare_kernels(SerialComm(), Log(), {kind: partial(warm_up, kind, 1)})
    print("kind", repr(kind), kernels.late, len(list(folder.rglob("*.nbc"))), sum(one.is_end for _, one in seen.buffer))
"""


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize(
    "kinds", [("shared", "", *OF_PARTICLES, "blocks", "coupled"), ("shared", "blocks", *OF_BLOCKS)]
)
def test_processes_know_what_to_compile(tmp_path, kinds):
    """From an empty store: the process that started them has next to nothing to compile, of any kind."""
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path))
    command = [sys.executable, "-c", ALONE, *kinds]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    assert "warning" not in done.stdout
    lines = [line for line in done.stdout.splitlines() if line.startswith("kind ")]
    assert len(lines) == len(kinds)
    for line in lines:
        before, count, compiled = line.rsplit(maxsplit=2)
        assert before.endswith(" []") and int(count) > 20 and int(compiled) <= 6, line


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
pcdc geometry export 'polygon' file 'polygon.dxf'
pcdc mesh structured (0,0) (2,1) cells 2 1
pcdc element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 2 1
pcdc element create geometry layer 'polygon' mesh-size 0.5
pcdc element create geometry-patch boundary-close-polyline array (0,0) (1,0) (1,1) mesh-size 0.5
pcdc element create geometry-boundary boundary (0,0) (1,0) (1,1) mesh-size 0.5
pcdc element create hollow-circle center (0,0) radius 3 inner-radius 1 mesh-size 0.7
pcdc mesh equilateral (0,0) (2,1) size 0.5
pcdc bolt create polyline (0,0) (1,1) length 0.1
pcdc bolt-element create (0,0) (1,1)
pcdc table create 'times' values (0,0) (1,1)
pcdc history create 'time' model value time
pcdc history export 'all.csv'
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
    """A script is read and a program imports without the second that numba and the kernels take."""
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
        from hpcdem.runtime.kept import name_kernels_apart
        name_kernels_apart()
    print([globals()[name](1.0) for name in sys.argv[1:]])
"""


@pytest.mark.parametrize("apart", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_kernels_of_two_processes_are_reported_apart(tmp_path, apart):
    """Without names of their own they are not: then this precaution is no longer needed."""
    (tmp_path / "factory.py").write_text(FACTORY)
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path / "cache"))

    def called(*names: str) -> str:
        command = [sys.executable, "-c", f"import factory; factory.compiled({apart})", *names]
        return subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.strip()

    assert called("double") == "[4.0]" and called("treble") == "[6.0]"
    assert (called("double", "treble") == "[4.0, 6.0]") == apart


MANY = """
import sys, time
sys.path.insert(0, sys.argv[1])
from hpcdem.core.comm import SerialComm
from hpcdem.runtime import kernels, launch
from hpcdem.runtime.progress import Log
launch.mask = lambda: frozenset({0})
def warm():
    import importlib.util
    spec = importlib.util.spec_from_file_location("hpcdem.many", sys.argv[1] + "/many.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["hpcdem.many"] = module
    spec.loader.exec_module(module)
    for k in range(6):
        getattr(module, f"kernel{k}")(1.0)
        time.sleep(0.05)
kernels.prepare_kernels(SerialComm(), Log(), {"": warm})
import hpcdem
made = sys.modules.get("hpcdem.many")
stats = [getattr(made, f"kernel{k}").stats for k in range(6) if made]
print("compiled", sum(sum(one.cache_misses.values()) for one in stats))
"""


@pytest.fixture
def many(tmp_path):
    """`many()` starts a process that compiles six kernels, or takes those that are there."""
    kernels = "".join(f"@numba.njit(cache=True)\ndef kernel{k}(x):\n    return x + {k}.0\n" for k in range(6))
    (tmp_path / "many.py").write_text("import numba\n" + kernels)
    (tmp_path / "program.py").write_text(MANY)
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    command = [sys.executable, str(tmp_path / "program.py"), str(tmp_path)]
    started: list[subprocess.Popen[str]] = []

    def start() -> subprocess.Popen[str]:
        started.append(subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def compiled(process: subprocess.Popen[str]) -> int:
    out, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    return int(out.rsplit(maxsplit=1)[-1])


@pytest.mark.parametrize("after", [pytest.param(0, marks=pytest.mark.slow), 1, pytest.param(4, marks=pytest.mark.slow)])
def test_a_process_that_is_killed_leaves_what_it_has_compiled(many, tmp_path, after):
    first, waiting = many(), None
    while len(files(tmp_path / "cache")) < after:
        assert first.poll() is None
        time.sleep(0.01)
    if after == 1:  # another one waits meanwhile, and goes on when the first is gone
        waiting = many()
        time.sleep(0.3)
    first.send_signal(signal.SIGKILL)
    first.wait()
    left = len(files(tmp_path / "cache"))
    assert left >= after
    assert compiled(waiting or many()) <= 6 - after and len(files(tmp_path / "cache")) == 6
    assert compiled(many()) == 0
    assert not [path for path in (tmp_path / "cache").rglob(".*") if path.stat().st_size]


@pytest.mark.slow
def test_many_processes_at_once_compile_once(many, tmp_path):
    processes = [many() for _ in range(3)]
    assert sum(compiled(process) for process in processes) == 6
    assert len(files(tmp_path / "cache")) == 6


def test_who_waits_says_for_whom(base, kernels):
    import filelock

    place, _ = kept.store()
    place.mkdir(parents=True)
    holder = place / f"building-{kernels_.socket.gethostname()}"
    holder.write_text("process 4711 of here")
    out = io.StringIO()

    class Stream(io.StringIO):
        def write(self, text: str) -> int:
            lock.release()  # it has been said
            return out.write(text)

    lock = filelock.FileLock(holder.with_suffix(".lock"), is_singleton=False)
    lock.acquire()
    kernels_.prepare_kernels(SerialComm(), Log(stream=Stream()), {"": kernels()})
    assert "waiting for process 4711 of here, which is compiling kernels" in out.getvalue()
    assert kernels.calls == [42] and not holder.exists()


def test_a_full_disk_costs_the_next_run_time_and_nothing_else(base, kernels, monkeypatch):
    usual = os.replace

    def full(source: object, target: Path) -> None:
        if target.suffix == ".nbc":  # names of empty files find room
            raise OSError(errno.ENOSPC, "no space left on device")
        usual(source, target)

    with monkeypatch.context() as disk:
        disk.setattr(kept.os, "replace", full)
        folder, said = prepare(kernels)
    assert kernels.calls == [42] and files(folder) == [] and not kernels_.ready("")
    assert said.count("warning") == 1 and f"cannot be stored in {folder} (no space left on device)" in said
    assert not [path for path in folder.rglob(".*") if path.is_file()]
    assert "warning" not in prepare(kernels)[1]
    assert len(files(folder)) == 1 and kernels_.ready("")


def test_a_folder_that_takes_names_only_is_none_for_kernels(tmp_path):
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, {resource.RLIM_INFINITY})); "
    ask = "import pathlib, sys; from hpcdem.runtime import kept; print(kept.can_write(pathlib.Path(sys.argv[1])))"
    for first, answer in (("", "True"), (limit, "False")):
        done = subprocess.run([sys.executable, "-c", first + ask, tmp_path], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == answer


@pytest.mark.parametrize("damage", [b"", b"nonsense", None])
def test_a_damaged_kernel_is_compiled_again(base, kernels, damage):
    folder, _ = prepare(kernels)
    (file,) = files(folder)
    whole = file.read_bytes()
    file.write_bytes(whole[:-10] + b"0123456789" if damage is None else damage)
    with kept.warming():
        kernels()()
    assert kernels.calls[-1] == 42 and kernels.hits() == 0
    kernels()()
    assert kernels.hits() == 1 and files(folder) == [file]


def test_an_error_of_the_kernels_themselves_comes_through(base):
    def wrong() -> None:
        raise TypeError("a kernel that cannot be compiled")

    with pytest.raises(TypeError):
        kernels_.prepare_kernels(SerialComm(), Log(stream=io.StringIO()), {"": wrong})
    assert not kernels_.ready("")


def test_a_cache_that_cannot_be_written_moves_to_a_temporary_folder(tmp_path, monkeypatch, kernels, base):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/proc/nobody/may/write/here")
    monkeypatch.setattr(kept.tempfile, "tempdir", str(tmp_path))
    folder, said = prepare(kernels)
    assert folder.parent == tmp_path / f"hpcdem-{os.getuid()}"
    assert folder.parent.stat().st_mode & 0o777 == 0o700
    assert said.count("warning") == 1 and "/proc/nobody" in said
    assert len(files(folder)) == 1


def test_a_temporary_folder_of_somebody_else_is_not_trusted(tmp_path, monkeypatch):
    monkeypatch.setattr(kept.tempfile, "tempdir", str(tmp_path))
    mine = tmp_path / f"hpcdem-{os.getuid()}"
    mine.mkdir(mode=0o777)
    mine.chmod(0o777)
    assert kept.temporary_base() != mine
    mine.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    mine.symlink_to(tmp_path / "elsewhere")
    assert kept.temporary_base() != mine


def test_the_store_is_known_by_the_settings_of_the_compiler(monkeypatch):
    name = kept.compiler()
    assert name == kept.compiler() and "numba" in name and "/" not in name
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert kept.compiler() != name


def test_runs_with_threads_need_more_than_others(base, monkeypatch):
    place, _ = kept.store()
    for mine, others in (("2", "1"), ("1", "2")):
        monkeypatch.setenv("NUMBA_NUM_THREADS", mine)
        kept.write(place / kernels_._name("blocks", mine != "1"), b"")
        assert kernels_.ready("blocks")
        monkeypatch.setenv("NUMBA_NUM_THREADS", others)
        assert kernels_.ready("blocks") == (mine == "2")
        for path in place.iterdir():
            path.unlink()


def test_kernels_that_nobody_uses_are_removed(base):
    now = time.time()
    store = base / "kernels-numba1-a"
    ages = {"used.nbc": 1, "old.nbc": 90, ".left": 3, ".new": 0}
    for name, days in ages.items():
        path = store / "one" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (now, now - 86400 * days))
    for name, days in (("0-numba1-used", 1), ("0-numba1-old", 90), ("0-numba1-x.building-a-1", 3), ("other", 999)):
        (base / name).mkdir()
        os.utime(base / name, (now, now - 86400 * days))
    (store / "empty").mkdir()
    os.utime(store / "empty", (now, now - 86400 * 3))
    kept.tidy(base)
    assert sorted(path.name for path in base.iterdir()) == ["0-numba1-used", "kernels-numba1-a", "other"]
    assert sorted(path.name for path in store.rglob("*")) == [".new", "one", "used.nbc"]


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
    import hpcdem_kernels_of_processes as k
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
    (tmp_path / "hpcdem_kernels_of_processes.py").write_text(MODULE)
    (tmp_path / "warm_ups_of_processes.py").write_text(WARM)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PARENT", str(os.getpid()))
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "3")
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setattr(kernels_, "QUIET_SECONDS", 0.0)
    some = sorted(os.sched_getaffinity(0))[0]
    monkeypatch.setattr(kernels_.launch, "mask", lambda: frozenset({some, 100000}))
    monkeypatch.setattr(kernels_.cgroups, "cpu_quota", lambda root: None)

    def run(name: str) -> str:
        out = io.StringIO()
        warm = getattr(importlib.import_module("warm_ups_of_processes"), name)
        kernels_.prepare_kernels(SerialComm(), Log(stream=out), {"": warm})
        return out.getvalue()

    yield run
    for name in ("hpcdem_kernels_of_processes", "warm_ups_of_processes"):
        sys.modules.pop(name, None)


def hits() -> dict[str, tuple[int, int]]:
    """Of each kernel: read from the folder, compiled here."""
    module = sys.modules["hpcdem_kernels_of_processes"]
    stats = {name: getattr(module, name).stats for name in ("twice", "of_an_intrinsic")}
    return {name: (sum(s.cache_hits.values()), sum(s.cache_misses.values())) for name, s in stats.items()}


def test_several_processes_fill_a_folder(processes, base, tmp_path):
    said = processes("curious")
    first, *later = said.splitlines()
    assert first.startswith("compiling 3 kernels (first run of this version on this machine")
    assert all(re.match(r"\d (of 3 )?kernels compiled", line) for line in later)
    # The second call of `twice` depends on what only the compiler can do: it was left to this process.
    assert hits() == {"twice": (1, 1), "of_an_intrinsic": (1, 0)}
    (folder,) = base.iterdir()
    assert len(list(folder.rglob("*.nbc"))) == 5 and not list(folder.rglob("*.tmp*"))
    seen = [path.read_text() for path in tmp_path.glob("seen-*") if path.name != f"seen-{os.getpid()}"]
    assert len(seen) == 2
    for text in seen:
        names, mpi, cores = eval(text)
        assert names == [] and not mpi and cores == {min(os.sched_getaffinity(0))}


@pytest.mark.parametrize(
    ("limit", "value", "alone"),
    [
        ("cpu_quota", 1.2, True),
        pytest.param("cpu_quota", 2.0, False, marks=pytest.mark.slow),
        ("memory", 9 * 10**8, True),
        pytest.param("memory", 2 * 10**9, False, marks=pytest.mark.slow),
    ],
)
def test_as_many_processes_as_the_control_group_allows(processes, monkeypatch, limit, value, alone):
    monkeypatch.setattr(kernels_.cgroups, limit, lambda root: value)
    processes("warm")
    assert hits()["of_an_intrinsic"] == ((0, 1) if alone else (1, 0))


def test_processes_that_fail_are_reported_and_this_one_compiles(processes, base):
    said = processes("fails")
    assert said.count("warning: processes that compiled kernels failed") == 1
    assert "(exit codes 1, 1; no such thing)" in said
    assert hits() == {"twice": (0, 2), "of_an_intrinsic": (0, 1)}
    (folder,) = base.iterdir()
    assert len(list(folder.rglob("*.nbc"))) == 5


@pytest.mark.slow
def test_a_warm_up_that_hangs_without_its_kernels_is_given_up(processes, monkeypatch):
    monkeypatch.setattr(compilers, "PATIENCE", 3.0)
    assert "failed; continuing with one (exit codes 1, 1;" in processes("hangs")
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
        "compile_in_processes([w.hangs], 2, os.sched_getaffinity(0), lambda done, total: None)"
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


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize("cores", ["alone", "on the cores of all"])
def test_one_rank_of_a_host_compiles_and_the_others_read(launch, tmp_path, cores):
    """Bound to a core each, they compile in processes on all of these."""
    (tmp_path / "hpcdem_kernels_of_a_test.py").write_text(KERNELS)
    warm = "def warm():\n    import hpcdem_kernels_of_a_test as k\n    k.twice(21)\n"
    (tmp_path / "warm_up_of_a_test.py").write_text(warm)
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
        "    import hpcdem_kernels_of_a_test as k\n"
        "    k.twice(21)\n"
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
    package = kept._PACKAGE
    found = set(kept.deciding())
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
