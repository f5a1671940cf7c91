"""What a script reads and writes by name: nothing is written over the script or over what it reads."""

from __future__ import annotations

import os
import signal

import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang import detect
from hpcdem.lang.pcdc import check
from hpcdem.lang.zdem import execute, parser

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2\n"
RUN = BOX + "pcdc history create 'load' node value reaction-y sum every 5\npcdc model step 20\n"
CHART = "pcdc chart create 'c'\npcdc chart add 'c' values (0,0) (1,1)\n"


@pytest.mark.parametrize(
    ("text", "name"),
    [("pcdc model save 'script.sc'\n", "script.sc"), ("pcdc model save './x/../script.sc'\n", "script.sc"),
     (RUN + "pcdc history export '{folder}/script.sc'\n", "script.sc"),
     (CHART + "pcdc chart export 'c' '{folder}/mesh.svg'\n", "mesh.csv"),
     (RUN + "pcdc history export '{folder}/mesh.csv'\n", "mesh.csv"),
     ("pcdc model save 'before.sav'\n", "before.sav"), ("pcdc model save 'link.sc'\n", "script.sc")],
)  # fmt: skip
def test_nothing_is_written_over_what_is_read(bench, monkeypatch, text, name):
    """Whichever way the name is written, and whichever command writes."""
    folder = bench.project.directory
    monkeypatch.chdir(folder)
    (folder / "x").mkdir()
    bench.blocks.save(folder / "before.sav", {"project": None})
    for other in ("script.sc", "mesh.csv"):
        (folder / other).write_text("as it was")
    os.symlink("script.sc", folder / "link.sc")
    kept = (folder / name).read_bytes()
    bench.project.to_read("mesh.csv")
    bench.project.to_read("before.sav")
    with pytest.raises(ScriptError, match=r"would overwrite .*; choose another name") as caught:
        bench(text.replace("{folder}", str(folder)))
    assert (folder / name).read_bytes() == kept and caught.value.line == text.count("\n")


def test_what_the_run_has_made_itself_may_be_replaced(bench):
    bench(BOX + "for k in range(3):\n    pcdc model save 'state.sav'\n    pcdc model restore 'state.sav'\n"
          "    pcdc model step 5\npcdc model save 'state.sav'\n")  # fmt: skip
    assert bench.project.step == 15


def test_what_is_exported_is_a_result(bench):
    bench(RUN + "pcdc history export 'h.csv'\n" + CHART + "pcdc chart export 'c' 'c.svg'\npcdc model save 's.sav'\n")
    names = {path.name for path in bench.project.outdir.iterdir()}
    assert {"h.csv", "c.svg", "c.csv", "history_load.csv"} <= names
    assert {path.name for path in bench.project.directory.iterdir()} == {"data", "s.sav"}


@pytest.mark.parametrize(
    ("text", "message"),
    [("LOAD b.dat\nSAV a.py\n", "a.py is the script itself, and would be overwritten"),
     ("LOAD b.dat\nEXP ./a.py\n", "./a.py is the script itself, and would be overwritten"),
     ("LOAD b.dat\nEXP b.dat\n", "b.dat would overwrite the file that line 1 reads"),
     ("RES c.sav\nCYC 10\nSAV c.sav\n", "c.sav would overwrite the file that line 1 reads"),
     ("LOAD b.dat\nEXP link.py\n", "link.py would overwrite the script that runs"),
     ("RES d.sav\nSAV e.sav\nSAV e.sav\n", None), ("RES d.sav\nSAV e.sav\n", None)],
)  # fmt: skip
def test_zdem_scripts(tmp_path, text, message):
    for name in ("b.dat", "c.sav"):
        (tmp_path / name).write_text("1 2 3\n")
    (tmp_path / "a.py").write_text(text)
    os.symlink("a.py", tmp_path / "link.py")

    def check() -> None:
        execute.refuse_lost_files(parser.parse_text(text.encode(), str(tmp_path / "a.py")))

    if message is None:
        check()
        return
    with pytest.raises(ScriptError, match=message) as caught:
        check()
    assert caught.value.line == text.count("\n")


CURVES = "pcdc mesh structured (0,0) (1,1) cells 1 1\npcdc history create 'a' model value time\n" + CHART


@pytest.mark.some_of_each
@pytest.mark.parametrize("command", ["history export '{}.csv'", "chart export 'c' '{}.png'"])
@pytest.mark.parametrize("name", ["../x", "../../x", "a/../../x", "./../x"])
def test_results_stay_in_their_folder(bench, command, name):
    """Refused as the line is read, or carried out, where the name comes from Python; a whole path says where."""
    message = "lies outside the folder of the results; give an absolute path for another folder"
    with pytest.raises(ScriptError, match=message):
        check.read(f"pcdc {command.format(name)}\n", "script.sc")
    with pytest.raises(ScriptError, match=message):
        bench(f"{CURVES}name = '{name}'\npcdc {command.format('[name]')}\n")
    assert not list(bench.project.directory.parent.glob("**/x.*"))


