"""Gmsh in a process of its own: a crash of the library (its optimisers, damaged files) does not end the run."""

from __future__ import annotations

import subprocess
import sys

from hpcdem.core.errors import HpcdemError


def run(module: str, *words: str, sent: str = "", failed: str) -> None:
    """`python -m module words`, with `sent` on its input. HpcdemError `failed`: its last line, or how it ended."""
    done = subprocess.run(
        [sys.executable, "-m", module, *words], input=sent, text=True, capture_output=True, check=False
    )
    if done.returncode:
        told = [line for line in done.stderr.splitlines() if line.strip()]
        why = told[-1].removeprefix("Exception: ") if told else f"it ended with {done.returncode}"
        raise HpcdemError(f"{failed}: {why}")
