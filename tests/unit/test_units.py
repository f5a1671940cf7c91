"""Declared units: values that are unlikely in them are warned of, what is written has their names, nothing changes."""

from __future__ import annotations

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest

from hpcdem.commands.dem import output, particles, properties, settings
from hpcdem.commands.fdem import charts, checkpoints, coupling, histories
from hpcdem.core import units
from hpcdem.core.errors import CommandError
from hpcdem.lang.zdem.execute import Interpreter
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem.settings import Settings
from hpcdem.physics.dem.simulation import Simulation
from tests.pcdc.fake import Bench
from tests.tables import each


class Told:
    """A log that keeps its warnings, each once."""

    def __init__(self):
        self.warned = {}

    def warn(self, text):
        self.warned[text] = text

    def warn_once(self, key, text):
        self.warned.setdefault(key, text)

    def info(self, text): ...

    def set_interval(self, explicit): ...


@each(
    ("system", "name", "unit", "value", "said"),
    [
        ("si", "density", "kg/m3", 2.7, "looks like g/cm3; x 1000 makes it 2700"),
        ("si", "density", "kg/m3", 2.7e-9, "looks like t/mm3; x 1e+12 makes it 2700"),
        ("si", "density", "kg/m3", 2700.0, ""),
        ("mm-mpa-s", "density", "kg/m3", 2.7e-9, ""),
        ("mm-mpa-s", "density", "kg/m3 or kg/m2", 2700.0, "looks like kg/m3; x 1e-12 makes it 2.7e-09"),
        ("km-mpa-s", "density", "kg/m3", 2700.0, ""),
        ("si", "young", "Pa", 30.0, "looks like GPa; x 1e+09 makes it 3e+10"),
        ("si", "young", "Pa", 3e4, "looks like MPa; x 1e+06 makes it 3e+10"),
        ("mm-mpa-s", "young", "Pa", 3e10, "looks like Pa; x 1e-06 makes it 30000"),
        ("mm-mpa-s", "young", "Pa", 3e4, ""),
        ("si", "cohesion", "Pa", 5.0, "looks like MPa; x 1e+06 makes it 5e+06"),
        ("si", "cohesion", "Pa", -100.0, ""),
        ("km-mpa-s", "rad", "m", 60.0, "looks like m; x 0.001 makes it 0.06"),
        ("km-mpa-s", "x", "m", 61.0, ""),
        ("km-mpa-s", "x", "m", 61000.0, "looks like m; x 0.001 makes it 61"),
        ("mm-mpa-s", "gravity", "m/s2", -9.81, "looks like m/s2; x 1000 makes it -9810"),
        ("mm-mpa-s", "gravity", "m/s2", -9810.0, ""),
        ("si", "specific-heat", "J/(kg K)", 0.8, "looks like kJ/(kg K); x 1000 makes it 800"),
        ("si", "density", "kg/m3", 1e30, "expected 50 to 2.5e+04"),
        ("si", "density", "kg/m3", 0.0, ""),
        ("si", "young", "Pa", float("inf"), ""),
        ("si", "damp", "1", 1e30, ""),
    ],
)  # fmt: skip
def test_doubts(system, name, unit, value, said):
    found = units.doubt(units.system(system), name, unit, value)
    assert said in found and bool(found) == bool(said)


@pytest.mark.parametrize("name", units.SYSTEMS)
def test_systems_are_consistent(name):
    """A newton is a unit of mass times acceleration in each, a stress is that over an area, an energy times a length;
    the symbols say the same sizes."""
    system = units.system(name)
    sizes = {"m": 1.0, "mm": 1e-3, "km": 1e3, "kg": 1.0, "t": 1e3, "Mt": 1e9, "Pa": 1.0, "MPa": 1e6, "N": 1.0,
             "TN": 1e12, "J": 1.0, "mJ": 1e-3, "PJ": 1e15, "W": 1.0, "mW": 1e-3, "PW": 1e15}  # fmt: skip
    powers = {"m": (1, 0, 0), "kg": (0, 1, 0), "Pa": (-1, 1, -2), "N": (1, 1, -2), "J": (2, 1, -2), "W": (2, 1, -3)}
    for symbol, of in powers.items():
        assert sizes[system.label(symbol)] == pytest.approx(system.size(of)), symbol


