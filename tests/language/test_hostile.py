"""Bad scripts: each gives exactly one message with its line, and nothing else happens."""

from __future__ import annotations

import io
import json

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import EXIT_USAGE, HpcdemError, ScriptError, UsageError
from hpcdem.lang import detect
from hpcdem.lang.zdem.execute import Interpreter
from hpcdem.lang.zdem.parser import parse_text, read_script
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.runtime.progress import Log
from tests.language.hostile import BEFORE, BEGIN, BOX, COORDINATES, LINES, RUNS, SCRIPTS, spoiled
from tests.tables import each


def error_of(source):
    with pytest.raises(ScriptError) as caught:
        parse_text(source, "push.py")
    return caught.value


@each(("line", "message"), LINES, ids=[f"{i}:{line[:30]!a}" for i, (line, _) in enumerate(LINES)])
@each("end", ["\n", "\r\n"])
def test_bad_lines(line, message, end):
    error = error_of((BEFORE + line + "\nCYC 1\nSTOP\n").replace("\n", end))
    assert message in error.message
    assert error.line == BEFORE.count("\n") + 1
    assert str(error) == f"push.py:{error.line}: {error.message}"
    assert "\n" not in str(error) and len(str(error)) < 600
    assert error.exit_code == EXIT_USAGE


@each(("source", "line", "message"), SCRIPTS)
def test_bad_scripts(source, line, message):
    error = error_of(source)
    assert (error.line, message in error.message) == (line, True), str(error)


def test_the_first_wrong_line_is_reported():
    assert error_of(BEFORE + "foo\nbar\n").line == 5


VALID = [line for line in BEFORE.splitlines()[2:]] + [
    "BOX left 0.0 right 41000.0 bottom 0.0 height 11000.0 kn=0e10 ks=0e10 fric 0.0",
    "GEN NUM 100000 rad discrete 60.0 80.0 x (10.0 40000.0) y (10.0 10000.0) COLOR black GROUP ball",
    "PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7 RANGE P4 (0 0) (1 0) (1 1) (0 1) and group ball",
    "IMPLE wall id 1 xmove 100.0 save 20.0 print 10.0",
    "SET GRAVITY 0.0 -9.8",
]


@pytest.mark.parametrize("line", VALID)
def test_every_word_replaced_by_nonsense_is_found(line):
    """Whatever word is spoilt, the message is about that line; names may be anything."""
    words = line.split()
    for at in range(len(words)):
        spoilt = " ".join([*words[:at], "qqq,,qqq", *words[at + 1 :]])
        error = error_of(BEFORE + spoilt + "\n")
        assert error.line == 5, spoilt


@pytest.mark.parametrize("line", VALID)
def test_every_line_cut_short_is_found_or_complete(line):
    words = line.split()
    for n in range(1, len(words)):
        try:
            parse_text(BEFORE + " ".join(words[:n]), "push.py")
        except ScriptError as error:
            assert error.line == 5


# ---- in a folder with results of an earlier run --------------------------------------------------------------------

GOOD = (
    f"START\nSET gravity 0 -1\n{BOX}BALL id 1 x 5 y 5 rad 1\nBALL id 2 x 9 y 5 rad 1\nPROP density 1 kn 1\n"
    "WALL id 4 nodes 0 0 9 0\nHIST id 7 interval 9 step\n"
)


@pytest.fixture(scope="module")
def good_checkpoint(tmp_path_factory) -> bytes:
    """A restart file that is whole."""
    folder = tmp_path_factory.mktemp("good")
    Interpreter(parse_text(GOOD + "SAV good.sav", str(folder / "a.py"))).run(Simulation(outdir=folder / "data"))
    return (folder / "good.sav").read_bytes()


