"""What comes from a file is data: nothing in it is executed, and none of it can stall the program."""

from __future__ import annotations

import ast
import re
import time
from collections.abc import Iterator

import pytest

from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.lang.zdem.lexer import Token, expression, number
from hpcdem.lang.zdem.parser import parse_text
from tests.conftest import ROOT, sources
from tests.tables import each

PACKAGE = ROOT / "hpcdem"

# -- the source of the package -------------------------------------------------------------------------------------

MODULES = frozenset("pickle cPickle dill cloudpickle joblib shelve marshal yaml code codeop pty".split())
"""What can be loaded with these is code; or they run it."""
BUILTINS = frozenset(("eval", "exec", "compile", "__import__"))
CALLS = frozenset(
    "os.system os.popen os.execv os.execve os.execvp os.execl os.spawnv os.spawnl os.posix_spawn "
    "importlib.import_module importlib.__import__ runpy.run_path runpy.run_module pandas.read_pickle torch.load "
    "joblib.load tempfile.mktemp ctypes.CDLL ctypes.cdll.LoadLibrary xml.etree.ElementTree.parse tarfile.open "
    "zipfile.ZipFile shutil.unpack_archive".split()
)
PROCESSES = frozenset(f"subprocess.{name}" for name in ("run", "Popen", "call", "check_call", "check_output"))

KNOWN = {
    # Ranks of one job tell each other Python objects; no file has a part in it.
    ("halo/comm.py", "import pickle"),
    ("halo/shared.py", "import pickle"),
    # The user's own program, `hpcdem study.py`.
    ("cli/run.py", "exec"),
    ("cli/run.py", "compile"),
    # The user's own script in the language PCDC, `hpcdem blast.sc`, and what he types into the console. The functions
    # that model restore brings back are checked to be plain defs (lang/pcdc/names.py), which do nothing when made.
    ("lang/pcdc/execute.py", "exec"),
    ("lang/pcdc/execute.py", "compile"),
    ("lang/pcdc/check.py", "compile"),
    ("lang/pcdc/console.py", "import codeop"),
    # Laws in a Python file that the user's own script names; files of data never do (physics/user_files.py).
    ("physics/user_files.py", "exec"),
    ("physics/user_files.py", "compile"),
    # The console that `hpcdem view --run` was asked for: what the user types there, behind the key of the page.
    ("page/desk.py", "subprocess.Popen"),
    # Modules of this package, by names from its own tables.
    ("__init__.py", "importlib.import_module"),
    ("lang/pcdc/bindings.py", "importlib.import_module"),
    ("cases/__init__.py", "importlib.import_module"),
    ("cli/__init__.py", "importlib.import_module"),
    ("commands/dem/__init__.py", "importlib.import_module"),
    ("commands/fdem/__init__.py", "importlib.import_module"),
    ("session.py", "importlib.import_module"),
    ("physics/fields.py", "importlib.import_module"),
    # The packages that hpcdem needs, for the doctor.
    ("runtime/doctor/software.py", "importlib.import_module"),
    # libgomp.so.1, by that name, where the system finds it.
    ("runtime/launch.py", "ctypes.CDLL"),
    # This process itself, for a function of the C library that is in it.
    ("core/heap.py", "ctypes.CDLL"),
    # Written, not read.
    ("page/maker.py", "zipfile.ZipFile"),
    # This Python with a module of this package; requests reach it as JSON in a pipe.
    ("page/worker.py", "subprocess.Popen"),
    # This Python with a module of this package; sbatch with a job script that was just written. Of a sweep's folder
    # only the name of the script is taken, which is the user's own.
    ("sweep/driver.py", "subprocess.Popen"),
    ("sweep/member.py", "subprocess.Popen"),
    ("sweep/array.py", "subprocess.run"),
    # Gmsh, with a description as JSON; it answers with arrays of numbers in a file of a folder made for that.
    ("pre/mesh/apart.py", "subprocess.run"),
    # The same to compile kernels; what is pickled goes from the parent to its child through a pipe.
    ("runtime/compilers.py", "subprocess.Popen"),
    ("runtime/compilers.py", "import pickle"),
    ("pre/mesh/apart.py", "import pickle"),  # from the parent to its child, in a folder of this user alone
    ("runtime/kernels.py", "import pickle"),
    # Compiled laws of the user in his own cache folder, beside the kernels of hpcdem; the
    # name of a folder follows from the law that the script has just named.
    ("runtime/kept.py", "import pickle"),
    # Programs with a list of words, never through a shell; the first is this one, for another set of kernels.
    ("cli/__init__.py", "subprocess.run"),
    ("post/movie.py", "subprocess.Popen"),
    ("runtime/stop_requests.py", "subprocess.run"),
    ("runtime/doctor/machine.py", "subprocess.run"),
}
"""The only places where something is executed, and what."""


