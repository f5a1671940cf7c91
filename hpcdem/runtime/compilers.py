"""Compiles the kernels of warm-ups in several processes, which fill the same store.

Each of them runs the warm-ups once with the plain Python functions in place of the kernels, to see which kernels are
called and with what types. That takes less than a second, as the models of a warm-up are tiny. Then each takes one
kernel after the other from this list, the largest first, until none is left; it skips those in the store. The list may
be wrong in places, because functions that exist for the compiler only (intrinsics) give zero here and a kernel that
fails does nothing: the process that started them runs the warm-ups in earnest, and compiles what is missing.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import inspect
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

from hpcdem.runtime import kept

LAUNCHER = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "MPI_", "MV2_", "PALS_", "HYDRA_", "HYDI_", "H5PY_ALWAYS_USE_MPI")
"""How variables begin that make a process take part in the MPI job of its parent."""
PATIENCE = 60.0
"""Seconds: a warm-up of plain functions that is not over by then waits for what a kernel should have done."""


@dataclass(frozen=True)
class Job:
    """warm_ups: whose kernels are compiled; cores: to run on; turn: descriptor of a file that all processes share, with
    three numbers (see `_Count`), whoever holds its lock may change them; patience: see PATIENCE."""

    warm_ups: list[Callable[[], None]]
    cores: Collection[int]
    turn: int
    patience: float


class _Count:
    """Counters shared by processes: kernels taken from the list, kernels compiled, and kernels to be compiled."""

    def __init__(self, file: int) -> None:
        self.file = file

    def read(self) -> list[int]:
        """The three numbers."""
        data = os.pread(self.file, 24, 0).ljust(24, b"\0")
        return [int.from_bytes(data[at : at + 8], "little") for at in (0, 8, 16)]

    def add(self, *more: int) -> list[int]:
        """Add to them; the numbers of before."""
        with _locked(self.file):
            before = self.read()
            data = b"".join((n + m).to_bytes(8, "little") for n, m in zip(before, more, strict=True))
            os.pwrite(self.file, data, 0)
        return before

    def expect(self, count: int) -> None:
        """Set the number of kernels to be compiled, unless it is set already."""
        with _locked(self.file):
            if not any(self.read()):
                os.pwrite(self.file, count.to_bytes(8, "little"), 16)


def compile_in_processes(
    warm_ups: list[Callable[[], None]], count: int, cores: Collection[int], meanwhile: Callable[[int, int], None]
) -> str:
    """Compile the kernels of the warm-ups into the store, with `count` processes. Returns what went wrong, empty if
    nothing did. meanwhile: receives the number of compiled kernels and their total. The processes end with this one,
    however that ends."""
    package = Path(__file__).resolve().parents[1]
    program = (  # -P and the removed entry: nothing is imported from where the run happens to be
        f"import sys; sys.path.insert(0, {str(package.parent)!r}); import {package.name}; del sys.path[0]; "
        f"from {__name__} import main; main()"
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith(LAUNCHER)}
    with tempfile.TemporaryFile() as turn, tempfile.TemporaryFile() as errors, contextlib.ExitStack() as processes:
        job = pickle.dumps(Job(warm_ups, cores, turn.fileno(), PATIENCE))
        counts = _Count(turn.fileno())
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
            meanwhile(*counts.read()[1:])
        if not any(process.returncode for process in started):
            return ""
        errors.seek(0)
        codes = ", ".join(str(process.returncode) for process in started)
        return f"exit codes {codes}; {errors.read().decode(errors='replace').strip().rpartition(chr(10))[2]}"


# -- in one of these processes -----------------------------------------------------------------------------------------


def main() -> None:
    """Take part in the job that comes through the standard input."""
    job: Job = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, job.cores)
    kept.install()
    gc.set_threshold(50_000, 20, 100)  # a compiler makes many objects and few circles
    faulthandler.dump_traceback_later(job.patience, exit=True)
    kernels = _recorded(job.warm_ups)
    faulthandler.cancel_dump_traceback_later()
    count = _Count(job.turn)
    count.expect(sum(not kept.has(*one) for one in kernels))
    with kept.warming():
        while (number := count.add(1, 0, 0)[0]) < len(kernels):
            kernel, types = kernels[number]
            if not kept.has(kernel, types):
                with contextlib.suppress(Exception):  # wrong types in the list; an error comes again in the parent
                    kernel.compile(types)
                count.add(0, 1, 0)


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
        os.lockf(file, os.F_ULOCK, 24)


def _recorded(warm_ups: list[Callable[[], None]]) -> list[tuple[Any, tuple[Any, ...]]]:
    """The kernels that the warm-ups call, with types of arguments, the longest first; the same list in each process."""
    found: dict[tuple[Any, tuple[Any, ...]], None] = {}
    for warm in warm_ups:
        with _calls_recorded() as calls, warnings.catch_warnings(action="ignore"), contextlib.suppress(Exception):
            warm()
        found |= calls
    return sorted(found, key=lambda call: -_length(call[0].py_func, set()))


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
    """Return the length of the byte code of a function and of all kernels it calls, a measure of the time to compile
    it."""
    if function in seen:
        return 0
    seen.add(function)
    code = function.__code__
    used = [function.__globals__.get(name) for name in code.co_names]
    used += [getattr(module, name, None) for module in used if isinstance(module, ModuleType) for name in code.co_names]
    used += [cell.cell_contents for cell in function.__closure__ or ()]
    kernels = (getattr(thing, "py_func", None) for thing in used)
    return len(code.co_code) + sum(_length(kernel, seen) for kernel in kernels if kernel is not None)
