"""The command line of scripts/bench."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from bench import block_memory, blocks, coupled, fracture, launch, other, runs, strain_stress, tables, view
from bench.launch import Layout
from bench.peers import PEERS
from bench.workloads import PEER_WORKLOADS, cache_folder, workloads

HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
UNIT = 12500
JSON = click.option("--json", "json_file", metavar="FILE", help="Add a JSON line per run to FILE (-: standard output).")
REPEATS = click.option("--repeats", type=click.IntRange(1), default=5, metavar="N", help="Runs of each kind [5].")
SIZE = click.option(
    "--unit", type=click.IntRange(50), default=UNIT, metavar="N", help=f"Particles of the unit bed [{UNIT}]."
)


def layouts_option(*default: str) -> Any:
    """--layout."""
    return click.option(
        "--layout", "layouts", multiple=True, default=default, callback=read_layouts, metavar="RxT",
        help=f"Ranks x threads of hpcdem; several times [{' '.join(default)}].",
    )  # fmt: skip


def read_layouts(context: click.Context, option: click.Parameter, value: tuple[str, ...]) -> list[Layout]:
    """Layouts from "2x1"."""
    try:
        found = [Layout.read(text) for text in value]
    except ValueError:
        raise click.BadParameter("expected ranks x threads, such as 2x1") from None
    if any(layout.ranks < 1 or layout.threads < 1 for layout in found):
        raise click.BadParameter("ranks and threads begin at 1")
    return found


def maker(layouts: list[Layout]) -> Layout:
    """What beds are made with: as many ranks as cores are asked for."""
    return Layout(max(layout.cores for layout in layouts), 1)


WORKLOADS_TEXT = "\n".join(f"  {w.name:<12} {w.bed.particles:>8}  {w.about}" for w in workloads(UNIT).values())
ABOUT = f"""Measure hpcdem: granular beds of 12 500 to a million particles on one and two ranks and threads.

\b
Workloads:
{WORKLOADS_TEXT}

