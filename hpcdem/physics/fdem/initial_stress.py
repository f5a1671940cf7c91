"""Initial stress of elements, which follows their moduli."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.assignments import ACROSS, COMPONENTS, Assignments
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.topology import Numbers, finite


class InitialStress(Assignments):
    """The stress that elements have at zero strain."""

    def initial_stress(
        self,
        elements: Numbers,
        xx: float = 0.0,
        yy: float = 0.0,
        xy: float = 0.0,
        zz: float | None = None,
        gradient: Mapping[str, tuple[float, ...]] | None = None,
        xz: float = 0.0,
        yz: float = 0.0,
    ) -> None:
        """Stress [Pa] at zero strain, tension positive; gradient: component -> (per m in x, per m in y, in space in z)
        at the centroid as it lies in the mesh, of six-node triangles at their Gauss points. It is the stress of a
        strain by the moduli of this moment, and changes with them, see `initial_stresses`. In the plane zz, if nothing
        is assigned to it, is that of plane strain, Poisson's ratio times xx + yy, and in space and in plane stress
        0."""
        at = self.numbers_of_elements(elements)
        mesh, values = self._mesh(), self.per_node(lambda: self._initial(at, xx, yy, xy, zz, gradient, xz, yz))
        self.before_change()

        def put() -> tuple[np.ndarray, np.ndarray]:
            stress0 = np.zeros((len(mesh.cells), len(COMPONENTS[mesh.dim]))) if self.stress0 is None else self.stress0
            stress0[at] = values
            self.stress0_row[at] = self.element_row[at]
            return stress0, self.stress0_row

        self.stress0, self.stress0_row = self.per_node(put)
        self._note_moduli(at)
        self.changed()

    def _initial(
        self, at: np.ndarray, xx: float, yy: float, xy: float, zz: float | None,
        gradient: Mapping[str, tuple[float, ...]] | None, xz: float, yz: float,
    ) -> np.ndarray:  # fmt: skip
        """Convert the argument of `initial_stress` to values of elements (n,), (n, 4) or (n, 6) [Pa]."""
        mesh = self._mesh()
        names = COMPONENTS[mesh.dim]
        if mesh.dim == 2 and (xz != 0.0 or yz != 0.0):
            raise CommandError("stress xz or yz is for three dimensions")
        given = {"xx": xx, "yy": yy, "xy": xy, "zz": 0.0 if zz is None else zz, "xz": xz, "yz": yz}
        values = np.tile(finite("initial stress", [given[name] for name in names]), (len(at), 1))
        for name, slope in (gradient or {}).items():
            if name not in names:
                raise CommandError(f"a stress gradient is one of {', '.join(names)}, got {name}")
            values[:, names.index(name)] += mesh.stress_points(at) @ self._vector(f"gradient of {name}", slope)
        if self.options.plane_stress and (values[:, ACROSS] != 0.0).any():
            raise CommandError(
                f"an initial stress zz of {values[values[:, ACROSS] != 0.0, ACROSS][0]:g} Pa cannot be in plane "
                "stress, where the stress across the plane is 0: omit stress-zz, or use model plane-strain"
            )
        if mesh.dim == 2 and zz is None and "zz" not in (gradient or {}):
            values[:, ACROSS] = math.nan  # until there are moduli
        return values

    def initial_stresses(self, elements: np.ndarray) -> np.ndarray:
        """Stress [Pa] (n, 4), in space (n, 6), of elements (n,) at zero strain, by their present moduli.

        What was set fixes a strain: mean stress over 3 K and deviator over 2 G with the moduli of that moment. So the
        mean follows the bulk modulus and the deviator the shear modulus. (In plane stress both are of the plane, and
        the bulk modulus K_2, see moduli.py.)"""
        assert self.stress0 is not None
        out = self.stress0[elements]
        assigned, now = self.stress0_row[elements], self.element_row[elements]
        ratio = np.ones((len(out), 2))
        of = moduli(self.element_rows, self.options.plane_stress)
        for c, modulus in enumerate((of.bulk, of.shear)):
            other = (assigned > 0) & (modulus[assigned] != modulus[now])
            ratio[other, c] = modulus[now[other]] / modulus[assigned[other]]
        other = (ratio != 1.0).any(axis=1)  # the rest keeps every bit
        normal = of.normal
        mean = out[other][:, normal].mean(axis=1, keepdims=True)
        scaled = ratio[other, 1:] * (out[other] - np.where(np.isin(np.arange(out.shape[1]), normal), mean, 0.0))
        scaled[:, normal] += ratio[other, :1] * mean
        out[other] = scaled
        return out
