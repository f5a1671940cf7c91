"""`hpcdem measure` in three dimensions: volumes, means of stress and strain, displacement of surfaces, fragments."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.measure import measure, work
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.post.measure import block_figures, blocks, bodies
from tests.conftest import Launcher
from tests.view import frames

GROWN = 0.1


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A box before and after it has become 10 % higher and 10 % narrower, and its roof has come off."""
    (tmp_path / "data").mkdir()
    frames.write_body(tmp_path / "data", 0, grown=0.0)
    frames.write_body(tmp_path / "data", 10, grown=GROWN, broken=True)
    return tmp_path / "data"


class Silent:
    def info(self, text: str) -> None: ...

    warn = info


@pytest.fixture
def wet(folder: Path) -> Path:
    """The same with fluid in the crack."""
    frames.write_body(folder, 10, grown=GROWN, broken=True, wet=True)
    return folder


def run(folder: Path, *words: str) -> None:
    work(SerialComm(), Silent(), read_command_line(measure, "hpcdem measure", [str(folder), *words]))  # type: ignore[arg-type]


def table(folder: Path, name: str) -> list[dict[str, str]]:
    with open(folder / "measure" / f"{name}.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_volume_extent_stress_and_strain(folder: Path):
    """u = a (0, -y, z) with a = 0.1: E = (0, -a + a2/2, a + a2/2), volume (1 - a) (1 + a). The stress of element k of
    144 is -1 MPa (k + 1) along z."""
    run(folder, "regions", "--format=none", "--box", "0,0,0,2,3,1")
    rows = [row for row in table(folder, "regions") if row["step"] == "10"]
    assert [(row["set"], row["group"]) for row in rows] == [
        ("", "all"),
        ("rock", "base"),
        ("rock", "roof"),
        ("", "box"),
    ]
    whole, base, roof, box = rows
    for row, volume, elements in ((whole, 24.0, 144), (base, 12.0, 72), (roof, 12.0, 72), (box, 6.0, 36)):
        assert float(row["volume[m3]"]) == pytest.approx(volume) and int(row["elements"]) == elements
        assert float(row["volume_change"]) == pytest.approx(-(GROWN**2), rel=1e-9)
        found = [float(row[f"strain_{c}"]) for c in bodies.COMPONENTS]
        half = 0.5 * GROWN**2
        np.testing.assert_allclose(found, [0.0, half - GROWN, half + GROWN, 0.0, 0.0, 0.0], atol=1e-12)
    state = read_mesh_frame(folder / "body_0000000010.vtkhdf", solid=True)
    middle = (state.points - state.of_points["displacement"])[state.cells].mean(axis=1)
    for row, some in (
        (whole, middle[:, 2] > 0.0), (base, middle[:, 2] < 1.0), (roof, middle[:, 2] > 1.0),
        (box, (middle[:, 0] < 2.0) & (middle[:, 2] < 1.0)),
    ):  # fmt: skip
        stress = -1e6 * (np.flatnonzero(some) + 1.0).mean()
        assert float(row["stress_zz[Pa]"]) == pytest.approx(stress) == 3.0 * float(row["mean_stress[Pa]"])
    assert [float(whole[f"{c}max[m]"]) for c in "xyz"] == pytest.approx([4.0, 2.7, 2.2])
    assert [float(roof[f"{c}min[m]"]) for c in "xyz"] == pytest.approx([0.0, 0.0, 1.1])


def test_a_turned_body_is_not_strained(folder: Path):
    """Turned by 40 degrees about z after it has become higher: the same strain along z."""
    state = read_mesh_frame(folder / "body_0000000010.vtkhdf", solid=True)
    c, s = np.cos(0.7), np.sin(0.7)
    home = bodies.homes(state)
    state.points = (home + GROWN * home * (0.0, 0.0, 1.0)) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    state.of_points = {**state.of_points, "displacement": state.points - home}
    found = bodies.strains(state)
    np.testing.assert_allclose(
        found, np.array([0.0, 0.0, GROWN + 0.5 * GROWN**2, 0.0, 0.0, 0.0]) + 0.0 * found, atol=1e-12
    )


def test_how_far_the_surface_has_moved(folder: Path):
    run(folder, "displacement", "--format=none")
    before, after = table(folder, "displacement")
    assert float(before["largest[m]"]) == 0.0
    assert float(after["largest[m]"]) == pytest.approx(GROWN * np.hypot(3.0, 2.0))
    assert (float(after["y[m]"]), float(after["z[m]"])) == pytest.approx((3.0, 2.0))
    assert float(after["uz_most[m]"]) == pytest.approx(0.2) and float(after["uy_least[m]"]) == pytest.approx(-0.3)
    last = table(folder, "displacement_last")
    assert len(last) == 60  # all nodes of 4 x 3 x 2 bricks: those inside are on the crack
    assert int(before["points"]) == 60 - 6
    for row in last:
        assert float(row["uz[m]"]) == pytest.approx(GROWN * float(row["z[m]"]), abs=1e-12)


def test_fragments_are_bodies_that_hang_together(folder: Path):
    run(folder, "fragments")
    before, after = table(folder, "fragments")
    assert (before["fragments"], after["fragments"]) == ("1", "2")
    assert float(after["largest_share"]) == pytest.approx(0.5) and float(after["volume[m3]"]) == pytest.approx(24.0)
    each = table(folder, "fragments_last")
    assert [row["elements"] for row in each] == ["72", "72"]
    assert float(each[0]["size[m]"]) == pytest.approx((6.0 * 12.0 / np.pi) ** (1.0 / 3.0))
    assert sorted(float(row["z[m]"]) for row in each) == pytest.approx([0.55, 1.65])
    assert (folder / "measure" / "fragments.png").stat().st_size > 10_000


def test_groups_places_and_steps(folder: Path):
    run(folder, "--format=none", "--groups=roof", "--from=10", "--xmove=5")
    names = {path.name for path in (folder / "measure").iterdir()}
    assert names == {f"{name}.csv" for name in ("regions", "displacement", "displacement_last", "cracks_joints",
                                                "cracks_last", "fragments", "fragments_last")}  # fmt: skip
    assert table(folder, "cracks_last") == []  # those that broke have one side in the base
    rows = table(folder, "regions")
    assert [row["group"] for row in rows] == ["all", "roof"] and {row["step"] for row in rows} == {"10"}
    assert float(rows[0]["xmin[m]"]) == pytest.approx(5.0) and rows[0]["elements"] == "72"
    assert table(folder, "fragments")[0]["fragments"] == "1"
    assert min(float(row["z[m]"]) for row in table(folder, "displacement_last")) == pytest.approx(1.0)
    run(folder)
    for name in ("regions", "displacement", "fragments"):
        assert (folder / "measure" / f"{name}.png").stat().st_size > 10_000, name


def test_fluid_between_tetrahedra(wet: Path):
    """The crack is 4 x 2.7 m, half of it full of a millimetre of fluid, the other half to a quarter."""
    run(wet, "fluid")
    row = table(wet, "fluid")[-1]
    numbers = {name: float(value) for name, value in row.items()}
    assert (numbers["channels"], numbers["wet"]) == (24.0, 12.0)
    assert numbers["wet_area[m2]"] == numbers["open_wet_area[m2]"] == pytest.approx(5.4)
    assert numbers["volume[m3]"] == pytest.approx(5.4e-3 * 1.25)
    assert [numbers[f"{name}"] for name in ("pressure[Pa]", "aperture[m]", "velocity[m/s]")] == [2e6, 1e-3, 0.2]
    last = table(wet, "fluid_last")
    assert len(last) == 24 and sum(float(one["area[m2]"]) for one in last) == pytest.approx(10.8)
    assert {round(float(one["z[m]"]), 9) for one in last} == {1.1} and {one["state"] for one in last} == {"3"}
    assert (wet / "measure" / "fluid.png").stat().st_size > 10_000
    run(wet, "fluid", "--format=none", "--groups=roof,base")
    assert table(wet, "fluid")[-1]["channels"] == "24"
    with pytest.raises(HpcdemError, match="have no channels"):  # the crack lies between both
        run(wet, "fluid", "--groups=roof")


def test_the_plane_of_a_fracture():
    """A square that dips by 30 degrees to the east strikes north; a network in space has no plane."""
    c, s = np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    points = np.stack([c * square[:, 0], square[:, 1], -s * square[:, 0]], axis=1)
    flat, names = block_figures._in_its_plane(points[[[0, 1, 2], [0, 2, 3]]])
    assert flat is not None and names == ("along strike", "up dip")
    assert np.ptp(flat.reshape(-1, 2), axis=0) == pytest.approx([1.0, 1.0])
    flat, names = block_figures._in_its_plane(points[[[0, 1, 2], [0, 2, 3]]] * (0.0, 1.0, 1.0))
    assert flat is not None and names == ("y", "z")
    assert block_figures._in_its_plane(np.random.default_rng(1).uniform(size=(9, 3, 3)))[0] is None


def test_joints_that_broke(folder: Path):
    """The crack is 4 x 3 m in the mesh, of all joints; it lies level, and the roof sits on it as it did."""
    run(folder, "cracks", "emission")
    row = {name: float(value) for name, value in table(folder, "cracks_joints")[-1].items() if value}
    assert (row["tension"], row["mixed"], row["shear"], row["broken"]) == (0.0, 0.0, 24.0, 24.0)
    assert row["broken_area[m2]"] == row["shear_area[m2]"] == pytest.approx(12.0)
    assert row["damage"] == pytest.approx(12.0 / row["area[m2]"]) and row["kinetic_energy[J]"] == pytest.approx(24.0)
    assert row["p32[1/m]"] == pytest.approx(12.0 / 24.0)
    last = table(folder, "cracks_last")
    assert len(last) == 24 and {float(one["dip[deg]"]) for one in last} == {0.0}
    for one in last:
        assert float(one["z[m]"]) == pytest.approx(1.0 + GROWN) and float(one["mode"]) == 2.0
        assert max(abs(float(one["opening[m]"])), float(one["slip[m]"])) < 1e-12
    events = table(folder, "emission_events")
    assert len(events) == 24 and {round(float(one["z[m]"]), 9) for one in events} == {1.0}  # in the mesh
    assert float(events[0]["magnitude"]) == pytest.approx(2.0 / 3.0 * -4.8)
    for name in ("cracks_joints", "emission"):
        assert (folder / "measure" / f"{name}.png").stat().st_size > 10_000, name


def test_dip_and_dip_direction():
    """A plane that falls 30 degrees to the east-north-east, whichever way its corners run."""
    dip, direction = np.radians(30.0), np.radians(67.5)
    down = np.array([np.cos(dip) * np.sin(direction), np.cos(dip) * np.cos(direction), -np.sin(dip)])
    strike = np.array([np.cos(direction), -np.sin(direction), 0.0])
    for order in ([0, 1, 2], [0, 2, 1]):
        corners = np.array([np.zeros(3), down, strike])[None, order]
        assert [float(one[0]) for one in blocks.orientation(corners)] == pytest.approx([30.0, 67.5])
    level = np.array([[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]])
    assert [float(one[0]) for one in blocks.orientation(level)] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["fluid"], "have no channels"),
        (["wedge"], "contains no frames"), (["--groups=floor"], "no element of group floor; known: base, roof"),
        (["regions", "--box=9,9,9,10,10,10"], "--box: no measured element"),
        (["--box=1,0,0,0,1,1"], "--box: give the minimum x"),
        (["fragments", "--box=0,0,0,1,1,1"], "--box requires regions"),
        (["--colors=red"], "--colors: blocks have groups, no colours"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(folder: Path, words: list[str], message: str):
    with pytest.raises(HpcdemError, match=message):
        run(folder, *words)


@pytest.mark.parametrize("words", [["regions"], ["displacement"], ["--box=0,0,0,1,1,1"]])
def test_words_of_space_are_refused_in_the_plane(tmp_path: Path, words: list[str]):
    frames.write_blocks(tmp_path)
    with pytest.raises(HpcdemError, match="three dimensions"):
        run(tmp_path, *words)


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_files_on_three_ranks(launch: Launcher, wet: Path):
    folder = wet
    run(folder, "--format=none")
    done = launch(3, "measure", folder, "--format=none", "-o", folder / "other", cwd=folder)
    assert done.returncode == 0, done.stderr
    for path in (folder / "measure").iterdir():
        assert path.read_bytes() == (folder / "other" / path.name).read_bytes(), path.name
