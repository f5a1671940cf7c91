"""Laws for the tests."""

import math

from hpcdem import Property, StateVariable, element_law


@element_law()
def elastic(e11, e22, e12, evol, bulk, shear):
    """That of mech-iso-elastic."""
    lame, two_mu = bulk - 2.0 / 3.0 * shear, 2.0 * shear
    p = lame * evol
    return p + two_mu * e11, p + two_mu * e22, two_mu * e12, p


@element_law(
    properties=[Property("limit", "Pa", "largest shear stress", low_itself=False)],
    state=[
        StateVariable("g11", "1", "plastic strain 11"), StateVariable("g12", "1", "plastic strain 12"),
        StateVariable("slip", "1", "shear of the plastic strain along its way"),
    ],
)  # fmt: skip
def tresca(e11, e22, e12, evol, g11, g12, slip, i11, i22, i12, bulk, shear, limit):
    """Shear stress in the plane up to a limit; plastic strain without volume. Below the limit that of mech-iso-elastic,
    bit by bit: tests of this share the loops that are compiled for it."""
    lame, two_mu = bulk - 2.0 / 3.0 * shear, 2.0 * shear
    p = lame * evol
    s11, s22, s12 = p + two_mu * (e11 - g11), p + two_mu * (e22 + g11), two_mu * (e12 - g12)
    half, across = 0.5 * ((s11 + i11) - (s22 + i22)), s12 + i12
    radius = math.sqrt(half * half + across * across)
    if radius > limit:
        over = 1.0 - limit / radius
        d11, d12 = over * half / two_mu, over * across / two_mu
        g11, g12, slip = g11 + d11, g12 + d12, slip + math.sqrt(d11 * d11 + d12 * d12)
        s11, s22, s12 = s11 - over * half, s22 + over * half, s12 - over * across
    return s11, s22, s12, p, g11, g12, slip


tresca_again = element_law(properties=tresca.properties, state=tresca.state)(tresca.function)
"""The same as another law."""


def lift(y):
    """Velocity [m/s] of a plate that is drawn out evenly."""
    return 0.1 * y


def beat(x, y, t):
    """Stress [Pa] of a wave that runs along y."""
    return -2e6 * math.sin(3e4 * (t - 1e-4 * y) + x)


@element_law(state=[StateVariable("age", "s", "time in motion", initial=3.0)])
def flat(e11, e22, e12, evol, age, bulk, shear, dt):
    """Elasticity in plane stress, with a clock."""
    lame, two_mu = bulk - 2.0 / 3.0 * shear, 2.0 * shear
    p = lame * two_mu / (lame + two_mu) * evol
    return p + two_mu * e11, p + two_mu * e22, two_mu * e12, 0.0, age + dt
