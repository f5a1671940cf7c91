"""Whole tables of numbers as text, fast: fixed-width rows formatted into one byte buffer by compiled kernels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.io.layout import FIXED as FIXED
from hpcdem.io.layout import INT as INT
from hpcdem.io.layout import MAX_DIGITS
from hpcdem.io.layout import SCI as SCI
from hpcdem.io.layout import WORD as WORD


@dataclass(frozen=True)
class Column:
    """Layout of one column, right-aligned in `width` characters (at least one blank in front).

    kind SCI: scientific notation with `digits` significant digits (at most 15);
    INT: an integer; FIXED: `digits` decimals, for numbers below 1e9 in size; WORD: index into a list of words.
    """

    name: str
    kind: int
    width: int
    digits: int = 0


def sci(name: str, digits: int = 9, width: int = 0) -> Column:
    """A float column wide enough for sign, point and a three-digit exponent."""
    return Column(name, SCI, max(width, digits + 8), digits)


_BLOCK = 1 << 18
"""Bytes of text made at a time, which remain in the cache while the columns are filled."""


class TextTable:
    """The rows of a table as text, made piece by piece: `rows` rows of `width` bytes each, ending in a newline.

    columns: pairs of a Column and its 1-d array (for WORD: indices into `words`). Raises ValueError if a number or
    word does not fit its column.
    """

    def __init__(self, columns: Sequence[tuple[Column, np.ndarray]], words: Sequence[str] = ()) -> None:
        self.rows = len(columns[0][1])
        self.columns = [(c, np.asarray(v)) for c, v in columns]
        self.width = sum(c.width for c, _ in columns) + 1
        encoded = [w.encode() for w in words] or [b""]
        self._lengths = np.array([len(w) for w in encoded], dtype=np.int64)
        self._letters = np.zeros((len(encoded), max(1, int(self._lengths.max()))), dtype=np.uint8)
        for i, w in enumerate(encoded):
            self._letters[i, : len(w)] = np.frombuffer(w, dtype=np.uint8)
        self._floats = [v for c, v in self.columns if c.kind in (SCI, FIXED)]
        self._ints = [v for c, v in self.columns if c.kind in (INT, WORD)]
        self._plan = np.zeros((len(columns), 4), dtype=np.int64)
        counts = [0, 0]
        for k, (column, values) in enumerate(self.columns):
            whole = int(column.kind in (INT, WORD))
            self._plan[k] = column.kind, counts[whole], column.width, column.digits
            counts[whole] += 1
            self._check(column, values, len(words))

    def _check(self, column: Column, values: np.ndarray, n_words: int) -> None:
        if len(values) != self.rows:
            raise ValueError(f"column {column.name}: {len(values)} values for {self.rows} rows")
        needed = {SCI: column.digits + 7, FIXED: column.digits + 3, INT: 1, WORD: int(self._lengths.max())}[column.kind]
        if column.kind == SCI and not 1 <= column.digits <= MAX_DIGITS:
            raise ValueError(f"column {column.name}: {column.digits} digits requested, expected 1 to {MAX_DIGITS}")
        if self.rows and column.kind == FIXED:
            largest = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
            needed += len(f"{min(largest, 1e9):.{column.digits}f}".split(".")[0]) - 1
        if self.rows and column.kind == INT:
            needed = max(len(str(values.max())), len(str(values.min())))
        if self.rows and column.kind == WORD and not (0 <= values.min() and values.max() < n_words):
            raise ValueError(f"column {column.name}: an index without a name")
        if needed > column.width:
            raise ValueError(f"column {column.name}: {needed} characters do not fit a width of {column.width}")

    def write_rows(self, first: int, count: int, out: np.ndarray) -> None:
        """Rows first : first + count as text into out (count * width,) u1."""
        from hpcdem.io import digits as kernels  # after their cache is settled (runtime/kernels.py)

        step = max(1, _BLOCK // self.width)
        floats = np.empty((len(self._floats), min(step, count)))
        ints = np.empty((len(self._ints), min(step, count)), dtype=np.int64)
        for a in range(first, first + count, step):
            n = min(step, first + count - a)
            for target, source in ((floats, self._floats), (ints, self._ints)):
                for k, values in enumerate(source):
                    target[k, :n] = values[a : a + n]
            field = out[(a - first) * self.width : (a - first + n) * self.width]
            kernels.fill(self._plan, floats, ints, self._letters, self._lengths, n, field)

    def blocks(self, size: int = 4 * _BLOCK) -> Iterator[np.ndarray]:
        """The text in uint8 arrays of about `size` bytes; each is valid until the next is requested."""
        step = max(1, size // self.width)
        out = np.empty(min(step, self.rows) * self.width, dtype=np.uint8)
        for a in range(0, self.rows, step):
            n = min(step, self.rows - a)
            self.write_rows(a, n, out)
            yield out[: n * self.width]


def format_table(columns: Sequence[tuple[Column, np.ndarray]], words: Sequence[str] = ()) -> bytes:
    """Return all rows of a table as text; see TextTable."""
    return b"".join(block.tobytes() for block in TextTable(columns, words).blocks())


def format_floats(values: np.ndarray, digits: int) -> list[str]:
    """Each value like ``%.<digits-1>e`` (for headers and tests)."""
    return format_table([(sci("value", digits), np.asarray(values, dtype=np.float64))]).decode().split()


def warm_up() -> None:
    """Compile the kernel, or load it from the cache."""
    format_floats(np.zeros(1), 3)
