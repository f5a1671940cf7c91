"""Nodes of a field that diffuses in elements: corners that are connected, as the joints between them hold now.

Corners that are connected through faces that are not broken are one node and carry equal copies of the value. Every
holder of a node adds what flows to all its corners in the order of elements, so the bits depend on neither ranks nor
threads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.errors import PhysicsError
from hpcdem.physics.fdem import build
from hpcdem.physics.fdem.kernels.elements import FORCE
from hpcdem.physics.field import kernels

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks


class Nodes:
    """Nodes of the elements of a rank.

    number (4 ne,), leads (nodes of the model,): the node of each corner of the mesh, -1: none, and their lowest
    corners; ids (n,): the numbers of those here; begin (n + 1,), corner: where their corners are in the table of
    values, flat, by the numbers of their elements; capacity (n,); held (n,): row of the table of prescribed values, -1:
    free.
    """

    def __init__(self, blocks: Blocks, name: str, capacity: np.ndarray, held: np.ndarray) -> None:
        """name: of the field; capacity (rows, w): of the corners held here; held (np,): rows of what is prescribed,
        from 1. PhysicsError on all ranks if a node is too wide for one of them. Collective."""
        mesh, own = blocks.the_mesh(), blocks.owned

        def find() -> tuple[np.ndarray, ...]:
            node, lead = mesh.corner_clusters(blocks.partner, blocks.open | np.repeat(~blocks.alive, 4))
            node[~blocks.alive] = -1
            node = node.astype(np.int32, copy=False)
            sizes = np.bincount(node[node >= 0], minlength=len(lead))
            member_begin = np.zeros(len(lead) + 1, np.int32)
            member = np.empty(int(sizes[sizes > 1].sum()), np.int32)
            build.cluster_members(node, sizes, member_begin, member)
            return node, lead, member_begin, member

        node, lead, member_begin, member = blocks.per_node(find)
        self.number, self.leads = node.reshape(-1), lead
        real = node[blocks.number[own]] >= 0
        nothing, scratch = np.empty(0, np.int64), np.full(len(lead), -1, np.int32)
        args = blocks.number, blocks.n_left, blocks.n_own, real, node, member_begin, 0, scratch
        n = build.special_nodes(*args, nothing, nothing, nothing)
        first, start, one = (np.empty(n, np.int64) for _ in range(3))
        build.special_nodes(*args, first, start, one)
        width, total = capacity.shape[1], int(one.sum())
        self.begin = np.zeros(n + 1, np.int64)
        corner, place, again = (np.empty(total, np.int64) for _ in range(3))
        lost = build.place_nodes(
            first, start, one, member, blocks.where, mesh.cells, blocks.v.shape[1], FORCE, 2, self.begin, corner, place,
            again,
        )  # fmt: skip
        lost = int(blocks.comm.max_into(np.array([lost], np.int64))[0])
        if lost >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the node of {name} at corner {lost} spans more than a column of "
                f"{blocks.rebuild_state.side:g} m: intact joints have opened too far"
            )
        self.corner = corner // 8 * width + corner % 8 // 2
        self.ids = self.number[first]
        self.capacity = self.sums(capacity)
        self.held = held[mesh.cells.reshape(-1)[first]].astype(np.int64) - 1

    def __len__(self) -> int:
        return len(self.begin) - 1

    def sums(self, values: np.ndarray) -> np.ndarray:
        """(n,) of values (rows, w) at corners."""
        out = np.empty(len(self))
        kernels.sums(self.begin, self.corner, values.reshape(-1), out)
        return out

    def first(self) -> np.ndarray:
        """(n,) where the first corner of each is, flat."""
        return self.corner[self.begin[:-1]]

    def put(self, values: np.ndarray, t: np.ndarray) -> None:
        """Set all corners of nodes to their values (n,), in t (rows, w)."""
        t.reshape(-1)[self.corner] = np.repeat(values, np.diff(self.begin))
