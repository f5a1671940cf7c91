"""Particles and blocks in one run: discs that touch the free faces of elements.

Both simulations stay what they are, each with its strips, lists and clock; `Coupled` steps them with one time step.
After both have moved, the contacts between them are computed where the discs are owned (links.py,
physics/coupling/kernels/disc_faces.py) and added to the forces on both sides, with which both move in the next step.

A step after which a command changed one of the models begins with the forces that there were: contacts that touched
continue as they were, new ones begin at its end, as contacts of new particles do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.engine.rebuild import AT_A_GLANCE, CheckInterval
from hpcdem.halo.migrate import Trail
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.coupling.kernels import disc_faces
from hpcdem.physics.coupling.links import Link, Touching, face_frictions
from hpcdem.physics.coupling.work import Work
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.kernels import laws, motion
from hpcdem.physics.dem.kernels.neighbours import NO_ROWS
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem import build
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.surface_loads import SurfaceLoad

__all__ = ["Coupled"]

MARGIN = 0.5
"""Largest displacement of discs and faces towards each other between two searches, over the largest radius."""
SAFETY = 0.8
"""Fraction of the stability limit that is used as time step."""
ON_DISCS, ON_FACES = 0, 1
"""The two sides of the work done across the contacts."""


class Coupled(SurfaceLoad):
    """A model of particles and a model of blocks on the same ranks. Every method is collective.

    friction: of the contacts between them, the smaller of this and that of the disc counts; None: that of the disc.
    late: searches that came late.
    """

    name: ClassVar[str] = "discs"  # as a surface load of the blocks

    def __init__(self, particles: Simulation, blocks: Blocks, friction: float | None = None) -> None:
        if friction is not None and not 0.0 <= friction < math.inf:
            raise CommandError(f"friction must be a number that is not negative, got {friction}")
        if self.name in blocks.surface_loads or particles.coupled:
            raise CommandError("these blocks or particles are coupled already")
        if particles.settings.period:
            raise CommandError("particles with periodic sides (PERIODIC) cannot be coupled to blocks")
        if particles.settings.restitution < 1.0:
            raise CommandError("SET restitution does not support contacts with blocks, which have their own law")
        self.particles, self.blocks = particles, blocks
        self.comm = particles.comm
        self.friction = math.inf if friction is None else float(friction)
        self.link: Link | None = None
        self.late = 0
        self._known = Touching.nothing()
        self._asleep = False
        self._changed = True
        self._stepping = False
        self._inside = -1
        self._check_interval = CheckInterval()
        self._work = Work(self)
        self._settled = 0.0, 0.0, 0.0
        self._law_key: Any = None
        blocks.open_model()
        blocks.surface_loads.add(self)
        particles.coupled = True

    # ---- one step ----------------------------------------------------------------------------------------------------

    def advance(self, steps: int) -> int:
        """Take up to `steps` steps, fewer if there is an external request. Returns the request (0: none)."""
        request = done = 0
        self.prepare()
        while done < steps and not request:
            request = self._step()
            done += 1
        self._work.empty()
        self.particles.timers.count(done, len(self.particles.particles))
        self.blocks.timers.count(done, len(self.blocks.number[self.blocks.owned]))
        return request

    def _step(self) -> int:
        """Advance both by one dt. Returns what the outside requested (0: nothing), agreed by all ranks."""
        particles, blocks = self.particles, self.blocks
        self._close()
        work = self._work if self.accounted else None
        if work is not None:
            work.book_discs(kick=True)
        self._stepping = True
        request = particles.step()
        request = max(request, blocks.step())
        if work is not None:
            work.book_faces()
        particles.close_model()
        blocks.close_model()
        self._stepping = False
        due = self._check_interval.passed()
        if not self._link_holds():
            self._connect()
        elif due and self._check_rebuild(due == AT_A_GLANCE):
            self._connect()
        self._interact()
        if work is not None:
            work.book_discs(kick=False)
            work.book_faces()
            work.step_done()
        return request

    def prepare(self) -> None:
        """Close both models, choose one time step, and find contacts with the laws of the present materials: ready to
        step."""
        self._close()
        if self._renew_laws():
            self._replay()

    def _close(self) -> None:
        self.particles.close_model()
        self.blocks.close_model()
        if self._link_holds() and not self._changed and self.particles.clock.dt == self.blocks.clock.dt:
            return
        self._check()
        self.blocks.check_start()
        self._connect()
        self.links().refuse_discs_inside()
        self._replay()
        self._changed = False
        self._work.begin()

    def _check_options(self) -> None:
        """CommandError for options of the blocks that do not go with particles."""
        options = self.blocks.options
        if not options.dynamic:
            raise CommandError("coupled blocks need model option dynamic on, as particles move in time")
        if options.auto:
            raise CommandError("coupled blocks need a constant time step: use time-step auto off")
        if options.mass_scaling > 0.0:
            raise CommandError("coupled blocks need their true masses: use time-step mass-scaling 0")

    def _check(self) -> None:
        """CommandError if the two cannot be stepped together."""
        self._check_options()
        one, other = self.particles.clock.dt, self.blocks.clock.dt
        if one != other:
            raise CommandError(
                f"the time steps differ: {one!r} s of the particles, {other!r} s of the blocks; set the same step for "
                "both (SET dt and model time-step), or call `settle_time_step` again"
            )
        if self.accounted and self.particles.clumps:
            raise CommandError("the energy budget does not support clumps that are coupled to blocks: switch it off")

    def links(self) -> Link:
        """The contacts that can come about now."""
        assert self.link is not None
        return self.link

    def _link_holds(self) -> bool:
        """Return whether rows, owners and free faces are those for which contacts were found."""
        particles, blocks = self.particles, self.blocks
        return self.link is not None and self.link.made_for == (particles.rebuilds, blocks.rebuilds, particles.closed)

    def _connect(self) -> None:
        """Search for contacts at the present positions."""
        particles, blocks = self.particles, self.blocks
        with particles.timers("search"):
            if self.link is not None:
                self._known = self.link.touching()
                self.link.close()
            p = particles.particles
            radii = p["radius"]
            largest = float(self.comm.max_into(np.array([radii.max(initial=0.0)]))[0])
            self.link = Link(particles, blocks, MARGIN * largest if largest > 0.0 else 1.0, self._known)
            self._known = Touching.nothing()
            self._renew_laws()
        self._check_rebuild()

    def _check_rebuild(self, glance: bool = False) -> bool:
        """Measure the displacements since the search and set the step of the next check; a glance does so only if
        something has accelerated too much for it. Returns whether a search is due. Raises PhysicsError if a disc went
        through a face."""
        particles, blocks, link = self.particles, self.blocks, self.links()
        p, mesh, dt = particles.particles, blocks.the_mesh(), particles.clock.dt
        of_discs, of_blocks = np.zeros(4), np.zeros(4)
        with particles.timers("search"):
            motion.survey(p.hot, p.n_left, p.n_own, link.origin, dt, NO_ROWS, of_discs)
            build.survey(
                blocks.x, blocks.v, link.corners, blocks.owned.start, len(link.corners), mesh.cells, blocks.number,
                of_blocks,
            )  # fmt: skip
            found = np.array([of_discs[0], of_discs[1], of_blocks[0], of_blocks[1], float(self._inside)])
        with particles.timers("reduce"):
            self.comm.max_into(found)
        if found[4] >= 0.0:
            link.stop_on_breakthrough(int(found[4]))
        path_d, speed_d, path_b, speed_b = np.sqrt(found[:4]).tolist()
        margin, stride = link.margin - path_d - path_b, (speed_d + speed_b) * dt
        if glance and not self._check_interval.is_too_late(margin - 2.0 * stride, stride):
            return False
        self.late += margin < 0.0
        self._check_interval.wait(0.5 * max(margin, 0.0) / stride if stride > 0.0 else math.inf)
        return margin < 2.0 * stride

    # ---- forces ------------------------------------------------------------------------------------------------------

    def _interact(self) -> None:
        """Forces between the two at the present positions; friction moves on by dt."""
        link, particles = self.links(), self.particles
        link.fetch()
        with particles.timers("couple"):
            self._inside = max(self._inside, self._forces(False))
            b = particles.lists.blocks
            disc_faces.add_to_discs(1.0, link.disc_row, link.disc_force, b.cut, b.lo, b.foff, particles.lists.force)
        link.deliver()
        if particles.clumps:
            particles.clumps.sum_forces(particles.particles, particles.halo, particles.lists)

    def _replay(self) -> None:
        """The forces on the blocks as they were; those on the particles are stored with them."""
        link = self.links()
        link.fetch()
        with self.particles.timers("couple"):
            self._forces(True)
        link.deliver()

    def _forces(self, again: bool) -> int:
        link, particles = self.links(), self.particles
        p = particles.particles
        return int(
            disc_faces.forces(
                again, link.disc_row, link.disc_begin, p.hot, p.ihot, link.slot_face, link.slot_before, link.slot_after,
                link.slot_on, link.slot_fs, link.ends, link.face_model, self._laws, len(particles.materials),
                particles.clock.dt, link.seen, link.disc_force, link.slot_force,
            )
        )  # fmt: skip

    def _renew_laws(self) -> bool:
        """The table of laws: kinds of faces by element models by materials, see `law_table`. Whether it is another
        now."""
        rows, materials = self.blocks.element_rows, self.particles.materials.rows
        frictions = np.minimum(face_frictions(self.blocks), self.friction)
        key = len(rows), frictions.tobytes(), materials.tobytes()
        if key == self._law_key:
            return False
        self._laws = law_table(
            np.array(rows.column("shear")), np.array(rows.column("poisson_ratio")), materials, frictions
        )
        self._law_key = key
        return True

    # ---- called by the blocks ----------------------------------------------------------------------------------------

    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: corners of owned elements on faces that are free or may become so."""
        number = blocks.number[blocks.owned]
        cells = blocks.the_mesh().cells[number]
        faces = 4 * number[:, None] + np.arange(4)
        loose = (cells >= 0) & (~blocks.closed_faces()[faces] | (blocks.joint_row[faces] > 0))
        count = np.where(cells[:, 3] >= 0, 4, 3)[:, None]
        before = np.where(np.arange(4) > 0, np.arange(4) - 1, count - 1)
        return (loose | np.take_along_axis(loose, before, axis=1)) & (cells >= 0)

    def add_to(self, applied: np.ndarray) -> None:
        """Add the forces of discs to those applied to corners (n, 8) [N/m]."""
        if self.link is not None and not self._asleep:
            self.link.apply(applied)

    def storage_rebuilt(self) -> None:
        """The storage of the blocks is another: find the places of the forces in it."""
        if self.link is not None and not self._asleep:
            self._changed |= not self._stepping
            self._connect()
            self._replay()

    def mesh_replaced(self) -> None:
        """The blocks are others: nothing touches."""
        if self.link is not None:
            self.link.close()
        self.link, self._known = None, Touching.nothing()

    # ---- time step ---------------------------------------------------------------------------------------------------

    def settle_time_step(self, dt: float = 0.0) -> float:
        """Give both the same time step and return it [s]: `dt`; else what was set for one of them or for both alike
        (SET dt, model time-step); else `stable_time_step`. CommandError if particles and blocks have different ones."""
        particles, blocks = self.particles, self.blocks
        self._check_options()
        steps = [value for value in (particles.settings.dt, blocks.options.dt) if value > 0.0]
        if dt <= 0.0 and len(set(steps)) > 1:
            raise CommandError(
                f"SET dt {steps[0]:g} s and model time-step {steps[1]:g} s differ: set the same value, or only one of "
                "them"
            )
        stable = self.stable_time_step()
        dt = dt if dt > 0.0 else steps[0] if steps else stable
        if not math.isfinite(dt):
            raise CommandError("no time step: neither contacts nor elements limit it; use SET dt")
        particles.settings.dt = dt
        if particles.clock.dt != dt:
            particles.clock.dt = dt
            particles.tables_changed()
            particles.check_soon()
            particles.refresh_tables()
        if blocks.options.dt != dt:
            blocks.time_step(value=dt)
        blocks.close_model()
        self._changed = True
        self._settled = self._assigned_steps()
        if particles.log is not None:
            particles.log.info(f"particles and blocks: time step {dt:.4g} s, {dt / stable:.2f} of the stable one")
        return dt

    def _assigned_steps(self) -> tuple[float, float, float]:
        settings = self.particles.settings
        return settings.dt, settings.frac, self.blocks.options.dt

    def heed_time_step(self, by_frac: Callable[[], float]) -> None:
        """Settle the time step again if a command has assigned one to particles or blocks since then. by_frac:
        the step that SET frac requests [s], 0 without it. CommandError if particles and blocks have different ones."""
        if self._assigned_steps() == self._settled:
            return
        (dt, _, value), (dt_before, _, value_before) = self._assigned_steps(), self._settled
        new = {one for one, before in ((dt, dt_before), (value, value_before)) if one > 0.0 and one != before}
        if len(new) > 1:
            raise CommandError(
                f"the time steps differ: SET dt {dt:g} s of the particles, model time-step {value:g} s of the blocks"
            )
        if not new and value == value_before:  # SET frac: what was settled before counts no more
            self.blocks.time_step(value=0.0)
        self.settle_time_step(new.pop() if new else by_frac())

    def stable_time_step(self) -> float:
        """The time step [s] that is stable for the particles, the blocks and their contacts.

        omega^2 of a disc: what its contacts give, and k/m of two faces; of a corner at the surface: what elements,
        joints and contacts give, and the same bound 2 k/m for each of two discs; k: the stiffness of the contact, of
        Hertz at an overlap of 1 % of the radius. dt = 0.8 * 2 / omega."""
        particles, blocks = self.particles, self.blocks
        particles.close_model()
        blocks.close_model()
        self._renew_laws()
        p, local = particles.particles, blocks.local
        of_discs, of_blocks = diagnostics.critical_dt(particles), local.masses.critical_time_step()
        stiffness = np.zeros(1)
        used = np.flatnonzero(particles.used(p["material"], particles.materials))
        table = self._laws.reshape(-1, len(particles.materials), 4)[1 : len(blocks.element_rows), used].reshape(-1, 4)
        radius = float(self.comm.max_into(np.array([p["radius"].max(initial=0.0)]))[0])
        for model, a, _, _ in table.tolist():
            stiffness[0] = max(stiffness[0], laws.tangent_normal_stiffness(model, a, 4.0 * radius, 0.01 * radius))
        own = blocks.owned
        corner = local.true_mass[own][self.corners(blocks)]
        lightest = float(self.comm.min_into(np.array([corner.min(initial=math.inf)]))[0])
        # 1 / dt^2 of springs adds up: both limits are safety * 2 / omega.
        safety = blocks.options.safety
        of_corner = (1.0 / of_blocks) ** 2 + 4.0 * stiffness[0] / lightest / (2.0 * safety) ** 2
        of_disc = (1.0 / of_discs) ** 2 + 2.0 * stiffness[0] / diagnostics.lightest(particles) / (2.0 * SAFETY) ** 2
        fastest = max(of_corner, of_disc)
        return 1.0 / math.sqrt(fastest) if fastest > 0.0 else math.inf

    # ---- looking -----------------------------------------------------------------------------------------------------

    def contacts(self) -> dict[str, np.ndarray]:
        """Contacts between discs and faces on all ranks, in the order of gid and face: id (of the disc), face, fn, fs
        [N] (their part of the load), x, y of the contact [m], overlap [m], energy [J]."""
        self.prepare()
        link, p = self.links(), self.particles.particles
        out, at = np.zeros((len(link.slot_on), 6)), np.zeros((len(link.slot_on), 2), np.int64)
        n = disc_faces.contacts(
            link.disc_row, link.disc_begin, p.hot, p.ihot, link.slot_face, link.slot_before, link.slot_after,
            link.slot_on, link.slot_fs, link.ends, link.face_model, self._laws, len(self.particles.materials),
            link.seen, out, at,
        )  # fmt: skip
        slots = at[:n, 0]
        mine = link.slot_gid[slots], link.slot_number[slots], out[:n]
        gid, face, rows = (np.concatenate(part) for part in zip(*self.comm.allgather(mine)))
        order = np.lexsort((face, gid))
        names = ("fn", "fs", "x", "y", "overlap", "energy")
        return {"id": gid[order], "face": face[order], **dict(zip(names, rows[order].T))}

    def force_on_blocks(self) -> tuple[float, float]:
        """Sum of the forces of all discs on the blocks [N]."""
        self.prepare()
        force = self.links().face_force
        return tuple(exact_sum(force[:, [c, c + 2]], self.comm) for c in range(2))  # type: ignore[return-value]

    # ---- energy ------------------------------------------------------------------------------------------------------

    @property
    def accounted(self) -> bool:
        """An account of energy is kept, of one model at least."""
        return self.particles.energy is not None or self.blocks.budget is not None

    def energies(self) -> dict[str, float]:
        """See `Work.energies`."""
        self.prepare()
        return self._work.energies()

    # ---- state -------------------------------------------------------------------------------------------------------

    def known(self) -> Touching:
        """Return the histories of contacts."""
        return self.link.touching() if self.link is not None else self._known

    def state(self) -> dict[str, Any]:
        """Return the other saved values, as JSON values."""
        friction = None if math.isinf(self.friction) else self.friction
        return {"friction": friction, **self._work.state(), "late": self.late}

    def begin_restore(self) -> None:
        """Prepare for the replacement of both models."""
        self._asleep = True
        self.mesh_replaced()

    def end_restore(self, state: Mapping[str, Any], known: Touching) -> None:
        """Take over the state and the histories of contacts from a checkpoint."""
        self.friction = math.inf if state["friction"] is None else float(state["friction"])
        self._work.restore(state)
        self.late = int(state["late"])
        self._law_key = None
        self._known, self._changed, self._asleep = known, True, False
        self._settled = self._assigned_steps()

    def release(self) -> None:
        """Decouple the two; both may continue alone. Not collective."""
        self.mesh_replaced()
        self.blocks.surface_loads.remove(self)
        self.particles.coupled = False
        self.particles.trail = Trail()


