"""Time series as text: a run appends rows, each of which begins with the step."""

from __future__ import annotations

import os
import re

from hpcdem.core.comm import Comm
from hpcdem.io.disk import explain, publish, remove


def append_rows(path: str | os.PathLike, header: str, rows: list[str], since: float | None, comm: Comm) -> None:
    """Append rows to the file. Collective.

    since: None to append; at the first call of a run, the step at which it starts: later rows of the file are removed
    (0: the file starts again), earlier ones are 0 in columns that they do not have. Raises HpcdemError on all ranks if
    the file cannot be written.
    """
    error = None
    if comm.rank == 0:
        try:
            if since is not None:
                _cut(path, header, since)
            with open(path, "a", encoding="utf-8") as file:
                file.writelines(f"{row}\n" for row in rows)
        except OSError as problem:
            error = explain(path, problem)
    comm.agree(error)


def _cut(path: str | os.PathLike, header: str, since: float) -> None:
    """Keep the rows up to a step. The last row may be truncated, as by a full disk; part of a number would read as a
    smaller number."""
    kept = [header]
    if since > 0 and os.path.exists(path):
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file.read().splitlines(keepends=True)[1:]:
                step = re.match(r"(\d+)[ ,]", line)
                if step is not None and int(step[1]) <= since and line.endswith("\n"):
                    new = header.count(",") - line.count(",") if step[0].endswith(",") else 0
                    kept.append(line.rstrip("\n") + ",0.0" * new)
    temporary = f"{os.fspath(path)}.tmp"
    try:
        with open(temporary, "w", encoding="utf-8") as file:
            file.write("\n".join(kept) + "\n")
        publish(temporary, os.fspath(path))
    except OSError:
        remove(temporary)
        raise
