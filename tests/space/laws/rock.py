"""Laws of space for the tests."""

import math

import numpy as np

from hpcdem import Property, StateVariable, element_law
from hpcdem.physics.fdem.kernels.plasticity import principal_return


def stiffest(bulk, shear, times):
    """As the moduli say, or more."""
    return times * (bulk + 4.0 / 3.0 * shear)


@element_law(dim=3)
def elastic(e11, e22, e12, e33, e13, e23, evol, bulk, shear):
    """That of mech-iso-elastic."""
    lame, two_mu = bulk - 2.0 / 3.0 * shear, 2.0 * shear
    p = lame * evol
    return p + two_mu * e11, p + two_mu * e22, two_mu * e12, p + two_mu * e33, two_mu * e13, two_mu * e23


FLOW = [
    *(StateVariable(f"p{axes}", "1", "plastic strain") for axes in ("11", "22", "12", "33", "13", "23")),
    StateVariable("work", "J/m3", "of the flow"),
]


@element_law(
    dim=3,
    properties=[
        Property("limit", "Pa", "largest sqrt(J2)", low_itself=False, default=1e20),
        Property("times", "1", "of its stiffness", default=1.0),
    ],
    state=FLOW,
    stiffness=stiffest,
)
def mises(
    e11, e22, e12, e33, e13, e23, evol, p11, p22, p12, p33, p13, p23, work, i11, i22, i12, i33, i13, i23, bulk, shear,
    limit,
):  # fmt: skip
    """Shear stress up to a limit, below it that of mech-iso-elastic; plastic strain without volume."""
    two_mu, mean, third = 2.0 * shear, (i11 + i22 + i33) / 3.0, evol / 3.0
    s11, s22 = two_mu * (e11 - third - p11) + (i11 - mean), two_mu * (e22 - third - p22) + (i22 - mean)
    s33, s12 = two_mu * (e33 - third - p33) + (i33 - mean), two_mu * (e12 - p12) + i12
    s13, s23 = two_mu * (e13 - p13) + i13, two_mu * (e23 - p23) + i23
    size = math.sqrt(0.5 * (s11 * s11 + s22 * s22 + s33 * s33) + s12 * s12 + s13 * s13 + s23 * s23)
    over = (1.0 - limit / size) / two_mu if size > limit else 0.0
    p11, p22, p12 = p11 + over * s11, p22 + over * s22, p12 + over * s12
    p33, p13, p23 = p33 + over * s33, p13 + over * s13, p23 + over * s23
    work += 2.0 * over * size * limit
    p = bulk * evol
    return (
        p + two_mu * (e11 - third - p11), p + two_mu * (e22 - third - p22), two_mu * (e12 - p12),
        p + two_mu * (e33 - third - p33), two_mu * (e13 - p13), two_mu * (e23 - p23), p11, p22, p12, p33, p13, p23,
        work,
    )  # fmt: skip


@element_law(
    dim=3,
    properties=[
        Property("dilation", "degrees", "of the flow"), Property("cohesion", "Pa", "of the yield surface"),
        Property("tensile", "Pa", "strength"),
    ],
    state=FLOW,
)  # fmt: skip
def mohr_coulomb(
    e11, e22, e12, e33, e13, e23, p11, p22, p12, p33, p13, p23, work, i11, i22, i12, i33, i13, i23, bulk, shear,
    friction, dilation, cohesion, tensile,
):  # fmt: skip
    """That of mech-mohr-coulomb, with the principal axes of LAPACK."""
    lame, two_mu = bulk - 2.0 / 3.0 * shear, 2.0 * shear
    p = lame * ((e11 - p11) + (e22 - p22) + (e33 - p33))
    s = np.empty((3, 3))
    s[0, 0], s[1, 1] = i11 + p + two_mu * (e11 - p11), i22 + p + two_mu * (e22 - p22)
    s[2, 2], s[0, 1] = i33 + p + two_mu * (e33 - p33), i12 + two_mu * (e12 - p12)
    s[0, 2], s[1, 2] = i13 + two_mu * (e13 - p13), i23 + two_mu * (e23 - p23)
    s[1, 0], s[2, 0], s[2, 1] = s[0, 1], s[0, 2], s[1, 2]
    size, axes = np.linalg.eigh(s)
    n_phi = math.tan(0.25 * math.pi + 0.5 * math.radians(friction)) ** 2
    n_psi = math.tan(0.25 * math.pi + 0.5 * math.radians(dilation)) ** 2
    strength = 2.0 * cohesion * math.sqrt(n_phi)
    r1, r2, r3, how = principal_return(
        size[0], size[1], size[2], n_phi, n_psi, strength, min(tensile, strength / (n_phi - 1.0)), lame + two_mu, lame
    )
    if how > 0.0:
        d = size - np.array([r1, r2, r3])
        flow = (d - lame / (3.0 * lame + two_mu) * d.sum()) / two_mu
        work += r1 * flow[0] + r2 * flow[1] + r3 * flow[2]
        for k in range(3):
            x, y, z = axes[0, k], axes[1, k], axes[2, k]
            p11, p22, p33 = p11 + flow[k] * x * x, p22 + flow[k] * y * y, p33 + flow[k] * z * z
            p12, p13, p23 = p12 + flow[k] * x * y, p13 + flow[k] * x * z, p23 + flow[k] * y * z
    p = lame * ((e11 - p11) + (e22 - p22) + (e33 - p33))
    return (
        p + two_mu * (e11 - p11), p + two_mu * (e22 - p22), two_mu * (e12 - p12), p + two_mu * (e33 - p33),
        two_mu * (e13 - p13), two_mu * (e23 - p23), p11, p22, p12, p33, p13, p23, work,
    )  # fmt: skip


def pump(x, y, z, t):
    """Velocity [m/s] that grows with height, and with time where both other coordinates are large."""
    return 0.1 * z + 1e3 * x * y * t


def drag(y):
    """Shear stress [Pa] of a stream that is faster on one side."""
    return 1e6 * y


def shove(x, z, t):
    """Force [N] that comes and goes along a bar."""
    return 40.0 * z * math.sin(600.0 * t - 3.0 * x)
