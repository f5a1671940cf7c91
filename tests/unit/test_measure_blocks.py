"""`hpcdem measure` of blocks: cracks, fragments and emission of frames and tables whose measures are known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.frame import Table
from hpcdem.io.vtkhdf_mesh import MeshFrame, read_mesh_frame, write_mesh_frame
from hpcdem.post.measure import blocks, emission
from hpcdem.post.measure.scene import Request
from tests.unit.measured import frame as bed
from tests.unit.measured import lattice, write
from tests.unit.test_measure_folder import column, run, table

FREE, INTACT, YIELDED, BROKEN = 0, 1, 2, 3
HEAD = "step,time [s],joint,x [m],y [m],mode,length [m],kinetic_energy [J/m],peak_step,peak_kinetic_energy [J/m]"


def strip(step: int, joints: dict[int, tuple[int, float]], gone: tuple[int, ...] = (), apart: float = 0.0) -> MeshFrame:
    """Ten squares of 2 m in a row, the last halved into two triangles that hang together; between square i and i + 1 a
    joint of this state and mode, or none: they hang together. Broken ones have broken at step 10 i with an energy of
    i + 1. gone: elements that were taken out; apart: how far each joint has opened."""
    corners: list[tuple] = []
    elements: list[tuple] = []
    for i in range(11):
        if i in gone:
            continue
        x, shift = 2.0 * min(i, 9), apart * min(i, 9)
        nodes = [2 * min(i, 9), 2 * min(i, 9) + 2, 2 * min(i, 9) + 3, 2 * min(i, 9) + 1]
        places = [(x, 0.0), (x + 2.0, 0.0), (x + 2.0, 2.0), (x, 2.0)]
        chosen = (0, 1, 2, 3) if i < 9 else (0, 2, 3) if i == 9 else (0, 1, 2)
        corners += [(4 * i + k, *places[c], shift, nodes[c]) for k, c in enumerate(chosen)]
        elements.append((i, len(chosen), 4.0 if i < 9 else 2.0, int(i >= 5)))
    number, x, y, moved, node = (np.array(c) for c in zip(*corners))
    rows = [(i, *of) for i, of in joints.items() if i not in gone]
    i, state, mode = (np.array(c) for c in zip(*rows)) if rows else (np.zeros(0, int), np.zeros(0), np.zeros(0))
    broken = state == BROKEN
    columns = {
        "number": 4 * i + 1, "first": 4 * i + 1, "last": 4 * i + 2, "state": state.astype(float),
        "mode": np.where(broken, mode, 0.0).astype(float), "length": np.full(len(i), 2.0),
        "damage": np.where(broken, 1.0, np.where(state == YIELDED, 0.25, 0.0)),
        "break_time": np.where(broken, 1e-3 * i, np.nan), "break_energy": np.where(broken, i + 1.0, np.nan),
    }  # fmt: skip
    e, count, area, group = (np.array(c) for c in zip(*elements))
    of_corners = {"number": number, "x": x + moved, "y": y, "displacement_x": moved, "displacement_y": 0.0 * moved,
                  "node": node}  # fmt: skip
    of_elements = {"number": e, "corners": count, "area": area, "group_body": group.astype(np.int32)}
    tables = (Table(c, 0, len(c["number"])) for c in (of_corners, of_elements, columns))
    return MeshFrame(step, 1e-4 * step, 1e-4, *tables, {"group_body": ["left", "right"]})


def save(folder: Path, frame: MeshFrame) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"strip_{frame.step:010d}.vtkhdf"
    write_mesh_frame(path, frame, SerialComm())
    return path


# Between 1 and 2 a crack that was there from the beginning, between 8 and 9 nothing.
BEFORE = {0: (INTACT, 0.0), 1: (FREE, 0.0), 2: (INTACT, 0.0), 3: (INTACT, 0.0), 4: (INTACT, 0.0), 5: (YIELDED, 0.0),
          6: (INTACT, 0.0), 7: (INTACT, 0.0)}  # fmt: skip
AFTER = {**BEFORE, 2: (BROKEN, 1.0), 4: (BROKEN, 1.5), 6: (BROKEN, 2.0)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("strip") / "data"
    save(folder, strip(0, BEFORE))
    save(folder, strip(100, AFTER, apart=0.1))
    save(folder, strip(200, AFTER, gone=(7,), apart=0.1))
    run(folder, figures=True)
    return folder


def test_cracks_by_mode_and_damage(folder):
    rows = table(folder / "measure", "cracks_joints")
    assert [row["step"] for row in rows] == ["0", "100", "200"]
    assert column(rows, "joints").tolist() == [7, 7, 6]  # the crack from the beginning is no joint
    assert column(rows, "yielded").tolist() == [1, 1, 1]
    for name in ("tension", "mixed", "shear"):
        assert column(rows, name).tolist() == [0, 1, 1]
        assert column(rows, f"{name}_length[m]").tolist() == [0.0, 2.0, 2.0]
    assert column(rows, "damage") == pytest.approx([0.25 / 7, 3.25 / 7, 3.25 / 6])
    assert column(rows, "p21[1/m]") == pytest.approx([0.0, 6.0 / 40.0, 6.0 / 36.0])
    assert column(rows, "kinetic_energy[J/m]").tolist() == [0.0, 15.0, 15.0]  # 3 + 5 + 7
    assert (folder / "measure" / "cracks_joints.png").stat().st_size > 10000


def test_fragments_are_what_hangs_together(folder):
    """0 1 | 2 | 3 4 | 5 6 | 7 8 9; without element 7: 0 1 | 2 | 3 4 | 5 6 | 8 9."""
    rows = table(folder / "measure", "fragments")
    assert column(rows, "fragments").tolist() == [2, 5, 5]
    assert column(rows, "single_elements").tolist() == [0, 1, 1]
    assert column(rows, "area[m2]").tolist() == [40.0, 40.0, 36.0]
    assert column(rows, "largest_share") == pytest.approx([32.0 / 40.0, 12.0 / 40.0, 8.0 / 36.0])
    last = table(folder / "measure", "fragments_last")
    assert column(last, "area[m2]").tolist() == [8.0, 8.0, 8.0, 8.0, 4.0]
    assert column(last, "elements").tolist() == [2, 2, 2, 3, 1]  # by their lowest element
    assert column(last, "size[m]") == pytest.approx([math.sqrt(4.0 * a / math.pi) for a in (8, 8, 8, 8, 4)])
    assert column(last, "passing") == pytest.approx([1.0, 28 / 36, 20 / 36, 12 / 36, 4 / 36])
    assert column(last, "x[m]")[:3] == pytest.approx([2.0 + 0.05, 8.0 + 0.35, 12.0 + 0.55])
    assert column(rows, "size_50[m]")[2] == pytest.approx(math.sqrt(32.0 / math.pi))
    assert (folder / "measure" / "fragments.png").stat().st_size > 10000


def test_groups_restrict_all_three(folder, tmp_path):
    """right: elements 5 to 10; the joint between 4 and 5 belongs to neither."""
    run(folder, "--groups", "right", "--to", 100, "--xmove", 100, "-o", tmp_path)
    joints, pieces = table(tmp_path, "cracks_joints"), table(tmp_path, "fragments")
    assert column(joints, "joints").tolist() == [3, 3] and column(joints, "broken").tolist() == [0, 1]
    assert column(pieces, "fragments").tolist() == [1, 2] and column(pieces, "area[m2]").tolist() == [20.0, 20.0]
    assert column(table(tmp_path, "fragments_last"), "x[m]").min() > 105.0
    events = table(tmp_path, "emission_events")
    assert column(events, "joint").tolist() == [25] and column(events, "x[m]") == pytest.approx([114.0])
    with pytest.raises(UsageError, match="no element of group top; known: left, right"):
        run(folder, "cracks", "--groups", "top", "-o", tmp_path)


def test_old_frames_do_not_record_neighbours(tmp_path):
    frame = strip(0, BEFORE)
    del frame.corners.columns["node"]
    save(tmp_path, frame)
    with pytest.raises(HpcdemError, match=r"earlier version.*neighbouring"):
        run(tmp_path, "fragments")
    run(tmp_path, "cracks")


def test_a_mesh_of_triangles_and_quads_around_a_point(tmp_path):
    """Two elements that share a point alone do not hang together."""
    state = read_mesh_frame(save(tmp_path, strip(0, {i: (BROKEN, 1.0) for i in range(9)})))
    pieces = blocks.fragments(state, np.ones(11, bool))
    assert pieces.elements.tolist() == [1] * 9 + [2]
    lower, upper = blocks.sides(state)
    assert lower.tolist() == list(range(9)) and upper[:8].tolist() == list(range(1, 9))


# --- emission --------------------------------------------------------------------------------------------------------


def events(folder: Path, magnitude: np.ndarray, **columns: np.ndarray) -> None:
    """A table of joints whose kinetic energies have these magnitudes."""
    n = len(magnitude)
    energy = 10.0 ** (1.5 * magnitude + 4.8)
    made = {
        "step": np.arange(n), "time": 1e-5 * np.arange(n), "joint": 4 * np.arange(n), "x": np.linspace(0, 1, n),
        "y": np.zeros(n), "mode": np.linspace(1.0, 2.0, n), "length": np.ones(n), "kinetic": energy,
        "peak_step": np.arange(n), "peak": 0.1 * energy, **columns,
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    lines = [HEAD, *(",".join(map(repr, row)) for row in zip(*(c.tolist() for c in made.values())))]
    (folder / "cracks.csv").write_text("\n".join(lines) + "\n")


def test_magnitude_is_that_of_its_energy():
    """M = 2/3 (log10 E - 4.8): 63.1 kJ is M 0, a thousand times less M -2."""
    assert emission.magnitudes(np.array([10**4.8, 10**1.8])) == pytest.approx([0.0, -2.0])
    assert np.isnan(emission.magnitudes(np.array([0.0, -1.0, np.nan]))).all()


def test_b_value_by_hand():
    """mean(M) - Mc = 0.5 for ten events: b = 0.4342945 / 0.5, error b / sqrt(10); two below Mc do not count."""
    m = np.array([-3.0, -2.5, *np.linspace(0.0, 1.0, 10)]) - 4.0
    found = emission.fit(m, -4.0)
    assert (found.number, found.completeness) == (10, -4.0)
    assert found.b == pytest.approx(0.868589, rel=1e-6) and found.error == pytest.approx(0.868589 / math.sqrt(10))
    assert 10.0 ** (found.a - found.b * -4.0) == pytest.approx(10.0)  # the line begins at the number of events
    assert np.isnan(emission.fit(m, -3.9).b)  # nine are too few
    assert np.isnan(emission.fit(np.full(30, -4.0), -4.0).b)


@pytest.mark.parametrize("b", [0.8, 1.4])
def test_b_value_of_a_catalogue(b, tmp_path):
    """Magnitudes of Gutenberg and Richter above -5.05, and a gap of small ones: the bin of most events is found, and b
    within three standard errors."""
    rng = np.random.default_rng(11)
    m = -5.0 + rng.exponential(1.0 / (b * math.log(10.0)), 4000)
    events(tmp_path, np.concatenate([m, rng.uniform(-5.6, -5.0, 200)]))
    run(tmp_path, "emission", "--history", "none")
    (row,) = table(tmp_path / "measure", "emission_b")
    assert float(row["completeness"]) == pytest.approx(-5.0)
    assert float(row["b"]) == pytest.approx(b, abs=3.0 * float(row["standard_error"]))
    assert float(row["standard_error"]) == pytest.approx(b / math.sqrt(4000), rel=0.1)
    counts = table(tmp_path / "measure", "emission_magnitudes")
    assert column(counts, "events").sum() == 4200 and column(counts, "events_from")[0] == 4200


def test_rates_and_energies(tmp_path):
    """Options one by one: --bins, --completeness, --joule, --energy, --history, --from."""
    events(tmp_path, np.linspace(-6.0, -4.0, 101))
    (tmp_path / "history_load.csv").write_text(
        "step,time [s],reaction_y [N/m]\n" + "".join(f"{k},{1e-5 * k!r},{-1e6 * k!r}\n" for k in range(0, 201, 10))
    )
    run(tmp_path, "--bins", 4, figures=True)
    rows = table(tmp_path / "measure", "emission")
    assert column(rows, "from[s]") == pytest.approx([0.0, 5e-4, 1e-3, 1.5e-3])  # up to the end of the history
    assert column(rows, "events").tolist() == [50, 50, 1, 0]
    assert column(rows, "cumulative").tolist() == [50, 100, 101, 101]
    assert [column(rows, name).sum() for name in ("tension", "mixed", "shear")] == [34, 33, 34]
    total = (10.0 ** (1.5 * np.linspace(-6.0, -4.0, 101) + 4.8)).sum()
    assert column(rows, "cumulative_energy[J]")[-1] == pytest.approx(total)
    assert (tmp_path / "measure" / "emission.png").stat().st_size > 10000

    def alone(*words: object) -> tuple[list[dict[str, str]], ...]:
        run(tmp_path, "emission", *words, "-o", tmp_path / "o")
        return tuple(table(tmp_path / "o", name) for name in ("emission", "emission_events", "emission_b"))

    assert len(alone()[0]) == 100
    assert column(alone("--history", "none", "--bins", 4)[0], "to[s]")[-1] == pytest.approx(1e-3)
    assert column(alone("--completeness", -5.0)[2], "events").tolist() == [51]
    shift = column(alone("--joule", 1e-3)[1], "magnitude") - np.linspace(-6.0, -4.0, 101)
    assert shift == pytest.approx(np.full(101, -2.0))
    released = column(alone("--energy", "released")[1], "energy[J]")
    assert released.sum() == pytest.approx(0.9 * total)
    assert len(alone("--from", 90)[1]) == 11 and len(alone("--to", 89)[1]) == 90
    with pytest.raises(UsageError, match="no frames of blocks, which record the groups"):
        alone("--groups", "rock")
    with pytest.raises(HpcdemError, match=r"history_other.csv not found; histories in .*: load"):
        alone("--history", "other")


def test_a_table_that_is_damaged_is_named_with_its_line(tmp_path):
    events(tmp_path, np.linspace(-6.0, -4.0, 5))
    text = (tmp_path / "cracks.csv").read_text().splitlines()
    (tmp_path / "cracks.csv").write_text("\n".join([*text[:3], text[3][:20]]) + "\n")
    with pytest.raises(HpcdemError, match=r"cracks.csv:4: expected 10 numbers"):
        run(tmp_path, "emission")
    (tmp_path / "cracks.csv").write_text("step,time\n")
    with pytest.raises(HpcdemError, match=r"not a table of broken joints: column 'time .s.' is missing"):
        run(tmp_path, "emission")


def test_particles_blocks_and_both(folder, tmp_path):
    """Each word does what the folder allows; one that cannot act is refused by name."""
    lines = run(folder, "-o", tmp_path / "blocks")
    assert lines[0] == "3 frames of blocks, strip_0000000000 to strip_0000000200"
    assert [line.split(":")[0] for line in lines[1:-1]] == ["cracks", "fragments", "emission"]
    with pytest.raises(HpcdemError, match=r"no frames .all_"):
        run(folder, "surface")
    with pytest.raises(UsageError, match="blocks have groups, no colours"):
        run(folder, "--colors", "red")
    x, y = lattice(4000.0, 1000.0)
    both = tmp_path / "both"
    write(both, bed(0, x, y, 0.0))
    with pytest.raises(HpcdemError, match=r"fragments: .* no frames of blocks"):
        run(both, "fragments")
    for step, joints in ((0, BEFORE), (100, AFTER)):
        save(both, strip(step, joints))
    lines = run(both)
    assert {"surface", "layers", "cracks", "fragments", "emission"} <= {line.split(":")[0] for line in lines}
    assert (both / "measure" / "cracks_joints.csv").exists() and (both / "measure" / "surface.csv").exists()


def test_nothing_has_broken(tmp_path):
    save(tmp_path, strip(0, BEFORE))
    assert any("skipped: emission: no joint broke" in line for line in run(tmp_path))
    with pytest.raises(HpcdemError, match="emission: no joint broke"):
        run(tmp_path, "emission")
    save(tmp_path / "one", strip(0, {}))
    assert any("skipped: cracks: the blocks in" in line for line in run(tmp_path / "one"))


@pytest.mark.slow
@pytest.mark.mpi
def test_on_any_number_of_ranks(folder, launch, tmp_path):
    done = launch(2, "measure", str(folder), "-o", str(tmp_path / "two"), "--format", "none")
    assert done.returncode == 0, done.stderr
    for path in sorted((folder / "measure").glob("*.csv")):
        assert (tmp_path / "two" / path.name).read_bytes() == path.read_bytes(), path.name


def test_request_defaults_are_those_of_the_command():
    made = Request(Path("x"))
    assert (made.bins, made.joule, made.released, made.history, made.completeness) == (100, 1.0, False, None, None)
