"""Lines in the words of PCDC's online help act: with a line the state is another one than without it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import pytest

from tests.pcdc.test_time import Rock

LINES = Path(__file__).with_name("online_lines.txt")
_MOTION = re.compile(
    r"(state|memories|flow_nodes|flow_channels|fluid_heat|heat_elements|heat_flow_nodes|proppant|bolt)"
)
_NEVER_THE_SAME = re.compile(r"element-steps|steps/s|steps in |compil")


@dataclass
class Context:
    """before, after: lines around each of those that are tried; moves: of these the ones that change the motion, says:
    what is saved, written or told."""

    before: str = ""
    after: str = ""
    moves: list[str] = field(default_factory=list)
    says: list[str] = field(default_factory=list)


def contexts() -> dict[str, Context]:
    """Those of LINES, which says how they are written."""
    found: dict[str, Context] = {}
    for text in LINES.read_text("utf-8").splitlines():
        if text.startswith("["):
            context = found.setdefault(text.strip("[]"), Context())
        elif text in ("moves", "says"):
            lines = getattr(context, text)
        elif text[:1] == ">":
            context.before += script(text[1:])
        elif text[:1] == "<":
            context.after += script(text[1:])
        elif text and text[0] != "#":
            lines.append(script(text))
    return found


def script(text: str) -> str:
    """Lines of a script from one of LINES."""
    out, goes_on = "", False
    for part in text.strip().split(" ;; "):
        out += f"{'' if goes_on else 'pcdc '}{part}\n"
        goes_on = part.endswith("...")
    return out


def traces(folder: Path, text: str) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """What a script leaves: what moved, and all else that is saved, written or told."""
    rock = Rock(folder, text)
    rock("pcdc model save 'end.sav'\n")
    moved: dict[str, bytes] = {}
    said: dict[str, bytes] = {}

    def take(name: str, of: object) -> None:
        if isinstance(of, h5py.Dataset):
            (moved if _MOTION.match(name) else said)[name] = of[()].tobytes()

    with h5py.File(folder / "end.sav") as file:
        file.visititems(take)
        said |= {f"attribute {name}": str(value).encode() for name, value in file.attrs.items()}
    moved["clock"] = repr((rock.blocks.clock.step, rock.blocks.clock.time)).encode()
    lines = [line for line in rock.blocks.log.lines if not _NEVER_THE_SAME.search(line)]
    said["log"] = "\n".join(lines).encode()
    said["files"] = " ".join(sorted(path.name for path in folder.rglob("*") if path.is_file())).encode()
    return moved, said


SLOW = "dynamic block", "bodies", "block at a lake", "loaded block", "heat"


@pytest.mark.parametrize("name", [pytest.param(one, marks=[pytest.mark.slow] * (one in SLOW)) for one in contexts()])
def test_each_line_acts(tmp_path, name):
    context = contexts()[name]
    without = traces(tmp_path / "without", context.before + context.after)
    assert traces(tmp_path / "again", context.before + context.after) == without  # what differs is the line's doing
    for kind, lines in enumerate((context.moves, context.says)):
        for k, line in enumerate(lines):
            found = traces(tmp_path / f"{kind} {k}", context.before + line + context.after)
            assert found[kind] != without[kind], f"{line.strip()}: {('moves nothing', 'does nothing')[kind]}"


def test_there_are_enough_lines():
    lines = [line for context in contexts().values() for line in (*context.moves, *context.says)]
    assert len(lines) == len(set(lines)) >= 150
