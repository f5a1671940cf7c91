"""Processes that stay alive and carry out one script after the other, and what must hold between two of them."""

from __future__ import annotations

import contextlib
import json
import re
import select
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, TextIO

from hpcdem.io.lock import NAME as LOCK
from hpcdem.lang.zdem import plan
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.runtime.run_folder import RECORD
from tests.conftest import ROOT, end, mpi_command, mpi_environment
from tests.foretold import frame_names
from tests.property.grammar import END, Model
from tests.short_push import HDF5, contents, files

WORKER = Path(__file__).with_name("worker.py")
START = 300.0
"""Longest wait for a worker [s]: the first one may have to compile."""
SECONDS = 60.0
"""Longest time of a script, which takes half a second where nothing else runs."""
RANKS = 3


class Lost(AssertionError):
    """A worker that died or does not answer."""


class Worker:
    """`ranks` processes of one job; started when first asked, and again after a loss."""

    def __init__(self, ranks: int, threads: int = 1) -> None:
        self.ranks, self.threads = ranks, threads
        self._process: subprocess.Popen | None = None
        self._lines: list[tuple[socket.socket, TextIO]] = []
        self._folder: tempfile.TemporaryDirectory | None = None
        self._owing = False

    def ask(self, **job: Any) -> None:
        """Hand out a job. Ranks that still owe an answer, as the other worker was lost meanwhile, are started again."""
        if self._owing:
            self.stop()
        if self._process is None:
            self._start()
        self._owing = True
        try:
            for _, talk in self._lines:
                talk.write(json.dumps(job) + "\n")
                talk.flush()
        except OSError:
            self._give_up(f"{self.ranks} ranks were gone before they were asked")

    def answers(self, seconds: float = SECONDS) -> list[dict[str, Any]]:
        """What the ranks say, in their order; Lost if one of them is silent for so long, or gone."""
        deadline = time.monotonic() + seconds
        found: dict[int, dict[str, Any]] = {}
        while len(found) < self.ranks:
            waiting = {line: talk for k, (line, talk) in enumerate(self._lines) if k not in found}
            ready, _, _ = select.select(list(waiting), [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                silent = sorted(set(range(self.ranks)) - found.keys())
                self._give_up(f"rank {silent} of {self.ranks} hangs: no answer within {seconds:g} s")
            for line in ready:
                words = waiting[line].readline()
                k = next(k for k, (other, _) in enumerate(self._lines) if other is line)
                if not words:
                    self._give_up(f"rank {k} of {self.ranks} died")
                found[k] = json.loads(words)
                if found[k].get("alone"):
                    self._give_up(f"rank {k} of {self.ranks} failed alone: {found[k]['text']}")
        self._owing = False
        return [found[k] for k in range(self.ranks)]

    def stop(self) -> None:
        """The end; kindly, then firmly."""
        self._owing = False
        for line, talk in self._lines:
            for thing in (talk, line):
                with contextlib.suppress(OSError):
                    thing.close()
        self._lines = []
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(10)
            end(self._process)
        self._process = None
        if self._folder is not None:
            self._folder.cleanup()
        self._folder = None

    def _start(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="hpcdem-")  # short: names of sockets have 100 letters
        address = f"{self._folder.name}/s"
        command = [*(mpi_command(self.ranks) if self.ranks > 1 else []), sys.executable, str(WORKER), address]
        command += [str(self.threads)]
        with socket.socket(socket.AF_UNIX) as door, open(self._log, "wb") as log:
            door.bind(address)
            door.listen(self.ranks)
            self._process = subprocess.Popen(
                command, env=mpi_environment() | {"PYTHONPATH": str(ROOT)}, stdin=subprocess.DEVNULL, stdout=log,
                stderr=log, start_new_session=True,
            )  # fmt: skip
            arrived: list[tuple[int, socket.socket, TextIO]] = []
            deadline = time.monotonic() + START
            while len(arrived) < self.ranks:
                if not select.select([door], [], [], 1.0)[0]:
                    if self._process.poll() is not None or time.monotonic() > deadline:
                        self._give_up(f"{self.ranks} ranks did not start")
                    continue
                line, _ = door.accept()
                talk = line.makefile("rw", encoding="utf-8")
                arrived.append((json.loads(talk.readline())["rank"], line, talk))
        self._lines = [(line, talk) for _, line, talk in sorted(arrived, key=lambda a: a[0])]

    @property
    def _log(self) -> Path:
        assert self._folder is not None
        return Path(self._folder.name) / "log"

    def _give_up(self, why: str) -> None:
        said = self._log.read_text(errors="replace")[-2000:]
        self._lines, lines = [], self._lines
        process, self._process = self._process, None
        if process is not None:
            end(process)
        self._process = None
        for line, talk in lines:
            with contextlib.suppress(OSError):
                talk.close()
            line.close()
        self.stop()
        raise Lost(f"{why}\n{said}")


class Resident:
    """`hpcdem WORDS` on n ranks, as `Launcher` does it, but by processes that stay: for tests that compare what many
    runs leave; others see to it that the program starts. Ranks and threads that were not asked before are started."""

    def __init__(self) -> None:
        self.workers: dict[tuple[int, int], Worker] = {}

    def __call__(
        self, n: int, *args: object, cwd: Path | None = None, timeout: float = 300.0
    ) -> subprocess.CompletedProcess[str]:
        """To its end; a test fails if it takes longer than `timeout` seconds, or if a rank is lost."""
        words = [str(arg) for arg in args]
        threads = int(words[words.index("-j") + 1]) if "-j" in words else 1
        worker = self.workers.setdefault((n, threads), Worker(n, threads))
        worker.ask(task="program", folder=str((cwd or Path()).resolve()), words=words, threads=threads)
        answers = worker.answers(timeout)
        out, err = ("".join(answer[name] for answer in answers) for name in ("out", "err"))
        return subprocess.CompletedProcess(["hpcdem", *words], answers[0]["code"], out, err)

    def stop(self) -> None:
        """Of all."""
        for worker in self.workers.values():
            worker.stop()


class Pair:
    """The same scripts on one rank and on three."""

    def __init__(self) -> None:
        self.one, self.three = Worker(1), Worker(RANKS)

    def stop(self) -> None:
        """Of both."""
        self.one.stop()
        self.three.stop()

    def compare(self, model: Model, accident: str = "", seconds: float = SECONDS) -> dict[str, Any]:
        """AssertionError unless a model ends alike on one rank and on three, and in one piece and in two.

        Returns what was seen on one rank: "code", "text", and of the last state "step", "bonds", ...; "refused" if the
        model is too narrow for three ranks.
        """
        with tempfile.TemporaryDirectory(prefix="hpcdem-") as name:
            return self._compare(model, Path(name), accident, seconds)

    def _compare(self, model: Model, folder: Path, accident: str, seconds: float) -> dict[str, Any]:
        one, three = folder / "one", folder / "three"
        again = END if model.lines[-1].endswith(END) or model.lines[-2:][0].endswith(END) else ""
        for worker, place in ((self.one, one), (self.three, three)):
            model.write(place)
            worker.ask(task="script", folder=str(place), script="model.py", again=again, accident=accident)
        alone, together = self.one.answers(seconds)[0], self.three.answers(seconds)
        for answer in (alone, *together):
            assert not answer["ours"], answer["text"]
        outcome = alone | alone["seen"] | {"share": [answer["seen"].get("owned", 0) for answer in together]}
        if "ranks are too many for this model" in together[0]["text"]:
            assert all(answer["code"] == 2 for answer in together)
            return outcome | {"refused": True}
        for answer in together:
            assert (answer["code"], plain(answer["text"])) == (alone["code"], plain(alone["text"]))
        assert together[0]["told"] == alone["told"]
        assert_alike(one, three)
        if alone["code"] == 0:
            assert_as_planned(model, one, alone["seen"].get("step", 0))
            if again:
                assert_same(one / END, one / "again.sav", "a checkpoint restored and saved again")
            if model.cut is not None:
                self._compare_halves(model, folder, one, seconds)
        return outcome | {"refused": False}

    def _compare_halves(self, model: Model, folder: Path, whole: Path, seconds: float) -> None:
        """Cut in two by SAV and RES, each half on another number of ranks, the run leaves the same files."""
        place = folder / "halves"
        model.write(place)
        (whole / "again.sav").unlink(missing_ok=True)
        for worker, half, name in zip((self.three, self.one), model.halves(), ("model1.py", "model2.py")):
            half.write(place, name)
            worker.ask(task="script", folder=str(place), script=name)
            for answer in worker.answers(seconds):
                if name == "model1.py" and "ranks are too many for this model" in answer["text"]:
                    return
                assert answer["code"] == 0, f"{name}: {answer['text']}"
        for name in ("model1.py", "model2.py", "middle.sav"):
            (place / name).unlink()
        assert_alike(whole, place, "in two halves: ")


def assert_as_planned(model: Model, place: Path, step: int) -> None:
    """A run has done the steps and left the files that were foretold from the script, where they can be."""
    script = parse_text(model.text)
    runs, steps = plan.follow(script.statements), plan.expected_steps(script.statements)
    assert steps in (None, step), f"{steps} steps foretold, {step} done"
    frames = frame_names(runs)
    if frames is not None:
        assert {path.name for path in place.rglob("all_*.dat")} == set(frames), "not the frames that were foretold"
    for kind, pattern in (("vtk", "all_*.vtk"), ("ps", "all_*.ps"), ("save", "[0-9]*.sav")):
        numbers = [run.files(kind) for run in runs]
        if None not in numbers:
            written = len({path.name for path in place.rglob(pattern)})
            few, more = sum(n for n in numbers if n), sum(run.rough(kind) for run in runs)
            assert few <= written <= few + more, (
                f"{numbers} files of {kind} foretold, {more} more at most, {written} there"
            )


def plain(text: str) -> str:
    """A message without the ranks that it names."""
    return re.sub(r", rank \d+", "", text)


def assert_alike(one: Path, other: Path, what: str = "") -> None:
    """The same files with the same content, and nothing half written."""
    names = files(one)
    assert names == files(other), f"{what}only one has {sorted(set(names) ^ set(files(other)))}"
    left = [name for name in names if ".tmp" in name or name.endswith(LOCK)]
    assert not left, f"{what}left behind: {left}"
    for name in names:
        assert_same(one / name, other / name, f"{what}{name}")


def assert_same(one: Path, other: Path, what: str) -> None:
    """Two files say the same; checkpoints may come from different scripts, and run.json from any number of ranks."""
    if one.read_bytes() == other.read_bytes():
        return
    if one.name == RECORD:
        ends = [json.loads(path.read_text()) for path in (one, other)]
        mine, yours = ([end[name] for name in ("language", "version", "state", "step")] for end in ends)
        assert mine == yours, f"{what}: {mine} and {yours}"
        return
    assert one.suffix in HDF5, f"{what}: {first_difference(one, other)}"
    mine, yours = said(one), said(other)
    assert mine.keys() == yours.keys(), f"{what}: only one has {sorted(mine.keys() ^ yours.keys())}"
    different = [name for name in mine if mine[name] != yours[name]]
    assert not different, f"{what}: {different[:5]} differ: {shown(mine, different)} and {shown(yours, different)}"


def said(path: Path) -> dict[str, Any]:
    """All of an HDF5 file as bytes by name, less what tells only where in which script it was written."""
    found: dict[str, Any] = {}
    for name, values in contents(path).items():
        if name == "@state":
            state = json.loads(str(values))
            for word in ("script", "position", "makers"):
                state.pop(word)
            (state["progress"] or {}).pop("position", None)
            found |= {f"@state {word}": json.dumps(value) for word, value in state.items()}
        elif name != "@crc":
            found[name] = (values.dtype.str, values.shape, values.tobytes())
    return found


def shown(values: dict[str, Any], names: list[str]) -> str:
    return str([values[name] for name in names[:2]])[:300]


def first_difference(one: Path, other: Path) -> str:
    """The first lines of two text files that are not the same."""
    mine, yours = (path.read_text(errors="replace").splitlines() for path in (one, other))
    for k, (a, b) in enumerate(zip(mine, yours), 1):
        if a != b:
            return f"line {k}: {a!r} and {b!r}"
    return f"{len(mine)} and {len(yours)} lines"
