"""The programs at their door: options, refusals, what is imported, who speaks."""

from __future__ import annotations

import importlib
import pkgutil
import re
import subprocess
import sys

import click
import pytest

from hpcdem import cli
from hpcdem.cli import common
from hpcdem.cli.chinese import in_chinese
from hpcdem.cli.programs import BY_NAME, GROUPS


def program(name: str, *args: str) -> subprocess.CompletedProcess[str]:
    """An entry point as the installed program calls it."""
    code = f"import sys; from hpcdem.cli import {name}; sys.argv[1:] = {list(args)!r}; sys.exit({name}())"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)


def options(*words: str) -> dict:
    return cli.read_command_line(cli.hpcdem, "hpcdem", list(words))


def test_defaults_of_a_run():
    found = cli.Options(**options("push.py"))
    assert (str(found.script), found.threads, found.figure) == ("push.py", None, True)
    assert (found.time_limit, found.resume, found.check, found.outdir, found.balance) == (
        None,
        False,
        False,
        None,
        True,
    )


def test_all_options_of_a_run():
    words = "-j 12 --time-limit 11:30:00 --resume --check --outdir here --no-figure push.py"
    found = cli.Options(**options(*words.split()))
    assert (found.threads, found.time_limit, str(found.outdir)) == (12, 41400.0, "here")
    assert found.resume and found.check and not found.figure


@pytest.mark.parametrize("name", ["start_zdem2jpg", "start_zdemss"])
def test_every_program_starts(name):
    done = program(name, "--help")
    assert done.returncode in (0, 2) and "Traceback" not in done.stderr


