"""The store of compiled kernels: one file per kernel and types of arguments, under a name that says what it is made of.

A file gets its name when it is whole and never changes its meaning, so any number of processes may read and write at
the same time, whatever ends them. A file that is damaged or belongs to somebody else counts as absent: the kernel is
compiled, and replaces it.
"""

from __future__ import annotations

import bisect
import contextlib
import hashlib
import itertools
import os
import pickle
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from hpcdem.runtime.launch import version

UNUSED_DAYS = 60
"""Kernels that were not used for this long are removed."""
_DIGEST = 32
"""Bytes of SHA-256, before what a file holds."""
_ROOM = 1 << 16
"""Bytes that a folder must take to be one for kernels."""
_PACKAGE = Path(__file__).absolute().parent.parent
_DAY = 86400.0


class Files:
    """Cache of a dispatcher of numba: a folder, and how the names of the kernel's files begin."""

    def __init__(self, place: Path, name: str) -> None:
        self.cache_path, self._place, self._name = str(place), place, name

    def path(self, signature: Any) -> Path | None:
        """Return where a kernel with these types of arguments is; None if the text of the types does not tell them
        apart."""
        text = str(signature)
        if " at 0x" in text:  # a function as argument
            return None
        return self._place / f"{self._name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.nbc"

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled kernel, None if it is not there."""
        from numba.core.compiler import CompileResult

        target.refresh()
        data = self._read(signature)
        try:
            return None if data is None else CompileResult._rebuild(target, *pickle.loads(data))
        except (ImportError, AttributeError):  # of a version in which a module or a class had another name or place
            return None

    def _read(self, signature: Any) -> bytes | None:
        path = self.path(signature)
        if path is None:
            return None
        try:
            with path.open("rb") as file:
                found = os.fstat(file.fileno())
                if hasattr(os, "getuid") and found.st_uid not in (os.getuid(), 0):
                    return None  # what is read here is executed
                data = file.read()
        except OSError:
            return None
        if hashlib.sha256(data[_DIGEST:]).digest() != data[:_DIGEST]:
            return None
        if time.time() - found.st_mtime > _DAY:
            with contextlib.suppress(OSError):
                os.utime(path)
        return data[_DIGEST:]

    def save_overload(self, signature: Any, found: Any) -> None:
        """Keep it, if that can be done: a full disk is no reason to stop."""
        from numba.core.serialize import dumps

        path = self.path(signature)
        if path is None or found.lifted or found.library.has_dynamic_globals:
            return
        data = dumps(found._reduce())
        try:
            write(path, hashlib.sha256(data).digest() + data)
        except OSError as error:
            unkept.append(error.strerror or str(error))

    def flush(self) -> None:
        """Forget what is kept: numba's `recompile`."""
        for path in self._place.glob(f"{self._name}-*"):
            path.unlink(missing_ok=True)


