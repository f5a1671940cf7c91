"""A ring that is heated inside until it cracks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.thermal_ring import MESH, ROCK, Ring


@dataclass(frozen=True)
class Cracked:
    """Result of the case.

    first: temperature difference at which the first joints broke [K]; exact: difference at which the closed form
    reaches the strength at the outer circle [K]; radius: largest radius of the centres of these joints [m]; broken:
    number of broken joints at the end; curve: (difference [K], broken joints) pairs.
    """

    first: float
    exact: float
    radius: float
    broken: int
    curve: list[tuple[float, float]] = field(repr=False)


class CrackingRing(Ring):
    """The hole of a jointed ring is heated slowly; the tension at the outer circle increases until the ring cracks."""

    name: ClassVar[str] = "cracking-ring"
    title: ClassVar[str] = "Thermal cracking of a ring"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Cracked

    friction: float = quantity(30.0, "degrees", "friction angle of joints", ge=0, lt=90)
    cohesion: float = quantity(20e6, "Pa", "cohesion of the joints", gt=0)
    tensile_strength: float = quantity(2e6, "Pa", "tensile strength of the joints", gt=0)
    gf1: float = quantity(1.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(200.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    size: float = quantity(0.025, "m", "edges of the elements", gt=0)
    penalty: float = quantity(100.0, "1", "penalty of the joints, over young", gt=0)
    begin: float = quantity(
        0.9, "1", "fraction of the temperature difference of the closed form applied in three parts", gt=0, lt=1
    )
    rise: float = quantity(0.045, "1", "of one difference to the next from there on", gt=0, le=0.2)
    end: float = quantity(1.17, "1", "last one", gt=1, le=10)
    balance: float = quantity(3e-5, "1", "unbalanced over all forces", gt=0, le=1e-3)
    patience: int = quantity(40000, "1", "steps towards it, after which the ring has parted", ge=1000)

    @model_validator(mode="after")
    def _ends(self) -> CrackingRing:
        if self.end < self.begin + self.rise:
            raise ValueError(f"end is {self.end:g}, expected at least begin + rise, {self.begin + self.rise:g}")
        return self

    def model(self) -> str:
        return MESH.replace("MORE", " irregular") + ROCK + JOINTS

    def loading(self) -> str:
        return WARMED


JOINTS = """
pcdc face-joint c-model c-i-c-i property friction [friction] cohesion [cohesion] tensile-str [tensile_strength] \\
    gf1 [gf1] gf2 [gf2] penalty-normal [penalty*young]
pcdc node boundary therm-s-b-c temperature 0 range geometry 'outer'
"""
WARMED = """
# Tangential stress at the outer circle per degree (Timoshenko & Goodier 1970, section 151).
import numpy as np
log = math.log(outer / inner)
unit = young * expansion / (2 * (1 - poisson) * log)
exact = tensile_strength / (unit * (1 - 2 * inner**2 / (outer**2 - inner**2) * log))

curve, first, radius = [], math.nan, math.nan
parts = [0.5*begin, 0.8*begin, *(begin + rise * k for k in range(int((end - begin) / rise + 1e-9) + 1))]
for warmer in (exact * part for part in parts):
    # The steady state of heat, then equilibrium of the blocks with it.
    pcdc node boundary therm-s-b-c temperature [warmer] range geometry 'hole'
    pcdc model option mechanical off thermal on
    pcdc model solve thermal steady
    pcdc model option mechanical on thermal off
    pcdc model solve ratio [balance] limit [patience] on-failure continue
    state = np.asarray(pcdc.values('joint', 'state'))
    x, y = (np.asarray(pcdc.values('joint', name)) for name in ('joint-position-x', 'joint-position-y'))
    broken = int((state == 3).sum())
    curve.append((warmer, float(broken)))
    if broken and math.isnan(first):
        first, radius = warmer, float(np.hypot(x, y)[state == 3].max())
        print('first cracks at %.4g K, up to a radius of %.4g m; closed form: %.4g K at %.4g m'
              % (first, radius, exact, outer))

print('%d joints are broken at %.4g K' % (broken, curve[-1][0]))
pcdc output vtk 'cracking-ring'
pcdc chart create 'cracking-ring' x-label 'hole over rim (K)' y-label 'broken joints'
pcdc chart add 'cracking-ring' values [curve] label 'joints' style points
pcdc chart add 'cracking-ring' values [[(exact, 0.0), (exact, float(broken))]] label 'strength at the rim, closed form'
pcdc chart export 'cracking-ring' 'cracking-ring.png' temperature
"""
