"""Whole scripts in PCDC's words, those of docs/from_pcdc.md, have the bits of the same models in hpcdem's words."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hpcdem.lang.pcdc import check
from tests.conftest import ROOT
from tests.pcdc.test_time import Rock

PAGE = ROOT / "docs" / "from_pcdc.md"
_SCRIPT = re.compile(r"(.+?)\n.*?^```pcdc\n(.*?)^```", re.MULTILINE | re.DOTALL)
SCRIPTS = dict(one.groups() for part in PAGE.read_text("utf-8").split("\n## ") if (one := _SCRIPT.match(part)))
FLUID = (
    "fluid-density 1000 fluid-bulk {bulk} viscosity 1e-6 aperature-initial {a} aperature-minumum {least} "
    "aperature-maximum {most}\n"
)
TWINS = {
    "Compression of a block": """\
pcdc mesh structured (0,0) (2,1) cells 8 4 type quad
pcdc element c-model mechanical-iso-elastic property density 2500 young 2e9 poisson-ratio 0.25
pcdc node boundary mechanical-velocity-boundary-condition velocity-y 0 range y 0 0
pcdc node boundary mechanical-velocity-boundary-condition velocity-x 0 range x 0 0
pcdc element-face boundary m-s-b-c stress-normal -1e6 range y 1 1
pcdc model option dynamic off
pcdc model solve ratio 1e-6
""",
    "A specimen that splits": """\
pcdc mesh structured (0,0) (0.04,0.08) cells 4 8 type tri
pcdc element c-model mech-iso-elastic property density 2500 young 30e9 poisson-ratio 0.2 damp-factor 0.2
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 5e6 tensile-strength 1e6 gf1 5 gf2 50 penalty-normal \\
     3e11 penalty-shear 3e11 penalty-overlay 3e11
pcdc table create 'pull' values (0,0) (2e-5,0.2) (1,0.2)
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc node boundary mech-vel-b-c velocity-y table 'pull' range y 0.08 0.08
pcdc model time-step value 1e-7
pcdc model solve time 1.2e-4
""",
    "A slope with an excavation and water": """\
pcdc geometry create polygon (4,2) (8,2) (8,4) (4,4) as-layer 'cut'
pcdc mesh structured (0,0) (8,4) cells 16 8 type tri
pcdc element c-model mech-m-c property density 2000 young 5e7 poisson-ratio 0.3 friction 25 cohesion 2e4 tensile 5e3
pcdc element group 'cut' range geometry 'cut'
pcdc model gravity (0,-9.8)
pcdc element initial stress-yy -78400 gradient (0,19600) stress-xx -33600 gradient (0,8400)
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 8 8
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc model option dynamic off
pcdc model solve cycles 400 ratio 1e-4
pcdc node reset displacement
pcdc element c-model null range group 'cut'
pcdc geometry create polyline (4,3) (8,3) as-layer 'lake'
pcdc element water surface 'lake' density 1000
pcdc model solve cycles 300
""",
    "A dam with seepage": f"""\
pcdc mesh structured (0,0) (4,3) cells 8 6 type tri
pcdc element c-model mech-iso-elastic property density 2400 young 20e9 poisson-ratio 0.2
pcdc face-joint c-model hydr-p-m property {FLUID.format(bulk="2e7", a="5e-4", least="1e-4", most="1e-3")}
pcdc model gravity (0,-9.8)
pcdc model option mechanical off
pcdc node boundary hydra-c-f-b flow-surface 2.5 range x 0 0
pcdc node boundary hydra-c-f-b flow-surface 1 range x 4 4
pcdc flow-node initial saturation 1 range y 0 1
pcdc model sub-step hydraulic 4
pcdc model step 60
""",
    "Water that opens a joint": f"""\
pcdc mesh structured (0,0) (2,2) cells 4 4 type tri
pcdc element c-model mech-iso-elastic property density 2500 young 20e9 poisson-ratio 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 2e6 tensile-strength 3e5 gf1 20 gf2 200 penalty-normal \\
     2e11 penalty-shear 2e11 penalty-overlay 2e11
pcdc face-joint group 'bed' range y 1 1
pcdc face-joint c-model hydr-p-m property {FLUID.format(bulk="2e8", a="1e-4", least="1e-5", most="1e-2")[:-1]} \\
     range group 'bed'
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc flow-node initial saturation 1
pcdc node boundary hydra-c-f-b pressure 2e6 range x 0 0 y 1 1
pcdc model step 400
""",
    "A ring that is heated inside": """\
