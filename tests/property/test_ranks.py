"""Any small model ends alike on one rank and on three, as a whole and cut in two by a checkpoint: the same files to the
last bit, or the same message and exit code; soon, and with nothing half written.

A model that does not is made as small as it gets and stored in `regressions`, where it is run ever after.
"""

from __future__ import annotations

import hashlib
import os
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, note, seed, settings

from tests.property.grammar import END, Model, models
from tests.property.workers import Lost, Pair

pytestmark = pytest.mark.mpi

REGRESSIONS = Path(__file__).with_name("regressions")
QUICK = 20
SLOW = int(os.environ.get("HPCDEM_PROPERTY_EXAMPLES", "100"))

SETTLING = Model(
    (
        "START", "SET gravity 0 -9.8 dt 1e-3", "BOX left 0 right 30 bottom 0 height 20 kn 1e7 ks 1e7 fric 0.1",
        "GEN grid rad discrete 0.8 1.0 x (0 30) y (0 6)", "PROP density 2500 kn 1e7 ks 1e7 fric 0.2 damp 0.2",
        "SET print 10", "CYC 20", f"SAV {END}",
    ),
)  # fmt: skip


@pytest.fixture(scope="module")
def pair() -> Iterator[Pair]:
    """Workers, started when first needed."""
    workers = Pair()
    yield workers
    workers.stop()


def explore(pair: Pair, examples: int, number: int | None = None) -> list[dict[str, Any]]:
    """Compare so many random models; what was seen of each. number: of the random sequence, None: always the same."""
    seen: list[dict[str, Any]] = []
    failing: list[Model] = []
    ways = (Phase.generate, Phase.target, Phase.shrink)

    @settings(
        max_examples=examples, deadline=None, derandomize=number is None, database=None, print_blob=False, phases=ways,
        report_multiple_bugs=False, suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(models())
    def ends_alike(model: Model) -> None:
        note(model.text)
        try:
            seen.append(pair.compare(model))
        except BaseException:
            failing[:] = [model]
            raise

    try:
        (ends_alike if number is None else seed(number)(ends_alike))()
    except BaseException:
        for model in failing:  # hypothesis comes back to the smallest one before it gives up
            name = hashlib.sha256(model.text.encode()).hexdigest()[:8]
            REGRESSIONS.mkdir(exist_ok=True)
            (REGRESSIONS / f"script_{name}.py").write_text(model.text)
        raise
    return seen


def assert_rich(seen: list[dict[str, Any]]) -> None:
    """The models were worth comparing."""
    done = [found for found in seen if found["code"] == 0 and not found["refused"]]
    shared = [found for found in done if sum(n > 0 for n in found["share"]) > 1]
    counts = {
        "to the end": len(done),
        "stopped by a mistake": sum(found["code"] != 0 for found in seen),
        "on several ranks": len(shared),
        "twenty particles": sum(found["made"] >= 20 for found in done),
        "lists rebuilt in mid-run": sum(found["rebuilds"] > 3 for found in done),
        "bonds": sum(found["bonds"] > 0 for found in done),
        "bonds that broke": sum(sum(found["breaks"]) > 0 for found in done),
        "walls that move": sum(found["travel"] > 0 for found in done),
    }
    print("of", len(seen), "models:", counts)
    assert counts["to the end"] > len(seen) / 2 and counts["on several ranks"] > len(seen) / 4, counts
    assert counts["twenty particles"] > len(seen) / 4, counts
    assert all(n > 0 for n in counts.values()), counts


def test_twenty_models(pair: Pair) -> None:
    """Always the same sequence, in which enough happens."""
    assert_rich(explore(pair, QUICK, 2))


@pytest.mark.slow
def test_many_models(pair: Pair) -> None:
    """Others every time; the number printed brings them back (HPCDEM_PROPERTY_SEED)."""
    number = int(os.environ.get("HPCDEM_PROPERTY_SEED") or random.SystemRandom().randrange(2**32))
    print("HPCDEM_PROPERTY_SEED", number)
    try:
        assert_rich(explore(pair, SLOW, number))
    except BaseException as error:
        error.add_note(f"HPCDEM_PROPERTY_SEED={number}")
        raise


@pytest.mark.parametrize("name", sorted(path.name for path in REGRESSIONS.glob("script*.py")))
def test_models_that_once_failed(pair: Pair, name: str) -> None:
    pair.compare(Model.read((REGRESSIONS / name).read_text()))


# ---- and a failure would be noticed ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("accident", "kind", "message"),
    [
        ("a bit", AssertionError, "differ"),
        pytest.param("leaves a file", AssertionError, "all_7.dat.tmp", marks=pytest.mark.slow),
        pytest.param("is ours", AssertionError, "Traceback", marks=pytest.mark.slow),
        pytest.param("dies", Lost, "died", marks=pytest.mark.slow),
        pytest.param("hangs", Lost, "hangs: no answer within 3 s", marks=pytest.mark.slow),
        pytest.param("alone", Lost, "failed alone: hpcdem: .*something against it", marks=pytest.mark.slow),
    ],
)
def test_what_goes_wrong_on_one_rank_is_noticed(pair: Pair, accident: str, kind: type, message: str) -> None:
    seen = pair.compare(SETTLING)
    assert seen["code"] == 0 and seen["step"] == 20 and min(seen["share"]) > 5
    with pytest.raises(kind, match=message):
        pair.compare(SETTLING, accident, seconds=3.0)
    assert pair.compare(SETTLING)["code"] == 0  # workers are there again
