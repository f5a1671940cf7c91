"""Data that are equal on all ranks, stored once per node of the machine.

The first rank of a node computes them and puts large arrays into files in memory; the other ranks map these files. The
files have no names, so a job that is killed at any moment leaves none behind. Every rank may write to its arrays: pages
that it writes become private (copy on write). Equal operations on all ranks keep the data equal, and `share` makes one
copy again.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import pickle
import resource
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError

SMALL = 1 << 16
"""Size of an array up to which no shared file is made [bytes]; it is sent with the rest."""
PIECE = 1 << 30
"""Largest size of a message [bytes]."""
FILES = 1 << 16
"""Number of files that a rank may open, if the system allows: each mapped array keeps one open."""


class Nodes:
    """The ranks of this node of the machine (host) and, on the first of them, the first ranks of all nodes (leads, else
    None); both are halo.comm.MpiComm, which imports this module.

    folders: possible folders of the files, in order of preference; notice: a message for the user that `warn` prints
    once.
    """

    def __init__(self, host: Any, leads: Any, folders: tuple[str, ...] = ()) -> None:
        self.host, self.leads = host, leads
        self.folders = folders or ("/dev/shm", tempfile.gettempdir())
        self.warn: Callable[[str], None] | None = None
        self._warned = self._making = False
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = FILES if hard == resource.RLIM_INFINITY else min(FILES, hard)
        if soft != resource.RLIM_INFINITY and soft < wanted:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))

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
        made, failure = self._handed_out(*parcel)
        if failure is not None:
            raise error or failure
        return made

    def _made(self, make: Callable[[], Any]) -> tuple[tuple[bytes, list[Any]], Exception | None]:
        """Call make() and return its result, or its error, in two parts that others can read: everything except large
        arrays, and the large arrays."""
        self._making = True
        try:
            return _packed((make(), None)), None
        except Exception as error:
            return _packed((None, _sendable(error))), error
        finally:
            self._making = False

    def _handed_out(self, head: bytes, large: list[Any]) -> Any:
        """Return an object that all ranks of the node share."""
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
        """Put arrays into memory of the node; None if the space is too small."""
        if not sizes:
            return []
        files = self._written(large) if self.host.rank == 0 else []
        opened = self.host.bcast([(f"/proc/{os.getpid()}/fd/{file}", _identity(file)) for file in files])
        blocks: list[Any] = []
        try:
            blocks = [_map(path, identity, size) for (path, identity), size in zip(opened, sizes)]
        except OSError:
            pass
        failed = self.host.any(len(blocks) < len(sizes))  # nobody opens the files after this
        for file in files:
            os.close(file)
        return None if failed else blocks

    def _written(self, large: list[Any]) -> list[int]:
        """Write arrays to open files without names; None if no folder has enough space."""
        for folder in self.folders:
            files: list[int] = []
            try:
                for one in large:
                    files.append(os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o600))
                    _write(files[-1], one)
                return files
            except OSError:
                for file in files:
                    os.close(file)
        return []

    def _notice(self, size: int) -> None:
        if self.warn is not None and not self._warned:
            self._warned = True
            self.warn(
                f"the {self.host.size} ranks of a node keep separate copies ({size / 2**20:.0f} MiB so far), because "
                f"{' or '.join(self.folders)} has no space to share them, or /proc hides the ranks from each other. "
                "Enlarge /dev/shm, or set TMPDIR to a folder in memory"
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
    """Return the error, or one with its message if it cannot be pickled."""
    with contextlib.suppress(Exception):
        pickle.loads(pickle.dumps(error))
        return error
    if isinstance(error, HpcdemError):
        return (CommandError if error.exit_code == CommandError.exit_code else HpcdemError)(str(error))
    return RuntimeError(f"{type(error).__name__}: {error}")


def _write(file: int, content: np.ndarray) -> None:
    os.posix_fallocate(file, 0, len(content))  # what there is no space for must not end in a bus error
    with mmap.mmap(file, len(content)) as view:
        view[:] = content.data


def _identity(file: int) -> tuple[int, int]:
    found = os.fstat(file)
    return found.st_dev, found.st_ino


def _map(path: str, identity: tuple[int, int], size: int) -> mmap.mmap:
    file = os.open(path, os.O_RDONLY)
    try:
        if _identity(file) != identity:
            raise OSError(f"{path} is another file: that of a process in another container")
        return mmap.mmap(file, size, access=mmap.ACCESS_COPY)
    finally:
        os.close(file)


def _broadcast(comm: Any, block: np.ndarray) -> np.ndarray:
    """Send the bytes of the first rank to all ranks of a communicator, into the block of each."""
    for at in range(0, len(block), PIECE):
        comm.wait(comm.mpi.Ibcast(block[at : at + PIECE], 0))
    return block


def _sent(leads: Any, head: bytes, large: list[Any]) -> tuple[bytes, list[Any]]:
    """Return the value of the first rank on all ranks."""
    head, sizes = leads.bcast((head, [len(one) for one in large]))
    return head, [_broadcast(leads, one) for one in large or [np.empty(size, np.uint8) for size in sizes]]
