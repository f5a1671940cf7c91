"""A view of a frame put together: what is where, in which colour, and what the legend says."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hpcdem.core import units
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.nearest import hint
from hpcdem.core.picture_words import COLOURS, HIDDEN, OBJECTS, eye_of, section_of
from hpcdem.io import colours
from hpcdem.io.axes import View, bar_ticks
from hpcdem.post import blocks
from hpcdem.post.view.filter import chosen, refusal
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import BALLS, DISCS, LINES, RODS, SOLIDS, SPOTS, Moment, Objects, lengths

STEPS = 256
"""Number of colours of a field."""
NOTHING = "#b8b8b8"
"""Colour of objects without a value."""
INK = {
    "contacts": "#7a7a7a", "bonds": "#1e3cb4", "bolts": "#202020", "liners": "#7a5195", "channels": "#2f7fb5",
    "face-conditions": "#e07b00", "flow-nodes": "#17607f", "node-conditions": "#a3195b",
    "faults": "#c81e1e",
}  # fmt: skip
"""Colours of lines and points without a field."""
WIDTH = {
    "walls": 1.2, "contacts": 0.4, "bonds": 0.6, "joints": 1.0, "channels": 1.6, "bolts": 1.6, "liners": 2.2,
    "face-conditions": 2.6, "flow-nodes": 3.0, "node-conditions": 4.0, "faults": 2.4,
}  # fmt: skip
"""Width of lines, and diameter of points drawn as discs [points], at size 1."""
POINT = 1.0 / 480.0
"""A point of rods and points, over the width of the picture."""
THROUGH = 0.35
"""Opacity of elements around rods."""
MOST_ARROWS = 3000
"""Largest number of arrows in a picture: with more objects only every k-th has one."""
LONGEST = 0.2
"""Largest length, over the width of the picture, of the arrow that shows the scale."""
ARROW = 0.05
"""Length of the longest arrow, over the width of the picture."""
CATEGORIES = (
    "#4477aa",
    "#ee6677",
    "#228833",
    "#ccbb44",
    "#66ccee",
    "#aa3377",
    "#bbbbbb",
    "#222255",
    "#994f00",
    "#44aa99",
)
"""Colours of groups: ten that colour-blind readers distinguish (Tol 2021, with three more)."""
PALE = ("#77aadd", "#eedd88", "#ee8866", "#44bb99", "#ffaabb", "#bbcc33", "#99ddff", "#aaaa00")
"""Colours of groups of elements, on which joints and bolts are visible (Tol 2021, light)."""
TRACES = (
    "#08306b", "#7f0000", "#00441b", "#4a1486", "#7a3b00", "#004d56", "#8e0152", "#252525", "#5a5200", "#3f007d",
)  # fmt: skip
"""Of faults: dark, so that their lines are visible on discs and elements coloured by groups."""
CLASSES = 12
"""Largest number of entries in the legend of an integer field with names."""


@dataclass(frozen=True)
class Scale:
    """The bar of colours of a field: its name, the unit of SI of its values, values of its ends, and whether they are
    logarithms. below, above: some values of what is shown lie beyond the ends."""

    name: str
    si: str
    low: float
    high: float
    log: bool
    colours: str
    below: bool = False
    above: bool = False

    @property
    def unit(self) -> tuple[float, str]:
        """Size in SI, and name, of the unit in which people read it."""
        return units.on_bar(self.low, self.high, self.si)

    @property
    def title(self) -> str:
        """Name and unit."""
        unit = self.unit[1]
        return f"{self.name} ({unit})" if unit else self.name

    def ticks(self) -> list[tuple[float, str]]:
        """Return where numbers stand along the bar, from 0 to 1, and which."""
        size = self.unit[0]
        low, high = self.low / size, self.high / size
        if not 1e-290 < high - low < 1e290:  # no round step is a number any more
            return [(0.0, units.power_of_ten(low)), (1.0, units.power_of_ten(high))]
        place = math.log10 if self.log else float
        return [
            (min(max((place(v) - place(low)) / (place(high) - place(low)), 0.0), 1.0), text)
            for v, text in bar_ticks(low, high, self.log)
        ]


@dataclass(frozen=True)
class Reference:
    """An arrow of a round value: what it says, and its length in the picture [m]."""

    text: str
    length: float


@dataclass
class Painted:
    """A layer ready to be drawn.

    rows (m,): which of its objects these are; shape as in `Objects`, of these; of tetrahedra what is seen of them, the
    columns of `space.Skin`; shades (c, 3): colours as fractions, kind (m,): the colour of each; width: of lines
    [points]; values (m,): of the field, None without; arrows: where (k, dim), and how far (k, dim) [m]; reference: how
    long a value is; legend: (word, colour, or several with blanks between them) of classes; scale: of the field."""

    layer: Layer
    kind_of_shape: str
    rows: np.ndarray
    shape: tuple[np.ndarray, ...]
    shades: np.ndarray
    kind: np.ndarray
    width: float
    values: np.ndarray | None = None
    arrows: tuple[np.ndarray, np.ndarray] | None = None
    reference: Reference | None = None
    legend: list[tuple[str, str]] = field(default_factory=list)
    scale: Scale | None = None


@dataclass
class Scene:
    """Everything in a picture. seen: the part of the plane, in space of that of the picture; turn (3, 3): in space
    right, up and towards the eye."""

    moment: Moment
    view: ModelView
    seen: View
    layers: list[Painted]
    turn: np.ndarray | None = None

    def title(self) -> str:
        """Over the picture."""
        return units.stamped(self.view.title, self.moment.step, self.moment.time)


STILL = 1e-9
"""Displacement over the size of a model below which an object counts as unmoved."""


def default_view(moment: Moment) -> ModelView:
    """Everything that the frame has, in its default view: discs by their colours, elements by what has happened to
    them (`telling`), channels by the pressure in them, joints by mode; `HIDDEN` is there, and hidden.
    Rods and shells shine through the elements around them. Of many frames the last one says what is shown in all of
    them."""
    shells = moment.dim == 3 and "liners" in moment.objects
    inside = shells or any(objects.kind == RODS and name not in HIDDEN for name, objects in moment.objects.items())
    appearance: dict[str, dict[str, Any]] = {"faults": {"field": "fault"}}
    if "elements" in moment.objects:
        field = telling(moment)
        small = moment.of("elements").count <= blocks.MOST_EDGES
        appearance["elements"] = {
            "field": field, "edges": small and (not field or moment.dim == 3), "opacity": THROUGH if inside else 1.0
        }  # fmt: skip
    if "channels" in moment.objects and _varies(moment.of("channels"), "fluid_pressure"):
        appearance["channels"] = {"field": "fluid_pressure", "colours": "blue-red"}
    if shells and _varies(moment.of("liners"), "membrane_smallest"):
        appearance["liners"] = {"field": "membrane_smallest", "colours": "blue-red"}
    return ModelView(
        layers=tuple(
            Layer(object=name, visible=name not in HIDDEN, **appearance.get(name, {}))
            for name in OBJECTS if name in moment.objects
        )
    )  # fmt: skip


def telling(moment: Moment) -> str:
    """Return the most informative field of elements: displacement if they have moved, else stress if there is some,
    else temperature if it differs; "", their groups, if nothing has happened yet.
    """
    elements = moment.of("elements")
    if moment.displacement is not None and elements.count:
        most = np.nanmax(np.abs(moment.displacement()), initial=0.0)
        points = elements.read()[0]
        if most > STILL * max(float(np.nanmax(points) - np.nanmin(points)), 1e-300):
            return "displacement"
    for name in ("stress_min", "stress_mises", *(f"stress_{c}" for c in ("yy", "xx", "zz"))):
        if elements.has(name) and np.any(np.nan_to_num(elements.values(name, ""))):
            return name
    return "temperature" if _varies(elements, "temperature") else ""


def _varies(objects: Objects, name: str) -> bool:
    """Return whether there is such a field, and not of one value."""
    if not objects.has(name):
        return False
    values = objects.values(name, "")
    values = values[np.isfinite(values)]
    return bool(len(values)) and float(values.min()) < float(values.max())


def with_field(view: ModelView, moment: Moment, name: str, on: str | None = None, **appearance: Any) -> ModelView:
    """Return the view with objects coloured by a field; on: kind of object (default: the first with this field).
    appearance: further values of that layer. HpcdemError that names the fields there are.
    """
    having = [
        layer for layer in view.layers
        if layer.object in moment.objects and moment.of(layer.object).has(name)
    ]  # fmt: skip
    # In a file a column of joints stands for elements too, empty; one that is empty everywhere has no value yet.
    filled = [layer for layer in having if moment.of(layer.object).filled(name)] or having
    for layer in filled:
        if on in (None, layer.object):
            return view.with_layer(layer.label, field=name, visible=True, **appearance)
    if on is not None:
        objects = moment.of(on)
        if not any(layer.object == on for layer in view.layers):
            raise HpcdemError(f"the view does not show {on}")
        raise objects.lack(name, on)
    known = "; ".join(f"{kind}: {', '.join(objects.known())}" for kind, objects in moment.objects.items())
    near = hint(name, [word for objects in moment.objects.values() for word in objects.known()])
    raise HpcdemError(f"this frame has no field {name}{near}{' It' if near else '; it'} has {known or 'nothing'}")


def adjusted(
    view: ModelView, moment: Moment, name: str | None, on: str | None, appearance: Mapping[str, Any], **more: Any
) -> ModelView:
    """Return the view with objects coloured by a field (`with_field`), or without a field with another appearance of
    one kind of object; more: values of the view. HpcdemError for what the frame or the view does not have.
    """
    if name is not None:
        view = with_field(view, moment, name, on, **appearance)
    elif on is not None:
        moment.of(on)
        labels = [layer.label for layer in view.layers if layer.object == on]
        if not labels:
            raise HpcdemError(f"the view does not show {on}")
        plain = {"field": ""} if appearance.get("colour") else {}  # instead of the field of the default view
        for label in labels:
            view = view.with_layer(label, visible=True, **plain, **appearance)
    elif appearance:
        word = "range" if "limits" in appearance else next(iter(appearance))
        raise UsageError(f"{word} requires field or object")
    return view.changed(**more) if more else view


def seen_of(moment: Moment, view: ModelView) -> View:
    """The part of the plane: that of the view, else everything drawn, with a margin."""
    if view.camera is not None:
        return View(*view.camera)
    left, right, bottom, top = moment.extent(turn_of(moment, view), shift_of(moment, view.deformed))
    air = 0.03 * max(right - left, top - bottom, 1e-12)
    return View(left - air, right + air, bottom - air, top + air)


def turn_of(moment: Moment, view: ModelView) -> np.ndarray | None:
    """(3, 3) right, up and towards the eye; None in the plane. HpcdemError for words that are for space."""
    if moment.dim == 3:
        from hpcdem.post.view import space

        return space.turn_of(eye_of(view.eye))
    for word in ("eye", "section"):
        if getattr(view, word) != ModelView.model_fields[word].default:
            raise HpcdemError(f"{word} requires three dimensions; this frame has two")
    return None


def plane_of(moment: Moment, view: ModelView) -> tuple[np.ndarray, np.ndarray] | None:
    """A point of the plane that cuts bodies in space, and its normal into what is taken away; None without."""
    if moment.dim != 3 or not view.section:
        return None
    from hpcdem.post.view import space

    return space.taken(section_of(view.section), eye_of(view.eye))


def sliced(view: ModelView) -> bool:
    """Return whether of bodies in space only a cut is shown."""
    return bool(view.section) and section_of(view.section).alone


def scene(
    moment: Moment, view: ModelView, seen: View | None = None, only: Mapping[str, np.ndarray] | None = None
) -> Scene:
    """Put a view of a frame together. only: numbers of the objects that may be shown, by kind. HpcdemError for what the
    frame does not have."""
    seen = replace(seen_of(moment, view) if seen is None else seen, system=moment.units)
    shifted = shift_of(moment, view.deformed)
    plane = plane_of(moment, view)
    layers = [
        painted(moment, layer, seen, shifted, None if only is None else only.get(layer.object), plane, sliced(view))
        for layer in view.layers if layer.visible
    ]  # fmt: skip
    return Scene(moment, view, seen, layers, turn_of(moment, view))


def shift_of(moment: Moment, factor: float) -> np.ndarray | None:
    """(k, dim) [m] by which the points of elements are moved for the picture."""
    if factor == 1.0:
        return None
    if moment.displacement is None:
        raise HpcdemError("deformed: this frame has no displacements")
    return (factor - 1.0) * moment.displacement()


def chosen_rows(moment: Moment, layer: Layer, only: np.ndarray | None = None) -> np.ndarray:
    """The rows of the objects that a layer shows: by its filter, and by their numbers."""
    objects = moment.of(layer.object)
    mask = np.ones(objects.count, bool)
    if layer.filter.strip():
        mask &= chosen(layer.filter, objects.count, _Words(objects), lambda g, s: _members(objects, layer, g, s))
    if only is not None:
        if objects.number not in objects.fields:
            raise HpcdemError(f"range: {layer.object} have no numbers to select by")
        mask &= np.isin(objects.fields[objects.number], only)
    return np.flatnonzero(mask)


class _Words(Mapping[str, np.ndarray]):
    """Names that a filter can use: fields, lengths of vectors, and the place of an object."""

    def __init__(self, objects: Objects) -> None:
        self.objects = objects

    def __getitem__(self, name: str) -> np.ndarray:
        objects = self.objects
        if name in objects.fields:
            return np.asarray(objects.fields[name])
        if name == "id" and objects.number in objects.fields:
            return np.asarray(objects.fields[objects.number])
        axes = "xyz"[: objects.dim]
        if name in tuple(axes):
            return objects.centres()[:, axes.index(name)]
        if objects.has(name):
            return objects.values(name, "")
        raise KeyError(name)

    def __iter__(self) -> Any:
        return iter(dict.fromkeys([*"xyz"[: self.objects.dim], *self.objects.known()]))

    def __len__(self) -> int:
        return len(list(iter(self)))


def _members(objects: Objects, layer: Layer, group: str, set_name: str) -> np.ndarray:
    sets = {k.removeprefix("group_"): k for k in objects.names}
    if set_name and set_name not in sets:
        raise refusal(layer.filter, f"unknown set {set_name}; known: {', '.join(sets) or 'none'}")
    found = np.zeros(objects.count, bool)
    named = False
    for short, column in sets.items():
        if set_name in ("", short) and group in objects.names[column]:
            named = True
            found |= np.asarray(objects.fields[column]) == objects.names[column].index(group)
    if not named:
        known = sorted({name for names in objects.names.values() for name in names})
        raise refusal(layer.filter, f"unknown group {group}; known: {', '.join(known) or 'none'}")
    return found


def painted(
    moment: Moment, layer: Layer, seen: View, shifted: np.ndarray | None = None, only: np.ndarray | None = None,
    plane: tuple[np.ndarray, np.ndarray] | None = None, alone: bool = False,
) -> Painted:  # fmt: skip
    """One layer of a picture. alone: of bodies only what lies in the plane."""
    objects = moment.of(layer.object)
    rows = chosen_rows(moment, layer, only)
    result = Painted(
        layer,
        objects.kind,
        rows,
        (),
        np.zeros((0, 3)),
        np.zeros(0, np.int64),
        WIDTH.get(layer.object, 1.0) * layer.size,
    )
    if layer.field:
        _by_field(result, objects, moment)
    elif layer.colour:
        _one_colour(result, layer.colour)
    else:
        _as_usual(result, objects)
    rows = result.rows
    whole = objects.read()
    if objects.kind == DISCS:
        result.shape = _of(whole[0], rows), layer.size * _of(whole[1], rows)
    elif objects.kind == LINES:
        result.shape = (_of(whole[0], rows),)
    elif objects.kind in (SPOTS, RODS, BALLS):
        radius = 0.5 * result.width * POINT * max(seen.width, seen.height)
        if objects.kind == SPOTS:
            result.kind_of_shape, result.shape = DISCS, (whole[0][rows], np.full(len(rows), radius))
        else:
            from hpcdem.post.view import space

            made = space.rods if objects.kind == RODS else space.balls
            result.kind_of_shape, result.shape = RODS, made(whole[0][rows], radius, plane)
    else:
        points = whole[0] if shifted is None else whole[0] + shifted
        if objects.dim == 3:
            from hpcdem.post.view import space

            solid = objects.kind == SOLIDS
            result.shape = space.skin(points, whole[1], whole[2], rows, plane, alone) if solid else space.cut_faces(
                points, whole[1][rows, :3], plane
            )  # fmt: skip
        else:
            result.shape = points, _of(whole[1], rows)
    if layer.vectors:
        result.arrows = _arrows(moment, objects, result, seen)
    return result


def _of(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """values[rows], themselves where these are all."""
    return values if len(rows) == len(values) else values[rows]


def spans(moment: Moment, view: ModelView) -> dict[str, tuple[float, float]]:
    """Values of the first and the last colour of the field of each layer that has one and no limits: many frames share
    these."""
    found = {}
    for layer in view.layers:
        if layer.visible and layer.field and layer.span is None and layer.object in moment.objects:
            objects = moment.of(layer.object)
            if not objects.names.get(layer.field):
                values = objects.values(layer.field, layer.object)[chosen_rows(moment, layer)]
                found[layer.label] = _span(values, layer)
    return found


def shared(view: ModelView, moments: Iterable[Moment]) -> ModelView:
    """The view for many frames: one range of colours, and one length of arrows for all; of a field that is one value
    everywhere each frame finds its own."""
    found: dict[str, tuple[float, float]] = {}
    longest = {layer.label: layer.longest for layer in view.layers}
    for moment in moments:
        for label, (low, high) in spans(moment, view).items():
            before = found.get(label, (low, high))
            found[label] = min(low, before[0]), max(high, before[1])
        for layer in view.layers:
            vectors = moment.objects[layer.object].vectors if layer.object in moment.objects else {}
            if layer.visible and layer.vectors in vectors and not layer.longest:
                far = np.asarray(vectors[layer.vectors], float)[chosen_rows(moment, layer)]
                longest[layer.label] = max(longest[layer.label], _largest(lengths(far)))
    span = {label: {"limits": ends} for label, ends in found.items() if ends[0] < ends[1]}
    return view.changed(layers=[
        layer.model_dump() | {"longest": longest[layer.label]} | span.get(layer.label, {}) for layer in view.layers
    ])  # fmt: skip


def _largest(values: np.ndarray) -> float:
    return float(np.max(values, initial=0.0, where=np.isfinite(values)))


FEW = 0.01
"""Fraction of the values that may lie beyond each end of a colour bar, so that a single element does not take all
colours."""


def _span(values: np.ndarray, layer: Layer) -> tuple[float, float]:
    """Values that one in a hundred is below or above, of those above 0 where colours go by logarithms; with
    `limits` "full", and of whole numbers, the least and the greatest; (inf, -inf) without any.

    Where most objects have nothing (0 plastic strain), it is a hundredth of those that have something."""
    fit = values[np.isfinite(values) & ((values > 0.0) | (not layer.log))]
    if not len(fit):
        return np.inf, -np.inf
    least, greatest = float(fit.min()), float(fit.max())
    some = fit[fit != 0.0]
    sparse = len(some) < 0.5 * len(fit)
    some = some if sparse else fit
    beyond = int(FEW * (len(some) - 1))
    if layer.limits == "full" or values.dtype.kind != "f" or beyond < 1:
        return least, greatest
    some = np.partition(some, (beyond, len(some) - 1 - beyond))
    low, high = float(some[beyond]), float(some[len(some) - 1 - beyond])
    if sparse:
        low, high = min(low, 0.0), max(high, 0.0)
    return (low, high) if low < high else (least, greatest)


def _by_field(result: Painted, objects: Objects, moment: Moment) -> None:
    layer = result.layer
    values = _of(np.asarray(objects.values(layer.field, layer.object)), result.rows)
    names = objects.names.get(layer.field)
    if names and layer.span is None:
        _by_name(result, values, names, TRACES if layer.object == "faults" else CATEGORIES)
        return
    low, high = layer.span or _span(values, layer)
    values = values.astype(float, copy=False)
    if layer.log and not low < np.inf and len(values):
        raise HpcdemError(f"log: no value of {layer.field} is above 0")
    if not low <= high or low == high == 0.0:
        low, high = 0.0, 1.0
    elif low == high:  # one value: in the middle of the colours
        low, high = (low / 2.0, 2.0 * low) if layer.log else (low - 0.05 * abs(low), low + 0.05 * abs(low))
    slack = 1e-9 * (high - low)
    result.scale = Scale(
        layer.field.replace("_", " "), moment.unit_of(layer.field), low, high, layer.log, layer.colours,
        bool(((values < low - slack) & ((values > 0.0) | (not layer.log))).any()), bool((values > high + slack).any()),
    )  # fmt: skip
    result.values = values
    with np.errstate(invalid="ignore", divide="ignore"):
        place, ends = (np.log10(values), np.log10((low, high))) if layer.log else (values, np.array((low, high)))
        part = place - ends[0]
        part /= max(float(ends[1] - ends[0]), 1e-300)
        np.nan_to_num(part, copy=False, nan=0.0, posinf=1.0, neginf=0.0)
        part *= STEPS
        result.kind = np.clip(part, 0, STEPS - 1, out=part).astype(np.int64)
    result.kind[~(np.isfinite(place) | np.isposinf(values))] = STEPS
    if layer.log:
        result.kind[~(values > 0.0)] = STEPS
    result.shades = np.concatenate([shades_of(layer.colours), rgb([NOTHING])])


def _by_name(
    result: Painted, values: np.ndarray, names: Sequence[str], palette: Sequence[str] = CATEGORIES
) -> None:  # fmt: skip
    """Colours of groups."""
    there = [int(v) for v in np.unique(values) if 0 <= v < len(names)]
    result.shades = rgb([*palette, NOTHING])
    result.kind = np.where((values >= 0) & (values < len(names)), values % len(palette), len(palette))
    result.values = values.astype(float)
    result.legend = [(names[v], palette[v % len(palette)]) for v in there[:CLASSES]]
    if len(there) > CLASSES:
        result.legend.append((f"and {len(there) - CLASSES} more", NOTHING))
    elif there and (values < 0).any():
        result.legend.append(("in no group", NOTHING))


MIXED = 0.02
"""Fraction of the discs of a group from which on a colour is named in its legend."""


def _beds(objects: Objects, rows: np.ndarray, kind: np.ndarray) -> list[tuple[str, str]]:
    """Groups of discs with the colours that they have, both from the highest to the lowest; none of a single group of
    one colour."""
    names, group = objects.names["group"], np.asarray(objects.fields["group"])[rows].astype(np.int64)
    known = (group >= 0) & (group < len(names))
    count, height = np.zeros((2, len(names), len(colours.RGB)))
    np.add.at(count, (group[known], kind[known]), 1.0)
    np.add.at(height, (group[known], kind[known]), objects.centres()[rows, 1][known])
    legend = []
    for k in np.argsort(-height.sum(axis=1) / np.maximum(count.sum(axis=1), 1.0), kind="stable"):
        order = np.argsort(-height[k] / np.maximum(count[k], 1.0), kind="stable")
        shown = [c for c in order if count[k, c] > MIXED * count[k].sum()]
        if shown:
            legend.append((names[k], " ".join(_hex(colours.RGB[c]) for c in shown)))
    if len(legend) > CLASSES:
        return [*legend[:CLASSES], (f"and {len(legend) - CLASSES} more", NOTHING)]
    return legend if len(legend) > 1 or any(" " in shades for _, shades in legend) else []


def _hex(shade: np.ndarray) -> str:
    return "#" + "".join(f"{round(255.0 * part):02x}" for part in shade)


def _one_colour(result: Painted, colour: str) -> None:
    result.shades, result.kind = rgb([colour]), np.zeros(len(result.rows), np.int64)


def _as_usual(result: Painted, objects: Objects) -> None:
    """Particles and walls in the manual's colours, clumps each in its own, elements by their group, joints by mode."""
    name, rows = result.layer.object, result.rows
    if name in ("particles", "walls") and "color" in objects.fields:
        result.shades, result.kind = colours.RGB, colours.numbers(objects.fields["color"])[rows]
        if name == "particles" and len(rows) and "group" in objects.fields:
            result.legend = _beds(objects, rows, result.kind)
    elif name == "clumps":
        result.shades = rgb(CATEGORIES)
        result.kind = np.asarray(objects.fields["clump"])[rows].astype(np.int64) % len(CATEGORIES)
    elif name == "elements":
        sets = {column: np.asarray(objects.fields[column]) for column in objects.names}
        best = max(sets, key=lambda column: len(np.unique(sets[column])), default=None)
        if best is None:
            _one_colour(result, PALE[0])
        else:
            _by_name(result, sets[best][rows], objects.names[best], PALE)
    elif name == "joints":
        kinds = blocks._kinds(np.asarray(objects.fields["state"])[rows], np.asarray(objects.fields["mode"])[rows])
        shown = [part for part, *_ in kinds]
        result.rows = rows[np.concatenate([*shown, np.zeros(0, np.int64)])]
        result.kind = np.repeat(np.arange(len(kinds)), [len(part) for part in shown])
        result.shades = rgb([shade for _, shade, _, _ in kinds])
        result.legend = [(word, shade) for _, shade, _, word in reversed(kinds)]
    else:
        _one_colour(result, INK.get(name, "#202020"))


