"""Frames made up for the tests of views: a few squares of blocks, and discs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.io.frame import Frame, Table
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import MeshFrame, write_mesh_frame
from hpcdem.pre.mesh import structured_space


def blocks(step: int = 7, n: int = 3, grown: float = 0.0) -> MeshFrame:
    """n by n unit squares, all quads but the first, of two triangles. stress_yy of element k is -1e6 (k + 1), its
    displacement (0.1 k, `grown`); the lower half of the squares is group "base", the other "roof". Joints stand on the
    lower edges of the second row of squares, the last of them broken in tension; the others intact and channels of
    aperture 1, 2 ... mm. A bolt of two elements and one liner element."""
    corners: list[tuple[float, float]] = []
    sizes: list[int] = []
    squares = [(x, y) for y in range(n) for x in range(n)]
    for k, (x, y) in enumerate(squares):
        a, b, c, d = (x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)
        if k == 0:
            corners += [a, b, c, a, c, d]
            sizes += [3, 3]
        else:
            corners += [a, b, c, d]
            sizes.append(4)
    count = len(sizes)
    first = np.cumsum(sizes) - sizes
    numbers = np.concatenate([4 * e + np.arange(size) for e, size in enumerate(sizes)])
    of = numbers // 4
    place = np.array(corners, float)
    u = np.column_stack([0.1 * of, np.full(len(of), grown)])
    lower = [e + 1 for e, (_, y) in enumerate(squares) if y == 1]
    state = np.ones(len(lower))
    state[-1] = 3.0
    aperture = 1e-3 * np.arange(1.0, len(lower) + 1)
    aperture[-1] = np.nan
    bolt_nodes = {"position_x": np.array([0.5, 0.5, 0.5]), "position_y": np.array([0.2, 1.0, 2.0]),
                  "distance": np.array([0.0, 0.8, 1.8])}  # fmt: skip
    liner_nodes = {"position_x": np.array([0.0, float(n)]), "position_y": np.array([float(n), float(n)])}
    element = np.arange(count)
    assert first[-1] + sizes[-1] == len(place)
    return MeshFrame(
        step, 1e-3 * step, 1e-6,
        Table({"number": numbers, "x": place[:, 0] + u[:, 0], "y": place[:, 1] + u[:, 1], "displacement_x": u[:, 0],
               "displacement_y": u[:, 1], "velocity_x": 0.0 * of, "velocity_y": 1.0 + of}, 0, len(place)),
        Table({"number": element, "corners": np.array(sizes), "stress_yy": -1e6 * (element + 1.0),
               "group_rock": (place[first, 1] >= n / 2).astype(np.int32)}, 0, count),
        Table({"number": 4 * np.array(lower), "first": 4 * np.array(lower), "last": 4 * np.array(lower) + 1,
               "state": state, "mode": np.where(state == 3.0, 1.0, 0.0), "opening": 0.0 * state, "aperture": aperture,
               "saturation": np.where(np.isnan(aperture), np.nan, 1.0)}, 0, len(lower)),
        {"group_rock": ["base", "roof"]},
        {"bolts": {"nodes": bolt_nodes, "elements": {"first_node": np.arange(2), "axial_force": np.array([1e3, 2e3]),
                                                     "bolt_state": np.zeros(2)}},
         "liners": {"nodes": liner_nodes, "elements": {"first_node": np.array([0]), "last_node": np.array([1]),
                                                       "axial_force": np.array([5e3]),
                                                       "liner_state": np.array([0.0])}}},
    )  # fmt: skip


def discs(step: int = 3, n: int = 25, seed: int = 1) -> Frame:
    """n discs of radius 0.45 m at whole metres, numbered 10, 11 ..., vx of disc k is k m/s, with contacts along rows,
    bonds on the first of them, and a floor."""
    side = round(np.sqrt(n))
    k = np.arange(n)
    x, y = (k % side).astype(float), (k // side).astype(float)
    pairs = np.array([(i, i + 1) for i in range(n - 1) if (i + 1) % side])
    rng = np.random.default_rng(seed)
    force = rng.normal(size=(len(pairs), 2))
    gid = 10 + k
    links = {"id1": gid[pairs[:, 0]], "id2": gid[pairs[:, 1]], "fn": force[:, 0], "fs": force[:, 1],
             "fx": force[:, 0], "fy": force[:, 1], "x": 0.5 * (x[pairs[:, 0]] + x[pairs[:, 1]]), "y": y[pairs[:, 0]],
             "overlap": np.full(len(pairs), 1e-3)}  # fmt: skip
    bonds = {name: values[:side] for name, values in links.items()}
    walls = {"id": np.array([0]), "p1": np.array([[-1.0, -0.5]]), "p2": np.array([[side, -0.5]]),
             "color": np.array([5]), "v": np.zeros((1, 2)), "force": np.array([[0.0, 2.0]])}  # fmt: skip
    particles = {"gid": gid, "x": x, "y": y, "radius": np.full(n, 0.45), "vx": k.astype(float), "vy": 0.0 * x,
                 "spin": 0.0 * x, "angle": 0.01 * k, "fx": 0.0 * x, "fy": -1.0 - y, "mass": np.full(n, 2.0),
                 "density": np.full(n, 2.0 / (np.pi * 0.45**2)),
                 "color": (k % 10).astype(np.int32), "group": (k % 2).astype(np.int32)}  # fmt: skip
    empty = {"id1": np.zeros(0, np.int64), "wall": np.zeros(0, np.int32)} | {
        name: np.zeros(0) for name in ("fn", "fs", "fx", "fy", "x", "y", "overlap")
    }
    tables = {"particles": particles, "contacts": links, "bonds": bonds, "wall_contacts": empty}
    return Frame(
        step, 0.5 * step, 0.1, {"disk": "off"}, walls,
        {name: Table(columns, 0, len(columns["id1"] if "id1" in columns else gid)) for name, columns in tables.items()},
        ["odd", "even"],
    )  # fmt: skip


def write_blocks(folder: Path, step: int = 7, **values: float) -> Path:
    """A frame of blocks in a file."""
    path = folder / f"rock_{step:010d}.vtkhdf"
    write_mesh_frame(path, blocks(step, **values), SerialComm())  # type: ignore[arg-type]
    return path


def write_discs(folder: Path, step: int = 3, **values: int) -> Path:
    """A frame of discs in a file."""
    path = folder / f"all_{step:010d}.vtkhdf"
    write_vtkhdf(path, discs(step, **values), SerialComm())
    return path


CORNERS = "first", "second", "last"
"""Columns of joints in space."""
SIZE = (4.0, 3.0, 2.0)
"""Of the body [m]."""


def body(
    step: int = 5, cells: tuple[int, int, int] = (4, 3, 2), grown: float = 0.1, broken: bool = False, wet: bool = False
) -> MeshFrame:
    """A box of SIZE of tetrahedra, six to a brick, whose upper end is `grown` times its height higher, and as much
    thinner along y: u = grown (0, -y, z). Its stress is uniaxial, stress_zz of element k -1e6 (k + 1); group "base"
    below half of the height, else "roof". broken: joints on all inner faces, broken in shear where the roof lies on
    the base, else intact; wet: the first are channels of 1 mm, full where x < 2, elsewhere to a quarter."""
    mesh = structured_space.box(tuple(np.linspace(0.0, s, n + 1) for s, n in zip(SIZE, cells, strict=True)), 6)
    count = len(mesh.cells)
    place = mesh.points[mesh.cells].reshape(-1, 3)
    u = grown * np.column_stack([np.zeros(len(place)), -place[:, 1], place[:, 2]])
    number = np.arange(count)
    zz = -1e6 * (number + 1.0)
    stress = {f"stress_{c}": zz if c == "zz" else np.zeros(count) for c in ("xx", "yy", "xy", "zz", "xz", "yz")}
    roof = mesh.points[mesh.cells].mean(axis=1)[:, 2] > 0.5 * SIZE[2]
    corners = {"number": np.arange(4 * count), "node": mesh.cells.reshape(-1).astype(np.int64)}
    corners |= {axis: (place + u)[:, c] for c, axis in enumerate("xyz")}
    corners |= {f"displacement_{axis}": u[:, c] for c, axis in enumerate("xyz")}
    corners |= {f"velocity_{axis}": np.full(4 * count, float(c == 0)) for c, axis in enumerate("xyz")}
    volume = np.full(count, np.prod(SIZE) / count)
    elements = {"number": number, "corners": np.full(count, 4), **stress, "stress_max": 0.0 * zz, "stress_min": zz,
                "volume": volume, "strain_energy": 0.5 * volume, "group_rock": roof.astype(np.int32)}  # fmt: skip
    values = "state", "damage", "mode", "joint_area", "break_time", "break_energy"
    joints = {name: np.zeros(0, np.int64) for name in ("number", *CORNERS)} | {name: np.zeros(0) for name in values}
    if broken:
        pairs = mesh.edges().faces
        lower, upper = pairs[pairs[:, 1] >= 0].T
        apart = roof[lower // 4] != roof[upper // 4]
        corner_of = dict(zip(CORNERS, mesh.face_corners(lower).T, strict=True))
        joints = {"number": lower, **corner_of, "state": np.where(apart, 3.0, 1.0), "damage": np.where(apart, 1.0, 0.0),
                  "mode": np.where(apart, 2.0, 0.0), "joint_area": areas(mesh.points[mesh.face_points(lower)]),
                  "break_time": np.where(apart, 2e-3, np.nan),
                  "break_energy": np.where(apart, 1.0, np.nan)}  # fmt: skip
        if wet:
            near = mesh.points[mesh.face_points(lower)].mean(axis=1)[:, 0] < 2.0
            full = {"aperture": 1e-3, "saturation": np.where(near, 1.0, 0.25), "fluid_velocity": 0.2,
                    "fluid_pressure": np.where(near, 2e6, 0.0), "flow_rate": 2e-4}  # fmt: skip
            joints |= {name: np.where(apart, value, np.nan) for name, value in full.items()}
    tables = (Table(columns, 0, len(columns["number"])) for columns in (corners, elements, joints))
    return MeshFrame(step, 1e-3 * step, 1e-6, *tables, {"group_rock": ["base", "roof"]})


def areas(corners: np.ndarray) -> np.ndarray:
    """(n,) of triangles (n, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def write_body(folder: Path, step: int = 5, **values: Any) -> Path:
    """A frame in three dimensions in a file."""
    path = folder / f"body_{step:010d}.vtkhdf"
    write_mesh_frame(path, body(step, **values), SerialComm())  # type: ignore[arg-type]
    return path
