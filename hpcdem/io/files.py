"""Files of sections, each made by all ranks or by rank 0: whole, or not there.

Only rank 0 touches the disk; other ranks send it their data in bounded pieces.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.behind import Deliveries
from hpcdem.io.rootfile import root_file
from hpcdem.io.transport import Places, Section, size_of, text_in_blocks, to_root, used


def write_sections(
    path: str | os.PathLike, comm: Comm, build: Callable[[], Sequence[Section]], later: Deliveries | None = None
) -> None:
    """Collective: write a file of sections, each either bytes (rank 0's are taken) or a table in slabs by rank.

    `build` is called on every rank and must return the same kinds of section in the same order everywhere; it may be
    collective. The bytes of the file do not depend on the rank count. Raises HpcdemError on all ranks; with `later` the
    file is written in the background, and settling the deliveries raises errors of the disk.
    """
    sections: Sequence[Section] = ()
    error = None
    try:
        sections = build()
    except (HpcdemError, ValueError) as failure:
        error = f"cannot write {os.fspath(path)}: {failure}"
    comm.agree(error)
    mine = sections if comm.rank == 0 else [s for s in sections if not isinstance(s, bytes)]
    with root_file(path, comm, later) as file:
        places = _places(comm, sections)
        if file is not None:
            for data, n in text_in_blocks(mine):
                places[0].write(file, data[:n], lambda data=data: used(data))  # type: ignore[misc]
        for rank, piece in to_root(comm, text_in_blocks(mine)):
            assert file is not None
            places[rank].write(file, piece, lambda piece=piece: used(piece))  # type: ignore[misc]


def _places(comm: Comm, sections: Sequence[Section]) -> list[Places]:
    """Return the locations of the text of each rank in the file; on rank 0 only. Collective."""
    sizes = [rows * width for rows, width in map(size_of, sections)]
    of_ranks = [sizes] if comm.size == 1 else comm.gather(sizes)
    if of_ranks is None:
        return []
    runs: list[list[tuple[str, int, int]]] = [[] for _ in of_ranks]
    at = 0
    for k, section in enumerate(sections):
        for rank, own in enumerate(of_ranks[:1] if isinstance(section, bytes) else of_ranks):
            runs[rank].append(("", at, own[k]))
            at += own[k]
    return [Places(r) for r in runs]
