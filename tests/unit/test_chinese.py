"""Help and messages in Chinese: where the language asks for it, beside the English, and only what is there in English."""

from __future__ import annotations

import ast
import gettext
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from hpcdem.cases import CASES, find
from hpcdem.cli import case
from hpcdem.cli import chinese as helps
from hpcdem.cli.programs import FIRST, GROUPS
from hpcdem.core import chinese
from scripts.lib.pages.options import PROGRAMS
from tests import catalogue

HAN = re.compile("[\u4e00-\u9fff]")
PACKAGE = Path(chinese.__file__).parents[1]


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({"LANG": "zh_CN.UTF-8"}, True), ({"LANG": "en_US.UTF-8"}, False), ({}, False),
        ({"LANG": "zh_CN.UTF-8", "LC_ALL": "C.UTF-8"}, False), ({"LANG": "C", "HPCDEM_LANG": "zh"}, True),
        ({"LANG": "zh_CN.UTF-8", "HPCDEM_LANG": "en"}, False), ({"LC_MESSAGES": "zh_TW.UTF-8", "LANG": "C"}, True),
    ],
)  # fmt: skip
def test_the_language_is_that_of_the_user(environ: dict[str, str], expected: bool) -> None:
    assert chinese.wanted(environ, "utf-8") is expected
    assert not chinese.wanted(environ, "latin-1"), "a terminal that cannot show it"


MEANT = {
    "hpcdem: a.py:2: read 'PROPP' at column 1, expected a command; did you mean 'PROP'?": "'PROPP' 不是命令;是否想写 'PROP'?",
    "hpcdem: a.py:2: read 'CYCLE2', expected a command": "'CYCLE2' 不是命令",
    "hpcdem: a.py:2: PROP: read '-1' at column 11, expected a number not below 0 for fric":
    "读到 '-1'(第 11 列),此处需要:a number not below 0",
    "hpcdem: a.sc:1: pcdc model neww: read 'neww' after 'model', expected one of new, save; did you mean 'new'?":
    "'neww' 不能识别;是否想写 'new'?",
    "hpcdem: a.py:2: CYC: there is no time step yet; use SET DT or SET frac": "还没有时间步:请先用 SET DT 或 SET frac",
    "hpcdem: 40 ranks are too many for this model: its width ... is 23, so at most 23 ranks fit": "进程数 40 太多:此模型最多用 23 个进程",
    "No such option '--nope'. (Did you mean one of: '--xmove'?)": "没有选项 --nope",
}  # fmt: skip


@pytest.mark.parametrize("message", MEANT)
def test_what_messages_mean(message: str) -> None:
    assert chinese.meaning(message) == MEANT[message]


def test_unknown_messages_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chinese, "wanted", lambda: True)
    assert chinese.beside("hpcdem: something else") == "hpcdem: something else"
    assert chinese.beside("hpcdem: x.py: no such script") == "hpcdem: x.py: no such script\n        没有脚本文件 x.py"


def test_every_text_is_that_of_an_option_that_is_there() -> None:
    """English that has changed would leave its Chinese behind."""
    there = set()
    for command in PROGRAMS.values():
        there |= {p.help for p in command.params if isinstance(p, click.Option)}
        there |= {command.epilog, inspect.cleandoc(command.help or "")}
    there |= {*GROUPS, *(one.line for group in GROUPS.values() for one in group)}
    there |= {FIRST, "Show this message and exit.", ": write its script.", "Write the script of a ready-made model."}
    assert not set(catalogue.of("help")) - there
    assert set(catalogue.of("program")) <= {command.name for command in PROGRAMS.values()}
    assert all(HAN.search(text) for text in catalogue.of("help", "program").values())


def test_programs_read_what_the_catalogue_says() -> None:
    """Each entry once, and the compiled file is that of the written one."""
    there = catalogue.entries()
    compiled = gettext.translation("hpcdem", chinese.LOCALE, ["zh"])
    wrong = [text for context, text, meant in there if compiled.pgettext(context, text) != meant]
    assert not wrong, "run scripts/catalogue"
    assert len({(context, text) for context, text, _ in there}) == len(there) == len(compiled._catalog) - 1


def program(*words: str, **environ: str) -> subprocess.CompletedProcess[str]:
    env = {k: v for k, v in os.environ.items() if k not in ("LC_ALL", "LC_MESSAGES", "LANG", "HPCDEM_LANG")}
    env |= {"PYTHONUTF8": "1", **environ}
    return subprocess.run(
        [sys.executable, "-m", "hpcdem", *words], env=env, capture_output=True, text=True, encoding="utf-8", check=False
    )