@pytest.mark.parametrize("kind", units.KINDS, ids=lambda kind: kind.name)
def test_rows_of_the_table(kind):
    """What is usual is plausible, and a unit that is meant is one that could be."""
    assert 0.0 < kind.low < kind.usual < kind.high
    assert any(size == 1.0 for _, size in kind.meant)
    name = kind.names[0] if kind.names else "x"
    assert units.kind_of(name, kind.unit) is kind
    for system in units.SYSTEMS.values():
        size = system.size(kind.powers)
        assert units.doubt(system, name, kind.unit, kind.usual / size) == ""
        assert units.doubt(system, name, kind.unit, 2.0 * kind.high / size) != ""


def test_labels():
    of = {name: units.label(name, "W/(m2 K)") for name in ("", *units.SYSTEMS)}
    assert of == {"": "W/(m2 K)", "si": "W/(m2 K)", "mm-mpa-s": "mW/(mm2 K)", "km-mpa-s": "PW/(km2 K)"}
    assert units.label("mm-mpa-s", "kg/m3") == "t/mm3" and units.label("mm-mpa-s", "Pa s") == "MPa s"


def zdem(tmp_path, text):
    sim = Simulation(outdir=tmp_path, log=Told())
    script = parse_text(f"START\n{text}", "x.py")
    for index in range(len(script.statements)):
        Interpreter(script).carry_out(sim, index)
    return sim


WALL_AND_BALL = "BALL id 0 x 1 y 1 rad 0.5\n"


def test_zdem_script_is_warned_once_per_property(tmp_path):
    text = WALL_AND_BALL + "PROP density 2.7 fric 0.3 kn 1e7 ks 1e7\nPROP density 2.6\nSET gravity 0 -9.8\n"
    assert zdem(tmp_path, text).log.warned == {}, "nothing was declared"
    sim = zdem(tmp_path, "SET units si\n" + text)
    assert list(sim.log.warned) == ["units of density"]
    assert sim.log.warned["units of density"].startswith("units SI: density 2.7 kg/m3 is an unlikely density: looks")
    assert sim.materials.rows["density"].max() == 2.7, "no value is changed"
    mm = zdem(tmp_path, "SET units mm-MPa-s gravity 0 -9.8\n" + text.replace("2.7", "2.7e-9").replace("2.6", "2.6e-9"))
    assert set(mm.log.warned) == {"units mm-mpa-s", "units of gravity"}
    assert (mm.settings.gx, mm.settings.gy) == (0.0, -9.8)


def test_histories_of_particles_have_the_units(tmp_path):
    sim = zdem(tmp_path, WALL_AND_BALL + "HIST id 1 interval 1 kinetic\n")
    assert output.unit_of(sim, "kinetic") == "J"
    settings.set_option(sim, "units", "mm-MPa-s")
    assert output.unit_of(sim, "kinetic") == "mJ" and output.unit_of(sim, "time") == "s"
    assert any("before this line" in text for text in sim.log.warned.values()), "there is a particle already"


def test_another_system_is_refused(tmp_path):
    sim = zdem(tmp_path, "SET units SI\nSET units si\n")
    with pytest.raises(CommandError, match="already uses the units SI"):
        settings.set_option(sim, "units", "mm-mpa-s")
    with pytest.raises(CommandError, match="expected one of SI, mm-MPa-s, km-MPa-s, got cgs"):
        settings.set_option(sim, "units", "cgs")
    particles.start(sim)
    assert sim.settings.units == ""
    properties.prop(sim, density=2.7)
    assert sim.log.warned == {}


ROCK = (
    "pcdc model units {}\npcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right\n"
    "pcdc element c-model mech-iso-elastic density {} young {} poisson-ratio 0.25\npcdc model gravity (0,{})\n"
)


def warnings(bench):
    return [line for line in bench.project.log.lines if line.startswith("warning: units")]


def test_pcdc_script(bench):
    bench(ROCK.format("SI", 2700, 3e10, -9.81))
    assert warnings(bench) == [] and bench.project.units == "si"
    bench("pcdc model new\n" + ROCK.format("SI", 2.7, 30, -9.81))
    assert [line.split(":")[2].split()[0] for line in warnings(bench)] == ["density", "young"]
    assert "x 1000 makes it 2700" in warnings(bench)[0] and "looks like GPa" in warnings(bench)[1]


