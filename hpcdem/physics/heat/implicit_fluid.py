"""The fluid in implicit steps of heat: its flow nodes are unknowns beside the nodes of the rock.

Fluid flows as it does at this moment:

    rho C W (T' - T) / dt = rho C sum(side q (T_face' - T')) + conduction + sum(a (T_wall' - T')),

all at the end of the step; T_face: that of the node upstream, or of second order. The matrix is that of first order. By
the limiter a node is the mean, with weights from 0 on, of those around it, so nothing goes beyond them.
Everything here is known to all ranks and the same on all: it is little beside the factors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE
from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.flow.network import at_nodes
from hpcdem.physics.heat import kernels
from hpcdem.physics.heat.fluid import FluidHeat, part
from hpcdem.physics.heat.model import Heat


@dataclass
class Fluid:
    """The network of a model as arrays. ends (m, 2): rows of nodes; length (m,) [m]; q (m,) [m2/s]; conduct (m,),
    exchange (m, 2): [W/(m K)] along channels, and with each wall at their ends; walls (m, 4): nodes of heat of the
    rock, two at each end; held (n,): row of the prescribed temperatures, -1: free; capacity (n,) [J/(m K)]; t (n,):
    temperatures."""

    of: FluidHeat
    ends: np.ndarray
    length: np.ndarray
    q: np.ndarray
    conduct: np.ndarray
    exchange: np.ndarray
    walls: np.ndarray
    held: np.ndarray
    capacity: np.ndarray
    t: np.ndarray

    @staticmethod
    def there(heat: Heat) -> Fluid | None:
        """The fluid of a closed model; None if heat does not flow with fluid. Collective."""
        fluid = heat.flowing
        if fluid is None:
            return None
        flow, network = fluid.flow, fluid.flow.network
        row_of = np.full(len(network.there), -1, np.int64)
        row_of[network.nodes] = np.arange(len(network.nodes))
        ends = row_of[network.ends]
        aperture = np.repeat(flow.values(CHANNEL, "aperture"), fluid.links)
        w, s, t = (flow.values(FLOW_NODE, name) for name in ("fluid", "saturation", "temperature"))
        q, wet = fluid.crossing(flow.link_flows(), s, ends, network.ends)
        sides, ratio, part_of_wall = fluid.shapes(network.channels)
        transfers = np.repeat(fluid.transfers(network.channels), fluid.links)
        exchange = part_of_wall[:, None] * transfers[:, None] * part(s)[ends]
        return Fluid(
            fluid, ends, fluid.lengths(sides, q), q, fluid.constant("conductivity") * aperture * wet / ratio, exchange,
            heat.at.number[fluid.walls(network.channels)], fluid.held[network.nodes].astype(np.int64) - 1,
            fluid.rho_c * w, t,
        )  # fmt: skip

    def made_for(self) -> tuple[bytes, ...]:
        """Return everything that determines the matrix."""
        parts = (self.ends, self.q, self.conduct, self.exchange, self.walls, self.held, self.capacity)
        return tuple(one.tobytes() for one in parts)

    def free(self, dt: float) -> np.ndarray:
        """(n,) bool: nodes whose temperature is unknown: dry ones keep theirs."""
        n, rho_c = len(self.t), self.of.rho_c
        total = self.capacity / dt
        for end in range(2):
            into = np.maximum(self.q if end else -self.q, 0.0) * rho_c
            total = total + np.bincount(self.ends[:, end], into + self.conduct + 2.0 * self.exchange[:, end], n)
        return (self.held < 0) & (total > 0.0)

    @property
    def second(self) -> bool:
        """Advection is of second order."""
        return self.of.constant("second_order") > 0.0

    def upstream(self, t: np.ndarray) -> np.ndarray:
        """Select the temperatures (m,) of the upstream nodes of the channels from those of all nodes (n,)."""
        return t[np.where(self.q > 0.0, *self.ends.T)]

    def beyond(self, t: np.ndarray) -> np.ndarray:
        """Return the difference (m,) between temperatures of the fluid in channels, in second order, and those
        upstream."""
        state, out = np.zeros((len(t), kernels.FLUID_STATE)), np.empty(len(self.q))
        state[:, kernels.T], state[:, kernels.FULL] = t, self.capacity
        kernels.upstream(*at_nodes(self.ends, len(t)), self.ends, self.q, self.length, self.held, state, state)
        kernels.faces(self.ends, self.q, self.length, True, 0.0, state, out)
        return out - self.upstream(t)

    def inflow(self, t: np.ndarray, rock: np.ndarray, beyond: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Heat [W/m] that nodes (n,) of these temperatures get, and nodes of the rock (k,) of theirs; beyond (m,): see
        there, 0 in first order."""
        n, (a, b) = len(t), self.ends.T
        rho_c, out = self.of.rho_c, np.zeros(len(rock))
        face = self.upstream(t) + beyond
        along = self.conduct * (t[a] - t[b])
        got = np.bincount(b, rho_c * self.q * (face - t[b]) + along, n)
        got += np.bincount(a, -rho_c * self.q * (face - t[a]) - along, n)
        for k in range(4):
            passed = self.exchange[:, k // 2] * (t[self.ends[:, k // 2]] - rock[self.walls[:, k]])
            got -= np.bincount(self.ends[:, k // 2], passed, n)
            out += np.bincount(self.walls[:, k], passed, len(rock))
        return got, out

    def pieces(self, dt: float, first: int) -> list[Pieces]:
        """Make the pieces of channels and of nodes, whose numbers begin with `first`, for rank 0."""
        mine = slice(None) if self.of.blocks.comm.rank == 0 else slice(0, 0)
        ends, q = self.ends[mine], self.of.rho_c * self.q[mine]
        conduct, exchange = self.conduct[mine], self.exchange[mine]
        out = np.zeros((len(ends), 6, 6))
        for end in range(2):
            into = np.maximum(q if end else -q, 0.0)
            out[:, end, end] += into + conduct + 2.0 * exchange[:, end]
            out[:, end, 1 - end] -= into + conduct
            for wall in (2 + 2 * end, 3 + 2 * end):
                out[:, end, wall] -= exchange[:, end]
                out[:, wall, end] -= exchange[:, end]
                out[:, wall, wall] += exchange[:, end]
        node = np.column_stack([first + ends, self.walls[mine]])
        nodes = np.arange(len(self.t))[mine]
        own = (self.capacity / dt)[mine, None, None]
        return [Pieces(np.repeat(self.of.flow.network.channels, self.of.links)[mine], node, _first_of_two(out)),
                Pieces(nodes, first + nodes[:, None], _first_of_two(own))]  # fmt: skip

    def take(self, dt: float, t: np.ndarray, got: np.ndarray) -> None:
        """Nodes have these temperatures (n,), with this inflow of heat; what came with fluid and by conditions is
        booked."""
        fluid = self.of
        n, (a, b) = len(t), self.ends.T
        net = np.bincount(b, self.q, n) - np.bincount(a, self.q, n)
        stored = self.capacity * (t - self.t)
        if np.isfinite(dt):
            # Fluid that is not carried on by channels leaves with the temperature of its node.
            brought = -dt * fluid.rho_c * t * net
            brought[self.held >= 0] += (stored - dt * got)[self.held >= 0]
        else:
            brought = stored  # with what the rock is given: all that has come in
        fluid.put(fluid.flow.network.nodes, t, brought)


def _first_of_two(stiffness: np.ndarray) -> np.ndarray:
    """(m, 2 k, 2 k): the first of the two unknowns of each node."""
    m, k, _ = stiffness.shape
    out = np.zeros((m, 2 * k, 2 * k))
    out[:, ::2, ::2] = stiffness
    return out
