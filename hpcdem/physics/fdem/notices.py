"""Lines in the log about a model of blocks that a user should know of before it moves."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.assignments import COMPONENTS
from hpcdem.physics.fdem.kernels import joint_law
from hpcdem.physics.fdem.mesh import pieces
from hpcdem.physics.fdem.state import State

OUTSIDE, MUCH = 1e-6, 1e-3
"""Part of its largest component by which a stress must be beyond the strength to be spoken of: one that was given, one
that relaxation begins with."""
LOCKS = 0.45
"""Poisson's ratio above which a notice says that tetrahedra lock."""


def report_tables(sim: Any) -> None:
    """Static mode ends: a line in the log about tables that have another value at the model time."""
    then, now = sim.time_now(), sim.clock.time
    for name in sim.tables_over_time() if sim.log is not None else ():
        table = sim.tables[name]
        if table(then) != table(now):
            sim.log.warn(
                f"table '{name}' of a condition goes from {table(then):g} to {table(now):g}: static mode, where a step "
                f"is one unit of time, reached {then:g}, and the model time is {now:g} s. If this is not intended, "
                "assign the condition again with a number or another table"
            )


def warn_of_quick_tables(sim: Any) -> None:
    """A line in the log about tables that are over within a static step."""
    if sim.options.dynamic or sim.creep.on or sim.log is None:
        return
    now = sim.time_now()
    for name in sim.changing_tables():
        if sim.tables[name].times[-1] - now < 1.0:
            sim.log.warn_once(
                f"table {name} in a static step",
                f"table '{name}' of a condition goes from {sim.tables[name](now):g} to {sim.tables[name].values[-1]:g} "
                "within one static step, which is one unit of time. Assign the condition after the static stage if it "
                "belongs to motion in time, or define the table in steps",
            )


def warn_of_given_stress(sim: Any) -> None:
    """A line in the log about elements that cannot bear the stress they were given. Collective."""
    if sim.stress0 is not None:
        _report_beyond(sim, OUTSIDE, sim.stress0_row > 0, "have an initial stress beyond their strength")


def warn_of_flow(sim: Any) -> None:
    """A line in the log about elements that relaxation lets flow before it finds balance, as something has changed
    since they were in balance. Collective."""
    sim.close_model()
    if not sim.options.dynamic and sim.options.mechanical:
        _report_beyond(sim,
            MUCH, sim.alive, "exceed their strength in the present state and yield permanently before equilibrium is "
            "reached. Use model solve elastic first, or make the change in small parts",
        )  # fmt: skip


def _report_beyond(sim: Any, least: float, of: np.ndarray, what: str) -> None:
    """Report the number of these elements (ne,) bool outside their strength by this part of their stress, and the
    farthest one; once for one state. Collective."""
    if not sim.local.yielding.on:
        return
    stress = sim.local.stresses(energies=False, flow=False)[0]
    beyond = sim.local.yielding.beyond(stress)
    number = sim.number[sim.owned]
    bad = np.flatnonzero((beyond > least * np.abs(stress).max(axis=1)) & of[number])
    worst = bad[np.lexsort((number[bad], -beyond[bad]))[:1]]
    found = sim.comm.allgather((len(bad), [(-beyond[i], int(number[i]), stress[i]) for i in worst]))
    count = sum(part[0] for part in found)
    if sim.log is None or not count:
        return
    far, element, stress = min((one for part in found for one in part[1]), key=lambda one: one[:2])
    place = ", ".join(f"{c:.4g}" for c in sim.the_mesh().centroids(np.array([element]))[0])
    sim.log.warn_once(
        f"beyond strength {count} {element} {far}",
        f"{count} elements {what}; the largest excess is {-far:.4g} Pa, of element {element} at ({place}): "
        f"{pascals(stress)}",
    )


def warn_of_locking(sim: State) -> None:
    """A line in the log about tetrahedra that hardly change their volume."""
    if sim.dim == 2:
        return
    bulk, shear = (np.array(sim.element_rows.column(name)) for name in ("bulk", "shear"))
    with np.errstate(divide="ignore", invalid="ignore"):
        nu = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))

    def find() -> tuple[int, float]:
        of = np.where(sim.alive & (sim.the_mesh().macro_of() < 0), nu[sim.element_row], 0.0)
        return int((of > LOCKS).sum()), float(of.max(initial=0.0))

    count, most = sim.per_node(find) if (nu > LOCKS).any() else (0, 0.0)
    if count and sim.log is not None:
        sim.log.warn_once(
            "locking",
            f"{count} tetrahedra have a Poisson's ratio up to {most:.3g}: constant-strain tetrahedra lock near 0.5; "
            "use hexahedra",
        )


def warn_of_snap_back(sim: State) -> None:
    """A line in the log about joints so brittle that they are gone within a tenth of their elastic opening.
    Collective."""
    if not len(sim.joint_rows) > 1:
        return

    def find() -> np.ndarray:
        faces = np.flatnonzero(sim.closed_faces() & (sim.joint_row > 0))
        longest = np.zeros(len(sim.joint_rows))
        for at in pieces(len(faces)):
            length = sim.the_mesh().joint_lengths(faces[at], sim.partner)
            np.maximum.at(longest, sim.joint_row[faces[at]], length)
        return longest

    longest = sim.per_node(find)
    if sim.log is None:
        return
    for strength, penalty, energy in (
        ("tensile_strength", "penalty_normal", "gf1"), ("cohesion", "penalty_shear", "gf2"),
    ):  # fmt: skip
        t, p, g = (sim.joint_rows.column(name) for name in (strength, penalty, energy))
        rows = np.flatnonzero((longest > 0.0) & (t > 0.0) & (p > 0.0))
        elastic, softening = joint_law.ways(t[rows], p[rows], g[rows], longest[rows])
        brittle = softening < 0.1 * elastic
        if not brittle.any():
            continue
        worst = np.argmin(softening / elastic)
        row = rows[worst]
        where = "a face" if sim.dim == 3 else "an edge"
        others = f", and {int(brittle.sum()) - 1} other sets of properties," if brittle.sum() > 1 else ""
        sim.log.warn_once(
            f"snap back {row} {energy}",
            f"joints with {strength} {t[row]:g} Pa, {energy} {g[row]:g} N/m{others} break within a tenth of their "
            f"elastic displacement, {elastic[worst]:.3g} m at {where} of {longest[row]:.3g} m, which releases the "
            "stored energy suddenly. Use smaller elements or a higher penalty",
        )


def pascals(stress: np.ndarray) -> str:
    """The components of a stress [Pa] by name."""
    return ", ".join(f"{name} {value:.4g}" for name, value in zip(COMPONENTS[3], stress)) + " Pa"
