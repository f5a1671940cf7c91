"""What is written as text reads back as the same number, or as near as the digits that are promised."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.commands.dem import cycles, output, particles, walls
from hpcdem.core.comm import SerialComm
from hpcdem.io.dat import read_dat, write_dat
from hpcdem.io.textnum import format_floats
from tests.support import model
from tests.unit.io_synthetic import make_frame

ALWAYS_THE_SAME = settings(max_examples=60, deadline=None, derandomize=True)
numbers = st.floats(width=64, allow_nan=False, allow_infinity=False, allow_subnormal=True)
moderate = st.floats(-1e6, 1e6)


def near(read: np.ndarray, written: np.ndarray, digits: int) -> np.ndarray:
    """Equal to half a unit of the last of so many digits, plus what reading rounds."""
    with np.errstate(over="ignore"):
        return np.abs(read - written) <= 0.5 * 10.0 ** (1 - digits) * np.abs(written) * (1 + 1e-9) + 5e-324


@settings(ALWAYS_THE_SAME, max_examples=300)
@given(st.lists(numbers.filter(lambda x: abs(x) < 1e307), min_size=1, max_size=40), st.integers(1, 15))
def test_floats_of_tables(values: list[float], digits: int) -> None:
    array = np.array(values)
    assert near(np.array([float(word) for word in format_floats(array, digits)]), array, digits).all()


@ALWAYS_THE_SAME
@given(st.integers(1, 60), st.integers(0, 2**32 - 1), st.integers(-12, 12))
def test_a_frame_as_text(n: int, number: int, size: int) -> None:
    """Positions to 13 digits, everything else to 9, whatever the units; and what was read writes the same words."""
    frame = make_frame(n, SerialComm())
    rng = np.random.default_rng(number)
    columns = frame.tables["particles"].columns
    for name in ("x", "y", "vx", "vy", "spin", "fx", "fy", "torque", "mass"):
        columns[name] = rng.normal(size=len(columns[name])) * 10.0 ** (size + rng.integers(-5, 6, len(columns[name])))
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "all_1.dat"
        write_dat(path, frame, SerialComm())
        found = read_dat(path)
        read = found.tables["particles"].columns
        for word, values in columns.items():
            if values.dtype.kind != "f":
                continue
            digits = 13 if word in ("x", "y") else 9
            if word in read:
                assert near(read[word], values, digits).all(), word
        again = Path(name) / "all_2.dat"
        write_dat(again, found, SerialComm())
        # Words, not bytes: groups without a particle are not in the file, and the longest name makes the column wide.
        one, other = (file.read_bytes().splitlines() for file in (path, again))
        assert (one.pop(1).split()[-1], other.pop(1).split()[-1]) == (b"all_1.dat", b"all_2.dat")
        assert [line.split() for line in one] == [line.split() for line in other]


@ALWAYS_THE_SAME
@given(x=moderate, y=moderate, xv=st.floats(-10, 10), dt=st.floats(1e-6, 0.1))
def test_walls_csv_and_histories_hold_doubles(x: float, y: float, xv: float, dt: float) -> None:
    with tempfile.TemporaryDirectory() as name:
        sim = model(Path(name), dt=dt)
        walls.wall(sim, 3, ((x, y), (x + 1.5, y - 0.7)), xv=xv)
        particles.ball(sim, 0, x, y + 5.0, 1e-3 + 1e-6 * abs(x) + 1e-6 * abs(y))
        sim.particles["fix"][:] = 7
        sim.history_requests[1] = (1, "time")
        cycles.cycle(sim, 2)
        head, *rows = (Path(name) / "walls.csv").read_text().splitlines()
        assert head == output.WALL_COLUMNS
        step, time, wall, *ends = rows[-1].split(",")
        assert (int(step), float(time), int(wall)) == (2, sim.clock.time, 3)
        assert [float(word) for word in ends[:4]] == [*sim.walls.p1[0], *sim.walls.p2[0]]
        step, time, value = (Path(name) / "hist_1.csv").read_text().splitlines()[-1].split(",")
        assert int(step) == 2 and float(time) == float(value) == sim.clock.time


@ALWAYS_THE_SAME
@given(
    st.lists(
        st.tuples(moderate, moderate, st.floats(1e-3, 1e3), st.sampled_from(["***", "sand", "沉积"])), min_size=1,
        max_size=20,
    )
)  # fmt: skip
def test_exported_particles_come_back(rows: list[tuple[float, float, float, str]]) -> None:
    """EXP and LOAD: thirteen digits; and exporting what was loaded writes the same file."""
    with tempfile.TemporaryDirectory() as name:
        one, other = Path(name) / "one.dat", Path(name) / "other.dat"
        sim = model(Path(name))
        for x, y, r, group in rows:
            particles.ball(sim, None, x, y, r, group=group)
        particles.export(sim, one, group=True)
        again = model(Path(name))
        assert particles.load(again, one) == len(rows)
        for column, word in enumerate(("x", "y", "radius")):
            assert near(again.particles[word], np.array([row[column] for row in rows]), 13).all()
        assert [again.groups[k] for k in again.particles["group"]] == [row[3] for row in rows]
        particles.export(again, other, group=True)
        assert one.read_bytes() == other.read_bytes()
