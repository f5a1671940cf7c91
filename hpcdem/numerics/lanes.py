"""Moving table rows into lanes and back: how a loop over scattered pairs is made fit for vector instructions.

A particle or a law is a row of a table, because then everything about it lies in one cache line. Vector arithmetic
wants the opposite: one array per quantity, a *lane*, with the pairs side by side. The functions here copy four rows
at a time and turn them (a 4 x 4 transposition in registers), which compilers do not find by themselves. The formulas
stay plain loops over lanes, which compilers do vectorise, as nothing in them depends on the pair before.

All operations are IEEE operations on each element, in the order written, so the results are the same on any CPU.

`lanes` is one flat f8 array of n * CAPACITY numbers, `lane(k)` is where lane k begins: distances that the compiler
knows let it prove that lanes do not overlap. Rows are given by flat offsets (row * width) into a C-contiguous f8 table.
Numbers are np.uint64: a signed index would be tested for being negative at every access.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

CAPACITY = 208
"""Pairs a set of lanes can hold: small enough for the first-level cache."""
GROUP = 4
"""Rows turned at a time."""

U = np.uint64
_INT, _FLOAT = ir.IntType(64), ir.DoubleType()
_FOUR = ir.VectorType(_FLOAT, GROUP)
_ROWS = types.UniTuple(types.uint64, GROUP)


def lane(number: int) -> np.uint64:
    """Return where a lane begins."""
    return U(number * CAPACITY)


@njit(cache=True, nogil=True)
def offset(row, width):
    """Return where a row begins in a flat table."""
    return U(row) * U(width)


@intrinsic
def no_farther(typingctx: Any, a: Any, b: Any) -> Any:
    """-1 (all bits set) if a <= b, else 0; a and b not negative, neither of them -0.0.

    The bits of such numbers are ordered as the numbers are.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        x, y = (builder.bitcast(value, _INT) for value in args)
        return builder.not_(builder.ashr(builder.sub(y, x), ir.Constant(_INT, 63)))

    return types.int64(types.float64, types.float64), codegen


@intrinsic
def as_bits(typingctx: Any, a: Any) -> Any:
    """The bits of a float; in the order of the numbers if none is negative."""
    return types.int64(types.float64), lambda context, builder, signature, args: builder.bitcast(args[0], _INT)


