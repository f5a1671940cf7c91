"""The recipes of CONTRIBUTING, each followed to the letter in a copy of the package: the places that it names exist,
nothing else has to be touched, and what was added works."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tests.conftest import ROOT

PACKAGE = ROOT / "hpcdem"


@dataclass(frozen=True)
class Recipe:
    """edits: (file of the package, line that is there, what stands after it; or in its place, if it begins with =);
    files: new ones; program: what is run with the copy, AssertionError if what was added does not act."""

    edits: list[tuple[str, str, str]]
    program: str
    files: dict[str, str] = field(default_factory=dict)


SCRIPT = """
import io, sys
from pathlib import Path
import numpy as np
from hpcdem.core.comm import SerialComm
from hpcdem.lang.zdem.execute import Interpreter
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.runtime.progress import Log

def play(*lines, begin=("START", "SET dt 1e-3 disk on")):
    sim = Simulation(SerialComm(), 1, Path("data"), Log(0, io.StringIO()))
    text = "\\n".join([*begin, *lines]) + "\\n"
    Interpreter(parse_text(text, "script.py")).run(sim)
    return sim

BALLS = "BALL id 0 rad 1.0 x 0.0 y 0.0", "BALL id 1 rad 1.0 x 5.0 y 0.0", "PROP density 1e3 kn 1e6 ks 1e6 xv 2.0"
"""

SALT = """
from hpcdem.physics.fdem.properties import ELEMENT, Model, Property
from hpcdem.physics.fields import Kind

TRANSPORT = Model("salt_transport", ELEMENT, "salt in pores",
                  (Property("salt_diffusivity", "m2/s", "diffusivity of salt", low_itself=False),))
KIND = Kind(name="salt", unit="1", doc="mass of salt over that of the rock", amount="kg/m", flux="kg/(m2 s)",
            transfer="kg/(m2 s)", model=TRANSPORT, load="Salt")
"""
SALTY = """
import numpy as np
from hpcdem.physics.field.diffusing import Diffusing
from hpcdem.physics.salt.properties import TRANSPORT

class Salt(Diffusing):
    name = quantity = word = kind_of_model = "salt"
    kernel_kind, unstressed, model = "heat", "salt_unstressed", TRANSPORT

    def _capacities(self):
        return np.array([0.0, *np.ones(len(self.rows))])

    def _conductivities(self, elements):
        k = 2000.0 * self.column("salt_diffusivity")[self.row[elements]]
        return np.column_stack([k, k, 0.0 * k])
"""
DECAY = """
from dataclasses import asdict, dataclass
from typing import ClassVar
from hpcdem.numerics.exact_sum import exact_sum

@dataclass
class Decay:
    rate: float
    name: ClassVar[str] = "decay"
    fields: ClassVar = {"activity": ("Bq", "activity", 1.0)}
    energies: ClassVar = ()

    def parameters(self): return asdict(self)
    def diagnostics(self): return {"activity": ("Bq", self.total)}
    def total(self, sim): return exact_sum(sim.particles["activity"].copy(), sim.comm)
    def prepare(self, sim): pass
    def stable_time_step(self, sim): return 1.0 / self.rate
    def advance(self, sim): sim.particles["activity"][:] *= 1.0 - self.rate * sim.clock.dt
"""

PLIANT = """
from hpcdem.physics.fdem.six import kernels
from hpcdem.physics.fdem.six.elements import SixNodes

class Pliant(SixNodes):
    def _make_constants(self, points):
        super()._make_constants(points)
        self.c[:, [kernels.LAMBDA, kernels.TWO_MU]] *= 0.5
