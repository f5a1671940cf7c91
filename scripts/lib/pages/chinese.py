"""The Chinese reference pages of both languages.

Words, values, units and defaults are those of the tables, as on the English pages; what a command does comes from the
catalogue `hpcdem/locale/zh`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from hpcdem.core.chinese import known
from hpcdem.lang.pcdc.table import PCDC
from hpcdem.lang.zdem.table import COLORS, ZDEM, Option
from scripts.lib.pages import pcdc, zdem
from scripts.lib.pages.markdown import first_sentence, overview

_HEAD = """\
# {name} 命令

本页由 `hpcdem/lang/{package}/table.py` 和 `hpcdem/locale/zh` 生成,请勿直接修改
(`./scripts/pages`)。
命令和关键字的说明是中文;完整的英文说明见 [{name} commands]({package}_reference.md)。
"""

_ZDEM = """
## 脚本的读法

- 每行一个命令;除文件名外不分大小写。`( ) = ,` 和空格只作分隔。
- `# ! ;` 之后是注释,注释可用任何编码,其余为 UTF-8。
- 命令可缩写到三个字母,关键字可缩写到两个字母(不与本命令其他关键字混淆时)。
- 第一条命令是 START、RESTORE 或 LOAD;STOP 之后的内容被忽略。
- 单独一行 `friction = 0.3` 定义参数,以后在需要数的地方写 `{friction}`([参数扫描](sweep.zh.md))。
- 运行前先检查整个脚本;有错误时给出第一处错误的行号,不做任何计算。单位为 SI。
"""

_PCDC = """
## 脚本的读法

