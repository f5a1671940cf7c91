"""Ready-made models: their parameters, their text, and that script, build and run are one and the same."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import click
import numpy as np
import pytest

from hpcdem.cases import CASES, find
from hpcdem.cases.base import Case, chooses, number
from hpcdem.cli.case import OWN, command
from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc import check
from tests.conftest import Launcher, absent
from tests.pcdc.fake import Bench
from tests.tables import each

KINDS = [find(name) for name in CASES]


def alternatives(kind: type[Case]) -> list[Case]:
    """The default, and every choice taken the other way."""
    made = [kind()]
    for name, field in kind.model_fields.items():
        if chooses(field) and isinstance(field.default, bool):
            made.append(kind(**{name: not field.default}))
    if "dim" in kind.model_fields:
        for one in list(made):
            given = {name: getattr(one, name) for name in one._given()}
            made.append(kind(dim=3, **given))
    return made


# ---- text ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.052, "0.052"), (2700.0, "2700"), (30e9, "30e9"), (5e-6, "5e-6"), (10e6, "10e6"), (0.0, "0"), (3, "3"),
     (123456.0, "123.456e3"), (1 / 3, "0.3333333333333333"), (-2.5e5, "-250e3"), (True, "True"), ("a", "'a'")],
)  # fmt: skip
def test_numbers_are_written_as_one_reads_them(value, text):
    assert number(value) == text


def test_numbers_read_back_to_the_last_bit():
    rng = np.random.default_rng(3)
    for value in (rng.standard_normal(500) * 10.0 ** rng.integers(-12, 13, 500)).tolist():
        assert float(number(value)) == value


@each("kind", KINDS)
def test_every_alternative_is_a_correct_script(kind):
    for case in alternatives(kind):
        summary = check.summary(case.script(), f"{kind.name}.sc")
        assert "warning" not in summary
        assert max(len(line) for line in case.script().splitlines()) <= 120


@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_has_an_effect_and_every_result_is_made(kind):
    everything = "\n".join(case.model() + case.loading() for case in alternatives(kind))
    for name, field in kind.model_fields.items():
        assert field.description
        if chooses(field):
            values = getattr(field.annotation, "__args__", (True, False))
            made = [kind(**{name: value}) for value in values]
            assert len({one.model() + one.loading() for one in made}) == len(values), name
        else:
            assert re.search(rf"\b{name}\b", everything), name
    made = kind().script()
    for field in dataclasses.fields(kind.result):
        assert re.search(rf"\b{field.name}\b[\w, ]* =", made), field.name


@each("kind", KINDS)
def test_the_command_in_the_script_makes_the_script(kind):
    given = {name: field.default * 1.01 for name, field in kind.model_fields.items()
             if isinstance(field.default, float) and 0 < field.default < 0.02}  # fmt: skip
    for case in [*alternatives(kind), kind(**given)]:
        (line,) = re.findall(r"^# Written by: hpcdem case (.*)$", case.script(), re.MULTILINE)
        name, *words = line.split()
        options = command(find(name)).make_context(name, words).params
        again = find(name)(**{k: v for k, v in options.items() if k not in OWN and v is not None})
        assert again == case and again.script() == case.script()


def test_help_shows_every_parameter_with_its_default():
    for kind in KINDS:
        text = command(kind).get_help(click.Context(command(kind)))
        for name in kind.model_fields:
            assert f"--{name.replace('_', '-')}" in text


# ---- wrong parameters ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"width": -1}, r"UCS: width is -1, expected more than 0 \(width of the specimen, m\)"),
        ({"width": "wide"}, "UCS: width is wide, expected a number"),
        ({"young": float("nan")}, "UCS: young is nan, expected a finite number"),
        ({"young": float("inf")}, "UCS: young is inf, expected a finite number"),
        ({"widht": 1}, "UCS has no parameter 'widht'; did you mean 'width'?"),
        ({"poisson": 0.5}, "UCS: poisson is 0.5, expected less than 0.5"),
        ({"size": 0.02}, "UCS: size is 0.02, expected at most a quarter of width, 0.013 m"),
        ({"width": 0.06}, "UCS: platen_width is 0.056, expected at least width, 0.06 m"),
        ({"size": 1e-6}, r"UCS: size is 1e-06, which makes 1\.3e\+10 elements: expected at most 5e\+06"),
        ({"platens": 3}, "UCS: platens is 3, expected"),
        ({"dim": 4}, "UCS: dim is 4, expected 2 or 3"),
        ({"dim": 3, "size": 1e-4}, r"which makes 1\.9e\+09 elements"),
        ({"size": None}, "UCS: size is None, expected a number"),
    ],
)
def test_what_is_wrong_is_named(given, said):
    with pytest.raises(ScriptError, match=said) as found:
        find("ucs")(**given)
    assert found.value.file == __file__


def test_what_is_of_space_is_refused_in_the_plane():
    with pytest.raises(ScriptError, match="thickness requires dim 3"):
        find("brazilian")(thickness=0.02)
    with pytest.raises(ScriptError, match="elements requires dim 2"):
        find("support")(dim=3, elements="tri")
    with pytest.raises(ScriptError, match="liner requires dim 2"):
        find("support")(dim=3, liner=0.3)
    with pytest.raises(ScriptError, match=r"at most 0\.7 of bolt_spacing"):
        find("support")(dim=3, size=0.8)
    assert find("ucs")(dim="3") == find("ucs")(dim=3)


def test_a_script_is_reported_its_line(tmp_path):
    bench = Bench(tmp_path)
    with pytest.raises(HpcdemError, match=r"script\.sc:3: UCS has no parameter 'sise'"):
        bench("from hpcdem.cases import UCS\npcdc model new\nUCS(sise=1)")


def test_parameters_stay_as_they_are():
    with pytest.raises(ScriptError, match=r"UCS cannot be changed: give .* to the constructor, UCS\("):
        find("ucs")().width = 3.0  # type: ignore[attr-defined]


def test_loading_without_a_model_is_refused():
    with pytest.raises(ScriptError, match=r"UCS\.load: no model yet"):
        find("ucs")().load()


# ---- a text within a script ----------------------------------------------------------------------------------------


def test_included_text_has_names_of_its_own_and_the_line_of_the_caller(tmp_path):
    bench = Bench(tmp_path)
    bench.interpreter.namespace["seen"] = names = {}
    bench.interpreter.namespace["include"] = bench.interpreter.include
    text = "width = 7\npcdc mesh structured (0,0) ([width],1) cells 7 1\nlines = [pcdc.cycle]\npcdc model step 2"
    bench(f"width = 3\n\ninclude({text!r}, 'more.sc', seen)\npcdc model step 1")
    assert bench["width"] == 3 and names["width"] == 7 and names["lines"] == [0]
    assert bench.project.mesh is not None and len(bench.project.mesh.cells) == 14 and bench.project.step == 3
    assert "line 3: step 2" in bench.blocks.log.lines and "line 4: step 1" in bench.blocks.log.lines


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("\npcdc modle new", r"^more\.sc:2: "),
        ("a = 1\npcdc model step [1/0]", r"^more\.sc:2: .*ZeroDivisionError"),
        ("pcdc element group 'a' range y 0 1", r"^more\.sc:1: .*no mesh yet.*called from line 2"),
        ("\n\nraise KeyError('x')", r"more\.sc ended with an error(.|\n)*line 3"),
        ("def f(:", r"^more\.sc:1: "),
    ],
)
def test_errors_of_included_text_name_its_line(tmp_path, text, said):
    bench = Bench(tmp_path)
    bench.interpreter.namespace["include"] = bench.interpreter.include
    with pytest.raises(HpcdemError, match=said):
        bench(f"pcdc model new\ninclude({text!r}, 'more.sc', {{}})")


# ---- the program ---------------------------------------------------------------------------------------------------


def test_the_program_lists_writes_and_never_replaces(launch, tmp_path):
    listed = launch(1, "case", cwd=tmp_path)
    assert listed.returncode == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()] == list(CASES)
    done = launch(1, "case", "ucs", "--width", "0.05", cwd=tmp_path)
    assert done.returncode == 0 and "run it with hpcdem ucs.sc" in done.stdout
    text = (tmp_path / "ucs.sc").read_text()
    assert text == find("ucs")(width=0.05).script()
    again = launch(1, "case", "ucs", cwd=tmp_path)
    assert again.returncode == 2 and "ucs.sc exists: use --force to replace it" in again.stderr
    assert (tmp_path / "ucs.sc").read_text() == text
    wrong = launch(1, "case", "ucs", "--force", "--width", "x", cwd=tmp_path)
    assert wrong.returncode == 2 and "width is x, expected a number" in wrong.stderr
    assert (tmp_path / "ucs.sc").read_text() == text and sorted(p.name for p in tmp_path.iterdir()) == ["ucs.sc"]
    nowhere = launch(1, "case", "ucs", "-o", "there/ucs.sc", cwd=tmp_path)
    assert nowhere.returncode == 2 and "folder there not found" in nowhere.stderr
    unknown = launch(1, "case", "usc", cwd=tmp_path)
    assert unknown.returncode == 2 and "unknown case 'usc'" in unknown.stderr


# ---- script, build and run are one ---------------------------------------------------------------------------------

COARSE = "size=0.013, transits=5, cohesion=4e6, tensile_strength=1e6"
SCRIPT = f"""
from hpcdem.cases import UCS
pcdc model new
result = UCS({COARSE}).run()
print('found %.17g %.17g' % (result.peak, result.modulus))
"""
STEPWISE = f"""
from hpcdem.cases import UCS
case = UCS({COARSE.replace("4e6", "9e6")})
case.build()
pcdc face-joint property cohesion 4e6 range face-of 'rock' set 'body'
result = case.load()
print('found %.17g %.17g' % (result.peak, result.modulus))
"""
PROGRAM = f"""
from hpcdem.cases import UCS
for name in ('one', 'two'):
    result = UCS({COARSE}).run(outdir=name)
    print('found %.17g %.17g' % (result.peak, result.modulus))
