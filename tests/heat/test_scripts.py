"""Heat in models that are made by commands: histories, frames, accounts, what a script cannot do."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import ELEMENT, NODE, Ids, OnLayer, Span
from hpcdem.physics.fdem.simulation import Blocks
from tests.heat.support import GRANITE

ROCK = {"density": 2500.0, "young": 50e9, "poisson_ratio": 0.25}
LEFT, RIGHT = (Span(0, 0.0, 0.0),), (Span(0, 4.0, 4.0),)


def strip(tmp_path) -> fdem.Project:
    model = fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "out")
    fdem.meshes.grid(model, (0.0, 0.0), (4.0, 2.0), (4, 2))
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)
    return model


def test_commands_histories_and_frames(tmp_path) -> None:
    model = strip(tmp_path)
    assert "temperature" not in frames.whole(model).of_points
    fdem.heat.model(model, GRANITE)
    fdem.heat.initial(model, 20.0)
    fdem.settings.option(model, mechanical=False)
    fdem.settings.time_step(model, thermal=1000.0)
    fdem.heat.condition(model, 100.0, where=LEFT)
    fdem.heat.face_condition(model, transfer_coeficient=10.0, environment_temperature=5.0, where=RIGHT)
    fdem.heat.element_property(model, {"capacity": 900.0, "density": 2600.0}, where=(Ids(0, 3),))
    fdem.histories.create(model, "gauge", NODE, "temperature", nearest=(4.0, 1.0))
    fdem.histories.create(model, "mean", ELEMENT, "mean_temperature", how="maximum")
    for name in ("heat_time", "heat_given", "heat_stored"):
        fdem.histories.create(model, name, "model", name)
    fdem.steps.step(model, 20)
    rows = {name: np.array(history.rows)[:, 2] for name, history in model.histories.items()}
    assert rows["gauge"][-1] < 20.0 < rows["mean"][-1] < 100.0
    assert rows["heat_time"][-1] == 20000.0 == model.blocks.clock.time
    found = fdem.queries.heat(model)
    assert rows["heat_given"][-1] == found["given"] and rows["heat_stored"][-1] == found["stored"]
    assert found["relative"] < 1e-13
    frame = frames.whole(model)
    nodes = fdem.queries.values(model, NODE, "temperature")
    assert np.array_equal(frame.of_points["temperature"], nodes[frame.of_points["node"]])
    assert np.array_equal(
        frame.of_elements["mean_temperature"], fdem.queries.values(model, ELEMENT, "mean_temperature")
    )
    fdem.heat.remove_conditions(model)
    fdem.heat.remove_face_conditions(model)
    fdem.steps.step(model, 3)
    assert fdem.queries.heat(model)["given"] == found["given"]


def test_sub_steps_are_those_of_a_cycle(tmp_path) -> None:
    model = strip(tmp_path)
    fdem.heat.model(model, GRANITE)
    fdem.settings.option(model, mechanical=False)
    fdem.settings.time_step(model, thermal=10.0)
    fdem.flow.sub_step(model, thermal=5)
    fdem.steps.step(model, 2)
    assert model.blocks.clock.time == 100.0
    fdem.settings.option(model, thermal=False)
    with pytest.raises(CommandError, match="nothing to compute"):
        fdem.steps.step(model, 1)


def test_what_a_script_cannot_do(tmp_path) -> None:
    model = strip(tmp_path)
    for command in (
        lambda: fdem.heat.condition(model, 1.0), lambda: fdem.heat.initial(model, 1.0),
        lambda: fdem.heat.face_condition(model, heat_flux=1.0), lambda: fdem.queries.heat(model),
        lambda: fdem.heat.element_property(model, {"capacity": 1.0}),
    ):  # fmt: skip
        with pytest.raises(CommandError, match="no heat yet"):
            command()
    with pytest.raises(CommandError, match="needs conductivity"):
        fdem.heat.model(model, {"capacity": 1.0})
    assert "heat" not in model.blocks.surface_loads
    fdem.heat.remove_conditions(model)
    fdem.heat.model(model, GRANITE)
    with pytest.raises(CommandError, match="one of heat_flux"):
        fdem.heat.face_condition(model)
    fdem.assignments.null(model, where=(Ids(0, 1),))
    with pytest.raises(CommandError, match="cannot be reinstated in a model with heat"):
        fdem.assignments.element_model(model, "mech_iso_elastic", ROCK, where=(Ids(0, 1),))
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)


def test_faces_without_a_range_are_the_surface(tmp_path) -> None:
    model = strip(tmp_path)
    fdem.heat.model(model, GRANITE)
    fdem.settings.option(model, mechanical=False)
    fdem.settings.time_step(model, thermal=1.0)
    fdem.heat.face_condition(model, heat_flux=2.0)
    fdem.steps.step(model, 1)
    assert fdem.queries.heat(model)["given"] == pytest.approx(2.0 * 12.0)
    assert fdem.queries.numbers(model, NODE, (OnLayer("left"),)).size == 3
