"""Frames as the text files ``all_<step>.dat`` of ZDEM, written and read.

The layout is that of ZDEM 2.2 as a public file of that version shows it (`data/all_0000007000.dat` in the GitHub
repository Phoenix0531-sudo/ZDEM_Area_Conservation): the same section lines, tables and order of columns. What is worth
knowing:

- Columns of ZDEM that hpcdem has no quantity for (``safe_dist name fixp1 fixp2 bst``, ``spin`` of walls) are 0 or
  ``***``; columns of hpcdem follow at the end of a row. Frames of earlier versions of hpcdem, which left the former
  out, are read as well: columns are found by their names.
- ``n_bond s_bond`` are the forces at which a bond breaks in tension and in shear without normal force.
- ``globalFx globalFy`` is the force of particle id1 on id2, and of the particle on the wall, as in ZDEM; in a Frame
  (and in VTKHDF) fx, fy is the force on id1, the opposite.
- ``wall contact data`` stands before ``ball data``: a public reader takes every line after the last table for bonds.
- x and y have 13 significant digits, what follows from other columns 6, all else 9. Each table ends with one blank
  line; header words need not stand over their columns, since some headers must begin with fixed text.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import on_first
from hpcdem.io.behind import Deliveries
from hpcdem.io.disk import explain
from hpcdem.io.files import write_sections
from hpcdem.io.frame import Frame, Table
from hpcdem.io.parts import read_lines
from hpcdem.io.textnum import INT, WORD, Column, TextTable, format_floats, sci
from hpcdem.io.transport import Section

WALL_HEAD = "     index         id      P1[0]"
WALL_FORCE_HEAD = "     index         id         xF"
BALL_HEAD = "     index         id                    x"
BALL_DATA_HEAD = "     index         id            m"
LINK_HEAD = "       id1        id2"

_SETTINGS = ("left", "right", "bottom", "height", "gx", "gy", "disk", "frac", "lsm")
_SELDOM = {"lsm": "damp LSM", "period": "period"}
_TABLES = ("particles", "contacts", "bonds", "wall_contacts")

# --- writing ---------------------------------------------------------------------------------------------------


def write_dat(path: str | os.PathLike, frame: Frame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: write the frame to `path`, the same bytes for any number of ranks.

    Columns a table does not have are written as nan (numbers) or 0 (flags, colours). Raises HpcdemError on all ranks.
    """
    write_sections(path, comm, lambda: _sections(frame, comm, os.path.basename(path)), later)