pcdc mesh structured (0,0) (1,1) cells 10 10 type tri
pcdc element group 'hole' range in-circle (0,0) 0.3
pcdc element group 'ring' range not group 'hole'
pcdc element c-model null range group 'hole'
pcdc element c-model mech-iso-elastic property density 2600 young 10e9 poisson-ratio 0.2 range group 'ring'
pcdc element c-model therm-iso-h property conductivity 3 capacity 900 expansion-coeficient 1e-5
pcdc node initial temperature 20
pcdc node boundary therm-s-b-c temperature 80 range in-circle (0,0) 0.35
pcdc element-face boundary therm-c-h transfer-coeficient 15 environment-temperature 20 range x 1 1
pcdc model option mechanical off
pcdc model time-step thermal 40
pcdc model sub-step thermal 2
pcdc model step 30
""",
    "A blast beside a quiet boundary": """\
pcdc mesh structured (0,0) (6,1) cells 24 4 type quad
pcdc element c-model mech-iso-elastic property density 2500 young 20e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 2 (1,0)
pcdc model step 10
t = pcdc.time
pcdc table create 'blast' values ([t],0) ([1e-4 + t],-2e6) ([3e-4 + t],0) ([1 + t],0)
pcdc element-face boundary m-s-b-c stress-normal table 'blast' range x 0 0
pcdc element-face boundary m-s-b-c quiet on range x 6 6
pcdc model solve time 2e-3
""",
    "An imported mesh": """\
pcdc mesh import 'large.msh'
pcdc element c-model mech-iso-elastic property density 2500 young 2e9 poisson-ratio 0.25
pcdc element c-model mech-iso-elastic property density 4000 young 8e9 poisson-ratio 0.25 range group 'ore' \\
     set 'physical'
pcdc model gravity (0,-9.8)
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc model option dynamic off
pcdc model solve cycles 200 ratio 1e-6
""",
    "A tunnel in stages, with bolts and a support": """\
pcdc mesh structured (0,0) (8,8) cells 16 16 type quad
pcdc element c-model mech-iso-elastic property density 2500 young 3e9 poisson-ratio 0.25
pcdc element group 'top heading' set 'stages' range x 3 5 y 4 5
pcdc element group 'bench' set 'stages' range x 3 5 y 3 4
pcdc element initial stress-xx -3e6 stress-yy -5e6
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 8 8
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc element-face boundary m-s-b-c stress-normal -5e6 range y 8 8
pcdc model option dynamic off
pcdc element c-model null range group 'top heading' set 'stages'
pcdc model solve cycles 150 ratio 1e-5
for x in (3.25, 4, 4.75):
    pcdc bolt create polyline ([x],5) ([x],7.2) length 0.5 group 'roof'
pcdc bolt create polyline (2.6,2.7) (5.4,2.7) length 0.5 group 'floor'
pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 tensile-yield-force 2e5 \\
     shear-stiffness-rock-bolt 1e9 grout-thickness 0.02 cohesion-rock-grout 1e6 cohesion-grout-bolt 2e6 spacing 1
pcdc element c-model null range group 'bench' set 'stages'
pcdc model solve cycles 250 ratio 1e-5
""",
    "A block that splits between two plates": """\
pcdc geometry create circle center (0,0) radius 0.03 segment-length 0.006 as-layer 'disc'
pcdc element create geometry layer 'disc' mesh-size 0.008
pcdc element c-model mech-iso-elastic property density 2500 young 20e9 poisson-ratio 0.2 damp-factor 0.2
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 8e6 tensile-strength 2e6 gf1 4 gf2 40 penalty-normal \\
     2e11 penalty-shear 2e11 penalty-overlay 2e11
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y -0.03 -0.0285
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y -0.4 range y 0.0285 0.03
pcdc model time-step value 1e-7
pcdc model solve time 4e-5
""",
    "An excavation in three dimensions": """\
pcdc model new dim 3
pcdc mesh structured (0,0,0) (4,2,2) cells 4 2 2 type hex
pcdc element c-model mech-iso-elastic property density 2500 young 5e9 poisson-ratio 0.25
pcdc element initial stress-xx -2e6 stress-yy -2e6 stress-zz -3e6
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 4 4
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc node boundary mech-vel-b-c velocity-y 0 range y 2 2
pcdc node boundary mech-vel-b-c velocity-z 0 range z 0 0
pcdc element-face boundary m-s-b-c stress-zz -3e6 range z 2 2
pcdc model option dynamic off
pcdc model solve cycles 100 ratio 1e-5
pcdc element c-model null range x 0 2 z 1 2 y 0 1
pcdc model solve cycles 200 ratio 1e-5
""",
}


def mesh_file(scale: float, move: float) -> str:
    """Two squares of two triangles each in Gmsh's format 2.2, the second in a physical group."""
    points = [(x, y) for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0)]
    cells = [(1, (1, 2, 5)), (1, (1, 5, 4)), (2, (2, 3, 6)), (2, (2, 6, 5))]
    nodes = "".join(f"{k} {scale * x + move!r} {scale * y!r} 0\n" for k, (x, y) in enumerate(points, 1))
    elements = "".join(f"{k} 2 2 {of} {of} {' '.join(map(str, at))}\n" for k, (of, at) in enumerate(cells, 1))
    return (
        '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 "host"\n2 2 "ore"\n$EndPhysicalNames\n'
        f"$Nodes\n{len(points)}\n{nodes}$EndNodes\n$Elements\n{len(cells)}\n{elements}$EndElements\n"
    )


