"""Blocks that break, slide, fly about and are excavated, with bolts, liners, fluid, laws of the user, and in a bed of
discs: the same bits on any number of ranks and threads, and across a restart on other ones.

All models of one way of running are run one after the other by one start of the ranks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.conftest import Launcher
from tests.parallel.kinds import KINDS

pytestmark = pytest.mark.ranks
WORKER = Path(__file__).with_name("model_worker.py")
THREADS = {"NUMBA_NUM_THREADS": "3", "OMP_WAIT_POLICY": "PASSIVE"}
"""More threads than cores must not wait actively for each other."""


class Way(NamedTuple):
    """A way to run a model. source: the way whose checkpoint it goes on from."""

    ranks: int = 1
    threads: int = 1
    source: str = ""
    saves: bool = False
    slow: bool = False


# The quick ones have ranks, threads and a restart on others in three runs; the slow ones add what these leave out: one
# rank more, threads alone, and restarts that gather what several ranks wrote and scatter what one wrote.
WAYS = {
    "alone": Way(saves=True),
    "3 ranks": Way(3, saves=True),
    "from 3 ranks to 2 with 2 threads": Way(2, 2, source="3 ranks"),
    "4 ranks": Way(4, saves=True, slow=True),
    "from 4 ranks to 2 threads": Way(threads=2, source="4 ranks", slow=True),
    "3 threads": Way(threads=3, slow=True),
    "from one to 3 ranks": Way(3, source="alone", slow=True),
}


@dataclass
class Runs:
    """What became of models; those that are wanted of a way are run when the first of them is asked for."""

    folder: Path
    wanted: set[str]
    said: dict[tuple[str, str], str] = field(default_factory=dict)
    """Of runs that were started: why there is no file, if there is none."""

    def __call__(self, way: str, kind: str) -> Path:
        """The file of a run."""
        if (way, kind) not in self.said:
            self._start(way, [one for one in KINDS if one in self.wanted and KINDS[one].slow == KINDS[kind].slow])
        found = self.folder / kind / f"{way}.npz"
        assert found.exists(), self.said[way, kind]
        return found

    def _start(self, way: str, kinds: list[str]) -> None:
        ranks, threads, source, saves, _ = WAYS[way]
        said = f"not at its end, or no checkpoint of {source!r} to go on from"
        self.said.update({(way, kind): said for kind in kinds})  # also if it hangs: it is not started again
        if source:
            if (source, kinds[0]) not in self.said:
                self._start(source, kinds)
            kinds = [kind for kind in kinds if (self.folder / kind / f"{source}.sav").exists()]
        for kind in kinds:
            (self.folder / kind).mkdir(exist_ok=True)
        done = Launcher().python(
            ranks, WORKER, threads, way, source or "begin", "saves" if saves else "-", *kinds, cwd=self.folder,
            env=THREADS if way != "alone" else None, timeout=600.0,
        )  # fmt: skip
        self.said.update({(way, kind): done.stderr[-2000:] for kind in kinds})


@pytest.fixture(scope="module")
def runs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Runs]:
    """Of the models that this run of pytest asks for."""
    items = [item for item in request.session.items if getattr(item, "module", None) is request.module]
    wanted = {item.callspec.params["kind"] for item in items if hasattr(item, "callspec")}
    return Runs(tmp_path_factory.mktemp("runs"), wanted)


def kinds() -> list:
    return [pytest.param(k, marks=[pytest.mark.slow] if m.slow else []) for k, m in KINDS.items()]


@pytest.mark.parametrize("kind", kinds())
def test_much_happens(runs: Runs, kind: str) -> None:
    with np.load(runs("alone", kind)) as found:
        KINDS[kind].much(dict(found))


@pytest.mark.mpi
@pytest.mark.parametrize("kind", kinds())
@pytest.mark.parametrize(
    "way", [pytest.param(w, marks=[pytest.mark.slow] if v.slow else []) for w, v in WAYS.items() if w != "alone"]
)
def test_it_comes_to_the_same_bits(runs: Runs, way: str, kind: str) -> None:
    with np.load(runs("alone", kind)) as one, np.load(runs(way, kind)) as other:
        assert set(one.files) == set(other.files)
        for name in one.files:
            if name != "about":
                assert np.array_equal(one[name], other[name], equal_nan=True), name
        if WAYS[way].ranks > 1 and not WAYS[way].source and KINDS[kind].come:
            assert other["about"][3] > KINDS[kind].come  # elements that came from another rank, with their states
