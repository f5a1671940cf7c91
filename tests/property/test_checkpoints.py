"""Checkpoints: whatever is put in comes out, and what was damaged is refused or says the same, never anything else."""

from __future__ import annotations

import random
import string
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from hpcdem.commands.dem import bonds, cycles, particles, properties, walls
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.physics.dem import saved_state
from hpcdem.physics.dem.simulation import Simulation
from tests.property.workers import Worker
from tests.short_push import contents
from tests.support import model

ALWAYS_THE_SAME = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
names = st.text(string.ascii_lowercase + "_0123456789", min_size=1, max_size=8)
texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)
values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats(allow_nan=False) | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4), max_leaves=12,
)  # fmt: skip
kinds = st.sampled_from([np.dtype("f8"), np.dtype("i8")])
columns = st.integers(0, 30).flatmap(
    lambda n: st.dictionaries(names, kinds.flatmap(lambda kind: arrays.arrays(kind, n)), min_size=1, max_size=4)
)


@ALWAYS_THE_SAME
@given(st.dictionaries(texts, values, max_size=5), st.dictionaries(names, columns, max_size=3))
def test_what_is_put_in_comes_out(state: dict[str, Any], tables: dict[str, dict[str, np.ndarray]]) -> None:
    """Every bit, not-a-number and minus nothing too; and written once more it is the same file."""
    with tempfile.TemporaryDirectory() as folder:
        one, other = Path(folder) / "1.sav", Path(folder) / "2.sav"
        put(one, state, tables)
        found, read = checkpoint.read(one)
        assert found == state
        assert {(t, c) for t in read for c in read[t]} == {(t, c) for t in tables for c in tables[t]}
        for table, of_table in tables.items():
            for name, array in of_table.items():
                assert read[table][name].dtype == array.dtype and read[table][name].tobytes() == array.tobytes()
        put(other, found, read)
        assert one.read_bytes() == other.read_bytes()


def put(path: Path, state: dict[str, Any], tables: dict[str, dict[str, np.ndarray]]) -> None:
    whole = {name: Table(of_table, 0, len(next(iter(of_table.values())))) for name, of_table in tables.items()}
    checkpoint.write(path, state, whole, SerialComm())


def busy(folder: Path, number: int, steps: int) -> Simulation:
    """Forty particles at random, some bonded, some deleted, between walls of which one moves."""
    rng = random.Random(number)
    sim = model(folder, dt=1e-3, gravity=(rng.uniform(-3, 3), -9.8), disk=rng.choice(["on", "off", "hex"]))
    walls.box(sim, 0.0, 30.0, 0.0, 20.0, kn=1e7, ks=1e7, fric=0.2)
    walls.wall(sim, 1, ((3.0, 20.0), (3.0, 0.0)), kn=1e7, ks=1e7, xv=rng.uniform(0.1, 3.0))
    particles.gen(sim, 40, [0.7, 1.0], (1.0, 29.0), (0.0, 12.0), group="bed")
    properties.prop(sim, density=2500.0, kn=1e7, ks=1e7, fric=0.3, damp=rng.choice([0.0, 0.3]))
    bonds.bond(sim, n_bond=rng.choice([1e3, 1e9]), s_bond=1e9, tolerate=0.3)
    cycles.cycle(sim, steps)
    if rng.random() < 0.5:  # an open model
        sim.open_model()
    return sim


