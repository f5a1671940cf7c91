"""Time series as text: rows are appended as the run goes, each row begins with the step."""

from __future__ import annotations

import os
import re
from typing import Any

from hpcdem.io.disk import explain


def append_rows(path: str | os.PathLike, header: str, rows: list[str], since: int | None, comm: Any) -> None:
    """Collective. Add rows to the file.

    since: None to append; at the first call of a run the step it starts from: what the file has after that step is cut
    off (0: it starts anew). Raises HpcdemError on all ranks if it cannot be written.
    """
    error = None
    if comm.rank == 0:
        try:
            if since is not None:
                _cut(path, header, since)
            with open(path, "a", encoding="utf-8") as file:
                file.write("\n".join(rows) + "\n")
        except OSError as problem:
            error = explain(path, problem)
    comm.agree(error)


def _cut(path: str | os.PathLike, header: str, since: int) -> None:
    kept = [header]
    if since > 0 and os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            for line in file.read().splitlines()[1:]:
                step = re.match(r"\d+", line)
                if step is not None and int(step[0]) <= since:
                    kept.append(line)
    temporary = f"{os.fspath(path)}.tmp"
    with open(temporary, "w", encoding="utf-8") as file:
        file.write("\n".join(kept) + "\n")
    os.replace(temporary, path)
