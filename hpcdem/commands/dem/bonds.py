"""PROP with bond keys, and BOND break."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from hpcdem.commands.dem.properties import chosen, prop
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import GID, MATERIAL, RADIUS, X, Y
from hpcdem.core.selection import Selection
from hpcdem.core.units import with_prefix
from hpcdem.physics.dem.kernels import contacts, laws, mass
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.pre.section.crossing import crossing

ELASTIC = ("ebmod", "gbmod", "tstrength", "sstrength")
KEPT = (*ELASTIC, "rubber", "conserving", "moment")
TOLERATE = 1e-6
FARTHEST = 10.0
"""Widest gap that can be bonded, in radii of the largest particle; a wider one is probably a mistake of units and would
bond all particles."""


def bond(
    sim: Simulation,
    where: Selection | None = None,
    *,
    ebmod: float | None = None,
    gbmod: float | None = None,
    tstrength: float | None = None,
    sstrength: float | None = None,
    n_bond: float | None = None,
    s_bond: float | None = None,
    tolerate: float | None = None,
    rext: float | None = None,
    fric: float | None = None,
    rubber: bool = False,
    conserving: bool = False,
    moment: bool = False,
) -> int:
    """PROP with bond keys: bond touching pairs and update existing bonds.

    Pairs are those with d - (Ra + Rb) rext <= tolerate. Either ebmod, gbmod, tstrength, sstrength (elastic bonds) or
    n_bond, s_bond (contact bonds). Omitted properties keep their values; in new bonds they are 0.

    Parameters
    ----------
    where : particles whose pairs are bonded; both particles of a pair must be selected.
    ebmod, gbmod : Young's and shear modulus of elastic bonds [Pa].
    tstrength, sstrength : their tensile strength and cohesion [Pa].
    n_bond, s_bond : tensile and shear strength of contact bonds [N].
    tolerate : largest gap across which a pair is bonded [m] (default: 1e-6).
    rext : factor on the radii in the search for pairs (default: 1).
    fric : friction coefficient of the particles.
    rubber : bool: label the bonds as a membrane; the label has no mechanical effect.
    conserving : bool: use one shear stiffness for open and touching bonds, so that opening and closing conserve energy;
        for contact bonds of Hertz particles, the stiffness at the moment of bonding.
    moment : bool: elastic bonds resist relative rotation and break in tension by the stress at their outer fibre.

    Returns
    -------
    int : number of new bonds.
    """
    kind, given = _law_of((ebmod, gbmod, tstrength, sstrength), (n_bond, s_bond))
    given |= _marks(sim, given, rubber, conserving, moment)
    if sim.own_laws:
        raise CommandError(f"bonds are not supported with the user law {sim.own_laws.titles}")
    gap = TOLERATE if tolerate is None else tolerate
    scale = 1.0 if rext is None else rext
    largest, reach = _reach(sim, gap, scale)
    if fric is not None:
        prop(sim, where, fric=fric)
    if largest == 0.0:
        return 0

    _refuse_soft(kind, given)
    if moment:
        sim.bond_types.row(kind=kind, **given)  # contacts begin to remember with the next lists
    # Lists that are sure to hold every pair within the search distance, made at the present positions.
    sim.open_model()
    sim.close_model(least_skin=reach)
    lists, p = sim.lists, sim.particles
    which = _flags_with_ghosts(sim, where)
    renewed = _renewed(sim, kind, given).astype(np.int32)
    fresh = sim.bond_types.row(kind=kind, **given)
    made, longest2 = 0, 0.0
    for t in range(lists.n_blocks):
        n, d2 = contacts.make_bonds(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            len(sim.materials), which, renewed, fresh, gap, scale,
        )  # fmt: skip
        made += n
        longest2 = max(longest2, d2)
    lists.tally[:, contacts.LONGEST2] = longest2
    sim.tables_changed()
    total = sim.count(made)
    sim.bonds += total
    _warn_of_overstretched(sim, which)
    return total


def _law_of(elastic: Sequence[float | None], contact: Sequence[float | None]) -> tuple[int, dict[str, float]]:
    """The kind of bond that is meant, and its properties by their names in the table of types. elastic: in the order of
    ELASTIC; contact: tensile and shear strength [N]."""
    of_elastic = {name: v for name, v in zip(ELASTIC, elastic, strict=True) if v is not None}
    of_contact = {name: v for name, v in zip(("tstrength", "sstrength"), contact, strict=True) if v is not None}
    if of_elastic and of_contact:
        raise CommandError("a bond is either ebmod, gbmod, tstrength, sstrength or n_bond, s_bond, not both")
    given = of_elastic or of_contact
    if not given:
        raise CommandError("no bond property given: expected ebmod, gbmod, tstrength, sstrength or n_bond, s_bond")
    for name, value in given.items():
        if value < 0.0:
            raise CommandError(f"{name} must not be negative, got {value:g}")
    return laws.ELASTIC_BOND if of_elastic else laws.CONTACT_BOND, given


def _marks(sim: Simulation, given: dict[str, float], rubber: bool, conserving: bool, moment: bool) -> dict[str, float]:
    """Columns of the table of types that these words set beside the properties given."""
    if moment and not given.get("ebmod"):
        raise CommandError("moment: the bending stiffness follows from ebmod; assign ebmod above 0 with it")
    if rubber and sim.log is not None:
        sim.log.warn_once("rubber", "rubber: the mark is stored and written but has no effect on the motion")
    words = {"rubber": rubber, "conserving": conserving, "moment": moment}
    return {name: 1.0 for name, is_given in words.items() if is_given}


def _refuse_soft(kind: int, values: Mapping[str, float]) -> None:
    """CommandError for a type of bonds that lacks the modulus which its words need."""
    if kind == laws.ELASTIC_BOND and values.get("conserving") and not values.get("gbmod"):
        raise CommandError("conserving bonds have their own shear stiffness, touching or open: gbmod above 0 is needed")
    if values.get("moment") and not values.get("ebmod"):
        raise CommandError("bonds with a moment have their bending stiffness from ebmod: ebmod above 0 is needed")


def _reach(sim: Simulation, gap: float, scale: float) -> tuple[float, float]:
    """Largest radius, and the distance of surfaces within which pairs are searched for [m]. Collective."""
    if scale <= 0.0:
        raise CommandError(f"rext must be positive, got {scale:g}")
    largest = float(sim.comm.max_into(np.array([sim.particles["radius"].max() if len(sim.particles) else 0.0]))[0])
    reach = max(gap, 2.0 * largest * (scale - 1.0) + gap, 0.0)
    if reach > FARTHEST * largest > 0.0:
        raise CommandError(
            f"tolerate {gap:g} and rext {scale:g} would bond particles {reach:g} m apart; at most {FARTHEST:g} radii "
            f"of the largest particle, {FARTHEST * largest:g} m"
        )
    return largest, reach


def _warn_of_overstretched(sim: Simulation, which: np.ndarray) -> None:
    """A warning if bonds with both ends in which (n,) bool, per storage row, will break at once: their tension counts
    from where the particles just touch, wherever they are bonded. Collective."""
    lists, p = sim.lists, sim.particles
    number, widest = 0, np.zeros(1)
    for t in range(lists.n_blocks):
        n, gap = contacts.overstretched(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            contacts.bond_laws(sim.bond_types.rows), len(sim.materials), mass.SPHERES[sim.settings.disk], which,
        )  # fmt: skip
        number += n
        widest[0] = max(widest[0], gap)
    number = sim.count(number)
    sim.comm.max_into(widest)
    if number and sim.log is not None:
        sim.log.warn(
            f"{number} of these bonds exceed their tensile limit and will break in the next step: a gap counts as "
            f"tensile strain, also with tolerate. The widest gap at which such a bond stays intact is {widest[0]:g} m"
        )


def warn_of_stiffnesses(sim: Simulation) -> None:
    """Warn of bonds without normal stiffness, which never break in tension, and report bonds whose shear stiffness
    differs from that of their contacts: opening and closing under shear then changes the energy. The report is a
    warning if nothing damps the motion. Collective.
    """
    state = len(sim.bond_types), len(sim.materials), sim.bonds, sim.settings.lsm
    if state == sim.bonds_checked or not sim.bonds_left():
        return
    sim.bonds_checked = state
    lists, p, rows = sim.lists, sim.particles, sim.materials.rows
    slots = _slots(lists)
    mine = (lists.bond[slots] > 0) & (lists.row[slots] >= p.owned.start) & (lists.row[slots] < p.owned.stop)
    slots = slots[mine]
    i, j, types = lists.row[slots], lists.partner[slots], sim.bond_types.rows[lists.bond[slots]]
    first, second = p.ihot[i, MATERIAL], p.ihot[j, MATERIAL]
    ri, rj = p.hot[i, RADIUS], p.hot[j, RADIUS]
    length, two_rt = ri + rj, 4.0 * ri * rj / (ri + rj)
    law = sim.pair_laws[first * len(rows) + second]
    hertz, elastic = law[:, contacts.MODEL] == laws.HERTZ, types["kind"] == laws.ELASTIC_BOND
    area = 0.25 * math.pi * two_rt * two_rt if mass.SPHERES[sim.settings.disk] else two_rt
    gap = np.hypot(p.hot[j, X] - p.hot[i, X], p.hot[j, Y] - p.hot[i, Y]) - length
    of_contact = law[:, contacts.B] * np.where(hertz, np.sqrt(two_rt * np.maximum(-gap, 0.0)), 1.0)
    of_bond = law[:, contacts.B] * np.where(hertz, np.sqrt(two_rt * lists.u_made[slots]), 1.0)
    of_bond = np.where(elastic, types["gbmod"] * area / length, of_bond)
    of_tension = np.where(elastic, types["ebmod"], law[:, contacts.A])
    _warn_of_loose_bonds(sim, np.sort(p.ihot[np.stack([i, j])][:, of_tension == 0.0, GID], axis=0).T.tolist())
    larger, smaller = np.maximum(of_bond, of_contact), np.minimum(of_bond, of_contact)
    damped = (np.maximum(rows["damp"][first], rows["damp"][second]) > 0.0) | (sim.settings.lsm > 0.0)
    some = np.flatnonzero((types["conserving"] == 0.0) & (hertz | (larger - smaller > 1e-6 * larger)))
    number, undamped = sim.count(len(some)), sim.count(int((~damped[some]).sum()))
    mine_worst = sorted(
        (float(smaller[k] / larger[k]), *sorted((int(p.ihot[i[k], GID]), int(p.ihot[j[k], GID]))), float(of_bond[k]),
         float(of_contact[k]), bool(elastic[k]), bool(hertz[k]))
        for k in some
    )[:1]  # fmt: skip
    worst = sorted(one for part in sim.comm.allgather(mine_worst) for one in part)[:1]
    if not number or sim.log is None:
        return
    _, a, b, bond_ks, contact_ks, by_modulus, by_hertz = worst[0]
    shown = partial(with_prefix, unit="N/m", system=sim.settings.units)
    text = (
        f"the shear stiffness of {number} bonds changes when they open or close, most between particles {a} and {b}: "
        f"{shown(bond_ks)} open ({'G A/L of the bond' if by_modulus else 'ks at the moment of bonding'}), "
        f"{shown(contact_ks)} closed (ks of the contact{', which tends to 0 with the overlap' if by_hertz else ''}). "
        "Pairs that open and close under shear create energy; add the word `conserving` to the line of the bonds to "
        "prevent this (docs/physics.md, Bonds)"
    )
    if undamped:
        sim.log.warn_once("two shear stiffnesses", f"{text}. {undamped} of these pairs have no damping")
    else:
        sim.log.info(f"{text}. Damping dissipates energy but may be insufficient under small loads")


def _warn_of_loose_bonds(sim: Simulation, ids: list[list[int]]) -> None:
    """A warning of bonds without normal stiffness: ids of their particles, those of this rank. Collective."""
    number, firsts = sim.count(len(ids)), sim.comm.allgather(sorted(ids)[:1])
    if number and sim.log is not None:
        a, b = min(one for part in firsts for one in part)
        sim.log.warn_once(
            f"{number} loose bonds",
            f"{number} bonds have no normal stiffness, for example that of particles {a} and {b}: they carry "
            "no tension and never break in tension. Assign ebmod with tstrength, or kn with n_bond",
        )


def break_bonds(sim: Simulation, where: Selection | None = None, across: Sequence[np.ndarray] | None = None) -> int:
    """BOND break: remove the bonds between particles of a selection; friction limits their shear forces from then on.

    Parameters
    ----------
    where : particles; a bond is removed if both of its particles are selected (default: all).
    across : polylines, arrays of points (n, 2) [m]: remove only bonds that cross one of them (default: no restriction).
    """
    sim.close_model()
    lists = sim.lists
    if across is None:
        which = _flags_with_ghosts(sim, where)
        gone = sum(
            contacts.break_bonds(t, lists.blocks, lists.ptr, lists.partner, lists.bond, which)
            for t in range(lists.n_blocks)
        )
    else:
        slots, own = _across(sim, where, across)
        lists.bond[slots] = 0
        gone = int(own.sum())
    total = sim.count(gone)
    sim.bonds -= total
    return total


def renew(sim: Simulation, where: Selection | None, across: Sequence[np.ndarray], **values: float | None) -> int:
    """Assign properties to the bonds between particles of `where` that cross one of the polylines `across`, arrays of
    points (n, 2) [m], and return their number. Omitted properties keep their values; values: as of `bond`.
    """
    kind, given = _law_of([values.get(n) for n in ELASTIC], [values.get(n) for n in ("n_bond", "s_bond")])
    sim.close_model()
    slots, own = _across(sim, where, across)
    renewed = _renewed(sim, kind, given)
    lists = sim.lists
    if len(slots):
        lists.bond[slots] = renewed[lists.bond[slots]]
    sim.tables_changed()
    ends = np.zeros(len(sim.particles.hot), bool)
    ends[lists.row[slots]] = ends[lists.partner[slots]] = True
    _warn_of_overstretched(sim, ends)
    return sim.count(int(own.sum()))


def _across(sim: Simulation, where: Selection | None, lines: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Slots of the bonds with both ends in `where` that cross one of the lines, and which of them this rank counts."""
    lists, p = sim.lists, sim.particles
    which = _flags_with_ghosts(sim, where)
    slots = _slots(lists)
    slots = slots[(lists.bond[slots] != 0) & which[lists.row[slots]] & which[lists.partner[slots]]]
    i, j = lists.row[slots], lists.partner[slots]
    slots = slots[crossing(p.hot[i][:, [X, Y]], p.hot[j][:, [X, Y]], lines)]
    row = lists.row[slots]
    return slots, (row >= p.owned.start) & (row < p.owned.stop)


