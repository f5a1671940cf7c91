"""Kernels whose work is cut into parts, one for each thread, and which are called by Python code."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import njit


class OnThreads:
    """A kernel of the form ``for t in prange(threads): part(t, threads, ...)``, called as kernel(threads, ...).

    It is compiled as a plain loop, which `prange` is without the option `parallel`, and for several threads; each when
    it is first called. One thread needs no library of threads, and compiles in less time. A NamedTuple of arrays must
    be an argument with a name: numba does not hand it to threads among ``*args``.
    """

    def __init__(self, function: Callable[..., None], cache: bool = True) -> None:
        self.py_func = function
        self.__doc__ = function.__doc__
        self.one = njit(cache=cache, nogil=True, error_model="numpy")(function)
        made: Any = function
        name = f"{made.__name__}_threaded"
        several = FunctionType(made.__code__, made.__globals__, name, made.__defaults__, made.__closure__)
        several.__qualname__ = f"{made.__qualname__}_threaded"  # the store of kernels tells them apart by it
        several.__module__ = made.__module__
        self.several = njit(cache=cache, parallel=True, error_model="numpy")(several)

    def on(self, threads: int) -> Callable[..., None]:
        """The compiled form. Calls in each step use it: a call through Python costs as much as some elements."""
        return self.one if threads == 1 else self.several

    def __call__(self, *args: Any) -> None:
        (self.one if args[0] == 1 else self.several)(*args)


def on_threads(function: Callable[..., None]) -> OnThreads:
    """Decorate a function of a module, as `njit` does."""
    return OnThreads(function)