@settings(ALWAYS_THE_SAME, max_examples=15)
@given(st.integers(0, 10**6), st.integers(0, 120))
def test_a_model_saved_restored_and_saved_again(number: int, steps: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        one, other = Path(folder) / "1.sav", Path(folder) / "2.sav"
        saved_state.save(busy(Path(folder), number, steps), one)
        again = Simulation(outdir=folder)
        found = saved_state.restore(again, one)
        again.script, again.position, again.progress = found["script"], found["position"], found["progress"]
        saved_state.save(again, other)
        a, b = contents(one), contents(other)
        assert a.keys() == b.keys()
        assert not [name for name in a if a[name].tobytes() != b[name].tobytes()]


# ---- damage ----------------------------------------------------------------------------------------------------------
# A worker reads what was spoilt: a library that crashes takes the worker with it, not the tests.


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """`reader(damages)`: how a checkpoint of a busy model was found after each of them; `reader.size` [B]."""
    folder = tmp_path_factory.mktemp("damaged")
    sim = busy(folder, 1, 150)
    file = folder / "busy.sav"
    saved_state.save(sim, file)
    worker = Worker(1)

    def read(damages: list[Any], seconds: float = 60.0) -> list[str]:
        worker.ask(task="damaged", file=str(file), damages=damages)
        return worker.answers(seconds)[0]["outcomes"]

    read.size = file.stat().st_size  # type: ignore[attr-defined]
    read.bytes = file.read_bytes()  # type: ignore[attr-defined]
    yield read
    worker.stop()


def assert_noticed(damages: list[Any], outcomes: list[str]) -> None:
    """Refused, or the same state."""
    wrong = [(damage, what) for damage, what in zip(damages, outcomes) if what not in ("refused", "same")]
    assert not wrong, f"{len(wrong)} of {len(damages)}, the first ones: {wrong[:5]}"


def flips(whole: bytes, number: int, how_many: int) -> list[list[tuple[int, int]]]:
    """One to three bytes changed, one bit or all: (place, new byte)."""
    rng = random.Random(number)

    def flip() -> tuple[int, int]:
        place = rng.randrange(len(whole))
        return place, whole[place] ^ (1 << rng.randrange(8) if rng.random() < 0.7 else rng.randrange(1, 256))

    return [[flip() for _ in range(rng.choice([1, 1, 1, 2, 3]))] for _ in range(how_many)]


def test_changed_bytes_are_noticed(reader: Any) -> None:
    damages = flips(reader.bytes, 5, 250)
    outcomes = reader(damages)
    assert_noticed(damages, outcomes)
    assert outcomes.count("refused") > 150


def test_a_shorter_file_is_noticed(reader: Any) -> None:
    rng = random.Random(6)
    lengths = [0, 1, 7, 8, 100, reader.size - 1, *(rng.randrange(reader.size) for _ in range(60))]
    assert set(reader(lengths)) == {"refused"}


@pytest.mark.slow
def test_every_byte_changed_is_noticed(reader: Any) -> None:
    """Each bit of what describes the file, which no checksum of the rows covers, and each byte of the rest once."""
    rng = random.Random(7)
    whole: bytes = reader.bytes
    damages = [[(place, whole[place] ^ rng.randrange(1, 256))] for place in range(len(whole))]
    damages += [[(place, whole[place] ^ (1 << bit))] for place in described(whole) for bit in range(8)]
    for k in range(0, len(damages), 500):
        assert_noticed(damages[k : k + 500], reader(damages[k : k + 500], 300.0))


def described(whole: bytes) -> list[int]:
    """Places outside the rows of datasets: signatures, headers, names, types and sizes."""
    import h5py

    mask = np.ones(len(whole), bool)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.sav"
        path.write_bytes(whole)
        with h5py.File(path) as file:

            def visit(_: str, item: Any) -> None:
                if isinstance(item, h5py.Dataset) and item.id.get_offset() is not None:
                    begin = item.id.get_offset()
                    mask[begin : begin + item.id.get_storage_size()] = False

            file.visititems(visit)
    return np.flatnonzero(mask).tolist()


def test_a_damaged_checkpoint_leaves_the_model_as_it_was(tmp_path: Path) -> None:
    sim = busy(tmp_path, 2, 50)
    file, before, after = (tmp_path / name for name in ("x.sav", "before.sav", "after.sav"))
    saved_state.save(sim, file)
    saved_state.save(sim, before)
    whole = file.read_bytes()
    for number in range(20):
        data = bytearray(whole)
        for place, value in flips(whole, number, 1)[0]:
            data[place] = value
        file.write_bytes(data)
        try:
            checkpoint.read(file)
        except HpcdemError:
            with pytest.raises(HpcdemError):
                saved_state.restore(sim, file)
            saved_state.save(sim, after)
            assert after.read_bytes() == before.read_bytes()
