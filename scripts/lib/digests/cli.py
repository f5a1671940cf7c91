"""The command line of scripts/digests."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import click
from bench.launch import Failed, Layout

from digests.content import Digests, differences, of_folder
from digests.models import models

SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
LISTED = 20


@click.group(context_settings=SETTINGS)
def main() -> None:
    """Fingerprints of all that a set of models writes, to show that a change of structure changes no bit.

    Record them before the change and after it, and compare. The models: short scripts of ZDEM's manual (where they are:
    HPCDEM_MANUAL_SCRIPTS), bonds and clumps, ready-made models of rock, particles and blocks in one run.
    """


@main.command(context_settings=SETTINGS)
@click.argument("output", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("names", nargs=-1, metavar="[MODEL]...")
@click.option("--layout", "layouts", multiple=True, default=["1x1", "2x1"], metavar="RxT", show_default=True,
              help="Ranks x threads; may be given again.")  # fmt: skip
@click.option("--keep", type=click.Path(path_type=Path, file_okay=False), help="Leave the results there.")
def record(output: Path, names: tuple[str, ...], layouts: tuple[str, ...], keep: Path | None) -> None:
    """Run the models (all, or those that are named) and write the fingerprints of their results to OUTPUT. Exit code 1
    if the layouts of a model do not agree."""
    known = {model.name: model for model in models()}
    if unknown := [name for name in names if name not in known]:
        raise click.UsageError(f"there is no model {unknown[0]}; available: {', '.join(known)}")
    found: dict[str, dict[str, Digests]] = {}
    agree = True
    for name in names or known:
        for text in layouts:
            with tempfile.TemporaryDirectory(prefix="hpcdem-digests-") as scratch:
                folder = (keep or Path(scratch)) / f"{name}-{text}"
                try:
                    known[name].run(folder, Layout.read(text))
                except Failed as error:
                    raise click.ClickException(f"{name} on {text}: {error}") from None
                found.setdefault(name, {})[text] = of_folder(folder)
            same = found[name][text] == found[name][layouts[0]]
            agree &= same
            verdict = "" if same else f", not those of {layouts[0]}"
            click.echo(f"{name} {text}: {len(found[name][text])} files{verdict}", err=True)
        output.write_text(json.dumps(found, indent=1))
    sys.exit(0 if agree else 1)


@main.command(context_settings=SETTINGS)
@click.argument("before", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.argument("after", type=click.Path(path_type=Path, exists=True, dir_okay=False))
def compare(before: Path, after: Path) -> None:
    """Say what differs between two recordings. Exit code 1 if a fingerprint does, or if a model or file is missing;
    datasets on one side only are listed and are no fault."""
    one, other = (json.loads(path.read_text()) for path in (before, after))
    failed = False
    for name in sorted(one.keys() | other.keys()):
        for layout in sorted(one.get(name, {}).keys() | other.get(name, {}).keys()):
            a, b = one.get(name, {}).get(layout), other.get(name, {}).get(layout)
            if a is None or b is None:
                click.echo(f"{name} {layout}: only {'after' if a is None else 'before'}")
                failed = True
                continue
            changed, apart = differences(a, b)
            missing = sorted(a.keys() ^ b.keys())
            failed |= bool(changed or missing)
            verdict = f"{len(changed)} differ, {len(missing)} files unmatched" if changed or missing else "same"
            click.echo(f"{name} {layout}: {verdict} ({len(a)} files)")
            for line in [*changed[:LISTED], *apart[:LISTED]]:
                click.echo(f"  {line}")
    sys.exit(1 if failed else 0)
