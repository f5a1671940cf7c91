"""Saved and restored models of blocks go on bit for bit, whatever state they were in."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import convergence, diagnostics, groups, saved_state
from hpcdem.physics.fdem.properties import CONTACT_MOHR_COULOMB, Rows
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks import models
from tests.blocks.support import jointed, model, rectangle


def state(sim: Blocks) -> dict[str, np.ndarray]:
    names = ("position_x", "position_y", "velocity_x", "stress_xx", "damage", "state", "reaction_x", "displacement_y")
    out = {name: diagnostics.values(sim, name) for name in names}
    out["contacts"] = np.column_stack([diagnostics.contacts(sim)[name] for name in ("x", "y")])
    out["clock"] = np.array([sim.clock.step, sim.clock.time, sim.clock.dt])
    return out


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> None:
    for name, values in a.items():
        assert np.array_equal(values, b[name], equal_nan=True), name


def test_a_run_with_all_kinds_of_stages_continues(tmp_path):
    """Before the first step, at rest, just after elements were taken out (not stepped yet), while forces fade, before
    and after the change to motion, while it breaks: 60 steps from a file come to the state of the run that wrote it."""
    sim, given, ends = Blocks(), (300, 750), {}  # given: saved with the commands of this step given, the model open
    models.opening(sim)

    def restored(at):
        saved_state.save(sim, tmp_path / "a.sav", {"m_n": 3})
        again = Blocks(threads=1)
        assert saved_state.restore(again, tmp_path / "a.sav") == {"m_n": 3}
        if at not in given:
            same(state(sim), state(again))
        for k in range(60):
            if k or at not in given:
                models.open_up(again)
            again.step()
        ends[again.clock.step] = state(again)

    while sim.clock.step <= 1020:
        at = sim.clock.step
        if at in ends:
            same(state(sim), ends.pop(at))
        if at in (0, 100, 301, 420, 751, 960):
            restored(at)
        models.open_up(sim)
        if at in given:
            restored(at)
        sim.step()
    assert not ends


@pytest.mark.parametrize(("key", "of"), [("groups", np.ndarray.tolist), ("group_runs", groups.runs)])
def test_groups_of_the_mesh_are_read_by_element_too_as_version_8_has_them(key, of):
    rows, mesh = np.array([0, 1, 2, 5]), rectangle(2, 2, 1.0, 1.0)
    about = {key: {"s": {"a": of(rows), "none": of(rows[:0])}}, "layers": {}, "cracks": [], "crack_sets": []}
    corners = {f"corner_{k}": mesh.cells[:, k] for k in range(4)}
    found = saved_state._mesh(about, {"mesh_points": dict(zip("xy", mesh.points.T)), "mesh_cells": corners}).groups["s"]
    assert found["a"].tolist() == rows.tolist() and found["none"].tolist() == []


def test_looking_and_saving_change_nothing(tmp_path):
    """A run that is looked at and saved at every step ends like one that is not."""
    ends = []
    for look in (False, True):
        sim = Blocks()
        models.impact(sim)
        convergence.advance(sim, 900)
        for k in range(150):
            convergence.advance(sim, 1)
            if look:
                diagnostics.values(sim, "stress_max")
                diagnostics.unbalanced_ratio(sim)
                diagnostics.energies(sim)
                diagnostics.contacts(sim)
                diagnostics.events(sim)
                if k % 10 == 0:
                    saved_state.save(sim, tmp_path / "b.sav")
        ends.append(state(sim))
    assert np.nanmax(ends[0]["damage"]) == 1.0
    same(*ends)


def test_the_time_limit_hears_how_long_a_checkpoint_took(tmp_path):
    sim = Blocks(stop=SimpleNamespace(saved=(took := []).append))
    models.impact(sim)
    saved_state.save(sim, tmp_path / "a.sav")
    assert len(took) == 1 and took[0] > 0.0


def test_variables_alone_can_be_saved(tmp_path):
    """A model without a mesh keeps what the script wants to keep."""
    sim = Blocks()
    saved_state.save(sim, tmp_path / "v.sav", {"m_a": [1.5, "x"], "nested": {"k": None}})
    other = jointed(model(rectangle(2, 2, 1.0, 1.0)))
    assert saved_state.restore(other, tmp_path / "v.sav") == {"m_a": [1.5, "x"], "nested": {"k": None}}
    assert other.mesh is None
    with pytest.raises(CommandError, match="no mesh"):
        other.step()


def test_what_cannot_be_restored_leaves_the_model_alone(tmp_path):
    sim = jointed(model(rectangle(2, 2, 1.0, 1.0)))
    convergence.advance(sim, 5)
    before = state(sim)
    (tmp_path / "c.sav").write_bytes(b"not a checkpoint")
    for path in (tmp_path / "c.sav", tmp_path / "missing.sav", tmp_path):
        with pytest.raises(CommandError):
            saved_state.restore(sim, Path(path))
        same(before, state(sim))
    convergence.advance(sim, 5)


def test_tables_of_earlier_versions_lack_what_is_new():
    """Rows of contact models without damping_ratio, options without overlap: as if they had not been said."""
    rows = Rows()
    rows.row(CONTACT_MOHR_COULOMB, CONTACT_MOHR_COULOMB.complete({"penalty_normal": 1e10}))
    (none, (name, numbers)) = rows.state()
    again = Rows.restored([none, [name, numbers[:-1]]])
    assert list(again.column("damping_ratio")) == [0.0, 0.0] and list(again.column("penalty_normal")) == [0.0, 1e10]
    sim = model(rectangle(1, 1, 1.0, 1.0))
    state = sim.definition_state()
    del state["options"]["overlap"]
    sim.take_definition_state(state)
    assert sim.options.overlap == "refuse"
