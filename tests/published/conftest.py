"""Decks of our own that repeat published series at a size for tests, each run once per session and kept.

Lengths in m. Bed: 30 x 3 km of spheres of radius 60 and 80 m (about 6000), the material of Li et al. 2022 and of the
2017 abstract (shear modulus 2.9e9, Poisson's ratio 0.2, density 2500, friction 0.3, bonds of modulus 2e8); its lowest
400 m are the detachment, without bonds.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.conftest import BIN, run
from tests.published import measure

BED = """\
START
SET disk off
SET seed {seed} gentry 2.75
BOX left -50.0 right 30050.0 bottom -50.0 height 9000.0
WALL id 0 nodes (0.0, 0.0) (30000.0, 0.0)
WALL id 1 nodes (0.0, 8000.0) (0.0, 0.0)
WALL id 2 nodes (30000.0, 0.0) (30000.0, 8000.0)
SET dt 0.05
SET gravity 0.0 -9.8
SET print 0
GEN num 60000 rad discrete 60.0 80.0 x (0.0, 30000.0) y (0.0, 7500.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 fric 0.0 damp 0.4 hertz
CYC 4000
DEL range y 3000.0 99999.0
CYC 1000
EXP bed.dat
STOP
"""

PUSH = """\
LOAD bed.dat
SET disk off
BOX left -50.0 right 30050.0 bottom -50.0 height 12000.0
WALL id 0 nodes (0.0, 0.0) (30000.0, 0.0) fric {detachment}
WALL id 1 nodes (0.0, 11000.0) (0.0, 0.0) fric 0.3 xv {speed}
WALL id 2 nodes (30000.0, 0.0) (30000.0, 11000.0) fric 0.3
PROP group rock density 2500.0 shear 2.9e9 poiss 0.2 fric 0.3 damp 0.4 hertz
PROP group weak fric {detachment} range y -100.0 400.0
PROP ebmod 2e8 gbmod 2e8 tstrength {tension} sstrength {cohesion} range group rock
PROP color red range group weak
PROP color yellow range group rock
PROP color lg range y 1000.0 1400.0
PROP color blue range y 1800.0 2200.0
PROP color green range y 2600.0 3400.0
SET dt 0.05
SET gravity 0.0 -9.8
IMPLE wall id 1 xmove {way} print 500.0
STOP
"""

Series = Callable[..., list[measure.Grains]]


def program(folder: Path, name: str, text: str, timeout: float = 1200.0) -> Path:
    """Run a script of ours in its folder on one rank; the folder of its frames."""
    folder.mkdir(parents=True, exist_ok=True)
    script = folder / f"{name}.zdem"
    script.write_text(text)
    command = [sys.executable, str(BIN / "hpcdem"), "--no-figure", str(script)]
    done = run(command, cwd=folder, timeout=timeout)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return folder / "data"


@pytest.fixture(scope="session")
def push(tmp_path_factory: pytest.TempPathFactory) -> Series:
    """`push([dict(seed=31, detachment=0.1, tension=1e7, way=5000.0, speed=2.5), ...])`: the frames of each run, the
    undeformed one first.

    seed: of the bed; detachment: friction of detachment and floor; tension: tensile strength of the bonds [Pa], their
    cohesion is twice that; way [m] and speed [m/s] of the wall. Two runs go side by side where there are two cores; a
    run asked for again is not repeated.
    """
    workers = ThreadPoolExecutor(max_workers=min(2, os.cpu_count() or 1))
    beds: dict[float, Path] = {}
    started: dict[tuple, Future] = {}

    def settle(seed: float) -> Path:
        folder = tmp_path_factory.mktemp("bed")
        program(folder, "bed", BED.format(seed=seed))
        return folder / "bed.dat"

    def one(options: dict[str, float]) -> list[measure.Grains]:
        folder = tmp_path_factory.mktemp("push")
        shutil.copy(beds[options["seed"]], folder)
        text = PUSH.format(cohesion=2.0 * options["tension"], **options)
        data = program(folder, "push", text)
        # The first and the last frame of an IMPLE stand twice, before and after its cycles: one per step is enough.
        return list({g.step: g for g in measure.series(data, ini=True)}.values())

    def ask(runs: list[dict[str, float]]) -> list[list[measure.Grains]]:
        new = sorted({options["seed"] for options in runs} - set(beds))
        beds.update(zip(new, workers.map(settle, new)))
        keys = [tuple(sorted(options.items())) for options in runs]
        for key, options in zip(keys, runs):
            if key not in started:
                started[key] = workers.submit(one, options)
        return [started[key].result() for key in keys]

    return ask
