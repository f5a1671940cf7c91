"""All pages and tables of a folder of sections, shared over the ranks frame by frame.

Every file is made from one section (or one series) by one rank, so that it does not depend on how many there are.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path, make_folder
from hpcdem.io.axes import View
from hpcdem.io.disk import explain
from hpcdem.io.frames import FORMATS, earlier_stems, left_out
from hpcdem.post.cpt import INVAR, INVAR2, VOLUME, ColourTable, read_cpt, stress_table
from hpcdem.post.saved import save as save_figure
from hpcdem.post.section import PAGE, read_section
from hpcdem.post.sections import panels, survey
from hpcdem.post.sections.files import write_grids, write_tables
from hpcdem.post.sections.pages import Style, panels_of_a_page, section_page, series_page
from hpcdem.post.series import draw_all

_NAME = re.compile(r"all_(\d+)(_ini)?\.npz")
BITMAPS = ("jpg", "png", "tiff")
DPI = 300


@dataclass(frozen=True)
class Request:
    """The request. folder: of the frames, with ss/data in it; kinds: panels from top to bottom; colormap: a file,
    or invar or invar2, for both strains, None: invar2 for the distortional one and invar in per cent for the volumetric
    one; sigma1: square [m] and scale of its bars; width [cm]; x, y: where the axes begin and end [m], None where the
    model does; maxstress [MPa]."""

    folder: Path
    kinds: tuple[panels.Kind, ...] = panels.KINDS
    formats: tuple[str, ...] = ("jpg", "ps")
    addball: bool = False
    delball: bool = False
    colorbar: bool = True
    labels: str = "on"
    colormap: Path | None = None
    sigma1: tuple[float, float] | None = None
    width: float = 14.0
    x: survey.Limits = (None, None)
    y: survey.Limits = (None, None)
    maxstress: float = 300.0


def draw_folder(request: Request, comm: Comm, log: Any, workers: int = 1) -> None:
    """Collective: draw and write everything, on one rank by `workers` processes. log: `info(text)`, `warn(text)`.
    Raises HpcdemError on all ranks."""
    ss = request.folder / "ss"
    files = _collective(comm, lambda: _of_this_run(request.folder, log))
    if _collective(comm, lambda: read_section(files[-1]).volume) == PAGE:
        kinds = (panels.PAGE_VOLUME if kind == panels.VOLUMETRIC else kind for kind in request.kinds)
        request = replace(request, kinds=tuple(kinds))
    tables = _collective(comm, lambda: colour_tables(request))
    for table in {id(t): t for t in tables.values()}.values():
        for note in table.notes:
            log.warn(f"{table.name}: {note}")
    outlines = _survey(files, comm)
    _name_changes(outlines, request, log)
    seen = survey.common_view(outlines, request.x, request.y)
    captions = survey.progress(outlines, seen.unit)
    style = Style(tables, request.width, request.colorbar, request.labels, request.sigma1)
    for sub in ("data2ps", "Tmp", "ps"):
        make_folder(ss / sub, comm)
    tasks: list[OneSection | OneSeries] = [
        OneSection(path, ss, seen, request.kinds, style, captions[path.stem], request.formats) for path in files
    ]
    if len(files) > 1:
        pages = math.ceil(len(files) / panels_of_a_page(seen, style))
        rows = math.ceil(len(files) / pages)
        parts = [tuple(files[k : k + rows]) for k in range(0, len(files), rows)]
        for kind in request.kinds:
            for k, part in enumerate(parts, 1):
                bars = "_sigma1" if request.sigma1 and kind.key == panels.DISTORTIONAL.key else ""
                name = f"series_{kind.key}{bars}" + (f"_{k}" if len(parts) > 1 else "")
                captions_here = tuple(captions[path.stem] for path in part)
                tasks.append(OneSeries(name, part, ss, seen, kind, style, captions_here, request.formats))
    log.info(f"{len(files)} sections of {request.folder}: {len(tasks)} pages")
    draw_all(tasks, comm, workers, log.info)
    log.info(
        f"{len(tasks)} pages: pictures in {ss} and {ss / 'ps'}, numbers in {ss / 'data2ps'}, grids in {ss / 'Tmp'}"
    )


@dataclass(frozen=True)
class OneSection:
    """The page, tables and grids of one section."""

    path: Path
    ss: Path
    seen: View
    kinds: tuple[panels.Kind, ...]
    style: Style
    caption: str
    formats: tuple[str, ...]

    @property
    def name(self) -> str:
        """Return the name of the section."""
        return self.path.stem

    def __call__(self) -> None:
        """Draw and write it."""
        section = read_section(self.path)
        write_tables(section, self.ss / "data2ps")
        write_grids(section, self.ss / "Tmp")
        figure = section_page(section, self.seen, self.kinds, self.style, self.caption)
        ending = "sigma1" if self.style.stress_bars else "strain_stress"
        save(figure, self.ss, f"{section.name}_{ending}", self.formats)


@dataclass(frozen=True)
class OneSeries:
    """A page with one kind of several sections."""

    name: str
    part: tuple[Path, ...]
    ss: Path
    seen: View
    kind: panels.Kind
    style: Style
    captions: tuple[str, ...]
    formats: tuple[str, ...]

    def __call__(self) -> None:
        """Draw it."""
        pairs = ((read_section(path), caption) for path, caption in zip(self.part, self.captions))
        figure = series_page(pairs, len(self.part), self.seen, self.kind, self.style)
        save(figure, self.ss, self.name, self.formats)


def _of_this_run(folder: Path, log: Any) -> list[Path]:
    """The sections of a folder of frames, without those of an earlier run's frames. Raises HpcdemError."""
    earlier = earlier_stems(folder) if folder.is_dir() else frozenset()
    found = section_files(folder / "ss" / "data")
    files = [path for path in found if path.stem not in earlier]
    if len(files) < len(found):
        log.warn(f"{len(found) - len(files)} of {len(found)} sections are ignored: {left_out(folder)}")
    old = [path.stem for path in files if _is_newer(folder, path)]
    if old:
        log.warn(f"{len(old)} frames are newer than their sections, first {old[0]}: run `hpcdem -s` again")
    if not files:
        raise HpcdemError(
            f"{folder / 'ss' / 'data'} contains sections of an earlier run only: run `hpcdem -s {folder}`"
        )
    return files


