"""Abaqus input files: points, elements, sets, surfaces, parts and their instances, by the numbers in the file.

What is read: *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE, *PART, *INSTANCE, *ASSEMBLY, *INCLUDE. What would make or move
points in another way (*NGEN, *SYSTEM and others) is refused; all else is skipped and named. Names of sets are
case-insensitive; groups are spelled as the file first does.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh.file_mesh import DIMENSIONS, Block, FileMesh, lines, listed

REFUSED = {
    "NGEN": "makes points between others", "NFILL": "makes points between others", "NCOPY": "copies points",
    "NMAP": "moves points", "ELGEN": "makes elements from others", "ELCOPY": "copies elements",
    "SYSTEM": "gives points in a local coordinate system", "SYMMETRICMODELGENERATION": "makes a part of the model",
    "IMPORT": "reads the mesh from a result",
}  # fmt: skip
"""Keywords without which the mesh would be a different one, and the reason for the message."""
PLANE = re.compile(r"(?:CPE|CPS|CPEG|CAX|CGAX|DC2D|DCC2D|DCAX|DCCAX|AC2D|ACAX|STRI|S|DS|M3D|R3D|SFM3D)(\d+)[A-Z]*5?$")
SOLID = re.compile(r"(?:C3D|DC3D|DCC3D|AC3D)(\d+)[A-Z]*$")
KINDS = {
    2: {3: "triangle", 4: "quad", 6: "triangle", 8: "quad", 9: "quad", 65: "triangle"},
    3: {4: "tetra", 8: "hexahedron", 10: "tetra", 20: "hexahedron", 27: "hexahedron", 6: "wedge", 15: "wedge",
        5: "pyramid", 13: "pyramid", 18: "wedge"},
}  # fmt: skip
"""Kind of element by dimension and number of points."""
SIDES = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of S1, S2, ... of each kind."""
LARGEST = 2**63
"""Bound of the numbers of nodes and elements, which are smaller."""
DEEPEST = 20
"""Largest depth to which files include files."""
NODES, ELEMENTS, FACES = "NSET", "ELSET", "SURFACE"


class Line(NamedTuple):
    """A line of data."""

    file: Path
    number: int
    text: str

    @property
    def where(self) -> str:
        """Return file and line for messages."""
        return f"{self.file}:{self.number}"

    def row(self) -> list[str]:
        """Return the values as text."""
        return [text.strip() for text in self.text.split(",")]

    def floats(self) -> list[float]:
        """Return the values."""
        return [_number(text, self) for text in self.row() if text]


@dataclass
class Keyword:
    """A line with a star: its name without blanks, its parameters, and the lines of data below it."""

    name: str
    parameters: dict[str, str]
    line: Line
    data: list[Line] = field(default_factory=list)

    def get(self, name: str) -> str:
        """A parameter; HpcdemError if it is missing."""
        if not self.parameters.get(name):
            raise HpcdemError(f"{self.line.where}: *{self.name} needs {name}=")
        return self.parameters[name]


@dataclass
class Entry:
    """One entry of a set: its element or node numbers, or the name of another set. nodes_of: use the points of that
    element set; instance: that it belongs to; side: of a surface.
    """

    value: np.ndarray | range | str
    line: Line
    instance: str = ""
    nodes_of: bool = False
    side: str = ""


@dataclass
class Scope:
    """A part, an instance, or what is outside of both (name ""). seen: points of all elements so far; others: elements
    of ignored kinds; sets: by kind and name in capitals; inner: sets created internally by Abaqus/CAE; turn, move:
    transformation of the points of the part.
    """

    name: str
    nodes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    blocks: list[tuple[str, str, dict[int, list[int]]]] = field(default_factory=list)
    seen: dict[int, list[int]] = field(default_factory=dict)
    others: set[int] = field(default_factory=set)
    sets: dict[tuple[str, str], list[Entry]] = field(default_factory=dict)
    spelled: dict[tuple[str, str], str] = field(default_factory=dict)
    inner: set[tuple[str, str]] = field(default_factory=set)
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    move: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def copy(self, name: str) -> Scope:
        """Return an instance of this part."""
        sets = {key: list(entries) for key, entries in self.sets.items()}
        return Scope(
            name,
            dict(self.nodes),
            list(self.blocks),
            dict(self.seen),
            set(self.others),
            sets,
            dict(self.spelled),
            set(self.inner),
        )

    def add(self, kind: str, name: str, word: Keyword, entries: list[Entry]) -> None:
        """Add entries to a set."""
        key = kind, name.upper()
        self.spelled.setdefault(key, name)
        self.sets.setdefault(key, []).extend(entries)
        if "INTERNAL" in word.parameters:
            self.inner.add(key)


