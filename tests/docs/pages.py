"""Pages of the documentation, taken apart: links, anchors, blocks."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    [*DOCS.glob("**/*.md"), *(ROOT / f"{n}.md" for n in ("README", "README.zh", "ARCHITECTURE", "CONTRIBUTING"))]
)
_FENCE = re.compile(r"^ *```([^\n`]*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block. language: the word behind the fence; mark: of the comment `<!-- mark: value -->` before it."""

    language: str
    text: str
    mark: str = ""
    value: str = ""


def blocks(page: Path) -> list[Block]:
    """All blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _FENCE.finditer(text):
        before = re.search(r"<!-- (\w+)(?:: (\S+))? -->\n$", text[: match.start()])
        found.append(Block(match[1].strip(), match[2], *((before[1], before[2] or "") if before else ())))
    return found


def without_blocks(page: Path) -> str:
    """A page without its blocks."""
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def prose(page: Path) -> str:
    """A page without its blocks and the code in its lines."""
    return re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", "`", without_blocks(page))


def links(page: Path) -> list[str]:
    """Targets of links and pictures, without those in other places of the world."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(page))
    return [link for link in found if not re.match(r"https?:|mailto:", link)]


@cache
def anchors(page: Path) -> set[str]:
    """What headings of a page are linked by."""
    text = without_blocks(page)
    seen: Counter[str] = Counter()
    found = set()
    for head in re.findall(r"^#+ (.*)", text, re.MULTILINE):
        head = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", head)
        slug = re.sub(r"[^\w\- ]", "", head.strip().lower()).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return found