def _is_newer(folder: Path, section: Path) -> bool:
    """Return whether the frame of a section was written after the section."""
    frames = [folder / f"{section.stem}.{kind}" for kind in FORMATS]
    return any(path.is_file() and path.stat().st_mtime_ns > section.stat().st_mtime_ns for path in frames)


def section_files(folder: Path) -> list[Path]:
    """The sections in a folder in the order of time, as `frames.list_frames`. Raises HpcdemError without any."""
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
        panels.VOLUMETRIC.key: own or (INVAR2 if panels.PAGE_VOLUME in request.kinds else VOLUME),
        panels.DISTORTIONAL.key: own or INVAR2,
        panels.MEAN.key: stress,
        panels.SHEAR.key: stress,
    }


def save(figure: Any, ss: Path, name: str, formats: Sequence[str]) -> None:
    """Write a figure: bitmaps into ss, vectors into ss/ps. Serial, the same figure gives the same bytes."""
    for kind in formats:
        path = (ss if kind in BITMAPS else ss / "ps") / f"{name}.{kind}"
        written = "eps" if kind == "ps" else kind
        with atomic_path(path) as temporary:
            save_figure(figure, temporary, written, DPI, path)
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


def _collective(comm: Comm, read: Callable[[], Any]) -> Any:
    """Read on rank 0 and broadcast the result; an HpcdemError is raised on all ranks with its class."""
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


def _survey(files: Sequence[Path], comm: Comm) -> list[survey.Outline]:
    mine: dict[int, survey.Outline] = {}

    def inspect(k: int) -> None:
        mine[k] = survey.outline(read_section(files[k]), read_section(files[k - 1]) if k else None)

    _shared([(inspect, (k,)) for k in range(len(files))], comm)
    found: dict[int, survey.Outline] = {}
    for part in comm.allgather(mine):
        found |= part
    return [found[k] for k in range(len(files))]


def _shared(tasks: Sequence[tuple[Callable[..., None], tuple[Any, ...]]], comm: Comm) -> None:
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
    """Warn of particles added or removed without the corresponding option."""
    for before, o in pairwise(outlines):
        if o.came and not request.addball:
            log.warn(f"{o.came} particles were added between {before.name} and {o.name}: add --addball ON if intended")
        if o.went and not request.delball:
            log.warn(
                f"{o.went} particles were removed between {before.name} and {o.name}: add --delball ON if intended"
            )


def refuse(request: Request) -> None:
    """UsageError for what cannot be drawn."""
    if request.sigma1 and all(kind.key != panels.DISTORTIONAL.key for kind in request.kinds):
        raise UsageError("zdemss: --sigma1 ON needs the distortional strain: it cannot be used with --strainshear OFF")
