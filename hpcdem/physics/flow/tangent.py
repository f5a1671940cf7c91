"""Derivatives of the balance of the fluid (implicit.py) for Newton's method, as pieces of a matrix (fdem/linear.py)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.implicit import Balance, Fluid, Step
from hpcdem.physics.flow.network import LINKS, SHAPES, normals


@dataclass
class Tangent:
    """Tangent of the fluid of a model."""

    of: Fluid

    def _opens(self, x: np.ndarray, delta: np.ndarray) -> np.ndarray:
        """Derivatives of apertures delta (m,) of channels by the positions of their corners `at`, (m, dim corners)."""
        law = self.of.laws[self.of.law[:: LINKS[self.of.dim]]]
        moves = (delta > law[:, kernels.LEAST]) & (delta < law[:, kernels.MOST])
        dilate = law[:, kernels.DILATE, None]
        at, k = x[self.of.at], self.of.dim
        near, far = at[:, :k], at[:, k:][:, SHAPES[k].facing]
        across = normals(0.5 * (near + far))
        across /= np.linalg.norm(across, axis=1)[:, None]
        away = (far.sum(axis=1) - near.sum(axis=1)) / k
        slip = away - (away * across).sum(axis=1)[:, None] * across
        size = np.linalg.norm(slip, axis=1)
        along = slip / np.maximum(size, 1e-300)[:, None]
        along -= (along * across).sum(axis=1)[:, None] * across  # of what is rounding it is any direction
        gains = law[:, kernels.DILATE] * size < law[:, kernels.GAIN]
        opens = across + np.where(gains[:, None], dilate, 0.0) * along
        side = np.repeat([-1.0, 1.0], k)[:, None] / k
        return (np.where(moves, 1.0, 0.0)[:, None, None] * side * opens[:, None, :]).reshape(self.of.m, -1)

    def pieces(self, step: Step, now: Balance, u: np.ndarray, x: np.ndarray, first: int) -> list[Pieces]:
        """Derivatives for Newton's method, as pieces of a matrix (see linear.py) whose "nodes" from `first` on are flow
        nodes, then their packs if some bear: of channels, on rank 0, of faces of this rank, and of nodes, on rank 0."""
        rank = self.of.flow.blocks.comm.rank
        mine = slice(None) if rank == 0 else slice(0, 0)
        own = [Pieces(one.key[mine], one.node[mine], one.stiffness[mine]) for one in self._own_pieces(now, u, first)]
        made = [
            self._channel_pieces(step, now, u, x, first, mine), *own,
            *self._face_pieces(self._rises(u, now)[0], x, first + self.of.first, len(self.of.face_key)),
        ]  # fmt: skip
        if now.slow is not None:
            made.append(self._turbulent_pieces(step, now, u, first, mine))
        if now.packs is not None:
            packs = first + self.of.n + np.arange(self.of.n)
            made += self._pack_pieces(now, x, packs, mine)
            made += self._face_pieces(np.ones(self.of.n), x, packs, self.of.of_channels)
        return made

    def _pack_pieces(self, now: Balance, x: np.ndarray, packs: np.ndarray, mine: slice) -> list[Pieces]:
        """Make the derivatives of w - w(V) by w itself, and by the corners of the channels around each node. packs
        (n,): their "nodes"."""
        assert now.packs is not None
        dim, ends = self.of.dim, self.of.ends[mine]
        own = np.zeros((len(packs[mine]), dim, dim))
        own[:, 0, 0] = 1.0
        table = now.table[mine]
        by_x = self._opens(x, now.table[:: LINKS[dim], kernels.APERTURE])[self.of.of][mine]
        by_x *= (table[:, kernels.HALF] / table[:, kernels.APERTURE])[:, None]
        width = by_x.shape[1]
        out = np.zeros((len(ends), width + 2 * dim, width + 2 * dim))
        for end in range(2):
            out[:, width + dim * end, :width] = -now.packs[1, ends[:, end], None] * by_x
        nodes = np.column_stack([self.of.at[self.of.of][mine], packs[ends]])
        key = np.arange(self.of.n)[mine]
        return [Pieces(self.of.channels[self.of.of][mine], nodes, out), Pieces(key, packs[mine][:, None], own)]

    def _rises(self, u: np.ndarray, now: Balance) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of pressure and saturation (n,) by the variable that counts for each node."""
        full = (u > 0.0)[self.of.first]
        pressed = full & (~self.of.tied | (now.state[:, kernels.P] > 0.0))
        return np.where(pressed, self.of.p0, 0.0), np.where(full, 0.0, 1.0)

    def _own_pieces(self, now: Balance, u: np.ndarray, first: int) -> list[Pieces]:
        """Make the derivatives of storage; nodes that follow the variable of another node are no unknowns."""
        p_u, s_u = self._rises(u, now)
        volumes = np.maximum(now.volume, 1e-300)
        diagonal = np.where(now.held, volumes, now.volume * (s_u + p_u / self.of.bulk))
        tied = np.flatnonzero(self.of.tied)
        made = []
        for key, node, values in ((np.arange(self.of.n), self.of.first, diagonal), (tied, tied, volumes[tied])):
            stiffness = np.zeros((len(key), self.of.dim, self.of.dim))
            stiffness[:, 0, 0] = values
            made.append(Pieces(key, first + node[:, None], stiffness))
        return made

    def _channel_pieces(
        self, step: Step, now: Balance, u: np.ndarray, x: np.ndarray, first: int, mine: slice
    ) -> Pieces:
        """Make the derivatives of flow, leak-off and volume of channels by the variables at their ends and the corners
        of their faces."""
        ends, state = self.of.ends[mine], now.state
        delta, conduct, half, weight = now.table[mine].T
        m, dt = len(ends), step.dt
        p_u, s_u = self._rises(u, now)
        s_u = np.where(u[self.of.first] > -1.0, s_u, 0.0)
        p, s, e = (state[:, k][ends] for k in (kernels.P, kernels.S, kernels.E))
        s = np.maximum(s, 0.0)
        head = (p[:, 0] - p[:, 1]) + (e[:, 0] - e[:, 1]) * weight
        mean, down = 0.5 * (s[:, 0] + s[:, 1]), (head > 0.0) == (conduct > 0.0)
        up = np.where(down, s[:, 0], s[:, 1])
        wet = np.minimum(mean, up)
        part, slope = wet * wet * (3.0 - 2.0 * wet), 6.0 * wet * (1.0 - wet)
        of_mean = mean <= up
        by_s = np.column_stack([np.where(of_mean, 0.5, down), np.where(of_mean, 0.5, ~down)])
        sign = np.array([1.0, -1.0])
        by_u = conduct[:, None] * (
            part[:, None] * sign * p_u[ends] + (head * slope)[:, None] * by_s * s_u[ends]
        )  # of q
        leak_u = np.zeros((m, 2))
        at = np.flatnonzero(now.lost[mine] > 0.0)
        if len(at):
            over = 0.5 * p[at].sum(axis=1) - self.of.laws[self.of.law[mine][at], kernels.PORE]
            power = np.where(self.of.laws[self.of.law[mine][at], kernels.FRONT] > 0.0, 0.5, 1.0)
            held = mean[at]
            by_part = now.lost[mine][at] / np.maximum(held * held * (3.0 - 2.0 * held), 1e-300)
            leak_u[at] = 0.5 * (
                (now.lost[mine][at] * power / over)[:, None] * p_u[ends[at]]
                + (by_part * 6.0 * held * (1.0 - held))[:, None] * s_u[ends[at]]
            )
        by_x = self._opens(x, now.table[:: LINKS[self.of.dim], kernels.APERTURE])[self.of.of][mine]
        # Blocks that are at rest need no columns.
        dim, first_row = self.of.dim, by_x.shape[1] if self.of.flow.blocks.options.mechanical else 0
        fill = state[:, kernels.S] + state[:, kernels.P] / self.of.bulk
        out = np.zeros((m, first_row + 2 * dim, first_row + 2 * dim))
        cubic = 3.0 if now.slow is None else np.where(now.slow[mine] < 1.0, 12.0 / 7.0, 3.0)  # of q by delta
        for end in range(2):
            row = first_row + dim * end
            out[:, row, first_row::dim] = sign[end] * dt * by_u + leak_u
            if first_row:
                stored = half / delta * fill[ends[:, end]]
                out[:, row, :first_row] = (stored + sign[end] * dt * cubic * now.q[mine] / delta)[:, None] * by_x
            out[now.held[ends[:, end]], row, :] = 0.0
        of_fluid = first + self.of.first[ends]
        nodes = np.column_stack([self.of.at[self.of.of][mine], of_fluid]) if first_row else of_fluid
        return Pieces(self.of.channels[self.of.of][mine], nodes, out)

    def _turbulent_pieces(self, step: Step, now: Balance, u: np.ndarray, first: int, mine: slice) -> Pieces:
        """Make the derivatives of turbulent flow by the pressures in a channel, beside those of its conductance: it is
        proportional to the size of the gradient to the power -3/7, so with the flows F into its nodes and the heads h
        along its links, -3/7 F F^T / sum(q h)."""
        assert now.slow is not None
        links = LINKS[self.of.dim]
        ends, q = self.of.ends[mine].reshape(-1, links, 2), now.q[mine].reshape(-1, links)
        state = now.state
        conduct, weight = (now.table[mine, k].reshape(-1, links) for k in (kernels.CONDUCT, kernels.WEIGHT))
        p, e = state[:, kernels.P][ends], state[:, kernels.E][ends]
        head = (p[..., 0] - p[..., 1]) + (e[..., 0] - e[..., 1]) * weight
        nodes = ends[:, 0] if links == 1 else ends[:, [1, 2, 0], 0]
        side = (ends[:, None, :, 1] == nodes[:, :, None]).astype(float) - (ends[:, None, :, 0] == nodes[:, :, None])
        # Of full channels the same twice: what is half full flows slower by the same gradient.
        into, full = ((side * flow[:, None]).sum(axis=2) for flow in (q, conduct * head))
        power = np.maximum((conduct * head * head).sum(axis=1), 1e-300)
        fast = now.slow[mine].reshape(-1, links)[:, 0] < 1.0
        rate = np.where(fast, -3.0 / 7.0 * step.dt, 0.0) / power
        values = (rate[:, None] * into)[:, :, None] * (full * self._rises(u, now)[0][nodes])[:, None, :]
        values[now.held[nodes]] = 0.0
        k, dim = nodes.shape[1], self.of.dim
        out = np.zeros((len(nodes), k * dim, k * dim))
        out[:, ::dim, ::dim] = values
        return Pieces(self.of.channels[mine], first + self.of.first[nodes], out)

    def _face_pieces(self, p_u: np.ndarray, x: np.ndarray, variable: np.ndarray, count: int) -> list[Pieces]:
        """Make the derivatives of the forces on the first `count` faces by variables at their ends: kernels.loads,
        and in space those on sides of hexahedra. p_u (n,): derivatives of pressures by them; variable (n,): their
        "nodes"."""
        if len(self.of.shore_node):  # there pressures follow the lowest node of a well, or nothing that is unknown
            shore = self.of.flow.state[len(self.of.held_rows) :, kernels.P]
            p_u = np.append(p_u, np.where((self.of.shore_node >= 0) & (shore > 0.0), p_u[self.of.shore_node], 0.0))
            variable = np.append(variable, variable[np.maximum(self.of.shore_node, 0)])
        at, dim = x[self.of.face_at[:count]], self.of.dim
        normal = normals(at) / math.factorial(dim + 1)
        weight = (1.0 + np.eye(dim)) * p_u[self.of.face_node[:count]][:, None]
        half, fourth, g, e = (one[self.of.on_sides[0] < count] for one in self.of.on_sides)
        rest = np.delete(np.arange(len(at)), half)
        made = [self._pushed(rest, weight[rest], normal[rest], self.of.face_at[rest], variable)]
        if len(self.of.flow.blocks.the_mesh().hexes):
            share = np.concatenate([weight[half], np.zeros((len(half), 1, dim))], axis=1)
            share -= g[:, :, None] * (e[:, :, None] * weight[half]).sum(axis=1)[:, None]
            ends = np.column_stack([self.of.face_at[half], fourth])
            made.append(self._pushed(half, share, normal[half], ends, variable))
        return made

    def _pushed(
        self, of: np.ndarray, weight: np.ndarray, normal: np.ndarray, ends: np.ndarray, variable: np.ndarray
    ) -> Pieces:
        """Make the derivatives for some faces (k,): weight (k, ends, dim) of each variable on each end, ends (k, ends):
        their nodes."""
        (k, m, dim), key = weight.shape, self.of.face_key[of]
        out = np.zeros((k, (m + dim) * dim, (m + dim) * dim))
        for end in range(m):
            for by in range(dim):
                out[:, dim * end : dim * end + dim, dim * (m + by)] = weight[:, end, by, None] * normal
        return Pieces(key, np.column_stack([ends, variable[self.of.face_node[of]]]), out)
