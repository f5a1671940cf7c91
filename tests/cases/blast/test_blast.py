"""Three holes in stressed rock, blasted one after the other (manual, 7.4.4), in the order that is printed there:
initial stress and static equilibrium without joints; joints, contact and motion; the rock in the holes relaxed by its
modulus and taken out; the blasts, by tables of time."""

from __future__ import annotations

import importlib.util
import json
from itertools import pairwise

import pytest

from tests.conftest import absent

SCRIPT = """
import json
m_E, m_stress, m_holes = 50e9, -5e6, ['hole1', 'hole2', 'hole3']
pcdc geometry create rectangle (-2,-2) (2,2) as-layer 'out'
for i, name in enumerate(m_holes):
    pcdc geometry create circle ([i - 1],0) 0.05 as-layer [name]
pcdc mesh create from-layer 'out' size [SIZE] refine-layer 'hole1' size [FINE] refine-layer 'hole2' size [FINE] \\
    refine-layer 'hole3' size [FINE] group 'rock' region 'hole1' region 'hole2' region 'hole3'
pcdc element c-model mech-iso-elastic property density 2700 young [m_E] poisson-ratio 0.25 damp-factor 0.1
pcdc node boundary mech-vel-b-c velocity-x 0 range x -2.001 -1.999
pcdc node boundary mech-vel-b-c velocity-x 0 range x 1.999 2.001
pcdc node boundary mech-vel-b-c velocity-y 0 range y -2.001 -1.999
pcdc node boundary mech-vel-b-c velocity-y 0 range y 1.999 2.001
pcdc element initial stress-xx [m_stress] stress-yy [m_stress] stress-zz [0.5*m_stress]
pcdc model option dynamic off
pcdc model option collision off
pcdc model solve ratio 1e-5

pcdc face-joint c-model c-i-c-i property friction 30 cohesion 10e6 tensile-strength 2e6 gf1 20 gf2 200 \\
    penalty-overlay [100*m_E] penalty-normal [10*m_E] penalty-shear [10*m_E]
pcdc model option collision on
pcdc model option dynamic on
pcdc model option energy on
pcdc model solve time 5e-4

found = {'core': [], 'broken': []}
def state():
    return [int((pcdc.values('joint', 'state') == s).sum()) for s in (2, 3)]

def m_Relaxing(stages, time):
    for k in range(1, stages + 1):
        for name in m_holes:
            pcdc element property young [m_E*max(1 - k/stages, 1e-3)] range group [name]
        pcdc model solve time [time]
        found['core'].append(float(pcdc.values('element', 'stress-yy', group='hole2').mean()))

m_Relaxing(10, 1e-4)
found['relaxed'] = state()
for name in m_holes:
    pcdc element c-model null range group [name]
pcdc model solve time 3e-4
found['taken_out'], found['before'] = state(), pcdc.time

for i, name in enumerate(m_holes):
    begin = found['before'] + 1e-3*i
    pcdc table create [name] values ([0],0) ([begin],0) ([begin + 5e-5],-60e6) ([begin + 4e-4],0)
    pcdc element-face boundary m-s-b-c stress-normal table [name] range boundary geometry [name]
for i in range(3):
    pcdc model solve time 1e-3
    x, broken = pcdc.values('joint', 'joint-position-x'), pcdc.values('joint', 'state') == 3
    found['broken'].append([float(v) for v in x[broken]])
found['energies'] = pcdc.energies
found['time'] = pcdc.time
if pcdc.rank == 0:
    with open('found.json', 'w') as file:
        json.dump(found, file)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("size", "fine"), [(0.5, 0.05), (0.12, 0.015)], ids=["coarse", "fine"])
def test_the_order_of_the_manual(resident, tmp_path, size, fine):
    """No joint breaks, or only yields, before the first blast; the stress of the cores goes down with their modulus to
    less than a hundredth; each blast cracks the rock around its hole; energy closes to 1e-3 (wanted: 2 %)."""
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")
    (tmp_path / "blast.sc").write_text(SCRIPT.replace("SIZE", str(size)).replace("FINE", str(fine)))
    done = resident(1, "--no-figure", "blast.sc", cwd=tmp_path, timeout=1800)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    core = found["core"]
    assert all(a < b < 0.0 for a, b in pairwise(core)) and core[0] < -4e6 and core[-1] > -5e4
    # A cylinder of f E in rock of E, plane strain, equal stress, after Lame for both: sigma = s0 f (1 + m) / (1 + f m),
    # m = 1 / (1 - 2 nu) = 2; joints and the coarse circle take some of it.
    for k, stress in enumerate(core[:-1], 1):
        f = 1.0 - k / 10
        assert stress == pytest.approx(-5e6 * 3.0 * f / (2.0 * f + 1.0), abs=0.05 * 5e6)
    assert found["relaxed"] == found["taken_out"] == [0, 0]
    first, second, third = found["broken"]
    assert len(first) > 8 and all(abs(x + 1.0) < 0.6 for x in first)
    assert len(second) > len(first) and len(third) > len(second)
    assert sum(abs(x) < 0.5 for x in second) > 8 and sum(abs(x - 1.0) < 0.5 for x in third) > 8
    assert found["energies"]["relative"] < 1e-3
