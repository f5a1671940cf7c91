"""model new, gravity, units, option, time-step, rayleigh, creep; reset."""

from __future__ import annotations

from typing import Any

from hpcdem.commands import units as of_values
from hpcdem.commands.fdem import coupling
from hpcdem.commands.fdem.choices import chosen, everything
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.records import ENERGIES
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem import creep as of_elements
from hpcdem.physics.fdem.groups import ELEMENT, JOINT, Range, UseHidden


def new(project: Project, dim: int = 2) -> None:
    """Start a new model in two or three dimensions: no geometry, no mesh, step 0, default options."""
    if dim not in (2, 3):
        raise CommandError(f"a model has 2 or 3 dimensions, not {dim}")
    project.clear(dim)


def gravity(project: Project, gravity: tuple[float, ...]) -> None:
    """Set gravity (2,), in space (3,), [m/s2]."""
    if len(gravity) != project.dim:
        raise CommandError(f"gravity: a vector of {project.dim} numbers is needed, got {len(gravity)}")
    project.blocks.gravity(*gravity)


def units(project: Project, system: str) -> None:
    """Declare the units of all input from here on, see `commands.units`; no value is converted."""
    project.units = of_values.declared(project.units, system, project.log, late=project.in_use)


def option(
    project: Project,
    dynamic: bool | None = None,
    collision: bool | None = None,
    large_strain: bool | None = None,
    overlap: str | None = None,
    deep_overlap: str | None = None,
    potential: str | None = None,
    energy: bool | None = None,
    mechanical: bool | None = None,
    hydraulic: bool | None = None,
    one_way: bool | None = None,
    thermal: bool | None = None,
    proppant: bool | None = None,
    plane_stress: bool | None = None,
) -> None:
    """Set options; None keeps one. overlap: treatment of bodies that overlap before the first step, deep_overlap:
    later; potential: of contact in space; plane_stress: see `Blocks.option`; energy: keep the energy budget from here
    on; mechanical, hydraulic, one_way, thermal, proppant: see `Blocks.parts`.
    """
    if mechanical is False:
        coupling.refuse(project, "model option mechanical off")
    parts = {
        "mechanical": mechanical, "hydraulic": hydraulic, "one_way": one_way, "thermal": thermal, "proppant": proppant,
    }  # fmt: skip
    if any(value is not None for value in parts.values()):
        project.blocks.parts(**parts)
    if dynamic is not None:
        project.dynamic = dynamic
    of_blocks: dict[str, Any] = {
        "dynamic": dynamic, "collision": collision, "large_strain": large_strain, "overlap": overlap,
        "deep_overlap": deep_overlap, "potential": potential, "plane_stress": plane_stress,
    }  # fmt: skip
    given = {name: value for name, value in of_blocks.items() if value is not None}
    if given:
        project.blocks.option(**given)
    if energy is not None:
        needed = [name for name, history in project.histories.items() if history.value in ENERGIES]
        if not energy and needed:
            raise CommandError(f"history '{needed[0]}' follows the energy budget: history delete '{needed[0]}' first")
        diagnostics.account_energy(project.ready(), energy)


def time_step(
    project: Project,
    value: float | str | None = None,
    auto: bool | None = None,
    safety: float | None = None,
    mass_scaling: float | None = None,
    hydraulic: float | None = None,
    thermal: float | None = None,
    update_frequency: int | None = None,
) -> None:
    """Set the time step of dynamic runs [s], or the name of a table of it over time; see `Blocks.time_step`. hydraulic,
    thermal: of flow and of heat, see `Blocks.flow_clock`, `Blocks.heat_clock`; update_frequency: steps between two
    estimates of an automatic time step.
    """
    table = value if isinstance(value, str) else ""
    number = None if isinstance(value, str) else value
    if table:
        if table not in project.blocks.tables:
            raise CommandError(f"time-step: there is no table '{table}'")
        if (project.blocks.tables[table].values <= 0.0).any():
            raise CommandError(f"time-step: table '{table}' has a value that is not above 0")
        number = project.blocks.tables[table](project.blocks.clock.time)
    if hydraulic is not None:
        project.blocks.flow_clock(dt=hydraulic)
    if thermal is not None:
        project.blocks.heat_clock(dt=thermal)
    if (value, auto, safety, mass_scaling, update_frequency) == (None,) * 5:
        return
    project.blocks.time_step(value=number, auto=auto, safety=safety, mass_scaling=mass_scaling)
    if update_frequency is not None:
        project.blocks.estimate_every(update_frequency)
    if value is not None or mass_scaling is not None or auto:
        project.step_table = table
    if value or mass_scaling or auto is not None:
        project.adapts = bool(auto or table)


def rayleigh(project: Project, ratio: float, frequency: float | None = None, part: str = "both") -> None:
    """Set Rayleigh damping of dynamic runs, frequency [Hz]; see `ModelDefinition.rayleigh`."""
    project.blocks.rayleigh(ratio, frequency, part)


def creep(
    project: Project,
    on: bool,
    dt: float | None = None,
    change: float | None = None,
    least: float | None = None,
    greatest: float | None = None,
) -> None:
    """Switch creep of elements on or off; see `creep.switch`."""
    coupling.refuse(project, "model creep")
    if on and dt is not None and project.dynamic:
        raise CommandError("dt of creep is for static runs: in dynamic runs elements creep in every time step")
    of_elements.switch(project.ready(), on, dt, change, least, greatest)


def reset_velocity(project: Project) -> None:
    """Set all velocities to zero."""
    changes.reset_velocity(project.ready())


def reset_displacement(project: Project) -> None:
    """Set all displacements to zero."""
    changes.reset_displacement(project.ready())


def hide(project: Project, hidden: bool = True, where: Range | None = None) -> None:
    """Hide elements from pictures and, without use-hidden, from ranges, or show them again."""
    seen_too = where if where is None else (*where, UseHidden())
    project.whole_mesh()
    project.hidden[everything(project, ELEMENT, seen_too, null_too=True)] = hidden


def collision(project: Project, on: bool, where: Range | None = None) -> None:
    """Switch the search for contacts of these elements on or off."""
    blocks = project.ready()
    elements = everything(project, ELEMENT, where, null_too=True)
    blocks.before_change()
    blocks.touches[elements] = on
    blocks.changed()


def reset_elements(project: Project, where: Range | None = None) -> None:
    """Reset plastic states of elements."""
    changes.reset_state(project.ready(), chosen(project, ELEMENT, where))


def reset_kelvin_strain(project: Project, where: Range | None = None) -> None:
    """Set the strain of Kelvin units to zero."""
    changes.reset_kelvin_strain(project.ready(), chosen(project, ELEMENT, where))


def reset_joints(project: Project, where: Range | None = None) -> None:
    """Reset the damage of joints."""
    changes.reset_joint_state(project.ready(), chosen(project, JOINT, where))
