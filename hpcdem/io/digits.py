"""Kernels that write columns of numbers as text into one byte buffer, right-aligned in fixed widths.

Floats are written like C's ``%.<n>e``, correctly rounded: the number is multiplied or divided by a power of ten in
double-double arithmetic (error-free products of Dekker 1971, Numerische Mathematik 18, 224-242), so the result can
differ from the exact one, by one unit of the last place, only when the value lies within about 1e-16 of such a unit
from the middle between two neighbours without being that middle. Most numbers take a shorter way to the same text.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from hpcdem.io.layout import FIXED, INT, SCI

_BLANK, _NEWLINE, _MINUS, _POINT, _ZERO, _E, _PLUS = 32, 10, 45, 46, 48, 101, 43


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


# --- the usual numbers, several bytes at a time -------------------------------------------------------------------
#
# Almost every number needs neither the exact product of `_scaled` nor the loop over digits of `_put_digits`: a plain
# product is good to 16 digits, and its rounding is certain unless it falls near the middle between two integers. What
# is left (flag 1: near the middle, three-digit exponents, nan, ...) is written by the functions above.

_LARGEST = 99  # exponents of two digits
_TENS = np.array([float(f"1e{k}") for k in range(-_LARGEST - 1, _LARGEST + 2)])  # _TENS[k + 100] = 10**k, rounded
_SCALES = np.array([float(f"1e{k}") for k in range(-_LARGEST - 1, _LARGEST + 14)])
# floor(log10(2**k)) for k = -333..333, the exponents of two of 1e-100..1e100
_LOG10 = np.array([len(str(2**k)) - 1 if k >= 0 else -len(str(2**-k)) for k in range(-333, 334)], dtype=np.int64)
_EXPONENTS = np.array(  # "e+07" as the bytes of a little-endian word
    [int.from_bytes(f"e{k:+03d}".encode(), "little") for k in range(-_LARGEST, _LARGEST + 1)], dtype=np.uint32
)
_BLANKS4, _ZEROS4 = np.uint32(0x20202020), np.uint32(0x30303030)
_BLANKS8, _ZEROS8 = np.uint64(0x2020202020202020), np.uint64(0x3030303030303030)


def _store(bits: int) -> Any:
    @intrinsic
    def store(typingctx: Any, out: Any, at: Any, word: Any) -> Any:
        signature = types.void(out, types.int64, types.Integer.from_bitwidth(bits, signed=False))

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, value=args[0])
            pointer = builder.bitcast(builder.gep(array.data, [args[1]]), ir.IntType(bits).as_pointer())
            word = args[2] if sys.byteorder == "little" else builder.bswap(args[2])
            builder.store(word, pointer).align = 1
            return context.get_dummy_value()

        return signature, codegen

    store.__doc__ = f"out[at : at + {bits // 8}] = the bytes of a word, lowest first; out (n,) u1, at >= 0."
    return store


_store4, _store8 = _store(32), _store(64)


@njit(cache=True, nogil=True, error_model="numpy")
def _eight_digits(n: np.uint64) -> np.uint64:
    """The digits of n < 10**8, one per byte, the first in the lowest byte (all lanes of a word at once)."""
    high = n // np.uint64(10000)
    pairs = high | ((n - high * np.uint64(10000)) << np.uint64(32))
    tens = ((pairs * np.uint64(10486)) >> np.uint64(20)) & np.uint64(0x7F0000007F)
    pairs = tens | ((pairs - tens * np.uint64(100)) << np.uint64(16))
    tens = ((pairs * np.uint64(103)) >> np.uint64(10)) & np.uint64(0x000F000F000F000F)
    return tens | ((pairs - tens * np.uint64(10)) << np.uint64(8))


@njit(cache=True, nogil=True, error_model="numpy")
def _split(values: np.ndarray, digits: int, n: int, whole: np.ndarray, exponent: np.ndarray, slow: np.ndarray) -> int:
    """The first n values as whole * 10**(exponent - digits + 1), whole having `digits` digits; zero stays zero.

    slow: 1 where that is uncertain; returns whether there is any.
    """
    limit = _HIGH[digits]
    edge = 0.5 - 4e-16 * limit - 1e-9
    bits = values.view(np.int64)
    any_slow = 0
    for k in range(n):
        size = bits[k] & np.int64(0x7FFFFFFFFFFFFFFF)
        two = (size >> 52) - 1023
        is_zero = size == 0
        fits = (two > -328) & (two < 328)
        two = two if fits else 0
        a = abs(values[k]) if fits else 1.0
        e = _LOG10[np.uint64(two + 333)]
        e += a >= _TENS[np.uint64(e + 101)]
        scaled = a * _SCALES[np.uint64(digits - 1 - e + 100)]
        number = math.floor(scaled)
        part = scaled - number
        m = np.int64(number) + (part > 0.5)
        over = m >= np.int64(limit)
        m = np.int64(_HIGH[digits - 1]) if over else m
        e = e + 1 if over else e
        bad = (not fits or abs(part - 0.5) < 0.5 - edge) and not is_zero
        whole[k] = 0 if is_zero else m
        exponent[k] = 0 if is_zero else e
        slow[k] = bad
        any_slow |= bad
    return any_slow


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_sci(values, digits, n, end, row, out, whole, exponent, slow):
    """Column of n numbers like ``%.<digits-1>e``, the first ending before out[end], the others `row` bytes apart."""
    any_slow = _split(values, digits, n, whole, exponent, slow)
    bits = values.view(np.int64)
    long = digits == 13
    for k in range(n):
        at = end + k * row
        m = np.uint64(whole[k])
        top = m // np.uint64(100000000)
        low = m - top * np.uint64(100000000)
        _store4(out, at - 4, _EXPONENTS[np.uint64(exponent[k] + _LARGEST)])
        _store8(out, at - 12, _eight_digits(low) | _ZEROS8)
        head = at - 16
        if long:
            lead = top // np.uint64(10000)
            _store4(out, at - 16, np.uint32(_eight_digits(top - lead * np.uint64(10000)) >> np.uint64(32)) | _ZEROS4)
            top, head = lead, at - 20
        sign = np.uint64(45) if bits[k] < 0 else np.uint64(32)
        _store4(out, head, np.uint32(np.uint64(0x2E300020) | (sign << np.uint64(8)) | (top << np.uint64(16))))
    if any_slow:
        for k in range(n):
            if slow[k]:
                at = end + k * row
                for q in range(at - digits - 8, at):
                    out[q] = _BLANK
                _put_sci(out, at, values[k], digits)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_int(values, n, end, row, out):
    """Column of n integers; the eight bytes before each end may be overwritten."""
    some = np.int64(0)
    for k in range(n):
        v = values[k]
        some |= v | (np.int64(99999999) - v)
    for k in range(n):
        at = end + k * row
        v = values[k]
        if some < 0 and not 0 <= v <= 99999999:
            _put_int(out, at, v)
            continue
        zeros = 8 * (
            np.int64(v < 10) + (v < 100) + (v < 1000) + (v < 10000) + (v < 100000) + (v < 1000000) + (v < 10000000)
        )
        digits = _eight_digits(np.uint64(v)) | _ZEROS8
        keep = ~np.uint64(0) << np.uint64(zeros)
        _store8(out, at - 8, (digits & keep) | (_BLANKS8 & ~keep))


@njit(cache=True, nogil=True, error_model="numpy")
def fill(
    plan: np.ndarray,
    floats: np.ndarray,
    ints: np.ndarray,
    words: np.ndarray,
    lengths: np.ndarray,
    n: int,
    out: np.ndarray,
) -> None:
    """Write the first n rows into out; plan (columns, 4): kind, source row, width, digits.

    Column by column, the last one first: what is written several bytes at a time may spoil the end of the column
    before.
    """
    row = 1
    for c in range(len(plan)):
        row += plan[c, 2]
    out[: n * row] = _BLANK
    whole, exponent, slow = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int8)
    end = row - 1
    for c in range(len(plan) - 1, -1, -1):
        kind, source, width, digits = plan[c, 0], plan[c, 1], plan[c, 2], plan[c, 3]
        if kind == SCI and (digits == 9 or digits == 13):
            _fill_sci(floats[source], digits, n, end, row, out, whole, exponent, slow)
        elif kind == INT and end >= 8:
            _fill_int(ints[source], n, end, row, out)
        else:
            for i in range(n):
                at = end + i * row
                if kind == SCI:
                    _put_sci(out, at, floats[source, i], digits)
                elif kind == FIXED:
                    _put_fixed(out, at, floats[source, i], digits)
                elif kind == INT:
                    _put_int(out, at, ints[source, i])
                else:
                    w = ints[source, i]
                    for k in range(lengths[w]):
                        out[at - lengths[w] + k] = words[w, k]
        end -= width
    for i in range(n):
        out[i * row + row - 1] = _NEWLINE
