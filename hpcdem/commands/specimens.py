"""The files of a specimen: which there are, and how each is written. For the command line and the page."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.io.agreed import atomic_path, make_folder
from hpcdem.io.clumps import Clumps, write_clumps
from hpcdem.io.ppdem import write_ppdem
from hpcdem.post import specimen as draw
from hpcdem.post.measure.figures import save
from hpcdem.pre.specimen import Specimen
from hpcdem.pre.specimen.discs import GAP, Discs
from hpcdem.pre.specimen.files import to_clumps, to_ppdem, xyr
from hpcdem.pre.specimen.scripts import biaxial, deposit
from hpcdem.pre.specimen.shapes import SIDES

MM = 1e3
Writer = Callable[[Path], object]


@dataclass(frozen=True)
class Style:
    """Format of the files. layout, angle_factor: of the PPDEM file ("full": polygons with the roundness of their
    edges); gap: distance between outlines and discs of clumps over the grain size; formats: of the figures; falling:
    bool, sizes of the grading curve decrease to the right.
    """

    layout: str = "sample"
    angle_factor: float = 1.0
    gap: float = GAP
    formats: tuple[str, ...] = ("png",)
    falling: bool = False


@dataclass(frozen=True)
class Outputs:
    """A specimen and the files that describe it."""

    specimen: Specimen
    style: Style = field(default_factory=Style)

    @cached_property
    def clumps(self) -> tuple[Clumps, Discs]:
        """Discs that fill the outlines, for shapes other than circles."""
        return to_clumps(self.specimen, self.style.gap)

    @cached_property
    def files(self) -> dict[str, Writer]:
        """Return the name of each file and the function that writes it to a path."""
        made, style = self.specimen, self.style
        layout = "sample" if style.layout == "full" and made.request.shape not in SIDES else style.layout
        grains: Writer = lambda path: write_ppdem(path, to_ppdem(made), layout, style.angle_factor)  # noqa: E731
        found: dict[str, Writer] = {"specimen.dat": grains}
        if made.request.shape == "circle":
            found["specimen.xyr"] = lambda path: write_text(path, xyr(made))
        else:
            found["specimen.clumps"] = lambda path: write_clumps(path, self.clumps[0])
        found["grading.csv"] = lambda path: write_text(path, self.table())
        found["deposit.py"] = lambda path: write_text(path, deposit(made))
        found["biaxial.py"] = lambda path: write_text(path, biaxial(made))
        found["specimen.json"] = lambda path: write_text(path, json.dumps(self.summary(), indent=2) + "\n")
        for name, figure in self._figures().items():
            for suffix in style.formats:
                found[f"{name}.{suffix}"] = partial(_draw, figure)
        return found

    def write(self, folder: Path) -> list[Path]:
        """Write all files into a folder, each complete or not at all. Raises HpcdemError."""
        make_folder(folder, SerialComm())
        paths = []
        for name, writer in self.files.items():
            writer(folder / name)
            paths.append(folder / name)
        return paths

    def _figures(self) -> dict[str, Callable[[], Any]]:
        made, rows = self.specimen, self.specimen.rows
        by_area, target = made.achieved.percent, made.grading.percent
        reached = made.achieved
        numbers = [
            ("Cu", made.grading.uniformity, reached.uniformity),
            ("Cc", made.grading.curvature, reached.curvature),
        ]
        sizes = made.grading.sizes
        return {
            "grading": lambda: draw.grading_curve(sizes, by_area, target, numbers, self.style.falling),
            "packing": lambda: draw.packing(
                made.outlines, made.class_of, sizes, made.density.room, (made.width, made.height)
            ),
            "sizes": lambda: draw.histogram(sizes, made.counts, np.array([row.exact for row in rows])),
        }

    def table(self) -> str:
        """The classes as CSV."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(
            ["size[mm]", "finer_target[%]", "finer_by_number[%]", "finer_by_area[%]", "exact", "grains", "needed"]
        )
        for r in self.specimen.rows:
            needed = math.ceil(r.needed * (1.0 - 1e-12)) if math.isfinite(r.needed) else ""
            values = (r.size, r.target, r.by_number, r.by_area, r.exact)
            writer.writerow([*(f"{v:.10g}" for v in values), r.count, needed])
        return text.getvalue()

    def summary(self) -> dict[str, Any]:
        """Return request and result as JSON values; lengths in mm."""
        made = self.specimen
        asked, d = made.request, made.density
        facts: dict[str, Any] = {
            "shape": asked.shape,
            "grains": len(made),
            "seed": asked.seed,
            "placement": asked.placement,
            "slenderness": asked.slenderness,
            "mass_exponent": asked.mass_exponent,
        }
        if asked.shape == "ellipse":
            facts |= {"l_over_d": asked.l_over_d, "size_rule": asked.size_rule}
        elif asked.shape in SIDES:
            facts |= {"deviation": asked.deviation, "roundness": asked.roundness}
        facts |= {
            "box": {"width": made.width * MM, "height": made.height * MM},
            "room": {"width": d.room[0] * MM, "height": d.room[1] * MM},
            "solid_area": float(made.area.sum()) * MM**2,
            "void_ratio": {"target": asked.void_ratio, "reached": d.void_ratio},
            "added": d.added,
            "moved": d.moved,
            "sweeps": d.sweeps,
            "Cu": {"target": _known(made.grading.uniformity), "reached": _known(made.achieved.uniformity)},
            "Cc": {"target": _known(made.grading.curvature), "reached": _known(made.achieved.curvature)},
            "classes": [
                {
                    "size": r.size, "finer_target": r.target, "finer_by_number": r.by_number,
                    "finer_by_area": r.by_area, "exact": r.exact, "grains": r.count, "needed": _known(r.needed),
                }
                for r in made.rows
            ],
        }  # fmt: skip
        if asked.shape != "circle":
            clumps, discs = self.clumps
            number = len(clumps.r) / len(clumps)
            worst = float((discs.gap / made.size).max())
            facts["clumps"] = {
                "discs": len(clumps.r), "discs_per_grain": number, "coverage": float(discs.coverage.mean()),
                "least_coverage": float(discs.coverage.min()), "largest_gap_over_size": worst,
            }  # fmt: skip
        return facts


def _draw(figure: Callable[[], Any], path: Path) -> None:
    save(figure(), path)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def write_text(path: str | os.PathLike, text: str) -> None:
    """Write a text file, complete or not at all."""
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.write(text)
