"""Heaps of clumps and discs: the energy budget, the critical time step, and what commands do to clumps."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties, settings, walls
from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Group, Ids, Interval
from hpcdem.io.clumps import write_clumps
from hpcdem.io.frame import Table
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.budget import NAMES
from hpcdem.post import stress
from tests.clumped import bodies, kinds, write_lattice
from tests.support import model, only, steps

K, DENSITY, G = 2e7, 2e3, 9.8


def heap(folder, dt: float = 2e-3, seconds: float = 8.0, threads: int = 1, fric: float = 0.3, energy: int = 0):
    """Forty clumps of five kinds and some fifty discs, settled on a floor between two walls."""
    folder.mkdir(exist_ok=True)
    sim = model(folder / "data", dt, gravity=(0.0, -G), energy=energy)
    sim.threads = threads
    walls.box(sim, -100.0, 400.0, -50.0, 400.0)
    for k, nodes in enumerate((((0.0, 0.0), (240.0, 0.0)), ((0.0, 300.0), (0.0, 0.0)), ((240.0, 0.0), (240.0, 300.0)))):
        walls.wall(sim, k, nodes, kn=K, ks=K, fric=fric)
    write_lattice(folder / "bodies.clumps", 3.0, 8, 5)
    clumps.clump(sim, folder / "bodies.clumps", x=0.0, y=0.0, group="rock", color=3)
    particles.gen(sim, 50, [2.5, 3.5], (0.0, 240.0), (0.0, 150.0), group="sand")
    properties.prop(sim, density=DENSITY, kn=K, ks=K, fric=fric, damp=0.3)
    cycles.cycle(sim, round(seconds / dt))
    return sim


# ---- energy --------------------------------------------------------------------------------------------------------


def test_the_budget_closes(tmp_path):
    """Clumps fall, rub, are pushed, joined, driven and deleted; every account is used."""
    sim = heap(tmp_path, 1e-3, 5.0, energy=10**6)
    settings.set_option(sim, "lsm", 100.0)
    clumps.join(sim, Group("sand") & Interval("x", 100.0, 125.0))
    bonds.bond(sim, Interval("x", 120.0, 240.0), n_bond=2e5, s_bond=2e5)
    properties.fix(sim, ("x", "spin"), Interval("x", 40.0, 60.0))
    properties.prop(sim, Interval("x", 40.0, 60.0), spin=0.1, xv=-0.2)
    walls.wall(sim, 1, xv=4.0)
    cycles.cycle(sim, 3000)
    particles.delete(sim, Interval("x", 200.0, 300.0))
    cycles.cycle(sim, 3000)
    seen = sim.energy.evaluate(sim)
    absent = (
        "box",
        "work_blocks",
        "loss_laws",
        "elastic_bonds",
        "loss_stiffness",
        "elastic_rolling",
        "loss_rolling",
        "closing",
    )  # stiffness is constant (linear law)
    for name in NAMES[:-1]:
        if name not in absent:
            assert getattr(seen, name) != 0.0, name
    assert abs(seen.closing) < 1e-3 * seen.work_gravity


def test_an_elastic_heap_keeps_its_energy(tmp_path):
    """Without friction and damping: to second order in the time step."""
    errors = []
    for dt in (1e-3, 2.5e-4):
        sim = heap(tmp_path / f"{dt:g}", dt, 0.0, fric=0.0, energy=10**6)
        properties.prop(sim, damp=0.0)
        cycles.cycle(sim, round(4.0 / dt))
        seen = sim.energy.evaluate(sim)
        assert len(diagnostics.contact_rows(sim)[0]) + len(diagnostics.wall_rows(sim)[0]) > 5
        assert seen.loss_friction == seen.loss_local_damping == 0.0 and seen.work_gravity > 1e6
        errors.append(abs(seen.relative))
    assert errors[0] < 1e-3 and errors[1] < errors[0] / 8.0


# ---- the critical time step ----------------------------------------------------------------------------------------


def by_matrix(sim) -> float:
    """The highest eigenfrequency from the whole matrix, with numpy: one row and column per direction of a free disc or
    clump. A linear contact has the stiffness K/2 along and, with friction, across its normal."""
    c, p = diagnostics.clumps(sim), sim.particles
    order = np.argsort(p["gid"])
    gid, x, y, of = (p[name][order] for name in ("gid", "x", "y")) and (
        p["gid"][order], p["x"][order], p["y"][order], p.clump[order],
    )  # fmt: skip
    place = dict(zip(gid.tolist(), zip(x, y, of)))
    free = {int(g): k for k, g in enumerate(gid[of < 0])}
    clump = {int(i): len(free) + k for k, i in enumerate(c["id"])}
    n = len(free) + len(clump)
    centre = np.concatenate([np.column_stack([x, y])[of < 0], np.column_stack([c["x"], c["y"]])])
    mass = np.concatenate([sim.body[order][of < 0, 0], c["mass"]])
    inertia = np.concatenate([sim.body[order][of < 0, 1], c["inertia"]])
    stiffness = np.zeros((3 * n, 3 * n))
    mu = float(sim.materials.rows["fric"].max())

    def row(g: int, at: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Motion of the material point `at` of a particle's body along a direction."""
        body = clump[int(place[g][2])] if place[g][2] >= 0 else free[g]
        arm = at - centre[body]
        out = np.zeros(3 * n)
        out[3 * body : 3 * body + 3] = *direction, arm[0] * direction[1] - arm[1] * direction[0]
        return out

    def add(rows: list[np.ndarray], k: float) -> None:
        strain = sum(rows)
        stiffness[:] += k * np.outer(strain, strain)

    out, ids = diagnostics.contact_rows(sim)
    for numbers, (a, b, _) in zip(out, ids):
        at = numbers[[diagnostics.AT_X, diagnostics.AT_Y]]
        normal = np.array(place[b][:2]) - np.array(place[a][:2])
        normal /= np.hypot(*normal)
        for direction in (normal, np.array([-normal[1], normal[0]])) if mu else (normal,):
            add([row(b, at, direction), -row(a, at, direction)], 0.5 * K)
    out, ids = diagnostics.wall_rows(sim)
    for numbers, (a, _) in zip(out, ids):
        at = numbers[[diagnostics.AT_X, diagnostics.AT_Y]]
        normal = at - np.array(place[a][:2])
        normal /= np.hypot(*normal)
        for direction in (normal, np.array([-normal[1], normal[0]])) if mu else (normal,):
            add([row(a, at, direction)], 0.5 * K)
    moves = np.ones((n, 3))
    moves[[clump[int(i)] for i in c["id"][:3]], 2] = 0.0
    weight = (moves / np.sqrt(np.column_stack([mass, mass, inertia]))).ravel()
    return math.sqrt(np.linalg.eigvalsh(weight[:, None] * stiffness * weight)[-1])


