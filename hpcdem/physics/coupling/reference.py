"""Plain form of `disc_faces.forces` for one disc. Read it beside the kernel; tests compare both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpcdem.physics.coupling.kernels.disc_faces import END1, END2, FACE, share
from hpcdem.physics.dem.kernels import laws


class Meeting(NamedTuple):
    """Contact of a disc and a face: part that is met (FACE, END1, END2), share of the second end, side of the face on
    which the centre is (outside positive), distance and overlap [m], normal (2,) to the face."""

    where: int
    t: float
    side: float
    d: float
    u: float
    n: np.ndarray


def meet(p1: np.ndarray, p2: np.ndarray, x: np.ndarray, r: float) -> Meeting:
    """A disc at x (2,) and a face from p1 to p2 (2,) [m], its element to the left."""
    e = p2 - p1
    t = float(np.clip((x - p1) @ e / (e @ e), 0.0, 1.0))
    side = float((x - p1) @ (e[1], -e[0]) / np.linalg.norm(e))
    q = (1.0 - t) * p1 + t * p2
    d = float(np.linalg.norm(q - x))
    return Meeting({0.0: END1, 1.0: END2}.get(t, FACE), t, side, d, r - d, (q - x) / d)


def counts(m: Meeting, before: Meeting | None, after: Meeting | None) -> bool:
    """Return whether this is a local minimum of the distance to the surface; before, after: the neighbours along it,
    None if they are not near."""
    if m.where == FACE or m.u <= 0.0:
        return m.u > 0.0 and m.side > 0.0
    other, facing = (before, END2) if m.where == END1 else (after, END1)
    if other is None:
        return m.side >= 0.0
    return other.where == facing and max(m.side, other.side) >= 0.0


def disc_forces(
    disc: tuple[np.ndarray, np.ndarray, float, float], ends: np.ndarray, before: list[int], after: list[int],
    on: np.ndarray, fs: np.ndarray, law: np.ndarray, dt: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Force and torque (3,) [N, N m] on a disc (place, velocity, spin, radius), forces (n, 2, 2) [N] on the ends of the
    faces near it, and which of them it touches and their friction [N] after the step.

    ends (n, 4, 2): places, then velocities of both ends; before, after: number of the neighbours of a face, -1: none
    near; on, fs (n,): touched, friction so far; law (n, 4): of disc and face.
    """
    x, v, spin, r = disc
    near = [meet(p1, p2, x, r) for p1, p2, _, _ in ends]
    neighbour = [(near[b] if b >= 0 else None, near[a] if a >= 0 else None) for b, a in zip(before, after)]
    touching = [k for k, m in enumerate(near) if counts(m, *neighbour[k])]
    on_disc, on_faces, new_fs = np.zeros(3), np.zeros((len(ends), 2, 2)), np.zeros(len(ends))
    for k in touching:
        m, (model, a, b, mu) = near[k], law[k]
        fn, ks, _, _ = laws.contact_state(model, a, b, 4.0 * r, m.u)
        old = fs[k]
        if not on[k]:  # it takes over the friction of the contact whose normal is nearest to its own
            known = [(share(*m.n, *near[j].n), fs[j]) for j in np.flatnonzero(on)]
            part, friction = max(known, default=(0.0, 0.0), key=lambda one: one[0])
            old = part * friction
        t = np.array([-m.n[1], m.n[0]])
        face = (1.0 - m.t) * ends[k, 2] + m.t * ends[k, 3]
        new_fs[k] = np.clip(old + ks * ((face - v) @ t - spin * m.d) * dt, -mu * fn, mu * fn)
        load = m.u / sum((1.0 if j == k else share(*m.n, *near[j].n)) * near[j].u for j in touching)
        f = load * (new_fs[k] * t - fn * m.n)
        on_disc += *f, load * new_fs[k] * m.d
        on_faces[k] = -(1.0 - m.t) * f, -m.t * f
    return on_disc, on_faces, np.isin(np.arange(len(ends)), touching), new_fs
