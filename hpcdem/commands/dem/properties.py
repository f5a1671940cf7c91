"""PROP / INI, FIX, FREE: what particles are made of and how they may move."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_BITS
from hpcdem.core.selection import Chain, Group, Selection, has_expressions
from hpcdem.physics.dem import user_laws
from hpcdem.physics.dem.materials import OWN
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.user_laws import PairLaw

MATERIAL_KEYS = ("density", "fric", "shear", "poiss", "damp", "kn", "ks", "xp", "yp")
LINEAR = "linear"
"""In the place of a law of the user: the built-in one."""
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
    law: str | None = None,
    parameter: Mapping[str, float] | None = None,
    folder: Path = Path(),
) -> None:
    """Set properties of the particles in `where`; keys left out keep their values.

    SI units; density is per volume, or per area when SET disk makes disks. HERTZ chooses the Hertz-Mindlin law, giving
    kn or ks without it the linear one. xp, yp [Pa] push each particle with pressure 2 R thickness (decision: the source
    shows the words only; published scripts press the particles of a freed side wall with them).
    law: 'file.py:function' of the user, in `folder` (physics/dem/user_laws.py), or LINEAR, which takes it back;
    parameter: properties that it declares. Walls go on with kn and ks, or HERTZ.
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
    given = _of_law(sim, where, law, parameter or {}, folder) | given
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


def load_law(sim: Simulation, law: str, folder: Path) -> PairLaw:
    """Read, check and compile a law 'file.py:function' of the user. Collective."""
    return user_laws.load(sim, folder / law.rpartition(":")[0], law)


def _of_law(
    sim: Simulation, where: Selection | None, law: str | None, parameter: Mapping[str, float], folder: Path
) -> dict[str, float]:
    """What a law of the user, and its properties, are among those of particles. Collective."""
    if law is None and not parameter:
        return {}
    if law == LINEAR:
        if parameter:
            raise CommandError(f"parameter belongs to a law of the user, not to {LINEAR}")
        return {"law": 0.0, "hertz": 0.0, **dict.fromkeys(OWN, 0.0)}
    if law is None:
        have = sim.materials.rows["law"][sim.particles["material"]] > 0.0
        if sim.pair_law is None or sim.comm.any(bool((chosen(sim, where) & ~have).any())):
            raise CommandError("parameter: there are particles without a law of the user; law 'file.py:function' first")
        return user_laws.given(sim.pair_law, parameter, whole=False)
    new = load_law(sim, law, folder)
    if sim.pair_law is not None and sim.pair_law.name != new.name:
        have = sim.materials.rows["law"][sim.particles["material"]] > 0.0
        if sim.comm.any(bool((have & ~chosen(sim, where)).any())):
            raise CommandError(f"other particles have the law {sim.pair_law.title}; a model has one law of the user")
    if sim.bonds_left():
        raise CommandError("there are bonds, and a law of the user knows none: BOND break comes first")
    if sim.energy is not None or sim.settings.energy:
        raise CommandError("SET energy: what a law of the user stores and loses is not known; SET energy 0 comes first")
    if any(what == "energy" for _, what in sim.history_wishes.values()):
        raise CommandError("HIST energy: what a law of the user stores is not known")
    values = user_laws.given(new, parameter, whole=True)
    if sim.pair_law is None or sim.pair_law.name != new.name:
        sim.open()
        sim.hist = sim.hist.resized(0)  # nothing of the law before
        sim.pair_law = new
    return {"law": 1.0, **dict.fromkeys(OWN, 0.0), **values}


def fix(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FIX: the components in `dofs` ("x", "y", "spin") keep the velocity they have."""
    sim.particles["fix"][chosen(sim, where)] |= sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()


def free(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FREE: undo FIX."""
    sim.particles["fix"][chosen(sim, where)] &= ~sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()