"""

WIND = '''
import numpy as np
from hpcdem.physics.fdem.surface_loads import SurfaceLoad

class Wind(SurfaceLoad):
    """A force along x on each corner [N/m]."""
    name = "wind"

    def __init__(self, blocks, force): self.blocks, self.force = blocks, force
    def corners(self, blocks): return blocks.the_mesh().cells[blocks.number[blocks.owned]] >= 0
    def add_to(self, applied): applied[self.blocks.owned, ::2] += self.force
    def storage_rebuilt(self): pass
    def mesh_replaced(self): pass
'''

BLOCK = '''
from dataclasses import dataclass
from typing import ClassVar
from hpcdem.cases.base import Case, quantity

@dataclass(frozen=True)
class Fall:
    """speed: at the end [m/s]."""
    speed: float

class FallingBlock(Case):
    """A block that falls."""
    name: ClassVar[str] = "falling-block"
    title: ClassVar[str] = "A block that falls"
    result: ClassVar[type] = Fall
    gravity: float = quantity(9.81, "m/s2", "gravity", gt=0)

    def model(self): return """
pcdc model new
pcdc mesh structured (0,0) (1,1) cells 1 1
pcdc element c-model mech-iso-elastic property den 2000 young 1e9 poisson-ratio 0.25
pcdc model option dynamic on
pcdc model gravity (0,[-gravity])
"""
    def loading(self): return """
pcdc model time-step value 1e-5
pcdc model step 100
speed = -pcdc.values('node', 'velocity-y').mean()
"""
'''

RECIPES = {
    "a pair law": Recipe(
        [
            ("physics/dem/kernels/laws.py", "LINEAR, HERTZ = 0, 1", "=LINEAR, HERTZ, CONICAL = 0, 1, 2"),
            (
                "physics/dem/kernels/laws.py",
                "        return a * s * u, b * s",
                "    if model == CONICAL:\n        return a * u * u, b * u",
            ),
            (
                "physics/dem/kernels/laws.py",
                "        return 1.5 * a * math.sqrt(two_rt * u)",
                "    if model == CONICAL:\n        return 2.0 * a * u",
            ),
            (
                "physics/dem/kernels/laws.py",
                "    return 0.4 * fn * u if model == HERTZ else 0.5 * fn * u",
                "=    if model == CONICAL:\n        return fn * u / 3.0\n"
                "    return 0.4 * fn * u if model == HERTZ else 0.5 * fn * u",
            ),
            (
                "physics/dem/kernels/contacts.py",
                "                table[i, j] = laws.LINEAR, kn, ks, mu",
                "=                table[i, j] = laws.CONICAL, kn, ks, mu",
            ),
        ],
        SCRIPT
        + """
from hpcdem.physics.dem import budget, diagnostics
sim = play("BALL id 0 rad 1.0 x 0.0 y 0.0", "BALL id 1 rad 1.0 x 1.99 y 0.0", "PROP density 1e3 kn 4e6 ks 4e6",
           "SET energy 1", "FIX x y spin", "CYC 2")
(row,), _ = diagnostics.contact_rows(sim)
assert abs(row[diagnostics.FN] / (2e6 * 0.01**2) - 1.0) < 1e-9, row
assert abs(budget.stored_energy(sim) / (2e6 * 0.01**3 / 3.0) - 1.0) < 1e-9
""",
    ),
    "a command": Recipe(
        [
            (
                "lang/zdem/table.py",
                '    Command("FREE", "Revokes FIX.", options=_DEGREES, ranged=True, '
                'example=("FREE x RANGE group base",)),',
                '    Command("HALT", "Velocities become zero.", ranged=True, example=("HALT RANGE group base",),\n'
                '            does="properties.halt"),',
            ),
            (
                "commands/dem/properties.py",
                "def free(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:",
                "=def halt(sim, where=None):\n    for name in ('vx', 'vy', 'spin'):\n"
                "        sim.particles[name][chosen(sim, where)] = 0.0\n    sim.check_soon()\n\n\n"
                "def free(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:",
            ),
        ],
        SCRIPT
        + """
sim = play(*BALLS, "HALT RANGE id 1", "CYC 10")
assert sim.particles["vx"][np.argsort(sim.particles["gid"])].tolist() == [2.0, 0.0]
""",
    ),
    "a command of PCDC": Recipe(
        [
            (
                "lang/pcdc/table.py",
                '    Command("mod{el} g{ravity}", "Sets gravity from now on.", ("pcdc model gravity (0,-9.81)",),',
                '=    Command("mod{el} moon", "Gravity of the moon.", '
                '("pcdc model moon",), does="settings.moon"),\n'
                '    Command("mod{el} g{ravity}", "Sets gravity from now on.", '
                '("pcdc model gravity (0,-9.81)",),',
            ),
            (
                "commands/fdem/settings.py",
                "def gravity(project: Project, gravity: tuple[float, ...]) -> None:",
                "=def moon(project):\n    gravity(project, (0.0, -1.62))\n\n\n"
                "def gravity(project: Project, gravity: tuple[float, ...]) -> None:",
            ),
        ],
        """
