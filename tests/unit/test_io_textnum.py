"""Numbers as text: the compiled kernel against Python's own formatting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.io.textnum import FIXED, INT, WORD, Column, TextTable, format_floats, format_table, sci
from tests.tables import each

any_float = st.floats(width=64, allow_subnormal=True)


def python_text(values: np.ndarray, digits: int) -> list[str]:
    return [f"{v:.{digits - 1}e}" for v in values.tolist()]


@settings(max_examples=300, deadline=None)
@given(st.lists(any_float, min_size=1, max_size=50), st.integers(1, 15))
def test_floats_are_written_like_python_does(values: list[float], digits: int) -> None:
    array = np.array(values)
    assert format_floats(array, digits) == python_text(array, digits)


@each("digits", [1, 2, 5, 9, 13, 15])
@each("kind", ["any bits", "denormal", "near one", "halves", "ties of integers", "powers of ten"])
def test_many_random_floats_are_written_like_python_does(kind: str, digits: int) -> None:
    rng = np.random.default_rng(7)
    n = 20000
    values = {
        "any bits": rng.integers(0, 2**64, n, dtype=np.uint64).view(np.float64),
        "denormal": rng.integers(0, 2**52, n, dtype=np.uint64).view(np.float64),
        "near one": rng.normal(size=n) * 10.0 ** rng.integers(-12, 13, n),
        "halves": rng.integers(0, 10**12, n) + 0.5,
        "ties of integers": rng.integers(0, 10**14, n) * 10.0 + 5,
        "powers of ten": np.array(
            [s * 10.0**k * f for k in range(-323, 308) for s in (1, -1) for f in (1, 0.5, 9.995)]
        ),
    }[kind]
    assert format_floats(values, digits) == python_text(values, digits)


def test_special_values() -> None:
    values = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, np.finfo(float).max, 9.9999999999999999e22])
    for digits in (1, 9, 13):
        assert format_floats(values, digits) == python_text(values, digits)


def test_a_mixed_table_is_what_python_would_write() -> None:
    rng = np.random.default_rng(3)
    n = 5000
    gid = rng.integers(-(2**62), 2**62, n)
    small = rng.integers(0, 8, n).astype(np.uint8)
    x = rng.normal(size=n) * 1e4
    group = rng.integers(0, 3, n).astype(np.int32)
    names = ["***", "Sandstein", "沉积"]
    columns = [
        (Column("gid", INT, 21), gid),
        (Column("fix", INT, 3), small),
        (sci("x", 13, 22), x),
        (Column("mm", FIXED, 12, 3), x),
        (Column("group", WORD, 12), group),
    ]
    expected = "".join(
        f"{g:21d}{s:3d}{v:22.12e}{v:12.3f}" + " " * (12 - len(names[w].encode())) + names[w] + "\n"
        for g, s, v, w in zip(gid.tolist(), small.tolist(), x.tolist(), group.tolist())
    )
    assert format_table(columns, names).decode() == expected
    # The size of the blocks does not show.
    assert b"".join(b.tobytes() for b in TextTable(columns, names).blocks(1000)).decode() == expected


@given(st.integers(-(2**63) + 1, 2**63 - 1))
def test_integers(value: int) -> None:
    assert format_table([(Column("i", INT, 21), np.array([value]))]).decode() == f"{value:21d}\n"


@given(st.floats(-1e6, 1e6), st.integers(0, 6))
def test_fixed_decimals_are_right_to_half_a_unit(value: float, decimals: int) -> None:
    text = format_table([(Column("x", FIXED, 20, decimals), np.array([value]))]).decode()
    assert len(text) == 21
    assert len(text.strip().partition(".")[2]) == decimals
    assert abs(float(text) - value) <= 0.5 * 10.0**-decimals * (1 + 1e-9) + np.spacing(abs(value))


def test_fixed_decimals_beyond_their_range_stay_numbers() -> None:
    text = format_table([(Column("x", FIXED, 20, 3), np.array([np.nan, np.inf, -np.inf, -1e12]))]).decode().split()
    assert text == ["nan", "inf", "-inf", "-1e+12"]


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        (Column("i", INT, 3), np.array([1234]), "4 characters do not fit"),
        (Column("i", INT, 3), np.array([-123]), "4 characters do not fit"),
        (Column("x", 0, 10, 9), np.array([1.0]), "16 characters do not fit"),
        (sci("x", 16), np.array([1.0]), "16 digits requested"),
        (Column("x", FIXED, 8, 3), np.array([-99999.0]), "10 characters do not fit"),
        (Column("w", WORD, 8), np.array([2]), "an index without a name"),
        (Column("w", WORD, 3), np.array([0]), "6 characters do not fit"),
    ],
)
def test_what_does_not_fit_is_refused(column: Column, values: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TextTable([(column, values)], ["abcdef", "b"])


def test_an_empty_table_is_no_text() -> None:
    assert format_table([(sci("x"), np.zeros(0)), (Column("i", INT, 5), np.zeros(0, dtype=np.int64))]) == b""
