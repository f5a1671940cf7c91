"""Commands on several ranks: all come to the same with the same values, or all stop with one message."""

from __future__ import annotations

import pytest

from tests.conftest import ROOT

pytestmark = pytest.mark.mpi
PROGRAM = ROOT / "tests" / "pcdc" / "on_ranks.py"
BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right\n"


@pytest.fixture
def ranks(launch, tmp_path):
    """`ranks(n, text)`: the script on n ranks of the fake simulation."""

    def run(n: int, text: str):
        (tmp_path / "script.sc").write_text(text)
        return launch.python(n, PROGRAM, tmp_path, cwd=tmp_path, timeout=600, env={"PYTHONPATH": str(ROOT)})

    return run


@pytest.mark.parametrize("n", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_script_runs_on_every_rank_and_speaks_once(ranks, tmp_path, n):
    text = (
        "import random\n" + BOX + "pcdc model gravity (0,[-9 - random.random()])\n"
        "pcdc history create 'load' node value reaction-y sum every 10 range y 2 2\n"
        "pcdc model step 30\npcdc history export 'h.csv'\npcdc chart create 'c'\npcdc chart add 'c' y 'load'\n"
        "pcdc chart export 'c' 'c.png'\nprint('done', pcdc.cycle)\n"
    )
    done = ranks(n, text)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("done 30") == 1
    assert (tmp_path / "data" / "h.csv").read_text().splitlines()[1:] == ["10,0.1,10.0", "20,0.2,10.0", "30,0.3,10.0"]
    assert (tmp_path / "data" / "history_load.csv").read_text().count("\n") == 4 and (
        tmp_path / "data" / "c.png"
    ).is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\npcdc model gravity (0,[pcdc.rank])\n",
         "script.sc:2: pcdc model gravity (0,[pcdc.rank]): its values differ between rank 0 and rank 1"),
        (BOX + "if pcdc.rank == 0:\n    print(len(pcdc.numbers('element')))\npcdc model step 1\n",
         "numbers element {}: rank 0 and rank 1 are at different commands (script.sc:"),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (
        ("if pcdc.rank == 0:\n    pcdc model gravity (0,1)\nelse:\n    pcdc model new\n",
         "rank 0 and rank 1 are at different commands (script.sc:2 and script.sc:4)"),
        ("if pcdc.rank == 1:\n    pcdc model new\n",
         "script.sc:2: pcdc model new: rank 0 and rank 1 are at different commands (the end of the script and"),
        ("pcdc model step [10 if pcdc.rank else -10]\n",
         "rank 0 and rank 1"),
        ("pcdc geometry delete 'x'\n", "there is no geometry layer 'x'"),
        )),
    ],
)  # fmt: skip
def test_ranks_that_go_different_ways_are_stopped(ranks, text, message):
    done = ranks(2, text)
    assert done.returncode == 2 and message in done.stderr
    assert done.stderr.count("script.sc:") <= 3


def test_an_error_of_python_on_one_rank_ends_all(ranks):
    done = ranks(2, BOX + "if pcdc.rank == 1:\n    x = [][1]\npcdc model step 5\n")
    assert done.returncode != 0 and "rank 1 of 2: " in done.stderr and "IndexError" in done.stderr
