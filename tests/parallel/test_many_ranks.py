"""64 pretended ranks: the same bits as one, and what a rank does does not grow with their number."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties, settings, walls
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.core.fields import FX
from hpcdem.core.selection import Interval
from hpcdem.halo.migrate import Migration, Trail
from hpcdem.io import checkpoint, parts
from hpcdem.io.dat import write_dat
from hpcdem.physics.coupling import saved_state as of_both
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem import diagnostics, saved_state
from hpcdem.physics.dem.particles import Particles
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import rectangle
from tests.clumped import write_lattice
from tests.pretended import Pretended, Ranks

PER_RANK, ROWS, STEPS = 8, 6, 120
"""Discs of one rank along x and y, steps."""


def flow(comm: Any, size: int) -> Simulation:
    """Discs on a lattice, as many for each of `size` ranks, that touch and drift to the right, ready to step."""
    sim = Simulation(comm, outdir=".", balance_on=False)
    settings.set_option(sim, "dt", 1e-3)
    settings.set_option(sim, "disk", "on")
    particles.gen_grid(sim, [0.5], (0.0, float(PER_RANK * size)), (0.0, float(ROWS)))
    properties.prop(sim, density=1000.0, kn=1e6, ks=1e6, fric=0.3)
    properties.prop(sim, xv=10.0)
    p = sim.particles
    p["vy"][:] = 0.5 * np.sin(p["x"])
    cycles.prepare(sim)
    return sim


def state(sim: Simulation) -> dict[int, tuple[float, ...]]:
    p = sim.particles
    columns = (p[name].tolist() for name in ("gid", "x", "y", "vx", "vy", "spin"))
    return {gid: tuple(row) for gid, *row in zip(*columns)}


def steps(comm: Any, size: int) -> tuple[dict, Any, int]:
    """State at the end, what was counted, rebuilds."""
    sim = flow(comm, size)
    sim.step()
    before = sim.rebuilds
    if isinstance(comm, Pretended):
        comm.watch()
    for _ in range(STEPS):
        sim.step()
    counts = dict(comm.counts) if isinstance(comm, Pretended) else {}
    return state(sim), counts, sim.rebuilds - before


@pytest.fixture(scope="module")
def on_64() -> list[tuple[dict, dict, int]]:
    return Ranks(64).run(lambda comm: steps(comm, 64))


def test_64_ranks_come_to_the_same_bits(on_64: list[tuple[dict, dict, int]]) -> None:
    alone, _, rebuilds = steps(SerialComm(), 64)
    together = {gid: row for part, *_ in on_64 for gid, row in part.items()}
    assert together == alone and len(alone) == sum(len(part) for part, *_ in on_64) == 64 * PER_RANK * ROWS
    assert rebuilds == on_64[0][2] > 3
    assert {gid // ROWS // PER_RANK for gid in on_64[30][0]} != {30}, "nobody went over to another rank"


def test_what_a_rank_does_does_not_grow_with_their_number(on_64: list[tuple[dict, dict, int]]) -> None:
    """Calls of functions, messages, reductions of the steps and rebuilds of a rank in the middle, where all have the
    same neighbourhood (but for where cells begin); and nothing is made that has a place for every rank."""
    on_8 = Ranks(8).run(lambda comm: steps(comm, 8))
    few, many = on_8[4][1], on_64[36][1]
    assert many["messages"] > STEPS and many["calls"] > STEPS
    assert many.keys() == few.keys() == {"messages", "calls", "reductions"}
    assert many["reductions"] == few["reductions"]
    assert many["messages"] <= few["messages"] + 2 and many["calls"] <= 1.01 * few["calls"]


@pytest.mark.parametrize("size", [8, 64])
def test_a_border_that_jumps_sends_far_and_costs_its_messages_only(size: int) -> None:
    """Everybody's first particle goes to the rank three further, the second to the neighbour, the third stays."""

    def move(comm: Pretended) -> tuple[list[float], dict]:
        rows = np.array([[10.0 * comm.rank + k] for k in range(3)])
        leave = np.array([0, 1])
        comm.watch()
        migration = Migration(comm, 3, leave, np.array([(comm.rank + 3) % size, (comm.rank + 1) % size]))
        arrived, counts, entries = migration.exchange(rows[migration.leave], np.array([1, 1]), rows[migration.leave])
        assert counts.tolist() == [1, 1] and (entries == arrived).all()
        return [*rows[migration.stay(), 0], *arrived[:, 0]], dict(comm.counts)

    for rank, (mine, counts) in enumerate(Ranks(size).run(move)):
        sources = sorted([(rank - 3) % size, (rank - 1) % size])
        expected = [10.0 * s + (0.0 if (s + 3) % size == rank else 1.0) for s in sources]
        assert mine == [10.0 * rank + 2.0, *expected]
        assert counts["messages"] == 2 and "lists" not in counts