@pytest.fixture
def workplace(tmp_path, good_checkpoint):
    """A folder in which somebody has worked before."""
    data, folder = tmp_path / "data", tmp_path / "folder"
    data.mkdir()
    folder.mkdir()
    for name in ("all_0000000000_ini.dat", "all_0000000100.vtkhdf", "0000000100.sav", "hist_7.dat", "walls.csv"):
        (data / name).write_text(f"{name} of an earlier run\n")
    (folder / "notes").write_text("a folder that is no file\n")
    (tmp_path / "file.txt").write_text("a file that is no folder\n")
    (tmp_path / "good.dat").write_text("1 2 1\n5 2 1\n")
    (tmp_path / "good.sav").write_bytes(good_checkpoint)
    return tmp_path


def contents(folder) -> dict[str, bytes | None]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def run_as_the_program_does(path, comm=None):
    """The way of a script from its bytes to its end."""
    source = path.read_bytes()
    assert detect.kind(source, str(path)) == "zdem"
    comm = comm or SerialComm()
    sim = Simulation(comm, 1, path.parent / "data", Log(comm.rank, io.StringIO()))
    try:
        Interpreter(parse_text(source, str(path))).run(sim)
    finally:
        sim.release()


def refused(workplace, source: str | bytes, expected: str, line: int | None = None) -> HpcdemError:
    """The script is refused in one line that names its file and line, and no file has changed."""
    path = workplace / "script.py"
    path.write_bytes(source if isinstance(source, bytes) else source.encode())
    before = contents(workplace)
    with pytest.raises(HpcdemError) as caught:
        run_as_the_program_does(path)
    message = str(caught.value)
    assert contents(workplace) == before
    assert expected in message and "\n" not in message and len(message) < 900
    assert message.isprintable()
    wanted = line if line is not None else source.rstrip().count(b"\n" if isinstance(source, bytes) else "\n") + 1
    assert message.startswith(f"{path}:{wanted}: ")
    assert caught.value.exit_code != 0
    return caught.value


def line_of(source: str, message: str) -> int:
    """Where the command that the message begins with stands last in the script."""
    word = message.split(":")[0].lower()[:3]
    return max((n for n, text in enumerate(source.split("\n"), 1) if text.lower().startswith(word)), default=0)


@pytest.mark.parametrize(("source", "message"), RUNS, ids=[f"{i}:{m[:30]}" for i, (_, m) in enumerate(RUNS)])
def test_scripts_that_cannot_be_carried_out(workplace, source, message):
    command = message.split(":")[0]
    line = line_of(source, message) if command.isupper() else None
    refused(workplace, source, message, line)


@each("name", COORDINATES)
def test_files_that_are_no_coordinates(workplace, name):
    (workplace / "bad.dat").write_bytes(COORDINATES[name])
    for before, line in (("", 1), ("START\n", 2)):
        refused(workplace, before + "LOAD bad.dat\nSET dt 1\nCYC 1\n", "LOAD: ", line)


SPOILED = list(spoiled(b"SNOD" + bytes(200)))


@pytest.mark.parametrize("name", SPOILED)
def test_files_that_are_no_checkpoint(workplace, good_checkpoint, name):
    (workplace / "bad.sav").write_bytes(spoiled(good_checkpoint)[name])
    refused(workplace, "RES bad.sav\nSET dt 1\nCYC 1\n", "RESTORE: ", 1)


def test_frames_and_scripts_are_no_checkpoint(workplace):
    (workplace / "frame.py").write_text("START\nSET dt 1\nCYC 0\n")
    run_as_the_program_does(workplace / "frame.py")
    refused(workplace, "RES all_0000000000_ini.vtkhdf\n", "is not an hpcdem checkpoint", 1)
    refused(workplace, "RES all_0000000000_ini.dat\n", "RESTORE: ", 1)
    refused(workplace, "RES frame.py\n", "RESTORE: ", 1)


