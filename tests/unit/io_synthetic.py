"""Frames made up for the tests of the writers: a loose random packing, the same on any number of ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.io.frame import Frame, Table
from hpcdem.runtime import kept

kept.install()  # for programs of several ranks, each of which would compile the kernels for itself

GROUPS = ["***", "ball_rand", "sed", "a_group_with_a_rather_long_name"]


def make_frame(n: int = 500, comm: Any = None, seed: int = 1, scale: float = 1.0) -> Frame:
    """About n particles of radius 60 or 80 m (times scale) in a BOX of 41 by 11 km like push.py's; every rank of
    `comm` holds a slab of unequal size (rank 1 of 3 and more holds none)."""
    rng = np.random.default_rng(seed)
    rows = max(1, round(np.sqrt(n / 7.5)))
    cols = -(-n // rows)
    spacing = 30000.0 / cols
    radius = rng.choice([60.0, 80.0], n) * spacing / 138.0
    k = rng.permutation(n)
    x = 10010.0 + (k % cols + 0.5) * spacing + rng.normal(0.0, 0.02, n) * spacing
    y = 10.0 + (k // cols + 0.5) * spacing + rng.normal(0.0, 0.02, n) * spacing
    gid = np.sort(rng.choice(3 * n + 5, n, replace=False)).astype(np.int64)
    layer = np.minimum((k // cols) * 9 // rows, 9)
    colour = np.array([0, 1, 2, 3, 5, 6, 7, 8, 9, 9])[layer]

    def wild(size: int) -> np.ndarray:
        return rng.normal(size=size) * 10.0 ** rng.integers(-8, 9, size)

    particles: dict[str, np.ndarray] = {"gid": gid, "x": x * scale, "y": y * scale, "radius": radius * scale}
    floats = "vx vy spin angle fx fy torque mass inertia density fric shear poiss kn ks damp"
    particles |= {name: wild(n) for name in floats.split()}
    particles["push_x"], particles["push_y"] = wild(n), wild(n)
    particles |= {
        "hertz": rng.integers(0, 2, n).astype(np.int8),
        "fix": rng.integers(0, 8, n).astype(np.uint8),
        "color": colour.astype(np.int32),
        "group": rng.integers(0, len(GROUPS), n).astype(np.int32),
    }

    pairs = cKDTree(np.stack([x, y], axis=1)).query_pairs(1.1 * spacing, output_type="ndarray")
    pairs = np.sort(pairs, axis=1)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))] if len(pairs) else np.zeros((0, 2), dtype=np.int64)
    touching = rng.random(len(pairs)) < 0.9
    bonded = rng.random(len(pairs)) < 0.8

    def links(p: np.ndarray, more: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
        columns = {"id1": gid[p[:, 0]], "id2": gid[p[:, 1]]}
        columns |= {name: wild(len(p)) for name in ("fn", "fs", "fx", "fy", "x", "y", "overlap", *more)}
        return columns

    contacts = links(pairs[touching])
    bonds = links(pairs[bonded], ("ebmod", "gbmod", "tstrength", "sstrength"))
    bonds["rubber"] = rng.integers(0, 2, int(bonded.sum())).astype(np.int8)
    bonds["kind"] = rng.integers(1, 3, int(bonded.sum())).astype(np.int8)
    low = np.flatnonzero(y < y.min() + spacing)
    wall_contacts = {"id1": gid[low], "wall": np.full(len(low), 4, dtype=np.int32)}
    wall_contacts |= {name: wild(len(low)) for name in ("fn", "fs", "fx", "fy", "x", "y", "overlap")}

    corners = np.array([[0.0, 0.0], [41000.0, 0.0], [41000.0, 11000.0], [0.0, 11000.0]])
    p1 = np.concatenate([corners, [[0.0, 10.0], [10010.0, 10000.0], [40010.0, 10.0]]])
    p2 = np.concatenate([np.roll(corners, -1, axis=0), [[40000.0, 10.0], [10010.0, 10.0], [40010.0, 10000.0]]])
    walls = {
        "id": np.array([100, 101, 102, 103, 0, 1, 2], dtype=np.int64),
        "p1": p1 * scale,
        "p2": p2 * scale,
        "kn": wild(7),
        "ks": wild(7),
        "fric": rng.random(7),
        "color": np.array([5, 5, 5, 5, 5, 7, 3], dtype=np.int32),
        "v": rng.normal(size=(7, 2)),
        "force": rng.normal(size=(7, 2)) * 1e10,
    }
    settings: dict[str, float | str] = {
        "left": 0.0,
        "right": 41000.0 * scale,
        "bottom": 0.0,
        "height": 11000.0 * scale,
        "gx": 0.0,
        "gy": -9.8,
        "disk": "off",
        "frac": np.nan,
        "lsm": 0.0,
    }
    whole = {"particles": particles, "contacts": contacts, "bonds": bonds, "wall_contacts": wall_contacts}
    tables = {name: slab(columns, comm) for name, columns in whole.items()}
    return Frame(46000, 2300.05, 0.05, settings, walls, tables, GROUPS)


def slab(columns: dict[str, np.ndarray], comm: Any = None) -> Table:
    """This rank's rows of a table that every rank has made whole."""
    n = len(next(iter(columns.values())))
    if comm is None or comm.size == 1:
        return Table(columns, 0, n)
    weights = np.array([3.0] + [0.0] * (comm.size > 2) + [1.0] * (comm.size - 1 - (comm.size > 2)))
    cuts = np.concatenate(([0], np.round(np.cumsum(weights) / weights.sum() * n).astype(int)))
    a, b = cuts[comm.rank], cuts[comm.rank + 1]
    return Table({name: values[a:b] for name, values in columns.items()}, int(a), n)


def assert_same(a: Frame, b: Frame) -> None:
    """Every number of two whole frames is the same."""
    assert (a.step, a.time, a.dt, a.group_names) == (b.step, b.time, b.dt, b.group_names)
    assert a.settings.keys() == b.settings.keys()
    for name, value in a.settings.items():
        assert value == b.settings[name] or np.isnan(value), name
    assert a.walls.keys() == b.walls.keys()
    for name, values in a.walls.items():
        np.testing.assert_array_equal(values, b.walls[name], err_msg=name)
    for name, table in a.tables.items():
        other = b.tables[name]
        assert table.columns.keys() == other.columns.keys(), name
        assert (table.offset, table.total) == (other.offset, other.total)
        for column, values in table.columns.items():
            assert values.dtype == other.columns[column].dtype, column
            np.testing.assert_array_equal(values, other.columns[column], err_msg=f"{name} {column}")