def read(path: Path) -> FileMesh:
    """Read an Abaqus input file. Raises HpcdemError with file and line for anything that cannot be used."""
    return _Reader(path).read()


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.scope = self.root = Scope("")
        self.parts: dict[str, Scope] = {}
        self.instances: dict[str, Scope] = {}
        self.assembled = False
        self.used: set[str] = set()
        self.files: set[Path] = set()
        self.dropped: Counter[str] = Counter()
        self.kinds: dict[str, list[int]] = {}
        self.notes: list[str] = []
        self.rows: dict[str, dict[int, int]] = {}
        self.numbers: dict[str, dict[int, int]] = {}

    def read(self) -> FileMesh:
        for word in _keywords(self.path, self.files):
            self._take(word)
        if not any(scope.nodes for scope in (self.root, *self.parts.values(), *self.instances.values())):
            raise HpcdemError(f"{self.path}: not an Abaqus input file with points: *NODE has no data")
        return self._whole()

    # ---- keyword by keyword ------------------------------------------------------------------------------------

    def _take(self, word: Keyword) -> None:
        name = word.name
        if name in REFUSED:
            raise HpcdemError(
                f"{word.line.where}: *{name} {REFUSED[name]}, which is not supported: write points and elements "
                "explicitly"
            )
        if name == "PART":
            part = word.get("NAME")
            if part.upper() in self.parts:
                raise HpcdemError(f"{word.line.where}: part {part} is defined twice")
            self.scope = self.parts[part.upper()] = Scope(part)
        elif name == "ASSEMBLY":
            self.scope, self.assembled = self.root, True
        elif name == "INSTANCE":
            self._instance(word)
        elif name in ("ENDPART", "ENDINSTANCE", "ENDASSEMBLY"):
            self.scope = self.root
        elif name == "NODE":
            self._nodes(word)
        elif name == "ELEMENT":
            self._elements(word)
        elif name in (NODES, ELEMENTS):
            self._set(word)
        elif name == FACES:
            self._surface(word)
        elif name not in ("HEADING", "PREPRINT"):
            self.dropped[f"*{name}"] += 1

    def _instance(self, word: Keyword) -> None:
        name = word.get("NAME")
        if "LIBRARY" in word.parameters:
            raise HpcdemError(
                f"{word.line.where}: instance {name} comes from a result (LIBRARY), which is not supported"
            )
        part = word.get("PART")
        if part.upper() not in self.parts:
            raise HpcdemError(f"{word.line.where}: instance {name} is of part {part}, which is not defined above")
        self.used.add(part.upper())
        if name.upper() in self.instances:
            raise HpcdemError(f"{word.line.where}: instance {name} is defined twice")
        scope = self.instances[name.upper()] = self.scope = self.parts[part.upper()].copy(name)
        given = [line.floats() for line in word.data]
        if given:
            scope.move = np.array([*given[0], 0.0, 0.0, 0.0][:3])
        if len(given) > 1:
            axis = np.array(given[1][3:6]) - given[1][:3] if len(given[1]) == 7 else np.zeros(3)
            if not axis @ axis > 0.0:
                raise HpcdemError(f"{word.data[1].where}: expected a rotation as two points of its axis and an angle")
            scope.turn = _rotation(axis, given[1][6])
            # The axis stands where the translation has brought the part (Abaqus Keywords, *INSTANCE).
            scope.move = scope.turn @ (scope.move - given[1][:3]) + given[1][:3]

    def _nodes(self, word: Keyword) -> None:
        if word.parameters.get("SYSTEM", "R").upper() != "R":
            raise HpcdemError(f"{word.line.where}: cylindrical and spherical coordinates are not supported")
        nodes, here = self.scope.nodes, []
        for line in word.data:
            row = line.row()
            number = _whole(row[0], line)
            at = tuple([*(_number(text, line) if text else 0.0 for text in row[1:4]), 0.0, 0.0, 0.0][:3])
            if nodes.setdefault(number, at) != at:
                raise HpcdemError(f"{line.where}: node {number} is defined twice, at different positions")
            here.append(number)
        if word.parameters.get(NODES):
            self.scope.add(NODES, word.parameters[NODES], word, [Entry(np.array(here, np.int64), word.line)])

    def _elements(self, word: Keyword) -> None:
        label = word.get("TYPE").upper()
        kind, size = _kind(label)
        known = self.scope.seen
        rows: dict[int, list[int]] = {}
        here = []
        data = iter(word.data)
        for line in data:
            row, last = [text for text in line.row() if text], line
            while len(row) <= size if size else last.text.rstrip().endswith(","):
                more = next(data, None)  # the next line continues it
                if more is None:
                    break
                row, last = row + [text for text in more.row() if text], more
            number = _whole(row[0], line) if row else 0
            here.append(number)
            if not size:
                self.scope.others.add(number)
                self.kinds.setdefault(label, []).append(number)
                continue
            points = [_whole(text, line) for text in row[1:]]
            if len(points) != size:
                raise HpcdemError(f"{line.where}: element {number} has {len(points)} points, {label} has {size}")
            if known.setdefault(number, points) != points:
                raise HpcdemError(f"{line.where}: element {number} is defined twice, with different points")
            if known[number] is points:
                rows[number] = points
        if rows:
            self.scope.blocks.append((kind, label, rows))
        if word.parameters.get(ELEMENTS):
            self.scope.add(ELEMENTS, word.parameters[ELEMENTS], word, [Entry(np.array(here, np.int64), word.line)])

    def _set(self, word: Keyword) -> None:
        instance = word.parameters.get("INSTANCE", "")
        entries = []
        if word.name == NODES and word.parameters.get(ELEMENTS):
            entries.append(Entry(word.parameters[ELEMENTS], word.line, instance, nodes_of=True))
        for line in word.data:
            row = [text for text in line.row() if text]
            if "GENERATE" in word.parameters:
                first, last, step = ([_whole(text, line) for text in row] + [1])[:3] if len(row) > 1 else (0, 0, 0)
                if step < 1 or last < first:
                    raise HpcdemError(f"{line.where}: GENERATE needs a first and a last number, and a step above 0")
                entries.append(Entry(range(first, last + 1, step), line, instance))
            else:
                entries += [Entry(_number_or_name(text), line, instance) for text in row]
        self.scope.add(word.name, word.get(word.name), word, entries)

    def _surface(self, word: Keyword) -> None:
        name, kind = word.get("NAME"), word.parameters.get("TYPE", "ELEMENT").upper()
        if kind not in ("ELEMENT", "NODE") or {"COMBINE", "CROP"} & word.parameters.keys():
            self.notes.append(f"the surface {name}, made of others or given by formulas")
            return
        entries = []
        for line in word.data:
            row = [*line.row(), ""]
            if row[0]:
                entries.append(Entry(_number_or_name(row[0]), line, side=row[1].upper()))
            else:
                self.notes.append(f"of the surface {name} what lies on all of the outside")
        if kind == "NODE":
            self.scope.add(NODES, name, word, entries)
        else:
            self.scope.add(FACES, name, word, entries)

    # ---- all of it ---------------------------------------------------------------------------------------------

    def _whole(self) -> FileMesh:
        if not self.assembled:
            self.instances.update((name, part.copy(part.name)) for name, part in self.parts.items())
        scopes = [*self.instances.values(), self.root]
        made = self.made = FileMesh(self.path, np.empty((0, 3)), np.empty(0, np.int64), [], strict=False)
        points, ids, elements = [made.points], [made.point_ids], 0
        for scope in scopes:
            count = sum(map(len, points))
            made.parts.append((count, elements, f"{scope.name}" if len(scopes) > 2 else ""))
            rows = self.rows[scope.name] = {number: count + k for k, number in enumerate(scope.nodes)}
            points.append(np.array(list(scope.nodes.values()), np.float64).reshape(-1, 3) @ scope.turn.T + scope.move)
            ids.append(np.fromiter(scope.nodes, np.int64, len(scope.nodes)))
            numbers: dict[int, int] = {}
            self.numbers[scope.name] = numbers
            for kind, label, of in scope.blocks:
                lost = next(((n, p) for n, corners in of.items() for p in corners if p not in rows), None)
                if lost:
                    raise HpcdemError(
                        f"{self.path}: element {lost[0]} has the node {lost[1]}, which is not in the file"
                    )
                table = np.array([[rows[p] for p in corners] for corners in of.values()], np.int64)
                made.blocks.append(Block(kind, table, np.fromiter(of, np.int64, len(of)), label))
                numbers.update((number, elements + k) for k, number in enumerate(of))
                elements += len(of)
        made.points, made.point_ids = np.concatenate(points), np.concatenate(ids)
        if self.instances and self.assembled:
            unused = [p.name for key, p in self.parts.items() if p.blocks and key not in self.used]
            self.notes += [f"the part {name}, which has no instance" for name in unused]
        for kind, into in ((ELEMENTS, made.element_sets), (NODES, made.node_sets), (FACES, made.face_sets)):
            self._name_sets(scopes, kind, into)
        if len(self.instances) > 1:
            made.instances = {
                s.name: np.fromiter(self.numbers[s.name].values(), np.int64) for s in self.instances.values()
            }
        self._report()
        made.files = sorted(self.files)
        return made

    def _name_sets(self, scopes: list[Scope], kind: str, into: dict[str, Any]) -> None:
        """Sets of the assembly by their names; those of instances by theirs, of all instances together, and where
        several have one by INSTANCE.SET too."""
        holders: dict[str, list[Scope]] = {}
        for scope in scopes:
            for of, name in scope.sets:
                if of == kind and (of, name) not in scope.inner:
                    holders.setdefault(name, []).append(scope)
                elif of == kind:
                    self.dropped["sets that Abaqus/CAE has made for itself"] += 1
        apart: dict[str, Any] = {}
        for name, of_scopes in holders.items():
            title = of_scopes[-1].spelled[kind, name]  # the assembly comes last
            found = {scope.name: self._set_of(scope, kind, name) for scope in of_scopes}
            taken = [found[""]] if "" in found else list(found.values())
            into[title] = [rows for one in taken for rows in one] if kind == FACES else np.unique(np.concatenate(taken))
            if len(found) > 1:
                apart |= {f"{scope}.{title}": members for scope, members in found.items() if scope}
        into |= apart

    def _set_of(self, scope: Scope, kind: str, name: str) -> Any:
        title = scope.spelled[kind, name]
        if kind == FACES:
            return [rows for entry in scope.sets[FACES, name] for rows in self._faces(scope, entry, title)]
        lost: list[int] = []
        members = self._members(scope, kind, name, lost, ())
        if lost:
            what = "nodes" if kind == NODES else "elements"
            self.notes.append(f"{what} {listed(lost)} of the set {title}, which are not in the file")
        return members

    def _members(self, scope: Scope, kind: str, name: str, lost: list[int], above: tuple) -> np.ndarray:
        """Rows of points, or numbers of elements over all blocks, of a set; lost: what it names and nobody has."""
        out = [np.empty(0, np.int64)]
        if (scope.name, kind, name) in above:
            return out[0]
        above = (*above, (scope.name, kind, name))
        for entry in scope.sets[kind, name]:
            of_kind = ELEMENTS if entry.nodes_of else kind
            of, value = self._target(scope, entry)
            if isinstance(value, str):
                if (of_kind, value) not in of.sets:
                    raise HpcdemError(f"{entry.line.where}: unknown *{of_kind} '{entry.value}'")
                found = self._members(of, of_kind, value, lost, above)
            else:
                found = self._numbered(of, of_kind, value, lost)
            out.append(self._points_of(found) if entry.nodes_of else found)
        return np.unique(np.concatenate(out))

    def _target(self, scope: Scope, entry: Entry) -> tuple[Scope, np.ndarray | range | str]:
        """Resolve an entry: whose numbers, or whose set (in capitals), an entry names: `7`, `SET`, `INSTANCE.7`,
        `INSTANCE.SET`."""
        value = entry.value
        of = self._instance_named(entry.instance, entry) if entry.instance else scope
        if isinstance(value, str):
            first, dot, second = value.partition(".")
            if dot and first.upper() in self.instances:
                of, value = self.instances[first.upper()], _number_or_name(second)
        return of, value.upper() if isinstance(value, str) else value

    def _instance_named(self, name: str, entry: Entry) -> Scope:
        if name.upper() not in self.instances:
            raise HpcdemError(f"{entry.line.where}: unknown instance {name}")
        return self.instances[name.upper()]

    def _numbered(self, scope: Scope, kind: str, numbers: np.ndarray | range, lost: list[int]) -> np.ndarray:
        table = self.rows[scope.name] if kind == NODES else self.numbers[scope.name]
        if isinstance(numbers, range):  # it may have gaps, and be as long as it likes
            named = [n for n in table if n in numbers]
        else:
            named = numbers.tolist()
        lost += [n for n in named if n not in table and (kind == NODES or n not in scope.others)]
        return np.array([table[n] for n in named if n in table], np.int64)

    def _points_of(self, elements: np.ndarray) -> np.ndarray:
        rows = [block.rows[at].ravel() for block, at in self._by_block(elements)]
        return np.unique(np.concatenate(rows)) if rows else np.empty(0, np.int64)

    def _by_block(self, elements: np.ndarray) -> Iterator[tuple[Block, np.ndarray]]:
        """Elements by the block they are of, and their rows in it."""
        firsts = self.made.firsts
        of = np.searchsorted(firsts, elements, side="right") - 1
        for k in np.unique(of).tolist():
            yield self.made.blocks[k], elements[of == k] - firsts[k]

    def _faces(self, scope: Scope, entry: Entry, title: str) -> list[np.ndarray]:
        """Corners (n, 2 to 4) of the sides of elements that an entry of a surface names."""
        of, value = self._target(scope, entry)
        if isinstance(value, str):
            if (ELEMENTS, value) not in of.sets:
                raise HpcdemError(f"{entry.line.where}: unknown *ELSET '{entry.value}'")
            elements = self._members(of, ELEMENTS, value, [], ())
        else:
            elements = self._numbered(of, ELEMENTS, value, [])
        out = []
        for block, at in self._by_block(elements):
            sides = SIDES.get(block.kind, ())
            number = entry.side[1:]
            if entry.side in ("SPOS", "SNEG") and DIMENSIONS.get(block.kind) == 2 < self._dim():
                out.append(block.rows[at, : len(sides)])
            elif entry.side[:1] in ("S", "E") and number.isdigit() and 1 <= int(number) <= len(sides):
                out.append(block.rows[at][:, sides[int(number) - 1]])
            elif not entry.side and sides:
                out.append(self._outside(np.concatenate([block.rows[at][:, side] for side in sides])))
            else:
                self.notes.append(f"the sides {entry.side or 'on the outside'} of {block.label} in the surface {title}")
        return out

    def _dim(self) -> int:
        return max(DIMENSIONS.get(block.kind, 3) for block in self.made.blocks)

    def _outside(self, faces: np.ndarray) -> np.ndarray:
        """Select the element sides that belong to no other element."""
        if not hasattr(self, "sides"):
            dim = self._dim()
            self.sides = Counter(
                tuple(sorted(row))
                for block in self.made.blocks if DIMENSIONS.get(block.kind) == dim
                for side in SIDES.get(block.kind, ()) for row in block.rows[:, side].tolist()
            )  # fmt: skip
        return faces[[self.sides[tuple(sorted(row))] < 2 for row in faces.tolist()]]

    def _report(self) -> None:
        notes = self.made.notes
        for begins, what in (("CPS", "plane stress"), ("CAX", "rotational symmetry"), ("CGAX", "rotational symmetry")):
            labels = dict.fromkeys(block.label for block in self.made.blocks if block.label.startswith(begins))
            if labels and all(DIMENSIONS.get(block.kind) == 2 for block in self.made.blocks):
                also = "unless model plane-stress is set" if begins == "CPS" else "or in plane stress"
                notes.append(f"the {what} of {', '.join(labels)}: blocks of the plane are in plane strain {also}")
        for label, numbers in self.kinds.items():
            notes.append(f"{len(numbers)} elements of type {label} ({listed(numbers)})")
        notes += dict.fromkeys(self.notes)
        if self.dropped:
            notes.append(", ".join(name + (f" ({n} times)" if n > 1 else "") for name, n in self.dropped.items()))