@pytest.mark.parametrize(
    ("name", "message"),
    [("absent.py", "absent.py"), ("folder", "folder"), ("file.txt/a.py", "a.py"), ("a" * 300, "aaa"), ("a\0b", "a")],
)
def test_scripts_that_cannot_be_read(workplace, name, message):
    with pytest.raises(UsageError, match="cannot read the script") as caught:
        read_script(workplace / name)
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "source",
    [
        b"\xef\xbb\xbfSTART\nSET DT 1\n",
        b"START\rSET DT 1\r",
        b"START\r\nSET DT 1\r\n",
        b"\n\n  START  # x\n\tSET\tDT\t1",
        b"START\nSET DT 1",
        b"start # \xc9\xfa\nSET DT 1\n",
        b"START\n\n\n\nSET DT 1\nSTOP\n\x00\xff garbage",
    ],
)
def test_odd_but_good(workplace, source):
    """Byte order mark, any ends of lines, blanks, comments in another encoding, anything after STOP."""
    path = workplace / "script.py"
    path.write_bytes(source)
    run_as_the_program_does(path)
    assert [s.command for s in read_script(path).statements][:2] == ["START", "SET"]


def test_a_full_box_ends_well(workplace):
    """It is told (see test_rules), and is no error: the manual's scripts ask for far more than fits."""
    path = workplace / "script.py"
    path.write_text(BEGIN + "GEN grid rad discrete 1 x 0 20 y 0 20\nGEN num 100 rad discrete 1 x 0 20 y 0 20\nSTOP\n")
    run_as_the_program_does(path)


def test_there_are_enough_of_them():
    """Scripts and files that are refused, each another way; those with other ends of lines not counted."""
    collection = {*[line for line, _ in LINES], *[source for source, *_ in SCRIPTS], *[source for source, _ in RUNS]}
    assert len(collection) == len(LINES) + len(SCRIPTS) + len(RUNS), "none stands there twice"
    assert len(collection) + len(COORDINATES) + len(SPOILED) >= 300


# ---- through the program -------------------------------------------------------------------------------------------

ON_RANKS = """
import json, sys
from pathlib import Path
from hpcdem.runtime import kept, launch, shutdown
launch.prepare_environment(1)
kept.install()
comm = launch.start_mpi()
sys.path[:0] = [{root!r}, {here!r}]
from test_hostile import run_as_the_program_does

def work():
    told = []
    for number, source in enumerate(json.loads(Path("sources.json").read_text())):
        path = Path(f"script_{{number}}.py")
        if comm.rank == 0:
            path.write_text(source)
        comm.barrier()
        try:
            run_as_the_program_does(path, comm)
            said = "nothing"
        except Exception as error:
            said = f"{{type(error).__name__}} {{error}}"
        told.append(comm.allgather(said))
    if comm.rank == 0:
        Path("told.json").write_text(json.dumps(told))

shutdown.leave(shutdown.run_together(comm, work))
"""


@pytest.mark.mpi
def test_two_ranks_refuse_alike(workplace, launch, request):
    """What is found out in mid-run is found out by both, and neither waits for the other."""
    (workplace / "sources.json").write_text(json.dumps([source for source, _ in RUNS]))
    here = request.path.parent
    (workplace / "ranks.py").write_text(ON_RANKS.format(root=str(here.parent.parent), here=str(here)))
    done = launch.python(2, "ranks.py", cwd=workplace, timeout=120)
    assert done.returncode == 0, done.stderr
    told = json.loads((workplace / "told.json").read_text())
    for (_, message), (first, second) in zip(RUNS, told, strict=True):
        assert first == second and message in first


@pytest.mark.some_of_each
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
@pytest.mark.parametrize(
    ("source", "message"),
    [(BEFORE + "CYC many\n", "script.py:5: CYC: read 'many'"), ("", "script.py:1: there is no command"),
     (b"\x7fELF\x02\x00", "script.py:1: "), ("RES absent.sav", "script.py:1: RESTORE: there is no file"),
     (BEGIN + "CYC 0\nEXP folder", "script.py:4: EXP: folder is a folder")],
)  # fmt: skip
def test_a_sample_through_the_program(workplace, launch, source, message, ranks):
    (workplace / "script.py").write_bytes(source if isinstance(source, bytes) else source.encode())
    before = contents(workplace)
    done = launch(ranks, "script.py", cwd=workplace, timeout=120)
    assert done.returncode == EXIT_USAGE
    assert done.stderr.count(message) == 1 and "Traceback" not in done.stdout + done.stderr
    assert contents(workplace) == before