def found(rock: Rock) -> dict[str, bytes]:
    """Bits of what moved, of the fluid and of the heat."""
    blocks = rock.blocks
    clock = repr((blocks.clock.step, blocks.clock.time)).encode()
    out = {"x": blocks.x.tobytes(), "v": blocks.v.tobytes(), "clock": clock}
    for load in blocks.surface_loads:
        if load.name == "fluid":
            out |= {"fluid": load.state.tobytes(), "time of fluid": repr(load.time).encode()}
        if load.name == "bolts":
            out |= {f"bolts {name}": column.tobytes() for name, column in load.nodes.items()}
        if load.name == "heat":
            out |= {"heat": rock.blocks.cold["temperature"].tobytes(), "time of heat": repr(load.time).encode()}
    return out


def test_each_script_of_the_page_has_a_twin():
    assert SCRIPTS.keys() == TWINS.keys()


@pytest.mark.parametrize("name", TWINS)
def test_a_script_has_the_bits_of_its_twin(tmp_path, name):
    for folder, file, how in (("ours", "large.msh", (2.0, 1.0)), ("theirs", "rock.msh", (1.0, 0.0))):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text(mesh_file(*how))
    ours, theirs = Rock(tmp_path / "ours", TWINS[name]), Rock(tmp_path / "theirs", SCRIPTS[name])
    assert found(theirs) == found(ours)
    moved = np.abs(theirs.blocks.v).max() if theirs.blocks.options.mechanical else 1.0
    assert moved > 0.0 and theirs.project.step > 0


def test_a_search_of_the_scripts_finds_their_names():
    """hpcdem --check: layers, tables and groups that words of PCDC make are known, those that none makes are named."""
    for name, text in SCRIPTS.items():
        assert "warning" not in check.summary(text, "a.sc"), name
    for text, what in (
        ("pcdc n g 'a' range geometry-distance 'bed' within 1\n", "line 1: no line creates the geometry layer 'bed'"),
        ("pcdc f-j g 'a' range not geom-a 'bed'\n", "line 1: no line creates the geometry layer 'bed'"),
        ("pcdc table 'a' data 0 1\npcdc n apply mech-f-b-c f-x table 'b'\n", "line 2: no line creates the table 'b'"),
        ("pcdc element create geometry layer 'out' m-s 1\n", "line 1: no line creates the geometry layer 'out'"),
        ("pcdc element create brick p0 0,0 p1 1,0 p2 0,1 n 1 1 group 'a'\npcdc e hide on range group 'b'\n",
         "line 2: no line creates the group 'b' of elements"),
    ):  # fmt: skip
        assert what in check.summary(text, "a.sc")


def test_the_block_sags_by_what_theory_says(tmp_path):
    rock = Rock(tmp_path, SCRIPTS["Compression of a block"] + "sag = pcdc.values('node', 'displacement-y', y=(1, 1))\n")
    assert rock["sag"] == pytest.approx(-1e6 * (1 - 0.25**2) / 2e9, rel=1e-4)


@pytest.mark.parametrize("name", ["A specimen that splits", "Water that opens a joint"])
def test_joints_break(tmp_path, name):
    rock = Rock(tmp_path, SCRIPTS[name] + "pcdc face-joint list summary\n")
    broken = int(re.search(r"(\d+) broken", rock.blocks.log.lines[-1])[1])
    assert broken == np.count_nonzero(rock.blocks.broken) > 0


def test_the_quiet_boundary_lets_the_blast_out(tmp_path):
    """After the wave has passed, hardly anything is left; with a free end it comes back."""
    script = SCRIPTS["A blast beside a quiet boundary"] + "pcdc model solve time 2e-3\n"
    left = []
    for k, text in enumerate((script, script.replace("pcdc element-face apply mech-abs-b-c range x 6\n", ""))):
        left.append(float(np.abs(Rock(tmp_path / str(k), text).blocks.v).max()))
    assert left[0] < 0.25 * left[1]
