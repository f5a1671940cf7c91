"""Colour tables in the format of the Generic Mapping Tools (CPT, GMT 4 and 5), and those of zdemss.

A line `z0 colour z1 colour` is a *slice*: the colour runs linearly from z0 to z1, in the colour model of the table.
A line `key colour` gives one value its colour. Format: GMT Technical Reference, "Color palette tables".
"""

from __future__ import annotations

import colorsys
import itertools
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hpcdem.core.errors import UsageError

RGB, HSV, CMYK = "RGB", "HSV", "CMYK"
RANGES = {RGB: (255.0,) * 3, HSV: (360.0, 1.0, 1.0), CMYK: (100.0,) * 4}
"""Largest value of each component of a colour in a file; 0 is the smallest."""
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
Colour = tuple[float, ...] | None
"""Components as fractions of their largest value; None: nothing is painted (a dash in the file)."""

# X11 names, as in GMT, that mean something else in the style sheets from which matplotlib has its list.
_X11: dict[str, str | float] = {
    "gray": 190 / 255,
    "grey": 190 / 255,
    "green": "#00ff00",
    "maroon": "#b03060",
    "purple": "#a020f0",
}


@dataclass(frozen=True)
class Slice:
    """Colours between two values, or of one value (low == high). label: its text on the colour bar; annotated: L, U or
    B if the table annotates its lower, upper or both limits.
    """

    low: float
    high: float
    first: Colour
    last: Colour
    label: str = ""
    annotated: str = ""


@dataclass(frozen=True)
class ColourTable:
    """Colours of numbers. below, above: red, green, blue (0..1) of values outside the slices; notes: settings of the
    file that have no effect. NaN is not painted: a section is white where there is no material.
    """

    name: str
    slices: tuple[Slice, ...]
    model: str = RGB
    below: Colour = BLACK
    above: Colour = WHITE
    notes: tuple[str, ...] = field(default=(), compare=False)

    @property
    def categorical(self) -> bool:
        """Return whether the table colours single values (categories) instead of intervals."""
        return self.slices[0].low == self.slices[0].high

    @property
    def breaks(self) -> np.ndarray:
        """Limits of the slices (n + 1,), or the n values of a categorical table."""
        low = [s.low for s in self.slices]
        return np.array(low if self.categorical else [*low, self.slices[-1].high])

    def position(self, values: np.ndarray) -> np.ndarray:
        """Locate values on a colour bar on which every slice is one unit long (NaN outside the table).

        Piecewise linear between the breaks; a categorical value lies in the middle of its unit.
        """
        values = np.asarray(values, dtype=float)
        n = np.arange(len(self.slices) + 1.0)
        if self.categorical:
            found, place = self._category(values)
            return np.where(found, place + 0.5, np.nan)
        return np.interp(values, self.breaks, n, left=np.nan, right=np.nan)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """Return red, green and blue (0..1) of values of any shape, (..., 3); NaN where nothing is painted, as for
        values that are NaN.
        """
        values = np.asarray(values, dtype=float)
        if self.categorical:
            inside, place = self._category(values)
            part = np.zeros(values.shape)
        else:
            breaks = self.breaks
            inside = (values >= breaks[0]) & (values <= breaks[-1])
            place = np.clip(np.searchsorted(breaks, values, side="right") - 1, 0, len(self.slices) - 1)
            part = (np.where(inside, values, breaks[0]) - breaks[place]) / np.diff(breaks)[place]
            part = np.where(inside, part, 0.0)[..., None]
        blank = (np.nan,) * len(RANGES[self.model])
        first, last = (np.array([blank if c is None else c for c in ends]) for ends in zip(*self._ends()))
        mixed = to_rgb((1.0 - part) * first[place] + part * last[place] if not self.categorical else first[place],
                       self.model)  # fmt: skip
        result = np.where(inside[..., None], mixed, np.nan)
        if not self.categorical:
            for outside, colour in ((values < self.breaks[0], self.below), (values > self.breaks[-1], self.above)):
                result[outside] = np.nan if colour is None else colour
        return result

    def stretched(self, low: float, high: float) -> ColourTable:
        """Scale this table to another range."""
        a, b = self.breaks[[0, -1]]

        def moved(z: float) -> float:
            return low + (z - a) / (b - a) * (high - low)

        slices = tuple(Slice(moved(s.low), moved(s.high), s.first, s.last, s.label, s.annotated) for s in self.slices)
        return replace(self, slices=slices)

    def _ends(self) -> list[tuple[Colour, Colour]]:
        return [(s.first, s.last) for s in self.slices]

    def _category(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        keys = self.breaks
        order = np.argsort(keys)
        place = order[np.clip(np.searchsorted(keys[order], values), 0, len(keys) - 1)]
        return keys[place] == values, place


def to_rgb(colours: np.ndarray, model: str) -> np.ndarray:
    """Red, green, blue (..., 3) of colours (..., 3 or 4) of another model, all 0..1."""
    if model == HSV:
        hue, saturation, value = np.moveaxis(colours, -1, 0)
        # Each channel falls off from `value` with the distance of the hue from its own.
        k = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[..., None]) % 6.0
        fall = np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0)
        return value[..., None] * (1.0 - saturation[..., None] * fall)
    if model == CMYK:
        return (1.0 - colours[..., :3]) * (1.0 - colours[..., 3:])
    return colours


