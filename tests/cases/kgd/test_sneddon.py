"""A crack under pressure, joints on its line or on all edges, against Sneddon 1946: w(x) = 4 p / E' sqrt(a^2 - x^2).

Far away a disc of radius R is held. A crack of volume V = 2 pi p a^2 / E' is, from there, a source with the moments
(lambda + 2 mu) V across it and lambda V along it, in Muskhelishvili's functions phi = alpha / z, psi = beta / z with
alpha = -mu V / (pi (1 + k)), beta = (lambda + mu) V (1 - k) / (pi (1 + k)), k = 3 - 4 nu. What is held answers with
phi = c z + ..., psi = d z, c = beta / ((k - 1) R^2), d = alpha (k + 3/k) / R^2: k phi - z conj(phi') - conj(psi) is 0
at R. Across the crack that is 2 c + d = -p (a/R)^2 (2 / (1 - 2 nu) + k + 3/k) / 4, by which p is less.

Joints on all edges soften the rock: 1/E' + sqrt(3)/P in a lattice of equilateral triangles (../penalty/exact.py).
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from hpcdem.physics.flow.model import Flow
from tests.conftest import absent
from tests.pcdc.test_time import Rock

SCRIPT = """
import json, numpy as np
n, a, young, poisson, p = CELLS, 1.0, 30e9, 0.25, 1e6
far = 20 * a
pcdc model new
pcdc geometry create polygon (0,[-far]) ([far],[-far]) ([far],[far]) (0,[far]) as-layer 'outline'
pcdc geometry create polyline (0,0) ([2*a],0) as-layer 'line'
pcdc geometry create polyline (0,0) ([a],0) as-layer 'crack'
pcdc mesh create from-layer 'outline' size [far/6] refine-layer 'line' size [a/n] distance [far] \\
    embed 'line' crack 'crack' irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young [young] poisson-r [poisson]
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e9 tensile-strength 1e9 gf1 1e6 gf2 1e6 \\
    penalty-normal [PENALTY*young] WHERE
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2e9 viscosity 1e-6 aperature-initial 1e-6 \\
    aperature-minumum 1e-6 range geometry 'crack'
pcdc model option dynamic off
pcdc model option large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x [far] [far]
for y in (-far, far):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [y] [y]
pcdc flow-node initial pressure [p]
pcdc model solve elastic
joints, every = pcdc.numbers('flow-channel'), pcdc.numbers('joint')
x = np.asarray(pcdc.values('joint', 'joint-position-x'))[np.searchsorted(every, joints)]
order = np.argsort(x)
x, opening = x[order], np.asarray(pcdc.values('flow-channel', 'aperture'))[order] - 1e-6
exact = 4 * p * (1 - poisson**2) / young * np.sqrt(np.maximum(a * a - x * x, 0.0))
middle = 1.5 * opening[0] - 0.5 * opening[1]
account = pcdc.fluid
if pcdc.rank == 0:
    with open('found.json', 'w') as file:
        json.dump({'middle': middle / (4 * p * a * (1 - poisson**2) / young) - 1, 'joints': len(x),
                   'volume': 2 * opening.mean() / (2 * math.pi * p * a * (1 - poisson**2) / young) - 1,
                   'given': account['given'], 'stored': account['stored']}, file)
"""


IN_A_DISC = """
import math
n, young, far = CELLS, 30e9, FAR
pcdc geometry create arc (0,0) [far] -90 90 as-layer 'outline'
pcdc geometry create polyline (0,[-far]) (0,[far]) as-layer 'outline'
pcdc geometry create arc (0,0) [far] -90 90 as-layer 'rim'
pcdc geometry create polyline (0,0) (2,0) as-layer 'line'
pcdc geometry create polyline (0,0) (1,0) as-layer 'crack'
# Finer everywhere, not on the crack alone: else what is coarse around it leaves an error of its own.
pcdc mesh create from-layer 'outline' size [far/(0.3*n)] refine-layer 'line' size [1/n] distance [far] \\
    embed 'line' crack 'crack' irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young [young] poisson-r 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e9 tensile-strength 1e9 gf1 1e6 gf2 1e6 \\
    penalty-normal [100*young] WHERE
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2e9 viscosity 1e-6 aperature-initial 1e-6 \\
    aperature-minumum 1e-6 range geometry 'crack'
