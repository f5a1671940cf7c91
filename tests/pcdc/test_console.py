"""The console: lines as they are typed."""

from __future__ import annotations

import pytest

from hpcdem.lang.pcdc.complete import candidates
from hpcdem.lang.pcdc.console import Console


def talk(bench, *lines: str) -> list[str]:
    """What the console says to these lines."""
    rest, said, prompts = list(lines), [], []

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        if not rest:
            raise EOFError
        return rest.pop(0)

    Console(bench.interpreter, ask, said.append).run()
    talk.prompts = prompts  # type: ignore[attr-defined]
    return said[1:]


def test_commands_and_python(bench, capsys):
    said = talk(bench, "m_a = 3", "pcdc geom create polyline (0,0) ([m_a],1) as-layer 'x'", "m_a + 1", "")
    assert bench.project.layers["x"][0].points.tolist() == [[0, 0], [3, 1]]
    assert capsys.readouterr().out == "4\n" and said == [""]


def test_blocks_of_lines(bench):
    talk(bench, "for i in range(3):", "    pcdc geometry create point ([i],0) as-layer 'p[i]'", "", "m_b = 1")
    assert list(bench.project.layers) == ["p0", "p1", "p2"] and bench["m_b"] == 1
    assert talk.prompts == ["pcdc> ", "  ... ", "  ... ", "pcdc> ", "pcdc> "]  # type: ignore[attr-defined]


def test_functions_and_continued_commands(bench):
    talk(bench, "def m_f(x):", "    pcdc geometry create point ([x],0) \\", "        as-layer 'p'", "", "m_f(4)",
         "pcdc geometry create point (1,1) \\", "as-layer 'q'", "pcdc model save 'a.sav'")  # fmt: skip
    assert bench.project.layers["p"][0].points.tolist() == [[4, 0]] and "q" in bench.project.layers
    assert (bench.project.directory / "a.sav").exists()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("pcdc modle new", "console 1:1: pcdc modle new: read 'modle'"),
        ("pcdc geometry delete 'x'", "console 1:1: pcdc geometry delete 'x': there is no geometry layer 'x'"),
        ("x = (", "'(' was never closed"),
        ("x = = 1", "console 1:1: x = = 1: this is not correct Python"),
        ("1 / 0", "ZeroDivisionError"),
        ("pcdc model step [y]", "NameError: name 'y' is not defined"),
    ],
)
def test_the_conversation_continues_after_an_error(bench, line, message):
    rest = ["", ")" if line.endswith("(") else "", "m_c = 7"] if line.endswith("(") else ["m_c = 7"]
    said = talk(bench, line, *rest)
    assert bench["m_c"] == 7
    if not line.endswith("("):
        assert message in said[0]


def test_exit_ends(bench):
    said = talk(bench, "exit()", "m_never = 1")
    assert "m_never" not in bench.interpreter.namespace and said == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("pcdc mod", "model"),
        ("pcdc model s", "save step solve solve-check sub-step scale"),
        ("pcdc geom cr p", "polyline polygon polyline-close point plane"),
        ("pcdc model option dynamic ", "on off true false yes no"),
        ("pcdc element c-model null ", "property relax range"),
        ("pcdc element-face c-model contact-m-c property p-n 1 p", "penalty-normal penalty-shear"),
        ("pcdc mesh create from-layer 'a' refine-layer 'b' ", "size distance"),
        ("pcdc node group 'a' range g", "group geometry geometry-along geometry-distance geometry-location"),
        (
            "pcdc history create 'h' ",
            "node element joint bolt-node bolt-element flow-node flow-channel well liner-node liner-element model",
        ),
        ("pcdc element group ", ""),
        ("pcdc nothing ", ""),
        ("pcdc model restore 'a", ""),
    ],
)
def test_completion(line, words):
    assert candidates(line) == words.split()