def write(path: Path, data: bytes) -> None:
    """Write a file that has its name only when it is whole."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


# -- kernels of hpcdem -----------------------------------------------------------------------------------------------

late: list[str] = []
"""Kernels that this process has compiled outside of a warm-up, which should have called them."""
unkept: list[str] = []
"""Why kernels that this process has compiled could not be kept, of each of them."""
_usual: Callable[[Any], None] | None = None
_warming = 0


class _OfPackage(Files):
    """Cache of a kernel of hpcdem: the folder belongs to its module and of all that this imports, as they are now."""

    def __init__(self, kernel: Any) -> None:
        function = kernel.py_func
        source = Path(function.__code__.co_filename)
        place = store()[0] / f"{source.stem}-{_digest(source)}"
        name = re.sub(r"[<>]", "", function.__qualname__)
        given = _sources_of(function) - _sources(source)  # a factory's module does not know its arguments
        digests = "".join(sorted(map(_digest, given)))
        made = hashlib.sha256((_made_of(function) + digests).encode()).hexdigest()[:8]
        super().__init__(place, f"{name}-{_line(source, function.__code__.co_firstlineno)}-{made}")

    def save_overload(self, signature: Any, found: Any) -> None:
        if not _warming:
            late.append(f"{found.fndesc.modname}.{found.fndesc.qualname}{signature}")
        super().save_overload(signature, found)


def _made_of(function: Any) -> str:
    """Return the code of a function and what its factory has put into it: values, and other kernels, whose text would
    be the place in memory."""
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    inner = [_made_of(cell.py_func) if hasattr(cell, "py_func") else repr(cell) for cell in cells]
    code = function.__code__
    line = _line(Path(code.co_filename), code.co_firstlineno)
    return repr((function.__qualname__, line, code.co_code.hex(), code.co_names, inner))


def _sources_of(function: Any) -> set[Path]:
    """Modules of it and of the kernels that the function that made it has put into it."""
    kernels = [cell.cell_contents for cell in function.__closure__ or () if hasattr(cell.cell_contents, "py_func")]
    inner = [_sources_of(kernel.py_func) for kernel in kernels]
    own = Path(function.__code__.co_filename)
    return ({own} if own.is_file() else set[Path]()).union(*inner)


@contextlib.contextmanager
def warming() -> Iterator[None]:
    """Do not count kernels that are compiled meanwhile as late."""
    global _warming
    _warming += 1
    try:
        yield
    finally:
        _warming -= 1


def install() -> None:
    """Take kernels of hpcdem from the store from now on and put new ones into it, also those imported already."""
    global _usual
    from numba.core.caching import FunctionCache
    from numba.core.dispatcher import Dispatcher

    from hpcdem.numerics.on_threads import OnThreads

    if _usual is None:
        name_kernels_apart()
        spare_c_entries()
        _usual = Dispatcher.enable_caching

        def enable_caching(kernel: Any) -> None:
            if kernel.py_func.__module__.startswith("hpcdem"):
                kernel._cache = _OfPackage(kernel)
            elif _usual is not None:
                _usual(kernel)

        patched: Any = Dispatcher
        patched.enable_caching = enable_caching
    store.cache_clear()
    for name, module in list(sys.modules.items()):
        if name.startswith("hpcdem"):
            things = vars(module).values()
            both = [kernel for thing in things if isinstance(thing, OnThreads) for kernel in (thing.one, thing.several)]
            kernels: list[Any] = [*both, *(thing for thing in things if isinstance(thing, Dispatcher))]
            for kernel in kernels:
                there = isinstance(kernel._cache, _OfPackage) and store()[0] in Path(kernel._cache.cache_path).parents
                if isinstance(kernel._cache, FunctionCache | _OfPackage) and not there:
                    kernel.enable_caching()


def has(kernel: Any, types: tuple[Any, ...]) -> bool:
    """Return whether a kernel with these types of arguments is in the store."""
    path = kernel._cache.path(types) if isinstance(kernel._cache, Files) else None
    return path is not None and path.is_file()


_WORDS = re.compile(r'\n[ \t]*(?:r?"""(?:[^"]|"(?!""))*"""|#[^\n]*)(?=\n)|  #[^"\'\n]*(?=\n)|\n(?=\n)')
"""Docstrings, comments and blank lines, which change no kernel. A test compares the rest with what Python parses."""


@cache
def _code(source: Path) -> tuple[str, list[int]]:
    """Return the text of a module without its docstrings, comments and blank lines, and the numbers of these lines."""
    text = "\n" + source.read_text(encoding="utf-8")
    omitted: list[int] = []
    line, at = 1, 0
    for words in _WORDS.finditer(text):
        line += text.count("\n", at, words.start())
        at = words.start()
        omitted += range(line, line + words[0].count("\n"))
    return _WORDS.sub("", text), omitted


def _line(source: Path, line: int) -> int:
    """Return the number of a line among those of `_code`; of what was typed, the line itself."""
    return line - bisect.bisect_left(_code(source)[1], line) if source.is_file() else line


@cache
def _digest(source: Path) -> str:
    """Return a digest of a module and of all modules that its first column imports: kernels take functions and
    constants from them, and numba does not see when these change."""
    digest = hashlib.sha256(_code(source)[0].encode())
    for name in _reached(source):
        digest.update(_code(_PACKAGE / name)[0].encode())
    return digest.hexdigest()[:12]


@cache
def _sources(source: Path) -> frozenset[Path]:
    """Return the files from which the digest of a module is computed."""
    return frozenset({source, *(_PACKAGE / name for name in _reached(source))})


@cache
def _reached(source: Path) -> list[str]:
    """The modules of hpcdem that a module imports in its first column, and those that these import."""
    wanted = sorted(_imported(_code(source)[0]) & _files(), key=_parts)
    for name in wanted:
        wanted += sorted((_imported(_code(_PACKAGE / name)[0]) & _files()).difference(wanted), key=_parts)
    return wanted


def _parts(name: str) -> list[str]:
    return name.split("/")


@cache
def _files() -> frozenset[str]:
    """The modules of hpcdem, as `engine/model.py`."""
    found = []
    for folder, _, names in os.walk(_PACKAGE):
        inner = os.path.relpath(folder, _PACKAGE).replace(os.sep, "/")
        found += [name if inner == "." else f"{inner}/{name}" for name in names if name.endswith(".py")]
    return frozenset(found)


def _imported(text: str) -> set[str]:
    """Modules that the statements ``from hpcdem.a import b`` in the first column may mean."""
    found = set()
    for module, names in re.findall(r"^from (hpcdem[\w.]*) import (\([^)]*\)|.*)$", text, re.MULTILINE):
        folder = "/".join(module.split(".")[1:])
        for one in (folder, *(f"{folder}/{name}".lstrip("/") for name in re.findall(r"\w+", names))):
            found |= {f"{one}.py", f"{one}/__init__.py".lstrip("/")}
    return found


@cache
def sources() -> str:
    """A digest of all modules of hpcdem that decide which kernels there are."""
    digest = hashlib.sha256()
    for name, text in deciding().items():
        digest.update(name.encode() + b"\0" + text.encode())
    return digest.hexdigest()[:12]


def deciding() -> dict[str, str]:
    """Return the code of the modules of hpcdem with kernels, of all that these import, and of those that call them with
    types of their choice."""
    texts = {name: _code(_PACKAGE / name)[0] for name in _files()}
    indented = re.compile(r"^[ \t]+from ", re.MULTILINE)
    imports = {name: _imported(indented.sub("from ", text)) & texts.keys() for name, text in texts.items()}
    kernels = {name for name, text in texts.items() if _COMPILES.search(text)}
    found, wanted = set(kernels), list(kernels)
    while wanted:
        more = imports[wanted.pop()] - found
        found |= more
        wanted += more
    callers = {name for name, used in imports.items() if used & kernels}
    warm_ups = {name for name in texts if name.endswith("warm_up.py")}
    return {name: texts[name] for name in sorted(found | callers | warm_ups, key=_parts)}


_COMPILES = re.compile(r"^\s*from numba import .*njit", re.MULTILINE)


def name_kernels_apart() -> None:
    """See to it that kernels of this process have names of their own in object code.

    numba counts the functions that a process compiles, and tells functions of the same qualified name and types, such
    as two closures of one factory, apart by that number alone. Of two of the same name that were compiled by different
    processes the linker takes one for both.
    """
    from numba.core.bytecode import FunctionIdentity

    counter: Any = FunctionIdentity
    counter._unique_ids = itertools.count(int.from_bytes(os.urandom(7), "little"))


def spare_c_entries() -> None:
    """Make kernels without the entry for programs in C that numba gives each of them, and nobody calls here: a
    fourteenth of the time of compiling."""
    from numba.core.compiler import Flags

    option: Any = Flags.options["no_cfunc_wrapper"]
    option._default = True


# -- where the store is ------------------------------------------------------------------------------------------------


@cache
def store() -> tuple[Path, bool]:
    """The folder of this process; False with it if it had to go to the temporary folder."""
    return store_of(os.environ)


def store_of(environ: Mapping[str, str]) -> tuple[Path, bool]:
    """The folder for this machine type, compiler and user; False with it if it had to go to the temporary folder."""
    base = cache_base(environ)
    return (base / compiler(), True) if can_write(base) else (temporary_base() / compiler(), False)


def cache_base(environ: Mapping[str, str] = os.environ) -> Path:
    """NUMBA_CACHE_DIR if set, else the user's cache folder."""
    given = environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given).absolute()
    return Path(environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hpcdem"


def can_write(base: Path) -> bool:
    """Return whether files can be made in the folder, which is made first."""
    try:
        base.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=base, buffering=0) as file:
            return file.write(bytes(_ROOM)) == _ROOM  # a full disk, and a quota that is used up, take a name only
    except OSError:
        return False


