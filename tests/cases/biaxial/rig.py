"""A biaxial press: a rectangular sample between four smooth walls, driven by `Simulation.every`.

Side walls, and while the sample is made all four, are held at a stress by a servo. With the stress s on the wall, its
target s0 and e = s0 - s, every n steps

    drift <- drift + beta g e,      inward velocity = g e + drift,      g = alpha d t / (k n dt)

d: mean diameter, t: thickness, k: tangent stiffness of a contact that carries the force s0 d t. A wall touched by one
particle per diameter would then take away the share alpha of e in the next n steps. The drift lets a wall follow a
sample that dilates steadily without lagging behind; it is slow (beta small) beside the way in which a change of
stress spreads through the sample. Speeds are limited to `LIMIT` of d sqrt(s0 / rho) / d per mean diameter and unit
time, which matters only until the walls meet the loose grains.

Stresses are wall forces over the present length of the wall inside the sample and the thickness: 1 m for discs, the
mean diameter for spheres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hpcdem import Simulation

LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
INWARD = {LEFT: (1.0, 0.0), RIGHT: (-1.0, 0.0), BOTTOM: (0.0, 1.0), TOP: (0.0, -1.0)}
ALPHA, BETA, EVERY = 0.8, 0.03, 5
LIMIT = 0.1
DAMP = 0.4


@dataclass
class Grains:
    """What a sample is made of. radii [m]; density; law: keys of PROP; disk: rule of mass; stiff(f): tangent stiffness
    [N/m] of a contact that carries f [N]; step: dt or frac; wall: kn, ks of walls; fixed: no rotation; grid: made by
    GEN grid (equal chances for all radii) or by random insertion (favours small ones)."""

    radii: list[float]
    density: float
    law: dict
    disk: str
    step: dict
    stiff: Callable[[float], float]
    wall: dict = field(default_factory=dict)
    fixed: bool = False
    grid: bool = False


@dataclass
class Curve:
    """One loading: axial strain (ln H0/H), differential stress and side stress [Pa], volume strain (+ swelling)."""

    axial: np.ndarray
    q: np.ndarray
    side: np.ndarray
    volume: np.ndarray

    @property
    def peak(self) -> float:
        """Largest differential stress of the curve, averaged over 2 % of the readings around each."""
        n = max(len(self.q) // 50, 1)
        return float(np.convolve(self.q, np.ones(n) / n, "valid").max())

    @property
    def residual(self) -> float:
        """Mean differential stress over the last third of the way."""
        return float(self.q[self.axial > 2.0 / 3.0 * self.axial[-1]].mean())


class Press:
    """A sample of `num` grains, aspect (height over width) 2."""

    def __init__(self, sim: Simulation, grains: Grains, num: int, seed: int = 1) -> None:
        self.sim, self.grains = sim, grains
        spacing = 2.0 * max(grains.radii)
        columns = round(math.sqrt(num / 2.0))
        w, h = columns * spacing, 2 * columns * spacing
        sim.set(disk=grains.disk, seed=seed, gentry=60.0, print=0, **grains.step)
        for wall, nodes in {
            LEFT: ((0.0, -h), (0.0, 2.0 * h)),
            RIGHT: ((w, -h), (w, 2.0 * h)),
            BOTTOM: ((-h, 0.0), (w + h, 0.0)),
            TOP: ((-h, h), (w + h, h)),
        }.items():
            sim.wall(wall, nodes, **grains.wall)
        if grains.grid:
            sim.gen_grid(grains.radii, x=(0.0, w * (1.0 + 1e-9)), y=(0.0, h * (1.0 + 1e-9)))
        else:
            sim.gen(num, rad=grains.radii, x=(0.0, w), y=(0.0, h))
        sim.prop(density=grains.density, damp=DAMP, fric=0.0, **grains.law)
        if grains.fixed:
            sim.fix("spin")
        self.diameter = 2.0 * float(np.mean(sim.gather("radius")))
        self.thickness = self.diameter if grains.disk == "off" else 1.0
        self.target: dict[int, float] = {}
        self.driven: dict[int, float] = {}
        self.drift = dict.fromkeys(INWARD, 0.0)
        self.seen: list[tuple[float, ...]] = []
        self.calm = 0
        self.each = 0

    def size(self) -> tuple[float, float]:
        """Width and height between the walls [m]."""
        w = self.sim.walls
        return w[RIGHT].p1[0] - w[LEFT].p1[0], w[TOP].p1[1] - w[BOTTOM].p1[1]

    def stress(self) -> dict[int, float]:
        """Normal stress on the four walls [Pa], compression positive."""
        width, height = self.size()
        force = self.sim.wall_forces()
        return {
            wall: -(force[wall][0] * nx + force[wall][1] * ny) / ((height if nx else width) * self.thickness)
            for wall, (nx, ny) in INWARD.items()
        }

    def control(self, stress: dict[int, float]) -> None:
        """New wall velocities."""
        g, sim = self.grains, self.sim
        for wall, (nx, ny) in INWARD.items():
            if wall in self.driven:
                v = self.driven[wall]
            else:
                target = self.target[wall]
                force = target * self.diameter * self.thickness
                gain = ALPHA * self.diameter * self.thickness / (g.stiff(force) * EVERY * sim.dt)
                limit = max(LIMIT * math.sqrt(target / g.density), 2.0 * max(self.driven.values(), default=0.0))
                v = gain * (target - stress[wall]) + self.drift[wall]
                if abs(v) < limit:
                    self.drift[wall] += BETA * gain * (target - stress[wall])
                v = min(max(v, -limit), limit)
            sim.wall(wall, xv=v * nx, yv=v * ny)

    def confine(self, stress: float, within: float = 0.01, most: int = 60000) -> None:
        """All four walls to `stress` [Pa], until it is met on each and the grains are at rest."""
        self.target, self.driven, self.calm = dict.fromkeys(INWARD, stress), {}, 0
        self.drift = dict.fromkeys(INWARD, 0.0)
        slow = 1e-6 * stress * self.diameter**2 * self.thickness * self.sim.count

        def look(sim: Simulation) -> bool:
            now = self.stress()
            self.control(now)
            good = all(abs(s / stress - 1.0) < within for s in now.values())
            self.calm = self.calm + 1 if good else 0
            return self.calm >= 50 and sim.kinetic_energy() < slow

        self._run(look, most)
        assert self.calm >= 50, f"{stress:g} Pa not reached: {self.stress()}"

    def shear(self, stress: float, inertial: float = 1e-3, strain: float = 0.15) -> Curve:
        """Drive top and bottom together at a rate of inertial number `inertial`, sides held at `stress`."""
        g, sim = self.grains, self.sim
        width, height = self.size()
        rate = inertial / (self.diameter * math.sqrt(g.density / stress))
        steps = int(strain / (rate * sim.dt))
        self.target = {LEFT: stress, RIGHT: stress}
        self.driven = {BOTTOM: 0.5 * rate * height, TOP: 0.5 * rate * height}
        self.drift = dict.fromkeys(INWARD, 0.0)
        self.seen = []

        def look(sim: Simulation) -> None:
            now = self.stress()
            self.control(now)
            self.seen.append((*self.size(), *(now[w] for w in INWARD)))

        self._run(look, steps)
        w, h, left, right, bottom, top = np.array(self.seen).T
        side = 0.5 * (left + right)
        return Curve(np.log(height / h), 0.5 * (bottom + top) - side, side, w * h / (width * height) - 1.0)

    def _run(self, look: Callable[[Simulation], object], steps: int) -> None:
        call = self.sim.every(EVERY, look)
        try:
            self.sim.cycle(steps)
        finally:
            call.cancel()

    def solid(self) -> float:
        """Area of the discs over that of the sample."""
        width, height = self.size()
        return float(math.pi * (self.sim.gather("radius") ** 2).sum()) / (width * height)


def mohr_coulomb(confining: list[float], q: list[float]) -> tuple[float, float, float]:
    """Friction angle [degrees], cohesion [Pa] and r^2 of the line q = (K - 1) s3 + 2 c sqrt(K)."""
    slope, intercept = np.polyfit(confining, q, 1)
    r2 = np.corrcoef(confining, q)[0, 1] ** 2
    k = slope + 1.0
    return math.degrees(math.asin((k - 1.0) / (k + 1.0))), intercept / (2.0 * math.sqrt(k)), float(r2)


@contextmanager
def serial(folder: Path) -> Iterator[None]:
    """Simulations of this process belong to one rank without MPI; relative file names begin at `folder`."""
    from hpcdem import session
    from hpcdem.core.comm import SerialComm
    from hpcdem.runtime.progress import Log
    from hpcdem.runtime.stop_requests import StopRequests

    before = session._current
    session.enter(
        session.Session(SerialComm(), Log(0), StopRequests(None, None), directory=folder, figure=False, ready={""})
    )
    try:
        yield
    finally:
        session.enter(before)
