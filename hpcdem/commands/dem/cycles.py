"""CYC and IMPLE: the loop over steps, and what is due between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from functools import partial

import numpy as np

from hpcdem.commands.dem import flexure, output, surface
from hpcdem.commands.dem.bonds import warn_of_stiffnesses
from hpcdem.commands.dem.physics import check_time_step
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.outputs import OUTPUTS
from hpcdem.core.units import with_prefix
from hpcdem.engine.due import Task, answer, first_after
from hpcdem.physics.dem import diagnostics, periodic
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.dem.guards import NAMED
from hpcdem.physics.dem.kernels.contacts import MODEL
from hpcdem.physics.dem.kernels.laws import LINEAR, tangent_normal_stiffness
from hpcdem.physics.dem.simulation import Simulation

STEPBAR = 1000
"""Default interval of progress reports and rows of walls.csv [steps]."""
NEAR = 0.5
"""Ratio of the time step to the estimated critical one above which the exact limit is computed."""
REPORT_AGAIN = 1.2
"""Growth of the ratio to the stability limit after which it is logged again."""
MOST_STEPS = 2**53
"""Largest number of steps that frames and histories can store exactly."""
WATCH = 100
"""Interval of checks of the stability limit while new contacts may approach it [steps]."""
RELAXED = 10
"""Longest interval of such checks, over WATCH."""
TOUCHING = 8
"""Number of contacts per particle up to which a small time step is accepted without a check."""


def cycle(sim: Simulation, steps: int) -> None:
    """CYC: take so many steps. Write output at multiples of the SET intervals, and an `_ini` frame before the first
    step.
    """
    if steps < 0:
        raise CommandError(f"CYC needs a number of steps that is not negative, got {steps}")
    intervals = {kind: getattr(sim.settings, kind) for kind in OUTPUTS}
    _begin(sim, "CYC", steps, 0, intervals, final_frame=False)


def imple(
    sim: Simulation,
    wall: int,
    xmove: float | None = None,
    ymove: float | None = None,
    **every: float | None,
) -> None:
    """IMPLE: step until the displacement of the wall reaches xmove or ymove [m]. every: displacement of the wall
    between two outputs of a kind of OUTPUTS [m], from the start of the command.

    Kinds of output that are not given are off during the command; a frame is always written at its end.
    """
    if unknown := every.keys() - OUTPUTS:
        raise CommandError(f"IMPLE has no option {min(unknown)}; expected {', '.join(OUTPUTS)}")
    if (xmove is None) == (ymove is None):
        raise CommandError("IMPLE needs either xmove or ymove")
    axis, name = (0, "xv") if xmove is not None else (1, "yv")
    move = float(xmove if xmove is not None else ymove or 0.0)
    speed = float(sim.walls.v[sim.walls.row(wall), axis])
    if speed == 0.0:
        raise CommandError(f"wall {wall} does not move: {name} is 0, so it never reaches a displacement of {move:g} m")
    if move * speed < 0.0 and sim.log is not None:
        sim.log.warn(
            f"IMPLE: wall {wall} moves with {name} {speed:g}, opposite to the distance {move:g}; the sign of the "
            "distance is ignored"
        )
    prepare(sim)
    per_step = abs(speed) * sim.clock.dt
    for kind, distance in every.items():
        if distance is not None and distance < 0.0:
            raise CommandError(f"{kind} must not be negative, got {distance:g}")
    intervals = {k: max(_nearest(d / per_step), 1) if d else 0 for k, d in {**dict.fromkeys(OUTPUTS), **every}.items()}
    _begin(sim, "IMPLE", _nearest(abs(move) / per_step), sim.clock.step, intervals, final_frame=True)


def resume(sim: Simulation) -> None:
    """Finish the CYC or IMPLE in which a checkpoint was written."""
    if sim.progress is not None:
        prepare(sim, dt_known=True)
        _run(sim)


def stop(sim: Simulation) -> None:
    """STOP: the end of the script; histories are closed."""
    output.finish(sim)


def _nearest(steps: float) -> int:
    if not steps <= MOST_STEPS:
        raise CommandError(f"this would need {steps:g} steps")
    return math.floor(steps + 0.5)


def prepare(sim: Simulation, dt_known: bool = False) -> None:
    """Close and check the model and determine its time step, before the first cycle. Collective."""
    _check_materials(sim)
    surface.check(sim)
    periodic.check(sim)
    if sim.clumps and sim.settings.disk != "on":
        raise CommandError(
            f"there are clumps, and SET disk is {sim.settings.disk}: their mass is density times area, so they need "
            "SET disk on"
        )
    flexure.check(sim)
    sim.close_model()
    _check_laws(sim)
    dt = sim.clock.dt if dt_known else time_step(sim)
    if dt != sim.clock.dt:
        sim.clock.dt = dt
        sim.tables_changed()
        sim.check_soon()
    sim.refresh_tables()
    check_time_step(sim)


def _check_materials(sim: Simulation) -> None:
    p, rows = sim.particles, sim.materials.rows
    if (sim.settings.energy > 0 or sim.energy is not None) and (rows["xp"].any() or rows["yp"].any()):
        raise CommandError("the energy budget (SET energy) does not support xp and yp; use one of them")
    free = p["fix"] != 7
    light = (rows["density"][p["material"]] <= 0.0) & free
    if sim.comm.any(bool(light.any())):
        raise CommandError(_described(sim, light, "that are free to move have no density (PROP density)"))
    hertz = rows["hertz"] != 0.0
    has_law = np.where(hertz, rows["shear"], rows["kn"]) > 0.0
    in_use = sim.used(p["material"], sim.materials) & has_law
    if not in_use.any():  # nobody has one: particles that fly through each other, which is meant
        return
    cure = "(PROP shear, poiss and hertz, or kn and ks, after the line that makes them)"
    without_law = ~has_law[p["material"]]
    if sim.comm.any(bool((without_law & free).any())):
        raise CommandError(_described(sim, without_law & free, f"have no contact law, while others have {cure}"))
    # Fixed ones may be out of reach; if not, Hertz particles have no common law with them.
    if (in_use & hertz).any() and sim.comm.any(bool(without_law.any())):
        text = _described(
            sim, without_law, f"that are fixed have no contact law {cure}; contact with a Hertz particle is an error"
        )
        if sim.log is not None:
            sim.log.warn_once(f"lawless {text}", text)


def _described(sim: Simulation, which: np.ndarray, what: str) -> str:
    """``9 particles WHAT: 9 of group sed, made in line 7``, for the flagged owned particles (n_own,). Collective."""
    p = sim.particles
    firsts = np.array([first for first, _ in sim.makers], np.int64)
    lines = np.array([0, *(line for _, line in sim.makers)], np.int64)
    made_in = lines[np.searchsorted(firsts, p["gid"][which], side="right")]
    total: Counter[tuple[int, int]] = Counter()
    for part in sim.comm.allgather(dict(Counter(zip(p["group"][which].tolist(), made_in.tolist())))):
        total.update(part)
    parts = [
        f"{number} of group {sim.groups[group]}{f', created in line {line}' if line else ''}"
        for (group, line), number in sorted(total.items(), key=lambda item: (item[0][1], item[0][0]))
    ]
    more = f"; and {len(parts) - NAMED} more" if len(parts) > NAMED else ""
    return f"{sum(total.values())} particles {what}: {'; '.join(parts[:NAMED])}{more}"


def _check_laws(sim: Simulation) -> None:
    """Pairs in the list of which the particles have different laws have none, unless one is given for the two."""
    if not np.isnan(sim.pair_laws[:, MODEL]).any():
        return
    _, iout = diagnostics.contact_rows(sim)
    p = sim.particles
    material = dict(zip(p.ihot[:, 7].tolist(), p.ihot[:, 6].tolist(), strict=True))
    n, lost = len(sim.materials), np.isnan(sim.pair_laws[:, MODEL])
    mixed = [
        (a, b, *(sim.own_laws.title_of(sim.materials.rows[material[x]]) for x in (a, b)))
        for a, b, _ in iout.tolist()
        if lost[material[a] * n + material[b]]
    ]
    first = [pairs[0] for pairs in sim.comm.allgather(mixed[:1]) if pairs]
    if first:
        a, b, one, other = first[0]
        raise CommandError(f"particles {a} and {b} are in contact, but one has the law {one} and the other {other}")


def time_step(sim: Simulation) -> float:
    """Return the time step [s]: SET DT, or for SET frac f, f sqrt(m_min / k_max). Collective.

    m_min: smallest mass of a particle with a free degree of freedom (for clumps see observe.lightest). k_max: largest
    pair stiffness. Linear contacts: of any two materials, or material and wall, in use. Hertz contacts: tangent
    stiffness at the largest overlap (at 1 % of R if none exceeds 1e-6 R, as in a grid of discs that touch without
    force). Bonds: normal or shear stiffness of an open bond, whether the bonds are open or not. Source: step count
    published with Li et al. 2021, which does not mention bonds.
    """
    s = sim.settings
    if s.dt > 0.0:
        return s.dt
    if s.frac <= 0.0:
        raise CommandError("no time step: SET DT or SET frac must come before the first cycle")
    light = diagnostics.lightest(sim)
    if not math.isfinite(light):
        raise CommandError("SET frac: no particle is free to move, so no mass defines a time step; use SET DT")
    rows = _laws_in_use(sim)
    stiffest = max(float(np.max(rows[rows[:, 0] == 0.0, 1], initial=0.0)), diagnostics.stiffest_bond(sim))
    out, _ = diagnostics.contact_rows(sim)
    wout, _ = diagnostics.wall_rows(sim)
    now = np.concatenate([out[:, diagnostics.STIFFNESS], wout[:, diagnostics.STIFFNESS]])
    hertz = rows[rows[:, 0] == 1.0]
    largest = np.array([now.max() if len(now) and len(hertz) else 0.0])
    touching = float(sim.comm.max_into(largest)[0])
    if len(hertz):
        r = sim.largest_radius
        barely, pressed = (
            max(tangent_normal_stiffness(model, a, 2.0 * r, u * r) for model, a, *_ in hertz) for u in (1e-6, 0.01)
        )
        touching = touching if touching > barely else pressed
    stiffest = max(stiffest, touching)
    if stiffest <= 0.0:
        raise CommandError("SET frac: no stiffness is set (PROP kn, or shear with HERTZ); use SET DT")
    return s.frac * math.sqrt(light / stiffest)


def _laws_in_use(sim: Simulation) -> np.ndarray:
    """Rows (m, 4) of the laws of pairs and walls that particles can have. Collective."""
    used, n = np.flatnonzero(sim.used(sim.particles["material"], sim.materials)), len(sim.materials)
    pairs = sim.pair_laws.reshape(n, n, 4)[np.ix_(used, used)].reshape(-1, 4)
    walls = sim.wall_laws.reshape(-1, n, 4)[:, used].reshape(-1, 4)
    return np.concatenate([pairs, walls])


def _begin(sim: Simulation, name: str, n: int, origin: int, intervals: dict[str, int], final_frame: bool) -> None:
    """Write the `_ini` frame and run n steps."""
    if sim.progress is not None:
        raise CommandError(f"{name} cannot be used by a function that is called during {sim.progress['name']}")
    if sim.coupled:
        raise CommandError(
            f"{name} would step these particles without the blocks coupled to them: use `pcdc model step` for both"
        )
    prepare(sim)
    start(sim, name, n, origin, intervals, final_frame)
    _run(sim)


def start(
    sim: Simulation,
    name: str,
    steps: int | None,
    origin: int,
    intervals: dict[str, int],
    final_frame: bool = False,
    initial_frame: bool = True,
) -> None:
    """Begin a command that steps particles: sim.progress, the energy budget and the `_ini` frame. steps: None if the
    number is unknown. The model must be ready to step. Collective.
    """
    if sim.settings.energy > 0 and sim.energy is None:
        sim.prepare_kernels("energy")
        sim.energy = Budget()
    first = sim.clock.step
    sim.progress = {
        "name": name, "first": first, "last": None if steps is None else first + steps, "origin": origin,
        "intervals": intervals, "final_frame": final_frame, "position": sim.position,
    }  # fmt: skip
    warn_of_stiffnesses(sim)
    _warn_about_the_time_step(sim)
    if initial_frame:
        sim.last_frame = None  # the model may have been changed since, at the same step
        output.Snapshot(sim, initial=True, waits=False).write_print()
    if sim.energy is not None:
        new = sim.energy.start is None
        sim.energy.begin(sim)
        if new:
            output.write_energy(sim)


def _is_surely_small(sim: Simulation) -> bool:
    """Return whether the time step is far below its limit in any state of contact: springs are linear, and much stiffer
    ones would still be stable. Collective."""
    rows = _laws_in_use(sim)
    if (rows[:, 0] != LINEAR).any() or (sim.rolling is not None and sim.rolling.damped):
        return False
    largest = max(float(np.max(rows[:, 1:3], initial=0.0)), diagnostics.stiffest_bond(sim))
    if sim.rolling is not None:
        largest *= sim.rolling.most()
    return sim.clock.dt**2 * TOUCHING * largest <= (0.8 * NEAR) ** 2 * diagnostics.lightest(sim)


def _watch_the_time_step(sim: Simulation) -> None:
    """dt beside its limits while contacts form; a line whenever these have come down by a fifth. The more the stiffness
    may grow until dt comes near them, the later the next check. Collective.
    """
    step = sim.clock.step
    if sim.step_limit > 0.0 and step >= sim.next_watch:
        critical = diagnostics.critical_dt(sim)
        if math.isfinite(critical):
            sim.next_watch = step + WATCH * int(min(RELAXED, (NEAR * critical / sim.clock.dt) ** 2))
        if sim.clock.dt > NEAR * critical and critical < 0.8 * sim.step_limit:
            _report_limits(sim, critical, f"step {step}: ")
        _warn_of_rolling_dashpots(sim)


def _warn_of_rolling_dashpots(sim: Simulation) -> None:
    """A warning if they reverse a rotation in a step. Collective."""
    turning = 0.0 if sim.rolling is None else 2.0 * sim.clock.dt * sim.rolling.fastest(sim)
    if turning > 1.0 and sim.log is not None:
        sim.log.warn_once(
            "rolling dashpots", f"PROP rdamp: dashpots would reverse relative rotations within {1.0 / turning:.3g} "
            "steps, so rolling discs will not come to rest. Reduce the time step or rdamp"
        )  # fmt: skip


def _report_limits(sim: Simulation, critical: float, when: str = "") -> None:
    """dt beside the estimate of the critical step and the true one where it comes near; once, a warning if it is beyond
    one. Collective."""
    dt, shown = sim.clock.dt, partial(with_prefix, unit="s")
    near = dt > NEAR * critical or (math.isinf(critical) and sim.bonds_left() > 0)
    highest = diagnostics.highest_frequency(sim) if near else 0.0
    sim.step_limit = 0.0 if 0.5 * dt * highest > 1.0 else critical  # 0: the worst is reported
    if sim.log is None:
        return
    if highest > 0.0:
        text = (
            f"{when}the time step {shown(dt)} is {0.5 * dt * highest:.2f} of the stability limit of the present "
            f"contacts and bonds ({shown(2.0 / highest)})"
        )
        if math.isfinite(critical):
            text += f", {dt / critical:.2f} of the critical one as estimated from masses and stiffnesses "
            text += f"({shown(critical)})"
        if 0.5 * dt * highest > 1.0:
            sim.log.warn_once("unstable time step", f"{text}; beyond the limit the undamped step is unstable")
        elif dt > critical and not sim.log.has_warned("critical time step"):
            sim.log.warn_once(
                "critical time step",
                f"{text}. Beyond the estimate results may be noisy. Reduce the time step if the run becomes unstable",
            )
        elif 0.5 * dt * highest > REPORT_AGAIN * sim.reported_share:
            sim.reported_share = 0.5 * dt * highest
            sim.log.info(text)
    elif dt > critical:
        sim.log.warn_once(
            "critical time step",
            f"{when}the time step {shown(dt)} is {dt / critical:.2f} times the critical one as estimated from masses "
            f"and stiffnesses ({shown(critical)}); results may be noisy. Reduce the time step if the run becomes "
            "unstable",
        )


def _warn_about_the_time_step(sim: Simulation) -> None:
    """dt beside its limits where it comes near the estimate of the critical step; once, a warning if it is beyond one,
    or if lattice-solid damping reverses a velocity."""
    dt, sim.next_watch = sim.clock.dt, 0
    _report_limits(sim, diagnostics.critical_dt(sim))
    _warn_of_rolling_dashpots(sim)
    damping = sim.settings.lsm * dt / diagnostics.lightest(sim)
    braking = 0.0 if sim.dashpots is None else 2.0 * dt * sim.dashpots.fastest(sim)
    if sim.log is None:
        return
    if damping > 1.0:
        sim.log.warn_once("damping", f"SET damp lsm: eta dt / m is {damping:.3g} for the lightest particle, above 1")
    if braking > 1.0:
        sim.log.warn_once(
            "dashpots", f"SET restitution: dashpots would reverse velocities within {1.0 / braking:.3g} steps, so the "
            "restitution will not be met. Reduce the time step"
        )  # fmt: skip
    if sim.dashpots is not None and (sim.settings.lsm > 0.0 or (sim.materials.rows["damp"] > 0.0).any()):
        sim.log.warn_once(
            "restitution", "SET restitution: PROP damp and SET damp lsm dissipate additional energy, so rebounds will "
            "be lower than requested"
        )  # fmt: skip


class Due:
    """Output and checks that are due while the running command (sim.progress) steps the particles; every such loop uses
    them.

    checkpoint: write checkpoints at the SET save intervals, after all other output, so that each one knows that the
    rest is complete; None: the caller writes them. at_reports: called where rows of walls.csv are written.
    """

    def __init__(
        self,
        sim: Simulation,
        checkpoint: Callable[[Simulation], object] | None = output.write_checkpoint,
        at_reports: Callable[[], object] = lambda: None,
    ) -> None:
        self.sim, self._checkpoint, self._at_reports = sim, checkpoint, at_reports
        self._bar = sim.settings.stepbar if sim.settings.stepbar > 0 else STEPBAR
        self._tasks = self._listed()
        if sim.log is not None:
            sim.log.set_interval(explicit=sim.settings.stepbar > 0)

    def _listed(self) -> list[Task]:
        sim, progress = self.sim, self.sim.progress
        assert progress is not None
        origin, intervals = progress["origin"], progress["intervals"]
        tasks = flexure.tasks(sim)
        for ident, (every, _) in sorted(sim.history_requests.items()):
            tasks.append(Task(every, 0, partial(output.write_history, sim, ident)))
        last = -1 if progress["last"] is None else progress["last"]
        tasks.append(Task(self._bar, progress["first"], self._report, also=last))
        if sim.lands or not _is_surely_small(sim):  # deposits may be stiffer or smaller than all others
            tasks.append(Task(WATCH, 0, lambda _: _watch_the_time_step(sim)))
        for kind in OUTPUTS:
            if kind != "save" and intervals.get(kind, 0) > 0:  # older checkpoints have fewer kinds
                tasks.append(Task(intervals[kind], origin, getattr(output.Snapshot, f"write_{kind}")))
        if sim.drawing is not None and sim.draws:
            every, what = sim.drawing
            tasks.append(Task(every, origin, lambda moment: moment.write_drawing(what)))
        if sim.energy is not None and sim.settings.energy > 0:
            tasks.append(Task(sim.settings.energy, 0, partial(output.write_energy, sim)))
        if intervals["save"] > 0 and self._checkpoint is not None:
            write_checkpoint = self._checkpoint
            tasks.append(Task(intervals["save"], origin, lambda _: write_checkpoint(sim)))
        return tasks

    def _report(self, _: object = None) -> None:
        flexure.write(self.sim)
        output.report(self.sim)
        self._at_reports()

    def next(self) -> int:
        """Return the next step at which output is due or a function must be called."""
        return first_after(self.sim.clock.step, [*self._tasks, *_calls(self.sim)])

    def finish(self) -> None:
        """Write the final report of a command whose end was not known in advance. Collective."""
        sim, progress = self.sim, self.sim.progress
        assert progress is not None
        step, first = sim.clock.step, progress["first"]
        if progress["last"] is None and step > first and (step - first) % self._bar:
            self._report()

    def serve(self) -> None:
        """Call the functions registered for this step and write the output due at it. If one of them ends the command,
        progress["last"] becomes this step. Collective.
        """
        sim, step = self.sim, self.sim.clock.step
        assert sim.progress is not None
        if _call_watchers(sim):
            sim.progress["last"] = step
            self._tasks = self._listed()
        moment = output.Snapshot(sim, waits=False)
        for task in self._tasks:
            if task.due_at(step):
                task.run(moment)


def _run(sim: Simulation) -> None:
    """Steps up to the end of the running command (sim.progress)."""
    progress = sim.progress
    assert progress is not None
    last = progress["last"]
    if sim.log is not None:
        before = sim.clock.step - progress["first"]
        sim.log.command_started(progress["name"], sim.line, last - sim.clock.step, sim.clock.step, before)
    due = Due(sim)
    clock = sim.clock
    try:
        while clock.step < last:
            request = sim.advance(min(last, due.next()) - clock.step)
            due.serve()
            last = progress["last"]
            if request:
                answer(sim, request, partial(output.write_checkpoint, sim, None), lambda _: sim.resume_advice)
    except PhysicsError:
        output.write_crash_frame(sim)
        raise
    finally:
        output.wait_for_disk()
        sim.progress = None
        if sim.log is not None:
            sim.log.command_finished()
    if sim.energy is not None:
        sim.energy.pause(sim)
    surface.report(sim)
    if progress["final_frame"]:
        output.Snapshot(sim).write_print()
    output.settle(sim)


def _calls(sim: Simulation) -> list[Task]:
    """The moments at which surface processes act and watchers are called; requested again each time, as they may come
    and go."""
    processes = [Task(land.every, 0, partial(surface.act, sim, ident)) for ident, land in sim.lands.items()]
    return [*processes, *(Task(watcher.every, 0, watcher.call) for watcher in sim.watchers)]


def _call_watchers(sim: Simulation) -> bool:
    """Call those who want to see this step, before anything of it is written: a checkpoint then has what they did.

    They may have added particles or changed a wall, so the model is made ready again. Returns True if one of them, on
    any rank, wants the command to end here.
    """
    step, enough = sim.clock.step, False
    due = [task for task in _calls(sim) if task.due_at(step)]
    if due:
        output.settle(sim)  # they may look at files
        if sim.energy is not None:
            sim.energy.pause(sim)
    for task in due:
        with sim.timers.around("callback"):
            enough |= bool(task.run())
    if not due:
        return False
    if sim.closed:
        sim.refresh_tables()
    else:
        prepare(sim, dt_known=True)
    if sim.energy is not None:
        sim.energy.begin(sim)
    return sim.comm.any(enough)
