"""The model of the soak: a heap in a trough whose left wall moves back and forth and whose ground tilts.

Rows of bonded particles rain down and break on the heap; as many of the oldest particles are taken away, so the number
stays. All values repeat themselves with the period: nothing in the model has a reason to grow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import hpcdem

R, DENSITY, KN = 1.0, 2500.0, 1e8
WIDTH, TOP = 60.0, 60.0
DT = 1.5e-3
"""A fifth of sqrt(m / kn) of the smallest particle, m = DENSITY pi (0.8 R)^2."""
GRAVITY, TILT = 10.0, 3.0
FLOOR, LEFT, RIGHT = 0, 1, 2
SPEED = 1.5
"""Of the left wall [m/s]."""
DRAG = 200.0
"""Lattice-solid damping [N s/m]: stops a particle in m / DRAG = 40 s."""
ROWS, ROW = 2, 8
"""Rows of particles that rain down each period, and particles in one."""
HEIGHT = 30.0
"""Where they begin to fall [m]."""
START = 5.0
"""Speed at which they begin [m/s]."""
MATERIAL = dict(density=DENSITY, kn=KN, ks=KN, fric=0.3, damp=0.1)
BOND = dict(ebmod=KN, gbmod=KN, tstrength=2e6, sstrength=2e6, tolerate=0.01 * R)
"""Breaks under 4e6 N, what two particles feel that meet at 6 m/s: v sqrt(m k), k = KN / 2."""


def build(sim: hpcdem.Simulation) -> None:
    """The trough and some 250 particles on a loose lattice."""
    sim.start()
    sim.set(gravity=(0.0, -GRAVITY), dt=DT, lsm=DRAG)
    sim.box(-20.0, WIDTH + 20.0, -5.0, TOP + 40.0, kn=KN, ks=KN)
    sim.wall(FLOOR, ((-15.0, 0.0), (WIDTH, 0.0)), kn=KN, ks=KN, fric=0.3)
    sim.wall(LEFT, ((0.0, TOP), (0.0, 0.0)), kn=KN, ks=KN, fric=0.3)
    right(sim)
    sim.gen_grid([0.8 * R, R, 1.2 * R], (1.0, WIDTH - 1.0), (0.5, 27.0), group="bed")
    sim.prop(**MATERIAL)


def right(sim: hpcdem.Simulation) -> None:
    """The right wall, made again: contacts with the old one are forgotten."""
    sim.wall(RIGHT, ((WIDTH, 0.0), (WIDTH, TOP)), kn=KN, ks=KN, fric=0.3)


def turn(sim: hpcdem.Simulation, k: int) -> None:
    """The k-th turn, at the end of a period: wall and tilt change sides."""
    side = 1.0 if k % 2 == 0 else -1.0
    sim.wall(LEFT, xv=side * SPEED)
    sim.set(gravity=(side * TILT, -GRAVITY))


def rain(sim: hpcdem.Simulation, k: int) -> tuple[int, int]:
    """Two bonded rows high above the heap, unless others are still there; returns how many particles and bonds."""
    made = 0
    if np.any(sim.gather("y") > HEIGHT - 3.0 * R):
        return 0, 0
    for row in range(ROWS):
        x = 12.0 + (7 * k + 19 * row) % 28
        y = HEIGHT + 3.0 * row
        made += sim.gline((x, y), (x + 2.0 * R * (ROW - 0.5), y), R, color=k % 10, group="rain")
    young = "group rain"
    sim.prop(young, **MATERIAL, yv=-START)
    bonds = sim.bond(young, **BOND)
    sim.prop(young, group="bed")
    return made, bonds


def tallest(sim: hpcdem.Simulation) -> float:
    """The largest kinetic energy the model can have from falling through the whole trough [J]."""
    mass = float(np.sum(sim.gather("mass")))
    return mass * (GRAVITY + TILT) * TOP
