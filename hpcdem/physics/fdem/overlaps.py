"""Bodies that overlap before anything has moved: where, and how deep.

Contact would throw them apart: an overlap d stores 3/2 P d^2 (1/h_1 + 1/h_2) per area, and the pressure is 60 E d/h at
P = 10 E. So the first step of a new model is refused, unless overlaps are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.definition import REFUSE, RELAX
from hpcdem.physics.fdem.kernels import contact, detect
from hpcdem.physics.fdem.pairs import Bodies

if TYPE_CHECKING:
    from hpcdem.physics.fdem.local import Local
    from hpcdem.physics.fdem.state import State

ROUNDING = 1e-5
"""Overlap over the size of the smaller element that is put down to the rounding of coordinates."""
NAMED = 5
"""Places that a message names."""


def check(sim: State, local: Local) -> None:
    """At the first step of a new model: CommandError if bodies overlap and that was not asked for. The model is closed.
    Collective."""
    o = sim.options
    if not o.collision:
        return
    found = deepest(sim, local)
    if not len(found):
        return
    places = "; ".join(
        f"elements {int(a)} and {int(b)} by {depth:.3g} m at ({x:g}, {y:g})" for depth, x, y, a, b in found[:NAMED]
    )
    said = f"{len(found)} pairs of elements overlap before the first step, {places}"
    if o.overlap == REFUSE:
        raise CommandError(
            f"{said}: contact would throw them apart. Move them apart, or say model option overlap relax and let a "
            "static stage do it (keep: they start as they are)"
        )
    if o.overlap == RELAX and o.dynamic:
        raise CommandError(
            f"{said}: with model option overlap relax they are moved apart by a static stage: model option dynamic "
            "off, model solve, then dynamic on"
        )
    if sim.log is not None:
        sim.log.info(said)


def deepest(sim: State, local: Local) -> np.ndarray:
    """Pairs of elements that overlap by more than rounding, on all ranks: (n, 5) depth [m], place [m], both numbers;
    the deepest first. However deep they are: all elements count, not those at the surface alone. The model is closed.
    Collective."""
    mesh, own = sim.the_mesh(), sim.owned
    bodies = Bodies(sim, local, np.arange(len(sim.number)), inner=True)
    rows = np.empty((0, 5))
    if len(bodies.row):
        box, around = np.empty((len(bodies.row), 4)), np.empty((len(bodies.row), 4))
        detect.boxes(bodies.x_place, bodies.free, sim.x, 0.0, box, around)
        owned = (bodies.row >= own.start) & (bodies.row < own.stop)
        first, second = detect.find(
            box, around, bodies.element, bodies.number, owned, mesh.cells, sim.partner, sim.closed_faces()
        )
        depth = np.empty((len(first), 3))
        if len(first):
            contact.depths(first, second, bodies.free, bodies.x_place, sim.x, depth)
        size = np.sqrt(sim.areas[bodies.element])
        real = depth[:, 0] > ROUNDING * np.minimum(size[first], size[second])
        real &= owned[first]  # a pair is told by the owner of its first element
        one, other = bodies.element[first[real]], bodies.element[second[real]]
        rows = np.column_stack([depth[real], np.minimum(one, other), np.maximum(one, other)])
    every = np.concatenate(sim.comm.allgather(rows))
    every = every[np.lexsort((every[:, 4], every[:, 3], -every[:, 0]))]
    _, once = np.unique(every[:, 3:], axis=0, return_index=True)  # of halves of quads the deeper one
    return every[np.sort(once)]
