"""What is equal on all ranks, held once per node of the machine.

The first rank of a node computes it, and puts its large arrays into files in memory that have no name any more; the
others map them. Every rank may write to what it got: the pages it wrote to are its own from then on (copy on write),
and nobody else sees them. So what is done alike on all ranks stays alike, and `share` makes one copy of it again.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError

SMALL = 1 << 16
"""Bytes of an array that is not worth a file: it travels with the rest."""
PIECE = 1 << 30
"""Bytes of a message at most."""
PREFIX = "hpcdem-shared-"


class Nodes:
    """The ranks of this node of the machine (host) and, on the first of them, the first ones of all nodes (leads, else
    None): both halo.comm.MpiComm, which imports this.

    folders: where files may be, in this order; notice: what a user should know of, said once by `warn`."""

    def __init__(self, host: Any, leads: Any, folders: tuple[str, ...] = ()) -> None:
        self.host, self.leads = host, leads
        self.folders = folders or ("/dev/shm", tempfile.gettempdir())
        self.warn: Callable[[str], None] | None = None
        self._told = self._making = False

    def share(self, make: Callable[[], Any], once: bool) -> Any:
        """See `Comm.per_node`."""
        if self._making or (self.host.size == 1 and not once):
            return make()
        parcel: tuple[bytes, list[Any]] = b"", []
        error: Exception | None = None
        if self.leads is not None:
            if self.leads.rank == 0 or not once:
                parcel, error = self._made(make)
            if once and self.leads.size > 1:
                parcel = _sent(self.leads, *parcel)
        made, told = self._handed_out(*parcel)
        if told is not None:
            raise error or told
        return made

    def _made(self, make: Callable[[], Any]) -> tuple[tuple[bytes, list[Any]], Exception | None]:
        """The result of `make()`, or its error, as others can read it: all but the large arrays, and these."""
        self._making = True
        try:
            return _packed((make(), None)), None
        except Exception as error:
            return _packed((None, _sendable(error))), error
        finally:
            self._making = False

    def _handed_out(self, head: bytes, large: list[Any]) -> Any:
        """The same object on all ranks of the node."""
        host = self.host
        if host.size == 1:
            return pickle.loads(head, buffers=large)
        head, sizes = host.bcast((head, [len(one) for one in large]))
        blocks = self._mapped(large, sizes)
        if blocks is None:
            self._notice(sum(sizes))
            blocks = [_broadcast(host, one) for one in large or [np.empty(size, np.uint8) for size in sizes]]
        return pickle.loads(head, buffers=blocks)

    def _mapped(self, large: list[Any], sizes: list[int]) -> list[Any] | None:
        """Arrays in memory of the node; None if there is no space for them."""
        if not sizes:
            return []
        place = self.host.bcast(self._written(large) if self.host.rank == 0 else None)
        if place is None:
            return None
        blocks: list[Any] = []
        try:
            blocks = [_map(Path(place) / str(k), size) for k, size in enumerate(sizes)]
        except OSError:
            pass
        failed = self.host.any(len(blocks) < len(sizes))  # all have them: now they need no names
        if self.host.rank == 0:
            shutil.rmtree(place, ignore_errors=True)
        return None if failed else blocks

    def _written(self, large: list[Any]) -> str | None:
        """A new folder with a file for each; None if no folder has space."""
        for folder in self.folders:
            place = None
            try:
                place = tempfile.mkdtemp(prefix=PREFIX, dir=folder)
                for k, one in enumerate(large):
                    _write(Path(place) / str(k), one)
                return place
            except OSError:
                if place is not None:
                    shutil.rmtree(place, ignore_errors=True)
        return None

    def _notice(self, size: int) -> None:
        if self.warn is not None and not self._told:
            self._told = True
            self.warn(
                f"the {self.host.size} ranks of a node keep separate copies ({size / 2**20:.0f} MiB so far), "
                f"because {' or '.join(self.folders)} has no space to share them. Enlarge /dev/shm, or set TMPDIR to "
                "a folder in memory"
            )


def _packed(thing: Any) -> tuple[bytes, list[Any]]:
    large: list[Any] = []

    def aside(buffer: pickle.PickleBuffer) -> bool:
        raw = buffer.raw()
        if raw.nbytes < SMALL:
            return True  # it stays where it is
        large.append(np.frombuffer(raw, np.uint8))
        return False

    return pickle.dumps(thing, protocol=5, buffer_callback=aside), large


def _sendable(error: Exception) -> Exception:
    """The error, or one with its message, if it cannot be sent."""
    with contextlib.suppress(Exception):
        pickle.loads(pickle.dumps(error))
        return error
    if isinstance(error, HpcdemError):
        return (CommandError if error.exit_code == CommandError.exit_code else HpcdemError)(str(error))
    return RuntimeError(f"{type(error).__name__}: {error}")


def _write(path: Path, content: np.ndarray) -> None:
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        os.posix_fallocate(file, 0, len(content))  # what there is no space for must not end in a bus error
        with mmap.mmap(file, len(content)) as room:
            room[:] = content.data
    finally:
        os.close(file)


def _map(path: Path, size: int) -> mmap.mmap:
    file = os.open(path, os.O_RDONLY)
    try:
        return mmap.mmap(file, size, access=mmap.ACCESS_COPY)
    finally:
        os.close(file)


def _broadcast(comm: Any, block: np.ndarray) -> np.ndarray:
    """The bytes of its first rank, on all ranks of a communicator: into the block where it is not that of the first."""
    for at in range(0, len(block), PIECE):
        comm.wait(comm.mpi.Ibcast(block[at : at + PIECE], 0))
    return block


def _sent(leads: Any, head: bytes, large: list[Any]) -> tuple[bytes, list[Any]]:
    """What the first rank of all has."""
    head, sizes = leads.bcast((head, [len(one) for one in large]))
    return head, [_broadcast(leads, one) for one in large or [np.empty(size, np.uint8) for size in sizes]]