def _sections(frame: Frame, comm: Comm, file: str) -> list[Section]:
    walls, particles = frame.walls, frame.tables["particles"]
    n_walls = len(walls["id"])
    index = np.arange(n_walls)
    mine = slice(0, n_walls if comm.rank == 0 else 0)  # the wall table is the same on all ranks: rank 0 writes it
    wall_words = {f"P{p}[{k}]": walls[f"p{p}"][:, k] for p in (1, 2) for k in (0, 1)}
    wall_state = {
        "xF": walls["force"][:, 0],
        "yF": walls["force"][:, 1],
        "kn": walls["kn"],
        "ks": walls["ks"],
        "fric": walls["fric"],
        "xv": walls["v"][:, 0],
        "yv": walls["v"][:, 1],
    }
    nothing = np.zeros(n_walls, dtype=np.int64)

    def wall_columns(floats: Mapping[str, np.ndarray], digits: int) -> list[tuple[Column, np.ndarray]]:
        columns = [(Column("index", INT, 10), index[mine]), (Column("id", INT, 11), walls["id"][mine])]
        return columns + [(sci(name, digits), np.asarray(v, dtype=float)[mine]) for name, v in floats.items()]

    wall_place_columns = [
        *wall_columns(wall_words, 13),
        (Column("safe_dist", INT, 11), nothing[mine]),
        (Column("name", WORD, 11), nothing[mine]),
    ]
    ends_fixed = [(Column(name, INT, 6), nothing[mine]) for name in ("fixp1", "fixp2")]
    wall_state_columns = [*wall_columns(wall_state, 9), *ends_fixed, (Column("color", INT, 6), walls["color"][mine])]
    wall_state_columns.append((Column("spin", INT, 6), nothing[mine]))

    get = _getter(particles)
    rows = particles.offset + np.arange(len(particles))
    ids = [(Column("index", INT, 10), rows), (Column("id", INT, 11), get("gid", int))]
    fix = get("fix", int)
    ball = [
        *ids,
        (sci("x", 13), get("x")),
        (sci("y", 13), get("y")),
        (sci("rad"), get("radius")),
        (Column("color", INT, 7), get("color", int)),
        (Column("fix_x", INT, 7), fix & 1),
        (Column("fix_y", INT, 7), fix >> 1 & 1),
        (Column("fix_w", INT, 7), fix >> 2 & 1),
        (Column("hertz", INT, 7), get("hertz", int)),
        (Column("safe_dis", INT, 11), np.zeros(len(particles), dtype=np.int64)),
    ]
    words = {"m": "mass", "fric": "fric", "damp": "damp", "kn": "kn", "ks": "ks", "poiss": "poiss", "shear": "shear"}
    names = ["_".join(name.split()) or "***" for name in frame.group_names] or ["***"]
    group = Column("group", WORD, max(13, 2 + max(len(name.encode()) for name in names)))
    ball_data = [
        *ids,
        *[(sci(word), get(name)) for word, name in words.items()],
        (sci("I"), get("inertia")),
        (group, get("group", int)),
    ]
    words = {"V[0]": "vx", "V[1]": "vy", "spin": "spin", "Fx": "fx", "Fy": "fy", "M": "torque"}
    ball_motion = [*ids, *[(sci(word), get(name)) for word, name in words.items()]]
    none = np.zeros(len(particles))
    for word, name in _PUSH_WORDS.items():
        ball_motion.append((sci(word), get(name) if name in particles.columns else none))
    ball_motion += [(Column("bst", INT, 6), none.astype(np.int64)), (sci("density"), get("density"))]
    ball_motion.append((sci("angle"), get("angle")))

    get = _getter(frame.tables["wall_contacts"])
    wall_row = get("wall", int)
    wall_contact = [
        (Column("wall_id", INT, 10), np.asarray(walls["id"])[wall_row] if n_walls else wall_row),
        (Column("ball_id", INT, 11), get("id1", int)),
        *_link_columns(get, ("x", "y", "Un")),
    ]

    def table(
        columns: list[tuple[Column, np.ndarray]], head: str = "", words: list[str] | None = None
    ) -> list[Section]:
        columns = _wide_enough(columns, comm)
        return [_header([c for c, _ in columns], head), TextTable(columns, words or ()), b"\n"]

    sections: list[Section] = [_parameters(frame, file), f"wall data ...\nwall num : {n_walls}\n".encode()]
    sections += table(wall_place_columns, WALL_HEAD, ["***"])
    sections += table(wall_state_columns, WALL_FORCE_HEAD)
    sections += [b"wall contact data ...\n", *table(wall_contact)]
    sections += [f"ball data ...\nball num : {particles.total}\n".encode(), *table(ball, BALL_HEAD)]
    sections += table(ball_data, BALL_DATA_HEAD, names)
    sections += table(ball_motion)
    for links in ("contacts", "bonds"):
        get = _getter(frame.tables[links])
        columns = [(Column("id1", INT, 10), get("id1", int)), (Column("id2", INT, 11), get("id2", int))]
        if links == "bonds":
            columns += _link_columns(get, ("x", "y"), "Un")
            columns[-2:-2] = [
                (Column("rubber", INT, 8), get("rubber", int)),
                (Column("type", INT, 6), get("kind", int)),
            ]
            columns += [(Column("kind", INT, 6), get("kind", int))]
            columns += [(sci(w), get(c)) for w, c in _BOND_WORDS.items()]
        else:
            columns += _link_columns(get, ("x", "y"), "Un")
        sections += [f"{links[:-1]} data ...\n".encode(), *table(columns, LINK_HEAD)]
    return sections