def _keywords(path: Path, files: set[Path]) -> Iterator[Keyword]:
    """The keywords with their data, those of files that are included in their place; files: gets what is read."""
    word: Keyword | None = None
    for piece in _pieces(path, files, 0):
        if isinstance(piece, Keyword):
            if word is not None:
                yield word
            word = piece
        elif word is None:
            raise HpcdemError(f"{piece.where}: a line of data without a keyword: {piece.text.strip()[:40]!r}")
        else:
            word.data.append(piece)
    if word is not None:
        yield word


def _pieces(path: Path, files: set[Path], depth: int) -> Iterator[Keyword | Line]:
    """Keywords and lines of data, one after the other: a file may be included between two lines of data too."""
    files.add(path)
    head: tuple[Line, str] | None = None
    for line in _lines(path, str(path)):
        given = line.text.strip()
        if not given or given.startswith("**"):
            continue
        if head is not None:
            head = head[0], head[1] + given
        elif given.startswith("*"):
            head = line, given
        else:
            yield line
        if head is not None and not head[1].endswith(","):
            yield from _with_files(_keyword(*head), files, depth)
            head = None
    if head is not None:
        yield from _with_files(_keyword(*head), files, depth)


def _lines(path: Path, where: str) -> list[Line]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise HpcdemError(f"{where}: {path} cannot be read ({error.strerror})") from None
    return [Line(path, number, raw) for number, raw in enumerate(lines(content), 1)]


