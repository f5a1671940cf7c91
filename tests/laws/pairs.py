"""Laws of pairs for the tests: the built-in linear one, one that remembers, and one that tells no energy."""

from hpcdem import PairProperty, StateVariable, pair_law


def springs(u, fs, kn, ks):
    return 0.5 * kn * u * u, 0.5 * fs * fs / ks


@pair_law(energy=springs)
def linear(u, fs, sliding, dt, kn, ks, fric):
    fn = kn * u
    limit = fric * fn
    fs = fs + ks * sliding * dt
    if fs > limit:
        fs = limit
    elif fs < -limit:
        fs = -limit
    return fn, fs + 0.0


def stiffest(kn, stiffening):
    return kn * stiffening


def held(u, fs, most, kn, ks, pull, stiffening):
    """What unloading gives back, down to no force."""
    fn = max(kn * most - stiffening * kn * (most - u), -pull)
    return 0.5 * fn * fn / (stiffening * kn), 0.5 * fs * fs / ks


@pair_law(
    properties=[
        PairProperty("pull", "N", "largest tension", mix="least"),
        PairProperty("stiffening", "1", "of springs, in unloading", default=2.0, low=1.0, mix="greatest"),
    ],
    state=[StateVariable("most", "m", "largest overlap"), StateVariable("age", "s", "of the contact", initial=1.0)],
    stiffness=stiffest,
    energy=held,
)
def sticky(u, fs, most, age, sliding, approach, dt, two_rt, kn, ks, fric, pull, stiffening):
    most = max(most, u)
    fn = max(kn * most - stiffening * kn * (most - u), -pull) + 1e-3 * kn * dt * approach / two_rt
    limit = fric * kn * most
    return fn, min(max(fs + ks * sliding * dt, -limit), limit), most, age + dt


@pair_law()
def untold(u, fs, kn):
    return kn * u, fs
