"""What the suite knows about itself: how long its files take, which modules they reach, how a run ended.

As a plugin of pytest it says how much time is left. Where ``scripts/test`` names a
folder (HPCDEM_TEST_RESULTS), it records the result of each part and which modules of hpcdem each file of tests loads,
in this process and in the programs that it starts.

    python -m tests.suite summary FOLDER       one table of all parts; exit code 1 if a test failed
    python -m tests.suite changed [REVISION]   the files of tests that a change can break, most specific first
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import time
import uuid
from collections import Counter, defaultdict
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ROOT / ".pytest_cache" / "suite.json"
"""Seconds and modules of each file of tests, as the last whole run on this machine found them."""
SHIPPED = ROOT / "tests" / "durations.json"
"""Seconds of the longer files, for a tree in which nothing has been measured."""
EVERY = 60.0
"""Seconds between two lines with the time left."""
BUDGET = 120.0
"""Seconds by the clock that the tests of a change may take."""

HOW = ("nightly", "slow")
"""Marks of tests that a run leaves out unless it is asked for them by an option of this name."""


@cache
def measured() -> dict[str, dict[str, Any]]:
    """{"seconds": {file: s}, "reach": {file: [module]}}"""
    found: dict[str, dict[str, Any]] = {"seconds": {}, "reach": {}}
    if SHIPPED.is_file():
        found["seconds"] = json.loads(SHIPPED.read_text())
    if MEASURED.is_file():
        for name, values in json.loads(MEASURED.read_text()).items():
            found[name] |= values
    return found


def seconds_of(file: str) -> float:
    """Expected duration of a file of tests [s]."""
    return measured()["seconds"].get(file, 0.5)


# --- plugin of pytest --------------------------------------------------------------------------------------------


class Suite:
    """One run of pytest. In a worker of xdist it only counts the tests that are left out."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.controls = not hasattr(config, "workerinput")
        given = os.environ if self.controls else config.workerinput  # type: ignore[attr-defined]
        folder = given.get("HPCDEM_TEST_RESULTS")
        self.results = Path(folder) if folder else None
        self.began = self.told = time.monotonic()
        self.asked: Counter[str] = Counter()  # tests of each file
        self.done: Counter[str] = Counter()
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.outcomes: Counter[str] = Counter()
        self.skipped: Counter[str] = Counter()
        self.failed: dict[str, str] = {}
        self.left_out: Counter[str] = Counter()
        self.reach = self.results / "reach" if self.results else None
        if self.reach:  # a pytest that a test starts is no part of this run, but the programs that it starts are
            os.environ.pop("HPCDEM_TEST_RESULTS", None)
            recorder = str(ROOT / "tests" / "recorder")
            places = os.environ.get("PYTHONPATH", "").split(os.pathsep)
            if recorder not in places:
                os.environ["PYTHONPATH"] = os.pathsep.join([*filter(None, places), recorder])

    # In each process

    def pytest_deselected(self, items: list[pytest.Item]) -> None:
        for item in items:
            self.left_out.update([name for name in HOW if item.get_closest_marker(name)][:1])

    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Programs that this test starts write down what they have loaded. Resident ones serve many files."""
        if self.reach is not None:
            names = {"resident"} & set(getattr(item, "fixturenames", ()))
            for name in (_file(item.nodeid), *names):
                folder = self.reach / name.replace("/", "+")
                folder.mkdir(parents=True, exist_ok=True)
            if names:
                (self.reach / _file(item.nodeid).replace("/", "+") / "resident").touch()
            os.environ["HPCDEM_TEST_REACH"] = str(folder)

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if not self.controls:
            self.config.workeroutput["left_out"] = dict(self.left_out)  # type: ignore[attr-defined]
        elif self.results:
            record = {
                "part": os.environ.get("HPCDEM_TEST_PART", "pytest"),
                "seconds": time.monotonic() - self.began,
                "outcomes": self.outcomes,
                "skipped": self.skipped,
                "failed": self.failed,
                "left_out": self.left_out,
                "files": self.seconds,
                "exit": int(exitstatus),
            }
            self.results.mkdir(parents=True, exist_ok=True)
            (self.results / f"{time.time_ns()}-{uuid.uuid4().hex}.json").write_text(json.dumps(record))

    # In the process that speaks

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self._expect(item.nodeid for item in session.items)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, node: Any, ids: list[str]) -> None:
        self._expect(ids)

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        node.workerinput["HPCDEM_TEST_RESULTS"] = str(self.results or "")

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:
        self.left_out |= Counter(getattr(node, "workeroutput", {}).get("left_out", {}))

    def _expect(self, ids: Iterable[str]) -> None:
        self.asked = Counter(map(_file, ids))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if not self.controls:
            return
        file = _file(report.nodeid)
        self.seconds[file] += report.duration
        if report.failed:
            crash = getattr(report.longrepr, "reprcrash", None)
            self.failed[report.nodeid] = (crash.message if crash else str(report.longrepr)).partition("\n")[0][:200]
        if report.when == "call" or (report.when == "setup" and not report.passed):
            self.done[file] += 1
            self.outcomes[report.outcome] += 1
            if report.skipped:
                reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
                self.skipped[reason.removeprefix("Skipped: ")] += 1
        elif report.failed:  # its call has passed, its end has not
            self.outcomes["failed"] += 1
        self._tell()

    def _tell(self) -> None:
        reporter = self.config.pluginmanager.get_plugin("terminalreporter")
        now = time.monotonic()
        if reporter is None or now - self.told < EVERY:
            return
        self.told = now
        if left := self.left(now - self.began):
            reporter.ensure_newline()
            reporter.write_line(left)

    def left(self, elapsed: float) -> str:
        """A line with the time left, from the expected seconds of what is done and of what is not."""
        whole = sum(map(seconds_of, self.asked))
        done = sum(seconds_of(file) * min(1.0, self.done[file] / count) for file, count in self.asked.items())
        if not done:
            return ""
        failed = f", {self.outcomes['failed']} failed" if self.outcomes["failed"] else ""
        return f"{100 * done / whole:.0f} %, about {clock(elapsed * (whole - done) / done)} left{failed}"


def _file(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Suite(config), "hpcdem-suite")


# --- which worker runs which files -------------------------------------------------------------------------------

FAMILIES = {
    "blocks": "blocks bolts elements flow heat liners moisture pcdc proppant section",
    "space": "space coupled",
    "discs": "cases language laws parallel property published python specimen sweep",
}
"""Folders of tests that share kernels."""
_FAMILY = {folder: family for family, folders in FAMILIES.items() for folder in folders.split()}


def next_file(files: Iterable[str], families: dict[Any, str], node: Any) -> str:
    """The file that a worker runs next: the longest one of its family, as it has loaded the kernels; if that is done,
    of the family with most seconds left for each of its workers. families: of the workers; becomes that of now."""
    left: defaultdict[str, dict[str, float]] = defaultdict(dict)
    for file in files:
        left[_FAMILY.get("".join(Path(file).parts[1:2]), "rest")][file] = seconds_of(_file(file))
    if families.get(node) not in left:
        at = Counter(families.values())
        families[node] = max(left, key=lambda family: sum(left[family].values()) / (1 + at[family]))
    mine = left[families[node]]
    return max(mine, key=lambda file: mine[file])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Whole files, by `next_file`, also with -n alone: each worker would make again what is made once for a file. What
    else --dist asks for is left to xdist."""
    if config.getoption("dist") not in ("load", "loadfile"):
        return None
    from xdist.scheduler import LoadFileScheduling

    class ByFamily(LoadFileScheduling):
        families: dict[Any, str] = {}

        def _assign_work_unit(self, node: Any) -> None:
            self.workqueue.move_to_end(next_file(self.workqueue, self.families, node), last=False)
            super()._assign_work_unit(node)

    return ByFamily(config, log)


