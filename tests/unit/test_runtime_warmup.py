"""The kernel cache: where it is, who fills it, and what happens when it cannot be used."""

from __future__ import annotations

import importlib.util
import io
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hpcdem.halo.comm import SerialComm
from hpcdem.runtime import kernels as kernels_
from hpcdem.runtime.progress import Log

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
    _, said = prepare(kernels)
    first, second = said.splitlines()
    assert first == "compiling about 4 kernels (first run of this version on this machine)"
    assert re.fullmatch(r"1 of about 4 kernels are compiled, some \d+ s left", second)
    assert prepare(kernels)[1] == ""


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=pytest.mark.slow) for kind in kernels_.KERNELS])
def test_the_number_of_kernels_is_about_right(tmp_path, kind):
    program = (
        "from numba.core import event\nfrom hpcdem.session import warm_up\n"
        f"if {kind!r} != 'shared': warm_up('shared', 1)\n"
        f"if {kind!r} == 'coupled': warm_up('', 1), warm_up('blocks', 1)\n"
        "with event.install_recorder('numba:compile') as seen:\n"
        f"    warm_up({kind!r}, 1)\n"
        "print(sum(one.is_end for _, one in seen.buffer))"
    )
    env = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_NUM_THREADS="1")
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=True)
    assert int(done.stdout) == pytest.approx(kernels_.KERNELS[kind], rel=0.15, abs=5)


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


@pytest.mark.mpi
def test_one_rank_of_a_host_compiles_and_the_others_read(launch, tmp_path):
    (tmp_path / "kernels_of_a_test.py").write_text(KERNELS)
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\n"
        "from hpcdem.runtime import kernels, launch, shutdown\n"
        "from hpcdem.runtime.progress import Log\n"
        "comm = launch.start_mpi()\n"
        "def warm():\n"
        "    import kernels_of_a_test as k\n"
        "    k.twice(21)\n"
        "def work():\n"
        "    kernels.prepare_kernels(comm, Log(comm.rank), {'': warm})\n"
        "    import kernels_of_a_test as k\n"
        "    hits = sum(k.twice.stats.cache_hits.values())\n"
        "    sys.stdout.write(f'rank {comm.rank} hits {hits}\\n')\n"
        "shutdown.leave(shutdown.run_together(comm, work))\n"
    )
    env = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for hits in ((0, 1, 1), (1, 1, 1)):
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