from pathlib import Path
from hpcdem.commands.fdem import Project
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.fdem.simulation import Blocks
project = Project(Blocks(outdir=Path("data")), Path("."), Path("data"))
interpreter = Interpreter(project)
interpreter.run(interpreter.read('''
pcdc mesh structured (0,0) (1,1) cells 1 1
pcdc element c-model mech-iso-elastic property den 2000 young 1e9 poisson-ratio 0.25
pcdc model option dynamic on
pcdc model moon
pcdc model time-step value 1e-5
pcdc model step 100
''', "falls.sc"))
speed = project.blocks.v[project.blocks.owned].reshape(-1, 2)[:, 1].min()
assert abs(speed / (-1.62e-3) - 1.0) < 0.02, speed
""",
    ),
    "a column of frames": Recipe(
        [
            (
                "physics/dem/diagnostics.py",
                '    columns["color"], columns["group"] = p["color"].astype(np.int32), p["group"].astype(np.int32)',
                '    columns["speed"] = np.hypot(p["vx"], p["vy"])',
            )
        ],
        SCRIPT
        + """
from hpcdem.io.frames import read_frame
sim = play(*BALLS, "SET print 5", "CYC 5")
frame = read_frame(sorted(Path("data").glob("*.vtkhdf"))[-1])
assert frame.tables["particles"].columns["speed"].tolist() == [2.0, 2.0]
""",
    ),
    "a property of the material": Recipe(
        [
            (
                "core/material.py",
                '    ks: Annotated[Value, Property("shear stiffness of the linear contact", "N/m", low=0.0)]',
                '    porosity: Annotated[Value, Property("share of voids", low=0.0, high=1.0, default="0")]',
            ),
        ],
        SCRIPT
        + """
from hpcdem.io.frames import read_frame
sim = play(*BALLS, "PROP porosity 0.3 RANGE id 1", "SET print 5", "CYC 5", "SAV half.sav")
sim = play("CYC 5", begin=["RESTORE half.sav"])
particles = read_frame(sorted(Path("data").glob("*.vtkhdf"))[-1]).tables["particles"].columns
assert particles["porosity"].tolist() == [0.0, 0.3]
try:
    play(*BALLS, "PROP porosity 1.3")
except Exception as error:
    assert "a number from 0 to 1" in str(error), error
else:
    raise AssertionError("1.3 was taken")
""",
    ),
    "an output": Recipe(
        [
            (
                "core/outputs.py",
                '    "ps": Output("a vector picture", ("all_<step>.ps",), 40, ("R", "R")),',
                '    "list": Output("a list of places", ("all_<step>.txt",), 40),',
            ),
            ("physics/dem/settings.py", "    vtk: int = 0", "    list: int = 0"),
            (
                "commands/dem/output.py",
                '        """`all_<step>.ps`."""',
                '        with self.sim.timers("output"):\n'
                '            self._write(write_ps, ".ps")\n            _under_way.go()\n\n'
                '    def write_list(self) -> None:\n        """Places."""\n'
                '        np.savetxt(self._path(".txt"), self.frame.tables["particles"].columns["x"])\n\n'
                "    def _never(self) -> None:",
            ),
        ],
        SCRIPT
        + """