_BOND_WORDS = {"ebmod": "ebmod", "gbmod": "gbmod", "tstr": "tstrength", "sstr": "sstrength"}


_PUSH_WORDS = {"applyFx": "push_x", "applyFy": "push_y"}
_LAW_WORDS = {"kn": "law_kn", "ks": "law_ks", "n_bond": "law_tension", "s_bond": "law_shear", "frci": "law_fric"}
_REAL_WORDS = {"realkn": "law_realkn", "realks": "law_realks"}


def _link_columns(
    get: Callable[..., np.ndarray], own: tuple[str, ...], overlap: str = ""
) -> list[tuple[Column, np.ndarray]]:
    """ZDEM's columns of contacts, with that of the overlap where there is one, then `own` at the end."""
    values = {"Fn": get("fn"), "Fs": get("fs"), "globalFx": 0.0 - get("fx"), "globalFy": 0.0 - get("fy")}
    columns = [(sci(word), v) for word, v in values.items()]
    columns += [(sci(word, 6), get(name)) for word, name in _LAW_WORDS.items()]
    columns.append((Column("slip", INT, 6), get("law_slip", int)))
    columns += [(sci(overlap), get("overlap"))] if overlap else []
    columns += [(sci(word, 6), get(name)) for word, name in _REAL_WORDS.items()]
    return columns + [(sci(word), get("overlap" if word == "Un" else word)) for word in own]


def _getter(table: Table) -> Callable[..., np.ndarray]:
    def get(name: str, kind: type = float) -> np.ndarray:
        if name in table.columns:
            return table.columns[name].astype(np.int64 if kind is int else np.float64, copy=False)
        if name.startswith("law_") and kind is float:
            return np.zeros(len(table))
        return np.full(len(table), np.nan) if kind is float else np.zeros(len(table), dtype=np.int64)

    return get


def _wide_enough(columns: list[tuple[Column, np.ndarray]], comm: Comm) -> list[tuple[Column, np.ndarray]]:
    """The integer columns widened to their largest number on any rank, with a blank in front."""
    whole = [np.max(np.abs(v), initial=0) * (-10 if np.any(v < 0) else 1) for c, v in columns if c.kind == INT]
    largest = comm.max_into(np.array([abs(w) for w in whole], dtype=np.int64))
    widths = iter(len(str(w)) + 1 for w in largest)
    return [(Column(c.name, INT, max(c.width, next(widths))), v) if c.kind == INT else (c, v) for c, v in columns]


def _header(columns: list[Column], head: str) -> bytes:
    """The names, right-aligned over their columns, after a beginning that must be exactly `head`."""
    line, end = head, 0
    skip = len(head.split())
    for k, column in enumerate(columns):
        end += column.width
        if k >= skip:
            line += column.name.rjust(max(end - len(line), len(column.name) + 1))
    return line.encode() + b"\n"


def _parameters(frame: Frame, file: str) -> bytes:
    def words(*values: Any) -> str:
        return " ".join(
            str(v).rjust(20) if isinstance(v, (str, int)) else format_floats(np.array([v]), 13)[0].rjust(20)
            for v in values
        )

    setting = {name: frame.settings.get(name, np.nan) for name in _SETTINGS}
    values = {name: words(setting[name]) for name in ("right", "left", "height", "bottom")}
    values |= {"dt": words(float(frame.dt)), "gravity": words(setting["gx"], setting["gy"])}
    values |= {"frac": words(setting["frac"]), "disk": words(_SHAPES.get(str(setting["disk"]), str(setting["disk"])))}
    values |= {"damp LSM": words(setting["lsm"]), "current_step": words(int(frame.step))}
    head = ["version    : 2.2(hpcdem)", f"filename   : {file}", "", "parameter data ..."]
    lines = [*head, *(f"{key:>18} : {value}" for key, value in values.items())]
    # Not in ZDEM's; a public reader takes the number of particles from the second.
    lines += [f"current_time: {words(float(frame.time)).strip()}", f"ball_num: {frame.tables['particles'].total}"]
    if "period" in frame.settings:
        lines.append(f"period: {words(frame.settings['period']).strip()}")
    return ("\n".join(lines) + "\n\n").encode()