@intrinsic
def as_number(typingctx: Any, mask: Any) -> Any:
    """Return the mask as a number of which the compiler does not know that it is a question.

    It would turn what is done with the mask into a jump, and a jump that no predictor can guess costs more than the
    whole contact law. (An empty piece of assembly, on any CPU.)
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        same = ir.InlineAsm(ir.FunctionType(_INT, [_INT]), "", "=r,0", side_effect=False)
        return builder.call(same, [args[0]])

    return types.int64(types.int64), codegen


@intrinsic
def differences(typingctx: Any, lanes: Any, at: Any, table: Any, j: Any, i: Any) -> Any:
    """table[j + c] - table[i + c] for the columns c = 0..3 into four lanes, the first from `at` on; i, j: four offsets
    each."""
    signature = types.void(lanes, types.uint64, table, _ROWS, _ROWS)

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        a = _Access(context, builder, signature, args)
        rows = [builder.fsub(a.load(2, a.item(3, q)), a.load(2, a.item(4, q))) for q in range(GROUP)]
        a.store_lanes(0, args[1], _turned(builder, rows))
        return context.get_dummy_value()

    return signature, codegen


def _columns(count: int) -> Any:
    @intrinsic
    def columns(typingctx: Any, lanes: Any, at: Any, table: Any, i: Any) -> Any:
        signature = types.void(lanes, types.uint64, table, _ROWS)

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            a = _Access(context, builder, signature, args)
            rows = [a.load(2, a.item(3, q)) for q in range(GROUP)]
            a.store_lanes(0, args[1], _turned(builder, rows)[:count])
            return context.get_dummy_value()

        return signature, codegen

    columns.__doc__ = (
        f"table[i + c], c = 0..{count - 1}, into {count} lanes, the first from `at` on; four columns must be readable."
    )
    return columns


two_columns, four_columns = _columns(2), _columns(4)


def _put(count: int) -> Any:
    @intrinsic
    def put(typingctx: Any, table: Any, i: Any, lanes: Any, at: Any) -> Any:
        signature = types.void(table, _ROWS, lanes, types.uint64)

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            a = _Access(context, builder, signature, args)
            for q, row in enumerate(_turned(builder, a.load_lanes(2, args[3]))):
                part = row if count == GROUP else builder.shuffle_vector(row, row, _picks(*range(count)))
                a.store(0, a.item(1, q), part)
            return context.get_dummy_value()

        return signature, codegen

    put.__doc__ = (
        f"The inverse of {'four' if count == GROUP else 'two'}_columns, one row after the other. Four lanes must be "
        "readable."
    )
    return put


put_two_columns, put_four_columns = _put(2), _put(4)


@intrinsic
def add_in_turn(typingctx: Any, force: Any, i: Any, j: Any, lanes: Any, at: Any) -> Any:
    """Add for each of four pairs, in sequence: force[i] += (a, b, c, 0), then force[j] += (-a, -b, d, 0).

    a..d: four lanes, the first from `at` on. The order of additions is that of the pairs, even where rows repeat.
    """
    signature = types.void(force, _ROWS, _ROWS, lanes, types.uint64)

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        access = _Access(context, builder, signature, args)
        a, b, c, d = access.load_lanes(3, args[4])
        zero = ir.Constant(_FOUR, [0.0] * GROUP)
        first = _turned(builder, [a, b, c, zero])
        second = _turned(builder, [builder.fneg(a), builder.fneg(b), d, zero])
        for q in range(GROUP):
            for rows, value in ((1, first[q]), (2, second[q])):
                at = access.item(rows, q)
                access.store(0, at, builder.fadd(access.load(0, at), value))
        return context.get_dummy_value()

    return signature, codegen


class _Access:
    """Loads and stores of four numbers at an offset of an array argument, while code is generated."""

    def __init__(self, context: Any, builder: Any, signature: Any, args: Any) -> None:
        self.context, self.builder, self.types, self.args = context, builder, signature.args, args

    def item(self, argument: int, q: int) -> Any:
        return self.builder.extract_value(self.args[argument], q)

    def load(self, argument: int, offset: Any) -> Any:
        value = self.builder.load(self._pointer(argument, offset))
        value.align = 8
        return value

    def store(self, argument: int, offset: Any, value: Any) -> None:
        self.builder.store(value, self._pointer(argument, offset, value.type)).align = 8

    def load_lanes(self, argument: int, at: Any) -> list:
        return [self.load(argument, self._lane(at, c)) for c in range(GROUP)]

    def store_lanes(self, argument: int, at: Any, values: list) -> None:
        for c, value in enumerate(values):
            self.store(argument, self._lane(at, c), value)

    def _lane(self, at: Any, c: int) -> Any:
        return self.builder.add(at, ir.Constant(_INT, c * CAPACITY))

    def _pointer(self, argument: int, offset: Any, kind: Any = _FOUR) -> Any:
        array = self.context.make_array(self.types[argument])(self.context, self.builder, value=self.args[argument])
        return self.builder.bitcast(self.builder.gep(array.data, [offset]), kind.as_pointer())


def _picks(*which: int) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(which)), list(which))


def _turned(builder: Any, rows: list) -> list:
    """The 4 x 4 transposition of four vectors of four."""

    def pick(a: Any, b: Any, *which: int) -> Any:
        return builder.shuffle_vector(a, b, _picks(*which))

    even = [pick(rows[k], rows[k + 1], 0, 4, 2, 6) for k in (0, 2)]
    odd = [pick(rows[k], rows[k + 1], 1, 5, 3, 7) for k in (0, 2)]
    return [pick(*pair, *which) for which in ((0, 1, 4, 5), (2, 3, 6, 7)) for pair in (even, odd)]