@pytest.mark.parametrize("fric", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_highest_frequency_against_the_matrix(tmp_path, fric):
    sim = heap(tmp_path, 2e-3, 6.0, fric=fric)
    properties.fix(sim, ("spin",), Ids(0, int(diagnostics.clumps(sim)["id"][2])))
    cycles.prepare(sim)
    found, expected = diagnostics.highest_frequency(sim, within=1e-8), by_matrix(sim)
    assert len(diagnostics.contact_rows(sim)[0]) > 60
    assert found == pytest.approx(expected, rel=1e-6)
    # Without shear springs Gershgorin's bound is omega^2 <= 2 max(sum k / m), so the estimate cannot be too large.
    critical = diagnostics.critical_dt(sim)
    assert (critical < 2.0 / found) if fric == 0.0 else (critical < 1.3 * 2.0 / found)
    assert critical > 0.25 * 2.0 / found


@pytest.mark.parametrize(("factor", "n", "stable"), [(0.98, 1500, True), (1.02, 40, False)])
def test_it_is_the_limit_of_stability(tmp_path, factor, n, stable):
    """Clumps bonded to each other (springs both ways) stay where they are just below the limit, and blow up just
    above."""
    sim = model(tmp_path / "data", 1e-5)
    places = np.array([(27.6 * k, 0.0) for k in range(4)])
    clump = bodies([kinds(3.0)[0]], places, np.zeros(4))
    write_clumps(tmp_path / "row.clumps", clump)
    clumps.clump(sim, tmp_path / "row.clumps")
    properties.prop(sim, density=DENSITY, kn=K, ks=K)
    assert bonds.bond(sim, n_bond=1e30, s_bond=1e30) == 3
    cycles.prepare(sim)
    sim.settings.dt = factor * 2.0 / diagnostics.highest_frequency(sim, within=1e-9)
    for k, i in enumerate(diagnostics.clumps(sim)["id"]):
        properties.prop(sim, only(int(i)), xv=1e-7 * (-1) ** k, spin=1e-8)
    steps(sim, n)
    assert (float(np.abs(diagnostics.clumps(sim)["vx"]).max()) < 1e-5) == stable


# ---- commands ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_same_bits_on_threads_and_when_inspected(tmp_path):
    one, three = heap(tmp_path / "1", seconds=2.0), heap(tmp_path / "3", seconds=2.0, threads=3)
    assert diagnostics.fingerprint(one) == diagnostics.fingerprint(three)
    assert diagnostics.highest_frequency(one) == diagnostics.highest_frequency(three)
    diagnostics.frame(one), diagnostics.survey(one), diagnostics.clumps(one)
    steps(one, 10), steps(three, 10)
    assert diagnostics.fingerprint(one) == diagnostics.fingerprint(three)


def test_range_takes_clumps_as_a_whole(tmp_path):
    """By their centre where a place is asked for: neighbouring ranges share no clump and leave none out. By any member
    where ids are."""
    sim = heap(tmp_path, seconds=1.0)
    p, c = sim.particles, diagnostics.clumps(sim)
    x = dict(zip(c["id"].tolist(), c["x"]))
    at = c["x"][5] + 0.01  # through a rod
    left, right = (properties.chosen(sim, Interval("x", *ends)) for ends in ((-1e3, at), (at, 1e3)))
    assert (left ^ right).all()
    for member in np.flatnonzero(p.clump >= 0):
        assert left[member] == (x[int(p.clump[member])] < at)
    assert (left != (p["x"] < at)).any(), "some member is on the other side"
    third = int(c["id"][0]) + 2
    assert (np.sort(p["gid"][properties.chosen(sim, only(third))]) == np.arange(c["members"][0])).all()
    before, n = len(p), int(properties.chosen(sim, Interval("x", 100.0, 130.0)).sum())
    number = sim.clumps.number
    assert particles.delete(sim, Interval("x", 100.0, 130.0)) == n
    assert len(sim.particles) == before - n and sim.clumps.number < number
    cycles.prepare(sim)
    left = diagnostics.clumps(sim)
    assert sim.clumps.number == len(left["id"]) and not ((left["x"] >= 100.0) & (left["x"] < 130.0)).any()
    steps(sim, 50)
    particles.delete(sim)
    assert sim.clumps.number == 0 and sim.particles.rigid is None


def test_properties_are_those_of_the_whole_clump(tmp_path):
    sim = heap(tmp_path, seconds=0.2)
    properties.prop(sim, only(3), density=5e3, color=7, group="heavy")
    p = sim.particles
    of = p.clump == p.clump[p["gid"] == 3]
    assert (sim.materials.rows["density"][p["material"][of]] == 5e3).all() and (p["color"][of] == 7).all()
    cycles.prepare(sim)
    c = diagnostics.clumps(sim)
    assert c["mass"][0] == 5e3 * c["area"][0] and c["mass"][1] == DENSITY * c["area"][1]
    # Frames: shares of the mass by the area of the discs.
    frame = diagnostics.frame(sim).tables["particles"].columns
    assert frame["mass"][frame["clump"] == 0].sum() == pytest.approx(c["mass"][0], rel=1e-14)
    assert (frame["angle"][frame["clump"] == 0] == c["angle"][0]).all()
    assert set(frame["clump"]) == {-1, *c["id"].tolist()}


def test_stress_is_that_of_whole_bodies(tmp_path):
    """Between bodies forces cancel, so that sum V s = sum c F - sum over walls of x f, c and F being the centre of each
    body and the contact force on it; to rounding, in any state. Half of that would be lost with members as bodies."""
    sim = heap(tmp_path, 2e-3, 3.0)
    frame = diagnostics.frame(sim)
    found, held = stress.moments(frame)
    p, w = frame.tables["particles"].columns, frame.tables["wall_contacts"].columns
    assert (p["clump_x"][p["clump"] < 0] == p["x"][p["clump"] < 0]).all()
    expected = []
    for centre in (p["clump_x"], p["clump_y"]):
        at = w["x"] if centre is p["clump_x"] else w["y"]
        expected += [float((centre * p[f]).sum() - (at * w[f]).sum()) for f in ("fx", "fy")]
    assert found.sum(axis=0) == pytest.approx(expected, abs=1e-9 * float(np.abs(found).sum()))
    as_discs = dataclasses.replace(frame, tables=dict(frame.tables))
    without = {name: values for name, values in p.items() if not name.startswith("clump")}
    as_discs.tables["particles"] = Table(without, 0, len(p["x"]))
    wrong = stress.moments(as_discs)[0].sum(axis=0)
    assert abs(wrong[3] / expected[3] - 1.0) > 0.1
    volume, thickness = stress.volume_rule(frame)
    c = diagnostics.clumps(sim)
    assert volume[p["clump"] >= 0].sum() == pytest.approx(c["area"].sum(), rel=1e-12) and thickness == 1.0
    first = p["clump"] == c["id"][0]
    assert held[first].all() or not held[first].any()


def test_the_box_deletes_a_clump_when_its_centre_leaves(tmp_path):
    sim = model(tmp_path / "data", 1e-2)
    walls.box(sim, 0.0, 100.0, 0.0, 100.0)
    rod = kinds(2.0)[0]
    write_clumps(tmp_path / "rod.clumps", bodies([rod], np.array([(98.0, 50.0), (30.0, 50.0)]), np.array([0.0, 1.0])))
    clumps.clump(sim, tmp_path / "rod.clumps")
    properties.prop(sim, density=DENSITY)
    properties.prop(sim, only(0), xv=1.0)
    assert (sim.particles["x"] > 100.0).sum() == 3
    steps(sim, 100)
    sim.rebuild()
    assert sim.clumps.number == 2 and sim.lost == 0, "three discs are outside, the centre is not"
    steps(sim, 110)
    sim.rebuild()
    assert sim.clumps.number == 1 and sim.lost == 7 and len(sim.particles) == 7
    assert (diagnostics.clumps(sim)["id"] == 7).all()


def test_joined_particles_keep_their_momentum(tmp_path):
    sim = model(tmp_path / "data", 1e-4)
    rng = np.random.default_rng(5)
    for k in range(6):
        particles.ball(sim, 10 + k, 1.1 * k, 0.3 * k, 0.5 + 0.05 * k)
        properties.prop(sim, only(10 + k), density=3.0, kn=1e3, ks=1e3, fric=0.2)
        properties.prop(sim, only(10 + k), xv=rng.normal(), yv=rng.normal(), spin=rng.normal())
    cycles.prepare(sim)
    steps(sim, 5)

    def kept() -> tuple[float, float, float]:
        p, m, i = sim.particles, sim.body[:, 0], sim.body[:, 1]
        turning = m * (p["x"] * p["vy"] - p["y"] * p["vx"]) + i * p["spin"]
        return float((m * p["vx"]).sum()), float((m * p["vy"]).sum()), float(turning.sum())

    before, energy = kept(), diagnostics.kinetic_energy(sim)
    assert clumps.join(sim, Ids(10, 15), group="body", color=2) == 6
    cycles.prepare(sim)
    c = {name: float(values[0]) for name, values in diagnostics.clumps(sim).items()}
    turning = c["mass"] * (c["x"] * c["vy"] - c["y"] * c["vx"]) + c["inertia"] * c["spin"]
    assert (c["mass"] * c["vx"], c["mass"] * c["vy"], turning) == pytest.approx(before, rel=1e-12)
    assert c["id"] == 10 and c["members"] == 6 and diagnostics.kinetic_energy(sim) < energy
    assert not len(diagnostics.contact_rows(sim)[0]), "members of one clump do not touch each other"
    energy = diagnostics.kinetic_energy(sim)
    steps(sim, 1000)
    assert diagnostics.kinetic_energy(sim) == pytest.approx(energy, rel=1e-12)
    assert {int(v) for v in sim.particles["color"]} == {2}


def test_what_cannot_be_joined_is_refused(tmp_path):
    sim = model(tmp_path / "data", 1e-4)
    for k in range(6):
        particles.ball(sim, k, 1.0 * k, 0.0, 0.5)
    properties.prop(sim, density=3.0, kn=1e3)

    def refused(message: str, first: int, last: int) -> None:
        before = diagnostics.fingerprint(sim)
        with pytest.raises(CommandError, match=message):
            clumps.join(sim, Ids(first, last))
        assert diagnostics.fingerprint(sim)["particles"] == before["particles"] and not sim.clumps

    refused("two particles or more, RANGE has 1", 0, 0)
    properties.prop(sim, only(1), density=4.0)
    refused("one density, these have 3 and 4", 0, 1)
    properties.fix(sim, ("x",), only(2))
    refused("fixed as a whole", 2, 3)
    bonds.bond(sim, Ids(4, 5), n_bond=1.0)
    refused("BOND break", 4, 5)
    settings.set_option(sim, "disk", "off")
    refused("SET disk on; it is off", 3, 4)
    settings.set_option(sim, "disk", "on")
    clumps.join(sim, Ids(3, 4))
    with pytest.raises(CommandError, match="particle 3 belongs to a clump already"):
        clumps.join(sim, Ids(4, 5))
    settings.set_option(sim, "disk", "hex")
    with pytest.raises(CommandError, match="SET disk is hex: their mass is density times area"):
        cycles.prepare(sim)


def test_bonds_hold_clumps(tmp_path):
    """A rod hangs from a fixed disc by a bond: at rest the bond carries its weight, and it hangs straight below."""
    sim = model(tmp_path / "data", 1e-3, gravity=(0.0, -G))
    write_clumps(tmp_path / "rod.clumps", bodies([kinds(1.0)[0]], np.array([(3.6, 0.0)]), np.array([0.0])))
    clumps.clump(sim, tmp_path / "rod.clumps")
    particles.ball(sim, 7, -2.0, 0.0, 1.0)
    properties.prop(sim, density=DENSITY, kn=K, ks=K, damp=0.5)
    properties.fix(sim, ("x", "y", "spin"), only(7))
    assert bonds.bond(sim, tolerate=0.1, n_bond=1e30, s_bond=1e30) == 1
    cycles.prepare(sim)
    steps(sim, 20000)
    out, ids = diagnostics.contact_rows(sim)
    c = diagnostics.clumps(sim)
    weight = c["mass"][0] * G
    assert ids.tolist() == [[0, 7, 1]]
    assert (out[0, diagnostics.FORCE_X], out[0, diagnostics.FORCE_Y]) == pytest.approx((0.0, weight), abs=1e-3 * weight)
    assert diagnostics.survey(sim).unbalanced < 1e-3


def test_gen_keeps_clear_of_clumps(tmp_path):
    sim = model(tmp_path / "data", 1e-3)
    write_lattice(tmp_path / "b.clumps", 3.0, 3, 3)
    clumps.clump(sim, tmp_path / "b.clumps")
    particles.gen(sim, 200, [1.0], (0.0, 90.0), (0.0, 90.0))
    properties.prop(sim, density=1.0, kn=1.0)
    cycles.prepare(sim)
    assert not len(diagnostics.contact_rows(sim)[0]) and len(sim.particles) > 180
