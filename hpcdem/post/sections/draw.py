"""All pages and tables of a folder of sections, shared over the ranks frame by frame.

Every file is made from one section (or one series) by one rank, so that it does not depend on how many there are.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from hpcdem.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path, make_folder
from hpcdem.io.disk import explain
from hpcdem.post.cpt import INVAR, INVAR2, VOLUME, ColourTable, read_cpt, stress_table
from hpcdem.post.section import Section, read_section
from hpcdem.post.sections import panels, survey
from hpcdem.post.sections.files import write_grids, write_tables
from hpcdem.post.sections.pages import Style, panels_of_a_page, section_page, series_page

_NAME = re.compile(r"all_(\d+)(_ini)?\.npz")
BITMAPS = ("jpg", "png")
DPI = 300


@dataclass(frozen=True)
class Request:
    """What is asked for. folder: of the frames, with ss/data in it; kinds: panels from top to bottom; colormap: a file,
    or invar or invar2, for both strains, None: invar2 for the distortional one and invar in per cent for the volumetric
    one; sigma1: square [m] and scale of its bars; width [cm]; xmax, ymax [m]; maxstress [MPa]."""

    folder: Path
    kinds: tuple[panels.Kind, ...] = panels.KINDS
    formats: tuple[str, ...] = ("jpg", "ps")
    addball: bool = False
    delball: bool = False
    colorbar: bool = True
    labels: str = "off"
    colormap: Path | None = None
    sigma1: tuple[float, float] | None = None
    width: float = 14.0
    xmax: float | None = None
    ymax: float | None = None
    maxstress: float = 300.0


def draw_folder(request: Request, comm: Any, log: Any) -> None:
    """Collective: draw and write everything. log: `info(text)`, `warn(text)`. Raises HpcdemError on all ranks."""
    ss = request.folder / "ss"
    files = _collective(comm, lambda: section_files(ss / "data"))
    tables = _collective(comm, lambda: colour_tables(request))
    for table in {id(t): t for t in tables.values()}.values():
        for note in table.notes:
            log.warn(f"{table.name}: {note}")
    outlines = _survey(files, comm)
    _name_changes(outlines, request, log)
    seen = survey.common_view(outlines, request.xmax, request.ymax)
    captions = survey.progress(outlines, seen.unit)
    style = Style(tables, request.width, request.colorbar, request.labels, request.sigma1)
    for sub in ("data2ps", "Tmp", "ps"):
        make_folder(ss / sub, comm)

    def one_section(path: Path) -> None:
        section = read_section(path)
        write_tables(section, ss / "data2ps")
        write_grids(section, ss / "Tmp")
        figure = section_page(section, seen, request.kinds, style, captions[section.name])
        ending = "sigma1" if request.sigma1 else "strain_stress"
        save(figure, ss, f"{section.name}_{ending}", request.formats)

    def one_series(kind: panels.Kind, part: Sequence[Path], name: str) -> None:
        def sections() -> Iterator[tuple[Section, str]]:
            for path in part:
                section = read_section(path)
                yield section, captions[section.name]

        save(series_page(sections(), len(part), seen, kind, style), ss, name, request.formats)

    tasks: list[tuple[Callable[..., None], tuple[Any, ...]]] = [(one_section, (path,)) for path in files]
    if len(files) > 1:
        pages = math.ceil(len(files) / panels_of_a_page(seen, style))
        room = math.ceil(len(files) / pages)
        parts = [files[k : k + room] for k in range(0, len(files), room)]
        for kind in request.kinds:
            for k, part in enumerate(parts, 1):
                bars = "_sigma1" if request.sigma1 and kind is panels.DISTORTIONAL else ""
                number = f"_{k}" if len(parts) > 1 else ""
                tasks.append((one_series, (kind, part, f"series_{kind.key}{bars}{number}")))
    _shared(tasks, comm)
    log.info(
        f"{len(files)} sections of {request.folder}, {len(tasks)} pages: pictures in {ss} and {ss / 'ps'}, "
        f"numbers in {ss / 'data2ps'}, grids in {ss / 'Tmp'}"
    )


def section_files(folder: Path) -> list[Path]:
    """The sections in a folder in the order of time, as `frames.list_frames`. Raises HpcdemError if there are none."""
    try:
        names = os.listdir(folder)
    except FileNotFoundError:
        names = []
    except OSError as failure:
        raise HpcdemError(explain(folder, failure, "read the folder")) from None
    found = [(int(match[1]), match[2] is not None, match[0]) for match in map(_NAME.fullmatch, names) if match]
    if not found:
        frames = folder.parent.parent
        raise HpcdemError(f"no stress and strain in {folder}: run `hpcdem -s {frames}` first")
    return [folder / name for _, _, name in sorted(found)]


def colour_tables(request: Request) -> dict[str, ColourTable]:
    """Colours by key of the kind."""
    built_in = {table.name: table for table in (INVAR, INVAR2)}
    own = None
    if request.colormap is not None:
        own = built_in.get(str(request.colormap).lower()) or read_cpt(request.colormap)
    stress = stress_table(request.maxstress)
    return {
        panels.VOLUMETRIC.key: own or VOLUME,
        panels.DISTORTIONAL.key: own or INVAR2,
        panels.MEAN.key: stress,
        panels.SHEAR.key: stress,
    }


def save(figure: Any, ss: Path, name: str, formats: Sequence[str]) -> None:
    """Write a figure: bitmaps into ss, vectors into ss/ps. Serial, the same figure gives the same bytes."""
    import matplotlib

    for kind in formats:
        path = (ss if kind in BITMAPS else ss / "ps") / f"{name}.{kind}"
        options: dict[str, Any] = {}
        if kind == "jpg":
            options["pil_kwargs"] = {"quality": 92, "subsampling": 0}  # thin coloured bands need their full colour
        elif kind == "png":
            options["metadata"] = {"Software": None}
        elif kind in ("pdf", "svg"):
            options["metadata"] = {"CreationDate": None} if kind == "pdf" else {"Date": None}
        fixed: Any = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "hpcdem"}
        with matplotlib.rc_context(fixed), atomic_path(path) as temporary:
            figure.savefig(temporary, format="eps" if kind == "ps" else kind, dpi=DPI, **options)
            if kind == "ps":
                _without_date(temporary)


def _without_date(path: str) -> None:
    """Take the date, and the name of the file, out of a PostScript file."""
    with open(path, "rb") as file:
        lines = file.read().split(b"\n")
    lines = [line for line in lines if not line.startswith((b"%%CreationDate", b"%%Title"))]
    with open(path, "wb") as file:
        file.write(b"\n".join(lines))


# -- ranks --------------------------------------------------------------------------------------------------------


def _collective(comm: Any, read: Callable[[], Any]) -> Any:
    """What rank 0 reads, on all ranks; its HpcdemError on all ranks, of its own class."""
    result = None
    if comm.rank == 0:
        try:
            result = read()
        except HpcdemError as failure:
            result = failure
    result = comm.bcast(result)
    if isinstance(result, HpcdemError):
        raise result
    return result


def _survey(files: Sequence[Path], comm: Any) -> list[survey.Outline]:
    mine: dict[int, survey.Outline] = {}

    def look(k: int) -> None:
        mine[k] = survey.outline(read_section(files[k]), read_section(files[k - 1]) if k else None)

    _shared([(look, (k,)) for k in range(len(files))], comm)
    found: dict[int, survey.Outline] = {}
    for part in comm.allgather(mine):
        found |= part
    return [found[k] for k in range(len(files))]


def _shared(tasks: Sequence[tuple[Callable[..., None], tuple[Any, ...]]], comm: Any) -> None:
    """Collective: every task on one of the ranks."""
    error = None
    try:
        for task, arguments in tasks[comm.rank :: comm.size]:
            task(*arguments)
    except HpcdemError as failure:
        error = str(failure)
    except OSError as failure:
        error = explain(failure.filename or "a picture", failure)
    comm.agree(error)


def _name_changes(outlines: Sequence[survey.Outline], request: Request, log: Any) -> None:
    """Say where particles came or went although the options do not tell of it."""
    for before, o in pairwise(outlines):
        if o.came and not request.addball:
            log.warn(f"{o.came} particles were added between {before.name} and {o.name}: say --addball ON if meant")
        if o.went and not request.delball:
            log.warn(f"{o.went} particles were removed between {before.name} and {o.name}: say --delball ON if meant")


def refuse(request: Request) -> None:
    """UsageError for what cannot be drawn."""
    if request.sigma1 and panels.DISTORTIONAL not in request.kinds:
        raise UsageError("zdemss: --sigma1 ON draws over the distortional strain: it cannot go with --strainshear OFF")
