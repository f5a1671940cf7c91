"""The run that is disturbed, and what it leaves when nothing happens to it."""

from __future__ import annotations

import json
import shutil
import time
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from faults import runs

SCRIPT = """\
# A small bed settles, is bonded, and is then pushed from the left until bonds break.
START
SET disk off
BOX left -200.0 right 3200.0 bottom -200.0 height 2400.0
WALL id 0 nodes (0.0, 0.0) (3000.0, 0.0) fric 0.2
WALL id 1 nodes (0.0, 1500.0) (0.0, 0.0) fric 0.2
WALL id 2 nodes (3000.0, 0.0) (3000.0, 1500.0) fric 0.2
GEN num 110 rad discrete 60.0 80.0, x (0.0, 3000.0), y (0.0, 1500.0) group bed
PROP density 2400.0 fric 0.1 shear 2.0e9 poiss 0.25 damp 0.5 hertz
HIST id 1 interval 100 kinetic
HIST id 2 interval 100 step
SET dt 0.04 gravity 0.0 -9.8 stepbar 100
SET print 500 save 250
CYC 3000
PROP ebmod 1e8 gbmod 1e8 tstrength 1e6 sstrength 2e6
WALL id 1 xv 1.0
IMPLE wall id 1 xmove 200.0 print 20.0 save 8.0
PLOT hist 2 1
STOP
"""
OTHER = SCRIPT.replace("fric 0.1 shear", "fric 0.3 shear").replace("xmove 200.0", "xmove 240.0")
"""A model of somebody else: other numbers in lines that were carried out early, a later end."""
STEPBAR = 100
LAST = 3000 + 5000
NAME = "push.py"


@dataclass
class Reference:
    """The undisturbed run. data: its output folder; calls: of the operating system, by kind; seconds: of the run."""

    folder: Path
    calls: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def data(self) -> Path:
        return self.folder / "data"

    @property
    def script(self) -> Path:
        return self.folder / NAME

    @cached_property
    def names(self) -> list[str]:
        """Names of all files that a run leaves."""
        ours = [path.name for path in self.data.iterdir() if path.is_file()]
        return sorted(name for name in ours if name not in ("run.json", ".lock"))


def write_script(folder: Path, text: str = SCRIPT) -> Path:
    """The script, in a folder of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    path.write_text(text)
    return path


def undisturbed(folder: Path, text: str = SCRIPT) -> Reference:
    """Run the model to its end. Raises RuntimeError if it does not come there, or bonds neither hold nor break."""
    shutil.rmtree(folder, ignore_errors=True)
    script = write_script(folder, text)
    runs.start(["warmup", "--of", "particles"], 1, folder).end(600.0)  # so that the run can be timed
    began = time.monotonic()
    tally = folder / "calls.json"
    end = runs.start([str(script)], 1, folder, plan={"tally": str(tally)}).end(120.0)
    if end.code != 0:
        raise RuntimeError(f"the model does not run: {end.err[-2000:]}")
    if f"step {LAST} " not in end.out and text == SCRIPT:
        raise RuntimeError(f"the model does not end at step {LAST}: {end.out[-500:]}")
    return Reference(folder, json.loads(tally.read_text()), time.monotonic() - began)