pcdc model option dynamic off large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range geometry 'rim'
pcdc flow-node initial pressure 1e6
pcdc model solve elastic
"""


def in_a_disc(folder, cells: int, far: float = 20.0, everywhere: bool = False) -> np.ndarray:
    """Errors of the opening in the middle, and mean square along the crack, over that in the middle; the same without
    what the rim takes away; [%]."""
    text = IN_A_DISC.replace("CELLS", str(cells)).replace("FAR", repr(far))
    rock = Rock(folder, text.replace("WHERE", "" if everywhere else "range geometry 'line'"))
    flow = Flow.of(rock.blocks)
    x = rock.blocks.mesh.points[flow.network.ends][:, :, 0].mean(axis=1)
    order = np.argsort(x)
    opening = flow.values("flow-channel", "aperture")[order] - 1e-6
    assert len(opening) == cells
    plane, nu = 30e9 / (1.0 - 0.25**2), 0.25
    k = 3.0 - 4.0 * nu
    softer = 1.0 + math.sqrt(3.0) * plane / 3e12 if everywhere else 1.0
    errors = []
    for rim in ((2.0 / (1.0 - 2.0 * nu) + k + 3.0 / k) / (4.0 * far**2), 0.0):
        middle = 4e6 / plane * softer * (1.0 - rim)
        wrong = opening / middle - np.sqrt(1.0 - x[order] ** 2)
        errors += [(1.5 * opening[0] - 0.5 * opening[1]) / middle - 1.0, math.sqrt(float((wrong**2).mean()))]
    return 100.0 * np.array(errors)


def test_within_a_per_cent_of_the_closed_form(tmp_path):
    """The rim and the joints in the closed form; 80 joints, and the order of convergence from 10 on."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    found = np.array([in_a_disc(tmp_path / str(n), n) for n in (10, 20, 40, 80)])
    orders = np.log2(np.abs(found[:-1, :2] / found[1:, :2]))
    everywhere = in_a_disc(tmp_path / "all", 40, everywhere=True)
    near = in_a_disc(tmp_path / "near", 20, far=10.0)
    print(found, orders, everywhere, near)
    assert abs(found[-1, 0]) < 0.6 and found[-1, 1] < 1.0
    assert orders.min() > 1.0
    assert np.abs(everywhere[:2] - found[2, :2]).max() < 0.2 and abs(everywhere[0]) < 1.0
    # At 10 a the rim takes 1.9 % away, and the closed form knows of it.
    assert near[0] == pytest.approx(found[1, 0], abs=0.2) and near[2] < found[1, 2] - 1.0


def opened(resident, folder, cells: int, penalty: float, ranks: int = 1, everywhere: bool = False) -> dict[str, float]:
    """Errors of the opening in the middle and of the volume."""
    folder.mkdir()
    text = "import math\n" + SCRIPT.replace("CELLS", str(cells)).replace("PENALTY", f"{penalty:g}")
    text = text.replace("WHERE", "" if everywhere else "range geometry 'line'")
    (folder / "crack.sc").write_text(text)
    done = resident(ranks, "--no-figure", "crack.sc", cwd=folder, timeout=600.0)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "found.json").read_text())


@pytest.mark.slow
@pytest.mark.mpi
def test_the_opening_converges_with_the_mesh(resident, tmp_path):
    """Of first order: errors of the opening fall by 1.6 and 0.9 % from 10 to 20 to 40 joints, to some -1.2 % that held
    sides at 20 a and the joints leave. Those of the volume are -8.0, -4.6, -2.9 %, a probe by others had -8.2, -4.7,
    -2.8 %. On two ranks the same."""
    found = [opened(resident, tmp_path / str(n), n, 100.0) for n in (10, 20, 40)]
    errors = [one["middle"] for one in found]
    print(errors, [one["volume"] for one in found])
    assert [one["joints"] for one in found] == [10, 20, 40]
    assert errors[0] < errors[1] < errors[2] < 0.0 and errors[2] > -0.025
    assert (errors[1] - errors[0]) / (errors[2] - errors[1]) == pytest.approx(2.0, abs=0.5)
    assert 2.0 * errors[2] - errors[1] == pytest.approx(-0.011, abs=0.004)
    assert [100.0 * one["volume"] for one in found] == pytest.approx([-8.2, -4.7, -2.8], abs=0.4)
    assert found[0]["given"] == pytest.approx(found[0]["stored"], rel=1e-12)
    assert opened(resident, tmp_path / "both", 10, 100.0, 2) == found[0]


@pytest.mark.slow
@pytest.mark.parametrize(("penalty", "volume"), [(10.0, -4.1), (50.0, -4.6), (100.0, -4.7)])
def test_joints_on_the_line_are_hardly_softer(resident, tmp_path, penalty, volume):
    """Whole joints lie ahead of the crack only: penalties of 10 to 100 E change the opening by little more than 1 %.
    Errors of the volume are those of a probe by others."""
    found = opened(resident, tmp_path / "one", 20, penalty)
    print(found)
    assert found["middle"] == pytest.approx(-0.0295, abs=0.013)
    assert 100.0 * found["volume"] == pytest.approx(volume, abs=0.4)


@pytest.mark.slow
@pytest.mark.parametrize(("penalty", "wanted"), [(10.0, 16.4), (50.0, 1.0), (100.0, -1.0)])
def test_joints_everywhere_are_softer(resident, tmp_path, penalty, wanted):
    """40 joints on the crack: the volume grows by some 1.84 E / P, 18, 3.7 and 1.8 %, a probe by others had errors of
    15, 0.8 and -1.0 %. At 50 E the right answer is one of two errors that cancel."""
    found = opened(resident, tmp_path / "all", 40, penalty, everywhere=True)
    alone = opened(resident, tmp_path / "line", 40, penalty)
    print(found, alone)
    assert 100.0 * found["volume"] == pytest.approx(wanted, abs=0.5)
    softer = (1.0 + found["volume"]) / (1.0 + alone["volume"]) - 1.0
    assert softer == pytest.approx(1.84 / penalty, rel=0.1)
