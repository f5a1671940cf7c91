"""Runs of the workers of blocks and of both, and the comparison of what they wrote."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.conftest import Launcher

THREADS = {"NUMBA_NUM_THREADS": "3", "OMP_WAIT_POLICY": "PASSIVE"}
"""More threads than cores must not wait actively for each other."""


def alone(worker: Path, kind: str, steps: int, save_at: int, folder: Path) -> Path:
    """The run on one rank with one thread, `alone.npz`, with a checkpoint from the middle of it, `middle.sav`."""
    run = Launcher().python(1, worker, kind, 1, steps, "alone.npz", save_at, "middle.sav", cwd=folder)
    assert run.returncode == 0, run.stderr[-2000:]
    return folder


def equal(launch, worker: Path, kind: str, steps: int, folder: Path, ranks: int, threads: int, *more: object) -> Path:
    """The same on other ranks and threads; more: `resume` and a checkpoint. Returns what it wrote, which is the same to
    the last bit."""
    out = folder / f"{'again' if more else 'r'}{ranks}t{threads}.npz"
    run = launch.python(ranks, worker, kind, threads, steps, out.name, *more, cwd=folder, env=THREADS)
    assert run.returncode == 0, run.stderr[-2000:]
    same(folder / "alone.npz", out)
    return out


def same(a: Path, b: Path) -> None:
    """All arrays are equal, but `about`."""
    with np.load(a) as one, np.load(b) as two:
        assert set(one.files) == set(two.files)
        for name in one.files:
            if name != "about":
                assert np.array_equal(one[name], two[name], equal_nan=True), name
