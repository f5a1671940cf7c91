"""`Vector(x, y)` of scripts: what the manual calls a PCDC vector."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


class Vector:
    """Two components, or three; .X, .Y and .Z as in the manual, and the little arithmetic that scripts need."""

    __slots__ = ("_items",)

    def __init__(self, x: float, y: float, *z: float) -> None:
        if len(z) > 1:
            raise TypeError(f"Vector takes two or three numbers, got {2 + len(z)}")
        self._items = tuple(float(v) for v in (x, y, *z))

    @property
    def X(self) -> float:
        """The first component."""
        return self._items[0]

    @property
    def Y(self) -> float:
        """The second component."""
        return self._items[1]

    @property
    def Z(self) -> float:
        """The third component. AttributeError in two dimensions."""
        if len(self._items) < 3:
            raise AttributeError("this vector has two components, X and Y")
        return self._items[2]

    def __iter__(self) -> Iterator[float]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __getitem__(self, index: int) -> float:
        return self._items[index]

    def __eq__(self, other: Any) -> bool:
        return isinstance(other, Vector) and self._items == other._items

    def __hash__(self) -> int:
        return hash(self._items)

    def __repr__(self) -> str:
        return f"Vector({', '.join(repr(v) for v in self._items)})"

    def __str__(self) -> str:
        return f"({', '.join(repr(v) for v in self._items)})"

    def _of_size(self, other: Any) -> bool:
        return isinstance(other, Vector) and len(other) == len(self)

    def __add__(self, other: Any) -> Vector:
        if not self._of_size(other):
            return NotImplemented
        return Vector(*(a + b for a, b in zip(self, other, strict=True)))

    def __sub__(self, other: Any) -> Vector:
        if not self._of_size(other):
            return NotImplemented
        return Vector(*(a - b for a, b in zip(self, other, strict=True)))

    def __neg__(self) -> Vector:
        return Vector(*(-a for a in self))

    def __mul__(self, factor: Any) -> Vector:
        if isinstance(factor, Vector) or not isinstance(factor, (int, float)):
            return NotImplemented
        return Vector(*(factor * a for a in self))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Vector:
        if isinstance(divisor, Vector) or not isinstance(divisor, (int, float)):
            return NotImplemented
        return Vector(*(a / divisor for a in self))
