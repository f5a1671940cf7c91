"""A section: stress and strain of one frame, on a grid and on its particles, and the file it is kept in.

Signs: stress positive in compression, dilatation positive for growth, distortional strain positive for clockwise
(top-to-the-right) shear. SI units throughout; volumetric strain in per cent. NaN where there is no material.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path
from hpcdem.post import grid as grids
from hpcdem.post.surface import bed

UNITS = {
    "volumetric": "%",
    "distortional": "1",
    "mean": "Pa",
    "shear": "Pa",
    "sxx": "Pa",
    "sxy": "Pa",
    "syy": "Pa",
    "direction": "rad",
}
"""The fields on the grid: 100 (det F - 1); s sqrt(J2) of the Lagrangian deviator, with the sign of the sense of shear;
mean stress (s1 + s2) / 2 and largest shear stress (s1 - s2) / 2; the components of the stress; the angle of s1."""
PARTICLE_FIELDS = (
    "gid", "x", "y", "radius", "color", "pxx", "pxy", "pyy", "fxx", "fxy", "fyx", "fyy", "volumetric", "distortional",
    "fixed",
)  # fmt: skip
"""Columns of the particles: pseudo stress p [Pa] (force moments over the particle's own volume), deformation gradient F
since the first section in which the particle was (identity there), strains of F; whether it is fixed along x and y."""
VERSION = 1
MEAN, NEAREST, PAGE = VOLUMES = ("mean", "nearest", "page")
"""Volumetric strain of the nodes: mean of what lies around a node; that of the nearest particle; as the manual's pages
draw it (`strain.page_volume`)."""


@dataclass
class Section:
    """One frame. name: of its file, without suffix; size: grid spacing [m]; x (nx,), y (ny,): nodes [m]; fields: by
    UNITS, each (ny, nx); particles: by PARTICLE_FIELDS, each (n,), in the order of ids; surface (m, 2): line over the
    top [m]; walls: id, p1, p2, color; smooth: whether strains are means around each node, or those of the nearest
    particle; average: length over which means are taken [m], 0: `size`; volume: how the volumetric strain of the nodes
    is made, of VOLUMES."""

    name: str
    step: int
    time: float
    size: float
    x: np.ndarray
    y: np.ndarray
    fields: dict[str, np.ndarray]
    particles: dict[str, np.ndarray]
    surface: np.ndarray
    walls: dict[str, np.ndarray] = field(default_factory=dict)
    smooth: bool = True
    average: float = 0.0
    volume: str = NEAREST

    def __post_init__(self) -> None:
        self.average = self.average or self.size
        self.particles.setdefault("fixed", np.zeros(len(self.particles["x"]), bool))  # files of 0.1 do not have it

    @cached_property
    def bed(self) -> np.ndarray:
        """(n,): the particles that fields, surface and limits are of: neither fixed ones nor flying bits."""
        return bed(*(self.particles[name] for name in ("x", "y", "radius", "fixed")))

    def mean_strain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x (nx,), y (ny,) [m] and the distortional strain (ny, nx), the mean of the particles nearer than `average` to
        nodes as far apart: without the scatter from particle to particle."""
        if self.smooth:
            return self.x, self.y, self.fields["distortional"]
        p = self.particles
        known = np.isfinite(p["distortional"]) & self.bed
        x, y, strain = (p[name][known] for name in ("x", "y", "distortional"))
        if not len(x):
            return self.x, self.y, self.fields["distortional"]
        grid = grids.cover(self.average, x, y, p["radius"][known])
        total = grids.sums(grid, x, y, {"strain": strain}, 1.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return grid.x, grid.y, total["strain"] / total["number"]

    @property
    def initial(self) -> bool:
        """Return whether this is the frame before the first step of a command."""
        return self.name.endswith("_ini")


def write_section(section: Section, path: str | os.PathLike) -> Path:
    """Write a section as .npz, complete or not at all."""
    path = Path(path)
    arrays: dict[str, Any] = {
        "version": np.int64(VERSION),
        "name": np.array(section.name),
        "step": np.int64(section.step),
    }
    arrays |= {"time": np.float64(section.time), "size": np.float64(section.size), "x": section.x, "y": section.y}
    arrays |= {"surface": section.surface, "smooth": np.bool_(section.smooth), "average": np.float64(section.average)}
    arrays["volume"] = np.array(section.volume)
    arrays |= {f"field_{name}": values for name, values in section.fields.items()}
    arrays |= {f"particle_{name}": values for name, values in section.particles.items()}
    arrays |= {f"wall_{name}": values for name, values in section.walls.items()}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)  # digits of measured numbers do not compress, and that takes seconds
    return path


def read_section(path: str | os.PathLike) -> Section:
    """Read what `write_section` wrote; HpcdemError for anything else."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if int(arrays["version"]) != VERSION:
            raise HpcdemError(f"{path}: section of version {int(arrays['version'])}, this program reads {VERSION}")

        def part(head: str) -> dict[str, np.ndarray]:
            return {name.removeprefix(head): values for name, values in arrays.items() if name.startswith(head)}

        return Section(
            str(arrays["name"]), int(arrays["step"]), float(arrays["time"]), float(arrays["size"]), arrays["x"],
            arrays["y"], part("field_"), part("particle_"), arrays["surface"], part("wall_"),
            bool(arrays.get("smooth", True)), float(arrays.get("average", 0.0)),
            str(arrays.get("volume", NEAREST)),
        )  # fmt: skip
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise HpcdemError(f"{path} is not a section written by hpcdem -s: {error}") from None
