"""Saved state of both models in one file, bit for bit, on any number of ranks and threads.

The file is a checkpoint of blocks to which the tables of the particles were added, under their names with `PREFIX`
before them, and what the contacts between the two remember. One file: the two cannot be of different steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcdem.engine import checkpoint as engine
from hpcdem.io import checkpoint
from hpcdem.io.slabs import holders, to_slabs
from hpcdem.physics.coupling.links import Touching
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem import saved_state as of_particles
from hpcdem.physics.fdem import saved_state as of_blocks

KIND, PREFIX, CONTACTS = checkpoint.BOTH, checkpoint.OF_PARTICLES, checkpoint.LINKS


def save(both: Coupled, path: Path | str, extra: Mapping[str, Any]) -> None:
    """Write the state, and `extra` (JSON values) with it. Reads only: a run that saves resumes exactly like one that
    does not. Collective."""
    engine.save(both.blocks, path, lambda: _contents(both, extra))


def _contents(both: Coupled, extra: Mapping[str, Any]) -> engine.Contents:
    particles, blocks = both.particles, both.blocks
    state = of_blocks.state_of(blocks, extra)
    state.update(kind=KIND, particles=of_particles.state_of(particles), coupled=both.state())
    tables = dict(of_blocks.tables(blocks))
    tables.update({PREFIX + name: table for name, table in of_particles.tables_of(particles).items()})
    known = both.known()
    columns = {"gid": known.gid, "face": known.face, "friction": known.friction}
    tables[CONTACTS] = to_slabs(both.comm, ("gid", "face"), columns)
    return state, tables


def restore(both: Coupled, path: Path | str) -> dict[str, Any]:
    """Take the state of a file written by `save`, progress of the particles included; returns `extra`. Collective.
    CommandError if the file is missing, foreign or damaged; both models are then as they were."""
    state, tables = of_blocks.read(both.comm, path, KIND, "particles and blocks together")
    of_the_discs = {name.removeprefix(PREFIX): t for name, t in tables.items() if name.startswith(PREFIX)}
    both.begin_restore()
    gid, face, friction = (tables[CONTACTS][name] for name in ("gid", "face", "friction"))
    to = holders(both.comm, of_the_discs["particles"]["gid"], gid)
    known = Touching(*both.comm.to_ranks(to, gid, face, friction)[1:])
    of_blocks.put(both.blocks, state, of_blocks.without_particles(tables))
    of_particles.apply_state(both.particles, state["particles"], of_the_discs)
    both.particles.progress = state["particles"]["progress"]
    both.end_restore(state["coupled"], known)
    return state["extra"]
