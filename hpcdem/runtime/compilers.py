"""Compiles the kernels of warm-ups in several processes, which fill the same folders.

Each of them runs the warm-ups once with the plain Python functions in place of the kernels, to see which kernels are
called and with what types. That takes less than a second, as the models of a warm-up are tiny. Then each takes one
kernel after the other from this list, the largest first, until none is left. The list may be wrong in places, because
functions that exist for the compiler only (intrinsics) give zero here and a kernel that fails does nothing: the process
that loads the kernels runs the warm-ups in earnest, and compiles what is missing.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import inspect
import itertools
import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

LAUNCHER = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "MPI_", "MV2_", "PALS_", "HYDRA_", "HYDI_", "H5PY_ALWAYS_USE_MPI")
"""How variables begin that make a process take part in the MPI job of its parent."""
PATIENCE = 60.0
"""Seconds: a warm-up of plain functions that is not over by then waits for what a kernel should have done."""


@dataclass(frozen=True)
class Part:
    """A warm-up and the cache folder of its kernels; wanted: they are to be compiled, not only to be known."""

    folder: Path
    warm: Callable[[], None]
    wanted: bool


@dataclass(frozen=True)
class Job:
    """cores: to run on; turn: descriptor of a file that all processes share, with the number
    of kernels taken; who holds its lock may change that, or write into the folders; patience: see PATIENCE."""

    parts: list[Part]
    cores: Collection[int]
    turn: int
    patience: float


def compile_in_processes(parts: list[Part], count: int, cores: Collection[int], meanwhile: Callable[[], None]) -> str:
    """Fill the folders of the wanted parts, with `count` processes. Returns what went wrong, empty if nothing did.

    parts: in the order in which this process loads them, with what it has loaded before: a kernel belongs to the folder
    that was set when its module was imported. The processes end with this one, however that ends.
    """
    package = Path(__file__).resolve().parents[1]
    program = (  # -P and the removed entry: nothing is imported from where the run happens to be
        f"import sys; sys.path.insert(0, {str(package.parent)!r}); import {package.name}; del sys.path[0]; "
        f"from {__name__} import main; main()"
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith(LAUNCHER)}
    with tempfile.TemporaryFile() as turn, tempfile.TemporaryFile() as errors, contextlib.ExitStack() as processes:
        os.pwrite(turn.fileno(), bytes(8), 0)
        job = pickle.dumps(Job(parts, cores, turn.fileno(), PATIENCE))
        started = []
        for _ in range(count):
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", program], bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=errors, env=environment, pass_fds=[turn.fileno()], start_new_session=True,
            )  # fmt: skip
            processes.enter_context(process)
            processes.callback(process.kill)
            started.append(process)
            assert process.stdin is not None
            with contextlib.suppress(BrokenPipeError):  # its exit code will tell
                process.stdin.write(job)
        while any(process.poll() is None for process in started):
            time.sleep(0.05)
            meanwhile()
        if not any(process.returncode for process in started):
            return ""
        errors.seek(0)
        codes = ", ".join(str(process.returncode) for process in started)
        return f"exit codes {codes}; {errors.read().decode(errors='replace').strip().rpartition(chr(10))[2]}"


def name_kernels_apart() -> None:
    """See to it that kernels of this process have names of their own in object code.

    numba counts the functions that a process compiles, and tells functions of the same qualified name and types, such
    as two closures of one factory, apart by that number alone. Of two of the same name that were compiled by different
    processes the linker takes one for both.
    """
    from numba.core.bytecode import FunctionIdentity

    counter: Any = FunctionIdentity
    counter._unique_ids = itertools.count(int.from_bytes(os.urandom(7), "little"))


def spare_c_entries() -> None:
    """Make kernels without the entry for programs in C that numba gives each of them, and nobody calls here: a
    fourteenth of the time of compiling."""
    from numba.core.compiler import Flags

    option: Any = Flags.options["no_cfunc_wrapper"]  # type: ignore[attr-defined]
    option._default = True


# -- in one of these processes -----------------------------------------------------------------------------------------


def main() -> None:
    """Take part in the job that comes through the standard input."""
    job: Job = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, job.cores)
    name_kernels_apart()
    spare_c_entries()
    gc.set_threshold(50_000, 20, 100)  # a compiler makes many objects and few circles
    filled: set[Path] = set()
    _write_in_turn(job, filled)
    faulthandler.dump_traceback_later(job.patience, exit=True)
    kernels = _recorded(job.parts)
    faulthandler.cancel_dump_traceback_later()
    while (number := _take(job.turn)) < len(kernels):
        kernel, types, folder = kernels[number]
        filled.clear()
        filled.add(folder)
        with contextlib.suppress(Exception):  # wrong types in the list; an error of a kernel comes again in the parent
            kernel.compile(types)


def _end_with_parent() -> None:
    while os.read(0, 1):  # nothing comes any more but the end of the pipe
        pass
    os._exit(1)


@contextlib.contextmanager
def _locked(file: int) -> Iterator[None]:
    """The lock ends with the process that holds it."""
    os.lockf(file, os.F_LOCK, 8)
    try:
        yield
    finally:
        os.lockf(file, os.F_ULOCK, 8)


def _take(turn: int) -> int:
    """The number of the next kernel that nobody has taken."""
    with _locked(turn):
        number = int.from_bytes(os.pread(turn, 8, 0), "little")
        os.pwrite(turn, (number + 1).to_bytes(8, "little"), 0)
    return number


def _write_in_turn(job: Job, filled: Collection[Path]) -> None:
    """numba looks for a free name for its file and enters it into an index: two at a time would take the same.

    filled: the folder of the kernel that is compiled. Of those of other folders, which are compiled within it, nothing
    is kept: what a folder holds does not depend on what is compiled at the same time.
    """
    from numba.core.caching import FunctionCache

    save = FunctionCache.save_overload

    def save_in_turn(cache: Any, signature: Any, kernel: Any) -> None:
        if not set(Path(cache.cache_path).parents).isdisjoint(filled):
            with _locked(job.turn):
                save(cache, signature, kernel)

    FunctionCache.save_overload = save_in_turn  # type: ignore[method-assign]


def _recorded(parts: list[Part]) -> list[tuple[Any, tuple[Any, ...], Path]]:
    """The kernels that the wanted parts call, with types of arguments and folder; the same list in each process."""
    import numba

    kernels: list[tuple[Any, tuple[Any, ...], Path]] = []
    known: set[tuple[Any, tuple[Any, ...]]] = set()
    for part in parts:
        numba.config.CACHE_DIR = str(part.folder)  # type: ignore[attr-defined]
        with _calls_recorded() as calls, warnings.catch_warnings(action="ignore"), contextlib.suppress(Exception):
            part.warm()
        if part.wanted:  # each folder before the next: what is in memory already is not stored again
            new = sorted(
                (call for call in calls if call not in known), key=lambda call: -_length(call[0].py_func, set())
            )
            kernels += [(kernel, types, part.folder) for kernel, types in new]
        known |= calls.keys()
    return kernels


@contextlib.contextmanager
def _calls_recorded() -> Iterator[dict[tuple[Any, tuple[Any, ...]], None]]:
    """Kernels are called as plain Python functions; those that Python code calls are noted."""
    from numba import types
    from numba.core.extending import _Intrinsic
    from numba.core.registry import CPUDispatcher

    calls: dict[tuple[Any, tuple[Any, ...]], None] = {}
    depth = 0

    def call(kernel: Any, *args: Any, **keywords: Any) -> Any:
        nonlocal depth
        if depth == 0:
            parameters = inspect.signature(kernel.py_func)
            given = parameters.bind(*args, **keywords).arguments
            signature = tuple(
                kernel.typeof_pyval(given[name]) if name in given else types.Omitted(parameter.default)
                for name, parameter in parameters.parameters.items()
            )
            calls[kernel, signature] = None
        depth += 1
        try:
            return kernel.py_func(*args, **keywords)
        except Exception:
            if depth > 1:
                raise
            return None
        finally:
            depth -= 1

    dispatcher: Any = CPUDispatcher
    intrinsic: Any = _Intrinsic
    usual = intrinsic.__call__
    dispatcher.__call__ = call
    intrinsic.__call__ = lambda self, *args: 0
    try:
        yield calls
    finally:
        del dispatcher.__call__  # that of its base
        intrinsic.__call__ = usual


def _length(function: FunctionType, seen: set[FunctionType]) -> int:
    """Of its byte code and of that of all kernels it calls: about how long it takes to compile."""
    if function in seen:
        return 0
    seen.add(function)
    code = function.__code__
    used = [function.__globals__.get(name) for name in code.co_names]
    used += [getattr(module, name, None) for module in used if isinstance(module, ModuleType) for name in code.co_names]
    used += [cell.cell_contents for cell in function.__closure__ or ()]
    kernels = (getattr(thing, "py_func", None) for thing in used)
    return len(code.co_code) + sum(_length(kernel, seen) for kernel in kernels if kernel is not None)
