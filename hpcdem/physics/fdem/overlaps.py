"""Bodies that overlap: before anything has moved, and later so deep that contact no longer tells inside from outside;
where, and how deep.

Contact would repel them violently: an overlap d stores 3/2 P d^2 (1/h_1 + 1/h_2) per area, and the pressure is 60 E d/h
at P = 10 E. So the first step of a new model is refused, unless overlaps are requested.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.fdem.kernels import contact, detect
from hpcdem.physics.fdem.pairs import Bodies
from hpcdem.physics.fdem.pairs_space import AllPairs
from hpcdem.physics.fdem.settings import REFUSE, RELAX, STOP

if TYPE_CHECKING:
    from hpcdem.physics.fdem.local import Local
    from hpcdem.physics.fdem.state import State

ROUNDING = 1e-5
"""Overlap over the size of the smaller element that is attributed to the rounding of coordinates."""
DEEP = 0.1
"""Largest admissible overlap over an altitude of the element: beyond a third, the contact no longer pushes surfaces
apart."""
AGAIN = 1.5
"""Factor of growth after which an overlap is reported again."""
NAMED = 5
"""Number of positions that a message names."""


def check(sim: State, local: Local) -> None:
    """Check a new model at its first step: CommandError if bodies overlap and overlaps were not requested. The model is
    closed. Collective."""
    o = sim.options
    if not o.collision:
        return
    found = deepest(sim, local)
    if not len(found):
        return
    places = "; ".join(
        f"elements {int(a)} and {int(b)} by {depth:.3g} m at ({', '.join(f'{c:g}' for c in place)})"
        for depth, *place, a, b in found[:NAMED]
    )
    text = f"{len(found)} pairs of elements overlap before the first step, {places}"
    if o.overlap == REFUSE:
        raise CommandError(
            f"{text}: contact would repel them with a very high force. Separate them, or use model "
            "option overlap relax in a static "
            "stage (keep: start with the overlap)"
        )
    if o.overlap == RELAX and o.dynamic:
        raise CommandError(
            f"{text}: model option overlap relax separates them in a static stage: model option dynamic off, model "
            "solve, then dynamic on"
        )
    if sim.log is not None:
        sim.log.info(text)


def part(sim: State, local: Local) -> float:
    """The deepest overlap of this rank's pairs, over an altitude; the model is closed. Not collective."""
    return float(local.pairs.parts(sim.x).max(initial=0.0)) if len(local.pairs) else 0.0


def count(sim: State, local: Local) -> int:
    """Pairs of elements that overlap too deep. Collective."""
    return len(_deep(sim, local))


def report(sim: State, local: Local) -> None:
    """Say where bodies overlap too deep; PhysicsError if the run shall stop there. The model is closed. Collective."""
    found, o = _deep(sim, local), sim.options
    if not len(found):
        return
    places = "; ".join(
        f"elements {int(a)} and {int(b)} by {depth:.3g} m at ({', '.join(f'{c:.6g}' for c in place)}), {share:.2g} of "
        "the altitude"
        for depth, *place, share, a, b in found[:NAMED]
    )
    text = (
        f"step {sim.clock.step}: {len(found)} pairs of elements overlap by more than {DEEP:g} of an altitude: "
        f"{places}. Contact is too soft for the load: use a larger penalty-normal (10 to 100 E)"
    )
    if o.deep_overlap == STOP:
        raise PhysicsError(f"{text}; stopped by model option deep-overlap stop")
    if sim.log is not None:
        sim.log.warn(f"{text}; model option deep-overlap stop ends the run there")


def _deep(sim: State, local: Local) -> np.ndarray:
    """Pairs of elements that overlap too deep, on all ranks: depth [m], place [m], depth over the altitude, both
    numbers; the deepest first. Collective."""
    pairs: Any = local.pairs
    own = sim.owned
    share = pairs.parts(sim.x)
    at = np.flatnonzero(share > DEEP)
    first, second, depth = pairs.first[at], pairs.second[at], np.zeros((len(at), sim.dim + 1))
    if sim.dim == 3:
        one, other, row = pairs.face[first] // 4, pairs.element[second], pairs.face_row[first]
    else:
        one, other, row = pairs.element[first], pairs.element[second], pairs.row[first]
    if len(at):
        pairs.depths_of(at, sim.x, depth)
    real = (row >= own.start) & (row < own.stop)  # a pair is reported by the owner of its first element, or of its face
    return _gathered(sim, np.column_stack([depth, share[at], np.minimum(one, other), np.maximum(one, other)])[real])


def deepest(sim: State, local: Local) -> np.ndarray:
    """Pairs of elements that overlap by more than rounding, on all ranks: (n, 5), in space (n, 6), depth [m], place
    [m], both numbers; the deepest first. However deep they are: all elements count, not those at the surface alone. The
    model is closed. Collective."""
    return _gathered(sim, _in_space(sim) if sim.dim == 3 else _in_the_plane(sim, local))


def _gathered(sim: State, rows: np.ndarray) -> np.ndarray:
    """Rows (n, k) of all ranks, depth first, numbers of both elements last: of each pair the deepest one, the deepest
    pair first. Collective."""
    every = np.concatenate(sim.comm.allgather(rows))
    every = every[np.lexsort((every[:, -1], every[:, -2], -every[:, 0]))]
    _, once = np.unique(every[:, -2:], axis=0, return_index=True)  # of halves of quads, and of faces, the deepest one
    return every[np.sort(once)]


def _in_the_plane(sim: State, local: Local) -> np.ndarray:
    """Overlaps of this rank in two dimensions."""
    mesh, own = sim.the_mesh(), sim.owned
    bodies = Bodies(sim, local, np.arange(len(sim.number)), inner=True)
    if not len(bodies.row):
        return np.empty((0, 5))
    box, around = np.empty((len(bodies.row), 4)), np.empty((len(bodies.row), 4))
    detect.boxes(bodies.x_place, bodies.free, sim.x, 0.0, box, around)
    owned = (bodies.row >= own.start) & (bodies.row < own.stop)
    first, second = detect.find(
        box, around, bodies.element, bodies.number, owned, mesh.cells, sim.partner, sim.closed_faces()
    )
    keep = sim.touches[bodies.element[first]] & sim.touches[bodies.element[second]]
    first, second = first[keep], second[keep]
    depth = np.empty((len(first), 3))
    if len(first):
        contact.depths(first, second, bodies.free, bodies.x_place, sim.x, depth)
    real = owned[first]  # a pair is reported by the owner of its first element
    return _named(depth[real], bodies.element[first[real]], bodies.element[second[real]], np.sqrt(sim.areas))


def _in_space(sim: State) -> np.ndarray:
    """Overlaps of this rank in three dimensions. Collective."""
    size, found = np.cbrt(sim.areas), []
    for pairs in AllPairs.of(sim):
        depth, row = pairs.depths(), pairs.face_row[pairs.first]
        real = (row >= pairs.own.start) & (row < pairs.own.stop)  # a pair is reported by the owner of its face
        first, second = pairs.first[real], pairs.second[real]
        found.append(_named(depth[real], pairs.face[first] // 4, pairs.element[second], size))
    return np.concatenate(found)


def _named(depth: np.ndarray, one: np.ndarray, other: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Rows of those that are more than rounding; depth (n, 3 or 4), and where; size: of all elements [m]."""
    real = depth[:, 0] > ROUNDING * np.minimum(size[one], size[other])
    one, other = one[real], other[real]
    return np.column_stack([depth[real], np.minimum(one, other), np.maximum(one, other)])
