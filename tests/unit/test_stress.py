"""Stress from forces: of pairs known in closed form, of a settled bed against its weight and its walls' forces."""

from __future__ import annotations

import copy
import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.frame import Frame, Table
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.post import strain, strain_stress, stress
from hpcdem.post.surface import surface
from tests.unit import bed


def frame_of(
    particles: list[tuple[float, float, float]],
    contacts: list[tuple] = (),  # type: ignore[assignment]
    bonds: list[tuple] = (),  # type: ignore[assignment]
    wall_contacts: list[tuple] = (),  # type: ignore[assignment]
    disk: str = "on",
) -> Frame:
    """Particles x y R with ids 10, 11, ...; rows of links: id1, id2 (or wall row), fx, fy, x, y."""
    p = np.array(particles, float)

    def links(rows: list[tuple], second: str) -> Table:
        a = np.array(rows, float).reshape(-1, 6)
        names = ("id1", second, "fx", "fy", "x", "y")
        columns = {k: v.astype(np.int64) if k in ("id1", second) else v for k, v in zip(names, a.T)}
        return Table(columns, 0, len(a))

    tables = {
        "particles": Table({"gid": 10 + np.arange(len(p)), "x": p[:, 0], "y": p[:, 1], "radius": p[:, 2]}, 0, len(p)),
        "contacts": links(contacts, "id2"), "bonds": links(bonds, "id2"), "wall_contacts": links(wall_contacts, "wall"),
    }  # fmt: skip
    walls = {"id": np.array([5]), "p1": np.array([[0.0, 0.0]]), "p2": np.array([[9.0, 0.0]])}
    return Frame(0, 0.0, 1.0, {"disk": disk}, walls, tables)


def test_a_squeezed_pair() -> None:
    """Two discs pressed together along x by 7 N: V s_xx = R F each, nothing else; positive, being compression."""
    frame = frame_of([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0)], [(10, 11, -7.0, 0.0, 1.0, 0.0)])
    m, held = stress.moments(frame)
    np.testing.assert_array_equal(m, [[7.0, 0.0, 0.0, 0.0]] * 2)
    assert held.all()
    volume, thickness = stress.volume_rule(frame)
    assert (volume / math.pi).tolist() == [1.0, 1.0] and thickness == 1.0


def test_shear_forces_stand_in_the_other_column() -> None:
    frame = frame_of([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0)], [(10, 11, -7.0, 3.0, 1.0, 0.0)])
    np.testing.assert_array_equal(stress.moments(frame)[0], [[7.0, -3.0, 0.0, 0.0]] * 2)


