"""The joints that broke, as rows of `cracks.csv` while the model runs."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.commands.fdem.project import Project
from hpcdem.core.fields import unit_in
from hpcdem.io.columns import append_rows
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.state import Crack

NAME = "cracks.csv"


def columns(dim: int) -> dict[str, str]:
    """Return names of `diagnostics.events` and of the columns, in their order, by dimensions of space."""
    joule = unit_in("J/m", dim)
    size = {2: {"length": "length [m]"}, 3: {"joint_area": "joint_area [m2]"}}[dim]
    return {
        "step": "step", "time": "time [s]", "joint": "joint", **{axis: f"{axis} [m]" for axis in "xyz"[:dim]},
        "mode": "mode", **size, "kinetic": f"kinetic_energy [{joule}]", "peak_step": "peak_step",
        "peak_kinetic": f"peak_kinetic_energy [{joule}]",
    }  # fmt: skip


def record(project: Project) -> None:
    """Record the broken joints detected so far; steps search for them at intervals. Collective."""
    _write(project, project.blocks.event_rows)


def flush(project: Project) -> None:
    """Write all joints broken so far. Remove the file of an earlier model if this one has no joints. Collective."""
    if project.taken:
        _write(project, diagnostics.crack_rows(project.blocks))
        if project.cracks_filed is None and project.folder_made and project.comm.rank == 0:
            (project.outdir / NAME).unlink(missing_ok=True)


def _write(project: Project, cracks: Sequence[Crack]) -> None:
    """A model that begins, or resumes from a checkpoint, begins a new file with all that has broken. What a checkpoint
    has filed may not be known as an event yet."""
    done = project.cracks_filed
    if (done is not None and done >= len(cracks)) or (not cracks and not project.blocks.joint_row.any()):
        return
    with project.blocks.timers.around("output"):
        path = project.folder() / NAME
        new = diagnostics.described(project.blocks, cracks[done or 0 :])
        named = columns(project.dim)
        table = zip(*(new[name].tolist() for name in named), strict=True)
        rows = [",".join(map(repr, row)) for row in table]
        append_rows(path, ",".join(named.values()), rows, 0 if done is None else None, project.comm)
    project.cracks_filed = len(cracks)
