"""The time of a step from its parts: strips as they are, blocks as they could be. Pure arithmetic; SI units."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

ROW = 64
"""Bytes of a ghost."""
SHARE = 1.5
"""Bytes through memory in a step over bytes of the arrays: all are read, about half are written (an estimate)."""


@dataclass(frozen=True)
class Parts:
    """What was measured, in seconds unless said otherwise.

    fixed: of a step, whatever its size; sizes, particle: per particle-step of a rank of so many particles in a low bed;
    heights, tall: factor on that where a column holds so many particles; force: share of the forces in it;
    slots, ghost_slots: pairs in the list per particle, and those that a left ghost adds; look, rebuild: (fixed, per
    particle); exchange: (start, per message, per byte); reduce: over two ranks; waits: of a rebuild for all others;
    per_rank: own work in a rebuild per rank of the job; pack: per row; company: factor on all own work beside another
    busy rank; frame, frame_b: of a frame per particle [s, B]; arrays_b: of the arrays per particle [B];
    width: of a column in mean diameters; looks, looks_pushed, rebuilds_pushed: per step.
    """

    fixed: float
    sizes: tuple[float, ...]
    particle: tuple[float, ...]
    heights: tuple[float, ...]
    tall: tuple[float, ...]
    force: float
    slots: float
    ghost_slots: float
    look: tuple[float, float]
    rebuild: tuple[float, float]
    exchange: tuple[float, float, float]
    reduce: float
    waits: float
    per_rank: float
    pack: float
    company: float
    frame: float
    frame_b: float
    arrays_b: float
    width: float
    looks: float
    looks_pushed: float
    rebuilds_pushed: float

    def per_particle(self, n: float, height: float) -> float:
        """Own work per particle-step of a rank of n particles in columns of `height` particles."""
        return between(n, self.sizes, self.particle) * between(height, self.heights, self.tall)


@dataclass(frozen=True)
class Machine:
    """Where it would run. latency [s] and bandwidth [B/s] of the network between nodes of `cores` cores that share
    memory [B/s] and have a cache [B] each. Between ranks of a node the measured exchange counts."""

    name: str
    cores: float = math.inf
    latency: float = 0.0
    bandwidth: float = math.inf
    memory: float = math.inf
    cache: float = math.inf


HERE = Machine("one shared memory")
FABRIC = Machine("100 Gb/s fabric", 64, 2e-6, 12e9, 400e9, 4e6)
ETHERNET = Machine("10 Gb/s Ethernet", 64, 30e-6, 1.2e9, 400e9, 4e6)


@dataclass(frozen=True)
class Model:
    """particles in so many columns and rows of cells."""

    particles: float
    columns: int
    rows: int

    @classmethod
    def bed(cls, particles: float, aspect: float, width: float) -> Model:
        """A bed `aspect` times as long as high, in a square grid; width of a cell in diameters."""
        high = math.sqrt(particles / aspect)
        return cls(particles, max(1, int(aspect * high / width)), max(1, int(high / width)))

    @property
    def height(self) -> float:
        """Particles of a column."""
        return self.particles / self.columns


@dataclass(frozen=True)
class Step:
    """Seconds of a step by part, on the busiest rank. own: an even share of the particles, on a core that has memory
    and cache for itself; sharing: what neighbours on the machine add to that; imbalance: columns cannot be cut."""

    own: float
    sharing: float
    imbalance: float
    ghosts: float
    exchange: float
    fixed: float
    look: float
    rebuild: float
    ranks: int
    particles: float

    @property
    def seconds(self) -> float:
        """All together."""
        return sum(getattr(self, name) for name in PARTS)

    @property
    def speed(self) -> float:
        """Particle-steps per second of the whole model."""
        return self.particles / self.seconds

    @property
    def efficiency(self) -> float:
        """Time of an even share of the particles on a core by itself over the time of the step; 1 is perfect."""
        return self.own / self.seconds

    @property
    def at_work(self) -> float:
        """Share of the step in which a rank works on an even share of the particles, slowed by the others or not."""
        return (self.own + self.sharing) / self.seconds


PARTS = ("own", "sharing", "imbalance", "ghosts", "exchange", "fixed", "look", "rebuild")


class TooMany(ValueError):
    """More ranks than columns."""


def between(x: float, at: Sequence[float], values: Sequence[float]) -> float:
    """Linear in log x between the points, the end values outside."""
    if x <= at[0]:
        return values[0]
    if x >= at[-1]:
        return values[-1]
    k = bisect_left(at, x)
    share = math.log(x / at[k - 1]) / math.log(at[k] / at[k - 1])
    return values[k - 1] + share * (values[k] - values[k - 1])


def strips(
    parts: Parts, model: Model, ranks: int, machine: Machine = HERE, looks: float | None = None, rebuilds: float = 0.0
) -> Step:
    """A step on so many ranks, with so many looks and rebuilds per step."""
    if ranks > model.columns:
        raise TooMany(f"{ranks} ranks, but {model.columns} columns")
    height, sides = model.height, min(2, ranks - 1)
    most = math.ceil(model.columns / ranks) * height
    ghosts = sides * height
    extra = height if ranks > 1 else 0.0
    comm = _exchange(parts, machine, ranks, sides, ROW * ghosts, ROW * ghosts)
    return _step(parts, model, ranks, machine, most, ghosts, extra, comm, looks, rebuilds)


def blocks(
    parts: Parts, model: Model, ranks: int, machine: Machine = HERE, looks: float | None = None, rebuilds: float = 0.0
) -> Step:
    """The same with the best grid of px x py blocks of cells: up to eight neighbours, rows packed and unpacked."""
    cell = model.height / model.rows
    found = []
    for px in range(1, ranks + 1):
        py = ranks // px
        if px * py != ranks or px > model.columns or py > model.rows:
            continue
        a, b = math.ceil(model.columns / px), math.ceil(model.rows / py)
        sx, sy = min(2, px - 1), min(2, py - 1)
        ghosts = cell * (sx * b + sy * a + sx * sy)
        # Of the ranks of a node only the outer ones send into the network: the border of a square of `cores` blocks.
        out = math.sqrt(min(machine.cores, ranks)) * ROW * ghosts
        comm = _exchange(parts, machine, ranks, (1 + sx) * (1 + sy) - 1, ROW * ghosts, out) + 2 * parts.pack * ghosts
        found.append(_step(parts, model, ranks, machine, a * b * cell, ghosts, ghosts / 2, comm, looks, rebuilds))
    if not found:
        raise TooMany(f"{ranks} ranks, but {model.columns} x {model.rows} cells")
    return min(found, key=lambda step: step.seconds)


def _exchange(parts: Parts, machine: Machine, ranks: int, messages: int, size: float, out: float) -> float:
    """Of `size` bytes each way between ranks of a node, `out` through its network. Nothing is hidden behind work."""
    if not messages:
        return 0.0
    start, message, byte = parts.exchange
    inside = start + message * messages + byte * size
    if ranks <= machine.cores:
        return inside
    return max(inside, start + message * messages + machine.latency + out / machine.bandwidth)


def reduction(parts: Parts, machine: Machine, ranks: int) -> float:
    """Of a few numbers over all ranks: a tree."""
    if ranks == 1:
        return 0.0
    inside = math.log2(min(ranks, machine.cores))
    outside = math.log2(max(1.0, ranks / machine.cores))
    return parts.reduce * (inside + outside) + machine.latency * outside


def _step(
    parts: Parts, model: Model, ranks: int, machine: Machine, most: float, ghosts: float, extra: float, comm: float,
    looks: float | None, rebuilds: float,
) -> Step:  # fmt: skip
    n = model.particles / ranks
    alone = parts.per_particle(n, model.height)
    each = alone * (parts.company if ranks > 1 else 1.0)
    # What does not fit into the cache of its core comes through the memory that the ranks of a node share.
    beyond = max(0.0, 1.0 - machine.cache / (n * parts.arrays_b))
    if beyond > 0.0 and ranks > 1:
        each = max(each, beyond * SHARE * parts.arrays_b * min(ranks, machine.cores) / machine.memory)
    together = reduction(parts, machine, ranks)
    slow = each / alone
    look = (parts.looks if looks is None else looks) * (parts.look[0] + slow * parts.look[1] * most + together)
    rebuild = parts.rebuild[0] + slow * parts.rebuild[1] * (most + ghosts) + parts.waits * together
    rebuild += parts.per_rank * ranks if ranks > 1 else 0.0
    return Step(
        own=n * alone, sharing=n * (each - alone), imbalance=(most - n) * each,
        ghosts=extra * each * parts.force * parts.ghost_slots / parts.slots,
        exchange=comm, fixed=parts.fixed, look=look, rebuild=rebuilds * rebuild, ranks=ranks, particles=model.particles,
    )  # fmt: skip


def fastest(parts: Parts, model: Model, machine: Machine, rebuilds: float, looks: float) -> Step:
    """Strips on the power of two that is fastest."""
    found = [strips(parts, model, p, machine, looks, rebuilds) for p in powers(model.columns)]
    return max(found, key=lambda step: step.speed)


def powers(most: int) -> list[int]:
    """1, 2, 4, ... up to `most`."""
    return [1 << k for k in range(most.bit_length()) if 1 << k <= most]