def _keyword(line: Line, text: str) -> Keyword:
    name, *given = (piece.strip() for piece in text[1:].split(","))
    parameters = {}
    for piece in given:
        key, _, value = piece.partition("=")
        parameters["".join(key.upper().split())] = value.strip().strip("\"'")
    return Keyword("".join(name.upper().split()), parameters, line)


def _with_files(word: Keyword, files: set[Path], depth: int) -> Iterator[Keyword | Line]:
    """The keyword, with the lines of a file that it takes its data from; *INCLUDE: what is in the file."""
    where = word.line.where
    if depth == DEEPEST:
        raise HpcdemError(f"{where}: more than {DEEPEST} nested files")
    if word.name == "INCLUDE":
        file = word.line.file.parent / word.get("INPUT")
        if not file.is_file():
            raise HpcdemError(f"{where}: file {file} not found")
        yield from _pieces(file, files, depth + 1)
        return
    yield word
    if word.name in ("NODE", "ELEMENT", NODES, ELEMENTS) and word.parameters.get("INPUT"):
        file = word.line.file.parent / word.parameters["INPUT"]
        files.add(file)
        for line in _lines(file, where):
            if line.text.strip() and not line.text.lstrip().startswith("*"):
                yield line


def _kind(label: str) -> tuple[str, int]:
    """Kind and number of points of a type of elements; "", 0 for one that is left out."""
    for pattern, dim in ((PLANE, 2), (SOLID, 3)):
        found = pattern.match(label)
        if found and int(found[1]) in KINDS[dim]:
            size = int(found[1])
            return KINDS[dim][size], 6 if size == 65 else size
    return "", 0


