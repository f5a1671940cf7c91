"""PROP / INI, FIX, FREE: what particles are made of and how they may move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Unpack

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_BITS
from hpcdem.core.material import Material, checked
from hpcdem.core.selection import Chain, Group, Selection, has_expressions
from hpcdem.physics.dem import periodic, rolling, user_laws
from hpcdem.physics.dem.materials import OWN
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.user_laws import LINEAR, PairLaw


def chosen(sim: Simulation, where: Selection | None) -> np.ndarray:
    """Return flags (n_own,) of the owned particles in a selection; None selects all. Clumps are selected as a whole: by
    the position of their centre, or if the selection names a member's id or group. Collective.
    """
    p = sim.particles
    if where is None:
        return np.ones(len(p), bool)
    if has_expressions(where):
        where = where.resolve(sim.extents())
    known = [name.lower() for name in sim.groups]
    for name in _group_names(where):
        if name not in known and sim.log is not None:
            sim.log.warn_once(f"group {name}", f"no particle has ever been in group {name}")
    x, y = sim.clumps.centres(p) if sim.clumps else (periodic.places(sim), p["y"])
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
    hertz: bool = False,
    xv: float | None = None,
    yv: float | None = None,
    spin: float | None = None,
    color: int | None = None,
    group: str | None = None,
    law: str | None = None,
    between: Sequence[str] = (),
    parameter: Mapping[str, float] | None = None,
    folder: Path = Path(),
    **properties: Unpack[Material],
) -> None:
    """PROP: assign properties, velocities, colour and group to particles; omitted ones keep their values.

    A density is per volume, or per area when SET disk makes disks. With `hertz`, contacts follow Hertz and Mindlin; kn
    or ks without it select the linear law. Contacts use the new values from the next step. Velocities of a clump are
    those of its centre; its members follow.

    Parameters
    ----------
    where : particles to change (default: all).
    hertz : bool: contacts of Hertz and Mindlin, defined by shear [Pa] and poiss.
    xv, yv, spin : velocity [m/s] and angular velocity, anticlockwise [rad/s].
    color, group : colour by name or number; name of the group.
    law : 'file.py:function' beside the program (docs/user_laws.md), or "linear".
    between : bool: assign the law to pairs of discs with these two laws; nothing else is changed.
    parameter : values of the properties that the law declares.
    properties : density [kg/m3], of discs of unit thickness [kg/m2]; fric; shear [Pa]; poiss; damp; kn, ks [N/m];
        rfric, rdamp: coefficient of rolling resistance, damping over the critical one; xp, yp: pressures along x and y,
        each acting on the area 2 R thickness of a particle [Pa].
    """
    if between:
        others = (*properties.values(), xv, yv, spin, color, group, where)
        if law is None or hertz or any(other is not None for other in others):
            raise CommandError("between accepts only a law and its parameter")
        _log_between(sim, law, between, parameter or {}, folder)
        return
    given = checked(properties)
    if hertz:
        given["hertz"] = 1.0
    elif "kn" in given or "ks" in given:
        given["hertz"] = 0.0
    given = _of_law(sim, where, law, parameter or {}, folder) | given
    if (given.get("xp") or given.get("yp")) and sim.log is not None:
        sim.log.warn_once(
            "pressure",
            f"xp, yp: the force on each particle is pressure 2 R thickness, thickness {sim.settings.thickness:g} m "
            "(SET thickness)",
        )
    p = sim.particles
    which = chosen(sim, where)
    rolling.begin(sim, given)
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
    """Read, check and compile a user law 'file.py:function'. Collective."""
    return user_laws.load(sim, folder / law.rpartition(":")[0], law)


def _of_law(
    sim: Simulation, where: Selection | None, law: str | None, parameter: Mapping[str, float], folder: Path
) -> dict[str, float]:
    """Rows of a user law and its properties among those of particles. Collective."""
    if law is None and not parameter:
        return {}
    if law == LINEAR:
        if parameter:
            raise CommandError(f"parameter applies to a user law, not to {LINEAR}")
        return {"law": 0.0, "hertz": 0.0, **dict.fromkeys(OWN, 0.0)}
    laws = sim.own_laws
    if law is None:
        column = sim.materials.rows["law"][sim.particles["material"]]
        numbers = {int(k) for part in sim.comm.allgather(np.unique(column[chosen(sim, where)]).tolist()) for k in part}
        if not numbers - {0} or 0 in numbers:
            raise CommandError("parameter: some particles have no user law; assign law 'file.py:function' first")
        if len(numbers) > 1:
            some = ", ".join(laws.laws[k - 1].title for k in sorted(numbers))
            raise CommandError(
                f"parameter: the particles have several laws, {some}; select the particles of one law by RANGE"
            )
        return user_laws.given(laws.laws[numbers.pop() - 1], parameter, whole=False)
    number, values = _added(sim, law, parameter, folder)
    return {"law": float(number), **dict.fromkeys(OWN, 0.0), **values}


def _added(sim: Simulation, law: str, parameter: Mapping[str, float], folder: Path) -> tuple[int, dict[str, float]]:
    """The number of a user law that the model has from now on, and its properties. Collective."""
    new = load_law(sim, law, folder)
    if sim.bonds_left():
        raise CommandError("a user law does not support bonds: remove them with BOND break")
    if new.declared.energy is None:
        unknown = f"the stored energy of the law {new.title} is not known: define it with pair_law(energy=)"
        if sim.energy is not None or sim.settings.energy:
            raise CommandError(f"SET energy: {unknown}; switch it off with SET energy 0")
        if any(what == "energy" for _, what in sim.history_requests.values()):
            raise CommandError(f"HIST energy: {unknown}")
    values = user_laws.given(new, parameter, whole=True)
    if not sim.own_laws.number(new.name):
        sim.open_model()
    return sim.own_laws.add(new), values


def _log_between(sim: Simulation, law: str, pair: Sequence[str], parameter: Mapping[str, float], folder: Path) -> None:
    """PROP between. Collective."""
    if len(pair) != 2:
        raise CommandError(f"between names two laws, got {len(pair)}")
    first, second = sorted(sim.own_laws.named(one) for one in pair)
    if first == second:
        raise CommandError(
            f"between needs two different laws, both are {pair[0]}; pairs of discs with the same law follow that law"
        )
    if law == LINEAR:
        if parameter:
            raise CommandError(f"parameter applies to a user law, not to {LINEAR}")
        sim.own_laws.between[first, second] = 0, ()
    else:
        number, values = _added(sim, law, parameter, folder)
        sim.own_laws.between[first, second] = number, tuple(values[name] for name in OWN if name in values)
    sim.tables_changed()


def fix(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FIX: keep the present velocity of particles in these directions: "x", "y", "spin"."""
    sim.particles["fix"][chosen(sim, where)] |= sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()


def free(sim: Simulation, dofs: tuple[str, ...], where: Selection | None = None) -> None:
    """FREE: undo `fix` for these directions."""
    sim.particles["fix"][chosen(sim, where)] &= ~sum(FIX_BITS[d] for d in set(dofs))
    sim.tables_changed()
