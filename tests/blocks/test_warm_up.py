"""After a warm-up nothing has to be compiled: asked of a process of its own, as kernels stay compiled."""

from __future__ import annotations

import sys

import pytest

from tests.conftest import ROOT, run

PROGRAM = """
from hpcdem.runtime import kept
kept.install()
import numpy as np
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem import build, histories, pairs
from hpcdem.physics.fdem import creep as clock
from hpcdem.physics.fdem import warm_up
from hpcdem.physics.fdem import connectivity
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.kernels import contact, creep, detect, elements, energy
from hpcdem.physics.fdem.kernels import limits, nodes, plasticity, softening
from hpcdem.physics.fdem.elements import tangent as of_elements
from hpcdem.physics.fdem.kernels import joint_points
from tests.blocks.support import jointed, model, rectangle

def compiled():
    modules = (build, connectivity, contact, creep, detect, elements, energy, limits, histories, nodes, pairs,
               plasticity, softening, joint_points, of_elements)
    found = ((m.__name__, name, f) for m in modules for name, f in vars(m).items())
    return {(module, name): len(f.signatures) for module, name, f in found if hasattr(f, "signatures")}

for one in (warm_up.warm_up, warm_up.yielding, warm_up.creeping, warm_up.tangent, warm_up.plastic_tangent):
    one(1)
before = compiled()
for kind in ("cross", "quad", "mixed"):
    sim = model(rectangle(4, 4, 1.0, 1.0, kind=kind))
    convergence.advance(sim, 3)
    diagnostics.unbalanced_ratio(sim)
    saved_state.save(sim, "x.sav")
    saved_state.restore(Blocks(), "x.sav")
    sim = jointed(model(rectangle(4, 4, 1.0, 1.0, kind=kind)))
    sim.option(dynamic=False)
    sim.gravity(0.0, -1.0)
    convergence.advance(sim, 3)
    changes.null(sim, [3], relax=3)
    convergence.advance(sim, 2)
    changes.crack(sim, sim.numbers_of_joints(None)[:3])
    sim.option(dynamic=True)
    diagnostics.account_energy(sim)
    sim.time_step(mass_scaling=1e-5)
    sim.initial_stress(None, xx=-1.0)
    convergence.advance(sim, 10)
    sim.time_step(auto=True)
    convergence.advance(sim, 110)
    diagnostics.energies(sim)
    diagnostics.contacts(sim)
    diagnostics.total(sim, "opening")
    changes.reset_displacement(sim)
    diagnostics.values(sim, "displacement_x")
rock = {"density": 2500.0, "young": 1e6,
        "poisson_ratio": 0.2, "friction": 30.0, "cohesion": 1.0, "tensile": 1.0, "dilation": 0.0}
for dynamic in (True, False):
    sim = model(rectangle(4, 4, 1.0, 1.0, kind="cross"))
    changes.element_model(sim, None, "mech_mohr_coulomb", rock)
    sim.option(dynamic=dynamic)
    sim.gravity(0.0, -1.0)
    convergence.advance(sim, 20)
    changes.reset_state(sim)
    saved_state.save(sim, "x.sav")
    saved_state.restore(Blocks(), "x.sav")
salt = {"density": 2500.0, "young": 1e6, "poisson_ratio": 0.2, "kelvin_shear": 1e6, "kelvin_viscosity": 1.0}
for dynamic in (True, False):
    sim = model(rectangle(4, 4, 1.0, 1.0, kind="cross"))
    changes.element_model(sim, None, "mech_burgers", salt)
    changes.element_model(sim, [0, 1], "mech_mohr_coulomb", rock)
    sim.option(dynamic=dynamic)
    sim.velocity_condition([0, 1, 2], vx=0.0, vy=0.0)
    sim.gravity(0.0, -1.0)
    clock.switch(sim, True, dt=0.1, change=0.1)
    if not dynamic:
        clock.begin(sim, 1.0)
    convergence.advance(sim, 3)
    diagnostics.values(sim, "kelvin_strain_xy")
    diagnostics.values(sim, "strain_energy")
    if not dynamic:
        clock.finish(sim, 1.0)
    changes.reset_kelvin_strain(sim)
    saved_state.save(sim, "x.sav")
    saved_state.restore(Blocks(), "x.sav")
square = rectangle(2, 2, 1.0, 1.0)
for kind in ("cross", "quad", "mixed"):
    for sim in (model(rectangle(2, 2, 1.0, 1.0, kind=kind)), jointed(model(rectangle(2, 2, 1.0, 1.0, kind=kind)))):
        sim.velocity_condition([0, 1, 2], vx=0.0, vy=0.0)
        sim.gravity(0.0, -1.0)
        sim.option(dynamic=False)
        equilibrium.solve_elastic(sim)
sim = model(Mesh.of(np.asfortranarray(square.points), np.asfortranarray(square.cells)))
sim.step()
after = compiled()
print({k: (n, after[k]) for k, n in before.items() if after[k] != n})
"""


@pytest.mark.slow
def test_a_warm_up_leaves_nothing_to_compile(tmp_path):
    done = run([sys.executable, "-c", PROGRAM], tmp_path, env={"PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == "{}"
