"""Data of a view: the objects that are shown and how, the part of the plane, and what stands around it.

Files `*.mv` hold it as JSON, with the names used here; missing names have their default, other names are rejected.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from hpcdem.core import validation
from hpcdem.core.errors import HpcdemError
from hpcdem.core.nearest import hint
from hpcdem.core.picture_words import COLOURS, OBJECTS, eye_of, section_of
from hpcdem.io.agreed import atomic_path
from hpcdem.io.disk import explain
from hpcdem.post.view.filter import LONGEST

VERSION = 1
MOST_LAYERS = 60
"""Largest number of layers: pictures distinguish them by a byte, and readers far fewer."""
_Colour = Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")]
_Span = tuple[FiniteFloat, FiniteFloat]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Layer(_Table):
    """One kind of object in a view.

    name: in the tree and the legend, else that of the object; field: what colours it, "" the object's own colours;
    limits: values of the first and the last colour, "full": the least and the greatest of what is shown, else those
    that one in a hundred is below or above; colour: one for all; size: factor on radii of particles and widths of
    lines; vectors: a field drawn as arrows, `longest` (SI, 0: the longest that is shown) `arrows` times a twentieth of
    the picture; filter: an expression that chooses objects, see hpcdem.post.view.filter."""

    object: Literal[OBJECTS]  # type: ignore[valid-type]
    name: Annotated[str, Field(max_length=60)] = ""
    visible: bool = True
    field: Annotated[str, Field(max_length=60)] = ""
    limits: _Span | Literal["full"] | None = None
    log: bool = False
    colours: Literal[tuple(COLOURS)] = "viridis"  # type: ignore[valid-type]
    colour: _Colour = ""
    opacity: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 1.0
    edges: bool = False
    size: Annotated[FiniteFloat, Field(gt=0.0, le=100.0)] = 1.0
    vectors: Annotated[str, Field(max_length=60)] = ""
    arrows: Annotated[FiniteFloat, Field(gt=0.0, le=100.0)] = 1.0
    longest: Annotated[FiniteFloat, Field(ge=0.0)] = 0.0
    filter: Annotated[str, Field(max_length=LONGEST)] = ""

    @property
    def label(self) -> str:
        """Return its name in the tree."""
        return self.name or self.object

    @property
    def span(self) -> tuple[float, float] | None:
        """The limits where they are values."""
        return None if isinstance(self.limits, str) else self.limits

    @model_validator(mode="after")
    def _ordered(self) -> Layer:
        if self.span is not None and not self.span[0] < self.span[1]:
            raise ValueError(f"limits: {self.span[0]:g} is not below {self.span[1]:g}")
        if self.log and self.span is not None and self.span[0] <= 0.0:
            raise ValueError(f"limits: with log both must be above 0, not {self.span[0]:g}")
        return self


class ModelView(_Table):
    """layers: what is shown, the later ones over the earlier; camera: left, right, bottom, top of the part of the plane
    [m], in space of the plane of the picture, else the whole model; eye, section: in space from where it is seen, and a
    plane that cuts it, as `hpcdem.core.picture_words` reads them; deformed: factor on displacements, 1 as it is, 0 as
    it was in the mesh; title: over the picture, with {step} and {time}; step: of the frame, else the last one."""

    layers: Annotated[tuple[Layer, ...], Field(max_length=MOST_LAYERS)] = ()
    camera: tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat] | None = None
    eye: Annotated[str, Field(max_length=100)] = "iso"
    section: Annotated[str, Field(max_length=200)] = ""
    deformed: FiniteFloat = 1.0
    title: Annotated[str, Field(max_length=200)] = "step {step}, {time} s"
    axes: bool = True
    legend: bool = True
    step: Annotated[int, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _a_part(self) -> ModelView:
        if self.camera is not None and not (self.camera[0] < self.camera[1] and self.camera[2] < self.camera[3]):
            raise ValueError("camera: expected left, right, bottom, top with left < right and bottom < top")
        for word, read in (("eye", eye_of), ("section", section_of)):
            if word == "eye" or self.section:
                try:
                    read(getattr(self, word))
                except ValueError as problem:
                    raise ValueError(f"{word}: {problem}, not '{getattr(self, word)}'") from None
        labels = [layer.label for layer in self.layers]
        for label in labels:
            if labels.count(label) > 1:
                raise ValueError(f"layers: two have the name '{label}': rename one of them")
        return self

    def layer(self, label: str) -> Layer | None:
        """The layer of this name."""
        return next((layer for layer in self.layers if layer.label == label), None)

    def changed(self, **values: Any) -> ModelView:
        """Return this view with other values. HpcdemError for invalid ones."""
        return view_of({**self.model_dump(), **values}, "view")

    def with_layer(self, label: str, **values: Any) -> ModelView:
        """Return this view with other values of one layer. HpcdemError for invalid ones."""
        layers = [
            {**layer.model_dump(), **(values if layer.label == label else {})} for layer in self.layers
        ]  # fmt: skip
        return self.changed(layers=layers)


def view_of(given: Mapping[str, Any], source: str) -> ModelView:
    """The view that a table of names and values says. HpcdemError that begins with `source` and names the value."""
    try:
        return ModelView.model_validate(dict(given))
    except ValidationError as problem:
        raise HpcdemError(f"{source}: {_wrong(problem.errors(), given)}") from None


_FORMS = {"limits": "two numbers", "camera": "left, right, bottom, top"}
"""Descriptions of lists of numbers in messages."""


def _wrong(errors: Sequence[Mapping[str, Any]], given: Mapping[str, Any]) -> str:
    """Describe the errors of a view and their places: "layer 2 (joints), opacity: expected at most 1, read 2"."""
    first = errors[0]
    loc, known = _place(first), ModelView.model_fields
    place: list[str] = []
    if loc[:1] == ["layers"] and len(loc) > 1:
        number, loc, known = int(loc[1]), loc[2:], Layer.model_fields
        layer = given["layers"][number]
        called = (layer.get("name") or layer.get("object")) if isinstance(layer, Mapping) else None
        place.append(f"layer {number + 1}{f' ({called[:60]})' if isinstance(called, str) else ''}")
    word = str(loc[0])[:40] if loc else ""
    place += [word] if word else []
    if len(loc) > 1:
        place.append(f"value {int(loc[1]) + 1}")
    where = f"{', '.join(place)}: " if place else ""
    if rule := validation.message(first):
        return f"{where}{rule}"
    if first["type"] == "extra_forbidden":
        table = "layer" if known is Layer.model_fields else "view"
        return f"{where.removesuffix(': ')} is not a word of a {table}{hint(word, known)}"
    read = first["input"]
    if first["type"] == "too_long":
        return f"{where}{len(read)}, {validation.expected(first)}"
    any_of = [error for error in errors if _place(error) == _place(first)]
    forms = [_FORMS.get(word, "a list") if e["type"] == "tuple_type" else validation.expected(e) for e in any_of]
    shown_as = validation.kind_of(read) if isinstance(read, (dict, list, tuple)) else repr(read)[:40]
    return f"{where}expected {' or '.join(forms)}" + ("" if first["type"] == "missing" else f", read {shown_as}")


def _place(error: Mapping[str, Any]) -> list[str | int]:
    """Return where an error is: without the names of kinds that a value may be of."""
    return [part for part in error["loc"] if isinstance(part, int) or not set(part) & set("[(")]


def read_view(path: str | os.PathLike) -> ModelView:
    """The view in a file. HpcdemError if it cannot be read, or is none."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise HpcdemError(f"cannot read {os.fspath(path)}: there is no such file") from None
    except OSError as failure:
        raise HpcdemError(explain(Path(path), failure, "read")) from None
    except UnicodeDecodeError:
        raise HpcdemError(f"{os.fspath(path)} is not a view: it is not text") from None
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise HpcdemError(f"{os.fspath(path)} is not a view: {problem}") from None
    if not isinstance(given, dict) or given.pop("view", None) != VERSION:
        raise HpcdemError(f'{os.fspath(path)} is not a view: expected "view": {VERSION} in a JSON object')
    return view_of(given, os.fspath(path))


def written(view: ModelView) -> str:
    """The text of a file: what differs from the defaults."""
    layers = [{"object": layer.object} | layer.model_dump(exclude_defaults=True) for layer in view.layers]
    table = {"view": VERSION} | view.model_dump(exclude_defaults=True, exclude={"layers"}) | {"layers": layers}
    return json.dumps(table, indent=2, ensure_ascii=False) + "\n"


def save_view(path: str | os.PathLike, view: ModelView) -> None:
    """Write the view into a file. HpcdemError if it cannot be written."""
    with atomic_path(path) as temporary:
        Path(temporary).write_text(written(view), encoding="utf-8")
