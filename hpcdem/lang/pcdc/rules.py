"""Rules that tie several words of a line together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hpcdem.lang.pcdc.statement import Pending
from hpcdem.lang.pcdc.table import RECORDED, Command


def check(command: Command, arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    """ValueError if the words of a line do not go together."""
    rule = _RULES.get(command.name)
    if rule is not None:
        rule(arguments, terms)


def _history(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    kind, value = arguments["object"], arguments["value"]
    if isinstance(kind, Pending) or isinstance(value, Pending):
        raise ValueError("the object and the value of a history are words, not expressions")
    if value not in RECORDED[kind]:
        raise ValueError(f"a history of {kind} can follow {', '.join(RECORDED[kind])}, not {value}")
    given = [word for word in ("id", "nearest") if word in arguments] + (["range"] if terms is not None else [])
    if kind == "model" and given:
        raise ValueError(f"a history of the model takes no {given[0]}")
    if kind != "model" and len(given) != 1:
        several = f", not {' and '.join(given)}" if given else ""
        raise ValueError(f"a history of {kind} needs one of id, nearest and range{several}")
    how = [word for word in ("sum", "mean", "minimum", "maximum") if word in arguments]
    if len(how) > 1 or (how and terms is None):
        raise ValueError(f"{how[-1]} goes with range, and only one of sum, mean, minimum and maximum")
    if terms is not None and not how:
        raise ValueError("a history of several objects needs sum, mean, minimum or maximum")


def _curve(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if ("values" in arguments) == ("y" in arguments):
        raise ValueError("a curve has either y, the name of a history, or values")
    if "values" in arguments and (wrong := [w for w in ("x", "scale-x", "scale-y") if w in arguments]):
        raise ValueError(f"{wrong[0]} goes with histories, not with values")


def _dimensions(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if arguments.get("dim", 2) == 3:
        raise ValueError("dim 3 is not there yet: this version computes in two dimensions")


def _time_step(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if arguments.get("auto") is True and "value" in arguments:
        raise ValueError("value and auto on exclude each other")


def _solve(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if "elastic" in arguments and "time" in arguments:
        raise ValueError("elastic and time exclude each other: equilibrium is found at once")
    if "solver" in arguments and "elastic" not in arguments:
        raise ValueError("solver goes with elastic; steps need none")


def _output(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if "every" in arguments and "off" in arguments:
        raise ValueError("every and off exclude each other")


_RULES = {
    "model new": _dimensions,
    "model time-step": _time_step,
    "model solve": _solve,
    "history create": _history,
    "chart add": _curve,
    "output vtk": _output,
}
