"""Check that a model of blocks can be stepped: nothing is missing, and nothing is assigned to parts that it lacks."""

from __future__ import annotations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import by_temperature, user_laws
from hpcdem.physics.fdem.properties import temperature_table
from hpcdem.physics.fdem.settings import DISTANCE
from hpcdem.physics.fdem.six import elements as six_nodes
from hpcdem.physics.fdem.state import State
from hpcdem.physics.fields import kinds


def bare(sim: State) -> np.ndarray:
    """Elements that have no model yet. CommandError without a mesh."""
    sim.the_mesh()
    return np.flatnonzero(sim.alive & (sim.element_row == 0))


def check(sim: State) -> None:
    """CommandError unless every element has a model."""
    lacking = bare(sim)
    if len(lacking):
        raise CommandError(f"element {lacking[0]} has no model ({len(lacking)} elements in all)")
    if not sim.alive.any():
        raise CommandError("no elements are left")
    _check_warmth(sim)
    six_nodes.check(sim)
    if sim.options.plane_stress:
        user_laws.check_plane_stress(sim)
    if sim.options.stiffness_damping and user_laws.in_use(sim):
        raise CommandError(
            f"the stiffness of {user_laws.some(sim)}, which has a user law, is not known: Rayleigh damping supports "
            "part mass only"
        )


def _check_warmth(sim: State) -> None:
    """CommandError where properties follow temperatures that are not there, or surroundings that cannot follow."""
    elements, joints = sim.temperature_dependent()
    if not elements.any() and not joints.any():
        return
    for what, at, rows, row in (("element", elements, sim.element_rows, sim.element_row),
                                ("joint", joints, sim.joint_rows, sim.joint_row)):  # fmt: skip
        for over, which in by_temperature.followed(sim, rows, row, at):
            if over not in sim.cold:
                lacking = "heat" if over == by_temperature.TEMPERATURE else over
                word = "thermal-iso-heat" if lacking == "heat" else kinds()[over].word
                raise CommandError(
                    f"a property of {what} {which} follows a table over {over}, but there is no {lacking}: element "
                    f"c-model {word} for all"
                )
    soft = elements & (sim.element_rows.column(temperature_table("young"))[sim.element_row] > 0.0)
    beside = np.flatnonzero(sim.quiet_faces() & np.repeat(soft, 4))
    if len(beside) or (soft.any() and "free_field" in sim.surface_loads):
        element = beside[0] // 4 if len(beside) else np.flatnonzero(soft)[0]
        raise CommandError(
            f"young of element {element} follows a table over temperature: quiet faces and free-field sides have "
            "dashpots of one modulus, a number"
        )


def check_parts(sim: State) -> None:
    """CommandError for what was assigned to parts of the calculation that are not there."""
    o = sim.options
    if sim.dim == 2 and o.potential != DISTANCE:
        raise CommandError("model option potential is for three dimensions")
    if not o.mechanical:
        if not any(load.keeps_time for load in sim.surface_loads):
            raise CommandError("nothing to compute: model option mechanical is off, and neither fluid nor heat flows")
        if not o.dynamic:
            raise CommandError("without mechanics, flow and heat need a dynamic run: use model option dynamic on first")
        others = [load.name for load in sim.surface_loads if not load.own_clock]
        if others:
            raise CommandError(f"{others[0].replace('_', '-')} need moving blocks: use model option mechanical on")
        if sim.creep.on:
            raise CommandError("creep needs moving blocks: use model option mechanical on, or model creep off")
    setting = "one-way" if o.one_way else "sub-step" if o.flow_steps > 0 else "time-step" if o.flow_dt > 0.0 else ""
    if o.flow_every != 1 and not o.one_way and "heat" not in sim.surface_loads:
        setting = "sub-step"
    if setting and "fluid" not in sim.surface_loads:
        raise CommandError(
            f"{setting} of flow is set, but no joint has a hydraulic model: assign face-joint c-model "
            "hydraulic-porous-medium"
        )
    if (o.heat_steps > 0 or o.heat_dt > 0.0) and "heat" not in sim.surface_loads:
        name = "sub-step" if o.heat_steps > 0 else "time-step"
        raise CommandError(
            f"{name} of heat is set, but no element has a thermal model: assign element c-model thermal-iso-heat"
        )
