"""The linear law of pairs as a user would write it."""

from hpcdem import pair_law


@pair_law()
def linear(u, fs, sliding, dt, kn, ks, fric):
    """Springs and friction, with the bits of the built-in law."""
    fn = kn * u
    limit = fric * fn
    fs = fs + ks * sliding * dt
    if fs > limit:
        fs = limit
    elif fs < -limit:
        fs = -limit
    return fn, fs + 0.0