_SHAPES = {"off": "off=ball", "on": "on=disk", "hex": "hex=hexagon"}


# --- reading ---------------------------------------------------------------------------------------------------

# Words of table headers, ours and ZDEM's of several versions, and the columns of a Frame they fill.
_BALL_WORDS = {
    "x": "x",
    "y": "y",
    "rad": "radius",
    "r": "radius",
    "color": "color",
    "hertz": "hertz",
    "m": "mass",
    "fric": "fric",
    "damp": "damp",
    "kn": "kn",
    "ks": "ks",
    "poiss": "poiss",
    "shear": "shear",
    "I": "inertia",
    "V[0]": "vx",
    "V[1]": "vy",
    "spin": "spin",
    "Fx": "fx",
    "Fy": "fy",
    "M": "torque",
    "angle": "angle",
    "density": "density",
} | _PUSH_WORDS
_LINK_WORDS = {"Fn": "fn", "Fs": "fs", "globalFx": "fx", "globalFy": "fy", "x": "x", "y": "y", "Un": "overlap"}
_LINK_WORDS |= {"kind": "kind", "rubber": "rubber"} | _BOND_WORDS
_TYPES = {
    "gid": np.int64,
    "id1": np.int64,
    "id2": np.int64,
    "wall": np.int32,
    "color": np.int32,
    "group": np.int32,
    "hertz": np.int8,
    "kind": np.int8,
    "rubber": np.int8,
    "fix": np.uint8,
}

_RawTable = dict[str, np.ndarray]


def is_frame(path: str | os.PathLike) -> bool:
    """Return whether a text file is a frame of ZDEM or hpcdem, by its first lines; False if it cannot be read.
    Serial."""
    try:
        with open(path, "rb") as file:
            return b"parameter data ..." in file.read(4096)
    except (OSError, ValueError):
        return False


def read_dat(
    path: str | os.PathLike,
    tables: Collection[str] | None = None,
    comm: Comm = SerialComm(),  # noqa: B008
) -> Frame:
    """The frame in a .dat file of hpcdem or ZDEM. Collective: of each table every rank gets some of the rows; of that
    of the particles a slab, in ascending order of ids. No rank has them all in memory, if lines end as on Unix.

    tables: names of the tables to read (all by default); the others come back empty, which saves most of the time.
    Columns that the file does not have are absent from the table; unknown columns are skipped. Groups
    are numbered in order of first appearance. Raises HpcdemError if the file is of another kind or truncated.
    """
    path = os.fspath(path)
    wanted = set(_TABLES if tables is None else tables)
    parameters, places, counts, in_place = on_first(comm, lambda: _layout(path, wanted))
    if "current_step" not in parameters:
        raise HpcdemError(f"cannot read {path}: it is not a frame of ZDEM or hpcdem (no line current_step)")
    raw = _tables(comm, path, places, in_place)
    balls = raw.get("ball data", [])
    if comm.size > 1:
        from hpcdem.io.slabs import by_ranges  # brings kernels, which a script that is read must not

        for k, table in enumerate(balls):
            if "id" in table:
                balls[k] = by_ranges(comm, "id", table | {"id": table["id"].astype(np.int64)})
    error = None
    try:
        walls = _walls(raw.get("wall data", []))
        particles, names = _particles(balls)
        columns = {
            "particles": particles,
            "contacts": _links(raw.get("contact data", [])),
            "bonds": _links(raw.get("bond data", []), forces=True),
            "wall_contacts": _wall_contacts(raw.get("wall contact data", []), walls["id"]),
        }
        frame = _frame(parameters, walls, names, columns)
    except (ValueError, KeyError, IndexError) as failure:
        error = f"cannot read {path}: {failure}"
    comm.agree(error)
    number = int(comm.sum_into(np.array([len(particles.get("gid", ()))]))[0])
    for section, found in (("wall", len(walls["id"])), ("ball", number)):
        if counts.get(section, found) != found and (section != "ball" or "particles" in wanted):
            raise HpcdemError(
                f"cannot read {path}: {counts[section]} {section}s announced, {found} found. The file may be truncated"
            )
    if comm.size > 1:
        _agree_on_columns(comm, frame)
    return frame


