"""Frames whose measures are known: a bed of grains on a lattice that a thrust cuts while a wall moves in."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.io.frame import Frame, Table
from hpcdem.io.vtkhdf import write_vtkhdf

R = 50.0
LENGTH, DEPTH, SLIP = 16000.0, 3000.0, 400.0
FOOT, DIP = 5000.0, 30.0


def lattice(width: float, height: float, disturbed: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Centres of grains of radius R on a hexagonal lattice, slightly disturbed."""
    rng = np.random.default_rng(7)
    rows = int(height / (np.sqrt(3.0) * R))
    y = R + np.sqrt(3.0) * R * np.arange(rows)
    x = np.arange(R, width, 2.0 * R)
    x, y = (x[None, :] + R * (np.arange(rows) % 2)[:, None]).ravel(), np.repeat(y, len(x))
    x, y = x + disturbed * rng.uniform(-1.0, 1.0, len(x)), y + disturbed * rng.uniform(-1.0, 1.0, len(y))
    keep = x + R <= width + R
    return x[keep], y[keep]


def ramp(x: np.ndarray, y: np.ndarray, foot: float, dip: float, slip: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of everything left of a plane that rises from (foot, 0) to the right, by `slip` up the plane."""
    a = np.radians(dip)
    above = (y - np.tan(a) * (x - foot)) > 0.0
    return np.where(above, slip * np.cos(a), 0.0), np.where(above, slip * np.sin(a), 0.0)


def pairs(a: np.ndarray) -> Table:
    """A table of contacts or bonds without forces."""
    zeros = np.zeros(len(a))
    columns: dict[str, np.ndarray] = {"id1": a[:, 0].astype(np.int64), "id2": a[:, 1].astype(np.int64)}
    columns |= {name: zeros for name in ("fn", "fs", "fx", "fy", "x", "y", "overlap")}
    return Table(columns, 0, len(a))


def frame(
    step: int, x: np.ndarray, y: np.ndarray, wall: float, gid: np.ndarray | None = None,
    color: np.ndarray | None = None, bonds: np.ndarray | None = None, contacts: np.ndarray | None = None,
) -> Frame:  # fmt: skip
    """A frame of grains of radius R; floor 0, wall 1 at x = `wall`; colours by default in layers of 1 km, groups
    "low" and "high" of colours 0 and the others."""
    n = len(x)
    gid = np.arange(n) if gid is None else gid
    color = (y // 1000.0).astype(np.int32) if color is None else color
    none = np.zeros((0, 2), np.int64)
    columns = {"gid": gid.astype(np.int64), "x": x, "y": y, "radius": np.full(n, R), "color": color.astype(np.int32)}
    columns["group"] = (color > 0).astype(np.int32)
    ends = {"p1": [[0.0, 0.0], [wall, 9000.0]], "p2": [[LENGTH, 0.0], [wall, 0.0]]}
    walls = {"id": np.array([0, 1]), **{name: np.array(p) for name, p in ends.items()}}
    walls |= {name: np.zeros(2) for name in ("kn", "ks", "fric")}
    walls |= {"color": np.array([5, 7], np.int32), "v": np.zeros((2, 2)), "force": np.zeros((2, 2))}
    tables = {
        "particles": Table(columns, 0, n), "contacts": pairs(none if contacts is None else contacts),
        "bonds": pairs(none if bonds is None else bonds),
        "wall_contacts": Table({"id1": none[:, 0], "wall": none[:, 0].astype(np.int32)}, 0, 0),
    }  # fmt: skip
    return Frame(step, 0.05 * step, 0.05, {"disk": "off"}, walls, tables, ["low", "high"])


def write(folder: Path, frame: Frame, ini: bool = False) -> Path:
    """The frame as VTKHDF under its step."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"all_{frame.step:010d}{'_ini' if ini else ''}.vtkhdf"
    write_vtkhdf(path, frame, SerialComm())
    return path


def chain(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(m, 2): neighbours along the rows of the lattice."""
    near = np.flatnonzero((np.abs(np.diff(y)) < R) & (np.abs(np.diff(x)) < 3.0 * R))
    return np.stack([near, near + 1], axis=1)


def thrust(folder: Path) -> Path:
    """Four frames, the first two before wall 1 moves; then the thrust slips by SLIP twice, as the wall comes in.

    All neighbours in a row are bonded until step 2000; at 3000 the bonds of grains 0-1 (still touching) and 10-11 are
    broken, and grains 100 and 101 are deleted after that (`_ini` frame). walls.csv: wall 1 is pushed back by 2e5 N for
    each metre of its way.
    """
    x, y = lattice(LENGTH, DEPTH)
    bonds = chain(x, y)
    heave = float(SLIP * np.cos(np.radians(DIP)))
    color = (y // 1000.0).astype(np.int32)
    write(folder, frame(1000, x, y + 500.0, 0.0, color=color))
    write(folder, frame(2000, x, y, 0.0, color=color, bonds=bonds), ini=True)
    dx, dy = ramp(x, y, FOOT, DIP, SLIP)
    broken = np.isin(bonds[:, 0], (0, 10))
    some = frame(3000, x + dx, y + dy, heave, color=color, bonds=bonds[~broken], contacts=np.array([[0, 1]]))
    write(folder, some)
    keep = ~np.isin(np.arange(len(x)), (100, 101))
    held = bonds[~broken & keep[bonds].all(axis=1)]
    gid, color = np.flatnonzero(keep), color[keep]
    write(folder, frame(3000, (x + dx)[keep], (y + dy)[keep], heave, gid, color, held), ini=True)
    write(folder, frame(4000, (x + 2 * dx)[keep], (y + 2 * dy)[keep], 2 * heave, gid, color, held))
    rows = ["step,time,wall,x1,y1,x2,y2,fx,fy"]
    for step, way in ((1000, 0.0), (2000, 0.0), (3000, heave), (4000, 2 * heave)):
        rows.append(f"{step},{0.05 * step},0,0.0,0.0,{LENGTH},0.0,0.0,-5e8")
        rows.append(f"{step},{0.05 * step},1,{way!r},9000.0,{way!r},0.0,{-2e5 * way!r},1e3")
    (folder / "walls.csv").write_text("\n".join(rows) + "\n")
    return folder