def test_help_and_errors_of_the_program(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("START\nPROPP fric 1\n")
    script = str(tmp_path / "a.py")
    shown = program("--help", LANG="zh_CN.UTF-8")
    assert (
        shown.returncode == 0
        and shown.stdout.startswith("用法: hpcdem")
        and "从此脚本最新的重启文件继续" in shown.stdout
    )
    assert helps.PARTLY not in shown.stdout and "Stress" not in shown.stdout
    failed = program("--check", script, LANG="zh_CN.UTF-8")
    assert failed.returncode == 2
    english, meant = failed.stderr.strip().splitlines()
    assert "read 'PROPP' at column 1, expected a command" in english and meant.strip().startswith("'PROPP' 不是命令")
    usual = program("--check", script, LANG="zh_CN.UTF-8", HPCDEM_LANG="en")
    assert usual.stderr.strip() == english and not HAN.search(usual.stderr)


def test_help_that_is_translated_in_part_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    page = helps.help_page(case.command(find("ucs")), "hpcdem case ucs")
    assert helps.PARTLY not in page and "用法:" in page and "岩样单轴压缩:写出其脚本。" in page
    assert "--friction X              节理和裂纹的摩擦角 [30 度]。" in page and "钢压板" in page and "[是]" in page
    assert helps.PARTLY not in helps.help_page(case.listing([]), "hpcdem case")
    title = find("slope").title
    monkeypatch.setattr(helps, "known", lambda *of: None if of[1] in ("density", title) else chinese.known(*of))
    page = helps.help_page(case.command(find("ucs")), "hpcdem case ucs")
    assert helps.PARTLY in page and "Density [2700 kg/m3]." in page
    page = helps.help_page(case.listing([]), "hpcdem case")
    assert helps.PARTLY in page and title in page


def test_nearly_all_of_the_ready_made_models_is_in_chinese() -> None:
    """A new one may wait for its own."""
    there = {str(field.description) for name in CASES for field in find(name).model_fields.values()}
    there |= {find(name).title for name in CASES}
    texts = catalogue.of("case")
    assert set(texts) <= there | {"The script; - prints it", "Replace an existing file"}
    assert len(texts) >= 0.9 * len(there)
    assert all(HAN.search(text) for text in texts.values())


def test_list_of_ready_made_models() -> None:
    assert "ucs          岩样单轴压缩\n" in program("case", LANG="zh_CN.UTF-8").stdout
    assert "ucs          Uniaxial compression" in program("case", LANG="en_US.UTF-8").stdout


def test_nearly_all_options_have_their_chinese() -> None:
    """A new one may wait for its own."""
    there = {p.help for command in PROGRAMS.values() for p in command.params
             if isinstance(p, click.Option) and p.help and not p.hidden}  # fmt: skip
    texts = catalogue.of("help")
    waiting = there - set(texts) - set(texts.values())
    assert len(waiting) < 0.1 * len(there), waiting


# --- the log of a run ----------------------------------------------------------------------------------------------

OF_RUNS = ("commands", "engine", "lang", "physics", "runtime", "session.py", "api")
"""Folders whose texts a run writes into its log. Other programs (cli, post, sweep) print English."""
NO_WORDS = {
    "{}: {}", "{}{}", "{}; {}", "  {}", "{}", "{}:{}: {}", "{} {}s: {}", "SECTION {}: {}",
    "{} | {} in {}, {} element-steps/s", "{} | {} steps/s, {} element-steps/s{}",
}  # fmt: skip
"""Forms that consist of values: their parts are translated."""


def forms_of_log() -> dict[str, str]:
    """Texts that runs give to their log, with {} for values, and the file and line of each."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.relative_to(PACKAGE).parts[0] not in OF_RUNS:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and "log" in ast.unparse(node.func):
                at = {"info": 0, "warn": 0, "warn_once": 1}.get(node.func.attr)
                form = None if at is None or len(node.args) <= at else form_of(node.args[at])
                if form is not None:
                    found[form] = f"{path.relative_to(PACKAGE)}:{node.lineno}"
    return found


def form_of(node: ast.expr) -> str | None:
    """The text of a literal, None for anything else."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)  # type: ignore[misc]
    return None


def test_every_text_of_the_log_has_its_chinese() -> None:
    """A text that is new or was changed needs an entry of context "log" in locale/zh (then run scripts/catalogue)."""
    forms = forms_of_log()
    assert len(forms) > 100
    waiting = {form: at for form, at in forms.items() if form not in NO_WORDS
               and not HAN.search(chinese.in_log(form.replace("{}", "7")))}  # fmt: skip
    assert not waiting
    assert all(HAN.search(meant) for meant in catalogue.of("log").values())


def test_the_log_of_a_run_in_chinese(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(
        "START\nSET dt 0.01\nBALL id 1 x 5 y 5 rad 1\nPROP density 1000\nPROP fric 0.1 RANGE group nobody\nCYC 3\nSTOP\n"
    )
    words = "--no-figure", "--outdir", str(tmp_path / "data"), str(tmp_path / "a.py")
    shown = program(*words, LANG="zh_CN.UTF-8").stdout
    assert "1 进程 x 1 线程,主机 " in shown and "第 6 行:CYC,3 步\n" in shown and "颗粒 1,接触 0,胶结 0\n" in shown
    assert "warning: no particle has ever been in group nobody\n        警告:从来没有颗粒属于组 nobody\n" in shown
    assert "3 步,用时 " in shown
    assert not HAN.search(program(*words, LANG="C.UTF-8").stdout)
