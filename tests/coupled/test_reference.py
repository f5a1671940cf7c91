"""Contacts of discs with faces against the plain loop of physics/coupling/reference.py, in random states."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import properties
from hpcdem.core.fields import MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.core.selection import Interval
from hpcdem.physics.coupling import reference
from hpcdem.physics.fdem.mesh import Mesh
from tests.blocks.support import joined, rectangle, shaken
from tests.coupled.support import body, discs, together


@pytest.mark.some_of_each
@pytest.mark.parametrize("hertz", [False, True])
@pytest.mark.parametrize("kind", ["cross", "mixed"])
def test_forces(tmp_path, kind: str, hertz: bool) -> None:
    """Discs on uneven sides, at corners and in the groove between two bodies; random motion and histories."""
    rng = np.random.default_rng(4)
    mesh = joined(
        shaken(rectangle(6, 3, 1.2, 0.6, kind=kind), 0.2),
        rectangle(3, 2, 0.6, 0.5, x0=1.3, y0=0.45, kind=kind),
    )
    mesh = Mesh.of(mesh.points + rng.uniform(-0.025, 0.025, mesh.points.shape), mesh.cells)
    r = rng.uniform(0.05, 0.12, 60)
    places = [(x, 0.6 + 0.8 * s, s) for x, s in zip(rng.uniform(-0.05, 1.3, 30), r)]
    places += [(1.3 + 0.6 * x, 0.95 + 0.8 * s, s) for x, s in zip(rng.uniform(-0.1, 1.1, 20), r[30:])]
    places += [(-0.8 * s, y, s) for y, s in zip(rng.uniform(0.0, 0.65, 10), r[50:])]
    sim = discs(places, tmp_path, dt=1e-5)
    if hertz:
        properties.prop(sim, shear=3e8, poiss=0.2, hertz=True)
    properties.prop(sim, Interval("x", 0.0, 0.7), fric=0.2)
    rock = body(mesh)
    both = together(sim, rock)
    both.prepare()
    link, p = both.links(), sim.particles
    for column in (VX, VY, SPIN):
        p.hot[:, column] = rng.normal(size=len(p.hot))
    rock.v[:] = 0.5 * rng.normal(size=rock.v.shape)
    link.fetch()
    m = len(link.slot_face)
    link.slot_on[:], link.slot_fs[:] = rng.random(m) < 0.5, rng.normal(0.0, 2e4, m)
    link.slot_fs[~link.slot_on] = 0.0
    on, fs = link.slot_on.copy(), link.slot_fs.copy()
    both._forces(False)
    laws, seen = both._laws.reshape(-1, len(sim.materials), 4), np.zeros(3, int)
    for d, i in enumerate(link.disc_row):
        at = slice(link.disc_begin[d], link.disc_begin[d + 1])
        faces = link.slot_face[at]
        disc = p.hot[i, [X, Y]], p.hot[i, [VX, VY]], p.hot[i, SPIN], p.hot[i, RADIUS]
        near = [[q - at.start if q >= 0 else -1 for q in of[at]] for of in (link.slot_before, link.slot_after)]
        law = laws[link.face_model[faces], p.ihot[i, MATERIAL]]
        force, on_faces, touches, friction = reference.disc_forces(
            disc, link.ends[faces].reshape(-1, 4, 2), *near, on[at], fs[at], law, sim.clock.dt
        )
        scale = max(np.abs(force).max(), 1.0)
        assert link.disc_force[d] == pytest.approx(force, abs=1e-10 * scale)
        assert link.slot_force[at] == pytest.approx(on_faces.reshape(-1, 4), abs=1e-10 * scale)
        assert np.array_equal(link.slot_on[at], touches) and link.slot_fs[at] == pytest.approx(friction, rel=1e-9)
        seen += touches.sum() == 1, touches.sum() > 1, (touches & ~on[at] & (friction != 0.0)).any()
    assert (seen > 3).all()
