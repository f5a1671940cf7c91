"""Mesh files of Gmsh, formats 2.0 to 2.2 and 4.1, text and binary (Gmsh Reference Manual, MSH file format).

An element that format 2 writes once for each of its physical groups is one element of several groups. Parameters of
points on curves and surfaces are skipped.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh.file_mesh import DIMENSIONS, Block, FileMesh, lines

_TYPES: dict[str, dict[int, int]] = {
    "line": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6},
    "triangle": {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21},
    "quad": {3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20},
    "tetra": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56},
    "hexahedron": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125},
    "wedge": {6: 6, 13: 18, 18: 15},
    "pyramid": {7: 5, 14: 14, 19: 13},
    "vertex": {15: 1},
}
TYPES = {number: (kind, points) for kind, of in _TYPES.items() for number, points in of.items()}
"""Kind and number of points by the number that Gmsh gives to a type of elements; corners precede the others."""
READ = {"MeshFormat", "PhysicalNames", "Nodes", "ParametricNodes", "Elements", "Entities", "PartitionedEntities"}
PASSED_OVER = {"Comments"}
LINES_AT_ONCE = 4096
"""Lines that are read at once."""


class _Text:
    """Values of a section one after the other."""

    def __init__(self, section: bytes) -> None:
        words = section.split()
        self.values = np.array(words).astype(np.float64) if words else np.empty(0)
        self.at = 0

    def floats(self, n: int) -> np.ndarray:
        """The next n."""
        if n < 0 or self.at + n > len(self.values):
            raise EOFError
        self.at += n
        return self.values[self.at - n : self.at]

    def ints(self, n: int) -> np.ndarray:
        """The next n."""
        return _whole(self.floats(n))

    sizes = ints

    def records(self, n: int, ints: int, floats: int, kind: str = "i4") -> tuple[np.ndarray, np.ndarray]:
        """(n, ints), (n, floats) of n records."""
        both = self.floats(n * (ints + floats)).reshape(n, ints + floats)
        return _whole(both[:, :ints]), both[:, ints:]


def _whole(values: np.ndarray) -> np.ndarray:
    """Convert floats to integers. Raises ValueError for fractions and for magnitudes of 2**53 or more, which are not
    exact."""
    if not (np.abs(values) < 2.0**53).all() or (values != np.rint(values)).any():
        raise ValueError
    return values.astype(np.int64)


class _Binary:
    """Reader of a binary section; order: of its bytes."""

    def __init__(self, section: bytes, order: Literal["<", ">"]) -> None:
        self.section, self.order, self.at = section, order, 0

    def _next(self, kind: str | list, n: int) -> np.ndarray:
        dtype = np.dtype(kind).newbyteorder(self.order)
        if n < 0 or self.at + n * dtype.itemsize > len(self.section):
            raise EOFError
        found = np.frombuffer(self.section, dtype, n, self.at)
        self.at += n * dtype.itemsize
        return found

    def floats(self, n: int) -> np.ndarray:
        """The next n."""
        return self._next("f8", n).astype(np.float64)

    def ints(self, n: int) -> np.ndarray:
        """The next n."""
        return self._next("i4", n).astype(np.int64)

    def sizes(self, n: int) -> np.ndarray:
        """The next n."""
        return self._next("u8", n).astype(np.int64)

    def records(self, n: int, ints: int, floats: int, kind: str = "i4") -> tuple[np.ndarray, np.ndarray]:
        """(n, ints), (n, floats) of n records."""
        found = self._next([("i", kind, (ints,)), ("f", "f8", (floats,))], n)
        return found["i"].astype(np.int64), found["f"].astype(np.float64)


def read(path: Path) -> FileMesh:
    """Read a mesh file of Gmsh. Raises HpcdemError with the section for anything that cannot be used."""
    return _Reader(path).read()


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.names: dict[tuple[int, int], str] = {}
        self.physical: dict[tuple[int, int], list[int]] = {}
        self.points: list[np.ndarray] = []
        self.ids: list[np.ndarray] = []
        self.blocks: list[tuple[str, str, np.ndarray, np.ndarray]] = []
        self.groups: dict[tuple[int, int], list[np.ndarray]] = defaultdict(list)
        self.count = 0

    def read(self) -> FileMesh:
        content = self.path.read_bytes()
        sections = self._sections(content)
        head = sections.get("MeshFormat", b"").split(maxsplit=3)
        try:
            self.version, binary = float(head[0]), int(head[1])
        except (ValueError, IndexError):
            raise HpcdemError(f"{self.path}: not a mesh file of Gmsh: $MeshFormat is missing") from None
        if not (2.0 <= self.version < 3.0 or 4.1 <= self.version < 5.0):
            raise HpcdemError(
                f"{self.path}: format {self.version:g} of Gmsh is not supported: save it as 4.1 or 2.2 "
                "(Mesh.MshFileVersion)"
            )
        little = sections["MeshFormat"].rstrip(b"\n\r")[-4:] == b"\x01\0\0\0"
        for name in ("Nodes", "Elements"):
            if name not in sections and not (name == "Nodes" and "ParametricNodes" in sections):
                raise HpcdemError(f"{self.path}: ${name} is missing or incomplete")
        self._names(sections.get("PhysicalNames", b""))
        taken: tuple[tuple[str, Callable[[Any, int], None]], ...] = (
            ("Entities", self._entities),
            ("PartitionedEntities", self._partitioned),
            ("Nodes", self._nodes_4 if self.version > 4.0 else self._nodes_2),
            ("ParametricNodes", self._parametric),
            ("Elements", self._elements_4 if self.version > 4.0 else self._elements_2),
        )
        for name, take in taken:
            if name not in sections:
                continue
            if binary and name == "ParametricNodes":
                raise HpcdemError(
                    f"{self.path}: binary $ParametricNodes are not supported: save as text, or as format 4.1"
                )
            section = sections[name]
            try:
                if binary:
                    count, _, rest = section.partition(b"\n") if self.version < 3.0 else (b"", b"", section)
                    take(_Binary(rest, "<" if little else ">"), int(count or 0))
                else:
                    text = _Text(section)
                    take(text, int(text.ints(1)[0]) if self.version < 3.0 else 0)
                    if text.at < len(text.values):
                        raise HpcdemError(f"{self.path}: ${name} has more lines than its header declares")
            except (EOFError, ValueError, IndexError, MemoryError):
                raise HpcdemError(
                    f"{self.path}: ${name} ends too early, or contains something that is not a number"
                ) from None
        made = self._made()
        lost = [name for name in sections if name not in READ | PASSED_OVER]
        made.notes += [f"the sections {', '.join('$' + name for name in lost)}"] if lost else []
        return made

    def _sections(self, content: bytes) -> dict[str, bytes]:
        """Split the file into the contents between $Name and $EndName, by name."""
        out: dict[str, bytes] = {}
        at = 0
        while True:
            found = re.compile(rb"\$([A-Za-z]\w*)[ \t]*\r?\n").search(content, at)
            if found is None:
                return out
            name = found[1].decode("ascii")
            end = re.compile(rb"\$End" + found[1] + rb"\b").search(content, found.end())
            if end is None:
                raise HpcdemError(f"{self.path}: the file ends within ${name}: $End{name} is missing")
            out[name] = content[found.end() : end.start()]
            at = end.end()

    def _names(self, section: bytes) -> None:
        for line in lines(section)[1:]:
            found = re.match(r'\s*(\d+)\s+(-?\d+)\s+"(.*)"', line)
            if found:
                self.names[int(found[1]), abs(int(found[2]))] = found[3]

    # ---- format 4.1 --------------------------------------------------------------------------------------------

    def _entities(self, given: _Text | _Binary, _: int) -> None:
        for dim, n in enumerate(given.sizes(4).tolist()):
            for _ in range(n):
                self._entity(given, dim, int(given.ints(1)[0]))

    def _entity(self, given: _Text | _Binary, dim: int, tag: int) -> None:
        given.floats(3 if dim == 0 else 6)
        self.physical[dim, tag] = sorted({abs(t) for t in given.ints(int(given.sizes(1)[0])).tolist()})
        if dim:
            given.ints(int(given.sizes(1)[0]))

    def _partitioned(self, given: _Text | _Binary, _: int) -> None:
        given.sizes(1)
        given.ints(2 * int(given.sizes(1)[0]))
        for dim, n in enumerate(given.sizes(4).tolist()):
            for _ in range(n):
                tag = int(given.ints(3)[0])
                given.ints(int(given.sizes(1)[0]))
                self._entity(given, dim, tag)

    def _nodes_4(self, given: _Text | _Binary, _: int) -> None:
        blocks = int(given.sizes(4)[0])
        for _ in range(blocks):
            dim, _, parametric = given.ints(3).tolist()
            n = int(given.sizes(1)[0])
            self.ids.append(given.sizes(n))
            width = 3 + (dim if parametric else 0)
            self.points.append(given.floats(n * width).reshape(n, width)[:, :3])

    def _elements_4(self, given: _Text | _Binary, _: int) -> None:
        blocks = int(given.sizes(4)[0])
        for _ in range(blocks):
            dim, tag, kind = given.ints(3).tolist()
            n = int(given.sizes(1)[0])
            rows = given.sizes(n * (1 + self._type(kind)[1])).reshape(n, -1)
            for group in self.physical.get((dim, tag), []):
                self.groups[dim, group].append(self.count + np.arange(n))
            self._block(kind, rows[:, 0], rows[:, 1:])

    # ---- format 2 ----------------------------------------------------------------------------------------------

    def _nodes_2(self, given: _Text | _Binary, n: int) -> None:
        ids, points = given.records(n, 1, 3)
        self.ids.append(ids[:, 0])
        self.points.append(points)

    def _parametric(self, given: _Text | _Binary, n: int) -> None:
        for _ in range(n):
            self.ids.append(given.ints(1))
            self.points.append(given.floats(3)[None])
            dim, _ = given.ints(2).tolist()
            given.floats(dim if dim < 3 else 0)

    def _elements_2(self, given: _Text | _Binary, n: int) -> None:
        tables: dict[int, list[np.ndarray]] = defaultdict(list)  # by type: place, number, group, entity, points
        done = 0
        while done < n:
            if isinstance(given, _Text):
                kind, n_tags, table = self._run(given, n - done)
            else:
                kind, follow, n_tags = given.ints(3).tolist()
                table = given.ints(follow * (1 + n_tags + self._type(kind)[1])).reshape(follow, -1)
            tags = np.zeros((len(table), 2), np.int64)
            tags[:, : min(n_tags, 2)] = table[:, 1 : 1 + min(n_tags, 2)]
            place = np.arange(done, done + len(table))
            tables[kind].append(
                np.column_stack([place, table[:, 0], np.abs(tags[:, 0]), tags[:, 1], table[:, 1 + n_tags :]])
            )
            done += len(table)
        whole = {kind: np.concatenate(parts) for kind, parts in tables.items()}
        same = np.arange(done)  # the place of the element that a line is of
        of_kind = np.zeros(done, np.int64)
        for kind, table in whole.items():
            _, first, back = np.unique(table[:, 3:], axis=0, return_index=True, return_inverse=True)
            lead = np.column_stack([table[first[back.reshape(-1)], 0], table[:, 2]])
            once = np.unique(lead, axis=0, return_index=True)[1]  # twice in one group it is another element
            same[table[once, 0]] = lead[once, 0]
            of_kind[table[:, 0]] = kind
        kept = same == np.arange(done)
        element = (self.count + np.cumsum(kept) - 1)[same]
        for kind, table in whole.items():
            for group in np.unique(table[:, 2]).tolist():
                if group:
                    self.groups[_dim(kind), group].append(element[table[table[:, 2] == group, 0]])
        places = np.flatnonzero(kept)
        for run in np.split(places, np.flatnonzero(np.diff(of_kind[places])) + 1):
            if len(run):
                table = whole[int(of_kind[run[0]])]
                rows = table[np.searchsorted(table[:, 0], run)]
                self._block(int(of_kind[run[0]]), rows[:, 1], rows[:, 4:])

    def _run(self, given: _Text, most: int) -> tuple[int, int, np.ndarray]:
        """Type and number of tags of the next lines that have the same, and these (k, number, tags and points)."""
        kind, n_tags = given.ints(3)[1:].tolist()
        given.at -= 3
        width = 3 + n_tags + self._type(kind)[1]
        most = min(most, LINES_AT_ONCE, (len(given.values) - given.at) // width)
        table = given.ints(max(most, 1) * width).reshape(-1, width)
        other = np.flatnonzero((table[:, 1] != kind) | (table[:, 2] != n_tags))
        k = int(other[0]) if len(other) else len(table)
        given.at -= (len(table) - k) * width
        return kind, n_tags, table[:k, [0, *range(3, width)]]

    # ---- both --------------------------------------------------------------------------------------------------

    def _type(self, kind: int) -> tuple[str, int]:
        if kind not in TYPES:
            raise HpcdemError(f"{self.path}: elements of Gmsh's type {kind} are not supported")
        return TYPES[kind]

    def _block(self, kind: int, ids: np.ndarray | list, rows: np.ndarray | list) -> None:
        if len(ids):
            name, size = self._type(kind)
            self.blocks.append((name, f"{name} of {size} points", np.array(ids, np.int64), np.array(rows, np.int64)))
            self.count += len(ids)

    def _made(self) -> FileMesh:
        ids = np.concatenate(self.ids) if self.ids else np.empty(0, np.int64)
        points = np.concatenate(self.points) if self.points else np.empty((0, 3))
        order = np.argsort(ids, kind="stable")
        twice = np.flatnonzero(np.diff(ids[order]) == 0)
        if len(twice):
            raise HpcdemError(f"{self.path}: point {ids[order[twice[0]]]} is defined twice")
        blocks = []
        for kind, label, numbers, named in self.blocks:
            at = np.minimum(np.searchsorted(ids[order], named), max(len(ids) - 1, 0))
            lost = np.argwhere(ids[order][at] != named) if len(ids) else np.zeros((1, 2), np.int64)
            if len(lost):
                raise HpcdemError(
                    f"{self.path}: element {numbers[lost[0][0]]} names point {named[tuple(lost[0])]}, which is not in "
                    "the file"
                )
            blocks.append(Block(kind, order[at], numbers, label))
        made = FileMesh(self.path, points, ids, blocks)
        for (dim, tag), parts in self.groups.items():
            name = self.names.get((dim, tag), str(tag))
            made.element_sets[name] = np.concatenate([made.element_sets.get(name, np.empty(0, np.int64)), *parts])
        lost_names = [name for (dim, tag), name in self.names.items() if (dim, tag) not in self.groups]
        if lost_names:
            made.notes.append("physical groups without an element: " + ", ".join(f"'{n}'" for n in lost_names))
        return made


def _dim(kind: int) -> int:
    return DIMENSIONS.get(TYPES[kind][0], 3)
