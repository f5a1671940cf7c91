"""Time series as text: rows are appended as the run goes, each row begins with the step."""

from __future__ import annotations

import os
import re

from hpcdem.core.comm import Comm
from hpcdem.io.disk import explain, publish, remove


def append_rows(path: str | os.PathLike, header: str, rows: list[str], since: float | None, comm: Comm) -> None:
    """Collective. Add rows to the file.

    since: None to append; at the first call of a run the step it starts from: what the file has after that step is cut
    off (0: it starts again). Raises HpcdemError on all ranks if it cannot be written.
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
    """Keep the rows up to a step. The last row may be a piece, as a full disk leaves it, and a piece of a number is a
    smaller number."""
    kept = [header]
    if since > 0 and os.path.exists(path):
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file.read().splitlines(keepends=True)[1:]:
                step = re.match(r"(\d+)[ ,]", line)
                if step is not None and int(step[1]) <= since and line.endswith("\n"):
                    kept.append(line.rstrip("\n"))
    temporary = f"{os.fspath(path)}.tmp"
    try:
        with open(temporary, "w", encoding="utf-8") as file:
            file.write("\n".join(kept) + "\n")
        publish(temporary, os.fspath(path))
    except OSError:
        remove(temporary)
        raise