def test_labels_and_checkpoint_of_blocks(bench, tmp_path):
    bench(ROCK.format("mm-MPa-s", 2.7e-9, 3e4, -9810) + "pcdc history create 'u' node value displacement-x id 3\n"
          "pcdc history create 's' element value stress-yy id 1\npcdc model step 3\n")  # fmt: skip
    project = bench.project
    histories.export(project, "h.csv", ())
    assert (project.outdir / "h.csv").read_text().splitlines()[0] == (
        "step,time [s],u displacement_x [mm],s stress_yy [MPa]"
    )
    assert charts._named(project, "s") == "s: stress yy [MPa]"
    state = json.loads(json.dumps(checkpoints._state(project)))
    project.units = ""
    checkpoints._take(project, state)
    assert project.units == "mm-mpa-s"
    state.pop("units")
    checkpoints._take(project, state)
    assert project.units == "", "checkpoints of versions before"


def test_blocks_and_particles_of_other_units_do_not_touch(bench, tmp_path):
    bench.project.units = "mm-mpa-s"
    others = SimpleNamespace(outdir=tmp_path / "others", settings=Settings(units="si"))
    with pytest.raises(CommandError, match="units of the blocks are mm-MPa-s, those of the particles SI"):
        coupling.couple(bench.project, others)


PROGRAM = """
import hpcdem
sim = hpcdem.Simulation()
sim.set(units="km-MPa-s")
sim.ball(1.0, 1.0, 60.0)
sim.prop(density=2500.0, kn=1.0)
sim.set(gravity=(0.0, -9.8))
sim.units("SI")
sim.mesh.structured((0, 0), (4, 2), cells=(4, 2))
sim.elements.model("mech-iso-elastic", density=2.7, young=3e10, poisson_ratio=0.25)
"""


def test_python_program(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    for text in ("rad 60 km is an unlikely radius: looks like m; x 0.001", "gravity -9.8 km/s2", "looks like g/cm3"):
        assert said.count(text) == 1, said
    assert said.count("unlikely") == 3, said


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


# -- prefixes ------------------------------------------------------------------------------------------------------


@each(
    ("value", "unit", "text"),
    [
        (2.5e6, "Pa", "2.5 MPa"), (-3.2e4, "Pa", "-32 kPa"), (3e10, "Pa", "30 GPa"), (0.02, "Pa", "0.02 Pa"),
        (999.996, "Pa", "1 kPa"), (0.0, "Pa", "0 Pa"), (-0.0, "m", "0 m"), (float("inf"), "s", "inf s"),
        (0.012, "m", "12 mm"), (4.2e-6, "m", "4.2 µm"), (12e3, "m", "12 km"), (2.5e-3, "m/s", "2.5 mm/s"),
        (1.5e6, "N/m", "1.5 MN/m"), (2e3, "N m", "2 kN m"), (1e-3, "Pa s", "0.001 Pa s"), (5e-4, "m3/s", "500 mL/s"),
        (1e8, "s", "3.169 years"), (7200.0, "s", "2 h"), (59.0, "s", "59 s"), (3.2e-6, "s", "3.2 µs"),
        (2650.0, "kg/m3", "2650 kg/m3"), (9.81, "m/s2", "9.81 m/s2"), (1e-5, "1/K", "1e-05 1/K"), (12.0, "", "12"),
        (3e-4, "m2", "300 mm2"), (300.0, "K", "300 K"), (1e22, "J", "1e+04 EJ"),
    ],
)  # fmt: skip
def test_values_are_written_as_people_write_them(value, unit, text):
    assert units.with_prefix(value, unit) == text


def test_values_of_a_declared_system_keep_its_units():
    assert units.with_prefix(2.5, "Pa", system="mm-mpa-s") == "2.5 MPa"
    assert units.with_prefix(12.0, "m", system="si") == "12 m" and units.with_prefix(0.5, "N", system="si") == "500 mN"


def test_several_values_share_the_unit_of_the_largest():
    assert units.scale(3.2e7, "Pa") == (1e6, "MPa") and units.scale(0.0, "Pa") == (1.0, "Pa")
    for unit in ("Pa", "N/m", "m", "m/s", "m2", "m3", "s", "kg", "m3/s", "J/m2", "W/(m K)"):
        steps = units.ladder(unit)
        assert (1.0, unit) in steps and [size for size, _ in steps] == sorted(size for size, _ in steps)


def test_titles_are_stamped_with_step_and_time():
    assert units.stamped("step {step}, {time} s", 7, 2.5e-4) == "step 7, 250 µs"
    assert units.stamped("{time} s", 7, 1e8) == "3.16881 years" and units.stamped("t={time}", 7, 1e8) == "t=1e+08"