def _agree_on_columns(comm: Comm, frame: Frame) -> None:
    """Collective: the same groups on all ranks, in the order of the whole table; and columns that are there on some
    ranks only, as they are nearly always zero, on all."""
    p, mine = frame.tables["particles"].columns, frame.group_names
    frame.group_names = list(dict.fromkeys(name for names in comm.allgather(mine) for name in names))
    if "group" in p:
        numbers = {name: k for k, name in enumerate(frame.group_names)}
        p["group"] = np.array([numbers[name] for name in mine], np.int32)[p["group"]]
    if "gid" in p and comm.any("push_x" in p):
        p |= {name: p.get(name, np.zeros(len(p["gid"]))) for name in _PUSH_WORDS.values()}


def _frame(
    parameters: dict[str, str], walls: dict[str, np.ndarray], groups: list[str], columns: dict[str, _RawTable]
) -> Frame:
    def number(key: str) -> float:
        return float(parameters.get(key, "nan").split()[0])

    gravity = parameters.get("gravity", "").split()
    settings: dict[str, float | str] = {}
    for name in _SETTINGS:
        settings[name] = parameters[name].split("=")[0] if name == "disk" and name in parameters else number(name)
    if gravity:
        settings["gx"], settings["gy"] = ([0.0, *map(float, gravity)])[-2:]
    settings |= {name: number(word) for name, word in _SELDOM.items() if word in parameters}
    if not isinstance(settings["disk"], str):
        settings["disk"] = "off"
    step, dt, time = int(number("current_step")), number("dt"), number("current_time")
    tables = {name: Table(c, 0, len(next(iter(c.values()))) if c else 0) for name, c in columns.items()}
    return Frame(step, step * dt if np.isnan(time) else time, dt, settings, walls, tables, groups)


@contextmanager
def _mapped(file: BinaryIO) -> Iterator[bytes | mmap.mmap]:
    """The bytes of a file with line ends of Unix, without having them all in memory where that is possible."""
    try:
        data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError):  # an empty file, or a file system without maps
        yield file.read().replace(b"\r\n", b"\n")
        return
    with data:
        dos = data.find(b"\r\n", 0, 1 << 16) >= 0
        yield data[:].replace(b"\r\n", b"\n") if dos else data


@dataclass(frozen=True)
class _Place:
    """A table of a section: header words, bytes of its rows, words of a row."""

    section: str
    names: list[str]
    begin: int
    end: int
    width: int


_Layout = tuple[dict[str, str], list[_Place], dict[str, int], bool]


def _layout(path: str, wanted: set[str]) -> _Layout:
    """Parameters by key, tables, the numbers of walls and balls announced, and whether the tables lie in the file as
    they are read. Serial."""
    try:
        with open(path, "rb") as file, _mapped(file) as data:
            return *_split(data, wanted), not isinstance(data, bytes)
    except OSError as failure:
        if isinstance(failure, FileNotFoundError):
            raise HpcdemError(f"cannot read {path}: there is no such file") from None
        raise HpcdemError(explain(path, failure, "read")) from None


def _split(data: bytes | mmap.mmap, wanted: set[str]) -> tuple[dict[str, str], list[_Place], dict[str, int]]:
    parameters: dict[str, str] = {}
    places: list[_Place] = []
    counts: dict[str, int] = {}
    needed_by = {"ball": "particles", "contact": "contacts", "bond": "bonds", "wall contact": "wall_contacts"}
    section, at = "", 0
    while at < len(data):
        end = data.find(b"\n", at)
        end = len(data) if end < 0 else end
        line = data[at:end].decode("utf-8", "replace").strip()
        at = end + 1
        if line.endswith(" data ..."):
            section = line.removesuffix(" ...")
        elif line.split()[:1] in (["index"], ["id1"], ["wall_id"]):
            end = data.find(b"\n\n", at - 1)
            end = len(data) if end < 0 else end
            if section.startswith("wall data") or needed_by.get(section.removesuffix(" data")) in wanted:
                first = data.find(b"\n", at, end)
                width = len(data[at : end if first < 0 else first].split()) if at < end else 0
                places.append(_Place(section, line.split(), at, max(at, end), width))
            _let_go(data, end)
            at = end + 1
        elif ":" in line:
            key, _, value = line.partition(":")
            if section == "parameter data":
                parameters[key.strip()] = value.strip()
            elif key.strip() in ("wall num", "ball num"):
                counts[key.split()[0]] = int(value)
    return parameters, places, counts