def temporary_base() -> Path:
    """A folder on this host that is ours alone: what is read from the store is executed."""
    if hasattr(os, "getuid"):
        mine = Path(tempfile.gettempdir()) / f"hpcdem-{os.getuid()}"
        with contextlib.suppress(OSError):
            mine.mkdir(mode=0o700, exist_ok=True)
            found = mine.lstat()
            if found.st_uid == os.getuid() and found.st_mode & 0o170077 == 0o040000 and can_write(mine):
                return mine
    return Path(tempfile.mkdtemp(prefix="hpcdem-"))


def compiler() -> str:
    """Name of the folder: all that compiled code depends on besides its source."""
    import llvmlite.binding as llvm
    import numba

    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k in COMPILER_SETTINGS)
    all_of_it = (sys.version_info[:2], llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten(), settings)
    digest = hashlib.sha256(repr(all_of_it).encode()).hexdigest()[:12]
    return f"kernels-numba{numba.__version__}-{llvm.get_host_cpu_name()}-{digest}"


COMPILER_SETTINGS = frozenset(
    f"NUMBA_{name}"
    for name in ("DISABLE_INTEL_SVML", "CPU_NAME", "CPU_FEATURES", "OPT", "BOUNDSCHECK", "THREADING_LAYER")
)
"""Variables that change the code numba makes, or the library it calls, without numba's cache seeing it."""


