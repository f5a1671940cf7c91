"""Stress from the forces between particles.

Stress of a particle (Christoffersen, Mehrabadi & Nemat-Nasser 1981, J. Appl. Mech. 48, 339-344; PFC), compression
positive: V s_ij = - sum_c l_i f_j over its contacts with particles and walls and its bonds, l from the centre to the
contact point, f the force on the particle. The stress of a region is the sum of V s_ij over its particles divided by
area and thickness.

A rigid clump is one body: l begins at its centre, and V s is shared out to its members by the area of their discs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.frame import Frame
from hpcdem.physics.dem.kernels import mass


def moments(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """V s of the particles of a whole frame (n, 4): xx, xy, yx, yy [N m]; and whether anything touches them (n,).

    A pair that touches stands among the contacts with all of its force, bonded or not; among the bonds it is counted
    only when it stands there alone (an open bond, which pulls). HpcdemError if forces or particles are missing.
    """
    p = frame.tables["particles"].columns
    n, row_of = len(p["gid"]), _finder(p["gid"])
    member = _members(p)
    x, y = (np.where(member, p[f"clump_{axis}"], p[axis]) if member.any() else p[axis] for axis in ("x", "y"))
    result, held = np.zeros((n, 4)), np.zeros(n, dtype=bool)

    def add(at: np.ndarray, place: tuple[np.ndarray, np.ndarray], force: tuple[np.ndarray, np.ndarray]) -> None:
        arm = frame.shortest(place[0] - x[at]), place[1] - y[at]
        for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
            result[:, k] -= np.bincount(at, arm[i] * force[j], n)
        held[at] = True

    seen = None
    for name in ("contacts", "bonds"):
        t = frame.tables[name].columns
        if not len(frame.tables[name]):
            continue
        a, b = row_of(t["id1"]), row_of(t["id2"])
        pair = np.minimum(a, b) * n + np.maximum(a, b)
        if seen is not None:
            alone = np.flatnonzero(~_among(pair, seen))
            a, b, t = a[alone], b[alone], {key: t[key][alone] for key in ("x", "y", "fx", "fy") if key in t}
        seen = pair
        fx, fy = _force(t, name)
        place = _pair_place(frame, t, p, a, b)
        add(a, place, (fx, fy))
        add(b, place, (-fx, -fy))
    t = frame.tables["wall_contacts"].columns
    if len(frame.tables["wall_contacts"]):
        a, force = row_of(t["id1"]), _force(t, "wall contacts")
        add(a, _wall_place(t, p, a, frame.walls, force), force)
    if member.any():
        of = np.unique(p["clump"][member], return_inverse=True)[1]
        area = p["radius"][member] ** 2
        share = area / np.bincount(of, area)[of]
        for k in range(4):
            result[member, k] = np.bincount(of, result[member, k])[of] * share
        held[member] = np.bincount(of, held[member])[of] > 0
    return result, held


def _members(p: dict[str, np.ndarray]) -> np.ndarray:
    """Flag the particles (n,) that belong to a clump; a .dat does not contain this information."""
    return p["clump"] >= 0 if "clump" in p else np.zeros(len(p["gid"]), bool)


def _finder(gid: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The rows of ids, by a table where the ids are dense enough for one. HpcdemError for an id that is not there."""
    n = len(gid)
    low, high = (int(gid[0]), int(gid[-1])) if n else (0, -1)
    rows = None
    if high - low < 16 * n + 1000:
        rows = np.full(high - low + 1, -1, dtype=np.int64)
        rows[gid - low] = np.arange(n)

    def find(ids: np.ndarray) -> np.ndarray:
        if n == 0:
            raise HpcdemError(f"a contact refers to the missing particle {ids[0]}")
        if rows is None:
            at = np.minimum(np.searchsorted(gid, ids), n - 1)
        else:
            at = rows[np.clip(ids - low, 0, len(rows) - 1)]
        wrong = gid[at] != ids
        if wrong.any():
            raise HpcdemError(f"a contact refers to the missing particle {ids[wrong][0]}")
        return at

    return find


def _force(table: dict[str, np.ndarray], name: str) -> tuple[np.ndarray, np.ndarray]:
    if "fx" not in table or "fy" not in table:
        raise HpcdemError(f"its {name} have no forces (globalFx, globalFy), so stress cannot be computed")
    return table["fx"], table["fy"]


def _among(keys: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Flag the keys that occur among the others (not empty)."""
    others = np.sort(others)
    return others[np.minimum(np.searchsorted(others, keys), len(others) - 1)] == keys


def _pair_place(frame: Frame, table: dict, p: dict, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Contact points x, y; where the file has none (ZDEM), R - U/2 from the centre of the first particle."""
    if "x" in table and "y" in table:
        return table["x"], table["y"]
    dx, dy = frame.shortest(p["x"][b] - p["x"][a]), p["y"][b] - p["y"][a]
    distance = np.hypot(dx, dy)
    arm = p["radius"][a] - 0.5 * (p["radius"][a] + p["radius"][b] - distance)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.where(distance > 0.0, arm / distance, 0.0)
    return p["x"][a] + part * dx, p["y"][a] + part * dy


def _wall_place(
    table: dict, p: dict, a: np.ndarray, walls: dict, force: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Contact points with walls x, y; where the file has none, R - U/2 from the centre towards the wall."""
    if "x" in table and "y" in table:
        return table["x"], table["y"]
    p1, p2 = walls["p1"][table["wall"]], walls["p2"][table["wall"]]
    centre, along = np.stack([p["x"][a], p["y"][a]], axis=1), p2 - p1
    length2 = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
    t = np.clip(((centre - p1) * along).sum(axis=1) / length2, 0.0, 1.0)
    offset = p1 + t[:, None] * along - centre
    distance = np.hypot(*offset.T)
    # A centre that has come through the wall is pushed towards it.
    side = np.where(offset[:, 0] * force[0] + offset[:, 1] * force[1] > 0.0, -1.0, 1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.where(distance > 0.0, side * 0.5 * (p["radius"][a] + side * distance) / distance, 0.0)
    return centre[:, 0] + part * offset[:, 0], centre[:, 1] + part * offset[:, 1]


def volume_rule(frame: Frame, bed: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Volume of each particle (n,) [m^3] by SET disk, of members of clumps their share, and the thickness of the model
    [m]: 1 for discs, twice the mean radius, of those in `bed` (n,), for spheres.

    HpcdemError for a rule that is not known."""
    p = frame.tables["particles"].columns
    radius, disk = p["radius"], str(frame.settings.get("disk", "off"))
    if disk not in mass.SPHERES:
        raise HpcdemError(f"its rule for volumes is disk {disk}, expected one of {', '.join(mass.SPHERES)}")
    volume = mass.volume(radius, disk)
    if "clump" in p:
        volume = np.where(p["clump"] >= 0, p["mass"] / p["density"], volume)
    mean = float(np.mean(radius if bed is None else radius[bed]))
    return volume, 2.0 * mean if mass.SPHERES[disk] else 1.0


def principal(sxx: np.ndarray, sxy: np.ndarray, syy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean (s1 + s2) / 2, largest shear (s1 - s2) / 2, and angle of s1 from the x axis [rad]."""
    return 0.5 * (sxx + syy), np.hypot(0.5 * (sxx - syy), sxy), 0.5 * np.arctan2(2.0 * sxy, sxx - syy)