def _let_go(data: bytes | mmap.mmap, end: int) -> None:
    """Let the system release memory of the part of a mapped file that was read."""
    if not isinstance(data, bytes) and hasattr(mmap, "MADV_DONTNEED"):
        data.madvise(mmap.MADV_DONTNEED, 0, end)


def _tables(comm: Comm, path: str, places: list[_Place], in_place: bool) -> dict[str, list[_RawTable]]:
    """Read the rows of this rank of each table, by section; all rows of tables of walls. Collective."""
    raw: dict[str, list[_RawTable]] = {}
    error, texts = None, {}
    shared_out = in_place and comm.size > 1
    for k, place in enumerate(places):
        if shared_out and not place.section.startswith("wall data"):
            texts[k] = read_lines(comm, path, place.begin, place.end)
    try:
        found = [
            _table(path, place, texts[k], 0, len(texts[k])) if k in texts else {} for k, place in enumerate(places)
        ]
        if comm.rank == 0 and len(texts) < len(places):
            with open(path, "rb") as file, _mapped(file) as data:
                for k, place in enumerate(places):
                    if k not in texts:
                        found[k] = _table(path, place, data, place.begin, place.end)
                        _let_go(data, place.end)
    except HpcdemError as failure:
        error = str(failure)
    except OSError as failure:
        error = explain(path, failure, "read")
    comm.agree(error)
    for k, place in enumerate(places):
        table = found[k]
        if place.section.startswith("wall data"):
            table = comm.bcast(table)
        elif comm.size > 1:
            table = _alike(comm, place, table or {name: np.zeros(0) for name in place.names[: place.width]})
        raw.setdefault(place.section, []).append(table)
    return raw


def _alike(comm: Comm, place: _Place, table: _RawTable) -> _RawTable:
    """The table with the same types on all ranks. Collective."""
    words = [name for name in ("group", "name") if name in table]
    size = np.array([1] + [table[name].dtype.itemsize for name in words if len(table[name])]).max(keepdims=True)
    width = int(comm.max_into(size)[0])
    return table | {name: table[name].astype(f"S{width}") for name in words}


_PIECE = 1 << 24
"""Most bytes of a table that are cut into words at once: words take many times the memory of their text."""


def _table(path: str, place: _Place, data: bytes | mmap.mmap, at: int, end: int) -> _RawTable:
    """Columns by header word of the lines from `at` to `end`: float64, or bytes where they are not numbers."""
    names, width = place.names, place.width
    words = "group" in names or "name" in names
    pieces: list[list[np.ndarray]] = []
    while at < end and width:
        stop = end if end - at <= _PIECE else data.rfind(b"\n", at, at + _PIECE) + 1 or end
        text = data[at:stop]
        at = stop
        values = np.array(text.split()) if words else np.fromstring(text, sep=" ")
        if values.size % width or values.size < width * text.rstrip().count(b"\n"):
            raise HpcdemError(
                f"cannot read {path}: a table of the section '{place.section}' has rows of unequal length"
            )
        columns = zip(names, values.reshape(-1, width).T)
        pieces.append([c.astype(np.float64) if name not in ("group", "name") else c for name, c in columns])
    if not pieces:
        return {name: np.zeros(0) for name in (names[:width] if width else names)}
    return {name: np.concatenate([piece[k] for piece in pieces]) for k, name in enumerate(names[:width])}