def test_a_bonded_pair_that_touches_is_counted_once() -> None:
    """Contacts have the whole force of a touching pair; an open bond stands among the bonds only, and pulls."""
    places = [(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (4.5, 0.0, 1.0)]
    touching, open_bond = (10, 11, -7.0, 0.0, 1.0, 0.0), (11, 12, 4.0, 0.0, 3.25, 0.0)
    m, _ = stress.moments(frame_of(places, [touching], [touching, open_bond]))
    np.testing.assert_array_equal(m[:, 0], [7.0, 7.0 - 1.25 * 4.0, -1.25 * 4.0])
    # ZDEM may name a pair the other way round in one of the tables.
    other_way = (11, 10, 7.0, 0.0, 1.0, 0.0)
    np.testing.assert_array_equal(stress.moments(frame_of(places, [touching], [other_way, open_bond]))[0], m)
    np.testing.assert_array_equal(stress.moments(frame_of(places, [], [touching, open_bond]))[0], m)


def test_a_sphere_on_a_floor() -> None:
    frame = frame_of([(4.0, 1.0, 1.0)], wall_contacts=[(10, 0, 0.0, 12.0, 4.0, 0.0)], disk="off")
    np.testing.assert_array_equal(stress.moments(frame)[0], [[0.0, 0.0, 0.0, 12.0]])
    volume, thickness = stress.volume_rule(frame)
    assert volume[0] == pytest.approx(4.0 / 3.0 * math.pi) and thickness == 2.0
    assert stress.volume_rule(frame_of([(0, 0, 1.0)], disk="hex")) == ([2.0 * math.sqrt(3.0)], 1.0)


def test_what_does_not_fit_is_named() -> None:
    with pytest.raises(HpcdemError, match="the missing particle 99"):
        stress.moments(frame_of([(0, 0, 1), (2, 0, 1)], [(10, 99, -7.0, 0.0, 1.0, 0.0)]))
    frame = frame_of([(0, 0, 1), (2, 0, 1)], [(10, 11, -7.0, 0.0, 1.0, 0.0)])
    del frame.tables["contacts"].columns["fx"]
    with pytest.raises(HpcdemError, match="contacts have no forces"):
        stress.moments(frame)
    with pytest.raises(HpcdemError, match="disk cubes, expected one of on"):
        stress.volume_rule(frame_of([(0, 0, 1)], disk="cubes"))


def test_principal_stresses() -> None:
    """60 and 20 in axes turned by 30 degrees."""
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    turn = np.array([[c, -s], [s, c]])
    t = turn @ np.diag([60.0, 20.0]) @ turn.T
    mean, shear, angle = stress.principal(t[0, 0], t[0, 1], t[1, 1])
    assert (mean, shear, math.degrees(angle)) == pytest.approx((40.0, 20.0, 30.0))


# --- a bed at rest ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def frame() -> Frame:
    return bed.resting()


def section_of(frame: Frame, folder: Path, size: float = 200.0) -> tuple:
    write_vtkhdf(folder / "all_0000000000.vtkhdf", frame, SerialComm())
    options = strain_stress.Options(folder, size=size)
    seen = strain_stress.read_snapshot(folder / "all_0000000000.vtkhdf", options)
    return seen, strain_stress.make_section(seen, np.tile(strain.IDENTITY, (len(seen.gid), 1)), size)


@pytest.mark.parametrize("size", [200.0, 300.0])
def test_stress_grows_with_depth_as_the_weight_does(frame: Frame, tmp_path: Path, size: float) -> None:
    """Gradient within 3 % of rho_bulk g (mass over area and thickness), level within 3 % of the weight above.

    Half as coarse again, a bed of nine spacings is too thin for its gradient (see Decisions in docs/stress_strain.md).
    """
    seen, section = section_of(frame, tmp_path, size)
    p = frame.tables["particles"].columns
    area = bed.WIDTH * seen.thickness
    top = float(np.nanmin(section.surface[:, 1]))
    rows = np.flatnonzero((section.y >= 2.0 * size) & (section.y <= top - 2.0 * size))
    inner = (section.x > 1.5 * size) & (section.x < bed.WIDTH - 1.5 * size)
    syy = section.fields["syy"][np.ix_(rows, inner)].mean(axis=1)
    above = np.array([p["mass"][p["y"] > h].sum() for h in section.y[rows]]) * bed.G / area
    y = section.y[rows]
    middle = (p["y"] > y[0]) & (p["y"] < y[-1])
    rho = p["mass"][middle].sum() / (area * (y[-1] - y[0]))
    slope = -np.polyfit(y, syy, 1)[0] / (rho * bed.G)
    print(f"size {size:g}: slope / rho g = {slope:.4f}, level / weight = {(syy / above).mean():.4f}")
    if size == 200.0:
        assert slope == pytest.approx(1.0, abs=0.03)
    assert (syy / above).mean() == pytest.approx(1.0, abs=0.03)
    # without friction no shear stress on horizontal planes, and nearly as much sideways
    assert np.abs(section.fields["sxy"][np.ix_(rows, inner)].mean()) < 0.02 * syy.max()
    assert section.fields["sxx"][np.ix_(rows, inner)].mean() == pytest.approx(syy.mean(), rel=0.1)


def test_particle_stress_adds_up_to_the_work_of_the_boundary(frame: Frame) -> None:
    """Sum of V s = - sum over walls of x_c f, plus sum of x_p F_p over the particles' resultant contact forces, as
    written to the frame: to rounding. At rest F_p is minus the weight: to the unbalanced force."""
    m, _ = stress.moments(frame)
    p, w = (frame.tables[name].columns for name in ("particles", "wall_contacts"))

    def boundary(fx: np.ndarray, fy: np.ndarray) -> np.ndarray:
        at_walls = [-(w[i] * w[j]).sum() for i in "xy" for j in ("fx", "fy")]
        inside = [(p[i] * f).sum() for i in "xy" for f in (fx, fy)]
        return np.array(at_walls) + inside

    exact = boundary(p["fx"], p["fy"])
    scale = np.abs(m).sum()
    assert m.sum(axis=0) == pytest.approx(exact, abs=1e-11 * scale)
    weight = p["mass"] * bed.G
    assert np.hypot(p["fx"], p["fy"] - weight).max() < 0.05 * weight.mean()  # it is at rest
    assert m.sum(axis=0) == pytest.approx(boundary(0.0 * weight, weight), abs=0.01 * m[:, 3].sum())
    # Every particle's moments balance: no torque is left.
    assert np.abs(m[:, 1] - m[:, 2]).max() < 1e-6 * np.abs(m).max()


def test_contact_points_are_found_where_a_file_has_none(frame: Frame) -> None:
    """As in files of ZDEM: pairs, faces of walls and their ends."""
    m, _ = stress.moments(frame)
    bare = copy.deepcopy(frame)
    for name in ("contacts", "bonds", "wall_contacts"):
        for axis in "xy":
            del bare.tables[name].columns[axis]
    np.testing.assert_allclose(stress.moments(bare)[0], m, atol=1e-9 * np.abs(m).max())


def test_empty_cells_are_no_numbers(frame: Frame, tmp_path: Path) -> None:
    seen, section = section_of(frame, tmp_path)
    x, y = np.meshgrid(section.x, section.y)
    top = np.interp(section.x, *section.surface.T)
    for name, values in section.fields.items():
        inside = (x > 150.0) & (x < bed.WIDTH - 150.0) & (y > 150.0) & (y < top - 150.0)
        assert np.isfinite(values[inside]).all(), name
        assert np.isnan(values[(y > top + 200.0) | (x < -101.0) | (y < -101.0)]).all(), name
    # every disc has a number at the node of its cell
    i, j = (np.rint((c - s[0]) / 200.0).astype(int) for c, s in ((seen.x, section.x), (seen.y, section.y)))
    assert np.isfinite(section.fields["mean"][j, i]).all()


# --- the line over the top ---------------------------------------------------------------------------------------


def test_no_disc_stands_out_of_the_surface(frame: Frame) -> None:
    p = frame.tables["particles"].columns
    line = surface(p["x"], p["y"], p["radius"], 100.0, 20.0)
    heights = np.full(len(line), -np.inf)
    for x, y, r in zip(p["x"], p["y"], p["radius"]):
        h2 = r * r - (line[:, 0] - x) ** 2
        heights = np.where(h2 >= 0.0, np.maximum(heights, y + np.sqrt(np.maximum(h2, 0.0))), heights)
    inside = np.isfinite(heights)
    assert (line[inside, 1] >= heights[inside] - 1e-6).all()
    assert np.median(line[inside, 1] - heights[inside]) < 40.0  # but it lies on them
    assert np.diff(line[:, 0]) == pytest.approx(20.0) and line[0, 0] <= 20.0 and line[-1, 0] >= bed.WIDTH - 20.0


def test_the_surface_over_three_discs() -> None:
    x, y, r = np.array([0.0, 2.0, 12.0]), np.array([0.0, 0.0, 5.0]), np.ones(3)
    line = surface(x, y, r, 2.0, 0.01)
    at = {round(a, 2): b for a, b in line}
    assert at[0.0] == pytest.approx(1.0, abs=1e-3) and at[2.0] == pytest.approx(1.0, abs=1e-3)
    assert at[1.0] == pytest.approx(math.sqrt(8.0) - 2.0, abs=1e-3)  # a ball of 2 between discs of 1, 2 apart
    assert np.isnan(at[7.0])  # it falls through where the gap is wider
    assert at[12.0] == pytest.approx(6.0, abs=1e-3)
    bridged = {round(a, 2): b for a, b in surface(x, y, r, 20.0, 0.01)}
    assert bridged[7.0] > 1.0
    assert surface(*[np.zeros(0)] * 3, 1.0, 1.0).shape == (0, 2)
