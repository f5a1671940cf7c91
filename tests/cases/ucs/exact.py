"""Uniaxial compression of a body of elastic triangles and elastic joints, as if each of them had the mean stress.

Rock alone, in plane strain with free sides: strain = stress (1 - nu2) / E.

A joint of length h whose normal makes the angle a with the load has the stresses s cos2 a (closing it) and
s sin a cos a (shearing it). It closes by h s cos2 a / P_overlay and slides by s_p (1 - sqrt(1 - q)),
q = s |sin a cos a| / t, with

    t = c + s cos2 a tan(phi),   s_p = 2 h t / P_shear           (docs/blocks_joints.md)

The strain that displacements u across faces add to a body of area A is the sum of h sym(u n) / A, so along the load

    strain = sum h (closing cos2 a + sliding |sin a cos a|) / A

Equal stress everywhere is an equilibrium but fits together only roughly, so this is the softest that the body can be.
"""

from __future__ import annotations

import numpy as np


def strain(
    stress: float,
    ends: np.ndarray,
    area: float,
    young: float,
    poisson: float,
    cohesion: float,
    friction: float,
    penalty: float,
    overlay: float,
) -> float:
    """Strain along y under this compressive stress [Pa]. ends: (n, 2, 2) of the joints [m]; area: of the body [m2];
    friction: degrees; penalties [Pa]."""  # fmt: skip
    way = ends[:, 1] - ends[:, 0]
    h = np.hypot(way[:, 0], way[:, 1])
    cos, sin = np.abs(way[:, 0]) / h, np.abs(way[:, 1]) / h  # the normal is across the way
    limit = cohesion + stress * cos**2 * np.tan(np.radians(friction))
    closing = h * stress * cos**2 / overlay
    sliding = 2 * h * limit / penalty * (1 - np.sqrt(1 - np.minimum(stress * sin * cos / limit, 1.0)))
    return stress * (1 - poisson**2) / young + float((h * (closing * cos**2 + sliding * sin * cos)).sum() / area)


def modulus(low: float, high: float, *body: object) -> float:
    """Slope of the stress-strain curve between two stresses [Pa], by least squares over the strain."""
    stresses = np.linspace(low, high, 50)
    strains = np.array([strain(s, *body) for s in stresses])  # type: ignore[arg-type]
    return float(np.polyfit(strains, stresses, 1)[0])


def strongest(cohesion: float, friction: float) -> float:
    """Mohr-Coulomb: 2 c tan(45 + phi / 2) [Pa], with a plane at the most favourable angle."""
    return 2 * cohesion * float(np.tan(np.radians(45 + friction / 2)))


def modulus_in_space(joints: np.ndarray, volume: float, young: float, shear: float, overlay: float) -> float:
    """Young's modulus [Pa] along z of rock with joints (n, 3, 3) corners [m] that all carry the mean stress s.

    Each, of area A, closes by sqrt(A) s cos2 / P_o and slides by sqrt(A) s sin cos / P_s, which adds A sqrt(A) (cos4 /
    P_o + cos2 sin2 / P_s) / V to the compliance. shear, overlay: penalties [Pa]. Before the peak joints soften, so it
    is a little less."""
    normal = np.cross(joints[:, 1] - joints[:, 0], joints[:, 2] - joints[:, 0])
    twice = np.linalg.norm(normal, axis=1)
    cos2 = (normal[:, 2] / twice) ** 2
    area = 0.5 * twice
    softer = (area**1.5 * (cos2**2 / overlay + cos2 * (1.0 - cos2) / shear)).sum() / volume
    return 1.0 / (1.0 / young + softer)