play(*BALLS, "SET list 5", "CYC 10")
assert sorted(p.name for p in Path("data").glob("*.txt")) == ["all_0000000005.txt", "all_0000000010.txt"]
assert np.allclose(np.loadtxt("data/all_0000000010.txt"), [0.02, 5.02], rtol=0.0, atol=1e-12)
play(*BALLS, "WALL id 0 nodes (-9.0, -9.0) (-9.0, 9.0)", "WALL id 0 xv 1.0", "IMPLE wall id 0 xmove 0.02 list 0.01")
assert len(list(Path("data").glob("*.txt"))) == 3  # at step 20 as well
""",
    ),
    "a history": Recipe(
        [
            (
                "commands/dem/output.py",
                '    "kinetic": ("J", diagnostics.kinetic_energy),',
                '    "discs": ("1", lambda sim: float(sim.count(len(sim.particles)))),',
            ),
            (
                "lang/zdem/table.py",
                '            Option("kinetic", "record the kinetic energy", source="S"),',
                '            Option("discs", "record their number", source="X"),',
            ),
        ],
        SCRIPT
        + """
play(*BALLS, "HIST id 3 interval 5 discs", "CYC 5")
assert Path("data/hist_3.csv").read_text().splitlines()[-1].endswith(",2.0")
""",
    ),
    "a field on blocks": Recipe(
        [("physics/fields.py", 'FIELDS = ("moisture",)', '=FIELDS = ("moisture", "salt")')],
        """
import hpcdem
sim = hpcdem.Simulation()
sim.mesh.structured((0, 0), (1.0, 0.1), (10, 1), diagonal="right")
sim.option(mechanical=False)
sim.elements.model("mech-iso-elastic", density=2000, young=1e7, poisson_ratio=0.3)
sim.elements.model("salt-transport", salt_diffusivity=1e-6)
sim.nodes.initial_field("salt", 0.2)
sim.nodes.field("salt", 0.1, where="x 0 0")
sim.histories.create("s", "node", "salt", nearest=(1.0, 0.0))
sim.step(50)
found = sim.field_account("salt")
assert found["given"] < 0.0 and found["relative"] < 1e-12, found
salt = sim.nodes["salt"]
assert salt.min() == 0.1 < salt.max() < 0.2, salt
""",
        {"physics/salt/__init__.py": "", "physics/salt/properties.py": SALT, "physics/salt/model.py": SALTY},
    ),
    "an element of blocks": Recipe(
        [
            (
                "physics/fdem/local.py",
                "from hpcdem.physics.fdem.six.elements import SixNodes",
                "=from hpcdem.physics.fdem.pliant.elements import Pliant as SixNodes",
            )
        ],
        """
import hpcdem
sim = hpcdem.Simulation()
sim.mesh.structured((0, 0), (1.0, 1.0), (1, 1))
sim.mesh.quadratic()
sim.option(dynamic=False, large_strain=False)
sim.elements.model("mech-iso-elastic", density=2000, young=1e9, poisson_ratio=0.0)
sim.nodes.velocity(vx=0, vy=0, where="y 0 0")
sim.faces.stress(normal=-1e6, where="y 1 1")
sim.solve(elastic=True)
top = sim.nodes["displacement-y"].min()
assert abs(top / -2e-3 - 1.0) < 1e-6, top
assert abs(sim.elements["stress-yy"] / -1e6 - 1.0).max() < 1e-6
""",
        {"physics/fdem/pliant/__init__.py": "", "physics/fdem/pliant/elements.py": PLIANT},
    ),
    "physics on particles": Recipe(
        [
            (
                "physics/particle_physics.py",
                'PHYSICS: Mapping[str, Callable[[], type[ParticlePhysics]]] = {"diffusion": _diffusion}',
                '=PHYSICS: Mapping[str, Callable[[], type[ParticlePhysics]]] = {"diffusion": _diffusion, '
                '"decay": lambda: __import__("hpcdem.physics.decay", fromlist=["Decay"]).Decay}',
            )
        ],
        SCRIPT
        + """
from hpcdem.io.frames import read_frame
from hpcdem.physics.particle_physics import PHYSICS
from hpcdem.commands import dem
sim = play("SET print 5")
sim.add_physics(PHYSICS["decay"]()(rate=10.0))
for gid in range(2):
    dem.particles.ball(sim, gid, 5.0 * gid, 0.0, 1.0)
