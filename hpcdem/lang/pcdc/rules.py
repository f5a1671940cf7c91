"""Rules that tie several words of a line together. They are checked when a line is read, except for
values that are expressions (`Pending`), and once more when these are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from hpcdem.lang.pcdc.kinds import Pending
from hpcdem.lang.pcdc.table import RECORDED, Command
from hpcdem.physics.fdem.groups import SHOWN


def check(command: Command, arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    """ValueError if the words of a line do not go together."""
    for k, (name, value) in enumerate(terms or ()):
        if name == "not" and (k + 1 == len(terms or ()) or (terms or ())[k + 1][0] in ("not", "present", "use-hidden")):
            raise ValueError("not must precede a term of a range, such as x, group or geometry")
        if name == "in-circle" and (len(value["value"]), len(value)) not in ((2, 1), (0, 3)):
            raise ValueError("in-circle needs a centre and a radius")
    rule = _RULES.get(command.name)
    if rule is not None:
        rule(arguments, terms)


def _history(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    kind, value = arguments["object"], arguments["value"]
    given = [word for word in ("id", "nearest") if word in arguments] + (["range"] if terms is not None else [])
    if len(given) > 1:
        raise ValueError(f"a history needs one of id, nearest and range, not {' and '.join(given)}")
    how = [word for word in ("sum", "mean", "minimum", "maximum") if word in arguments]
    if len(how) > 1 or (how and given not in ([], ["range"])):
        raise ValueError(
            f"{how[-1]} needs a range or applies to all objects; give only one of sum, mean, minimum and maximum"
        )
    if terms is not None and not how:
        raise ValueError("a history of several objects needs sum, mean, minimum or maximum")
    if not isinstance(value, Pending) and (value == "law-state") != ("variable" in arguments):
        raise ValueError("value law-state and variable, the name of a state variable, are both required")
    if isinstance(kind, Pending):
        return
    if (kind == "well") != ("well" in arguments):
        raise ValueError("object well and well, its name, are both required")
    if not isinstance(value, Pending) and value not in RECORDED[kind]:
        raise ValueError(f"a history of {kind} can follow {', '.join(RECORDED[kind])}, not {value}")
    if kind in ("model", "well") and (given or how):
        raise ValueError(
            f"a history of {'the model' if kind == 'model' else 'a well'} does not accept {(given or how)[0]}"
        )
    if kind not in ("model", "well") and not (given or how):
        raise ValueError(
            f"a history of {kind} needs one of id, nearest and range, or it is sum, mean, minimum or maximum of all"
        )


def _structured(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    kind, first = arguments.get("type"), arguments["first"]
    if kind is None or isinstance(kind, Pending) or isinstance(first, Pending):
        return
    there = ("tri", "quad") if len(first) == 2 else ("tet", "hex")
    if kind not in there:
        raise ValueError(f"type {kind}: in {('two', 'three')[len(first) - 2]} dimensions it is {' or '.join(there)}")
    if kind == "hex" and "split" in arguments:
        raise ValueError("split is for tetrahedra only")


def _bolt(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if "segments" in arguments and "length" in arguments:
        raise ValueError("segments and length cannot be combined: both define the division of a bolt")


def _fluid(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if "pressure" in arguments and "saturation" in arguments:
        raise ValueError("pressure and saturation cannot be combined: the pressure is 0 below full saturation")


def _stage(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    given = [word for word in ("rate", "pressure", "shut-in") if word in arguments]
    if len(given) != 1:
        raise ValueError(f"a stage of a well is one of rate, pressure and shut-in, not {' and '.join(given) or 'none'}")
    if "limit" in arguments and given != ["rate"]:
        raise ValueError("limit, a pressure, needs rate")


def _curve(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    given = [word for word in ("values", "y", "profile") if word in arguments]
    if len(given) != 1:
        raise ValueError(
            f"a curve has either y, the name of a history, or values or profile, got {' and '.join(given) or 'none'}"
        )
    (word,) = given
    if word == "values" and (wrong := [w for w in ("x", "scale-x", "scale-y") if w in arguments]):
        raise ValueError(f"{wrong[0]} applies to histories, not to values")
    if word == "profile" and "x" in arguments:
        raise ValueError("x applies to histories, not to profile")
    if terms is not None and word != "profile":
        raise ValueError("range applies to profile, whose joints it selects")


def _time_step(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    settings = {"value": "value", "auto": "auto on", "mass-scaling": "mass-scaling"}
    if "auto" in arguments and arguments["auto"] == ():
        arguments = {**arguments, "auto": True}
    auto = arguments.get("auto")
    if "update-frequency" in arguments and auto is not True and not isinstance(auto, Pending):
        raise ValueError("update-frequency needs auto on")
    given = [
        phrase
        for word, phrase in settings.items()
        if not isinstance(arguments.get(word), Pending) and arguments.get(word)
    ]
    if len(given) > 1:
        raise ValueError(f"{given[0]} and {given[1]} cannot be combined: both set the time step")
    if given == ["value"] and "safety" in arguments:
        raise ValueError("value and safety cannot be combined: a given time step is used unchanged")


def _parts(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None, words: str) -> None:
    for part, given in arguments.items():
        if len(given) == 1:
            raise ValueError(f"{part} needs at least one of {words}")


def _option(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if arguments.get("collision") == () and "ecda" not in arguments:
        raise ValueError("collision is on or off")


def _solve(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if {"elastic", "run-time"} <= arguments.keys():
        raise ValueError("run-time needs a run by steps")
    if {"elastic", "time", "cycles"} <= arguments.keys():
        raise ValueError("elastic accepts time or cycles: it solves a creep step directly")
    watched = [word for word in ("window", "limit", "on-failure") if word in arguments]
    by_ratio = "ratio" in arguments or not ({"cycles", "time"} & set(arguments))
    if watched and ("elastic" in arguments or not by_ratio):
        raise ValueError(f"{watched[0]} needs a run by steps towards a ratio")
    if "limit" in watched and "cycles" in arguments:
        raise ValueError("limit and cycles cannot be combined: a run that reaches its cycles has not failed")
    for part in ("hydraulic", "thermal"):
        if part in arguments:
            _implicit(arguments, part)
            return
    if "auto" in arguments:
        raise ValueError("auto needs hydraulic")
    for word in ("dt", "steady"):
        if word in arguments:
            raise ValueError(f"{word} needs hydraulic or thermal")
    for word in ("solver", "steps"):
        if word in arguments and "elastic" not in arguments:
            raise ValueError(f"{word} needs elastic")


def _implicit(arguments: Mapping[str, Any], part: str) -> None:
    """Rules of model solve by implicit steps of fluid or heat."""
    others = arguments.keys() - {part, "time", "dt", "steady", "solver", *(["auto"] if part == "hydraulic" else [])}
    if others:
        raise ValueError(f"{part} does not accept {min(others)}")
    if ("steady" in arguments) == ("time" in arguments):
        raise ValueError(f"{part} needs either time or steady")
    if "auto" in arguments and "steady" in arguments:
        raise ValueError("auto needs time: steady flow is computed by implicit steps")
    if part == "thermal" and {"steady", "dt"} <= arguments.keys():
        raise ValueError("dt needs time: the steady state of heat is computed directly")


def _creep(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    others = [word for word in ("dt", "change", "least", "greatest") if word in arguments]
    if arguments["on"] is False and others:
        raise ValueError(f"off does not accept {others[0]}")
    for word, with_ in (("change", "dt"), ("least", "change"), ("greatest", "change")):
        if word in arguments and with_ not in arguments:
            raise ValueError(f"{word} needs {with_}")


def _rayleigh(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    others = [word for word in ("frequency", "part") if word in arguments]
    if arguments["ratio"] == 0.0 and others:
        raise ValueError(f"ratio 0 does not accept {others[0]}")
    if arguments["ratio"] != 0.0 and not isinstance(arguments["ratio"], Pending) and "frequency" not in arguments:
        raise ValueError("a ratio needs its frequency")


def _output(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if "every" in arguments and "off" in arguments:
        raise ValueError("every and off cannot be combined")


LAYER_OPTIONS = ("limits", "full", "log", "colours", "opacity", "edges", "size", "vectors", "arrows", "filter")


def _image(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    shown = arguments.get("object")
    if terms is not None and shown not in SHOWN and not isinstance(shown, Pending):
        raise ValueError(f"range needs object, one of {', '.join(SHOWN)}")
    if "full" in arguments and "limits" in arguments:
        raise ValueError("limits and full cannot be combined: both set the range of colours")
    if "field" not in arguments and "object" not in arguments:
        for word in LAYER_OPTIONS:
            if word in arguments:
                raise ValueError(f"{word} requires field or object")


def _field(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    given = [name for name in ("weibull", "normal", "lognormal") if name in arguments]
    if len(given) != 1:
        raise ValueError(
            f"a field has one distribution, weibull, normal or lognormal, not {' and '.join(given) or 'none'}"
        )


def _glue(arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    if terms is not None and "between" in arguments:
        raise ValueError("between and range cannot be combined: both select the faces to glue")


_RULES: dict[str, Callable[[Mapping[str, Any], Sequence[tuple[str, Any]] | None], None]] = {
    "mesh glue": _glue,
    "bolt create polyline": _bolt,
    "mesh structured": _structured,
    "field create": _field,
    "flow-node initial": _fluid,
    "model option": _option,
    "model cycle-option": partial(_parts, words="time-step, cycle-number"),
    "model reset": partial(_parts, words="start-time, current-time, time-step"),
    "model time-step": _time_step,
    "model creep": _creep,
    "model rayleigh": _rayleigh,
    "model solve": _solve,
    "history create": _history,
    "chart add": _curve,
    "well stage": _stage,
    "output vtk": _output,
    "output image": _image,
}
