"""The elastic law of elements as a user would write it."""

from hpcdem import element_law


@element_law()
def elastic(e11, e22, e12, evol, bulk, shear):
    """That of mech-iso-elastic, with its bits."""
    pressure, two_mu = (bulk - 2.0 / 3.0 * shear) * evol, 2.0 * shear
    return pressure + two_mu * e11, pressure + two_mu * e22, two_mu * e12, pressure
