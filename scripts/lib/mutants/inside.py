"""The process that holds the tests of a copy of the tree: measures what they call, then tries one mutant after another.

python -m mutants.inside JOB     JOB: a file with what to do (cli.py)
"""

from __future__ import annotations

import hashlib
import importlib
import json
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from mutants import plain
from mutants.seeds import Mutant
from mutants.trial import Copy
from mutants.within import PACES, Session

WALL = 90.0
"""Seconds by the clock after which a file of tests, or a mutant, is given up."""


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text())
    if job["kernels"] == "plain":
        plain.install()
    few = {"max_examples": 10, "deadline": None, "derandomize": True, "database": None}
    hypothesis.settings.register_profile("mutants", **few)
    hypothesis.settings.load_profile("mutants")
    reach = Path(job["reach"])
    known = read(reach)
    elsewhere = {said["test"]: said["seconds"] for said in read(reach.with_name("compiled.jsonl")) if "test" in said}

    def work(session: Session) -> None:
        imported = session.functions()
        with reach.open("a") as out:

            def keep(said: dict[str, Any]) -> None:
                known.append(said)
                out.write(json.dumps(said) + "\n")
                out.flush()

            measure(session, known, elsewhere, keep)
        if not job["only_measure"]:
            try_all(session, known, imported, job)

    names = ["-q", "-p", "no:cacheprovider", "--no-header", "-m", "not slow", *job["tests"]]
    sys.exit(pytest.main(names, plugins=[Session(Path(job["root"]), work, PACES[job["kernels"]])]))


def read(reach: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in reach.read_text().splitlines()] if reach.is_file() else []


def measure(
    session: Session,
    known: list[dict[str, Any]],
    seconds: dict[str, float],
    keep: Callable[[dict[str, Any]], None],
) -> None:
    """What each test calls, of files that are not known as they are now. seconds: of tests with compiled kernels."""
    done = {(said["file"], said.get("text")) for said in known if "file" in said}
    for file, items in session.measurable(seconds).items():
        text = hashlib.sha256((Path(session.root) / file).read_bytes()).hexdigest()[:16]
        if (file, text) not in done:
            began = time.monotonic()
            outcomes: dict[str, int] = defaultdict(int)
            for said in session.measure(file, items, WALL):
                outcomes[said["outcome"]] += 1
                keep(said)
            keep({"file": file, "text": text})
            counts = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.items())
            print(f"measured {time.monotonic() - began:6.1f} s  {file}: {counts}", flush=True)


Reaching = tuple[int, float, str]
"""Functions that a test calls, its seconds, its name."""


def choice(reaching: list[Reaching], seconds: float) -> list[tuple[str, float]]:
    """(test, seconds) in the order in which they are run: of each file the one that calls least besides, then the next
    of each, as many as the time allows."""
    files: dict[str, list[Reaching]] = defaultdict(list)
    for one in sorted(reaching):
        files[one[2].partition("::")[0]].append(one)
    turns = [(turn, *one) for found in files.values() for turn, one in enumerate(found)]
    taken: list[tuple[str, float]] = []
    for _, _, spent, test in sorted(turns):
        if not taken or spent <= seconds:
            taken.append((test, spent))
            seconds -= spent
    return taken


def try_all(session: Session, known: list[dict[str, Any]], imported: set[str], job: dict[str, Any]) -> None:
    """Each mutant of the job. imported: functions that were called while tests were collected. With compiled kernels
    those that Python calls are tried; the others, kernels and what nobody calls, are left to the plain ones."""
    root, record = Path(job["root"]), Path(job["record"])
    calls: dict[str, list[Reaching]] = defaultdict(list)
    passed_tests: list[Reaching] = []
    for said in {said["test"]: said for said in known if "test" in said}.values():
        if said["outcome"] == "passed" and said["test"] in session.items:
            passed_tests.append((len(said["reach"]), said["seconds"], said["test"]))
            for function in said["reach"]:
                calls[function].append(passed_tests[-1])
    plainly = job["kernels"] == "plain"
    copy = Copy(root, root.parent)
    mutants = [Mutant(**given) for given in job["mutants"]]
    for file in {mutant.file for mutant in mutants}:  # forks would load anew what only tests load
        importlib.import_module(file.removesuffix(".py").removesuffix("/__init__").replace("/", "."))
    for mutant in mutants:
        began = time.monotonic()
        name = f"{mutant.file}::{mutant.function}"
        text = (root / mutant.file).read_text(encoding="utf-8")
        reaching = calls[name]
        if not plainly and not reaching:
            continue
        if name in imported and not reaching:  # a table at the top of the module, say: tests that may look into it
            callers = {
                test.partition("::")[0] for f in calls if f.startswith(f"{mutant.file}::") for _, _, test in calls[f]
            }
            reaching = [one for one in passed_tests if one[2].partition("::")[0] in callers]
        tests = choice(reaching, job["seconds"])
        entry: dict[str, Any] = {"mutant": mutant.name, "file": mutant.file, "kind": mutant.kind}
        by, passed = "", 0
        if tests and calls[name]:
            wall = 40.0 + 12.0 * sum(spent for _, spent in tests)
            try:
                by, passed = session.judge(mutant, text, tests, wall)
            except LookupError:
                tests = [] if plainly or name not in imported else tests
        if tests and not by and name in imported:
            if not plainly:
                continue
            by = copy.fresh(mutant, [test for test, _ in tests[:20]], WALL)
            passed = 0 if by else len(tests[:20])
        outcome = "killed" if by else "survived" if tests else "untested"
        entry |= {"outcome": outcome, "by": by, "passed": passed, "seconds": round(time.monotonic() - began, 1)}
        with record.open("a") as out:
            out.write(json.dumps(entry) + "\n")
        because = f"{by}: {session.why}" if by else passed
        print(f"{outcome:<9}{entry['seconds']:6.1f} s  {mutant.name}  {because}", flush=True)


if __name__ == "__main__":
    main()