def clock(seconds: float) -> str:
    """Minutes and seconds as m:ss."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d} min"


# --- summary -----------------------------------------------------------------------------------------------------


def summary(folder: Path) -> int:
    """Print what came of all parts and keep what was measured; 1 if a test failed or there was none."""
    parts = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    total: Counter[str] = Counter()
    print("\n== summary")
    for part in parts:
        found = part["outcomes"]
        total.update(found)
        counts = ", ".join(f"{found.get(name, 0):6d} {name}" for name in ("passed", "failed", "skipped"))
        print(f"{part['part']:<22}{counts}   {clock(part['seconds'])}")
    skipped = sum((Counter(part["skipped"]) for part in parts), Counter[str]())
    for reason, count in skipped.most_common():
        print(f"skipped: {count} x {reason}")
    for name in HOW:
        if count := max((part["left_out"].get(name, 0) for part in parts), default=0):
            print(f"not run: {count} {name} tests (./scripts/test --{name})")
    failed = {name: message for part in parts for name, message in part["failed"].items()}
    for name, message in failed.items():
        print(f"failed:  {name}\n         {message}")
    if failed:
        print("again:   ./scripts/test " + " ".join(f"'{name}'" for name in list(failed)[:20]))
    print(f"{total['passed']} passed, {total['failed']} failed, {total['skipped']} skipped")
    _keep(parts, folder / "reach")
    return int(bool(failed) or not parts)


def _keep(parts: list[dict[str, Any]], reach: Path) -> None:
    """Add what this run measured to what earlier ones did."""
    kept = json.loads(MEASURED.read_text()) if MEASURED.is_file() else {"seconds": {}, "reach": {}}
    seconds: Counter[str] = Counter()
    for part in parts:
        seconds.update(part["files"])
    kept["seconds"] |= {file: round(value, 2) for file, value in seconds.items()}

    def loaded(name: str) -> set[str]:
        names: set[str] = set()
        for path in (reach / name).glob("*"):
            names |= loaded("resident") if path.name == "resident" else set(path.read_text().split())
        return names

    for path in reach.glob("tests+*"):
        kept["reach"][path.name.replace("+", "/")] = sorted(loaded(path.name))
    MEASURED.parent.mkdir(exist_ok=True)
    MEASURED.write_text(json.dumps(kept, indent=0, sort_keys=True))


# --- the tests of a change ---------------------------------------------------------------------------------------


def changed_files(since: str | None) -> list[str]:
    """Files that differ from a revision, by default from the last commit that the upstream branch has too."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else ""

    base = git("rev-parse", "--verify", f"{since}^{{commit}}") if since else git("merge-base", "HEAD", "@{upstream}")
    if since and not base:
        sys.exit(f"scripts/test --changed: git knows no revision {since}")
    base = base.strip() or "HEAD"
    names = git("diff", "-z", "--name-only", base) + git("ls-files", "-z", "--others", "--exclude-standard")
    return sorted(filter(None, set(names.split("\0"))))


