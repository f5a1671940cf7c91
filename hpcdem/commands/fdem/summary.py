"""Output at the end of a run of blocks: histories, energy, the table of stages, the last figure."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from hpcdem.commands.dem import output
from hpcdem.commands.fdem import frames, histories
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import unit_in
from hpcdem.core.units import with_prefix
from hpcdem.io.agreed import on_first
from hpcdem.physics import supports
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.groups import ELEMENT, FACE, JOINT, Range
from hpcdem.physics.fields import kinds
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant

ENERGY_WORDS = {
    "kinetic": "stored: motion",
    "strain": "stored: strain of elements",
    "joints": "stored: joints",
    "joints_lost": "lost by fracture and friction in joints",
    "contact": "lost or stored by contacts",
    "viscous_lost": "lost by viscous damping",
    "plastic_lost": "lost by plastic flow",
    "creep_lost": "lost by creep",
    "work_gravity": "work of gravity",
    "work_outside": "work of loads and conditions",
    "work_discs": output.ACROSS,
    "work_bolts": "work of bolts on the rock",
    "work_liners": "work of liners on the rock",
    "work_heat": "work of thermal stress",
    "commands": "supplied by commands",
    "closing": "closing error",
}
"""Names of the entries of the energy budget in the final table."""
SUPPORT_WORDS = {
    "stored": "stored, with kinetic energy",
    "at_start": "part of it at the beginning",
    "lost_in_bars": "lost by yield and rupture",
    "lost_in_grout": "lost by slip in the grout",
    "lost_by_dashpots": "lost by viscous damping",
    "lost_in_beams": "lost by yield",
    "lost_in_bond": "lost by slip and failure of the bond",
    "work_on_rock": "work on the rock",
    "work_of_conditions": "work of conditions",
    "work_of_gravity": "work of gravity",
    "commands": "supplied by commands, such as pretension",
    "closing": "closing error",
}
"""Names of the entries of the budgets of bolts and liners."""
FLUID_WORDS = {
    "given": "supplied by conditions and at the beginning",
    "stored": "in the channels",
    "leaked": "leaked into the rock",
    "removed": "removed with channels",
    "closing": "closing error",
}
"""Names of the entries of the budget of the fluid, volumes at its density at zero pressure."""
PROPPANT_WORDS = {
    "came": "supplied by conditions and at the beginning", "stored": "in the channels", "packed": "part of it packed",
    "left": "removed with fluid", "removed": "removed with channels",
    "closing": "closing error",
}  # fmt: skip
"""Names of the entries of the budget of proppant."""
HEAT_WORDS = {
    "given": "supplied by conditions", "commands": "supplied by commands",
    "stored": "stored in elements, relative to temperature 0",
    "fluid": "in the fluid",
    "removed": "removed with elements and channels", "closing": "closing error",
}  # fmt: skip
"""Names of the entries of the budget of heat."""
ACROSS_WORDS = {
    "work_on_particles": "work on particles",
    "work_on_blocks": "work on blocks",
    "stored": "stored in the contacts since the beginning",
    "lost": "lost by friction, minus initial overlaps",
}
"""Names of the entries of the exchange of energy between particles and blocks, whose sum is 0."""


def close(project: Project, figure: bool = True) -> None:
    """Write pending files, log the summary and draw the last state. Collective."""
    histories.flush(project)
    blocks, log = project.blocks, project.log
    both = project.coupled
    stepped = blocks.timers.steps or (both is not None and both.particles.timers.steps)
    if log is None or not (stepped or project.solved):
        return
    joule, volume = unit_in("J/m", blocks.dim), unit_in("m2", blocks.dim, content=True)
    if blocks.budget is not None:
        energies = diagnostics.energies(blocks)
        entries = {
            text: energies[name]
            for name, text in ENERGY_WORDS.items()
            if name not in ("work_discs", "work_bolts", "work_liners", "work_heat", "plastic_lost", "creep_lost")
            or energies[name]
        }
        log.account("energy budget", "energy", joule, entries, project.units)
        log.info(f"energy: closing error {energies['relative']:.2g} of the largest flow")
        for support in supports.ALL:
            there = support.there(blocks)
            if there is not None:
                found = there.energies()
                entries = {SUPPORT_WORDS[name]: found[name] for name in SUPPORT_WORDS if name in found}
                log.account(f"energy of {support.name}", "energy", joule, entries, project.units)
    flow = Flow.there(blocks)
    if flow is not None:
        found = flow.account()
        log.account("fluid", "volume", volume, {FLUID_WORDS[k]: found[k] for k in FLUID_WORDS}, project.units)
    proppant = Proppant.there(blocks)
    if proppant is not None:
        found = proppant.account()
        log.account("proppant", "volume", volume, {PROPPANT_WORDS[k]: found[k] for k in PROPPANT_WORDS}, project.units)
    heat = Heat.there(blocks)
    if heat is not None:
        found = heat.account()
        log.account("heat", "heat", joule, {HEAT_WORDS[k]: found[k] for k in HEAT_WORDS}, project.units)
    _report_fields(project)
    _report_both(project)
    if figure:
        path = last_figure(project)
        log.info(f"figure: {path}")
    if not stepped:
        return
    if both is None:
        log.stages(blocks.timers, project.comm, "element")
    else:
        log.stages_of_both(both.particles.timers, blocks.timers, project.comm)


def _report_fields(project: Project) -> None:
    """The accounts of fields that diffuse in elements. Collective."""
    blocks, log = project.blocks, project.log
    for kind in kinds().values():
        if log is not None and kind.name in blocks.surface_loads:
            found = kind.load_type().there(blocks).account()
            unit = kind.amount if blocks.dim == 2 else kind.amount.removesuffix("/m")
            entries = {word: found[name] for name, word in HEAT_WORDS.items() if name in found}
            log.account(kind.name, kind.name, unit, entries, project.units)


def _report_both(project: Project) -> None:
    """Report the exchange through contacts of discs and faces, and the sum of both energy budgets. Collective."""
    both, log = project.coupled, project.log
    if both is None or project.continues is not None or not both.accounted:
        return
    try:
        found = both.energies()
    except CommandError as error:  # the last commands of the script left them so that no step could follow
        log.warn(f"no table of the energy between discs and faces: {error}")
        return
    found["stored"] -= found["stored_before"]
    log.account(
        output.ACROSS, "energy", "J/m", {text: found[name] for name, text in ACROSS_WORDS.items()}, project.units
    )
    if "closing" in found:
        closing = with_prefix(found["closing"], "J/m", system=project.units)
        log.info(f"energy of both: closing error {closing}, {found['relative']:.2g} of the largest flow")


def last_figure(project: Project) -> Path:
    """Draw cracks and stress, in space displacement, of the present state: `all_<step>.jpg` in the output folder.
    Collective.
    """
    path = project.folder() / f"all_{project.step:010d}.jpg"
    with project.blocks.timers.around("figure"):
        whole = frames.whole(project)
        if project.blocks.dim == 3:
            project.blocks.prepare_kernels("pictures")

        def draw() -> None:
            from hpcdem.post import blocks
            from hpcdem.post.view import moment, paper, scene

            assert whole is not None
            if project.blocks.dim == 3:
                found = moment.of_blocks(whole)
                paper.draw(found, path, scene.default_view(found))
            else:
                blocks.plot(whole, path)

        on_first(project.comm, draw)
    return path


def listed(project: Project, kind: str, where: Range | None = None) -> None:
    """Log the number of selected elements, faces or joints, their models and their groups. Collective."""
    numbers, blocks = everything(project, kind, where), project.ready(use=False)
    row, rows = {
        ELEMENT: (blocks.element_row, blocks.element_rows), FACE: (blocks.face_row, blocks.face_rows),
        JOINT: (blocks.joint_row, blocks.joint_rows),
    }[kind]  # fmt: skip
    models = Counter(rows.rows[r][0].replace("_", "-") or "without model" for r in row[numbers].tolist())
    parts = [f"{count} {name}" for name, count in sorted(models.items())]
    if kind == JOINT:
        parts.append(f"{int((blocks.broken[numbers] > 0).sum())} broken")
    for set_name, of in sorted(project.groups[kind].sets.items()):
        for name, members in sorted(of.items()):
            if count := int(np.isin(members, numbers).sum()):
                parts.append(f"{count} in group '{name}'" + ("" if set_name == "default" else f" of set '{set_name}'"))
    if project.log is not None:
        project.log.info(f"{len(numbers)} {kind}s: {', '.join(parts)}")