def from_rgb(colour: Sequence[float], model: str) -> tuple[float, ...]:
    """Components of a colour given as red, green, blue, all 0..1."""
    r, g, b = colour
    if model == HSV:
        return colorsys.rgb_to_hsv(r, g, b)
    if model == CMYK:
        black = 1.0 - max(r, g, b)
        return (*((1.0 - c - black) / (1.0 - black) if black < 1.0 else 0.0 for c in (r, g, b)), black)
    return (r, g, b)


# -- reading ------------------------------------------------------------------------------------------------------


def read_cpt(path: str | os.PathLike) -> ColourTable:
    """Read the colour table of a file. Raises UsageError naming file and line."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as failure:
        raise UsageError(f"cannot read the colour table {os.fspath(path)}: {failure.strerror}") from None
    return parse_cpt(text, os.fspath(path))


def parse_cpt(text: str, name: str = "colour table") -> ColourTable:
    """Parse the colour table in a text; `name` is for messages. Raises UsageError naming the line."""
    model, notes = _comments(text)
    slices: list[Slice] = []
    outside: dict[str, Colour] = {}
    for number, line in enumerate(text.splitlines(), 1):
        try:
            words, label = _words(line)
            if not words:
                continue
            if words[0] in ("B", "F", "N"):
                colour = _colour(words[1:], model)
                outside[words[0]] = None if colour is None else tuple(to_rgb(np.array(colour), model))
                continue
            new = _slice(words, label, model)
            if slices:
                _fits(slices, new)
            slices.append(new)
        except ValueError as problem:
            raise UsageError(f"{name}:{number}: {problem}") from None
    if not slices:
        raise UsageError(f"{name}: no colours in this table: expected lines `z0 r g b z1 r g b`")
    below, above = outside.get("B", BLACK), outside.get("F", WHITE)
    return ColourTable(name, tuple(slices), model, below, above, tuple(notes))


def _comments(text: str) -> tuple[str, list[str]]:
    """The colour model, wherever in the file it stands, and notes on comments that would mean something to GMT."""
    model, notes = RGB, []
    for line in text.splitlines():
        if found := re.match(r"#\s*COLOR_MODEL\s*=\s*\+?\s*(RGB|HSV|CMYK)\b", line, re.IGNORECASE):
            model = found[1].upper()
        elif found := re.match(r"#\s*((?:HARD_|SOFT_)?HINGE|RANGE|CYCLIC)\b", line, re.IGNORECASE):
            notes.append(f"{found[1].upper()} is ignored: values of the table are used unchanged")
    return model, notes


def _words(line: str) -> tuple[list[str], str]:
    """The words of a line without its comment, and the label behind a semicolon."""
    if line.lstrip().startswith("#"):
        return [], ""
    data, _, label = line.partition(";")
    if not label:
        data = re.split(r"\s#(?![0-9A-Fa-f]{6}\b)", data)[0]
    return data.split(), label.strip()


def _slice(words: list[str], label: str, model: str) -> Slice:
    annotated = words.pop().upper() if len(words) > 2 and words[-1].upper() in ("L", "U", "B") else ""
    if len(words) == 2:  # key colour
        key, colour = _number(words[0], "a value"), _colour(words[1:], model)
        return Slice(key, key, colour, colour, label, annotated)
    if len(words) not in (4, 8, 10):
        raise ValueError(
            f"{len(words)} words; expected `z0 r g b z1 r g b`, `z0 colour z1 colour` or `key colour`"
            " (c m y k instead of r g b where COLOR_MODEL = CMYK)"
        )
    half = len(words) // 2
    if half == 5 and model != CMYK:
        raise ValueError("four numbers per colour need the line `# COLOR_MODEL = CMYK`")
    if half == 4 and model == CMYK:
        raise ValueError("COLOR_MODEL = CMYK needs four numbers per colour")
    low, high = _number(words[0], "z0"), _number(words[half], "z1")
    if not low < high:
        raise ValueError(f"z1 = {high:g} must be larger than z0 = {low:g}")
    first, last = _colour(words[1:half], model), _colour(words[half + 1 :], model)
    return Slice(low, high, first, first if last is None else last, label, annotated)


def _fits(slices: list[Slice], new: Slice) -> None:
    """ValueError unless the new slice begins where the last one ended."""
    last = slices[-1]
    if (last.low == last.high) != (new.low == new.high):
        raise ValueError("a table contains either slices or single values")
    if new.low == new.high:
        if any(s.low == new.low for s in slices):
            raise ValueError(f"the value {new.low:g} already has a colour")
    elif new.low != last.high:
        raise ValueError(f"this slice begins at {new.low:g}, the one before ends at {last.high:g}")


def _number(word: str, what: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise ValueError(f"{word} is not a number; expected {what}") from None
    if not np.isfinite(value):
        raise ValueError(f"{word} is not a finite number; expected {what}")
    return value


def _colour(words: Sequence[str], model: str) -> Colour:
    """A colour of a table: components in its model, a dash, or one word of any other form that GMT knows."""
    if not words:
        raise ValueError("expected a colour")
    if len(words) > 1:
        return _components(words, model)
    word = words[0]
    if word == "-":
        return None
    if re.fullmatch(r"[pP]\d+/\S+", word):
        raise ValueError(f"{word}: patterns cannot be drawn here; expected a colour")
    if "/" in word:
        parts = word.split("/")
        own = CMYK if len(parts) == 4 else HSV if model == HSV else RGB
        return _converted(_components(parts, own), own, model)
    if re.fullmatch(r"[\d.]+-[\d.]+-[\d.]+", word):
        return _converted(_components(word.split("-"), HSV), HSV, model)
    if re.fullmatch(r"[-+.\d].*", word):
        return _converted(_components([word] * 3, RGB), RGB, model)
    return from_rgb(_named(word), model)


def _components(words: Sequence[str], model: str) -> tuple[float, ...]:
    largest = RANGES[model]
    if len(words) != len(largest):
        raise ValueError(f"{' '.join(words)}: a colour of {model} has {len(largest)} numbers")
    values = [_number(word, f"a component of {model}") for word in words]
    for value, most in zip(values, largest):
        if not 0.0 <= value <= most:
            raise ValueError(f"{value:g} is not a component of {model}, which ranges from 0 to {most:g} here")
    return tuple(value / most for value, most in zip(values, largest))


def _converted(colour: tuple[float, ...], own: str, model: str) -> tuple[float, ...]:
    return colour if own == model else from_rgb(to_rgb(np.array(colour), own).tolist(), model)


def _named(word: str) -> tuple[float, ...]:
    """Red, green, blue (0..1) of #RRGGBB, gray0 to gray100 or a name."""
    from matplotlib.colors import to_rgb as named

    name = word.lower()
    if found := re.fullmatch(r"gr[ae]y(\d{1,3})", name):
        if int(found[1]) <= 100:
            return (int(found[1]) / 100,) * 3
    elif name in _X11:
        known = _X11[name]
        return named(known) if isinstance(known, str) else (known,) * 3
    elif name.startswith("#") or len(name) > 2:  # not matplotlib's letters
        try:
            return named(name)
        except ValueError:
            pass
    raise ValueError(f"{word} is not a colour: expected r g b, r/g/b, a grey of 0 to 255, #RRGGBB or a name")


