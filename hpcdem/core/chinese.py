"""Messages in Chinese, beside their English, where the user's language is Chinese.

HPCDEM_LANG (zh, en) decides, else the first of LC_ALL, LC_MESSAGES, LANG that is set. The English message always stays:
it is what can be looked up; below it stands what it means in general, for the messages that are known here.

The log of a run, helps and reference pages have their Chinese from the catalogue `hpcdem/locale/zh` (gettext);
scripts/catalogue compiles it.
"""

from __future__ import annotations

import gettext
import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

LOCALE = Path(__file__).resolve().parent.parent / "locale"

MESSAGES: tuple[tuple[str, str], ...] = (
    (r"read (.+?)(?: at column \d+)?, expected a command(?:.*did you mean (\S+)\?)?", "{1} 不是命令{2:;是否想写 {}?}"),
    (r"read (.+?) (?:at|after) .+?, expected .+did you mean (\S+)\?", "{1} 不能识别;是否想写 {2}?"),
    (
        r"read (.+?)(?: at column (\d+))?, expected (.+?)(?: for (\S+?))?(?:;.*)?$",
        "读到 {1}{2:(第 {} 列)},此处需要:{3}",
    ),
    (
        r"the first command is (\S+); it must be START, RESTORE or LOAD",
        "第一条命令必须是 START、RESTORE 或 LOAD,而不是 {1}",
    ),
    (r"there is no time step yet|no time step: SET DT", "还没有时间步:请先用 SET DT 或 SET frac"),
    (r"'(.+)' lacks (.+)$", "{1} 缺少必需的参数:{2}"),
    (r"(\S+) missing;", "缺少 {1}"),
    (r"(\S+): no such script", "没有脚本文件 {1}"),
    (r"folder not found: (\S+)", "没有目录 {1}"),
    (r"there is no file (\S+)", "没有文件 {1}"),
    (r"cannot read (?:the script )?(\S+?):", "无法读取 {1}"),
    (r"cannot write (\S+?):", "无法写入 {1}"),
    (r"no space left on", "磁盘空间已满;腾出空间后可用 --resume 继续"),
    (r"(\d+) ranks are too many for this model.*at most (\d+) ranks fit", "进程数 {1} 太多:此模型最多用 {2} 个进程"),
    (r"rank 0 of 1", "各进程互不相识:启动器(mpiexec、srun)与 mpi4py 所用的 MPI 库不一致"),
    (r"mpi4py finds no MPI library", "找不到 MPI 库:用 pip 安装附加项 [mpi],或加载集群的 MPI 模块"),
    (r"over half its radius per step", "有颗粒一步移动超过半个半径:时间步太大,或颗粒生成时就重叠"),
    (r"(?:is|are) not finite|not a finite number", "出现非有限数(NaN 或无穷大)"),
    (r"have no density", "有可移动的颗粒没有密度:在最后一次 GEN 之后写 PROP density"),
    (r"have no contact law", "有颗粒没有接触参数:写 PROP shear、poiss、hertz,或 kn、ks"),
    (r"range selects no|RANGE selects no", "范围(range)没有选中任何对象"),
    (r"another run|is writing into", "另一个运行正在写同一个输出目录"),
    (r"is not an hpcdem checkpoint", "不是 hpcdem 的重启文件;ZDEM 的 .sav 不能读,请用 LOAD 读其 .dat 帧"),
    (r"stopped at step .* checkpoint|checkpoint .* --resume", "已存盘并停止;用 --resume 继续"),
    (r"no equilibrium|solve did not converge", "没有达到所要求的平衡"),
    (r"expected a time as HH:MM:SS", "时间应写成 HH:MM:SS,例如 11:30:00"),
    (r"is given twice|stands twice", "同一项写了两次"),
    (r"must be positive", "必须为正数"),
    (r"must not be negative", "不能为负数"),
    (r"interrupted", "已中断;没有存盘"),
    (r"No such option:? '?(-\S+?)'?[.]?(?: .*)?$", "没有选项 {1}"),
    (r"Missing argument", "缺少参数"),
    (r"Option '(\S+)' requires an argument", "选项 {1} 需要一个值"),
    (r"Got unexpected extra argument", "多余的参数"),
    (r"Invalid value for '(.+?)'", "{1} 的值不正确"),
)
"""Patterns of English messages, in the order in which they are tried, and their translations; {1}: text of a group,
{2:text {}}: text if the group is not empty."""


def wanted(environ: Mapping[str, str] | None = None, encoding: str | None = None) -> bool:
    """Return whether messages need a Chinese translation and the terminal can display it."""
    environ = os.environ if environ is None else environ
    names = ("HPCDEM_LANG", "LC_ALL", "LC_MESSAGES", "LANG")
    chosen = next((environ[name] for name in names if environ.get(name)), "")
    if not chosen.lower().startswith("zh"):
        return False
    try:
        "中".encode(encoding or getattr(sys.stderr, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


def meaning(message: str) -> str:
    """Translate a message into Chinese; "" if it is unknown."""
    for pattern, text in MESSAGES:
        if found := re.search(pattern, message, re.MULTILINE):
            return _filled(text, found)
    return ""


def beside(message: str) -> str:
    """A message with its meaning on a line below, where that is wanted and known."""
    text = meaning(message) if wanted() else ""
    return f"{message}\n        {text}" if text else message


@cache
def _catalogue() -> gettext.NullTranslations:
    return gettext.translation("hpcdem", LOCALE, ["zh"])


def known(context: str, text: str) -> str | None:
    """A text in Chinese, None where nobody has written it yet.

    Parameters
    ----------
    context : str
        Where it stands: "help", "program", "case", "log", "zdem command", "zdem keyword", "pcdc command", "pcdc model",
        "pcdc keyword", "pcdc default".
    text : str
        Its English; of commands, models and programs their name.
    """
    meant = _catalogue().pgettext(context, text)
    return None if meant == text else meant


def logged(text: str, encoding: str | None = None) -> str:
    """Return a text of the log of a run in Chinese where that is wanted; of warnings the English stays, as of errors."""
    if not wanted(encoding=encoding):
        return text
    meant = in_log(text)
    return f"{text}\n        {meant}" if text.startswith("warning") and meant != text else meant


def in_log(text: str) -> str:
    """Translate a text of the log, part by part; what is unknown stays."""
    if " | " in text:
        return " | ".join(map(in_log, text.split(" | ")))
    for pattern, meant in _forms():
        if found := pattern.fullmatch(text):
            return meant.format(*map(in_log, found.groups()))
    return text


@cache
def _forms() -> list[tuple[re.Pattern[str], str]]:
    """The forms of texts of the log in the catalogue (context "log"; {}: a value), those that say most first."""
    texts: dict[str, str] = getattr(_catalogue(), "_catalog")  # noqa: B009
    forms = [(key[4:].split("{}"), meant) for key, meant in texts.items() if key.startswith("log\4")]
    forms.sort(key=lambda one: -sum(map(len, one[0])))
    return [(re.compile("(.*?)".join(map(re.escape, words)), re.DOTALL), meant) for words, meant in forms]


def _filled(text: str, found: re.Match[str]) -> str:
    def put(hole: re.Match[str]) -> str:
        value = found[int(hole[1])]
        if hole[2] is None:
            return value or ""
        return hole[2].replace("{}", value) if value else ""

    return re.sub(r"\{(\d)(?::((?:[^{}]|\{\})*))?\}", put, text)
