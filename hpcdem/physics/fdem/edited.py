"""The part of a model of blocks that commands change after it has moved: its definition, and the consequences of a
change.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import notices
from hpcdem.physics.fdem.kernels import elements as element_kernels
from hpcdem.physics.fdem.kernels.creep import IN_KELVIN
from hpcdem.physics.fdem.local import Local
from hpcdem.physics.fdem.properties import KELVIN_STRAIN, MECH_BURGERS
from hpcdem.physics.fdem.state import State
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.fdem.topology import Numbers


class Edited(State):
    """A state whose definition may be changed at any time."""

    local: Local
    _state_given = False
    """A stress, or what must carry it, was set before anything moved, and is still to be checked."""

    @abstractmethod
    def open_model(self) -> None:
        """Make the model free to be changed: owned elements and their histories only. Joints that broke become free
        faces."""

    @abstractmethod
    def close_model(self) -> None:
        """Make the model ready to step: storage, ghosts and tables at the present positions."""

    @abstractmethod
    def _renew_lists(self) -> None:
        """Contact lists at the present positions; joints that broke become free faces. Storage stays."""

    def note(self, text: str) -> None:
        if self.log is not None:
            self.log.info(text)

    def before_change(self) -> None:
        if self.budget is not None and (self.closed or self.budget.running):
            self.close_model()  # the last step may have scheduled a rebuild
            if self.comm.any(bool(self.local.tally[:, element_kernels.NEW_BROKEN].any())):
                self._renew_lists()  # what broken joints lose is not the doing of commands
            self.budget.pause(self)
        if self.creep.passed > 0.0:
            self._settle_creep()
        self.open_model()

    def _settle_creep(self) -> None:
        """A command is about to change a model in motion: elements creep for the time that has passed. Collective."""
        if self.options.dynamic:
            self.close_model()
            if self.local.creeping.some:
                self.local.creeping.keep()
            self.creep.passed = 0.0

    def drop_creep_step(self) -> None:
        """Forget a creep step of a static run that did not come into balance: elements have not crept in it."""
        if self.creep.passed > 0.0 and not self.options.dynamic:
            self.creep.passed = 0.0
            self.open_model()

    def changed(self, topology: bool = False, stiffness: bool = True) -> None:
        self._topology_stale |= topology
        if topology:
            self._closed = None
        self.rebuild_state.soon()
        if stiffness:
            self.rebuild_state.dt = 0.0

    def set_element_model(self, elements: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        before = self.element_row.copy() if self.stress0 is not None and self.log is not None else None
        super().set_element_model(elements, name, properties)
        self._state_given |= self.clock.step == 0
        if name == MECH_BURGERS.name:
            self._take_kelvin_strain(elements, KELVIN_STRAIN[self.dim])
        if self.log is None or self.stress0 is None or before is None:
            return
        at = np.flatnonzero((before != self.element_row) & (before > 0))
        other = at[(self.initial_stresses(at) != self.stress0[at]).any(axis=1)]
        if len(other):
            self.log.warn_once(
                "initial stress follows",
                f"{len(other)} elements: initial stress was rescaled to the new moduli (element {other[0]}: "
                f"{notices.pascals(self.initial_stresses(other[:1])[0])} instead of "
                f"{notices.pascals(self.stress0[other[0]])}). Use element initial after the models to set it",
            )

    def element_property(self, elements: Numbers, properties: Mapping[str, Value]) -> None:
        super().element_property(elements, properties)
        self._state_given |= self.clock.step == 0
        self._take_kelvin_strain(elements, [name for name in KELVIN_STRAIN[self.dim] if name in properties])

    def initial_stress(self, *args: Any, **given: Any) -> None:
        super().initial_stress(*args, **given)
        self._state_given = True

    def _take_kelvin_strain(self, elements: Numbers, names: Sequence[str]) -> None:
        """The strain of the Kelvin units becomes what their properties say, in these components; the model is open."""
        at = self.numbers_of_elements(elements)
        for name in names:
            value = self.element_rows.column(name)[self.element_row]
            if "creep" not in self.cold:
                if not value[at].any():
                    continue
                self.cold["creep"] = np.zeros((len(self.number), self.memory("creep") * self.element_parts))
            mine, memory = np.isin(self.number, at), self.cold["creep"]
            first = IN_KELVIN[KELVIN_STRAIN[self.dim].index(name)]
            for column in range(first, memory.shape[1], self.memory("creep")):
                memory[mine, column] = value[self.number[mine]]

    def remove_table(self, name: str) -> None:
        if any(load.uses_table(name) for load in self.surface_loads):
            raise CommandError(f"table '{name}' is used by a boundary condition")
        super().remove_table(name)

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
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. Velocities become zero when it is
        changed, as those of the static mode are ways per step. collision (on): contact. large_strain (on): rotations of
        any size; off: geometry of the mesh. overlap ("refuse"): of bodies that overlap before the first step: refuse
        it; "relax": a static stage moves them apart; "keep": they start as they are. deep_overlap ("warn"): of bodies
        that come to overlap by more than a tenth of an altitude: say where; "stop": end the run. potential
        ("distance"): of contact in space, see `settings.POTENTIAL`. plane_stress (off): a model of the plane is a
        plate whose faces are stress-free; off: in plane strain. Said before stress and steps are."""
        before = self.options.dynamic
        if plane_stress not in (None, self.options.plane_stress) and self.clock.step > 0:
            raise CommandError(f"model plane-{'stress' if plane_stress else 'strain'} must precede the first step")
        if dynamic is not None and dynamic != before:
            self.drop_creep_step()
            if dynamic:
                notices.report_tables(self)
        super().option(dynamic, collision, large_strain, overlap, potential, deep_overlap, plane_stress)
        if self.options.dynamic != before:
            self.v[:] = 0.0
            if before:
                self._set(static_since=self.clock.step)

    def tables_over_time(self) -> list[str]:
        """Tables that conditions of blocks, bolts and liners follow; fluid and heat have clocks of their own."""
        others = [load for load in self.surface_loads if not load.own_clock]
        used = self.followed_tables()
        return [name for name in self.tables if name in used or any(load.uses_table(name) for load in others)]

    def changing_tables(self) -> list[str]:
        """Tables whose later values differ from the present one."""
        now = self.time_now()
        return [name for name in self.tables_over_time() if self.tables[name].changes_after(now)]
