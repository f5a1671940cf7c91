"""SECTION: groups, discs and weak planes from the polygons and lines of a drawing, a map or an image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands.dem import bonds
from hpcdem.commands.dem.particles import add, check_circles
from hpcdem.commands.dem.properties import chosen, prop
from hpcdem.core.errors import CommandError
from hpcdem.core.material import PROPERTIES
from hpcdem.core.picture_words import NUMBERS
from hpcdem.core.selection import Particles, Selection, even_odd
from hpcdem.io.agreed import on_first
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.pre.section.fill import POROSITY, filled
from hpcdem.pre.section.read import read
from hpcdem.pre.section.shapes import Placement, Section, group_name


@dataclass(frozen=True, eq=False)
class _Given(Selection):
    """Particles by flags (n,) of the owned ones."""

    flags: np.ndarray

    def mask(self, p: Particles) -> np.ndarray:
        return self.flags


def section(
    sim: Simulation,
    file: Path | str,
    scale: float | None = None,
    origin: tuple[float, float] = (0.0, 0.0),
    to: tuple[float, float] = (0.0, 0.0),
    line: tuple[tuple[float, float], tuple[float, float]] | None = None,
    legend: Path | str | None = None,
    attribute: str | None = None,
    only: Sequence[str] | str = (),
    rad: Sequence[float] | float | None = None,
    porosity: float | None = None,
    cut: bool = False,
    ebmod: float | None = None,
    gbmod: float | None = None,
    tstrength: float | None = None,
    sstrength: float | None = None,
    n_bond: float | None = None,
    s_bond: float | None = None,
    where: Selection | None = None,
) -> int:
    """SECTION: apply the polygons or lines of a file .geojson, .json, .shp, .svg, .dxf or of an image to the particles.

    By default, particles whose centres lie in a polygon get its name as group, and those of its attributes that are
    properties (density, fric, kn, ...) or color; later polygons of the file cover earlier ones. With rad, the polygons
    are filled with new particles. With cut, bonds that cross a line are removed; with bond properties, these are
    assigned to them.

    Parameters
    ----------
    file : path of the section.
    scale : metres per unit of the file (default: as given in the file, else 1).
    origin, to : point of the file, in its units, and the corresponding point of the model [m].
    line : two points of a map, in its units: x is the distance along the line through them, y the height (z).
    legend : for an image: path of a file with rows colour, name.
    attribute : attribute whose value is the name, for GeoJSON and shapefiles (default: name, layer, unit, ... or id).
    only : names of the polygons and lines to use (default: all).
    rad : radii of new particles, drawn at random; a repeated one is more likely [m].
    porosity : porosity of the filled polygons (default: 0.2).
    cut : bool: remove the bonds that cross a line.
    ebmod, gbmod, tstrength, sstrength : properties of elastic bonds that cross a line [Pa].
    n_bond, s_bond : strengths of contact bonds that cross a line [N].
    where : particles to change (default: all); of a bond both must be selected; not for new particles.

    Returns
    -------
    int : number of particles that got a group or were created, or number of bonds changed.
    """
    weak = any(v is not None for v in (ebmod, gbmod, tstrength, sstrength, n_bond, s_bond))
    if (rad is not None) + cut + weak > 1:
        raise CommandError("a SECTION either fills polygons (rad), removes bonds (cut) or changes them")
    if porosity is not None and rad is None:
        raise CommandError("porosity applies to filled polygons only: give rad")
    if rad is not None and where is not None:
        raise CommandError("new particles (rad) do not accept a RANGE; use only to select polygons")
    placement = Placement(scale, origin, to, line)
    names = (only,) if isinstance(only, str) else tuple(only)
    found: Section = on_first(sim.comm, lambda: read(file, placement, legend, attribute, names))
    _report(sim, found, file)
    if cut or weak:
        values = ((ebmod, gbmod, tstrength, sstrength), (n_bond, s_bond)) if weak else None
        return _bonds(sim, found, values, where, str(file))
    if not found.polygons:
        raise CommandError(f"{file}: no polygon; lines need cut, or bond properties")
    return _group(sim, found, where) if rad is None else _fill(sim, found, rad, porosity, str(file))


def _report(sim: Simulation, found: Section, file: Path | str) -> None:
    if sim.log is None:
        return
    for note in found.notes:
        sim.log.info(f"SECTION {Path(file).name}: {note}")
    for warning in found.warnings:
        sim.log.warn(f"SECTION {Path(file).name}: {warning}")


def _attributes(attributes: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Arguments of PROP among the attributes of a polygon."""
    made: dict[str, Any] = {}
    for key, value in attributes.items():
        word = str(key).lower()
        if word == "color" and value not in (None, ""):
            number = NUMBERS.get(str(value).lower(), value)
            if not isinstance(number, int | float) or number not in NUMBERS.values():
                raise CommandError(f"'{name}': color {value!r} is none of {', '.join(NUMBERS)}")
            made["color"] = int(number)
        elif word == "hertz":
            made["hertz"] = bool(value) and str(value).lower() not in ("0", "0.0", "no", "false", "off")
        elif word in PROPERTIES and value not in (None, ""):
            try:
                made[word] = float(value)
            except (TypeError, ValueError):
                raise CommandError(f"'{name}': {word} is a number, the file has {value!r}") from None
    return made


