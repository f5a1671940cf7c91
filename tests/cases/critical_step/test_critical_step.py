"""The highest frequency of the contacts there are, against chains, pairs and matrices; and what it is good for.

- A free chain of n equal masses and springs: omega = 2 sqrt(k/m) cos(pi / (2 n)); between two walls with springs of the
  same stiffness: 2 sqrt(k/m) cos(pi / (2 (n + 1))).
- Two equal discs that share a shear spring ks: across and turning, omega^2 = ks (2/m + 2 R^2/I) = 6 ks/m for discs of
  I = m R^2/2 (arms R, no overlap).
- Anything else: the matrix of all contacts, put together here from the list of contacts, and numpy's eigenvalues.
"""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, particles, properties, settings, walls
from hpcdem.core.selection import Ids
from hpcdem.physics.dem import diagnostics
from hpcdem.runtime.progress import Log
from tests.support import body, model, only, steps, value

R, KN = 1.0, 2e6
K = 0.5 * KN


def chain(folder, n: int, dt: float = 1e-4, **law):
    sim = model(folder, dt)
    particles.gline(sim, (0.0, 0.0), (2.0 * R * (n - 0.5), 0.0), R)
    properties.prop(sim, density=1000.0, **{"kn": KN, **law})
    cycles.prepare(sim)
    return sim


@pytest.mark.smoke
@pytest.mark.parametrize("n", [2, 3, 7, 40])
def test_free_chain(tmp_path, n):
    sim = chain(tmp_path, n)
    expected = 2.0 * math.sqrt(K / body(sim)[0]) * math.cos(math.pi / (2 * n))
    found = diagnostics.highest_frequency(sim)
    assert found == pytest.approx(expected, rel=1e-3) and found <= expected * (1.0 + 1e-12)


@pytest.mark.parametrize("n", [1, 6])
def test_chain_between_walls(tmp_path, n):
    sim = chain(tmp_path, n)
    for wall, x in enumerate((-R + 1e-9, 2.0 * R * n - R - 1e-9)):  # a disc that only touches a wall has no contact
        walls.wall(sim, wall, ((x, -2.0), (x, 2.0)), kn=KN)
    cycles.prepare(sim)
    expected = 2.0 * math.sqrt(K / body(sim)[0]) * math.cos(math.pi / (2 * (n + 1)))
    assert diagnostics.highest_frequency(sim) == pytest.approx(expected, rel=1e-3)


def test_shear_and_rotation(tmp_path):
    sim = chain(tmp_path, 2, kn=1e-3, ks=KN, fric=0.5)
    assert diagnostics.highest_frequency(sim) == pytest.approx(math.sqrt(6.0 * K / body(sim)[0]), rel=1e-6)
    properties.prop(sim, fric=0.0)
    cycles.prepare(sim)
    slips = math.sqrt(2.0 * 0.5e-3 / body(sim)[0])
    assert diagnostics.highest_frequency(sim) == pytest.approx(slips, rel=1e-6), "without friction nothing holds"


def test_fixed_directions_do_not_swing(tmp_path):
    sim = chain(tmp_path, 2)
    properties.fix(sim, ("x",))
    cycles.prepare(sim)
    assert diagnostics.highest_frequency(sim) == pytest.approx(0.0, abs=1e-6)
    properties.fix(sim, ("y", "spin"))
    cycles.prepare(sim)
    assert diagnostics.highest_frequency(sim) == 0.0