@pytest.mark.some_of_each
@pytest.mark.parametrize("command", ["history export '{}.csv'", "chart export 'c' '{}.png'"])
@pytest.mark.parametrize("name", ["x", "more/and/x", "a/../x", "{folder}/elsewhere/x"])
def test_folders_of_results_are_made(bench, command, name):
    name = name.format(folder=bench.project.directory)
    bench(f"{CURVES}pcdc {command.format(name)}\n")
    assert (bench.project.outdir / os.path.normpath(name)).with_suffix(command[-5:-1]).exists()


@pytest.mark.parametrize("text", ["x = 1\nprint(x)\n", "BOX left 0 right 1\n", "import math\n", "pcdc model new\n"])
def test_the_name_says_that_it_is_pcdc(text):
    assert detect.kind(text, "a.sc") == "pcdc" == detect.kind(text, "dir.py/B.SC")


def test_an_empty_script_is_refused():
    with pytest.raises(ScriptError, match="there is no command"):
        detect.kind("\n", "a.sc")


DEEP = 100_000


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [("def f(n):\n    return f(n + 1)\n\nf(0)\n", 2, "RecursionError: maximum recursion depth exceeded"),
     ("def f(n):\n    pcdc model gravity (0,[n])\n    f(n + 1)\n\nf(0)\n", None, "RecursionError"),
     ("x = []\nfor i in range(100000):\n    x = [x]\n\npcdc model gravity [x]\n", 5, "RecursionError"),
     ("x = 1\ny = " + "-" * DEEP + "1\nz = 2\n", 2, "this is nested too deeply for Python"),
     ("x = 1\n\ny = x" + ".a" * DEEP + "\nz = 2\n", 3, "this is nested too deeply for Python"),
     ("x = 1\npcdc model gravity (0,[" + "-" * DEEP + "1])\n", 2, "is not an expression of Python")],
    ids=["function", "commands", "value", "signs", "attributes", "expression"],
)  # fmt: skip
def test_what_is_nested_too_deeply_has_a_line(bench, text, line, message):
    with pytest.raises(HpcdemError, match=message) as caught:
        bench(text)
    told = str(caught.value)
    assert told.startswith(f"script.sc:{line}: " if line else "script.sc:") and "Traceback" not in told


@pytest.mark.parametrize(
    ("words", "message"),
    [("structured (0,0) (1,1) cells 1000000 1000",
      r"cells 1000000 1000 would make about 2e\+09 elements, at most 2e\+07"),
     ("structured (0,0) (1,1) cells 3000 3000 diagonal both", r"would make about 3.6e\+07 elements"),
     ("structured (0,0) (1,1) cells 100000000000 1 type quad", r"would make about 1e\+11 elements"),
     ("equilateral (0,0) (1,1) size 1e-5", r"size 1e-05 would make about 2.3e\+10 elements"),
     ("equilateral (0,0) (1,1e-9) size 1e-12", "elements, at most"),
     ("equilateral (0,0) (1,1) size 1e-320", "size 9.99989e-321 would make about inf elements")],
)  # fmt: skip
def test_meshes_that_are_too_large_are_refused_before_they_are_made(bench, words, message):
    with pytest.raises(ScriptError, match=message):
        bench(f"pcdc mesh {words}\n")
    assert bench.project.mesh is None


OWN_LOOP = """
import time
pcdc mesh structured (0,0) (4,2) cells 4 2
print('looping', flush=True)
while True:
    time.sleep(0.05)
"""
COMMANDS = OWN_LOOP.replace("time.sleep(0.05)", "pcdc model gravity (0,-9.8)")
PARTICLES = "import hpcdem; hpcdem.Simulation().box(0, 1, 0, 1) #"


@pytest.mark.parametrize(
    ("name", "text", "code", "said"),
    [pytest.param("loop.sc", OWN_LOOP, 130, "in line 6 of loop.sc before the next command; nothing was saved",
                  marks=pytest.mark.slow),
     ("loop.sc", COMMANDS, 85, "stopped at step 0 by Ctrl-C; checkpoint data"),
     pytest.param("loop.py", OWN_LOOP.replace("pcdc mesh", PARTICLES), 130, "in line 6 of loop.py",
                  marks=pytest.mark.slow)],
    ids=["python", "commands", "program"],
)  # fmt: skip
def test_one_ctrl_c_ends_a_loop_of_the_script_itself(launch, tmp_path, name, text, code, said):
    (tmp_path / name).write_text(text)
    job = launch.start(1, name, "--no-figure", cwd=tmp_path)
    line = ""
    while "looping" not in line:
        line = job.stdout.readline()
        assert line, job.stderr.read()
    job.send_signal(signal.SIGINT)
    _, err = job.communicate(timeout=60)
    assert job.returncode == code and said in err
