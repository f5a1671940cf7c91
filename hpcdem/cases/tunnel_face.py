"""A tunnel that ends in the rock: how far its wall closes before and behind the face, in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Closure:
    """behind [m]: closure of the wall far behind the face; theory [m]: (1 + nu) p r / E, of a long tunnel; at_face:
    closure at the face, over that behind; profile: (distance from the face over the radius, closure over that far
    behind), positive ahead of the face.
    """

    behind: float
    theory: float
    at_face: float
    profile: list[tuple[float, float]] = field(repr=False)


class TunnelFace(Case):
    """A quarter of a circular tunnel, driven along y into rock under isotropic pressure."""

    name: ClassVar[str] = "tunnel-face"
    title: ClassVar[str] = "Convergence of a tunnel ahead of and behind its face, in three dimensions"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Closure

    radius: float = quantity(3.0, "m", "radius of the tunnel", gt=0)
    driven: float = quantity(10.0, "1", "length of the tunnel, over its radius", ge=4, le=100)
    ahead: float = quantity(10.0, "1", "rock ahead of the face, over the radius", ge=4, le=100)
    beside: float = quantity(10.0, "1", "rock beside the tunnel, from its axis, over the radius", ge=4, le=100)
    pressure: float = quantity(10e6, "Pa", "pressure in the rock, from all sides", gt=0)
    young: float = quantity(10e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    density: float = quantity(2500.0, "kg/m3", "density", gt=0)
    size: float = quantity(0.5, "m", "edges of the elements at the tunnel", gt=0)
    coarse: float = quantity(5.0, "m", "edges of the elements far from it", gt=0)
    balance: float = quantity(1e-5, "1", "unbalanced ratio of equilibrium", gt=0, le=1e-3)

    @model_validator(mode="after")
    def _fits(self) -> TunnelFace:
        if self.size > 0.6 * self.radius or self.coarse < self.size:
            raise ValueError(
                f"size is {self.size:g}, expected at most 0.6 of radius, {0.6 * self.radius:g} m, and coarse"
            )
        return self

    def model(self) -> str:
        return ROCK

    def loading(self) -> str:
        return DRIVEN


ROCK = """
import numpy as np
wide, face, end = beside * radius, driven * radius, (driven + ahead) * radius
pcdc model new dim 3
pcdc model option collision off dynamic off
pcdc geometry create box (0,0,0) ([wide],[end],[wide]) as-layer 'rock'
pcdc geometry create cylinder (0,0,0) (0,[face],0) [radius] as-layer 'tunnel'
pcdc mesh create from-layer 'rock' size [coarse] refine-layer 'tunnel' size [size] distance [wide - radius] \\
    region 'tunnel' group 'tunnel'
pcdc element c-model mech-iso-e property density [density] young [young] poisson-ratio [poisson]
pcdc element initial stress-xx [-pressure] stress-yy [-pressure] stress-zz [-pressure]
near = 1e-6 * end                                # planes of symmetry, and sides that are far enough to be held
for place in (0, wide):
    pcdc node boundary mech-vel-b-c velocity-x 0 range x [place - near] [place + near]
    pcdc node boundary mech-vel-b-c velocity-z 0 range z [place - near] [place + near]
for place in (0, end):
    pcdc node boundary mech-vel-b-c velocity-y 0 range y [place - near] [place + near]
"""
DRIVEN = """
pcdc element c-model null range group 'tunnel'
pcdc model solve ratio [balance]
x, y, z = (pcdc.values('node', 'position-' + axis) for axis in 'xyz')
dx, dz = (pcdc.values('node', 'displacement-' + axis) for axis in 'xz')
r = np.hypot(x - dx, z - dz)
wall = np.abs(r - radius) < np.where(y > face + near, 0.1, 0.01) * radius
closure = -(dx * (x - dx) + dz * (z - dz))[wall] / r[wall]
along = (y[wall] - face) / radius
behind = float(closure[along < -0.6 * driven].mean())
theory = (1 + poisson) * pressure * radius / young
at_face = float(closure[np.abs(along) < 0.05].mean() / behind)
order = np.argsort(along, kind='stable')
profile = list(zip(along[order].tolist(), (closure[order] / behind).tolist()))
print('far behind the face the wall has closed by %.4g mm, of a long tunnel %.4g mm' % (1e3 * behind, 1e3 * theory))
print('at the face it has closed by %.3g of that' % at_face)
pcdc chart create 'tunnel-face' x-label 'distance from the face / radius' y-label 'closure / closure far behind'
pcdc chart add 'tunnel-face' values [profile] label 'nodes at the radius' style points
pcdc chart export 'tunnel-face' 'tunnel-face.png'
pcdc output image 'tunnel-face' field 'displacement' eye '-1,-1,0.7'
pcdc output vtk 'tunnel-face'
"""