# ---- what comes from files ------------------------------------------------------------------------------------------

AHEAD = 40
"""Steps after a restore."""


@pytest.fixture
def rows_held(monkeypatch: pytest.MonkeyPatch) -> dict[int, int]:
    """Most particles that any of so many pretended ranks ever held."""
    most: dict[int, int] = {}
    place = Particles.place

    def noted(self: Particles, hot: np.ndarray, cold: np.ndarray, *more: Any) -> None:
        ranks = threading.current_thread().name.rpartition(" of ")[2]
        if ranks.isdigit():
            most[int(ranks)] = max(most.get(int(ranks), 0), len(cold))
        place(self, hot, cold, *more)

    monkeypatch.setattr(Particles, "place", noted)
    return most


def bonded_flow(folder: Path, size: int) -> Path:
    """A checkpoint of `flow`, a third of it bonded, with a wall below and a few clumps; 40 steps old."""
    sim = flow(SerialComm(), size)
    write_lattice(folder / "bodies", 0.3, 2 * size, 1)
    clumps.clump(sim, folder / "bodies", 0.0, ROWS + 4.0)
    properties.prop(sim, density=1000.0, kn=1e6, ks=1e6, fric=0.3)
    walls.wall(sim, 1, ((-10.0, 0.0), (PER_RANK * size + 50.0, 0.0)), kn=1e6, ks=1e6)
    bonds.bond(sim, n_bond=1e9, s_bond=1e9, tolerate=0.1)
    cycles.prepare(sim)
    for _ in range(40):
        sim.step()
    path = folder / f"{size}.sav"
    saved_state.save(sim, path)
    return path


def restored(comm: Any, path: Path) -> tuple[dict, Any, int, Simulation]:
    sim = Simulation(comm, outdir=".", balance_on=False)
    if isinstance(comm, Pretended):
        comm.watch()
    saved_state.restore(sim, path)
    cycles.prepare(sim, dt_known=True)
    counts, most = (dict(comm.counts), comm.most) if isinstance(comm, Pretended) else ({}, 0)
    return state(sim), counts, most, sim


def test_a_checkpoint_comes_back_on_64_ranks_with_the_same_bits(tmp_path: Path) -> None:
    path = bonded_flow(tmp_path, 64)

    def go_on(comm: Any) -> tuple[dict, dict, int]:
        before, *_, sim = restored(comm, path)
        for _ in range(AHEAD):
            sim.step()
        return before, state(sim), sim.bonds_left()

    alone = go_on(SerialComm())
    parts = Ranks(64).run(go_on)
    for when in (0, 1):
        assert {gid: row for part in parts for gid, row in part[when].items()} == alone[when]
    assert {part[2] for part in parts} == {alone[2]} and alone[2] > 64 * PER_RANK


