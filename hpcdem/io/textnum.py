"""Whole tables of numbers as text, fast: fixed-width rows formatted into one byte buffer by a compiled kernel.

Floats are written like C's ``%.<n>e``, correctly rounded: the number is multiplied or divided by a power of ten in
double-double arithmetic (error-free products of Dekker 1971, Numerische Mathematik 18, 224-242), so the result can
differ from the exact one, by one unit of the last place, only when the value lies within about 1e-16 of such a unit
from the middle between two neighbours without being that middle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

SCI, INT, FIXED, WORD = range(4)
MAX_DIGITS = 15
_BLANK, _NEWLINE, _MINUS, _POINT, _ZERO, _E, _PLUS = 32, 10, 45, 46, 48, 101, 43


@dataclass(frozen=True)
class Column:
    """How one column is written, right-aligned in `width` characters (at least one blank in front).

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


def _powers() -> tuple[np.ndarray, np.ndarray]:
    """10**k, k = 0..308, as a sum of two float64 each."""
    high = np.array([float(10**k) for k in range(309)])
    low = np.array([float(10**k - int(h)) for k, h in enumerate(high)])
    return high, low


_HIGH, _LOW = _powers()
# The numbers 0000 to 9999 as text.
_DIGITS = (_ZERO + np.arange(10000)[:, None] // np.array([1000, 100, 10, 1]) % 10).astype(np.uint8)
_LIMITS = np.array([10**k for k in range(19)], dtype=np.int64)


@njit(cache=True, nogil=True, error_model="numpy")
def _product(a: float, b: float) -> tuple[float, float]:
    """a * b as an exact sum of two float64 (Dekker; no fused multiply-add needed)."""
    p = a * b
    t = 134217729.0 * a
    a1 = t - (t - a)
    a2 = a - a1
    t = 134217729.0 * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


@njit(cache=True, nogil=True, error_model="numpy")
def _scaled(a: float, p: int) -> tuple[float, float]:
    """a * 10**p for a > 0 as the sum of two float64; the result must be of a size between 1 and 1e17."""
    if p < 0:
        ten, rest = _HIGH[-p], _LOW[-p]
        if a > 1e270:  # keep the splitting in _product from overflowing
            a, ten, rest = a * 2.0**-200, ten * 2.0**-200, rest * 2.0**-200
        h = a / ten
        q, e = _product(h, ten)
        return h, ((a - q) - e - h * rest) / ten
    back, low = 1.0, 0.0
    if p > 260:  # a is tiny, perhaps denormal: leave the bottom of the range by exact steps
        back = 2.0**-200
        a, low = _product(a * 2.0**200, 1e22)
        a, e = _product(a, 1e22)
        low = low * 1e22 + e
        p -= 44
    h, e = _product(a, _HIGH[p])
    return h * back, (e + a * _LOW[p] + low * _HIGH[p]) * back


@njit(cache=True, nogil=True, error_model="numpy")
def _round(h: float, low: float) -> np.int64:
    """h + low rounded to the nearest integer, halves to even."""
    n = math.floor(h)
    m = np.int64(n)
    over = ((h - n) - 0.5) + low  # h - n is exact, and so is the first difference where it matters
    return m + np.int64((over > 0.0) | ((over == 0.0) & (m & 1 == 1)))


@njit(cache=True, nogil=True, error_model="numpy")
def _put_digits(out: np.ndarray, end: int, n: int | np.int64, count: int) -> np.int64:
    """Write the last `count` digits of n >= 0 so that they end before `end`; returns the digits left over."""
    m = np.uint64(n)  # unsigned: division by a constant becomes one multiplication
    while count >= 4:
        q = m // np.uint64(10000)
        r = m - q * np.uint64(10000)
        out[end - 4] = _DIGITS[r, 0]
        out[end - 3] = _DIGITS[r, 1]
        out[end - 2] = _DIGITS[r, 2]
        out[end - 1] = _DIGITS[r, 3]
        m = q
        end -= 4
        count -= 4
    while count:
        q = m // np.uint64(10)
        out[end - 1] = _DIGITS[m - q * np.uint64(10), 3]
        m = q
        end -= 1
        count -= 1
    return np.int64(m)


@njit(cache=True, nogil=True, error_model="numpy")
def _put_int(out: np.ndarray, end: int, n: int | np.int64) -> int:
    negative = n < 0
    if negative:
        n = -n
    count = 1
    while count < 19 and n >= _LIMITS[count]:
        count += 1
    _put_digits(out, end, n, count)
    end -= count
    if negative:
        end -= 1
        out[end] = _MINUS
    return end


@njit(cache=True, nogil=True, error_model="numpy")
def _put_special(out: np.ndarray, end: int, v: float) -> None:
    """nan, inf or -inf."""
    if v != v:
        out[end - 3], out[end - 2], out[end - 1] = 110, 97, 110
    else:
        out[end - 3], out[end - 2], out[end - 1] = 105, 110, 102
        if v < 0:
            out[end - 4] = _MINUS


@njit(cache=True, nogil=True, error_model="numpy")
def _put_sci(out: np.ndarray, end: int, v: float, digits: int) -> None:
    """Write v like ``%.<digits-1>e`` so that it ends before `end`."""
    if v != v or math.isinf(v):
        _put_special(out, end, v)
        return
    a = abs(v)
    n = np.int64(0)
    e10 = 0
    if a > 0.0:
        m, e2 = math.frexp(a)
        e10 = math.floor((e2 + 2.0 * m - 2.0) * 0.30102999566398120)  # log2 x >= x - 1: right, or one too small
        h, low = _scaled(a, digits - 1 - e10)
        if h >= _HIGH[digits]:
            e10 += 1
            h, low = _scaled(a, digits - 1 - e10)
        n = _round(h, low)
        if n >= _LIMITS[digits]:
            n = _LIMITS[digits - 1]
            e10 += 1
    x = abs(e10)
    out[end - 1] = _DIGITS[x, 3]
    out[end - 2] = _DIGITS[x, 2]
    if x > 99:
        out[end - 3] = _DIGITS[x, 1]
        end -= 1
    end -= 4
    out[end + 1] = _MINUS if e10 < 0 else _PLUS
    out[end] = _E
    lead = _put_digits(out, end, n, digits - 1)
    end -= digits - 1
    if digits > 1:
        end -= 1
        out[end] = _POINT
    end -= 1
    out[end] = _ZERO + lead
    out[end - 1] = _MINUS if math.copysign(1.0, v) < 0 else _BLANK


@njit(cache=True, nogil=True, error_model="numpy")
def _put_fixed(out: np.ndarray, end: int, v: float, decimals: int) -> None:
    """Write v with a fixed number of decimals (rounded in float64, which may be one unit off at a tie)."""
    if not abs(v) < 1e9:
        if v != v or math.isinf(v):
            _put_special(out, end, v)
        else:
            _put_sci(out, end, v, 1)
        return
    n = np.int64(math.floor(abs(v) * _HIGH[decimals] + 0.5))
    if decimals:
        _put_digits(out, end, n, decimals)
        end -= decimals + 1
        out[end] = _POINT
    end = _put_int(out, end, n // _LIMITS[decimals])
    if v < 0 and n > 0:
        out[end - 1] = _MINUS


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(
    plan: np.ndarray,
    floats: np.ndarray,
    ints: np.ndarray,
    words: np.ndarray,
    lengths: np.ndarray,
    n: int,
    out: np.ndarray,
) -> None:
    """Write the first n rows into out; plan (columns, 4): kind, source row, width, digits."""
    row = 1
    for c in range(len(plan)):
        row += plan[c, 2]
    for i in range(n):
        end = i * row
        out[end : end + row] = _BLANK
        for c in range(len(plan)):
            kind, source, width, digits = plan[c, 0], plan[c, 1], plan[c, 2], plan[c, 3]
            end += width
            if kind == SCI:
                _put_sci(out, end, floats[source, i], digits)
            elif kind == FIXED:
                _put_fixed(out, end, floats[source, i], digits)
            elif kind == INT:
                _put_int(out, end, ints[source, i])
            else:
                w = ints[source, i]
                for k in range(lengths[w]):
                    out[end - lengths[w] + k] = words[w, k]
        out[end] = _NEWLINE


class TextTable:
    """The rows of a table as text, made in blocks: `rows` rows of `width` bytes each, ending in a newline.

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
            raise ValueError(f"column {column.name}: {column.digits} digits asked for, 1 to {MAX_DIGITS} are possible")
        if self.rows and column.kind == FIXED:
            largest = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
            needed += len(f"{min(largest, 1e9):.{column.digits}f}".split(".")[0]) - 1
        if self.rows and column.kind == INT:
            needed = max(len(str(values.max())), len(str(values.min())))
        if self.rows and column.kind == WORD and not (0 <= values.min() and values.max() < n_words):
            raise ValueError(f"column {column.name}: an index without a word")
        if needed > column.width:
            raise ValueError(f"column {column.name}: {needed} characters do not fit a width of {column.width}")

    def blocks(self, size: int = 1 << 19) -> Iterator[np.ndarray]:
        """The text in uint8 arrays of about `size` bytes; each is valid until the next is asked for."""
        step = max(1, size // self.width)
        n = min(step, self.rows)
        out = np.empty(n * self.width, dtype=np.uint8)
        floats = np.empty((len(self._floats), n))
        ints = np.empty((len(self._ints), n), dtype=np.int64)
        for a in range(0, self.rows, step):
            n = min(step, self.rows - a)
            for target, source in ((floats, self._floats), (ints, self._ints)):
                for k, values in enumerate(source):
                    target[k, :n] = values[a : a + n]
            _fill(self._plan, floats, ints, self._letters, self._lengths, n, out)
            yield out[: n * self.width]


def format_table(columns: Sequence[tuple[Column, np.ndarray]], words: Sequence[str] = ()) -> bytes:
    """All rows of a table as text; see TextTable."""
    return b"".join(block.tobytes() for block in TextTable(columns, words).blocks())


def format_floats(values: np.ndarray, digits: int) -> list[str]:
    """Each value like ``%.<digits-1>e`` (for headers and tests)."""
    return format_table([(sci("value", digits), np.asarray(values, dtype=np.float64))]).decode().split()


def warm_up() -> None:
    """Compile the kernel, or load it from the cache."""
    format_floats(np.zeros(1), 3)
