"""Declared units: what a value is measured against when a command gives it. Values are never changed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from hpcdem.core import units
from hpcdem.core.errors import CommandError

Given = tuple[str, str, Any]
"""Name of a property, its unit in SI, its value or values."""


def declared(before: str, name: str, log: Any, late: bool) -> str:
    """Return the system of units that applies from here on. before: the present one, "" none; late: values were given
    already. CommandError for an unknown system, or if another one was declared before.
    """
    new = units.system(name).name
    if before not in ("", new):
        raise CommandError(
            f"this model already uses the units {units.CHOICES[before]}; start a new model to change them"
        )
    if log is not None and not before:
        if late:
            log.warn("units: values given before this line were not checked")
        if new != units.SI.name:
            log.warn_once(
                f"units {new}",
                f"units {units.CHOICES[new]}: histories, charts and the energy table use these units. Pictures and "
                "tables made from frames show SI units; the numbers of default values in the reference are in the "
                "declared units",
            )
    return new


def check(name: str, log: Any, given: Iterable[Given]) -> None:
    """Warn of values that are unlikely in these units, "" none, once per property."""
    if not name or log is None:
        return
    where = units.system(name)
    for called, unit, value in given:
        doubts = (units.doubt(where, called, unit, number) for number in _numbers(value))
        found = next(filter(None, doubts), "")
        if found:
            log.warn_once(f"units of {called}", f"units {units.CHOICES[name]}: {found}")


def _numbers(value: Any) -> Iterator[float]:
    """Yield all numbers in a value: a number, an array, or several of them."""
    if isinstance(value, (bool, np.bool_, str)):
        return
    if isinstance(value, (int, float, np.integer, np.floating)):
        yield float(value)
    elif isinstance(value, (list, tuple, np.ndarray)):
        for item in value:
            yield from _numbers(item)