def test_no_rank_holds_a_checkpoint(tmp_path: Path, rows_held: dict[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes read, particles held and bytes of the largest message of a rank are those of its share, and it has as many
    messages among 64 ranks as among 16."""
    read: dict[int, list[int]] = {16: [], 64: []}
    counted = parts.read_parts

    def noted(comm: Any, path: Any, wanted: Any) -> Any:
        if comm.size > 1:
            read[comm.size].append(sum(end - first for first, end in wanted))
        return counted(comm, path, wanted)

    monkeypatch.setattr(checkpoint, "read_parts", noted)
    found = {}
    for size in (16, 64):
        path = bonded_flow(tmp_path, size)
        found[size] = Ranks(size).run(lambda comm, path=path: restored(comm, path)[:3])
        held = sum(len(part[0]) for part in found[size])
        assert len(read[size]) == size and sum(read[size]) < path.stat().st_size
        assert max(read[size]) < 1.1 * path.stat().st_size / size
        assert rows_held[size] < 2 * held / size
    few, many = found[16], found[64]
    largest = {size: max(most for *_, most in part) for size, part in found.items()}
    assert largest[64] < 1.2 * largest[16] and largest[64] < (tmp_path / "64.sav").stat().st_size / 20
    for kind in ("messages", "reductions", "lists"):
        of_16, of_64 = (max(counts.get(kind, 0) for _, counts, _ in part) for part in (few, many))
        assert of_64 <= 1.1 * of_16


def test_damage_is_found_by_all_ranks_in_the_same_words(tmp_path: Path) -> None:
    """In the rows of any of 16 ranks, of any column; in the state; and of what is no checkpoint at all."""
    path = bonded_flow(tmp_path, 16)
    whole, (_, columns, _) = path.read_bytes(), checkpoint._contents(path)
    rng = np.random.default_rng(3)
    texts = {whole[:-3], whole.replace(b'"script"', b'"skript"'), b"nonsense"}
    for full, column in columns.items():
        if column.shape[0]:
            at = column.first + int(rng.integers(column.shape[0] * column.row))
            spoilt = whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
            path.write_bytes(spoilt)
            assert refusals(path, 1) == {f"{path} is damaged: checksum of {full} is wrong"}
            texts |= {spoilt} if column.shape[0] > 30 and len(texts) < 6 else set()
    for text in texts:
        path.write_bytes(text)
        assert refusals(path, 16) == refusals(path, 1) and len(refusals(path, 16)) == 1
    path.unlink()
    assert refusals(path, 16) == refusals(path, 1) == {f"cannot read {path}: there is no such file"}


def refusals(path: Path, size: int) -> set[str]:
    """What the ranks say of a file that they cannot restore; the model stays as it was."""

    def refused(comm: Any) -> str:
        sim = Simulation(comm, outdir=".", balance_on=False)
        particles.gen_grid(sim, [0.5], (0.0, 20.0), (0.0, 2.0))
        with pytest.raises(HpcdemError) as error:
            saved_state.restore(sim, path)
        assert sim.count(len(sim.particles)) == 40
        return str(error.value)

    return set(Ranks(size).run(refused) if size > 1 else [refused(SerialComm())])


def test_rank_0_reads_for_those_that_do_not_see_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on hosts with file systems of their own: every rank but 0 and 2 is blind, or sees half of the file."""
    path = bonded_flow(tmp_path, 8)
    half = tmp_path / "half.sav"
    half.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    seen: dict[int, Any] = {}
    counted, read = parts.read_parts, parts._read

    def noted(comm: Any, *args: Any) -> Any:
        seen[threading.get_ident()] = comm.rank
        return counted(comm, *args)

    def blind(path: Any, wanted: Any) -> Any:
        rank = seen[threading.get_ident()]
        return read({0: path, 2: path, 5: half}.get(rank, tmp_path / "nowhere"), wanted)

    monkeypatch.setattr(checkpoint, "read_parts", noted)
    monkeypatch.setattr(parts, "_read", blind)
    together = Ranks(8).run(lambda comm: restored(comm, path)[0])
    monkeypatch.undo()
    assert {gid: row for part in together for gid, row in part.items()} == restored(SerialComm(), path)[0]


def text_of(size: int) -> str:
    """Rows of LOAD, with comments, empty lines, other ends of lines, umlauts, and groups of which some come late."""
    rng = np.random.default_rng(7)
    lines = ["# x y r"]
    for k in range(20 * size):
        name = ("", "  böden", f"  late{k // (5 * size)}")[k % 3]
        lines.append(f"{rng.uniform(0, 8 * size)!r} {rng.uniform(0, 6)!r} {rng.uniform(0.1, 0.5)!r}{name}")
        lines += ["", "   # nothing"][: int(rng.integers(3))]
    return "\n".join(lines[: 9 * size]) + "\r\n" + "\r".join(lines[9 * size : 9 * size + 5]) + "\n" + "\n".join(lines)


def loaded(comm: Any, path: Path, **options: Any) -> tuple[dict, list[str], int]:
    sim = Simulation(comm, outdir=".", balance_on=False)
    n = particles.load(sim, path, **options)
    p = sim.particles
    rows = zip(*(p[name].tolist() for name in ("gid", "x", "y", "radius", "group")))
    return {gid: row for gid, *row in rows}, sim.groups, n


@pytest.mark.parametrize("options", [{}, {"x": (40.0, 90.0), "scale": 3.0}])
def test_each_rank_loads_its_lines(tmp_path: Path, rows_held: dict[int, int], options: dict[str, Any]) -> None:
    path = tmp_path / "rows.dat"
    path.write_bytes(text_of(16).encode())
    rows, groups, n = loaded(SerialComm(), path, **options)
    assert len(rows) == n > 60 and list(rows) == list(range(n)) and "böden" in groups and len(groups) > 3
    together = Ranks(16).run(lambda comm: loaded(comm, path, **options))
    assert {gid: row for part, *_ in together for gid, row in part.items()} == rows
    assert all((names, number) == (groups, n) for _, names, number in together)
    assert rows_held[16] < 0.15 * len(loaded(SerialComm(), path)[0])


def test_lines_longer_than_shares(tmp_path: Path) -> None:
    path = tmp_path / "rows.dat"
    path.write_text("# " + 9000 * "x" + "\n1 2 0.5\n\n3 4 0.25" + 5000 * " " + "# y")
    alone = loaded(SerialComm(), path)[0]
    assert alone == {0: [1.0, 2.0, 0.5, 0], 1: [3.0, 4.0, 0.25, 0]}
    for size in (2, 7, 32):
        together = Ranks(size).run(lambda comm: loaded(comm, path)[0])
        assert {gid: row for part in together for gid, row in part.items()} == alone


@pytest.mark.parametrize("wrong", [30, 333, None])
def test_a_wrong_line_is_named_on_all_ranks(tmp_path: Path, wrong: int | None) -> None:
    path = tmp_path / "rows.dat"
    lines = text_of(16).splitlines()
    for k in (wrong, 400) if wrong is not None else ():
        lines[k - 1] = "1.0 2.0 -3.0 bed"
    path.write_text("\n".join(lines) if wrong is not None else "# nothing\n")

    def refused(comm: Any) -> str:
        with pytest.raises(HpcdemError) as error:
            loaded(comm, path)
        return str(error.value)

    expected = f":{wrong}: read '1.0 2.0 -3.0 bed', expected" if wrong is not None else ": contains no particles"
    assert {refused(SerialComm())} == set(Ranks(16).run(refused)) and expected in refused(SerialComm())


def of_frame(comm: Any, path: Path, **options: Any) -> tuple[dict, Any, dict]:
    """What every particle has and remembers after LOAD of a frame; what all ranks know; where it comes to."""
    sim = Simulation(comm, outdir=".", balance_on=False)
    n = particles.load(sim, path, **options)
    p, ends = sim.particles, sim.hist.ptr.tolist()
    names = ("gid", "x", "y", "vx", "spin", "radius", "group", "material", "color", "fix")
    rows = zip(*(p[name].tolist() for name in names), p.cold[:, FX].tolist())
    kept = {row[0]: (*row, sim.hist.rows[a:b].tobytes()) for row, a, b in zip(rows, ends, ends[1:])}
    known = (n, sim.groups, sim.bonds, sim._longest2, sim.next_gid, sim.materials.as_floats().tolist(),
             sim.bond_types.as_floats().tolist(), sim.walls.table().tolist())  # fmt: skip
    cycles.prepare(sim)
    for _ in range(AHEAD):
        sim.step()
    return kept, known, state(sim)


@pytest.mark.parametrize("options", [{}, {"x": (20.0, 100.0)}])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_each_rank_loads_its_part_of_a_frame(
    tmp_path: Path, rows_held: dict[int, int], options: dict[str, Any], end: bytes
) -> None:
    sim = flow(SerialComm(), 16)
    walls.wall(sim, 1, ((-10.0, 0.02), (300.0, 0.02)), kn=1e6, ks=1e6, fric=0.3)
    for k, name in enumerate(("left", "böden")):
        where = Interval("x", 60.0 * k, 60.0 * k + 50.0)
        properties.prop(sim, where, density=900.0 + k, group=name)
    bonds.bond(sim, n_bond=1e3, s_bond=1e9, tolerate=0.1)
    cycles.prepare(sim)
    for _ in range(40):
        sim.step()
    path = tmp_path / "all_0000000040.dat"
    write_dat(path, diagnostics.frame(sim), SerialComm())
    path.write_bytes(path.read_bytes().replace(b"\n", end))
    kept, known, moved = of_frame(SerialComm(), path, **options)
    assert known[2] > 200 and len(known[1]) > 2 and any(len(row[-1]) > 32 for row in kept.values())
    together = Ranks(16).run(lambda comm: of_frame(comm, path, **options))
    assert {gid: row for part, *_ in together for gid, row in part.items()} == kept
    assert all(part[1] == known for part in together)
    assert {gid: row for *_, part in together for gid, row in part.items()} == moved
    assert rows_held[16] < 0.15 * 16 * PER_RANK * ROWS


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [(lambda text: text.replace("ball num : 768", "ball num : 9"), "9 balls announced, 768 found"),
     (lambda text: text.replace(" 5.00000000e-01", "            nan", 700), "has no position or size"),
     (lambda text: text.replace("current_step", "step"), "no line current_step"),
     (lambda text: text[: len(text) // 2], "cannot read")],
)  # fmt: skip
def test_a_frame_that_is_damaged_is_refused_by_all_ranks(
    tmp_path: Path, spoilt: Callable[[str], str], message: str
) -> None:
    path = tmp_path / "all_1.dat"
    write_dat(path, diagnostics.frame(flow(SerialComm(), 16)), SerialComm())
    text = path.read_text()
    assert spoilt(text) != text
    path.write_text(spoilt(text))

    def refused(comm: Any) -> str:
        with pytest.raises(HpcdemError) as error:
            of_frame(comm, path)
        return str(error.value)

    assert set(Ranks(16).run(refused)) == {refused(SerialComm())} and message in refused(SerialComm())


def test_gen_keeps_its_share(rows_held: dict[int, int]) -> None:
    def made(comm: Any) -> dict:
        sim = Simulation(comm, outdir=".", balance_on=False)
        particles.gen_grid(sim, [0.4, 0.5], (0.0, 100.0), (0.0, 10.0))
        particles.gen(sim, 400, [0.3, 0.4], (0.0, 100.0), (9.0, 20.0))
        return state(sim)

    alone = made(SerialComm())
    together = Ranks(16).run(made)
    assert {gid: row for part in together for gid, row in part.items()} == alone and len(alone) == 1400
    assert rows_held[16] < 100


def test_what_is_known_of_a_particle_follows_it() -> None:
    """Over two borders, back home, and into nothing."""

    def follow(comm: Pretended) -> list[tuple[int, float]]:
        trail, n = Trail(), comm.size
        known = np.array([4 * comm.rank + k for k in range(4)])
        value = known + 0.5
        # Of each rank the first disc stays, the second goes on by two ranks, the third comes back, the fourth dies.
        mine = known[:1].tolist()
        if not trail.follow(comm, known, known, value)[0].size == 0:
            raise AssertionError("nobody is followed before the beginning")
        trail.begin()
        trail.note(known[1:3], np.full(2, (comm.rank + 1) % n))
        came = 4 * ((comm.rank - 1) % n) + np.array([1, 2])
        trail.note(came, np.array([(comm.rank + 1) % n, (comm.rank - 1) % n]))
        mine += [4 * ((comm.rank - 2) % n) + 1, int(known[2])]
        gid, values = trail.follow(comm, np.array(mine), known, value)
        return sorted(zip(gid.tolist(), values.tolist()))

    for rank, found in enumerate(Ranks(5).run(follow)):
        gids = sorted([4 * rank, 4 * ((rank - 2) % 5) + 1, 4 * rank + 2])
        assert found == [(gid, gid + 0.5) for gid in gids]


# ---- particles and blocks -------------------------------------------------------------------------------------------


def raft(comm: Any, size: int, save: Path | None = None, restore: Path | None = None) -> tuple[Any, dict, int]:
    """Discs that slide along a bar of elements, as many of both for each of `size` ranks: forces of the faces and
    discs at the end, what was counted, searches."""
    sim = Simulation(comm, outdir=".", balance_on=False)
    blocks = Blocks(comm, balance_on=False)
    if restore is None:
        for name, value in (("disk", "on"), ("gravity", (0.0, -10.0)), ("dt", 2e-4)):
            settings.set_option(sim, name, value)
        particles.gen_grid(sim, [0.5], (0.5, 8.0 * size - 0.5), (0.999, 2.0))
        properties.prop(sim, density=1000.0, kn=1e6, ks=1e6, fric=0.5, xv=30.0)
        cycles.prepare(sim)
        blocks.take_mesh(rectangle(8 * size, 1, 8.0 * size + 20.0, 1.0))
        changes.element_model(
            blocks, None, "mech_iso_elastic", {"density": 2500.0, "young": 1e8, "poisson_ratio": 0.25}
        )
        blocks.velocity_condition(None, vx=0.0, vy=0.0)
    both = Coupled(sim, blocks)
    if restore is None:
        both.settle_time_step()
        both.advance(20)
    else:
        of_both.restore(both, restore)
        both.prepare()
    if save is not None:
        of_both.save(both, save, {})
    if isinstance(comm, Pretended):
        comm.watch()
    searches = []
    for _ in range(150):
        link = both.link
        both.advance(1)
        searches.append(both.link is not link)
    counts = dict(comm.counts) if isinstance(comm, Pretended) else {}
    known = both.known()
    rows = sorted(zip(known.gid.tolist(), known.face.tolist(), known.friction.tolist()))
    return (rows, state(sim)), counts, sum(searches)


@pytest.mark.slow  # a minute; coupled runs on several ranks are in test_coupled.py
def test_contacts_of_discs_and_faces_on_64_ranks(tmp_path: Path) -> None:
    """The same bits as on one rank, also after a restart; messages of a rank do not grow with their number."""
    path = tmp_path / "both.sav"
    (touching, moved), _, searches = raft(SerialComm(), 64, save=path)
    assert searches > 2 and len(touching) > 64 and any(friction for *_, friction in touching)
    few = Ranks(16).run(lambda comm: raft(comm, 16))
    many = Ranks(64).run(lambda comm: raft(comm, 64))
    again = Ranks(64).run(lambda comm: raft(comm, 64, restore=path))
    for found in (many, again):
        assert sorted(row for (rows, _), *_ in found for row in rows) == touching
        assert {gid: row for (_, part), *_ in found for gid, row in part.items()} == moved
    assert {n for *_, n in many} == {searches}
    for kind in ("messages", "reductions", "lists"):
        assert many[34][1].get(kind, 0) <= few[9][1].get(kind, 0) + 2
    assert many[34][1]["calls"] <= 1.02 * few[9][1]["calls"]
