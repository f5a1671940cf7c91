"""Gmsh in a process of its own: a crash of the library (its optimisers, damaged files) does not end the run, and what
this process did before does not change the mesh."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError


def run(module: str, *words: str, sent: str = "", failed: str) -> None:
    """`python -m module words`, with `sent` on its input. HpcdemError `failed`: its last line, or how it ended.

    It finds modules where this process does, not also in the working folder, where scripts may be called like them.
    Signals to the group of this process (Ctrl-C) do not end it: the run answers them after it.
    """
    code = f"import sys; sys.path[:] = {sys.path!r}; import runpy; runpy.run_module({module!r}, None, '__main__', True)"
    done = subprocess.run(
        [sys.executable, "-c", code, *words], input=sent, text=True, capture_output=True, check=False,
        start_new_session=True,
    )  # fmt: skip
    if done.returncode:
        messages = [line for line in done.stderr.splitlines() if line.strip()]
        why = messages[-1].removeprefix("Exception: ") if messages else f"it ended with {done.returncode}"
        raise HpcdemError(f"{failed}: {why}")


def called(function: Callable[..., Any], *arguments: Any, failed: str) -> Any:
    """Return what a function of a module returns there; raises its HpcdemError, or one that begins with `failed`."""
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        file = Path(folder) / "call"
        file.write_bytes(pickle.dumps((function, arguments)))
        run(__name__, str(file), failed=failed)
        found = pickle.loads(file.read_bytes())
    if isinstance(found, HpcdemError):
        raise found
    return found


def _call(file: Path) -> None:
    function, arguments = pickle.loads(file.read_bytes())
    try:
        found = function(*arguments)
    except HpcdemError as error:
        found = error
    file.write_bytes(pickle.dumps(found))


if __name__ == "__main__":
    _call(Path(sys.argv[1]))