Without a command: hpcdem on all of these, or with --peers on the first five beside other codes, in turn.
"""


@click.group(
    context_settings=HELP,
    help=ABOUT,
    invoke_without_command=True,
    epilog="Speeds are particle-steps per second by the clock, of the loop over steps alone: starting, loading, "
    "compiling and some hundred steps to warm up are not in them. Beds are made by hpcdem once and kept in "
    "~/.cache/hpcdem-bench (XDG_CACHE_HOME). How it is measured, and what came out: docs/benchmarks.md.",
)
@click.option("--peers", is_flag=True, help="Beside LAMMPS, LIGGGHTS, Yade, ESyS-Particle, in turn; table of ratios.")
@click.option("--peer", "names", multiple=True, type=click.Choice(list(PEERS)), help="Only this peer; several times.")
@click.option(
    "--workload", "names_of_work", multiple=True, type=click.Choice(list(workloads())), metavar="NAME",
    help="Only this workload; several times.",
)  # fmt: skip
@layouts_option("1x1", "2x1", "1x2")
@REPEATS
@click.option("--seconds", type=float, default=2.0, metavar="S", help="Stepping time of a run, about [2].")
@SIZE
@JSON
@click.pass_context
def bench(context: click.Context, **options: Any) -> None:
    """Our workloads, alone or beside the peers."""
    if context.invoked_subcommand is not None:
        return
    layouts, lines = options["layouts"], tables.Lines(options["json_file"])
    names = list(options["names"]) or (list(PEERS) if options["peers"] else [])
    known = workloads(options["unit"])
    default = PEER_WORKLOADS if names else tuple(known)
    chosen = [known[name] for name in options["names_of_work"] or default]
    faults: dict[str, str] = {}
    try:
        if names:
            odd = [w.name for w in chosen if w.name not in PEER_WORKLOADS]
            if odd:
                raise click.UsageError(f"peers run {', '.join(PEER_WORKLOADS)}, not {', '.join(odd)}")
            faults = runs.beside(chosen, layouts, names, options["repeats"], options["seconds"], lines, maker(layouts))
        else:
            runs.alone(chosen, layouts, options["repeats"], options["seconds"], lines, maker(layouts))
    finally:
        lines.close()
        if lines.rows:
            tables.show_runs(lines.rows)
        if names:
            tables.show_ratios(lines.rows)
        show_settings(lines.rows)
        if warning := tables.disturbed(lines.rows):
            runs.say(f"warning: {warning}")
    for name, why in faults.items():
        runs.say(f"{name}: {why}")


def show_settings(rows: list[tables.Row]) -> None:
    """What each peer was run with."""
    said = {(r["workload"], r["cores"], r["version"]): r["settings"] for r in rows if r["code"] != "hpcdem"}
    for (workload, cores, version), settings in said.items():
        runs.say(f"{workload}, {cores} core(s), {version}: {settings}")


@bench.command("blocks", context_settings=HELP)
@click.option(
    "--workload", "names", multiple=True, type=click.Choice(list(blocks.WORKLOADS)), metavar="NAME",
    help=f"Only this one; several times [{', '.join(blocks.WORKLOADS)}].",
)  # fmt: skip
@layouts_option("1x1", "2x1", "1x2")
@REPEATS
@click.option("--seconds", type=float, default=2.0, metavar="S", help="Stepping time of a run, about [2].")
@JSON
def blocks_(names: tuple[str, ...], layouts: list[Layout], repeats: int, seconds: float, json_file: str | None) -> None:
    """Blocks: element-steps per second, intact and shattered; touching contact pairs per second."""
    lines = tables.Lines(json_file)
    try:
        blocks.blocks(list(names or blocks.WORKLOADS), layouts, repeats, seconds, lines)
    finally:
        lines.close()
        if warning := tables.disturbed(lines.rows):
            runs.say(f"warning: {warning}")


@bench.command("block-memory", context_settings=HELP)
@click.option(
    "--kind", "kinds", multiple=True, type=click.Choice(list(block_memory.KINDS)), metavar="NAME",
    help=f"Only this one; several times [{', '.join(block_memory.KINDS)}].",
)  # fmt: skip
@click.option("--elements", type=click.IntRange(100), default=100_000, metavar="N", help="About so many [100000].")
@click.option("--steps", type=click.IntRange(1), default=4, metavar="N", help="Steps [4].")
@click.option(
    "--arrays", type=click.IntRange(0), default=0, metavar="N", help="List the N largest arrays of a rank [0]."
)
@layouts_option("1x1", "2x1", "4x1")
@JSON
def block_memory_(
    kinds: tuple[str, ...], elements: int, steps: int, arrays: int, layouts: list[Layout], json_file: str | None
) -> None:
    """Memory of a model of blocks: of the busiest rank, and the one copy per node of what all ranks share."""
    lines = tables.Lines(json_file)
    try:
        block_memory.measure(list(kinds or block_memory.KINDS), elements, layouts, steps, arrays, lines)
    finally:
        lines.close()


@bench.command("coupled", context_settings=HELP)
@layouts_option("1x1", "2x1")
@REPEATS
@click.option("--seconds", type=float, default=4.0, metavar="S", help="Stepping time of a run, about [4].")
@JSON
def coupled_(layouts: list[Layout], repeats: int, seconds: float, json_file: str | None) -> None:
    """Particles and blocks in one run: steps per second, and the shares of both and of what is between them."""
    lines = tables.Lines(json_file)
    try:
        coupled.coupled(layouts, repeats, seconds, lines)
    finally:
        lines.close()
        if warning := tables.disturbed(lines.rows):
            runs.say(f"warning: {warning}")


@bench.command("fracture", context_settings=HELP)
@layouts_option("1x1")
@click.option("--seconds", type=float, default=5.0, metavar="S", help="Injected time [5].")
@JSON
def fracture_(layouts: list[Layout], seconds: float, json_file: str | None) -> None:
    """A hydraulic fracture of 20 000 triangles by implicit steps: time by stages."""
    lines = tables.Lines(json_file)
    try:
        fracture.fracture(layouts, seconds, lines)
    finally:
        lines.close()


@bench.command(context_settings=HELP)
@layouts_option("1x1", "2x1")
@click.option("--repeats", type=click.IntRange(1), default=3, metavar="N", help="Runs of each kind [3].")
@click.option("--every", type=click.IntRange(1), default=1000, metavar="N", help="Steps between frames [1000].")
@click.option("--way", type=float, metavar="M", help="Length of the push in metres [that of the script].")
@JSON
def push(layouts: list[Layout], repeats: int, every: int, way: float | None, json_file: str | None) -> None:
    """Wall time of examples/push.py, whole, without frames and with one every N steps."""
    other.push(layouts, repeats, every, way, tables.Lines(json_file))


@bench.command(context_settings=HELP)
@layouts_option("1x1", "2x1")
@REPEATS
@JSON
def start(layouts: list[Layout], repeats: int, json_file: str | None) -> None:
    """Time from the command `hpcdem` to its first step, with the kernels compiled before."""
    other.start(layouts, repeats, tables.Lines(json_file))


@bench.command(context_settings=HELP)
@click.option("--particles", type=float, default=1e6, metavar="N", help="How many [1e6].")
@layouts_option("1x1", "2x1")
@click.option("--steps", type=click.IntRange(1), default=2, metavar="N", help="Steps after the first [2].")
@click.option("--checkpoint", is_flag=True, help="Also save the bed, and measure a run that restores it.")
@SIZE
@JSON
def memory(
    particles: float, layouts: list[Layout], steps: int, checkpoint: bool, unit: int, json_file: str | None
) -> None:
    """Bytes per particle: the peaks of all ranks, each less that of an empty run, over N; and those of the arrays.

    The bed is laid out of copies of the settled unit bed and does not settle again, so ten million take minutes.
    """
    other.memory(int(particles), unit, layouts, steps, checkpoint, tables.Lines(json_file), maker(layouts))


@bench.command("view", context_settings=HELP)
@click.option("--objects", type=float, multiple=True, default=(1e5, 1e6), metavar="N", help="Several times.")
@click.option(
    "--kind", "kinds", type=click.Choice(view.KINDS), multiple=True, default=view.KINDS, help="Several times."
)
@click.option("--frames", type=click.IntRange(2), default=200, metavar="N", help="Frames in the folder [200].")
@JSON
def view_(objects: tuple[float, ...], kinds: tuple[str, ...], frames: int, json_file: str | None) -> None:
    """First picture, pictures per second, clicks, new frames and memory of `hpcdem view` at 1280 x 720."""
    lines = tables.Lines(json_file)
    for kind in kinds:
        for size in objects:
            view.measure(kind, int(size), frames, lines)
    for row in lines.rows:
        runs.say(", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()))
    lines.close()


@bench.command("strain-stress", context_settings=HELP)
@click.option("--particles", type=float, multiple=True, default=(1e4, 1e5), metavar="N", help="Several times.")
@click.option("--ranks", type=click.IntRange(1), multiple=True, default=(1, 2), metavar="R", help="Several times.")
@click.option("--frames", type=click.IntRange(2), default=8, metavar="N", help="Frames of the run [8].")
@click.option("--format", "suffix", type=click.Choice(("vtkhdf", "dat")), default="vtkhdf", help="[vtkhdf]")
@JSON
def strain_stress_(
    particles: tuple[float, ...], ranks: tuple[int, ...], frames: int, suffix: str, json_file: str | None
) -> None:
    """Frames per second of `hpcdem -s` on made-up frames of so many particles."""
    strain_stress.strain_stress([int(n) for n in particles], list(ranks), frames, suffix, tables.Lines(json_file))


@bench.command(context_settings=HELP)
@click.option("--measure", "measures", is_flag=True, help="Run what the model is made from and checked on (minutes).")
@click.option("--report", "reports", is_flag=True, help="Fit, check, write tables and figures into docs/scaling.md.")
@click.option("--ranks", type=click.IntRange(2), default=4, metavar="R", help="Most ranks [4].")
@click.option("--repeats", type=click.IntRange(1), default=3, metavar="N", help="Launches of each kind [3].")
@click.option("--small", is_flag=True, help="Without the beds of more than 100 000: a trial in half a minute.")
@SIZE
@click.option("--json", "json_file", metavar="FILE", help="Lines of the measurement [scaling.json beside the beds].")
@click.option("--page", metavar="FILE", help="Page to write into; figures go to figures/ beside it [docs/scaling.md].")
def scaling(
    measures: bool, reports: bool, ranks: int, repeats: int, small: bool, unit: int, json_file: str | None,
    page: str | None,
) -> None:  # fmt: skip
    """Scaling on paper: measure the parts of a step, fit a model, check it, foretell 16 to 4096 ranks."""
    from bench.scaling import measure, report

    if not measures and not reports:
        raise click.UsageError("give --measure, --report or both")
    file = Path(json_file) if json_file else cache_folder() / "scaling.json"
    if measures:
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        part.unlink(missing_ok=True)
        lines = tables.Lines(str(part))
        try:
            measure.measure(unit, ranks, repeats, small, lines)
        finally:
            lines.close()
        part.replace(file)
    if reports:
        where = Path(page) if page else report.PAGE
        for check in report.report(file, where, where.parent / "figures"):
            runs.say(
                f"{check.name:>12} {check.ranks} rank(s) {check.what:>14}: measured {check.measured:.4g}, predicted "
                f"{check.predicted:.4g}, {100 * check.error:+.0f} %"
            )
        runs.say(f"written: {where}")


def main() -> None:
    """Start; a failure is its message."""
    try:
        bench(prog_name="scripts/bench")
    except launch.Failed as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(1)
