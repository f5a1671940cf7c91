"""PROP / INI, FIX, FREE: what particles are made of and how they may move."""

from __future__ import annotations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_BITS
from hpcdem.core.selection import Chain, Group, Selection, has_expressions
from hpcdem.physics.dem.simulation import Simulation

MATERIAL_KEYS = ("density", "fric", "shear", "poiss", "damp", "kn", "ks", "xp", "yp")
NOT_NEGATIVE = ("density", "fric", "shear", "damp", "kn", "ks")


def chosen(sim: Simulation, where: Selection | None) -> np.ndarray:
    """Flags (n_own,) of the owned particles in a selection; None is all. Clumps are chosen as a whole: by the place of
    their centre, or if a member's id or group is asked for. Collective."""
    p = sim.particles
    if where is None:
        return np.ones(len(p), bool)
    if has_expressions(where):
        where = where.resolve(sim.extents())
    known = [name.lower() for name in sim.groups]
    for name in _group_names(where):
        if name not in known and sim.log is not None:
            sim.log.warn_once(f"group {name}", f"no particle has ever been in group {name}")
    x, y = sim.clumps.centres(p)
    which = where.mask({"x": x, "y": y, "gid": p["gid"], "group": p["group"], "group_names": sim.groups})
    return sim.clumps.whole(p, which, sim.comm) if sim.clumps else which


def _group_names(where: Selection) -> tuple[str, ...]:
    if isinstance(where, Group):
        return where.names
    if isinstance(where, Chain):
        return sum((_group_names(term) for term in where.terms), ())
    return ()


def prop(
    sim: Simulation,
    where: Selection | None = None,
    *,
    density: float | None = None,
    fric: float | None = None,
    shear: float | None = None,
    poiss: float | None = None,
    damp: float | None = None,
    hertz: bool = False,
    kn: float | None = None,
    ks: float | None = None,
    xp: float | None = None,
    yp: float | None = None,
    xv: float | None = None,
    yv: float | None = None,
    spin: float | None = None,
    color: int | None = None,
    group: str | None = None,
) -> None:
    """Set properties of the particles in `where`; keys left out keep their values.

    SI units; density is per volume, or per area when SET disk makes disks. HERTZ chooses the Hertz-Mindlin law, giving
    kn or ks without it the linear one. xp, yp [Pa] push each particle with pressure 2 R thickness (decision: the source
    shows the words only; published scripts press the particles of a freed side wall with them).
    Existing contacts use the new values from the next step. Velocities of a clump are those of its centre; its members
    follow.
    """
    given = {
        k: v
        for k, v in zip(MATERIAL_KEYS, (density, fric, shear, poiss, damp, kn, ks, xp, yp), strict=True)
        if v is not None
    }
    for name in NOT_NEGATIVE:
        if not given.get(name, 0.0) >= 0.0:
            raise CommandError(f"{name} must not be negative, got {given[name]:g}")
    if not -1.0 < given.get("poiss", 0.0) <= 0.5:
        raise CommandError(f"poiss must lie in (-1, 0.5], got {poiss:g}")
    if hertz:
        given["hertz"] = 1.0
    elif kn is not None or ks is not None:
        given["hertz"] = 0.0
    if (xp or yp) and sim.log is not None:
        sim.log.warn_once(
            "pressure",
            f"xp, yp: the force on each particle is pressure 2 R thickness, thickness {sim.settings.thickness:g} m "
            "(SET thickness)",
        )
    p = sim.particles
    which = chosen(sim, where)
    if given:
        material = p["material"]
        mapping = sim.materials.changed(sim.used(material[which], sim.materials), **given)
        material[which] = mapping[material[which]]
        sim.tables_changed()
    motion = {name: value for name, value in (("vx", xv), ("vy", yv), ("spin", spin)) if value is not None}
    for name, value in (*motion.items(), ("color", color)):
        if value is not None:
            p[name][which] = value
    if motion and sim.clumps:
        sim.clumps.set_motion(p, which, **motion)
    if group is not None:
        p["group"][which] = sim.group_number(group)
    if xv is not None or yv is not None or (motion and sim.clumps):
        sim.check_soon()


def fix(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FIX: the components in `dofs` ("x", "y", "spin") keep the velocity they have."""
    sim.particles["fix"][chosen(sim, where)] |= sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()


def free(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FREE: undo FIX."""
    sim.particles["fix"][chosen(sim, where)] &= ~sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()
