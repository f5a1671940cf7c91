"""Contacts of discs with faces against the plain loop of physics/coupling/reference.py, in random states."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import properties
from hpcdem.core.fields import MATERIAL, RADIUS, SPIN, VX, VY, WIDTH, X, Y
from hpcdem.core.selection import Interval
from hpcdem.physics.coupling import reference
from hpcdem.physics.coupling.kernels import disc_faces
from hpcdem.physics.dem.kernels import laws
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


def test_reported_contacts() -> None:
    """A linear disc on one face and one after Hertz on another, which is steeper; a third slot does not touch any more:
    forces, places, overlaps and energies by hand."""
    hot = np.zeros((3, WIDTH))
    ihot = hot.view(np.int64)
    hot[1:, RADIUS], ihot[1:, MATERIAL] = (1.0, 0.5), (0, 1)
    hot[1, [X, Y]], hot[2, [X, Y]] = (0.5, 0.9), (10.0 - 0.8 * 0.4, 0.6 * 0.4)
    ends = np.zeros((2, disc_faces.ENDS))
    ends[0, :4] = 2.0, 0.0, 0.0, 0.0  # the element below
    ends[1, :4] = 10.0 + 0.6, 0.8, 10.0 - 0.6, -0.8
    table = np.zeros((4, 4))
    table[0, [disc_faces.MODEL, disc_faces.A, disc_faces.B]] = laws.LINEAR, 1e6, 5e5
    table[3, [disc_faces.MODEL, disc_faces.A, disc_faces.B]] = laws.HERTZ, 2e7, 1e7
    row, begin, nobody = np.array([1, 2]), np.array([0, 2, 3]), np.full(3, -1)
    on, fs = np.array([True, False, True]), np.array([300.0, 0.0, -40.0])
    seen, out, at = np.full((2, disc_faces.SCRATCH), 9.0), np.zeros((3, 6)), np.zeros((3, 2), int)
    n = disc_faces.contacts(
        row,
        begin,
        hot,
        ihot,
        np.array([0, 0, 1]),
        nobody,
        nobody,
        on,
        fs,
        ends,
        np.array([0, 1]),
        table,
        2,
        seen,
        out,
        at,
    )
    assert n == 2 and at[:2].tolist() == [[0, 0], [2, 1]]
    assert out[0] == pytest.approx([1e5, 300.0, 0.5, 0.0, 0.1, 0.5 * 1e4 + 0.5 * 300.0**2 / 5e5], rel=1e-12)
    root = math.sqrt(4.0 * 0.5 * 0.1)
    fn = 2e7 * root * 0.1
    energy = 0.4 * fn * 0.1 + 0.5 * 40.0**2 / (1e7 * root)
    assert out[1] == pytest.approx([fn, -40.0, 10.0, 0.0, 0.1, energy], rel=1e-12, abs=1e-12)