dem.properties.prop(sim, density=1e3, kn=1e6)
dem.history.hist(sim, 1, 1, "activity")
dem.cycles.cycle(sim, 5)
rows = Path("data/hist_1.csv").read_text().splitlines()
assert abs(float(rows[-1].split(",")[-1]) - 2.0 * 0.99**5) < 1e-12, rows
frame = read_frame(sorted(Path("data").glob("*.vtkhdf"))[-1])
assert abs(frame.tables["particles"].columns["activity"] - 0.99**5).max() < 1e-12
""",
        {"physics/decay.py": DECAY},
    ),
    "a surface load": Recipe(
        [
            (
                "physics/fdem/surface_loads.py",
                'ORDER = ("discs", "fluid", "proppant", "heat", *FIELDS, "bolts", "liners", "free_field", "water")',
                '=ORDER = ("discs", "fluid", "proppant", "heat", *FIELDS, "bolts", "liners", "free_field", "water", '
                '"wind")',
            )
        ],
        """
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.wind import Wind
from tests.blocks.support import model, rectangle
blocks = model(rectangle(2, 2, 1.0, 1.0))
blocks.time_step(value=1e-5)
blocks.surface_loads.add(Wind(blocks, 27.0))
for _ in range(10):
    blocks.step()
mean = blocks.v[blocks.owned].reshape(-1, 2)[:, 0].max()
assert mean > 0.0 and abs(blocks.v[blocks.owned].reshape(-1, 2)[:, 1]).max() < mean
""",
        {"physics/wind.py": WIND},
    ),
    "a ready-made model": Recipe(
        [
            (
                "cases/__init__.py",
                '    "triaxial": "Triaxial", "tunnel-face": "TunnelFace",',
                '    "falling-block": "FallingBlock",',
            )
        ],
        """
import re, subprocess, sys
from pathlib import Path
from hpcdem.commands.fdem import Project
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.cases import FallingBlock
project = Project(Blocks(outdir=Path("data")), Path("."), Path("data"))
interpreter = Interpreter(project)
interpreter.run(interpreter.read(FallingBlock(gravity=4.0).script(), "case.sc"))
assert abs(interpreter.namespace["speed"] / 4.0e-3 - 1.0) < 0.02, interpreter.namespace["speed"]
subprocess.run([sys.executable, "-m", "hpcdem", "case", "falling-block", "--gravity", "2"], check=True)
said = Path("falling-block.sc").read_text()
assert re.search(r"^gravity = 2(.0)? +# m/s2", said, re.M), said
""",
        {"cases/falling_block.py": BLOCK},
    ),
}


STORE = "from hpcdem.runtime import kept\nkept.install()\n"
"""What a program of the package does first: kernels that a recipe does not reach come from the store."""


def copy_of_the_package(folder: Path) -> Path:
    """Links to its files, and to what Python has made of them; what is changed becomes a file."""
    for file in PACKAGE.rglob("*"):
        if file.is_file():
            link = folder / file.relative_to(ROOT)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(file)
    return folder / PACKAGE.name


QUICK = ("a command of PCDC",)
"""The others compile what is made of their changed modules."""


def test_the_places_exist() -> None:
    """Of all recipes: the lines that are changed."""
    for name, recipe in RECIPES.items():
        for file, line, _ in recipe.edits:
            assert (PACKAGE / file).read_text().count(f"{line}\n") == 1, f"{name}: {file}: {line}"


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow, pytest.mark.nightly] * (name not in QUICK)) for name in RECIPES],
)
def test_a_recipe_is_complete(tmp_path: Path, name: str) -> None:
    recipe, package = RECIPES[name], copy_of_the_package(tmp_path)
    for file, line, text in recipe.edits:
        before = (package / file).read_text()
        assert before.count(f"{line}\n") == 1, f"{file}: {line}"
        (package / file).unlink()
        after = f"{text[1:]}\n" if text.startswith("=") else f"{line}\n{text}\n"
        (package / file).write_text(before.replace(f"{line}\n", after))
    for file, text in recipe.files.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(text)
    env = dict(os.environ, PYTHONPATH=f"{tmp_path}:{ROOT}", PYTHONDONTWRITEBYTECODE="1")
    command = [sys.executable, "-c", STORE + recipe.program]
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