"""


def histories(folder: Path) -> dict[str, bytes]:
    found = {path.name: path.read_bytes() for path in folder.glob("history_*.csv")}
    assert len(found) == 5
    return found


def found(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("found ")]


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """The written script, run by itself."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    folder = tmp_path_factory.mktemp("ucs")
    (folder / "ucs.sc").write_text(eval(f"find('ucs')({COARSE})").script())
    done = Launcher()(1, "ucs.sc", cwd=folder, timeout=600)
    assert done.returncode == 0, done.stderr
    assert (folder / "data" / "ucs.png").stat().st_size > 5000 and list((folder / "data").glob("all_*.jpg"))
    return folder


@pytest.mark.slow
def test_step_by_step_in_a_script(resident, written, tmp_path):
    (tmp_path / "a.sc").write_text(STEPWISE)
    done = resident(1, "a.sc", "--no-figure", cwd=tmp_path, timeout=600)
    assert done.returncode == 0, done.stderr
    assert histories(tmp_path / "data") == histories(written / "data")
    curve = np.loadtxt(written / "data" / "ucs.csv", delimiter=",", skiprows=1, usecols=(1, 2))
    (line,) = found(done.stdout)
    assert float(line.split()[1]) == pytest.approx(1e6 * curve[:, 1].max(), rel=1e-12)


