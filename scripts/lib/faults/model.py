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
BLOCKS = """\
# A jointed block falls onto a fixed one and breaks; the script looks at the model for its way.
pcdc model new
pcdc model gravity (0,-9.81)
pcdc mesh structured (0,0) (1.6,0.3) cells 8 2 group 'base' set 'parts'
pcdc mesh structured (0.5,0.3001) (1.1,0.7001) cells 6 4 group 'stone' set 'parts'
pcdc element c-model mech-iso-e property density 2600 young 1e8 poisson-r 0.25 damp-factor 0.1 friction 30
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 6e4 tensile-s 2e4 gf1 0.05 gf2 0.2 penalty-n 1e9
pcdc node boundary mech-vel-b-c property velocity-x 0 velocity-y 0 range y -0.01 0.01
pcdc node initial velocity (0.4,-3) range y 0.30005 1
pcdc model option energy on
pcdc model time-step value 1e-5
pcdc history create 'fall' node value velocity-y nearest (0.8,0.7) every 50
pcdc history create 'broken' model value broken-joints every 50
pcdc output vtk 'stone' every 2000
turn = 0
while turn < 30:
    pcdc model step [800 if pcdc.energies['kinetic'] > 600.0 else 1000]
    turn += 1
pcdc model step [32000 - pcdc.cycle]
"""
COUPLED = """\
# A bed of discs settles; a jointed block falls into it. A function acts in the middle of commands.
import hpcdem

sand = hpcdem.Simulation(outdir='data/sand')
sand.set(disk='on', gravity=(0.0, -9.81), dt=2e-5, seed=2, stepbar=50, print=500, save=400, energy=100)
sand.box(0.0, 1.0, 0.0, 1.5, kn=2e6, ks=1e6, fric=0.3)
sand.gen_grid([0.04], x=(0.0, 1.0), y=(0.0, 0.33))
sand.prop(density=2000.0, kn=2e6, ks=1e6, fric=0.4, damp=0.2)
sand.hist(1, 100, 'kinetic')
sand.cycle(600)
top = sand.extents()['top']
pcdc model new
pcdc model gravity (0,-9.81)
pcdc mesh structured (0.2,[top + 0.002]) (0.8,[top + 0.202]) cells 6 2 group 'block' set 'domain'
pcdc element c-model mech-iso-e property density 2600 young 1e8 poisson-r 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 6e4 tensile-s 2e4 gf1 0.05 gf2 0.2 penalty-n 1e9
pcdc node initial velocity (0.3,-3)
pcdc history create 'fall' node value velocity-y id 0 every 50
pcdc output vtk 'block' every 700
both = hpcdem.couple(sand, friction=0.5)
seen = []


def look(particles):
    seen.append(particles.kinetic_energy())
    if len(seen) == 5:
        particles.prop(damp=0.0)


sand.every(170, look)
for turn in range(6):
    pcdc model step [600 + 100 * (both.force()[1] > 0.0)]
    if turn == 2:
        sand.delete('x 0 0.1')
pcdc model step [4400 - pcdc.cycle]
"""


@dataclass(frozen=True)
class Model:
    """A run that can be disturbed. key: short name; script: name of its file; text; other: of a model of somebody
    else; kernels: those it needs; last: its last step; every: steps between rows of its series; series: the one by
    which the campaign follows it, below the output folder; ahead: of the steps of checkpoints are those of the series;
    options: of the program."""

    key: str
    script: str
    text: str
    other: str
    kernels: str
    last: int
    every: int
    series: str
    ahead: int = 0
    options: tuple[str, ...] = ()


PARTICLES = Model("particles", "push.py", SCRIPT, OTHER, "particles", 3000 + 5000, 100, "walls.csv")
MODELS = {
    one.key: one
    for one in (
        PARTICLES,
        Model("blocks", "stone.sc", BLOCKS, BLOCKS.replace("gf1 0.05", "gf1 0.06").replace("[32000", "[34000"),
              "blocks", 32000, 1000, "history_fall.csv", options=("--autosave", "0.3")),
        Model("coupled", "fall.sc", COUPLED, COUPLED.replace("fric=0.4, damp", "fric=0.3, damp").replace("[4400",
              "[5000"), "coupled", 600 + 4400, 50, "sand/walls.csv", ahead=600),
    )
}  # fmt: skip
"""By their short names."""


@dataclass
class Reference:
    """The undisturbed run. data: its output folder; calls: of the operating system, by kind; seconds: of the run."""

    folder: Path
    calls: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    model: Model = PARTICLES

    @property
    def data(self) -> Path:
        return self.folder / "data"

    @property
    def script(self) -> Path:
        return self.folder / self.model.script

    @cached_property
    def names(self) -> list[str]:
        """Names of all files that a run leaves, below its folder."""
        return sorted(name for name in files(self.data) if Path(name).name not in ("run.json", ".lock"))


def files(data: Path) -> list[str]:
    """All files of an output folder, by their names below it."""
    try:
        return [path.relative_to(data).as_posix() for path in data.rglob("*") if path.is_file()]
    except OSError:
        return []


def write_script(folder: Path, model: Model = PARTICLES, text: str = "") -> Path:
    """The script, in a folder of its own; text: instead of that of the model."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / model.script
    path.write_text(text or model.text)
    return path


def undisturbed(folder: Path, model: Model = PARTICLES, text: str = "") -> Reference:
    """Run the model to its end. Raises RuntimeError if it does not come there."""
    shutil.rmtree(folder, ignore_errors=True)
    script = write_script(folder, model, text)
    runs.start(["warmup", "--of", model.kernels], 1, folder).end(600.0)  # so that the run can be timed
    began = time.monotonic()
    tally = folder / "calls.json"
    end = runs.start([str(script), *model.options], 1, folder, plan={"tally": str(tally)}).end(120.0)
    if end.code != 0:
        raise RuntimeError(f"the model does not run: {end.err[-2000:]}")
    if f"step {model.last - model.ahead} " not in end.out and not text:
        raise RuntimeError(f"the model does not end at step {model.last - model.ahead}: {end.out[-500:]}")
    return Reference(folder, json.loads(tally.read_text()), time.monotonic() - began, model)
