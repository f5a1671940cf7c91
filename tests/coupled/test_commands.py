"""hpcdem.couple and what the commands of a script then do."""

from __future__ import annotations

import io
import itertools

import numpy as np
import pytest

from hpcdem import output
from hpcdem.blocks import Blocks
from hpcdem.cli import info
from hpcdem.commands import properties, running, settings, walls
from hpcdem.commands.blocks import assigning, closing, coupling, meshing, saving
from hpcdem.commands.blocks import running as stepping
from hpcdem.commands.blocks.project import Project
from hpcdem.errors import CommandError
from hpcdem.halo.comm import SerialComm
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.post import inventory
from hpcdem.runtime.progress import BETWEEN, Log
from hpcdem.simulation import Watcher
from hpcdem.timers import Timers
from tests.coupled.support import ROCK, discs


def scene(folder) -> tuple[Project, object]:
    """A block beside a disc that falls on it, not yet coupled."""
    project = Project(Blocks(outdir=folder / "data"), folder, folder / "data")
    meshing.rectangle(project, (0.0, 0.0), (1.2, 0.6), (6, 3))
    assigning.element_model(project, "mech_iso_elastic", ROCK)
    sim = discs([(0.5, 0.6995, 0.1), (0.5, 0.8998, 0.1)], folder / "sand", dt=5e-6)
    properties.prop(sim, yv=-1.0, xv=0.3)
    settings.set_option(sim, "print", 100)
    settings.set_option(sim, "energy", 50)
    return project, sim


def state(project):
    both = project.coupled
    p = both.particles.particles
    return np.concatenate([project.blocks.values("position_y"), p["x"], p["y"], p["spin"], both.contacts()["fs"],
                           [both.energies()["lost"]]])  # fmt: skip


def test_both_are_stepped_saved_and_restored(tmp_path):
    project, sim = scene(tmp_path)
    coupling.couple(project, sim)
    stepping.step(project, 130)
    assert sim.clock.step == project.step == 130
    saving.save(project, "middle.sav")
    stepping.step(project, 170)
    whole = state(project)
    names = sorted(path.name for path in (tmp_path / "sand").glob("*.vtkhdf"))
    assert [name[-10:-7] for name in names][-2:] == ["200", "300"]
    rows = np.genfromtxt(tmp_path / "sand" / "energy.csv", delimiter=",", names=True)
    assert rows["step"][-1] == 300 and rows["work_blocks"][-1] != 0.0 and abs(rows["relative"][-1]) < 1e-2

    saving.restore(project, str(tmp_path / "middle.sav"))
    assert sim.clock.step == project.step == 130
    stepping.step(project, 170)
    assert np.array_equal(state(project), whole)

    # As a run does that goes on: blocks first, particles when the script has coupled them again.
    again, other = scene(tmp_path)
    saving._restored(again, tmp_path / "middle.sav", begins=True)
    coupling.couple(again, other)
    stepping.step(again, 170)
    assert other.clock.step == again.step == 300 and np.array_equal(state(again), whole)


def test_refusals(tmp_path):
    project, sim = scene(tmp_path)
    with pytest.raises(CommandError, match="would both write into"):
        coupling.couple(project, discs([(0.5, 0.9, 0.1)], tmp_path / "data", dt=5e-6))
    with pytest.raises(CommandError, match="time step must be positive"):
        coupling.couple(project, sim, dt=-1.0)
    sim.watchers.append(Watcher(5, lambda: None))
    with pytest.raises(CommandError, match="wait for steps of the particles"):
        coupling.couple(project, sim)
    sim.watchers.clear()
    inside = discs([(0.5, 0.31, 0.1)], tmp_path / "sand", dt=5e-6)
    with pytest.raises(CommandError, match="inside element"):
        coupling.couple(project, inside)
    coupling.couple(project, sim)  # nothing is left of the failed ones
    with pytest.raises(CommandError, match="coupled to particles already"):
        coupling.couple(project, sim)
    with pytest.raises(CommandError, match="CYC would leave the blocks behind"):
        running.cycle(sim, 1)
    project.clear()
    running.cycle(sim, 1)