# -- the tables of zdemss -----------------------------------------------------------------------------------------


def _white_in_the_middle(name: str, breaks: Sequence[float]) -> ColourTable:
    """Blue over white to red, over eleven values; black outside (zdemss of ZDEM, manual chapter 7)."""
    shades = (
        (0, 0, 136), (0, 20, 160), (0, 40, 204), (0, 100, 255), (153, 255, 255), (255, 255, 255), (255, 255, 153),
        (255, 100, 0), (204, 40, 0), (160, 20, 0), (136, 0, 0),
    )  # fmt: skip
    colours = [tuple(c / 255.0 for c in shade) for shade in shades]
    slices = (Slice(*z, *c) for z, c in zip(itertools.pairwise(breaks), itertools.pairwise(colours)))
    return ColourTable(name, tuple(slices), above=BLACK)


INVAR = _white_in_the_middle("invar", (-10000, -20, -1, -0.1, -0.03, 0, 0.02, 0.3, 1, 20, 10000))
INVAR2 = _white_in_the_middle("invar2", (-16000, -800, -80, -4.8, -0.16, 0, 0.16, 4.8, 80, 800, 16000))
VOLUME = _white_in_the_middle("volume", (-100, -70, -30, -10, -3, 0, 2, 30, 100, 2000, 1e6))
"""Colours of volumetric strain in per cent: the steps of INVAR for increases; a volume cannot decrease by more than 100
%."""


def stress_table(most: float) -> ColourTable:
    """Dark blue, blue, cyan, yellow, red, dark red from 0 to `most`; values outside take the colour of the end."""
    places = (0.0, 0.125, 0.375, 0.625, 0.875, 1.0)
    shades = ((0.0, 0.0, 0.5), (0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.0, 0.0))
    slices = (Slice(*z, *c) for z, c in zip(itertools.pairwise(places), itertools.pairwise(shades)))
    return ColourTable("stress", tuple(slices), below=shades[0], above=shades[-1]).stretched(0.0, most)