def module_of(path: str) -> str:
    """hpcdem.core.units of hpcdem/core/units.py"""
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


_IMPORT = re.compile(
    r"^([ \t]*)(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]+))", re.M
)


@cache
def imports(path: Path, deep: bool) -> frozenset[str]:
    """Modules of this project that a file imports: at its top level or, deep, anywhere in it."""
    names: set[str] = set()
    for indent, module, given, plain in _IMPORT.findall(path.read_text()):
        words = re.findall(r"[\w.]+(?=\s*(?:,|\)|$|\sas\s))", re.sub(r"#.*", "", given or plain))
        if deep or not indent:
            names.update(f"{module}.{word}" for word in words) if module else names.update(words)
            names.add(module)
    return frozenset(name for name in names if name.partition(".")[0] in ("hpcdem", "tests") and _path(name))


@cache
def _path(module: str) -> Path | None:
    base = ROOT.joinpath(*module.split("."))
    return next((p for p in (base.with_suffix(".py"), base / "__init__.py") if p.is_file()), None)


def reached(test: str) -> tuple[frozenset[str], frozenset[str]]:
    """Modules that a file of tests imports itself, and all that it reaches."""
    own = imports(ROOT / test, True)
    found = set(own)
    left = list(own)
    while left:
        path = _path(left.pop())
        for name in imports(path, False) - found if path else ():
            found.add(name)
            left.append(name)
    return own, frozenset(found | set(measured()["reach"].get(test, ())))


def tests_of(files: Iterable[str]) -> list[str]:
    """The files of tests that a change of `files` can break: those that import what has changed, then those of the same
    subject by their name (heat, flow, ...), then all others that reach it; in each group those first that reach least
    besides. Files of other kinds (docs, scripts) are looked for by their names."""
    files = set(files)
    modules = {module_of(name) for name in files if name.endswith(".py") and name.startswith(("hpcdem/", "tests/"))}
    others = {Path(name).name for name in files if module_of(name) not in modules}
    subjects = set().union(*map(_words, files))
    ranked = []
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        test = path.relative_to(ROOT).as_posix()
        own, every = reached(test)
        if test in files:
            rank = 0
        elif own & modules or any(name in path.read_text() for name in others):
            rank = 1
        elif every & modules:
            rank = 2 if _words(test) & subjects else 3
        else:
            continue
        ranked.append((rank, len(every), test))
    return [test for _, _, test in sorted(ranked)]


def _words(path: str) -> set[str]:
    """Words of a path that say what it is about."""
    return set(re.split(r"[/_.]", path)) - {"hpcdem", "tests", "test", "py", "init", "physics", "commands", ""}


def within(tests: list[str], budget: float) -> tuple[list[str], list[str]]:
    """Those that fit into so many seconds of test time, in their order, and those that do not. One always fits."""
    taken: list[str] = []
    spent = 0.0
    for test in tests:
        if not taken or spent + seconds_of(test) <= budget:
            taken.append(test)
            spent += seconds_of(test)
    return taken, [test for test in tests if test not in taken]


def changed(since: str | None) -> int:
    """Print the files to test, one per line; on stderr, what they are chosen from."""
    files = changed_files(since)
    tests = tests_of(files)
    taken, left = within(tests, BUDGET * (os.cpu_count() or 1))
    say = f"{len(files)} changed files can break {len(tests)} files of tests; run: {len(taken)}"
    if left:
        say += f", left out: {len(left)} (about {clock(sum(map(seconds_of, left)) / (os.cpu_count() or 1))})"
    if not MEASURED.is_file():
        say += ". After one whole ./scripts/test the choice also knows which modules the programs load"
    print(say, file=sys.stderr)
    print("\n".join(taken))
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.suite")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("summary").add_argument("folder", type=Path)
    commands.add_parser("changed").add_argument("since", nargs="?")
    given = parser.parse_args()
    return summary(given.folder) if given.command == "summary" else changed(given.since)


if __name__ == "__main__":
    sys.exit(main())
