"""What is written and told at the end of a run of blocks: histories, energy, the table of stages, the last figure."""

from __future__ import annotations

from pathlib import Path

from hpcdem.commands.blocks import frames, histories
from hpcdem.commands.blocks.project import Project
from hpcdem.io.agreed import on_first

ENERGY_WORDS = {
    "kinetic": "stored: motion",
    "strain": "stored: strain of elements",
    "joints": "stored: joints",
    "joints_lost": "lost by fracture and friction in joints",
    "contact": "lost or stored by contacts",
    "viscous_lost": "lost by viscous damping",
    "work_gravity": "work of gravity",
    "work_outside": "work of loads and conditions",
    "commands": "brought by commands",
    "closing": "closing error",
}
"""What the table at the end calls the entries of the energy budget."""


def close(project: Project, figure: bool = True) -> None:
    """Bring what waits to the disk, tell how it was, draw the last state. Collective."""
    histories.flush(project)
    blocks, log = project.blocks, project.log
    if log is None or not blocks.timers.steps:
        return
    if blocks.budget is not None:
        energies = blocks.energies()
        rows = [(text, f"{energies[name]:.6g}") for name, text in ENERGY_WORDS.items()]
        log.table("energy budget", ("energy", "J/m"), rows)
        log.info(f"energy: closing error {energies['relative']:.2g} of the largest flow")
    if figure:
        path = last_figure(project)
        log.info(f"figure: {path}")
    log.stages(blocks.timers, project.comm, "element")


def last_figure(project: Project) -> Path:
    """Cracks and stress at this moment, `all_<step>.jpg` in the folder of the results. Collective."""
    path = project.folder() / f"all_{project.step:010d}.jpg"
    with project.blocks.timers.around("figure"):
        whole = frames.whole(project)

        def draw() -> None:
            from hpcdem.post import blocks

            if whole is not None:
                blocks.plot(whole, path)

        on_first(project.comm, draw)
    return path