def test_info_of_a_checkpoint_of_both(tmp_path, capsys):
    """Both stand in it, each with its own step; damage is found wherever it is."""
    project, sim = scene(tmp_path)
    walls.wall(sim, 1, nodes=((-1.0, -0.5), (2.0, -0.5)))
    running.cycle(sim, 7)
    both = coupling.couple(project, sim)
    stepping.step(project, 130)
    saving.save(project, "middle.sav")
    path = tmp_path / "middle.sav"
    facts = inventory.of_file(path)
    assert facts["whole"] and (facts["kind"], facts["version"]) == ("checkpoint", checkpoint.VERSION)
    assert (facts["step"], facts["dt"], facts["elements"], facts["nodes"]) == (130, 5e-6, 36, 28)
    assert facts["time"] == project.blocks.clock.time
    assert facts["particles_at"] == {"step": 137, "time": sim.clock.time, "dt": 5e-6}
    assert (facts["particles"], facts["bonds"], facts["walls"]) == (2, 0, 1)
    assert facts["disc_face_contacts"] == len(both.contacts()["id"]) > 0
    info.show(path, facts)
    shown = capsys.readouterr().out
    assert f"{path}: checkpoint, whole" in shown and "\n  particles    2\n" in shown
    assert "\n  particles at step 137, time 0.000685, dt 5e-06\n" in shown

    content = path.read_bytes()
    tables = checkpoint.read(path)[1]
    broken = tmp_path / "broken.sav"
    for name in ("discs_particles", "disc_contacts", "state"):
        rows = next(iter(column for column in tables[name].values() if column.any()))
        at = content.index(rows.tobytes())
        broken.write_bytes(content[: at + 1] + bytes([content[at + 1] ^ 1]) + content[at + 2 :])
        assert not inventory.of_file(broken)["whole"]
    broken.write_bytes(content[:-100])
    assert "seal" in inventory.of_file(broken)["why"]

    state = checkpoint.read_state(path)
    hostile = ({"kind": "plasma"}, {"particles": None}, {"particles": {**state["particles"], "walls": 3}},
               {"particles": {}}, {"extra": []})  # fmt: skip
    for change in hostile:
        slabs = {name: Table(columns, 0, len(next(iter(columns.values())))) for name, columns in tables.items()}
        checkpoint.write(broken, {**state, **change}, slabs, SerialComm())
        facts = inventory.of_file(broken)
        assert not facts["whole"] and ("of what ('plasma')" in facts["why"] or "is damaged" in facts["why"])


def rows_of(text, title):
    """The table with this title, by its first column."""
    lines = text.split(f"{title}\n", 1)[1].splitlines()
    cells = [line.rsplit(maxsplit=1) for line in lines[1:]]
    return {name.strip(): float(value) for name, value in itertools.takewhile(lambda row: row[1][-1].isdigit(), cells)}


def test_the_tables_of_energy_close_together(tmp_path):
    """Both list what went across the contacts by one name; with the energy of the falling discs in, theirs and what the
    contacts kept add up as `energies` does, to the digits that are shown."""
    project, sim = scene(tmp_path)
    said = io.StringIO()
    project.blocks.log = sim.log = Log(stream=said)
    project.blocks.account_energy()
    both = coupling.couple(project, sim)
    falling = 2 * 0.5 * 2500.0 * np.pi * 0.1**2 * (1.0**2 + 0.3**2)
    stepping.step(project, 250)
    saving.save(project, "middle.sav")
    stepping.step(project, 3000)
    whole = project.blocks.energies()
    saving.restore(project, str(tmp_path / "middle.sav"))
    stepping.step(project, 3000)
    assert project.blocks.energies() == whole  # a restart forgets nothing of it
    found = both.energies()
    assert whole["work_discs"] == pytest.approx(found["work_on_blocks"], rel=1e-9) and whole["work_discs"] > 1.0
    assert abs(whole["work_outside"]) < 1e-9 * whole["work_discs"]

    output.tell_energy(sim)
    told = said.getvalue()
    discs = rows_of(told, "energy budget")
    said.truncate(0)
    closing.close(project, figure=False)
    told = said.getvalue()
    blocks, between = rows_of(told, "energy budget"), rows_of(told, output.ACROSS)
    assert discs[output.ACROSS] == between["work on particles"] and blocks[output.ACROSS] == between["work on blocks"]
    assert sum(between.values()) == pytest.approx(0.0, abs=1e-4)
    of_discs = sum(v for name, v in discs.items() if name.startswith(("stored", "lost"))) - falling
    of_blocks = sum(v for name, v in blocks.items() if name.startswith(("stored", "lost")))
    left = of_discs + of_blocks + between["lost by friction, less overlaps at first"]
    left += between["stored in the contacts, more than at first"]
    assert abs(left) < 1e-4 * falling and found["relative"] < 1e-6
    assert found["lost"] == pytest.approx(-0.5 * 1e7 * 0.0005**2, rel=0.02)  # sticks; begins with an overlap of 0.5 mm
    assert "energy of both: closing error" in told


def test_the_table_of_stages_names_both(tmp_path):
    """One table: stages of either, what is between them, nothing twice: they add up to the wall time at most."""
    project, sim = scene(tmp_path)
    said = io.StringIO()
    project.blocks.log = Log(stream=said)
    coupling.couple(project, sim)
    stepping.step(project, 300)
    closing.close(project, figure=False)
    cells = [line.split("  ") for line in said.getvalue().splitlines()]
    names = {row[0] for row in cells}
    assert {"particles: force", "blocks: force", "between: contact", "between: search", "between: exchange",
            "particles: output", "blocks: node", "other"} <= names  # fmt: skip
    assert "300 steps of particles and 300 of blocks in" in said.getvalue()
    summary = Timers.joined({"a": sim.timers, "b": project.blocks.timers}, BETWEEN).merge(SerialComm())
    assert sum(stage.mean for stage in summary.stages) < summary.wall and summary.imbalance == 1.0