def bed(folder, threads: int = 1):
    """Hertz spheres of two sizes with friction in a heap, some bonded, some bonds open, some fixed, on a floor."""
    sim = model(folder, 1e-3, disk="off")
    sim.threads = threads
    walls.wall(sim, 0, ((-50.0, 0.0), (50.0, 0.0)), fric=0.3)
    random = np.random.default_rng(4)
    for gid in range(60):
        place = 1.9 * (gid % 10) + random.uniform(-0.05, 0.05), 0.95 + 1.9 * (gid // 10) + random.uniform(-0.05, 0.05)
        particles.ball(sim, gid, *place, R if gid % 3 else 0.9)
    properties.prop(sim, density=2000.0, shear=1e8, poiss=0.25, hertz=True, fric=0.4)
    bonds.bond(sim, ebmod=4e8, gbmod=3e8, tstrength=1e12, sstrength=1e12, tolerate=0.2)
    properties.fix(sim, ("x", "spin"), Ids(0, 2))
    cycles.prepare(sim)
    return sim


def by_matrix(sim) -> float:
    """sqrt of the largest eigenvalue of M^-1/2 K M^-1/2, put together contact by contact."""
    order = np.argsort(sim.particles["gid"])
    n = len(order)
    radius = sim.particles["radius"][order]
    place = sim.particles.positions()[order]
    stiffness = np.zeros((3 * n, 3 * n))
    shear, nu = 1e8, 0.25

    def add(a, b, normal, overlap, kn, ks):
        across = np.array([-normal[1], normal[0]])
        for k, direction in ((kn, normal), (ks, across)):
            row = np.zeros(3 * n)
            for p, sign in ((a, -1.0), (b, 1.0)):
                if p is not None:
                    row[3 * p : 3 * p + 2] = sign * direction
                    if direction is across:
                        row[3 * p + 2] = -(radius[p] - 0.5 * overlap)
            stiffness[:] += k * np.outer(row, row)

    def hertz(two_rt, u):
        root = math.sqrt(two_rt * u)
        return shear / (1.0 - nu) * root, 2.0 * shear / (2.0 - nu) * root

    for a in range(n):
        for b in range(a + 1, n):
            way = place[b] - place[a]
            d = math.hypot(*way)
            u, two_rt = radius[a] + radius[b] - d, 4.0 * radius[a] * radius[b] / (radius[a] + radius[b])
            if u > -0.2:  # bonded, all of them: the stiffer of contact and bond, as it may open or close in any step
                area = math.pi * (0.5 * two_rt) ** 2 / (radius[a] + radius[b])
                add(a, b, way / d, u, *map(max, hertz(two_rt, max(u, 0.0)), (4e8 * area, 3e8 * area)))
        u = radius[a] - place[a, 1]
        if u >= 0.0:
            add(a, None, np.array([0.0, -1.0]), u, *hertz(2.0 * radius[a], u))
    free = np.ones((n, 3))
    free[:3, [0, 2]] = 0.0
    mass, inertia = sim.body[order, 0], sim.body[order, 1]
    weight = (free / np.sqrt(np.column_stack([mass, mass, inertia]))).ravel()
    return math.sqrt(np.linalg.eigvalsh(weight[:, None] * stiffness * weight)[-1])


def test_against_the_matrix(tmp_path):
    sim = bed(tmp_path)
    overlaps = diagnostics.contact_rows(sim)[0][:, diagnostics.OVERLAP]
    assert (overlaps < 0.0).sum() > 3 and (overlaps > 0.0).sum() > 50, "bonds both open and closed"
    found, expected = diagnostics.highest_frequency(sim, within=1e-8), by_matrix(sim)
    assert found == pytest.approx(expected, rel=1e-6)
    assert diagnostics.highest_frequency(sim) == pytest.approx(expected, rel=2e-3)


def test_threads_and_looking_change_no_bit(tmp_path):
    one, three = bed(tmp_path, 1), bed(tmp_path, 3)
    assert diagnostics.highest_frequency(one) == diagnostics.highest_frequency(three)
    steps(three, 20)
    steps(one, 10)
    diagnostics.highest_frequency(one)
    steps(one, 10)
    assert diagnostics.fingerprint(one) == diagnostics.fingerprint(three)


@pytest.mark.parametrize(("factor", "n", "stable"), [(0.98, 400, True), (1.02, 25, False)])
def test_it_is_the_limit_of_stability(tmp_path, factor, n, stable):
    """A bonded chain (springs both ways) stays where it is just below the limit; just above, the fastest mode grows by
    |z| = 1.49 a step, z^2 - (2 - 2.04^2) z + 1 = 0: by 2e4 in 25 steps."""
    sim = chain(tmp_path, 5)
    bonds.bond(sim, n_bond=1e30, s_bond=1e30)
    cycles.prepare(sim)
    sim.settings.dt = factor * 2.0 / diagnostics.highest_frequency(sim)
    for gid in range(5):
        properties.prop(sim, only(gid), xv=1e-6 * (-1) ** gid)
    steps(sim, n)
    assert (max(abs(value(sim, "vx", gid)) for gid in range(5)) < 1e-5) == stable


def test_the_limit_of_contacts_that_form_is_watched(tmp_path):
    """A cycle begins without contacts, with a larger step than the discs will bear that fall on the floor: it is said
    while they do. A step that is small for any contacts is not looked at again."""
    for factor, says in ((1.02, True), (0.02, False)):
        sim = model(tmp_path, gravity=(0.0, -0.1))
        walls.wall(sim, 0, ((-9.0, 0.0), (199.0, 0.0)), kn=KN)
        for gid in range(40):
            particles.ball(sim, gid, 3.0 * gid, R + 0.01 * (1 + gid), R)
        properties.prop(sim, density=1000.0, kn=KN, damp=0.5)
        cycles.prepare(sim)
        sim.settings.dt = factor * 2.0 / math.sqrt(K / body(sim)[0])
        sim.log = Log(stream=io.StringIO())
        cycles.cycle(sim, 0)
        assert "stability limit" not in sim.log._stream.getvalue()
        cycles.cycle(sim, 4 * cycles.WATCH)
        said = sim.log._stream.getvalue()
        assert ("warning: step " in said and "the undamped step is unstable" in said) == says
        assert cycles._is_surely_small(sim) != says


@pytest.mark.parametrize("shear", [False, True])
def test_bonds_count_in_frac_and_in_what_is_reported(tmp_path, shear):
    """Bonds much stiffer than their contacts, which touch when the step is chosen: the step is theirs, and the chain
    stays; the step of the contacts is told to be too large."""
    sim = chain(tmp_path, 5)
    modulus = 100.0 * K  # E A/L of equal discs is E
    more = {"gbmod": modulus, "ebmod": K} if shear else {"ebmod": modulus, "gbmod": K}
    bonds.bond(sim, tstrength=1e30, sstrength=1e30, **more)
    settings.set_option(sim, "frac", 0.2)
    properties.prop(sim, only(2), xv=1e-3, yv=1e-3)
    cycles.prepare(sim)
    assert sim.clock.dt == pytest.approx(0.2 * math.sqrt(body(sim)[0] / modulus))
    steps(sim, 400)
    assert max(abs(value(sim, "vx", gid)) for gid in range(5)) < 1e-2
    settings.set_option(sim, "dt", 0.2 * math.sqrt(body(sim)[0] / K))
    sim.log = Log(stream=io.StringIO())
    cycles.cycle(sim, 0)
    assert "the undamped step is unstable" in sim.log._stream.getvalue()


def test_what_the_log_says(tmp_path):
    """Nothing while dt is small; both limits when it comes near; a warning beyond."""
    said = {}
    for factor in (0.25, 0.7, 1.1):
        sim = chain(tmp_path, 5)
        sim.settings.dt = factor * 2.0 / diagnostics.highest_frequency(sim)
        sim.log = Log(stream=io.StringIO())
        cycles.cycle(sim, 1)
        said[factor] = sim.log._stream.getvalue()
    assert "stability limit" not in said[0.25]
    assert (
        "0.70 of the stability limit of the present contacts and bonds (" in said[0.7]
        and "is unstable" not in said[0.7]
    )
    assert (
        "warning: the time step" in said[1.1]
        and "is 1.10 of the stability limit" in said[1.1]
        and "unstable" in said[1.1]
    )


def test_the_share_is_reported_again_only_where_it_has_grown(tmp_path):
    sim = chain(tmp_path, 5)
    sim.settings.dt = 0.6 * 2.0 / diagnostics.highest_frequency(sim)
    sim.log = Log(stream=io.StringIO())
    for factor in (1.0, 1.0, 1.1, 1.4, 1.4):
        settings.set_option(sim, "dt", factor * 0.6 * 2.0 / diagnostics.highest_frequency(sim))
        sim.log._warned.add("critical time step")
        cycles.cycle(sim, 1)
    assert sim.log._stream.getvalue().count("of the stability limit") == 2
