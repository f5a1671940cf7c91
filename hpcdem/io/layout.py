"""How numbers are written as text: what those who lay out columns share with the kernels that fill them."""

SCI, INT, FIXED, WORD = range(4)
"""Kinds of columns, see textnum.Column."""
MAX_DIGITS = 15
"""Significant digits at most."""
