"""The page of the Python interface, made from its docstrings."""

from __future__ import annotations

import inspect
import re
from typing import Any

from hpcdem.api import Call, Coupling, Frame, Frames, Simulation, blocks, couple, frames
from hpcdem.api.simulation import Bonds, Particles, Shared, Walls
from hpcdem.sweep import Sweep

_TOP = """\
# Python reference

This page is generated from the docstrings by `./scripts/pages`; do not edit it. [Python](python.md) explains how the
methods work together, with examples. Every method is collective: under mpiexec all ranks must call it. Units are SI.
For details of a command see the command of the same name ([ZDEM](zdem_reference.md), [PCDC](pcdc_reference.md)).
"""

OF_BLOCKS = {
    "geometry": blocks.Geometry, "mesh": blocks.Mesh, "elements": blocks.Elements, "faces": blocks.Faces,
    "joints": blocks.Joints, "nodes": blocks.Nodes, "flow_nodes": blocks.FlowNodes, "channels": blocks.Channels,
    "wells": blocks.Wells, "bolts": blocks.Bolts, "bolt_nodes": blocks.BoltNodes, "liners": blocks.Liners,
    "liner_nodes": blocks.LinerNodes, "tables": blocks.Tables, "fields": blocks.Fields, "histories": blocks.Histories,
    "charts": blocks.Charts, "output": blocks.Output,
}  # fmt: skip
"""Attributes of a simulation that hold the commands of blocks."""


def page() -> str:
    """The whole page, in Markdown."""
    parts = [_TOP, _class("hpcdem.Simulation", Simulation, "sim"), *map(_group, (Particles, Walls, Bonds))]
    parts += [_class(f"sim.{name}", of, f"sim.{name}") for name, of in OF_BLOCKS.items()]
    parts += [f"## hpcdem.couple\n\n{_function('hpcdem.couple', couple, method=False)}"]
    parts += [f"## hpcdem.frames\n\n{_function('hpcdem.frames', frames, method=False)}"]
    parts += [_class("Frames", Frames, "frames"), _class("Frame", Frame, "frame")]
    parts += [_class("Coupling", Coupling, "both"), _class("Call", Call, "call")]
    parts += [_class("hpcdem.Sweep", Sweep, "sweep")]
    return "\n".join(parts).rstrip("\n") + "\n"


def _class(title: str, of: type, name: str) -> str:
    lines = [f"## {title}", "", _text(of), ""]
    rows = []
    for member, value in inspect.getmembers(of):
        if member.startswith("_") and member not in ("__getitem__", "__setitem__"):
            continue
        if isinstance(value, property):
            rows.append(f"- `{name}.{member}`: {_text(value.fget)}")
        elif inspect.isfunction(value):
            lines += [_function(f"{name}.{member}", value)]
    if rows:
        lines += ["Values:", "", *rows, ""]
    return "\n".join(lines)


def _group(of: type) -> str:
    """A group: which method of the simulation each of its own is."""
    name = f"sim.{of.__name__.lower()}"
    rows = []
    for member in sorted(member for member in vars(of) if not member.startswith("_")):
        value = inspect.getattr_static(of, member)
        if isinstance(value, Shared):
            own = value.method.__name__
            rows.append(f"- `{name}.{member}`: " + (f"as `sim.{own}`" if own[0] != "_" else _text(value.method)))
        elif isinstance(value, property):
            rows.append(f"- `{name}.{member}`: {_text(value.fget)}")
    return "\n".join([f"## {name}", "", _text(of), "", *rows, ""])


def _function(name: str, of: Any, method: bool = True) -> str:
    signature = inspect.signature(of)
    parameters = [*signature.parameters.values()][1 if method else 0 :]
    shown = ", ".join(_shown(p) for p in parameters)
    if "__getitem__" in name:
        name, shown = name.removesuffix(".__getitem__"), f"[{shown}]"
    elif "__setitem__" in name:
        first, _, second = shown.partition(", ")
        name, shown = name.removesuffix(".__setitem__"), f"[{first}] = {second}"
    else:
        shown = f"({shown})"
    return f"```\n{name}{shown}\n```\n\n{_text(of)}\n"


def _shown(parameter: inspect.Parameter) -> str:
    text = {"VAR_POSITIONAL": "*", "VAR_KEYWORD": "**"}.get(parameter.kind.name, "") + parameter.name
    return text if parameter.default is parameter.empty else f"{text}={parameter.default!r}"


def _text(of: Any) -> str:
    """A docstring as Markdown: literal blocks are fenced."""
    text = inspect.getdoc(of) or ""
    text = re.sub(r"::\n\n((?:(?:    .*)?\n?)+)", lambda m: ":\n\n```\n" + inspect.cleandoc(m[1]) + "\n```\n", text)
    text = re.sub(r"^(Parameters|Returns)\n-+\n((?:.+\n?)+)", _listed, text, flags=re.MULTILINE)
    return text.replace("``", "`")


def _listed(section: re.Match[str]) -> str:
    """Parameters, or what comes back, as a list."""
    items = re.sub(r"\n +", " ", section[2].strip())
    rows = re.sub(r"^(.+?) : ", lambda found: f"- `{found[1]}`: ", items, flags=re.MULTILINE)
    return f"{'Returns' if section[1] == 'Returns' else 'Arguments'}:\n\n{rows}\n"
