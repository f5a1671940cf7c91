"""Switches and numbers of a whole model of blocks: gravity, mode, what is computed, clocks, time step, damping."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.topology import Topology, finite

SAFETY = 0.8
"""Fraction of the stability limit that is used as time step."""
OVERLAP = REFUSE, RELAX, KEEP = "refuse", "relax", "keep"
"""Treatment of bodies that overlap before the first step."""
DEEP_OVERLAP = WARN, STOP = "warn", "stop"
"""Treatment of a run in which bodies come to overlap too deep."""
POTENTIAL = DISTANCE, MUNJIZA = "distance", "munjiza"
"""Potential of contact in space: the distance to the nearest side of an element, over a length of its body, or four
times the smallest of its barycentric coordinates (Munjiza 2004)."""
RAYLEIGH = {"both": (1.0, 1.0), "mass": (2.0, 0.0), "stiffness": (0.0, 2.0)}
"""Parts of Rayleigh damping, and the factors of both that make its ratio what was set at its frequency."""


@dataclass(frozen=True)
class Options:
    """Switches and numbers of the whole model, see `Blocks`. dt: the user's time step [s], 0 if estimated. At most one
    of dt, auto and mass_scaling is set; auto_every: steps between two estimates. overlap: one of `OVERLAP`,
    deep_overlap: of `DEEP_OVERLAP`; potential: of `POTENTIAL`, in space. mechanical, hydraulic: blocks move, fluid
    flows; one_way: fluid does not push; proppant: grains move in it; flow_every: steps of the blocks between two cycles
    of flow, of flow_steps sub-steps (0: as many as are needed) of flow_dt [s] (0: the time of those steps, or a stable
    one); thermal: heat flows, in cycles as often as those of flow, of heat_steps sub-steps of heat_dt [s] likewise.
    mass_damping [1/s], stiffness_damping [s]: Rayleigh damping, of dynamic runs. static_since: step at which static
    mode was switched on. plane_stress: a model of the plane is a plate whose faces are stress-free, else in plane
    strain, see moduli.py."""

    gx: float = 0.0
    gy: float = 0.0
    gz: float = 0.0
    dynamic: bool = True
    collision: bool = True
    large_strain: bool = True
    dt: float = 0.0
    auto: bool = False
    auto_every: int = 100
    safety: float = SAFETY
    mass_scaling: float = 0.0
    overlap: str = REFUSE
    deep_overlap: str = WARN
    static_since: int = 0
    potential: str = DISTANCE
    mechanical: bool = True
    hydraulic: bool = True
    one_way: bool = False
    proppant: bool = True
    flow_every: int = 1
    flow_steps: int = 0
    flow_dt: float = 0.0
    thermal: bool = True
    heat_steps: int = 0
    heat_dt: float = 0.0
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    plane_stress: bool = False


class Settings(Topology):
    """See `Options`. Methods that assign raise CommandError, alike on all ranks, and change nothing then."""

    options: Options
    stress0: np.ndarray | None
    """Stress [Pa] at zero strain (ne, 4), in space (ne, 6), columns `assignments.COMPONENTS`; None: none was given."""

    def gravity(self, gx: float, gy: float, gz: float = 0.0) -> None:
        """Acceleration of gravity [m/s2]."""
        x, y, z = finite("gravity", [gx, gy, gz]).tolist()
        if z != 0.0 and self.mesh is not None:
            self._only_in_space("gravity in z", z)
        self._set(gx=x, gy=y, gz=z)

    def option(
        self,
        dynamic: bool | None = None,
        collision: bool | None = None,
        large_strain: bool | None = None,
        overlap: str | None = None,
        potential: str | None = None,
        deep_overlap: str | None = None,
        plane_stress: bool | None = None,
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. collision (on): contact.
        plane_stress (off): a model of the plane is a plate; off: in plane strain; said before stress is.
        large_strain (on): rotations of any size; off: geometry of the mesh. overlap ("refuse"): of bodies that overlap
        before the first step: refuse it; "relax": a static stage moves them apart; "keep": they start as they are.
        deep_overlap ("warn"): of bodies that come to overlap by more than a tenth of an altitude: say where; "stop":
        end the run. potential ("distance"): of contact in space, see `POTENTIAL`."""
        given = {"dynamic": dynamic, "collision": collision, "large_strain": large_strain}
        changes: dict[str, Any] = {name: bool(value) for name, value in given.items() if value is not None}
        for name, value, known in (
            ("overlap", overlap, OVERLAP), ("deep_overlap", deep_overlap, DEEP_OVERLAP)
        ):  # fmt: skip
            if value is not None and value not in known:
                raise CommandError(f"{name.replace('_', '-')} is one of {', '.join(known)}, got {value}")
            if value is not None:
                changes[name] = value
        if potential is not None:
            if self.mesh is not None:
                self._only_in_space("model option potential", potential)
            if potential not in POTENTIAL:
                raise CommandError(f"the potential of contact is one of {', '.join(POTENTIAL)}, got {potential}")
            changes["potential"] = potential
        if plane_stress is not None and plane_stress != self.options.plane_stress:
            self._check_plane(plane_stress)
            changes["plane_stress"] = plane_stress
        self._set(**changes)

    def _check_plane(self, stress: bool) -> None:
        """CommandError where it is too late for plane stress or plane strain, or in space."""
        word = "model plane-stress" if stress else "model plane-strain"
        if self.mesh is not None and self.mesh.dim == 3:
            raise CommandError(f"{word} is for two dimensions")
        if self.stress0 is not None:
            raise CommandError(f"{word} must precede element initial: the stress across the plane depends on it")

    def parts(
        self,
        mechanical: bool | None = None,
        hydraulic: bool | None = None,
        one_way: bool | None = None,
        thermal: bool | None = None,
        proppant: bool | None = None,
    ) -> None:
        """Switch parts of the computation: motion of the blocks (on), flow (on), heat (on), grains in the fluid (on);
        one_way (off): fluid does not push on blocks."""
        given = {
            "mechanical": mechanical, "hydraulic": hydraulic, "one_way": one_way, "thermal": thermal,
            "proppant": proppant,
        }  # fmt: skip
        self._set(**{name: bool(value) for name, value in given.items() if value is not None})

    def flow_clock(self, every: int | None = None, steps: int | None = None, dt: float | None = None) -> None:
        """every: steps of the blocks between two cycles of flow; steps: sub-steps of a cycle, 0: as many as are needed;
        dt [s]: of a sub-step, 0: the time in which the blocks move, or without motion a stable one."""
        self._set(**self._clock(("flow_every", every, 1), ("flow_steps", steps, 0), flow_dt=dt))

    def heat_clock(self, steps: int | None = None, dt: float | None = None) -> None:
        """steps: sub-steps of a cycle of heat, 0: as many as are needed; dt [s]: of one, as that of flow."""
        self._set(**self._clock(("heat_steps", steps, 0), heat_dt=dt))

    @staticmethod
    def _clock(*counts: tuple[str, int | None, int], **steps: float | None) -> dict[str, Any]:
        """Checked counts (name, number, the least one) and time steps, those that were given."""
        changes: dict[str, Any] = {}
        for name, number, least in counts:
            if number is not None:
                if number < least:
                    raise CommandError(f"a number of sub-steps must be at least {least}, got {number}")
                changes[name] = int(number)
        for name, dt in steps.items():
            if dt is not None:
                changes[name] = float(finite("a time step", [dt])[0])
                if changes[name] < 0.0:
                    raise CommandError(f"a time step must not be negative, got {dt:g}")
        return changes

    def time_step(
        self,
        value: float | None = None,
        auto: bool | None = None,
        safety: float | None = None,
        mass_scaling: float | None = None,
    ) -> None:
        """Choose how the time step of the dynamic mode is found. Default: estimated at the first step and after changes
        of the model.

        value [s]: it is this. mass_scaling [s]: it is this, and nodes get the mass that makes it stable. auto on: it is
        estimated again every 100 steps (`estimate_every`), too. Of these three the one that was set last holds and
        ends the other two; 0 (off) takes it back. safety (0.8): part of the stability limit that is used, by estimates
        and mass scaling.

        CommandError for two of the three at once, and for a safety factor beside a value.
        """
        changes: dict[str, Any] = {}
        for name, number in (("dt", value), ("mass_scaling", mass_scaling)):
            if number is not None:
                changes[name] = float(finite("a time step", [number])[0])
                if changes[name] < 0.0:
                    raise CommandError(f"a time step must not be negative, got {number:g}")
        if safety is not None:
            if not 0.0 < safety <= 1.0:
                raise CommandError(f"the safety factor of the time step must lie in (0, 1], got {safety:g}")
            changes["safety"] = float(safety)
        if auto is not None:
            changes["auto"] = bool(auto)
        wanted = [name for name in ("dt", "mass_scaling", "auto") if changes.get(name)]
        if len(wanted) > 1:
            one, other = ({"dt": "value", "mass_scaling": "mass scaling"}.get(name, name) for name in wanted[:2])
            raise CommandError(f"{one} and {other} cannot be combined: both set the time step")
        if wanted == ["dt"] and safety is not None:
            raise CommandError("value and safety cannot be combined: a given time step is used unchanged")
        if wanted:
            changes = {"dt": 0.0, "mass_scaling": 0.0, "auto": False, **changes}
        self._set(**changes)

    def estimate_every(self, steps: int) -> None:
        """Steps after which an automatic time step is estimated again (100)."""
        if steps < 1:
            raise CommandError(f"steps between two estimates of the time step: at least 1 is needed, got {steps}")
        self._set(auto_every=int(steps))

    def rayleigh(self, ratio: float, frequency: float | None = None, part: str = "both") -> None:
        """Rayleigh damping C = alpha M + beta K, dynamic runs: `ratio` of the critical one at `frequency` [Hz].

        part "both": xi = (alpha / omega + beta omega) / 2 is least there, alpha = xi omega, beta = xi / omega; "mass":
        alpha = 2 xi omega alone; "stiffness": beta = 2 xi / omega alone. M: true masses, K: stiffness of the elements,
        without joints and contact. ratio 0: no more. CommandError in static mode.
        """
        if part not in RAYLEIGH:
            raise CommandError(f"the part of Rayleigh damping is one of {', '.join(RAYLEIGH)}, got {part}")
        xi = float(finite("the ratio of Rayleigh damping", [ratio])[0])
        if not 0.0 <= xi < 1.0:
            raise CommandError(f"the ratio of Rayleigh damping must lie in [0, 1), got {xi:g}")
        if xi == 0.0:
            self._set(mass_damping=0.0, stiffness_damping=0.0)
            return
        if frequency is None:
            raise CommandError("Rayleigh damping needs the frequency of its ratio")
        omega = 2.0 * math.pi * float(finite("the frequency of Rayleigh damping", [frequency])[0])
        if omega <= 0.0:
            raise CommandError(f"the frequency of Rayleigh damping must be positive, got {frequency:g} Hz")
        of_mass, of_stiffness = RAYLEIGH[part]
        self._set(mass_damping=of_mass * xi * omega, stiffness_damping=of_stiffness * xi / omega)

    def _set(self, **changes: Any) -> None:
        options = replace(self.options, **changes)
        if not options.dynamic and (options.mass_damping or options.stiffness_damping):
            raise CommandError(
                "Rayleigh damping needs a dynamic run: set it after dynamic on, and reset it with ratio 0 before "
                "dynamic off"
            )
        self.before_change()
        self.options = options
        self.changed()

    def gravity_down(self) -> float:
        """Gravity against the last axis [m/s2]."""
        return -(self.options.gz if self.dim == 3 else self.options.gy)

    def time_now(self) -> float:
        """Return the argument of tables and functions of conditions, see `State.time_now`."""
        return 0.0
