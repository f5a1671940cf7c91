"""The frame: one output time of the model, as every writer gets it.

Each rank holds a contiguous slab of every table in one global order (particles by gid, contacts by the pair of
gids), so that files do not depend on the rank count. Walls are few and known to all ranks.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hpcdem.core.comm import Comm


class Columns(Mapping[str, np.ndarray]):
    """Columns by name, each read on first use and kept.

    readers: from rows to their values; most: bytes that are kept, beyond which columns that were not used recently
    are read again when they are wanted."""

    def __init__(self, readers: Mapping[str, Callable[[slice], np.ndarray]], most: float = math.inf) -> None:
        self._readers, self._read, self._most = dict(readers), OrderedDict[str, np.ndarray](), most

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._read:
            self._read[name] = self._readers[name](slice(None))
        self._read.move_to_end(name)
        while self.size > self._most and len(self._read) > 1:
            self._read.popitem(last=False)
        return self._read[name]

    def part(self, name: str, rows: slice) -> np.ndarray:
        """Some rows of a column, read for this once if the column is not there."""
        return self._read[name][rows] if name in self._read else self._readers[name](rows)

    def __contains__(self, name: object) -> bool:
        return name in self._readers

    def __iter__(self) -> Iterator[str]:
        return iter(self._readers)

    def __len__(self) -> int:
        return len(self._readers)

    def was_read(self, name: str) -> bool:
        """Return whether a column was used before."""
        return name in self._read

    @property
    def size(self) -> int:
        """Bytes that have been read."""
        return sum(values.nbytes for values in self._read.values())


def part(columns: Mapping[str, np.ndarray], name: str, rows: slice) -> np.ndarray:
    """Some rows of one of these columns; of a file only they are read."""
    return columns.part(name, rows) if isinstance(columns, Columns) else columns[name][rows]


@dataclass
class Table:
    """Hold this rank's rows ``offset : offset + len`` of a table of `total` rows; columns are 1-d arrays by name."""

    columns: dict[str, np.ndarray]
    offset: int = 0
    total: int = 0

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0


@dataclass
class Frame:
    """Everything that is written at one output time.

    tables: "particles", "contacts", "bonds", "wall_contacts"; walls: columns of the wall table (BOX walls first,
    ids fields.BOX_IDS, in this order); settings: left, right, bottom, height, gx, gy, disk, frac, lsm, units where the
    model declared others than SI, and period [m], the length of a periodic model. SI units throughout.
    """

    step: int
    time: float
    dt: float
    settings: dict[str, float | str]
    walls: dict[str, np.ndarray]
    tables: dict[str, Table]
    group_names: list[str] = field(default_factory=list)

    def shortest(self, x: np.ndarray) -> np.ndarray:
        """Return differences of x [m] between neighbours: across periodic sides the distance is the short one."""
        period = float(self.settings.get("period", 0.0))
        return x - period * np.rint(x / period) if period else x


def whole(frame: Frame, comm: Comm) -> Frame | None:
    """Collective: the frame with all rows on rank 0, None elsewhere."""
    parts = comm.gather({name: table.columns for name, table in frame.tables.items()})
    if parts is None:
        return None
    tables = {
        name: Table({key: np.concatenate([part[name][key] for part in parts]) for key in table.columns}, 0, table.total)
        for name, table in frame.tables.items()
    }
    return replace(frame, tables=tables)
