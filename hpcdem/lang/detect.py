"""Detects the kind of a script. All kinds end in .py, so the content decides; .sc is always PCDC."""

from __future__ import annotations

import ast
import re
import warnings

from hpcdem.core.errors import ScriptError
from hpcdem.lang.zdem.lexer import COMMENT, LINE_END, SEPARATORS
from hpcdem.lang.zdem.table import ZDEM

_UTF_16 = (b"\xff\xfe", b"\xfe\xff")

_PCDC_LINE = re.compile(rb"^[ \t]*pcdc[ \t]+[A-Za-z]", re.MULTILINE)
_PYTHON_LINE = re.compile(
    rb"""^[ \t]*( import[ \t]+\w | from[ \t]+\S+[ \t]+import\b | (def|class)[ \t] | (for|while|if|with)\b.*:
                 | print[ \t]*\( | \w+[ \t]*=[^=] )""",
    re.MULTILINE | re.VERBOSE,
)


def kind(source: bytes | str, file: str = "script") -> str:
    """ "zdem" (ZDEM commands), "pcdc" (``pcdc`` commands among Python, and the contents of any file *.sc) or "python"
    (Python that imports something).

    ScriptError, with the line that gave it away, for what is none of these. That a script is of a kind does not mean
    that it is correct.
    """
    if isinstance(source, str):
        source = source.encode("utf-8", errors="surrogatepass")
    if source.startswith(_UTF_16):
        raise ScriptError(file, 1, "the file is UTF-16 text; save it as UTF-8")
    source = source.removeprefix(b"\xef\xbb\xbf")
    firsts = _first_words(source)
    if firsts and file.lower().endswith(".sc"):
        return "pcdc"
    tree, trouble = _python(source)
    if tree is not None and any(isinstance(node, (ast.Import, ast.ImportFrom)) for node in ast.walk(tree)):
        return "python"
    if _PCDC_LINE.search(source):
        return "pcdc"
    if not firsts:
        raise ScriptError(file, 1, "there is no command in the script")
    commands = sum(ZDEM.command(word) is not None for _, word in firsts)
    if ZDEM.command(firsts[0][1]) is not None or 2 * commands > len(firsts):
        return "zdem"
    line, word = firsts[0]
    if _PYTHON_LINE.search(source):
        if trouble is not None:
            line = trouble.lineno or line
            raise ScriptError(file, line, f"this is not correct Python: {trouble.msg}")
        raise ScriptError(file, line, "this Python script imports nothing; it must import hpcdem")
    shown = "".join(char if char.isprintable() else "?" for char in word[:40])
    raise ScriptError(
        file,
        line,
        f"'{shown}' is not the beginning of a script: neither a ZDEM command{ZDEM.hint(word)}, nor a pcdc command, nor "
        "Python",
    )


def _python(source: bytes) -> tuple[ast.Module | None, SyntaxError | None]:
    """The syntax tree, or what is wrong with it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return ast.parse(source), None
        except SyntaxError as error:
            return None, error
        except (ValueError, RecursionError, MemoryError):
            return None, None


def _first_words(source: bytes) -> list[tuple[int, str]]:
    """Line number and first word of every line that has any, in lower case, read as ZDEM reads them."""
    blanks = bytes.maketrans(SEPARATORS.encode(), b" " * len(SEPARATORS))
    firsts = []
    for number, raw in enumerate(LINE_END.split(source), start=1):
        words = COMMENT.split(raw, maxsplit=1)[0].translate(blanks).split(maxsplit=1)
        if words:
            firsts.append((number, words[0].decode("utf-8", errors="replace").lower()))
    return firsts