@pytest.mark.slow
def test_in_a_program_several_times(launch, written, tmp_path):
    (tmp_path / "study.py").write_text(PROGRAM)
    done = launch.python(1, "study.py", cwd=tmp_path, timeout=600)
    assert done.returncode == 0, done.stderr
    one, two = found(done.stdout)
    assert one == two
    for name in ("one", "two"):
        assert histories(tmp_path / name) == histories(written / "data")
        assert (tmp_path / name / "ucs.png").exists()
    assert sorted(p.name for p in tmp_path.iterdir() if not p.name.startswith("data")) == ["one", "study.py", "two"]


STOPPED = f"""
import os, signal
from hpcdem.cases import UCS

class Stopped(UCS):
    def loading(self):
        line = "    peak = max(peak, stress)\\n"
        more = "    if pcdc.cycle > 500 and os.path.exists('stop'): os.kill(os.getpid(), signal.SIGUSR1)\\n"
        return "import os, signal\\n" + super().loading().replace(line, line + more)

result = Stopped({COARSE}).run()
print('found %.17g %.17g' % (result.peak, result.modulus))
"""


def test_a_stopped_case_continues(resident, written, tmp_path):
    (tmp_path / "a.sc").write_text(STOPPED)
    (tmp_path / "stop").touch()
    done = resident(1, "a.sc", "--no-figure", cwd=tmp_path, timeout=600)
    assert done.returncode == 85 and "resume with --resume" in done.stderr, done.stderr
    (tmp_path / "stop").unlink()
    again = resident(1, "a.sc", "--no-figure", "--resume", cwd=tmp_path, timeout=600)
    assert again.returncode == 0, again.stderr
    assert len(found(again.stdout)) == 1 and histories(tmp_path / "data") == histories(written / "data")


@pytest.mark.slow
@pytest.mark.mpi
def test_on_several_ranks(launch, tmp_path):
    """Elements small enough for four strips; the same bits on any number of ranks, in scripts and in programs."""
    finer = COARSE.replace("0.013", "0.004")
    for ranks in (1, 2, 3, 4):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.sc").write_text(SCRIPT.replace(COARSE, finer))
        done = launch(ranks, "a.sc", "--no-figure", cwd=folder, timeout=1200)
        assert done.returncode == 0, done.stderr
        assert histories(folder / "data") == histories(tmp_path / "1" / "data")
    (tmp_path / "study.py").write_text(PROGRAM.replace(COARSE, finer))
    done = launch.python(2, "study.py", cwd=tmp_path, timeout=1200)
    assert done.returncode == 0, done.stderr
    for name in ("one", "two"):
        assert histories(tmp_path / name) == histories(tmp_path / "1" / "data")
    (tmp_path / "wrong.sc").write_text("from hpcdem.cases import UCS\npcdc model new\nUCS(size=-1).run()\n")
    done = launch(2, "wrong.sc", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("wrong.sc:3: UCS: size is -1") == 1


def test_outdir_in_a_script_is_refused(resident, tmp_path):
    (tmp_path / "a.sc").write_text("from hpcdem.cases import UCS\npcdc model new\nUCS().run(outdir='there')\n")
    done = resident(1, "a.sc", cwd=tmp_path)
    assert done.returncode == 2 and "a.sc:3: UCS.run: outdir applies to Python programs" in done.stderr
    assert not (tmp_path / "there").exists()
