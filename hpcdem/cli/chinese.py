"""`--help` in Chinese, as far as the catalogue has it (core/chinese.py); the rest stays English."""

from __future__ import annotations

import inspect
import re

import click

from hpcdem.core.chinese import known

HEADS = {
    "Usage:": "用法:", "Options:": "选项:", "Stress and strain of a finished run:": "已完成运行的应力应变:",
    "[required]": "[必需]",
}  # fmt: skip
PARTLY = "(部分说明目前只有英文。)"
HAN = re.compile("[\u4e00-\u9fff]")


def in_chinese(text: str) -> str:
    """A text of a help in Chinese, or the text itself."""
    return known("help", text) or text


def translated(command: click.Command) -> click.Command:
    """The command with Chinese texts, as far as there are some; changed in place."""
    english = 0
    for parameter in command.params:
        if isinstance(parameter, click.Option) and parameter.help and not parameter.hidden:
            meant = known("help", parameter.help) or _of_a_case(parameter.help)
            english += not meant and not HAN.search(parameter.help)  # programs share some
            parameter.help = meant or parameter.help
    name = command.name or ""
    text = inspect.cleandoc(command.help or "")
    meant = known("program", name) or known("help", text)
    if not meant and (meant := _of_cases(text)):
        english += any(line.isascii() and line.strip("\b") for line in meant.splitlines())
    english += not meant
    command.help = meant or command.help
    if command.epilog:
        english += known("help", command.epilog) is None
        command.epilog = in_chinese(command.epilog)
    if english:
        command.epilog = f"{command.epilog or ''}\n\n{PARTLY}".strip()
    return command


def _of_a_case(text: str) -> str | None:
    """A parameter of a ready-made model, `What it is [default].`"""
    whole = re.fullmatch(r"(.+?)( \[[^\[]*\])?\.", text)
    meant = whole and (known("case", whole[1]) or known("case", whole[1][:1].lower() + whole[1][1:]))
    if not whole or not meant:
        return None
    default = {" [yes]": " [是]", " [no]": " [否]"}.get(whole[2] or "", whole[2] or "")
    return f"{meant}{default.replace(' degrees]', ' 度]')}。"


def _of_cases(text: str) -> str | None:
    """Texts of the programs of ready-made models, with their titles; None of other programs."""

    def line(found: re.Match[str]) -> str:
        title = known("case", found[2]) or known("help", found[2])
        return f"{found[1]}{title}{in_chinese(found[3] or '')}" if title else found[0]

    meant = text
    for pattern in (r"^()(.+?)(: write its script\.)?$", r"^(\S+ +)(.+?)()$"):  # a text, and a row of the list
        meant = re.sub(pattern, line, meant, flags=re.MULTILINE)
    return None if meant == text else meant


def help_page(command: click.Command, program: str) -> str:
    """The text that `--help` prints."""
    page = translated(command).get_help(click.Context(command, info_name=program, max_content_width=110))
    page = page.replace("Show this message and exit.", in_chinese("Show this message and exit."))
    for head, chinese in HEADS.items():
        page = re.sub(
            rf"^{re.escape(head)}" if head.endswith(":") else re.escape(head), chinese, page, flags=re.MULTILINE
        )
    return page