def tidy(base: Path) -> None:
    """Remove kernels that nobody has used for two months, what killed processes left, and folders of earlier versions
    of hpcdem that kept kernels in another way."""
    now = time.time()

    def unused(path: Path) -> float:
        with contextlib.suppress(OSError):
            return (now - path.stat().st_mtime) / _DAY
        return 0.0

    for folder in base.glob("*-numba*"):
        if folder.name.startswith("kernels-"):
            for path in [path for path in folder.rglob("*") if path.is_file()]:
                if unused(path) > (1 if path.name.startswith(".") else UNUSED_DAYS):
                    path.unlink(missing_ok=True)
            for inner in [inner for inner in folder.rglob("*") if inner.is_dir() and unused(inner) > 1]:
                with contextlib.suppress(OSError):
                    inner.rmdir()
        elif unused(folder) > (1 if ".building-" in folder.name else UNUSED_DAYS):
            shutil.rmtree(folder, ignore_errors=True)


# -- kernels that are made of a function of the user ----------------------------------------------------------------


def folder(*made_of: str) -> Path:
    """Return the folder of the kernels that are made of these texts by this version on this type of machine. numba
    keeps a kernel by the place of its source, and those that are made of other kernels not at all; here who asks says
    what it is made of."""
    digest = hashlib.sha256(repr((version(), sources(), made_of)).encode()).hexdigest()
    return store()[0] / f"user-{digest[:32]}"


def knows(place: Path, name: str) -> bool:
    """Return whether a kernel of this name is kept."""
    return any(place.glob(f"{name}-*"))


def keep(kernel: Any, place: Path, name: str) -> None:
    """Take a kernel that has not been compiled yet from this folder from now on, or store it there."""
    name_kernels_apart()
    kernel._cache = Files(place, name)
