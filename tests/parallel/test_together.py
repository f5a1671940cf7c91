"""Soil that yields and softens, rock that creeps, a law of the user, a bolt through all of them, an excavation: in one
model, first in relaxation, then in motion. The same bits on any ranks and threads, and from a file in mid-creep."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident

LAWS = Path(__file__).parent.parent / "blocks" / "laws" / "rock.py"
START = """\
pcdc model new
pcdc table create 'c' values (0,2e5) (0.01,5e4)
pcdc mesh structured (0,0) (4,3) cells 8 6 diagonal alternate group 'rock'
pcdc element group 'soft' set 'layer' range y 0 1
pcdc element group 'slow' set 'layer' range y 1 2
pcdc element group 'top' set 'layer' range y 2 3
pcdc element c-model mech-m-c property density 2000 young 5e7 poisson-r 0.3 friction 20 tensile 5e4 dilation 5 \\
    cohesion table 'c' over plastic-strain range group 'soft' set 'layer'
pcdc element c-model mech-bur property density 2000 young 1e8 poisson-r 0.25 k-s 5e7 k-v 5e11 m-v 5e12 \\
    range group 'slow' set 'layer'
pcdc element c-model user 'rock.py:tresca' property density 2000 young 2e8 poisson-r 0.25 parameter 'limit' 1e9 \\
    range group 'top' set 'layer'
pcdc node boundary mech-m-b-c type 1 (0,0) range y -0.01 0.01
pcdc model gravity (0,-9.81)
pcdc model option dynamic off
pcdc model option collision off
pcdc model solve ratio 1e-2
pcdc element-face boundary m-s-b-c stress-normal -6e5 range y 2.99 3.01
pcdc model solve ratio 1e-2 cycles 500
pcdc bolt create polyline (2.0,3.0) (2.2,0.4) length 0.2 plate group 'a'
pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 t-y-f 60e3 \\
    s-s-r-b 1e8 g-t 0.0125 c-r-g 2e5 c-g-b 2e5 friction-rock-grout 20
pcdc model creep on dt 500
pcdc model solve ratio 1e-2 time 1500
"""
REST = """\
pcdc element c-model null relax 50 range x 3.3 4 y 1.6 3
pcdc model solve ratio 1e-2 time 1000
pcdc model creep off
pcdc model option dynamic on
pcdc node reset velocity
pcdc model step 80
import hashlib
import numpy as np
text, most = hashlib.sha256(), []
for kind, names in (
    ('element', ('stress-xx', 'stress-yy', 'stress-xy', 'plastic-shear-strain', 'creep-work')),
    ('node', ('displacement-x', 'displacement-y', 'velocity-y')),
    ('bolt-element', ('axial-force', 'plastic-strain')), ('bolt-node', ('slip', 'bond-force')),
):
    for name in names:
        values = pcdc.values(kind, name)
        text.update(np.ascontiguousarray(values).tobytes())
        most.append(float(np.nanmax(np.abs(values))))
if pcdc.rank == 0:
    print('most', min(most[3], most[4], most[8], most[10]) > 0)
    print('digest', text.hexdigest())
"""


def ended(resident: Resident, folder: Path, ranks: int, script: str, *options: str) -> str:
    """What the script prints last."""
    folder.mkdir(exist_ok=True)
    shutil.copy(LAWS, folder)
    (folder / "all.sc").write_text(script)
    done = resident(ranks, "--no-figure", *options, "all.sc", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "most True" in done.stdout  # something has flowed, crept, is pulled, has slipped
    (found,) = (line for line in done.stdout.splitlines() if line.startswith("digest"))
    return found


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """The end of the run on one rank, and its folder with what it saved in mid-creep."""
    folder = tmp_path_factory.mktemp("alone")
    return ended(resident, folder, 1, START + "pcdc model save 'middle.sav'\n" + REST, "-j", "1"), folder


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("ranks", "threads"),
    [(3, 1), pytest.param(2, 2, marks=pytest.mark.slow)],
)
def test_the_same_on_any_ranks(alone, resident, tmp_path, ranks, threads):
    assert ended(resident, tmp_path, ranks, START + REST, "-j", str(threads)) == alone[0]


@pytest.mark.mpi
def test_from_the_middle(alone, resident, tmp_path):
    """Of the restored law the script must say where it is: a checkpoint names no file that is executed."""
    begin = f"pcdc element law 'rock.py:tresca'\npcdc model restore '{alone[1] / 'middle.sav'}'\n"
    assert ended(resident, tmp_path, 2, begin + REST, "-j", "1") == alone[0]
