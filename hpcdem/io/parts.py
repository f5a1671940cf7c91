"""Parts of a file, each read by the rank that needs it: no rank has the whole file in memory."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.io.disk import explain

Parts = Sequence[tuple[int, int]]
"""First byte of each part and the one after its last."""

_MORE = 4096
"""Bytes searched at a time for the end of a line."""


def share(n: int, comm: Comm) -> tuple[int, int]:
    """First and one after the last of n things in a row that this rank takes: nearly equally many on all ranks."""
    return n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size


def read_parts(comm: Comm, path: str | os.PathLike, parts: Parts) -> list[np.ndarray]:
    """Collective: parts of a file, to each rank those it names, as bytes (n,) u1. HpcdemError on all ranks.

    Every rank reads for itself. On a host that does not see the file, or not yet all of it, rank 0 reads for it.
    """
    found, error = _read(path, parts)
    comm.agree(error if comm.rank == 0 else None)
    if comm.size == 1 or not comm.any(error is not None):
        return found
    blind = comm.allgather(None if error is None else parts)
    for rank, wanted in enumerate(blind):
        if wanted is None:
            continue
        sent, error = _read(path, wanted) if comm.rank == 0 else ([], None)
        comm.agree(error)
        # One row to one rank; those that get nothing need not know how long it is.
        row = np.concatenate([np.empty(0, np.uint8), *sent])[None, :]
        like = row if comm.rank == 0 else np.empty((0, sum(end - first for first, end in wanted)), np.uint8)
        _, arrived = comm.to_ranks(np.full(len(like), rank), like)
        if comm.rank == rank:
            found = np.split(arrived[0], np.cumsum([end - first for first, end in wanted])[:-1])
    return found


def _read(path: str | os.PathLike, parts: Parts) -> tuple[list[np.ndarray], str | None]:
    """The parts, and what is wrong."""
    found: list[np.ndarray] = []
    try:
        with open(path, "rb") as file:
            for first, end in parts:
                file.seek(first)
                found.append(np.fromfile(file, np.uint8, end - first))
                if len(found[-1]) < end - first:
                    return [], f"cannot read {os.fspath(path)}: it ends before byte {end}"
    except OSError as failure:
        return [], explain(path, failure, "read")
    return found, None


def read_lines(comm: Comm, path: str | os.PathLike, begin: int, end: int) -> bytes:
    """Collective: of the bytes `begin` to `end` of a text file the lines that begin in this rank's share of them, with
    their ends; joined in order they are all of these bytes. HpcdemError on all ranks."""
    first, last = (begin + at for at in share(end - begin, comm))
    (part,) = read_parts(comm, path, [(max(first - 1, begin), last)])
    text = part.tobytes()
    if first > begin:
        text = text[(text.find(b"\n") + 1) or len(text) :]
    while True:
        cut_off = bool(text) and not text.endswith(b"\n") and last < end
        if not comm.any(cut_off):
            return text
        first, last = last, min(last + _MORE, end) if cut_off else last
        (part,) = read_parts(comm, path, [(first, last)])
        more = part.tobytes()
        text += more[: (more.find(b"\n") + 1) or len(more)]
