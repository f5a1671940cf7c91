"""Check the prose of the English pages with proselint; what it must not object to is in pyproject.toml.

scripts/test runs `python scripts/lib/prose.py`. Code, formulas, links and quotation marks are blanked, so that only
sentences are checked. The exit code is 1 if proselint objects to one.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from proselint.checks import __register__
from proselint.config import DEFAULT
from proselint.registry import CheckRegistry
from proselint.tools import LintFile

ROOT = Path(__file__).resolve().parents[2]
CODE = re.compile(r"^ *```.*?^ *```$|(`+)(?!`).*?(?<!`)\1(?!`)|\]\([^)\n]*\)|\$[^$\n]*\$|<!--.*?-->", re.M | re.S)
QUOTES = re.compile("[\"\u201c\u201d]|\\B'|'\\B")


def sentences(text: str) -> str:
    """A page with the same lines and columns, in which only sentences are left."""
    return QUOTES.sub("·", CODE.sub(lambda code: re.sub(r"\S", "·", code[0]), text))


def main() -> int:
    with (ROOT / "pyproject.toml").open("rb") as file:
        settings = tomllib.load(file)["tool"]["proselint"]
    allowed = re.compile("|".join(settings["allowed"]), re.DOTALL)
    CheckRegistry().register_many(__register__)
    off = dict.fromkeys(settings["off"], False)
    config = DEFAULT | {"checks": off | {check: on for check, on in DEFAULT["checks"].items() if check not in off}}
    pages = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    wrong = 0
    for name in pages.stdout.split():
        if name.endswith(".zh.md"):
            continue
        for error in LintFile(name, sentences((ROOT / name).read_text(encoding="utf-8"))).lint(config):
            line, column = error.pos
            if not allowed.search(error.check_result.message):
                print(f"{name}:{line - 1}:{column}: {error.check_result.message}")
                wrong += 1
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
