"""Quantities of flow nodes and channels that can be queried."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.faces import Faces
from hpcdem.physics.flow.network import LINKS

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks


NODE_QUANTITIES: dict[str, tuple[str, str]] = {
    "pressure": ("Pa", "pressure of the fluid"),
    "saturation": ("1", "saturation: filled part of the volume"),
    "fluid": ("m2", "volume of the fluid at its density at zero pressure"),
    "volume": ("m2", "volume for fluid: half of each channel"),
    "inflow": ("m2/s", "inflow by conditions in the last sub-step"),
    "temperature": ("K", "temperature of the fluid; NaN without a thermal model of it"),
    "concentration": ("1", "volume of proppant over that of the slurry; NaN without proppant"),
    "proppant": ("m2", "volume of proppant; NaN without it"),
    "pack_pressure": ("Pa", "pressure of a pack of proppant on its walls; NaN without proppant"),
}
CHANNEL_QUANTITIES: dict[str, tuple[str, str]] = {
    "pressure": ("Pa", "mean pressure of its ends"),
    "saturation": ("1", "mean saturation of its ends"),
    "aperture": ("m", "hydraulic aperture"),
    "flow_rate": ("m2/s", "volume that flows along the lower face of the joint, from its first corner on"),
    "velocity": ("m/s", "mean velocity: flow rate over the aperture"),
    "temperature": ("K", "mean temperature of the fluid at its ends; NaN without a thermal model of it"),
    "concentration": ("1", "mean concentration of proppant at its ends; NaN without it"),
    "pack_pressure": ("Pa", "mean pressure of packs at its ends; NaN without proppant"),
}
_OF_OTHERS = ("temperature", "concentration", "proppant", "pack_pressure")
"""Quantities that are stored by other physics."""
QUANTITIES = {FLOW_NODE: NODE_QUANTITIES, CHANNEL: CHANNEL_QUANTITIES}
"""Quantities of flow nodes and channels that can be queried: unit and meaning."""


class Values(Faces):
    """more: by name quantities (n,) of this rank's flow nodes that other physics keep."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self.more: dict[str, Callable[[], np.ndarray]] = {}

    def owned_values(self, kind: str, names: list[str]) -> dict[str, np.ndarray]:
        """Columns of this rank's flow nodes or channels (those on whose lower face its elements lie), with their
        "number"."""
        self.blocks.close_model()
        if self.frozen:
            self.update_volumes()
        if kind == FLOW_NODE:
            made = {
                "number": self.number, "pressure": self.state[: len(self.number), kernels.P],
                "saturation": self.state[: len(self.number), kernels.S], "fluid": self.nodes[:, kernels.W],
                "volume": self.nodes[:, kernels.V], "inflow": self.nodes[:, kernels.INFLOW],
                **{name: self._of_others(name)[: self.owned] for name in _OF_OTHERS},
            }  # fmt: skip
        else:
            blocks = self.blocks
            row = blocks.where[self.channels_here // 4]
            mine = (row >= blocks.owned.start) & (row < blocks.owned.stop)
            ends, aperture = self._corners[mine], self.apertures()[mine]
            self._find_flows(0.0)
            flux = self.fluxes()[mine]
            wanted = [name for name in names if name in _OF_OTHERS]
            others = {name: self._of_others(name, copies=True)[ends].mean(axis=1) for name in wanted}
            made = {
                "number": self.channels_here[mine], "aperture": aperture, "flow_rate": flux,
                "pressure": self.state[ends, kernels.P].mean(axis=1),
                "saturation": self.state[ends, kernels.S].mean(axis=1),
                "velocity": flux / aperture, **others,
            }  # fmt: skip
        return {name: made[name].copy() for name in ("number", *names)}

    def _of_others(self, name: str, copies: bool = False) -> np.ndarray:
        """A quantity of other physics of the flow nodes held here, NaN where missing; with copies, then
        collective, those of other ranks too."""
        own = self.more[name]() if name in self.more else np.full(self.owned, math.nan)
        out = np.append(own, np.full(len(self.held) - len(own), math.nan))
        if copies and self._copies is not None:
            column = self.state[: len(out), kernels.P]
            kept = column.copy()
            column[:] = out
            self._copies.refresh()
            out = column.copy()
            column[:] = kept
        return out

    def values(self, kind: str, name: str, numbers: np.ndarray | None = None) -> np.ndarray:
        """A quantity of `QUANTITIES` of flow nodes or channels (None: all), on all ranks; NaN where missing."""
        if name not in QUANTITIES[kind]:
            raise CommandError(f"there is no quantity {name} of a {kind}; available: {', '.join(QUANTITIES[kind])}")
        mine = self.owned_values(kind, [name])
        numbers = self.numbers(kind) if numbers is None else numbers
        found = np.full(int(max(numbers.max(initial=-1), mine["number"].max(initial=-1))) + 1, math.nan)
        found[mine["number"]] = mine[name]
        return self._on_all_ranks(found[numbers])

    def link_flows(self) -> np.ndarray:
        """Present flow along the links (l,) of all channels [m2/s], on all ranks."""
        blocks, links = self.blocks, LINKS[self.blocks.dim]
        blocks.close_model()
        self._find_flows(0.0)
        row = blocks.where[self.channels_here // 4]
        mine = (row >= blocks.owned.start) & (row < blocks.owned.stop)
        found = np.full((len(self.network.channels), links), math.nan)
        found[np.searchsorted(self.network.channels, self.channels_here[mine])] = self._q.reshape(-1, links)[mine]
        return self._on_all_ranks(found.reshape(-1))

    def _on_all_ranks(self, values: np.ndarray) -> np.ndarray:
        """Values (n,), NaN but on one rank at most: to the last bit."""
        bits, nothing = values.view(np.int64), np.array([math.nan]).view(np.int64)[0]
        return (self.blocks.comm.sum_into(bits - nothing) + nothing).view(np.float64)