- 脚本是 Python,首词为 `pcdc` 的行是命令,循环和函数中也可以;命令续行用反斜杠,`#` 之后是注释。
- 运行前先检查全部命令和 Python;有错误时给出第一处错误的文件、行号和内容。`hpcdem --check script.sc` 只做这项检查。
- 花括号内的部分可以省略:`a{s}-l{ayer}` 可写成 `as-layer`、`a-l`;不分大小写。缩写有歧义时报错并列出候选。
- 值是数、引号内的文本、`on` 和 `off`、向量 `(x,y)`;方括号内是 Python 表达式:`[m_R/12]`、`'layer [i]'`。
- `<f>` 数,`<i>` 整数,`<s>` 文本,`<v>` 向量;可写 `table <s>` 处,值是时间的函数。
- 拉为正;对象编号从 0 开始;单位可用任何一致的单位制,表中为 SI。
"""


_IN_ROWS = {
    "| required |": "| 必需 |",
    "; also accepted: ": ";也可写作 ",
    "; may be repeated": ";可重复",
    " (**not supported yet**)": "(**尚不支持**)",
    "| all |": "| 全部 |",
    "| that of the law |": "| 由本构而定 |",
    "; joined particles keep theirs": ";所连颗粒保持各自的值",
}


def zdem_page() -> str:
    """All of docs/zdem_reference.zh.md."""
    parts = [
        _HEAD.format(name="ZDEM", package="zdem"),
        _ZDEM,
        _overview({c.name: _said("zdem command", c.name, c.doc) for c in ZDEM.commands}),
    ]
    for command in ZDEM.commands:
        lines = [
            f"## {command.name}",
            "",
            f"`{zdem._shortened(command)}`",
            "",
            _said("zdem command", command.name, command.doc),
            "",
            "```",
        ]
        lines += [*zdem._syntax(command), "```", ""]
        if not command.same_as:
            if command.options:
                lines += [_chinese(zdem._options(_meant(command.options))), ""]
            lines += ["例:", "", "```", *command.example, "```", ""]
        parts.append("\n".join(lines))
    parts += ["## RANGE\n\n写在行末,只对部分颗粒起作用;不写时对全部。各项用 `and`、`or` 连接,从左到右。\n"]
    parts += [_chinese(zdem._options(_meant(ZDEM.range_terms))), "\n## 颜色\n", "| 编号 | 名称 |", "|---|---|"]
    parts += [f"| {number} | {name} |" for name, number in COLORS.items()]
    return "\n".join(parts).rstrip("\n") + "\n"


def pcdc_page() -> str:
    """All of docs/pcdc_reference.zh.md."""
    parts = [
        _HEAD.format(name="PCDC", package="pcdc"),
        _PCDC,
        _overview({c.name: _said("pcdc command", c.name, c.doc) for c in PCDC.commands}),
    ]
    for command in PCDC.commands:
        lines = [
            f"## {command.name}",
            "",
            f"`pcdc {command.notation}`",
            "",
            _said("pcdc command", command.name, command.doc)
            + "".join(f"也可写作 `{words}`。" for words in command.also),
            "",
            "```",
        ]
        lines += [*pcdc._syntax(command), "```", ""]
        if command.leading or command.options:
            lines += [_chinese(pcdc._options(_meant_pcdc(command.options), _meant_pcdc(command.leading))), ""]
        if command.models:
            lines += ["模型:" + "、".join(f"[{m.keyword.name}](#{m.keyword.name})" for m in command.models) + "。", ""]
        lines += ["例:", "", "```", *command.example, "```", ""]
        parts.append("\n".join(lines))
    parts += ["## range\n\n写在行末,只对部分对象起作用;不写时对全部。各项必须同时满足;没有选中任何对象时报错。\n"]
    parts += [_chinese(pcdc._options(_meant_pcdc(PCDC.range_terms))), "\n## 模型和条件\n"]
    for command in PCDC.commands:
        for model in command.models:
            lines = [f"### {model.keyword.name}", "", f"`{model.notation}`(`pcdc {command.name}`)", ""]
            lines += [_said("pcdc model", model.keyword.name, model.doc), ""]
            if model.one_of:
                lines[-2] += "必需:" + ",或 ".join(" 和 ".join(names) for names in model.one_of) + "。"
            if model.options:
                lines += [_chinese(pcdc._options(_meant_pcdc(model.options))), ""]
            parts.append("\n".join(lines))
    parts += ["## 监测记录的量\n", _chinese(_last(pcdc._recorded()))]
    parts += [
        "\n## 三维\n\n`pcdc model new dim 3` 之后向量有三个分量,可用以下命令;除表中列出的以外,其关键字都可用;其余命令在运行前报错。\n",
        f"不可用的命令:{'、'.join(f'`{name}`' for name in pcdc.missing_in_space(PCDC))};此外不支持:"
        f"{'、'.join(pcdc.IN_THE_PLANE.values())}。\n",
    ]
    parts += [_chinese(_last(pcdc._dimensions(PCDC)))]
    return "\n".join(parts).rstrip("\n") + "\n"


def _said(context: str, name: str, doc: str) -> str:
    """In Chinese; the first sentence in English where nobody has written it yet."""
    return known(context, name) or first_sentence(doc) + "."


def _overview(texts: dict[str, str]) -> str:
    return "\n" + overview("全部命令", "| 命令 | 作用 |", texts)


def _meant(options: Sequence[Option]) -> list[Option]:
    """Keywords of ZDEM with their meanings in Chinese."""
    return [dataclasses.replace(option, doc=known("zdem keyword", option.doc) or option.doc) for option in options]


def _meant_pcdc(options: Sequence[pcdc.Option]) -> list[pcdc.Option]:
    """Keywords of PCDC, and those that belong to them, with their meanings and defaults in Chinese."""
    return [
        dataclasses.replace(
            option,
            doc=known("pcdc keyword", option.doc) or option.doc,
            default=known("pcdc default", option.default) or option.default,
            more=tuple(_meant_pcdc(option.more)),
        )
        for option in options
    ]


def _last(section: str) -> str:
    """The table that ends a section."""
    return section.rstrip("\n").rsplit("\n\n", 1)[1]


def _chinese(table: str) -> str:
    """A table of keywords with its head, and the words that its rows share, in Chinese."""
    head, *rows = table.split("\n")
    names = {
        "keyword": "关键字",
        "value": "值",
        "unit": "单位",
        "default": "默认",
        "meaning": "含义",
        "from": "来源",
        "object": "对象",
        "command": "命令",
        "models": "模型",
        "not available": "不可用的关键字",
        "in three dimensions only": "仅三维可用",
    }
    cells = [names[cell.strip()] for cell in head.strip("|").split("|")]
    for english, meant in _IN_ROWS.items():
        rows = [row.replace(english, meant) for row in rows]
    return "\n".join(["| " + " | ".join(cells) + " |", *rows])


PAGES: dict[str, Callable[[], str]] = {"zdem": zdem_page, "pcdc": pcdc_page}