def _walls(raw: list[_RawTable]) -> dict[str, np.ndarray]:
    words: _RawTable = {}
    for table in raw:
        words |= table
    n = len(words.get("P1[0]", ()))

    def get(*names: str) -> np.ndarray:
        values = [words[name] if len(words.get(name, ())) == n else np.full(n, np.nan) for name in names]
        return np.stack(values, axis=1) if len(values) > 1 else values[0]

    color = get("color")
    return {
        "id": words["id"].astype(np.int64) if n else np.zeros(0, dtype=np.int64),
        "p1": get("P1[0]", "P1[1]"),
        "p2": get("P2[0]", "P2[1]"),
        "kn": get("kn"),
        "ks": get("ks"),
        "fric": get("fric"),
        "color": np.where(np.isnan(color), 5, color).astype(np.int32),
        "v": get("xv", "yv"),
        "force": get("xF", "yF"),
    }


def _particles(raw: list[_RawTable]) -> tuple[_RawTable, list[str]]:
    if not raw:
        return {}, ["***"]
    gid = raw[0]["id"].astype(np.int64)
    order = np.argsort(gid, kind="stable")
    columns: _RawTable = {"gid": gid[order]}
    names = np.full(len(gid), b"***", dtype="S3")
    for table in raw:
        own = table["id"].astype(np.int64)
        if len(own) == 0 and len(gid):  # a header without rows
            continue
        rows = np.argsort(own, kind="stable")
        if not np.array_equal(own[rows], columns["gid"]):
            raise ValueError("the tables of 'ball data' do not list the same ids")
        for word, name in _BALL_WORDS.items():
            if word in table:
                columns[name] = table[word][rows].astype(_TYPES.get(name, np.float64))
        if "fix_x" in table:
            fix = table["fix_x"] + 2 * table["fix_y"] + 4 * table["fix_w"]
            columns["fix"] = fix[rows].astype(np.uint8)
        if "group" in table:
            names = table["group"][rows]
    push = [columns.pop(name) for name in _PUSH_WORDS.values() if name in columns]
    if any(values.any() for values in push):  # nearly always zero, and then as if they were not there
        columns |= dict(zip(_PUSH_WORDS.values(), push))
    unique, first, inverse = np.unique(names, return_index=True, return_inverse=True)
    rank = np.empty(len(unique), dtype=np.int32)
    by_appearance = np.argsort(first)
    rank[by_appearance] = np.arange(len(unique))
    columns["group"] = rank[inverse.reshape(-1)]
    return columns, [bytes(unique[k]).decode("utf-8", "replace") for k in by_appearance]


def _links(raw: list[_RawTable], forces: bool = False) -> _RawTable:
    """Pairs in order; forces: with the strengths of bonds as ZDEM writes them."""
    if not raw:
        return {}
    table = raw[0]
    order = np.lexsort((table["id2"], table["id1"]))
    columns = {name: table[name][order].astype(np.int64) for name in ("id1", "id2")}
    if forces and "kind" not in table:  # in frames of hpcdem they follow from its own columns
        columns |= {word: table[word][order] for word in ("n_bond", "s_bond") if word in table}
    return columns | _link_values(table, order)


def _wall_contacts(raw: list[_RawTable], wall_ids: np.ndarray) -> _RawTable:
    if not raw:
        return {}
    table = raw[0]
    rows = {int(i): k for k, i in enumerate(wall_ids)}
    unknown = [int(i) for i in table["wall_id"] if int(i) not in rows]
    if unknown:
        raise ValueError(f"a wall contact refers to the unknown wall {unknown[0]}")
    wall = np.array([rows[int(i)] for i in table["wall_id"]], dtype=np.int32)
    order = np.lexsort((wall, table["ball_id"]))
    columns: _RawTable = {"id1": table["ball_id"][order].astype(np.int64), "wall": wall[order]}
    return columns | _link_values(table, order)


def _link_values(table: _RawTable, order: np.ndarray) -> _RawTable:
    values = {
        name: table[word][order].astype(_TYPES.get(name, np.float64))
        for word, name in _LINK_WORDS.items()
        if word in table
    }
    return values | {name: 0.0 - values[name] for name in ("fx", "fy") if name in values}