def _flags_with_ghosts(sim: Simulation, where: Selection | None) -> np.ndarray:
    """Selection flags per storage row; the owners decide for the ghosts."""
    p = sim.particles
    flags = np.zeros(len(p.hot), bool)
    flags[p.owned] = chosen(sim, where)
    sim.halo.fill(flags)
    return flags


def _renewed(sim: Simulation, kind: int, given: dict[str, float]) -> np.ndarray:
    """New type of every existing bond type: its own values overwritten, or a new kind altogether."""
    lists, table = sim.lists, sim.bond_types
    used = sim.used(lists.bond[_slots(lists)], table)
    used[0] = False
    mapping = np.arange(len(table))
    for m in np.flatnonzero(used):
        values = {name: float(table.rows[name][m]) for name in KEPT} if table.rows["kind"][m] == kind else {}
        values |= given
        _refuse_soft(kind, values)
        mapping[m] = table.row(kind=kind, **values)
    return mapping


def _slots(lists: Any) -> np.ndarray:
    """Indices of the pair slots in use."""
    pieces = []
    cut, lo, _, poff, _ = lists.blocks
    for t in range(lists.n_blocks):
        pieces.append(np.arange(lists.ptr[poff[t]], lists.ptr[poff[t] + max(cut[t + 1] - lo[t], 0)]))
    return np.concatenate(pieces)
