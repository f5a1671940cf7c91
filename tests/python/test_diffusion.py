"""Physics on particles beside their motion, by the worked example physics/diffusion: heat through contacts.

A row of N equal discs that touch, heat capacity C = c m, conductance H of each contact: forward Euler damps the mode
T_k = cos(pi q (k + 1/2) / N) by the factor 1 - 4 H dt / C sin^2(pi q / 2 N) per step.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core import fields
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.io.frames import read_frame
from hpcdem.physics.dem import diagnostics, saved_state
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.diffusion import kernels
from hpcdem.physics.diffusion.model import Diffusion
from tests.property.workers import Resident
from tests.short_push import assert_same_files, contents

N, RADIUS, DENSITY = 24, 0.5, 2.0
MASS = DENSITY * math.pi * RADIUS**2


def row_of_discs(folder: Path, threads: int = 1, conductance: float = 3.0, capacity: float = 2.0) -> Simulation:
    """N discs at rest that just touch, without stiffness."""
    sim = Simulation(SerialComm(), threads, folder)
    sim.settings.disk, sim.settings.dt, sim.clock.dt = "on", 1e-2, 1e-2
    sim.add_physics(Diffusion(conductance, capacity))
    material = np.full(N, sim.materials.row(density=DENSITY))
    x = 2.0 * RADIUS * (1.0 - 1e-9) * np.arange(N)
    sim.particles.append(x=x, y=0.0, radius=RADIUS, material=material, gid=np.arange(N))
    sim.hist, sim.next_gid = sim.hist.extended(N), N
    return sim


@pytest.mark.some_of_each
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(("conductance", "capacity", "q"), [(3.0, 2.0, 1), (3.0, 2.0, 5), (1.0, 2.0, 1), (3.0, 5.0, 1)])
def test_modes_of_a_row_decay_as_computed(tmp_path, threads, conductance, capacity, q):
    sim = row_of_discs(tmp_path, threads, conductance, capacity)
    mode = np.cos(math.pi * q * (np.arange(N) + 0.5) / N)
    sim.particles["temperature"][:] = 10.0 + mode
    with pytest.warns(DeprecationWarning, match="close_model"):
        sim.close()  # its name before
    for _ in range(50):
        sim.step()
    rate = 4.0 * conductance / (capacity * MASS) * math.sin(math.pi * q / (2 * N)) ** 2
    order = np.argsort(sim.particles["gid"])
    expected = 10.0 + mode * (1.0 - rate * 1e-2) ** 50
    assert sim.particles["temperature"][order] == pytest.approx(expected, abs=1e-12)


def test_heat_is_kept_and_sources_give_theirs(tmp_path):
    sim = row_of_discs(tmp_path)
    diffusion = sim.physics[0]
    sim.particles["temperature"][3] = 100.0
    sim.particles["heat_source"][20] = 7.0
    sim.close_model()
    before = diffusion.diagnostics()["heat"][1](sim)
    for _ in range(40):
        sim.step()
    heat, given = (what(sim) for _, what in diffusion.diagnostics().values())
    assert before == pytest.approx(2.0 * MASS * 100.0) and given == pytest.approx(7.0 * 0.4, rel=1e-13)
    assert heat - given == pytest.approx(before, rel=1e-13)


def test_discs_apart_keep_their_heat(tmp_path):
    sim = row_of_discs(tmp_path)
    sim.particles["x"][12:] += 0.05
    sim.particles["temperature"][:12] = 1.0
    sim.close_model()
    for _ in range(10):
        sim.step()
    assert np.ptp(sim.particles["temperature"][:12]) == 0.0 and not sim.particles["temperature"][12:].any()


@pytest.mark.parametrize(("name", "values"), [("conductance", (0.0, 1.0)), ("capacity", (1.0, math.nan))])
def test_wrong_parameters(name, values):
    with pytest.raises(CommandError, match=f"diffusion: {name} must be a positive number"):
        Diffusion(*values)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("magic", {}, "there is no physics 'magic'; available: diffusion"),
        ("diffusion", {"conductance": 1.0}, "diffusion: missing 1 required positional argument: 'capacity'"),
        ("diffusion", {"conductance": 1.0, "capacity": 1.0, "colour": 1.0}, "unexpected keyword argument 'colour'"),
    ],
)
def test_wrong_calls(name, parameters, message):
    with pytest.raises(CommandError, match=message):
        saved_state.add_physics(Simulation(), name, parameters)


def test_physics_is_added_once(tmp_path):
    with pytest.raises(CommandError, match="has a field temperature already"):
        row_of_discs(tmp_path).add_physics(Diffusion(1.0, 1.0))


def test_the_limit_of_the_time_step(tmp_path):
    """c m / (2 H) for discs with two neighbours."""
    from hpcdem.commands.dem import cycles

    sim = row_of_discs(tmp_path)
    sim.close_model()
    limit = sim.physics[0].stable_time_step(sim)
    assert limit == pytest.approx(2.0 * MASS / 6.0, rel=1e-12)
    sim.settings.dt = 1.01 * limit
    with pytest.raises(CommandError, match="is beyond the stability limit of diffusion"):
        cycles.prepare(sim)


def test_a_limit_that_falls_in_mid_run_stops_it(tmp_path):
    """Discs come together: with two neighbours each in place of none the step is too large."""
    sim = row_of_discs(tmp_path)
    sim.particles["x"][:] *= 1.5
    sim.settings.dt = sim.clock.dt = 1.0
    sim.close_model()
    sim.step()
    sim.particles["x"][:] /= 1.5
    with pytest.raises(PhysicsError, match=r"time step 1 s is beyond the stability limit of diffusion, 0\.52"):
        sim.rebuild()


def test_particles_without_mass_are_refused(tmp_path):
    from hpcdem.commands.dem import cycles, properties
    from hpcdem.core.selection import Ids

    sim = row_of_discs(tmp_path)
    sim.particles["material"][np.isin(sim.particles["gid"], (2, 3, 4))] = sim.materials.row()
    sim.tables_changed()
    properties.fix(sim, ("x", "y", "spin"), where=Ids(2, 4))
    with pytest.raises(CommandError, match="diffusion: 3 particles have no mass"):
        cycles.prepare(sim)


def test_clumps_are_refused(tmp_path):
    from hpcdem.commands.dem import clumps, cycles
    from hpcdem.core.selection import Ids

    sim = row_of_discs(tmp_path)
    clumps.join(sim, Ids(0, 3))
    with pytest.raises(CommandError, match="heat inside clumps is not supported"):
        cycles.prepare(sim)


def test_new_particles_have_initial_values_and_the_removed_take_theirs_along(tmp_path):
    sim = row_of_discs(tmp_path)
    sim.particles["temperature"][:] = np.arange(N)
    sim.remove(np.arange(N) % 2 == 0)
    assert sim.particles["temperature"].tolist() == list(range(1, N, 2))
    sim.particles.append(x=np.array([99.0]), y=0.0, radius=0.5, gid=np.array([N]))
    assert sim.particles["temperature"][-1] == 0.0 and len(sim.particles) == N // 2 + 1


def test_state_and_its_fingerprint(tmp_path):
    sim = row_of_discs(tmp_path)
    sim.particles["temperature"][:] = np.arange(N)
    sim.close_model()
    sim.step()
    before = diagnostics.fingerprint(sim)
    saved_state.save(sim, tmp_path / "a.sav")
    other = Simulation()
    saved_state.restore(other, tmp_path / "a.sav")
    assert other.physics[0].parameters() == {"conductance": 3.0, "capacity": 2.0}
    assert diagnostics.fingerprint(other) == before
    other.particles["temperature"][0] += 1e-13
    assert diagnostics.fingerprint(other) != before


PROGRAM = """\
import hpcdem