def test_version_is_quick_to_say():
    done = program("main", "--version")
    assert done.returncode == 0 and done.stdout.startswith("hpcdem ")
    code = (
        "import sys; from hpcdem.cli import main\nsys.argv[1:] = ['--version']\n"
        "try: main()\nexcept SystemExit: pass\n"
        "print([m for m in ('numpy', 'numba', 'matplotlib', 'mpi4py', 'h5py', 'rich') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def commands() -> dict[str, click.Command]:
    """All programs of the package, by name."""
    found = {}
    for module in pkgutil.iter_modules(cli.__path__):
        members = vars(importlib.import_module(f"{cli.__name__}.{module.name}"))
        found |= {f"{module.name}.{name}": one for name, one in members.items() if isinstance(one, click.Command)}
    return found


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_no_option_takes_a_number_that_is_none(value):
    """Not `--before nan`, not `--keep-every inf`, nor any other of any program."""
    seen = set()
    for name, command in commands().items():
        for option in command.params:
            if isinstance(option.type, click.types.FloatParamType | common.Finite):
                seen.add(f"{name} {option.name}")
                with pytest.raises(click.BadParameter, match=f"{value} is not a number"):
                    option.type.convert(value, option, None)
    assert len(seen) > 40 and {"run.hpcdem before", "run.hpcdem keep_every", "resume.resume before"} <= seen


@pytest.mark.parametrize(
    "words",
    [["--before", "nan"], ["--keep-every", "inf"], ["--keep-at", "1,inf"], ["--time-limit", "nan"],
     ["--autosave", "inf"], ["--before", "-1"], ["--keep-every", "0"]],
)  # fmt: skip
def test_such_numbers_are_refused_by_name(words, capsys):
    with pytest.raises(SystemExit) as left:
        options(*words, "push.py")
    assert left.value.code == 2 and words[0] in capsys.readouterr().err


@pytest.mark.parametrize("word", [*(pytest.param(word, marks=pytest.mark.slow) for word in ("-h", "--help")), "--hlep"])
def test_help_also_as_the_manual_spells_it(word):
    done = program("main", word)
    assert done.returncode == 0 and "--time-limit" in done.stdout
    for option in ("--strin-stres DIR", "-g, --grid SIZE", "--addball", "--delball", "--leftwallid ID", "--rightwallid",
                   "--xmove X", "--ymove", "--increment", "--smooth"):  # fmt: skip
        assert option in done.stdout


def test_help_gives_the_arguments_that_a_command_takes():
    seen = set()
    for name, command in commands().items():
        one = BY_NAME.get(name.rpartition(".")[2])
        if one is not None:
            pieces = [piece.strip("[].") for piece in command.collect_usage_pieces(click.Context(command))]
            words = [word.strip("[]") for word in one.use.split()]
            taken = [piece.split("|")[-1 if one.name == "draw" else 0] for piece in pieces if piece != "OPTIONS"]
            assert taken == words, name
            seen.add(one.name)
    assert {"measure", "view", "draw", "info", "movie", "resume", "sweep", "examples"} <= seen


def test_help_lists_every_command_by_group_and_in_chinese():
    page = cli.hpcdem.get_help(click.Context(cli.hpcdem, info_name="hpcdem", max_content_width=110))
    for group, programs in GROUPS.items():
        assert f"\n{group}:\n" in page and in_chinese(group) != group
        for one in programs:
            assert f"hpcdem {one.name}" in page and in_chinese(one.line) != one.line
    assert page.index("hpcdem view") < page.index("--time-limit")


def test_every_command_of_the_table_starts():
    for one in (one for one in BY_NAME.values() if one.module):
        module = importlib.import_module(f"hpcdem.cli.{one.module}")
        assert hasattr(module, "work") and hasattr(module, one.name) if one.reads_only else hasattr(module, "start")


def test_examples_are_listed_and_copied(tmp_path):
    said = program("main", "examples")
    assert said.returncode == 0 and "push.py" in said.stdout and "Thrust sheets" in said.stdout
    done = program("main", "examples", "specimens.py", "--into", str(tmp_path))
    assert done.returncode == 0 and {path.name for path in tmp_path.iterdir()} == {"specimens.py", "grading.txt"}
    again = program("main", "examples", "specimens", "--into", str(tmp_path))
    assert again.returncode == 2 and "exists and is not overwritten" in again.stderr
    far = program("main", "examples", "../x")
    assert far.returncode == 2 and "../x: unknown example. Known: angle_of_repose, " in far.stderr
    wrong = program("main", "examples", "puhs")
    assert wrong.returncode == 2 and "did you mean 'push'?" in wrong.stderr


OF_SECTIONS = "--addball", "--delball", "-g 100.0", "--grid 200", "--leftwallid 1", "--rightwallid 2", "--xmove -1000.0"
WRONG = {
    "viw": "no such script and no such command; did you mean hpcdem view?", "mesure": "did you mean hpcdem measure?",
    "xyzzyxyzzy": "see hpcdem --help", "viw.py": "viw.py: no such script; hpcdem examples lists the examples\n",
    **{f"{words} push.py": f"{words.split()[0]}.* requires -s DIR" for words in OF_SECTIONS},
    "-j 12 --ymove -1000.0 push.py": "--ymove.* requires -s DIR", "-s nowhere": "nowhere",
    "--strain-stress nowhere": "nowhere", "-j 1 --addball --strin-stres nowhere": "nowhere", "": "Usage:",
    **dict.fromkeys(("-j 0 a.py", "--time-limit soon a.py", "--nonsense a.py"), "Usage:"),
}  # fmt: skip
QUICK = "viw", "viw.py", "--addball push.py", "-j 1 --addball --strin-stres nowhere", ""


@pytest.mark.parametrize("words", [pytest.param(w, marks=[pytest.mark.slow] * (w not in QUICK)) for w in WRONG])
def test_what_is_wrong_with_a_command_line_is_named(words, tmp_path):
    done = program("main", *words.replace("nowhere", str(tmp_path / "nowhere")).split())
    assert done.returncode != 0 if "nowhere" in words else done.returncode == 2
    assert re.search(WRONG[words], done.stderr + done.stdout) and "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.mpi
def test_a_wrong_command_line_is_reported_once(launch):
    done = launch(3, "--nonsense", "a.py")
    assert done.returncode == 2
    assert done.stderr.count("No such option") == 1


def test_a_missing_script(resident, tmp_path):
    done = resident(1, "nowhere.py", cwd=tmp_path)
    assert done.returncode == 2 and "hpcdem: nowhere.py: no such script" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.mpi
def test_a_missing_script_is_reported_once(launch, tmp_path):
    done = launch(3, "nowhere.py", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("no such script") == 1


def test_a_pcdc_script_is_read_whole_before_anything_runs(resident, tmp_path):
    (tmp_path / "a.sc").write_text("open('ran', 'w')\nfor i in range(3):\n    pcdc block create\n")
    done = resident(1, "a.sc", cwd=tmp_path)
    assert done.returncode == 2 and "hpcdem: a.sc:3: pcdc block create: read 'block'" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.sc"]


def test_a_pcdc_script_is_checked_without_running_it(resident, tmp_path):
    lines = ["import math", "open('ran', 'w')", "pcdc model new", "for i in range(3):",
             "    pcdc geometry create circle ([i],0) 1 as-layer 'hole'",
             "pcdc mesh create from-layer 'whole' size 0.5"]  # fmt: skip
    (tmp_path / "a.sc").write_text("\r\n".join(lines))
    done = resident(1, "--check", "a.sc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "a.sc: 3 commands read, nothing was executed" in done.stdout and "1 geometry create circle" in done.stdout
    assert "warning: line 6: no line creates the geometry layer 'whole'" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["a.sc"]


def test_a_pcdc_script_without_a_checkpoint_starts_at_the_beginning(resident, tmp_path):
    (tmp_path / "a.sc").write_text("pcdc model new\n")
    done = resident(1, "--resume", "a.sc", cwd=tmp_path, timeout=600)
    assert done.returncode == 0 and "no checkpoint in data: starting at the beginning" in done.stdout


def test_a_return_outside_of_a_function_is_found_before_the_run(resident, tmp_path):
    (tmp_path / "a.sc").write_text("pcdc model new\nreturn 3\n")
    done = resident(1, "--check", "a.sc", cwd=tmp_path)
    assert (
        done.returncode == 2 and "hpcdem: a.sc:2: return 3: this is not correct Python: 'return' outside" in done.stderr
    )


@pytest.mark.slow
@pytest.mark.mpi
def test_the_console_is_for_one_rank(launch, tmp_path):
    done = launch(2, "console", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("hpcdem console supports one rank") == 1


@pytest.mark.parametrize("option", ["--check", "--resume"])
def test_options_for_zdem_scripts_are_refused_for_python(resident, tmp_path, option):
    (tmp_path / "a.py").write_text("import hpcdem\n")
    done = resident(1, option, "a.py", cwd=tmp_path)
    assert done.returncode == 2 and f"hpcdem: a.py: {option} is for ZDEM and PCDC scripts" in done.stderr


def test_a_zdem_script_takes_no_arguments(resident, tmp_path):
    (tmp_path / "a.py").write_text("START\nSTOP\n")
    done = resident(1, "a.py", "0.3", cwd=tmp_path)
    assert done.returncode == 2 and "0.3: a ZDEM script does not accept arguments" in done.stderr


SHORT = """\
START
BOX left 0.0 right 100.0 bottom 0.0 height 100.0
BALL id 1 x 50.0 y 50.0 rad 1.0
PROP density 2000.0 shear 1e9 poiss 0.2 hertz
SET dt 0.001 gravity 0.0 -9.8
CYC 100
STOP
"""


def test_check_runs_nothing(resident, tmp_path):
    (tmp_path / "a.py").write_text(SHORT)
    done = resident(1, "--check", "a.py", cwd=tmp_path)
    assert done.returncode == 0 and "100" in done.stdout
    assert [p.name for p in tmp_path.iterdir()] == ["a.py"]


def test_a_run_from_script_to_figure(launch, tmp_path):
    (tmp_path / "a.py").write_text(SHORT)
    done = launch(1, "a.py", cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("hpcdem ") and "steps/s" in done.stdout
    *_, figure, results = done.stdout.splitlines()
    figure = figure.removeprefix("figure: ")
    assert results.startswith("results: data; `hpcdem view data` shows them")
    assert (tmp_path / figure).stat().st_size > 1000


def test_the_run_does_not_load_what_only_the_figure_needs(tmp_path):
    (tmp_path / "a.py").write_text(SHORT)
    code = (
        "import sys; from hpcdem.cli import main\nsys.argv[1:] = ['a.py', '--no-figure']\n"
        "try: main()\nexcept SystemExit: pass\n"
        "print([m for m in ('matplotlib', 'vtk', 'pyvista') if m in sys.modules])"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True, cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