def names_of(tree: ast.AST) -> dict[str, str]:
    """What the names of a module stand for: `np` for numpy, `load` for numpy.load, wherever they are imported."""
    found: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                first = alias.name.split(".")[0]
                found[alias.asname or first] = alias.name if alias.asname else first
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                found[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    return found


def full_name(node: ast.AST, names: dict[str, str]) -> str:
    """`numpy.load` for `np.load`; empty for what is no name with dots."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join([names.get(node.id, node.id), *reversed(parts)])


def dangers(source: str) -> Iterator[str]:
    """What a module does that could execute what it reads."""
    tree = ast.parse(source)
    names = names_of(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (f"import {a.name}" for a in node.names if a.name.split(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in MODULES:
            yield f"import {node.module}"
        elif isinstance(node, (ast.Name, ast.Attribute)):
            name = full_name(node, names)
            # Not only when it is called: a function can be handed on.
            if name in CALLS or name in PROCESSES or (isinstance(node, ast.Name) and name in BUILTINS):
                yield name
        if isinstance(node, ast.Call):
            name = full_name(node.func, names)
            given = {k.arg: k.value for k in node.keywords}
            allowed = given.get("allow_pickle")
            if allowed is not None and not (isinstance(allowed, ast.Constant) and allowed.value is False):
                yield f"{name}(allow_pickle=)"
            if name == "numpy.load" and allowed is None:
                yield "numpy.load"  # what it allows by default has changed before
            if "shell" in given and not (isinstance(given["shell"], ast.Constant) and given["shell"].value is False):
                yield f"{name}(shell=)"
            if None in given and name in PROCESSES:
                yield f"{name}(**)"


def test_nothing_in_the_package_executes_what_it_reads():
    names = {name.rpartition(".")[2] for name in (*MODULES, *BUILTINS, *CALLS, *PROCESSES)}
    words = re.compile(rf"\b({'|'.join(names)}|allow_pickle|shell)\b")  # without one of them nothing is found
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    found = {
        (str(path.relative_to(PACKAGE)), what)
        for path, text in texts.items()
        if words.search(text)
        for what in dangers(text)
    }
    assert found - KNOWN == set(), "not known to be harmless"
    assert KNOWN - found == set(), "no longer there: take it off the list"


@pytest.mark.parametrize(
    ("source", "what"),
    [
        ("import pickle", "import pickle"),
        ("def f():\n    from pickle import loads", "import pickle"),
        ("import yaml as y", "import yaml"),
        ("eval(text)", "eval"),
        ("run = exec", "exec"),
        ("import numpy as np\nnp.load(f, allow_pickle=True)", "numpy.load(allow_pickle=)"),
        ("import numpy as np\nnp.load(f, allow_pickle=wanted)", "numpy.load(allow_pickle=)"),
        ("from numpy import load\nload(f)", "numpy.load"),
        ("import subprocess as s\ns.run('ls', shell=True)", "subprocess.run(shell=)"),
        ("from subprocess import run\nrun('ls', shell=yes)", "subprocess.run(shell=)"),
        ("from os import system as go\ngo('ls')", "os.system"),
        ("import importlib\nload = importlib.import_module", "importlib.import_module"),
        ("import subprocess\nsubprocess.run(words, **how)", "subprocess.run(**)"),
    ],
)
def test_the_search_finds_what_it_should(source, what):
    assert what in set(dangers(source))


@pytest.mark.parametrize(
    "source",
    [
        "import numpy as np\nnp.load(f, allow_pickle=False)",
        "import re\nre.compile('a')",
        "import json\njson.loads(text)",
        "h5py.File(path)",
        "self.eval(x)",
    ],
)
def test_the_search_leaves_the_harmless_alone(source):
    assert not set(dangers(source))


def import_module_names(source: str) -> Iterator[ast.AST]:
    tree = ast.parse(source)
    names = names_of(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and full_name(node.func, names) == "importlib.import_module":
            yield node.args[0]


def test_modules_are_loaded_by_names_of_this_package():
    """`import_module` gets f"hpcdem...." or a row of a table of the module, never a word as it was read.

    The doctor also loads packages: those it names and those that installed packages declare to need.
    """
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    for path in [path for path, text in texts.items() if "import_module" in text]:
        for given in import_module_names(texts[path]):
            if isinstance(given, ast.JoinedStr):
                first = given.values[0]
                assert isinstance(first, ast.Constant) and str(first.value).startswith("hpcdem."), path
            elif isinstance(given, ast.Constant):
                assert str(given.value).startswith("hpcdem."), path
            elif path != PACKAGE / "runtime/doctor/software.py":
                assert isinstance(given, ast.Subscript) and ast.unparse(given.value) == "_NAMES", path


# -- expressions ---------------------------------------------------------------------------------------------------

MILLION = 10**6
MANY = 10**5
"""Operators of an expression that has a value: ten times as many take ten times as long."""
HOSTILE = {
    "a power": "{top}**9",
    "a power of powers": "9**9**9**9",
    "an import": "__import__('os').system('true')",
    "an import in braces": "{__import__('os')}",
    "an attribute": "{top.__class__}",
    "a format": "{top!r:>1000000}",
    "a call": "{top}+open('/etc/passwd')",
    "a lambda": "{lambda:0}",
    "a million braces": "{" * MILLION,
    "a million pairs of braces": "{" * MILLION + "top" + "}" * MILLION,
    "a brace that does not end": "{" + "t" * MILLION,
    "a million signs": "-" * MILLION + "{top}",
    "an infinite number": "{top}+1e999",
    "a number with a huge exponent": "{top}+1e" + "9" * MILLION,
    "a number with a million digits": "{top}*" + "9" * MILLION,
    "hexadecimal": "{top}+0xff",
    "underscores": "{top}+1_000",
    "other digits": "{top}+\u0661\u0662",
    "nothing a number is": "{top}+nan",
    "a surrogate": "{\udc80}",
}


@each("name", HOSTILE)
def test_hostile_expressions_are_refused_at_once(name):
    began = time.process_time()
    with pytest.raises(ScriptError) as caught:
        expression(Token(HOSTILE[name], 3, 1), "push.py")
    assert time.process_time() - began < 2.0
    message = str(caught.value)
    assert message.startswith("push.py:3: read ") and len(message) < 600 and "\n" not in message


def test_a_million_brackets_are_separators():
    """Brackets only separate words in this language: nothing is nested, so nothing can be nested too deep."""
    began = time.process_time()
    script = parse_text("START\nDEL RANGE y " + "(" * MILLION + "0 {top}" + ")" * MILLION, "push.py")
    assert time.process_time() - began < 10.0
    assert script.statements[-1].command == "DEL"


EXTENTS = {"left": 0.0, "right": 10.0, "bottom": 0.0, "top": 5.0}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("{top}" + "+1" * MANY, 5.0 + MANY),
        ("{top}" + "*1" * MANY, 5.0),
        ("{top}+0." + "0" * MILLION + "1", 5.0),
        ("{top}+1e-" + "9" * MILLION, 5.0),
    ],
    ids=["sum", "product", "digits", "exponent"],
)
def test_a_long_expression_has_a_value(text, value):
    began = time.process_time()
    assert expression(Token(text, 1, 1), "push.py").value(EXTENTS) == value
    assert time.process_time() - began < 2.0


@pytest.mark.parametrize(
    "text",
    ["{top}" + "*9e99" * 10, "1" + "/{left}" * MANY, "{left}/{left}" + "+0" * MANY],
    ids=["overflow", "zeros", "zero by zero"],
)
def test_values_that_do_not_exist_are_reported_in_a_short_line(text):
    with pytest.raises(CommandError) as caught:
        expression(Token(text, 1, 1), "push.py").value(EXTENTS)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    "text", ["9" * MILLION, "1e" + "9" * MILLION, "0." + "0" * MILLION + "1"], ids=["whole", "exponent", "zeros"]
)
def test_plain_numbers_of_a_million_digits(text):
    began = time.process_time()
    number(Token(text, 1, 1))
    assert time.process_time() - began < 2.0


@pytest.mark.parametrize(
    "line",
    ["CYC " + "9" * MILLION, "SET DT 1e" + "9" * MILLION, "GEN num 1e400 rad discrete 1 x 0 9 y 0 9", "CYC 1e300"],
    ids=["steps", "exponent", "infinite", "large"],
)
def test_huge_numbers_in_a_script_are_refused_in_a_short_line(line):
    with pytest.raises(ScriptError) as caught:
        parse_text(f"START\nSET DT 1\n{line}\n", "push.py")
    assert len(str(caught.value)) < 600


def test_no_file_of_the_project_is_a_pickle():
    """Nor is there any data file that would have to be one."""
    files = sources(".")
    assert len(files) > 1000 and not [p for p in files if p.suffix in (".pkl", ".pickle", ".joblib", ".npy")]
