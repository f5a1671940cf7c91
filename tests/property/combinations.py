"""Small models of blocks with one of each: kind of element, measure of strain, account, motion, and what flows.

Each is run as it is, and again with a checkpoint in its middle, written by itself or restored: the end must be the same
to the last bit.
"""

from __future__ import annotations

import itertools
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.flow.model import Flow
from hpcdem.session import Session
from tests.property import two_ways

ELEMENTS = ("tri", "six", "quad", "tet", "hex")
MOTIONS = ("dynamic", "static", "at once")
PHYSICS = ("dry", "flow", "heat")
MIDDLES = ("restore", "autosave")


@dataclass(frozen=True)
class Combination:
    """large: rotations count; account: of energy, which only looks."""

    element: str
    large: bool
    account: bool
    motion: str
    physics: str

    def __str__(self) -> str:
        strain, account = "large" if self.large else "small", "account" if self.account else "no account"
        return f"{self.element}, {strain} strain, {account}, {self.motion}, {self.physics}"

    @property
    def space(self) -> bool:
        return self.element in ("tet", "hex")

    def script(self, middle: str = "") -> str:
        """Its text; middle: "restore" saves and restores between the two runs."""
        dim = 3 if self.space else 2
        place = "({},0,0) ({},0.5,0.5)" if self.space else "({},0) ({},0.5)"
        cells = "2 1 1" if self.space else "3 2"
        kind = {"tet": "", "hex": " type hex", "six": " type tri"}.get(self.element, f" type {self.element}")
        up, across = (
            ("z", "velocity-x 0 velocity-y 0 velocity-z 0") if self.space else ("y", "velocity-x 0 velocity-y 0")
        )
        lines = [
            f"model new dim {dim}",
            f"mesh structured {place.format(0, 1)} cells {cells}{kind}",
            *(["mesh quadratic"] if self.element == "six" else []),
            f"model option large-strain {_switch(self.large)}",
            "element c-model mech-iso-e property density 2500 young 1e8 poisson-r 0.2 damp-f 0.1",
            "face-joint c-model c-i-c-i property friction 30 cohesion 1e5 tensile-strength 5e4 gf1 5 gf2 20 "
            "penalty-normal 4e9 range x 0.4 1",
            f"node boundary mech-vel-b-c {across} range {up} 0 0",
            f"element-face boundary m-s-b-c stress-{2 * up} -2e4 range {up} 0.5 0.5",
            f"model gravity ({','.join(['0'] * (dim - 1))},-10)",
        ]
        if self.motion != "dynamic":
            lines.append("model option dynamic off")
        if self.account:
            lines.append("model option energy on")
        if self.physics == "flow":
            lines += [
                "face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 1e6 viscosity 1e-6 "
                "aperature-initial 1e-4 aperature-minumum 2e-5 aperature-maximum 1e-3 range x 0.4 1",
                "flow-node initial pressure 1e3",
                f"node boundary hydra-c-f-b pressure 5e3 range x 0.45 1 {up} 0 0",
            ]
            if self.motion == "static":
                lines.append("model time-step hydraulic 1e-7")
        elif self.physics == "heat":
            lines += [
                "element c-model therm-iso-h property conductivity 3 capacity 800 expansion-coeficient 1e-5",
                "node initial temperature 20",
                f"node boundary therm-s-b-c temperature 60 range {up} 0 0",
            ]
            if self.motion == "static":
                lines.append("model time-step thermal 100")
        first, second = self._runs()
        then = ["model save 'middle.sav'", "model restore 'middle.sav'"] if middle == "restore" else []
        return "".join(f"pcdc {line}\n" for line in [*lines, first, *then, second])

    def _runs(self) -> tuple[str, str]:
        if self.motion != "at once":
            return "model step 15", "model step 20"
        if self.physics == "flow":
            return "model solve hydraulic time 2e-3 dt 1e-3", "model solve hydraulic time 3e-3 dt 1e-3"
        if self.physics == "heat":
            return "model solve thermal time 2e4 dt 1e4", "model solve thermal time 3e4 dt 1e4"
        return "model solve elastic", "model solve elastic"


def _switch(on: bool) -> str:
    return "on" if on else "off"


ALL = tuple(
    Combination(*of) for of in itertools.product(ELEMENTS, (True, False), (True, False), MOTIONS, PHYSICS)
    if not (of[2] and of[3] != "dynamic")  # an account is kept of motion
)  # fmt: skip


def sample(number: int) -> list[Combination]:
    """So many of all, in which each choice comes up about as often as the others."""
    chosen: list[Combination] = []
    seen: dict[tuple[int, object], int] = {}
    while len(chosen) < number:
        left = [one for one in ALL if one not in chosen]
        rare = min(left, key=lambda one: (sum(seen.get(choice, 0) for choice in enumerate(astuple(one))), str(one)))
        chosen.append(rare)
        for choice in enumerate(astuple(rare)):
            seen[choice] = seen.get(choice, 0) + 1
    return chosen


def end(one: Session) -> dict[str, np.ndarray]:
    """Every quantity of elements, nodes and joints that there is, of the fluid, and the account."""
    blocks = one.projects[-1].blocks
    there = [name for name, about in diagnostics.QUANTITIES.items() if blocks.dim in about.dims]
    found = {name: diagnostics.values(blocks, name) for name in there}
    flow = Flow.there(blocks)
    if flow is not None:
        found |= {f"fluid {name}": flow.values("flow-node", name) for name in ("pressure", "fluid")}
    if blocks.budget is not None:
        found |= {f"energy {name}": np.array([value]) for name, value in diagnostics.energies(blocks).items()}
    return found | {"steps": np.array([blocks.clock.step, blocks.clock.time])}


def run(of: Combination, folder: Path, middle: str = "") -> tuple[dict[str, np.ndarray], str]:
    """End and error of a combination."""
    one, error = two_ways.carry_out(of.script(middle), folder, autosave=1e-6 if middle == "autosave" else None)
    try:
        return {} if error else end(one), error
    finally:
        two_ways.leave(one)
