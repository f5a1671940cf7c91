"""The energy of blocks and their fluid in implicit steps: what was pumped in, and where it went.

The blocks are in balance at both ends of a step. Pressures are the means of both ends; the work of joints is that
along the straight way of the nodes between them, as joints soften, with what they remember of the way before. So what
does not add up tells how well steps follow the fracture: energy is missing in a jump from one balance to another,
which would radiate waves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import equilibrium
from hpcdem.physics.fdem.budget import WORK
from hpcdem.physics.fdem.kernels import energy
from hpcdem.physics.flow import kernels

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.physics.flow.implicit import Balance, Fluid, Step

POINTS = 5
"""Number of points along a step at which the forces of joints are evaluated."""


def stored(sim: Blocks) -> tuple[float, float]:
    """Energy stored in elements and in joints now [J/m], in space [J]. Collective."""
    return exact_sum(sim.local.stresses()[1], sim.comm), exact_sum(sim.local.stored_in_joints(), sim.comm)


def of_blocks(
    sim: Blocks, fluid: Fluid, a: np.ndarray, b: np.ndarray, before: np.ndarray, after: np.ndarray
) -> tuple[float, float, float]:
    """Work of joints, of the fluid, and of gravity and other loads, on the way of the nodes (nn, dim) from a to b, at
    which corners are afterwards; before, after (n, kernels.STATE): states of the flow nodes there. Collective."""
    equilibrium.place_corners(sim, a)
    displacement = sim.x.copy()
    equilibrium.place_corners(sim, b)
    # With the time step 1 of the static mode a velocity; rows of triangles have fewer columns for these.
    displacement = np.ascontiguousarray((sim.x - displacement)[:, : sim.v.shape[1]])
    shown = fluid.flow.state.copy()

    def done(state: np.ndarray | float, points: np.ndarray, weights: np.ndarray) -> dict[str, float]:
        fluid.flow.state[:] = state
        work = np.zeros((sim.n_own, energy.WORK))
        for point, weight in zip(points, weights):
            equilibrium.place_corners(sim, a + 0.5 * (1.0 + point) * (b - a))
            seen = sim.local.evaluation(contact=False)
            sim.local.book(
                displacement,
                displacement,
                0.5 * weight,
                0.0,
                seen.of_joints,
                seen.pushed,
                seen.felt,
                seen.outside,
                work,
            )
        return {name: exact_sum(work[:, k], sim.comm) for k, name in enumerate(WORK)}

    dry = done(0.0, *np.polynomial.legendre.leggauss(POINTS))
    middle = np.zeros(1), np.full(1, 2.0)
    mean = 0.5 * np.concatenate([(before + after)[fluid.held_rows], fluid.shore_before + shown[len(fluid.held_rows) :]])
    pushed = done(mean, *middle)["outside"] - done(0.0, *middle)["outside"]
    fluid.flow.state[:] = shown
    equilibrium.place_corners(sim, b)
    return dry["joints"], pushed, dry["gravity"] + dry["outside"]


def of_fluid(
    fluid: Fluid, step: Step, before: np.ndarray, volume: np.ndarray, now: Balance, given: np.ndarray
) -> dict[str, float]:
    """Compute the energies of the fluid in a step. before: state of the nodes (n, kernels.STATE), volume (n,) [m2] at
    its beginning; given (n,) [m2]: inflow. The fluid of `Fluid` is that of the end."""
    mean = 0.5 * (before[:, kernels.P] + before[:, kernels.E] + now.state[:, kernels.P] + now.state[:, kernels.E])
    gone = np.bincount(fluid.end, now.lost[fluid.both], fluid.n)

    def stores(state: np.ndarray, volume: np.ndarray, content: np.ndarray) -> float:
        return float((0.5 * volume * state[:, kernels.P] ** 2 / fluid.bulk + content * state[:, kernels.E]).sum())

    return {
        "pumped": float((mean * given).sum()),
        "leaked": float((mean * gone).sum()),
        "viscous": float((mean * (given - gone - (fluid.fluid - step.fluid))).sum()),
        "fluid": stores(now.state, now.volume, fluid.fluid) - stores(before, volume, step.fluid),
    }
