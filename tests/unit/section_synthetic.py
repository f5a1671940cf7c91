"""Sections as `hpcdem -s` writes them, made without a run: a thrust wedge that grows with the push of its left wall."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.post.section import UNITS, Section, write_section

LENGTH, DEPTH, SIZE = 40000.0, 4000.0, 200.0
DENSITY, GRAVITY = 2000.0, 10.0


def top(x: np.ndarray, push: float) -> np.ndarray:
    """Height of the surface [m]: a taper of the same area as what has been pushed together."""
    high, length = 0.5 * push, 4.0 * DEPTH
    return DEPTH + np.maximum(0.0, high * (1.0 - (x - push) / length)) + 40.0 * np.sin(x / 700.0)


def bands(x: np.ndarray, y: np.ndarray, push: float) -> np.ndarray:
    """Distortional strain: three forethrusts from the base, and a backthrust of the other sign."""
    strain = np.zeros_like(x)
    for k, sign in ((0, 1.0), (1, 1.0), (2, 1.0), (1, -1.0)):
        root = push + 3500.0 * k + (3000.0 if sign < 0 else 0.0)
        away = (y - sign * 0.55 * (x - root)) / 1.14
        strain += sign * 2.5e-3 * push / (k + 1) * np.exp(-((away / 160.0) ** 2)) * (sign * (x - root) > 0)
    return strain


def wedge(step: int, push: float = 0.0, initial: bool = False, radius: float = 80.0, missing: int = 0) -> Section:
    """A section after so much push [m]; missing: so many particles of the largest ids are left out."""
    xs = np.arange(SIZE / 2, LENGTH + 4 * SIZE, SIZE)
    ys = np.arange(SIZE / 2, 3 * DEPTH, SIZE)
    x, y = np.meshgrid(xs, ys)
    inside = (x > push) & (x < LENGTH) & (y < top(x, push))
    depth = top(x, push) - y
    syy = DENSITY * GRAVITY * depth
    sxx = syy * (0.6 + (2.4 if push else 0.0) * np.exp(-(x - push) / 15000.0))
    sxy = 0.12 * (sxx - syy) * np.sin(x / 5000.0)
    distortional = bands(x, y, push)
    radius_of_circle = np.hypot(0.5 * (sxx - syy), sxy)
    fields = {
        "volumetric": -4.0 * (push / 5000.0) * np.exp(-(x - push) / 6000.0) + 30.0 * np.abs(distortional) * np.sin(y),
        "distortional": distortional, "mean": 0.5 * (sxx + syy), "shear": radius_of_circle,
        "sxx": sxx, "sxy": sxy, "syy": syy, "direction": 0.5 * np.arctan2(2.0 * sxy, sxx - syy),
    }  # fmt: skip
    fields = {name: np.where(inside, fields[name], np.nan) for name in UNITS}
    px, py = np.meshgrid(np.arange(radius, LENGTH, 2 * radius), np.arange(radius, 3 * DEPTH, 1.74 * radius))
    px = (px + np.where(np.arange(len(px)) % 2, radius, 0.0)[:, None]).reshape(-1)
    py = py.reshape(-1)
    held = (px - radius >= push) & (px + radius <= LENGTH) & (py + radius < top(px, push))
    px, py = px[held], py[held]
    n = len(px) - missing
    layer = (py - 0.4 * np.maximum(top(px, push) - DEPTH, 0.0)) // 600.0
    particles = {
        "gid": np.arange(n), "x": px[:n], "y": py[:n], "radius": np.full(n, radius),
        "color": np.clip(layer[:n], 0, 9).astype(np.int64),
    }  # fmt: skip
    line = np.arange(push, LENGTH + 1.0, 100.0)
    walls = {
        "id": np.array([-1, 0, 1, 2]),
        "p1": np.array([[-500.0, -500.0], [0.0, 0.0], [push, 0.0], [LENGTH, 0.0]]),
        "p2": np.array([[-500.0, 15000.0], [LENGTH, 0.0], [push, 11000.0], [LENGTH, 11000.0]]),
        "color": np.array([0, 5, 7, 3]),
    }
    name = f"all_{step:010d}{'_ini' if initial else ''}"
    surface = np.stack([line, top(line, push)], axis=1)
    return Section(name, step, 0.05 * step, SIZE, xs, ys, fields, particles, surface, walls)


def write_wedges(folder: Path, sections: list[Section] | None = None) -> list[Section]:
    """Sections in DIR/ss/data; by default three with 0, 4 and 8 km of push."""
    if sections is None:
        sections = [wedge(6000, initial=True), wedge(26000, 4000.0), wedge(46000, 8000.0)]
    (folder / "ss" / "data").mkdir(parents=True)
    for section in sections:
        write_section(section, folder / "ss" / "data" / f"{section.name}.npz")
    return sections
