"""V13: tangential loading of a Hertz contact with constant normal overlap.

The tangent shear stiffness is that of Mindlin, ks = 2 (3 G^2 (1 - nu) Rt Fn)^(1/3) / (2 - nu), evaluated at the present
Fn = 2 G sqrt(2 Rt) / (3 (1 - nu)) U^(3/2). With U constant it is a constant, so a tangential way d gives

    Fs = ks d                             up to mu Fn (Cundall & Strack 1979), then Fs = mu Fn
    and back: Fs = mu Fn - ks d'          down to -mu Fn, d' being the way back.

Numbers: R = 60 m, G = 2.9 GPa, nu = 0.2, U = 1 m, mu = 0.3: Fn = 2.64733e10 N, ks = 0.8889 x 1.5 x 2.64733e10 =
3.52977e10 N/m; slip begins at d = 0.225 m = 0.3 / (0.8889 x 1.5) U, whatever G and R.
"""

from __future__ import annotations

import math

import numpy as np

RADIUS, G, NU, OVERLAP, MU = 60.0, 2.9e9, 0.2, 1.0, 0.3


def normal_force(u: float) -> float:
    """Fn [N]."""
    return 2.0 * G * math.sqrt(2.0 * RADIUS) / (3.0 * (1.0 - NU)) * u**1.5


def shear_stiffness(u: float) -> float:
    """ks [N/m], in the form with the cube root."""
    return 2.0 * (3.0 * G**2 * (1.0 - NU) * RADIUS * normal_force(u)) ** (1.0 / 3.0) / (2.0 - NU)


def there_and_back(way: np.ndarray, u: float) -> np.ndarray:
    """Fs [N] along a tangential path given by its points [m]: a spring whose force is cut to +-mu Fn."""
    ks, limit = shear_stiffness(u), MU * normal_force(u)
    fs = [0.0]
    for step in np.diff(way):
        fs.append(min(max(fs[-1] + ks * step, -limit), limit))
    return np.array(fs)
