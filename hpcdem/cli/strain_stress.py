"""`hpcdem -s DIR`: stress and strain of the frames of a finished run."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import FINITE, HELP, PATH, Words
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.runtime.progress import Log


@click.command(context_settings=HELP, epilog="Draw the results with `zdemss --dir DIR`. Also under mpiexec or srun.")
@click.option(
    "-s", "--strain-stress", "--strin-stres", "folder", type=PATH, metavar="DIR", required=True,
    help="Stress and strain of the frames in DIR, into DIR/ss/data.",
)  # fmt: skip
@click.option(
    "-g", "--grid", "size", type=FINITE, default=200.0, metavar="SIZE",
    help="Length in m over which stress is averaged, and spacing of the grid of --smooth [200].",
)  # fmt: skip
@click.option("--addball", is_flag=True, help="Particles were added between frames (sedimentation).")
@click.option("--delball", is_flag=True, help="Particles were deleted between frames (erosion).")
@click.option("--leftwallid", type=int, metavar="ID", help="Ignore particles to the left of this wall.")
@click.option("--rightwallid", type=int, metavar="ID", help="Ignore particles to the right of this wall.")
@click.option("--groups", type=Words(), default="", metavar="A,B", help="Only particles of these groups.")
@click.option("--xmove", type=FINITE, default=0.0, metavar="X", help="Add X [m] to all x [0].")
@click.option("--ymove", type=FINITE, default=0.0, metavar="Y", help="Add Y [m] to all y [0].")
@click.option("--increment", is_flag=True, help="Strain since the previous frame, not since the first one.")
@click.option(
    "--smooth", is_flag=True, help="Strain fitted and averaged on the grid, not by the nearest neighbours of particles."
)
@click.option(
    "--volume", type=click.Choice(("mean", "nearest", "page")), help="Volumetric strain of the nodes: mean change of "
         "volume around each, over SIZE; that of the nearest particle; or the quantity in the figures of the ZDEM "
         "manual, which is not a change of volume [mean].",
)  # fmt: skip
@click.option("-j", "threads", type=click.IntRange(1), metavar="N", help="Threads per rank [value of srun -c, else 1].")
def strain_stress(**options: Any) -> None:
    """Stress and strain of the frames of a finished run, on a grid and on the particles.

    Strain is that since the first frame of DIR. Results of an earlier call are replaced when the new ones are complete.
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: what the command does once the ranks are together; options by the names of its parameters."""
    load_kernels(comm)
    from hpcdem.post.strain_stress import Options, run

    run(
        comm,
        log,
        Options(
            folder=Path(options["folder"]), size=options["size"], left_wall=options["leftwallid"],
            right_wall=options["rightwallid"], xmove=options["xmove"], ymove=options["ymove"],
            addball=options["addball"], delball=options["delball"], increment=options["increment"],
            smooth=options["smooth"], volume=options["volume"],
            groups=tuple(options["groups"]),
        ),
    )  # fmt: skip


def load_kernels(comm: Comm) -> None:
    """Collective: compile or load what writes text, which runs share. Before any import of hpcdem.io."""
    from hpcdem.runtime.progress import Log
    from hpcdem.session import prepare

    # For as many threads as a run here would have: it uses the same folder. Of which nobody need hear.
    prepare(comm, Log(1), ["shared"], int(os.environ.get("NUMBA_NUM_THREADS", "1")))