def _number(text: str, line: Line) -> float:
    try:
        value = float(text if "d" not in text and "D" not in text else text.upper().replace("D", "E"))
    except ValueError:
        raise HpcdemError(f"{line.where}: expected a number, not {text[:40]!r}") from None
    if not math.isfinite(value):
        raise HpcdemError(f"{line.where}: expected a finite number, not {text[:40]}")
    return value


def _whole(text: str, line: Line) -> int:
    value = int(text) if text.isdecimal() else _number(text, line)
    if not abs(value) < LARGEST:
        raise HpcdemError(f"{line.where}: {text[:40]} is too large for the number of a node or an element")
    if value != int(value):
        raise HpcdemError(f"{line.where}: expected a whole number, not {text[:40]}")
    return int(value)


def _number_or_name(text: str) -> np.ndarray | str:
    return np.array([int(text)]) if re.fullmatch(r"\d+", text) else re.sub("[\"']", "", text)


def _rotation(axis: np.ndarray, degrees: float) -> np.ndarray:
    """(3, 3) of a turn about an axis, right-handed (Rodrigues)."""
    x, y, z = axis / math.sqrt(axis @ axis)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = math.radians(degrees)
    return np.asarray(np.eye(3) + math.sin(turn) * across + (1.0 - math.cos(turn)) * across @ across)
