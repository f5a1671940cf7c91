"""Small inputs that once gave wrong answers, as strangers found them, with the values that are right.

They lie beside the project, in ../shared; what each holds is held by tests of its subject, too.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import ROOT

pytestmark = pytest.mark.slow
FOLDER = Path(os.environ.get("HPCDEM_STRANGERS", ROOT.parent / "shared" / "cases_turn3"))
Run = Callable[..., str]


@pytest.fixture
def run(resident: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path) -> Run:
    """`run("damping_t.sc")`: what a file says, with some of its words replaced, each of which must be there."""
    if not FOLDER.is_dir():
        pytest.skip("the inputs of strangers are not part of the project: set HPCDEM_STRANGERS to their folder")
    folder = tmp_path / "cases"
    shutil.copytree(FOLDER, folder)
    for path in (folder, *folder.rglob("*")):  # they are read-only there
        path.chmod(0o755 if path.is_dir() else 0o644)

    def carry_out(name: str, *words: str, **replaced: str) -> str:
        path = folder / name
        text = path.read_text()
        for old, new in (pair.split(" => ") for pair in replaced.values()):
            assert old in text, old
            text = text.replace(old, new)
        path.write_text(text)
        done = resident(1, path.name, "--no-figure", *words, cwd=path.parent)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return carry_out


def numbers(text: str, pattern: str) -> list[float]:
    """All numbers in the places of %f of a pattern, in order."""
    found = re.findall(pattern.replace("%f", r"([-+0-9.e]+)"), text)
    assert found, f"{pattern} is not in\n{text}"
    return [float(number) for groups in found for number in ([groups] if isinstance(groups, str) else groups)]


def checked(text: str) -> list[str]:
    """What the lines CHK of a file call wrong."""
    lines = [line for line in text.splitlines() if line.startswith("CHK | ")]
    assert lines
    return [line for line in lines if not line.endswith("| ok")]


def warnings(text: str) -> list[str]:
    return [line for line in text.splitlines() if "warning: " in line]


# -- blocks ------------------------------------------------------------------------------------------------------------


def test_water_wets_no_outer_face(run: Run) -> None:
    found = numbers(run("wet_outer_faces.sc"), r"joint normal stress %f .* element stress %f ")
    assert found == pytest.approx([-5e6, -5e6, -4e6, -5e6], rel=2e-3)


def test_the_sides_of_a_joint_are_two_nodes(run: Run) -> None:
    found = re.findall(r"opening \[([^\]]*)\]", run("two_sides_of_a_joint.sc"))
    assert len(found) == 2
    assert [float(text.split()[0]) for text in found] == pytest.approx([1e-6, 1e-6], rel=1e-2)


def test_the_damping_of_contacts_ends_at_its_tension(run: Run) -> None:
    found = numbers(run("damping_t.sc"), r"stress %f over 0.2 m; T %f;")
    assert len(found) == 6
    assert [stress / tension for stress, tension in zip(found[::2], found[1::2])] == pytest.approx([1.0] * 3, rel=0.03)


def test_tables_continue_in_static_runs(run: Run) -> None:
    assert numbers(run("static_tables.sc"), "syy %f time") == pytest.approx([-1e5], rel=1e-3)


def test_rock_within_its_strength_stays_so(run: Run) -> None:
    """Without a stress zz that was given it is the one of plane strain."""
    text = run("initial_szz.sc")
    (line,) = [line for line in text.splitlines() if line.startswith("zz None")]
    assert numbers(line, "syy %f szz %f ") == pytest.approx([-10e6, -4e6], rel=1e-2)
    assert re.search(r"plastic \{[^,]*0(\.0)?\)?\}$", line), line


def test_cooling_flows_no_more_in_one_step_than_in_many(run: Run) -> None:
    text = run("cooled_mohr_coulomb.sc", few="(1, 4, 16, 64) => (1, 4, 16)")
    assert checked(text) == []
    assert re.search(r"^state \[[^,]*0(\.0)?\)?\]$", text, re.MULTILINE), text


def test_water_that_is_switched_off_still_carries(run: Run) -> None:
    assert checked(run("hydraulic_off.sc")) == []


def test_conditions_on_a_shared_corner_combine(run: Run) -> None:
    text = run("move_constraint_replaced.sc")
    assert "EXC" not in text
    assert numbers(text, r"corner \(0,0\) moved by \[\s*%f\s*\]") == pytest.approx([0.0, 0.0], abs=1e-15)


def test_the_energy_account_closes_with_small_strain(run: Run) -> None:
    """To rounding, which with large strain it does not."""
    text = run("energy_small_strain.py")
    closing = [abs(value) for value in numbers(text, " small .*'relative': '%f'")]
    assert len(closing) == 3 and max(closing) < 1e-12, text


def test_checkpoints_change_nothing(run: Run, tmp_path: Path) -> None:
    """Automatic ones in the midst of an implicit solve."""
    frames = {}
    for often in ("off", "0.02"):
        run("autosave_changes_bits.sc", "--autosave", often, "--outdir", often)
        frames[often] = {path.name: path.read_bytes() for path in sorted((tmp_path / "cases" / often).glob("f_*"))}
    assert len(frames["off"]) > 1 and list((tmp_path / "cases" / "0.02").glob("auto_*.sav"))
    assert frames["off"] == frames["0.02"]


def test_a_block_that_falls_through_another_is_reported(run: Run) -> None:
    said = [line for line in warnings(run("low_penalty.sc")) if "overlap" in line or "penetrat" in line]
    assert said and re.search(r"\(-?[0-9.]+, ?-?[0-9.]+\)", said[0]), said


def test_nothing_to_do_is_no_error(run: Run) -> None:
    text = run("nothing_to_do.sc")
    assert "EXC" not in text and text.count("t1 ok") == 1 and text.count("t2 ok") == 5


# -- meshes ------------------------------------------------------------------------------------------------------------


def test_a_set_of_a_file_is_the_right_elements(run: Run) -> None:
    text = run("mesh/model.sc")
    assert numbers(text, "end moves by %f right") == pytest.approx([2.2e-3], rel=1e-6)
    assert [int(number) for number in re.findall(r"\d+", text.split("elements of CLAY ")[1].splitlines()[0].replace(
        "np.int64", ""))] == [2, 3, 4, 5]  # fmt: skip


@pytest.mark.parametrize(
    ("file", "dim", "groups"),
    [("nested_one.inp", 2, {"LEFT": [0], "RIGHT": [1], "BOTH": [0, 1]}),
     ("solid_sets.inp", 3, {"LOWER": [*range(6)], "UPPER": [*range(6, 12)]})],  # six elements to a hexahedron
)  # fmt: skip
def test_sets_of_sets_and_of_solids(
    run: Run, tmp_path: Path, file: str, dim: int, groups: dict[str, list[int]]
) -> None:
    lines = [f"pcdc model new dim {dim}", f"pcdc mesh import '{file}'"]
    sets = {group: "BOTH" if group == "BOTH" else "physical" for group in groups}  # what overlaps has a set of its own
    lines += [
        f"print('{g}', [int(k) for k in pcdc.numbers('element', group='{g}', set='{of}')])" for g, of in sets.items()
    ]
    (tmp_path / "cases" / "mesh" / "sets.sc").write_text("\n".join(lines) + "\n")
    text = run("mesh/sets.sc")
    assert [f"{group} {members}" in text for group, members in groups.items()] == [True] * len(groups), text


def test_a_mesh_in_pieces_is_reported(run: Run) -> None:
    """The whole one holds its load; of others the places are named, and the command that joins them."""
    text = run("mesh/pull_cube.sc")
    assert numbers(text, "good2 top %f elastic") == pytest.approx([1.03e-3], rel=0.02)
    said = [line for line in warnings(text) if "mesh glue" in line]
    assert len(said) == 2 and all(re.search(r"\(-?[0-9.e-]+, ?-?[0-9.e-]+", line) for line in said), text


# -- discs -------------------------------------------------------------------------------------------------------------


def test_bonds_that_make_energy_are_reported(run: Run) -> None:
    text = run("bonds_make_energy.py", few=", (5e8, 0.01)) => )")
    assert [line for line in warnings(text) if "bond" in line and "energy" in line], text


def test_a_time_step_beyond_the_limit_is_reported_while_contacts_form(run: Run) -> None:
    text = run("time_step_unwatched.py", few="CYC 4000 => CYC 2000")
    assert [line for line in warnings(text) if "time step" in line], text


def test_friction_continues_where_walls_meet(run: Run) -> None:
    text = run(
        "wall_junction.py", few="(1, 2, 4, 7, 20) => (1, 2)", near="s2.ball(-0.5, => s2.ball(-0.01,",
        short="s2.cycle(300_000) => s2.cycle(5000)", rest="s.cycle(20000) => s.cycle(6000)",
    )  # fmt: skip
    found = numbers(text, r"sum of forces/mg %f, overlap k/mg %f;.*least after that %f, mean %f")
    assert found == pytest.approx([1.0] * 8, rel=1e-3)