def law_table(shear: np.ndarray, poisson: np.ndarray, materials: np.ndarray, frictions: np.ndarray) -> np.ndarray:
    """Laws of discs at faces, (kinds of faces * element models * materials, 4) [MODEL, A, B, MU]; row 0 of the models
    is none. frictions (kinds,): of the disc and of the face the smaller one counts.

    Linear discs: their own springs. Hertz discs: a sphere at a half-space of another material (Johnson 1985, ch. 4 and
    7), 1/E* = (1 - nu1)/(2 G1) + (1 - nu2)/(2 G2), F = 4/3 E* sqrt(R) U^1.5; 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2,
    ks = 8 G* sqrt(R U). shear [Pa] and poisson: of the element models.
    """
    table = np.zeros((len(shear), len(materials), 4))
    for e in range(1, len(shear)):
        for m, mat in enumerate(materials):
            mu = float(mat["fric"])
            if mat["hertz"]:
                with np.errstate(divide="ignore"):  # a modulus of zero: no force
                    soft = (1.0 - mat["poiss"]) / (2.0 * mat["shear"]) + (1.0 - poisson[e]) / (2.0 * shear[e])
                    slack = (2.0 - mat["poiss"]) / mat["shear"] + (2.0 - poisson[e]) / shear[e]
                table[e, m] = laws.HERTZ, 2.0 / 3.0 / soft, 4.0 / slack, mu
            else:
                table[e, m] = laws.LINEAR, mat["kn"], mat["ks"], mu
    every = np.tile(table, (len(frictions), 1, 1, 1))
    every[..., disc_faces.MU] = np.minimum(every[..., disc_faces.MU], frictions[:, None, None])
    return every.reshape(-1, 4)
