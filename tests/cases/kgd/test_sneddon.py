"""A crack under pressure, joints on its line or on all edges, against Sneddon 1946: w(x) = 4 p / E' sqrt(a^2 - x^2)."""

from __future__ import annotations

import json

import pytest

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


def opened(launch, folder, cells: int, penalty: float, ranks: int = 1, everywhere: bool = False) -> dict[str, float]:
    """Errors of the opening in the middle and of the volume."""
    folder.mkdir()
    text = "import math\n" + SCRIPT.replace("CELLS", str(cells)).replace("PENALTY", f"{penalty:g}")
    text = text.replace("WHERE", "" if everywhere else "range geometry 'line'")
    (folder / "crack.sc").write_text(text)
    done = launch(ranks, "--no-figure", "crack.sc", cwd=folder, timeout=600.0)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "found.json").read_text())


@pytest.mark.mpi
def test_the_opening_converges_with_the_mesh(launch, tmp_path):
    """Of first order: errors of the opening fall by 1.6 and 0.9 % from 10 to 20 to 40 joints, to some -1.2 % that held
    sides at 20 a and the joints leave. Those of the volume are -8.0, -4.6, -2.9 %, a probe by others had -8.2, -4.7,
    -2.8 %. On two ranks the same."""
    found = [opened(launch, tmp_path / str(n), n, 100.0) for n in (10, 20, 40)]
    errors = [one["middle"] for one in found]
    print(errors, [one["volume"] for one in found])
    assert [one["joints"] for one in found] == [10, 20, 40]
    assert errors[0] < errors[1] < errors[2] < 0.0 and errors[2] > -0.025
    assert (errors[1] - errors[0]) / (errors[2] - errors[1]) == pytest.approx(2.0, abs=0.5)
    assert 2.0 * errors[2] - errors[1] == pytest.approx(-0.011, abs=0.004)
    assert [100.0 * one["volume"] for one in found] == pytest.approx([-8.2, -4.7, -2.8], abs=0.4)
    assert found[0]["given"] == pytest.approx(found[0]["stored"], rel=1e-12)
    assert opened(launch, tmp_path / "both", 10, 100.0, 2) == found[0]


@pytest.mark.slow
@pytest.mark.parametrize("penalty", [10.0, 50.0, 100.0])
def test_joints_on_the_line_are_hardly_softer(launch, tmp_path, penalty):
    """Whole joints lie ahead of the crack only: penalties of 10 to 100 E change the opening by little more than 1 %."""
    found = opened(launch, tmp_path / "one", 20, penalty)["middle"]
    assert found == pytest.approx(-0.0295, abs=0.013)


@pytest.mark.slow
@pytest.mark.parametrize(("penalty", "wanted"), [(10.0, 16.4), (50.0, 1.0), (100.0, -1.0)])
def test_joints_everywhere_are_softer(launch, tmp_path, penalty, wanted):
    """40 joints on the crack: the volume grows by some 1.84 E / P, 18, 3.7 and 1.8 %, a probe by others had errors of
    15, 0.8 and -1.0 %. At 50 E the right answer is one of two errors that cancel."""
    found = opened(launch, tmp_path / "all", 40, penalty, everywhere=True)
    alone = opened(launch, tmp_path / "line", 40, penalty)
    print(found, alone)
    assert 100.0 * found["volume"] == pytest.approx(wanted, abs=0.5)
    softer = (1.0 + found["volume"]) / (1.0 + alone["volume"]) - 1.0
    assert softer == pytest.approx(1.84 / penalty, rel=0.1)
