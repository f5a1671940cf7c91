"""The table of a campaign, into docs/reliability.md between its markers."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from faults.campaign import Row, steps_lost
from faults.kinds import KINDS

BEGIN, END = "<!-- campaign: begin -->", "<!-- campaign: end -->"


def table(rows: list[Row]) -> str:
    """A row for each kind, and one for all."""
    names = ["fault", "injected", "survived", "refused", "failed", "steps done twice: median", "largest"]
    lines = [names, ["---", *["---:"] * 6]]
    for name in [k for k in KINDS if any(row["kind"] == k for row in rows)]:
        lines.append(_line(name, [row for row in rows if row["kind"] == name]))
    lines.append(_line("**all**", rows))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _line(name: str, rows: list[Row]) -> list[str]:
    count: Counter[str] = Counter(row["result"] for row in rows)
    middle, most = steps_lost(rows)
    made = len(rows) - count["skipped"] - count["missed"]
    values = [made, count["survived"], count["refused"], count["failed"], f"{middle:g}", most]
    return [name, *map(str, values)]


def about(rows: list[Row]) -> str:
    """What each kind is."""
    return "\n".join(
        f"- **{name}**: {k.about}." for name, k in KINDS.items() if any(row["kind"] == name for row in rows)
    )


def text(rows: list[Row], setting: dict[str, Any]) -> str:
    """All that stands between the markers."""
    chains = sum(bool(row["chain"]) for row in rows)
    faults = sum(1 + len(row["chain"]) for row in rows if row["result"] not in ("skipped", "missed"))
    missed = Counter(row["result"] for row in rows)
    head = (
        f"{faults} faults in {len(rows) - missed['skipped'] - missed['missed']} runs, {chains} of them with a second "
        f"or third fault in the run that went on; seed {setting['seed']}, {setting['minutes']:.0f} minutes on "
        f"{setting['cores']} cores, {setting['mpi']}. In {missed['missed']} more the run was over before the fault "
        f"came, {missed['skipped']} could not be made on this machine."
    )
    by_model = Counter(row.get("model", "particles") for row in rows if row["result"] not in ("skipped", "missed"))
    head += " Runs of " + ", ".join(f"{key}: {n}" for key, n in by_model.items()) + "."
    return "\n\n".join([head, table(rows), about(rows)])


def into(page: Path, words: str) -> None:
    """Put a text between the markers of a page. ValueError without them."""
    old = page.read_text(encoding="utf-8")
    if old.count(BEGIN) != 1 or old.count(END) != 1:
        raise ValueError(f"{page.name} needs the lines {BEGIN} and {END}, once each")
    head, tail = old.split(BEGIN)[0], old.split(END)[1]
    page.write_text(f"{head}{BEGIN}\n\n{words}\n\n{END}{tail}", encoding="utf-8")