sim = hpcdem.Simulation(outdir={outdir!r})
if {restore!r}:
    sim.restore({restore!r})
else:
    sim.set(disk="on", seed=3, dt=1e-3, gravity=(0.0, -10.0), energy=20)
    sim.box(0.0, 30.0, 0.0, 30.0, kn=1e6, ks=1e6, fric=0.3)
    sim.gen(300, rad=[0.4, 0.6], x=(0.0, 30.0), y=(0.0, 25.0))
    sim.prop(density=2500.0, kn=1e6, ks=5e5, fric=0.4, damp=0.2)
    sim.add_physics("diffusion", conductance=4e3, capacity=1.0)
    sim["temperature"] = sim["x"] ** 2
    sim["heat_source"] = (sim["y"] > 12.0) * 1e4
    sim.hist(1, 10, "heat")
    sim.set(print=60)
    sim.cycle(60)
    sim.save("middle.sav")
sim.cycle(60)
sim.save("end.sav")
sim.finish()
"""


def run(resident: Resident, folder: Path, ranks: int, threads: int = 1, restore: str = "") -> Path:
    folder.mkdir()
    (folder / "heat.py").write_text(PROGRAM.format(outdir="data", restore=restore))
    done = resident(ranks, "heat.py", "-j", threads, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.mpi
def test_the_same_files_on_any_ranks_and_threads_and_after_a_restart(resident: Resident, tmp_path: Path) -> None:
    alone = run(resident, tmp_path / "alone", 1)
    frame = read_frame(tmp_path / "alone/data/all_0000000120.vtkhdf")
    temperature = frame.tables["particles"].columns["temperature"]
    assert temperature.std() > 10.0 and frame.tables["particles"].columns["heat_given"].max() > 0.0
    rows = (tmp_path / "alone/data/hist_1.csv").read_text().splitlines()
    assert rows[0] == "step,time [s],heat [J]" and len(rows) == 13
    energy = (tmp_path / "alone/data/energy.csv").read_text().splitlines()
    assert energy[0].endswith(",closing,relative,heat,heat_given")
    first, last = ([float(v) for v in row.split(",")[-2:]] for row in (energy[1], energy[-1]))
    assert last[0] - first[0] == pytest.approx(last[1] - first[1], rel=1e-9) and last[1] > 0.0
    for ranks, threads in ((3, 1), (1, 2)):
        assert_same_files(alone, run(resident, tmp_path / f"{ranks}x{threads}", ranks, threads))
    on_two = run(resident, tmp_path / "again", 2, restore=str(alone / "middle.sav"))
    for name in ("end.sav", "data/all_0000000120.vtkhdf"):
        one, other = contents(alone / name), contents(on_two / name)
        assert one.keys() == other.keys()
        differ = [key for key in one if not np.array_equal(one[key], other[key], equal_nan=one[key].dtype.kind == "f")]
        assert set(differ) <= {"@state", "@crc"}, differ  # how often lists were rebuilt, and its checksum


def test_heat_between_discs_that_touch() -> None:
    """Conductance times the difference, one way and the other; of a ghost and of what is apart nothing."""
    hot = np.zeros((4, fields.WIDTH))
    hot[:, fields.X], hot[:, fields.Y], hot[:, fields.RADIUS] = (0.0, 1.2, 2.4, 3.6), (0.0, 1.5, 3.0, 4.5), 1.0
    temperature, flow, links = np.array([10.0, 30.0, 70.0, 20.0]), np.zeros(4), np.zeros(4)
    row, partner = np.array([0, 1, 2, 0]), np.array([1, 2, 3, 3])
    kernels.inflow(hot, row, partner, 1, 3, temperature, 0.5, flow, links)
    assert flow.tolist() == [0.0, -10.0 + 20.0, -20.0 - 25.0, 0.0] and links.tolist() == [0.0, 2.0, 2.0, 0.0]
