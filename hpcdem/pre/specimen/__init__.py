"""Make specimens from a grading curve: numbers of grains of each size, their outlines and positions.

    specimen = make_specimen(Request(sizes=(10, 5, 1, 0.5), percents=(100, 95, 75, 60), shape="triangle"))

Functions of arrays; everything is a function of the request, its seed included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import Outlines, sampled
from hpcdem.pre.specimen import counts as number_of
from hpcdem.pre.specimen.cells import in_cells, order
from hpcdem.pre.specimen.dense import pack
from hpcdem.pre.specimen.grading import Grading, grading, parse_grading, read_grading
from hpcdem.pre.specimen.shapes import ANGLE, APPLIES, SHAPES, SIZE_RULES, bodies, check_shape, numbers

__all__ = [
    "MOST", "PLACEMENTS", "SHAPES", "SIZE_RULES", "ClassRow", "Density", "Grading", "Outlines", "Request", "Specimen",
    "make_specimen", "parse_grading", "read_grading", "sampled",
]  # fmt: skip

PLACEMENTS = ("cells", "dense")
MOST = 1_000_000
"""Largest number of grains of a specimen."""
MM = 1e-3


@dataclass(frozen=True)
class Request:
    """Specification of a specimen. Raises CommandError if it is invalid.

    sizes [mm] and percents (mass finer) are the rows of the grading, in descending or ascending order. Give either
    `number`, the number of grains, which determines the box, or `width` of the box [m] with number None. slenderness:
    height over width of the box; void_ratio: area of voids over area of grains in the box. mass_exponent: 2, or 3 for
    the numbers of a sieve curve of real grains. placement: "cells", a loose column, or "dense", within the box. cell:
    size of a cell over the largest grain.
    """

    sizes: tuple[float, ...]
    percents: tuple[float, ...]
    shape: str = "circle"
    number: int | None = 200
    width: float | None = None
    slenderness: float = 2.0
    void_ratio: float = 0.5
    l_over_d: float = 1.5
    size_rule: str = "major"
    deviation: float = 0.0
    roundness: float = 0.0
    mass_exponent: int = 2
    placement: str = "dense"
    cell: float = 2.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("sizes", "percents"):
            object.__setattr__(self, name, tuple(float(v) for v in getattr(self, name)))
        grading(self.sizes, self.percents)
        check_shape(self.shape, self.l_over_d, self.size_rule, self.deviation, self.roundness)
        for name, shapes in APPLIES.items():
            if self.shape not in shapes and getattr(self, name) != type(self).__dataclass_fields__[name].default:
                raise CommandError(
                    f"{name.replace('_', ' ')} {getattr(self, name)} applies to {', '.join(shapes)} grains, not to "
                    f"{self.shape} grains; omit it"
                )
        if (self.number is None) == (self.width is None):
            raise CommandError("expected either the number of grains or the width of the box")
        if self.number is not None and not 1 <= self.number <= MOST:
            raise CommandError(f"number of grains {self.number}, expected 1 to {MOST}")
        for name, low, high in (("width", 0.0, 1e9), ("slenderness", 0.0, 1e3), ("void_ratio", 0.0, 1e3)):
            value = getattr(self, name)
            if value is not None and not low < value <= high:
                raise CommandError(
                    f"{name.replace('_', ' ')} {value:g}, expected a number above {low:g}, at most {high:g}"
                )
        if self.mass_exponent not in (2, 3):
            raise CommandError(f"mass exponent {self.mass_exponent}, expected 2 (area) or 3 (volume)")
        if self.placement not in PLACEMENTS:
            raise CommandError(f"placement '{self.placement}', expected one of {', '.join(PLACEMENTS)}")
        if not 1.0 <= self.cell <= 100.0:
            raise CommandError(f"cell {self.cell:g} times the largest grain, expected 1 to 100")
        if not 0 <= self.seed < 2**63:
            raise CommandError(f"seed {self.seed}, expected a whole number from 0 to below 2^63")


@dataclass(frozen=True)
class ClassRow:
    """One size of the grading. size [mm]; target, by_number and by_area: per cent finer as requested, from the whole
    grains of each class, and from their true areas; exact: grains before rounding; count: whole grains; needed: number
    of grains in all for one of this class (infinite if it has no share)."""

    size: float
    target: float
    by_number: float
    by_area: float
    exact: float
    count: int
    needed: float


@dataclass(frozen=True)
class Density:
    """Result of placing the grains. room [m]: width and height of the rectangle that contains them; void_ratio of that
    rectangle; added: grains that fitted into free space; moved: grains for which others were displaced; sweeps: rounds
    of that displacement; raised: height of the rectangle over that of the box."""

    room: tuple[float, float]
    void_ratio: float
    added: int
    moved: int = 0
    sweeps: int = 0
    raised: float = 1.0


@dataclass(frozen=True)
class Specimen:
    """Grains in their positions, in the order of the files.

    class_of (n,) i8: row of the grading; size (n,) f8 [m]; body: outlines about (0, 0) at angle 0; x, y (n,) [m] and
    angle (n,) [rad] put them in their places; reach (n,) [m]: circle about (x, y) that holds the grain. width, height
    [m]: the box of the requested void ratio, whose lower left corner is the origin.
    """

    request: Request
    grading: Grading
    class_of: np.ndarray
    size: np.ndarray
    body: Outlines
    x: np.ndarray
    y: np.ndarray
    angle: np.ndarray
    reach: np.ndarray
    width: float
    height: float
    density: Density
    notes: tuple[str, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.x)

    @cached_property
    def outlines(self) -> Outlines:
        """The outlines in their positions."""
        return self.body.placed(self.x, self.y, self.angle)

    @cached_property
    def moments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Area [m2], centroid x, y [m], polar second moment of area about the centroid [m4] of each grain."""
        return moments(self.outlines)

    @property
    def area(self) -> np.ndarray:
        """Area of each grain (n,) [m2]."""
        return self.moments[0]

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of grains of each class (m,)."""
        return np.bincount(self.class_of, minlength=len(self.grading.sizes))

    @cached_property
    def rows(self) -> list[ClassRow]:
        """The table of the classes, largest first."""
        g, q = self.grading, self.request.mass_exponent
        # An area stands for d^2; with q = 3 the grain it stands for has that much more mass.
        by_area = np.bincount(self.class_of, self.area * self.size ** (q - 2), len(g.sizes))
        columns = (
            g.sizes, g.percent, number_of.percent_finer(self.counts * g.sizes**q), number_of.percent_finer(by_area),
            number_of.exact_counts(g, len(self), q), self.counts, number_of.needed(g, q),
        )  # fmt: skip
        return [ClassRow(*row) for row in zip(*(c.tolist() for c in columns))]

    @property
    def achieved(self) -> Grading:
        """The grading by true areas."""
        return Grading(self.grading.sizes, np.array([row.by_area for row in self.rows]))


def make_specimen(request: Request) -> Specimen:
    """Make the grains of a request. Raises CommandError if the box cannot contain them."""
    curve = grading(request.sizes, request.percents)
    if request.number is not None:
        return _made(request, curve, request.number, None)
    assert request.width is not None
    # The mean area of a grain follows from the classes' shares, the shape's mean from those grains.
    space = request.slenderness * request.width**2 / (1.0 + request.void_ratio)
    share = number_of.weights(curve, request.mass_exponent)
    circle = 0.25 * math.pi * float(share @ (curve.sizes * MM) ** 2)
    unit, _ = _bodies(request, np.ones(1000))
    wanted = space / (circle * float(moments(unit)[0].mean()) / (0.25 * math.pi))
    if not 0.5 <= wanted <= MOST:
        raise CommandError(f"a box {request.width:g} m wide contains {wanted:.3g} such grains, expected 1 to {MOST}")
    return _made(request, curve, max(1, round(wanted)), request.width)


def _bodies(request: Request, size: np.ndarray) -> tuple[Outlines, np.ndarray]:
    return bodies(
        request.shape, size, request.l_over_d, request.size_rule, request.deviation, request.roundness, request.seed
    )


def _made(request: Request, curve: Grading, number: int, width: float | None) -> Specimen:
    count = number_of.counts(curve, number, request.mass_exponent)
    class_of = np.repeat(np.arange(len(count)), count)
    if request.placement == "cells":
        class_of = class_of[order(number, request.seed)]
    size = curve.sizes[class_of] * MM
    body, reach = _bodies(request, size)
    solid = float(moments(body)[0].sum())
    if width is None:
        width = math.sqrt(solid * (1.0 + request.void_ratio) / request.slenderness)
    height = request.slenderness * width
    angle = 2.0 * math.pi * numbers(request.seed, ANGLE, number)
    if request.shape == "circle":
        angle[:] = 0.0
    widest = 2.0 * float(reach.max())
    if widest > width or (request.placement == "dense" and widest > height):
        raise CommandError(
            f"the box is {width / MM:.4g} mm wide and {height / MM:.4g} mm high, the largest grain {widest / MM:.4g} "
            "mm long: use more grains, or another slenderness"
        )
    if request.placement == "cells":
        x, y, tall = in_cells(reach, width, request.cell, request.seed)
        density = Density((width, tall), width * tall / solid - 1.0, number)
    else:
        x, y, angle, tall, added, sweeps = pack(body, reach, angle, width, height, request.seed)
        density = Density((width, tall), width * tall / solid - 1.0, added, number - added, sweeps, tall / height)
    return Specimen(request, curve, class_of, size, body, x, y, angle, reach, width, height, density)