def _group(sim: Simulation, found: Section, where: Selection | None) -> int:
    """Groups and properties of the particles in polygons."""
    p = sim.particles
    wanted = chosen(sim, where)
    x, y = sim.clumps.centres(p)
    which = np.full(len(p), -1)
    deviation = found.deviation
    for number, shape in enumerate(found.polygons):
        which[wanted & even_odd(shape.points(deviation), x, y)] = number
    given = [_attributes(shape.attributes, shape.name) for shape in found.polygons]
    counts: dict[str, int] = {}
    for number, shape in enumerate(found.polygons):
        flags = which == number
        name = group_name(shape.name)
        counts[name] = counts.get(name, 0) + sim.count(int(flags.sum()))
        prop(sim, _Given(flags), group=name, **given[number])
    total = sum(counts.values())
    outside = sim.count(int((wanted & (which < 0)).sum()))
    if sim.log is not None:
        by_group = ", ".join(f"{name} {count}" for name, count in counts.items())
        sim.log.info(f"SECTION: particles by group: {by_group}; {outside} in no polygon keep theirs")
        words = {word for one in given for word in one}
        if words:
            sim.log.info(f"SECTION: assigned from attributes: {', '.join(sorted(words))}")
        for name, count in counts.items():
            if not count:
                sim.log.warn(f"SECTION: no selected particle is in '{name}'; check scale, origin and to")
    return total


def _fill(sim: Simulation, found: Section, rad: Sequence[float] | float, porosity: float | None, file: str) -> int:
    """New particles in the polygons."""
    radii = np.atleast_1d(np.array(rad, np.float64))
    if not len(radii) or not (np.isfinite(radii).all() and (radii > 0.0).all()):
        raise CommandError("rad: radii above 0 are needed")
    share = POROSITY if porosity is None else porosity
    made = on_first(sim.comm, lambda: filled(found, radii, share, sim.settings.seed, sim.streams, file))
    sim.streams += 1
    check_circles(sim.comm, made.rows)
    names = list(dict.fromkeys(group_name(shape.name) for shape in found.polygons))
    for number, shape in enumerate(found.polygons):
        rows = made.rows[made.shape == number]
        name = group_name(shape.name)
        if not len(rows):
            if sim.log is not None:
                sim.log.warn(f"SECTION: '{shape.name}' ({shape.where}) got no particle: later polygons cover it")
            continue
        given = _attributes(shape.attributes, shape.name)
        first = sim.next_gid
        add(sim, rows, sim.group_number(name), given.pop("color", names.index(name) % len(NUMBERS)))
        if given:
            prop(sim, _Given(sim.particles["gid"] >= first), **given)
        if sim.log is not None:
            sim.log.info(f"SECTION: {name}: {len(rows)} particles")
    if sim.log is not None:
        sim.log.info(
            f"SECTION: {len(made.rows)} particles, porosity {share:g}; neighbours overlap by at most "
            f"{100.0 * made.overlap:.2g} % of the sum of their radii: let them come to rest before bonding"
        )
    return len(made.rows)


def _bonds(sim: Simulation, found: Section, values: tuple[Any, Any] | None, where: Selection | None, file: str) -> int:
    """Remove or change the bonds that cross lines."""
    if not found.lines:
        raise CommandError(f"{file}: no line that bonds could cross; polygons assign groups only")
    deviation = found.deviation
    lines = [points for shape in found.lines for points in shape.points(deviation)]
    if values is None:
        changed = bonds.break_bonds(sim, where, across=lines)
    else:
        elastic, contact = values
        given = dict(zip(bonds.ELASTIC, elastic)) | dict(zip(("n_bond", "s_bond"), contact))
        changed = bonds.renew(sim, where, lines, **given)
    if sim.log is not None:
        names = ", ".join(dict.fromkeys(f"'{shape.name}'" for shape in found.lines))
        done = "removed" if values is None else "changed"
        sim.log.info(f"SECTION: {changed} bonds that cross {names} {done}")
        if not changed:
            sim.log.warn(f"SECTION: no bond crosses {names}; bonds are made by PROP, before SECTION")
    return changed
