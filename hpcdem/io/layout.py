"""Layout of numbers as text, shared by the code that lays out columns and the kernels that fill them."""

SCI, INT, FIXED, WORD = range(4)
"""Kinds of columns, see textnum.Column."""
MAX_DIGITS = 15
"""Largest number of significant digits."""