def _arrows(moment: Moment, objects: Objects, result: Painted, seen: View) -> tuple[np.ndarray, np.ndarray]:
    """Draw arrows from the middle of the objects; in space from that of their faces that are seen."""
    layer, rows = result.layer, result.rows
    if layer.vectors not in objects.vectors:
        known = ", ".join(objects.vectors) or "none"
        raise HpcdemError(f"{layer.object} have no vectors {layer.vectors} in this frame; known: {known}")
    if objects.dim == 3:
        from hpcdem.post.view import space

        points, cells, of, _ = result.shape
        at, rows = space.middles(points, cells), rows[of]
        some = np.arange(len(at))
    else:
        at = objects.centres()[rows]
        inside = (at[:, 0] >= seen.left) & (at[:, 0] <= seen.right) & (at[:, 1] >= seen.bottom) & (at[:, 1] <= seen.top)
        some = np.flatnonzero(inside)
    # One for each square with half of the longest arrow as side: where there are more nobody sees one.
    place = np.floor(at[some] / (0.5 * ARROW * seen.width))
    some = some[np.sort(np.unique(place, axis=0, return_index=True)[1])]
    some = some[:: max(1, -(-len(some) // MOST_ARROWS))]
    far = np.asarray(objects.vectors[layer.vectors], float)[rows][some]
    length = lengths(far)
    longest = layer.longest or _largest(length)
    shown = np.isfinite(length) & (length > 1e-3 * longest)
    factor = layer.arrows * ARROW * seen.width / max(longest, 1e-300)
    if longest > 0.0:
        value = _round(min(longest, LONGEST * seen.width / factor))
        value_text = units.printed(units.with_prefix(value, moment.unit_of(layer.vectors)))
        result.reference = Reference(f"{layer.vectors.replace('_', ' ')} {value_text}", factor * value)
    return at[some][shown], far[shown] * factor


def _round(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above this one."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(part * power for part in (0.5, 1.0, 2.0, 5.0) if part * power <= value * (1.0 + 1e-9))


def rgb(words: Sequence[str]) -> np.ndarray:
    """(n, 3) fractions of red, green and blue of "#rrggbb"."""
    return np.array([[int(word[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for word in words]).reshape(-1, 3)


def shades_of(name: str) -> np.ndarray:
    """(STEPS, 3) colours of a field."""
    from matplotlib import colormaps

    return np.asarray(colormaps[COLOURS[name]](np.linspace(0.0, 1.0, STEPS)))[:, :3]
