"""The compiled kernels: where numba keeps them, and who compiles when.

A kernel is compiled once per machine type and read by everyone else. numba's own cache folder is not safe when
several processes fill it at the same time (two of them may number different kernels alike), so a folder is filled
under a private name and then renamed; a folder with its final name is complete. Folders that already have their
final name are only read: a kernel that is missing there is compiled by each process that needs it, for itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import pickle
import re
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from hpcdem.runtime import cgroups, launch
from hpcdem.runtime.compilers import Part, compile_in_processes, name_kernels_apart, spare_c_entries
from hpcdem.runtime.launch import patient_barrier, version

if TYPE_CHECKING:
    from hpcdem.halo.comm import SerialComm
    from hpcdem.runtime.progress import Log

BUILDING = ".building-"
UNUSED_DAYS = 60


KERNELS = {
    "shared": 33, "": 100, "energy": 17, "clumps": 14, "blocks": 195, "coupled": 17, "bolts": 12, "liners": 11,
    "flow": 20, "flow-space": 7, "proppant": 12, "proppant-space": 3, "heat": 22, "heat-space": 8, "yielding": 45,
    "creep": 32, "tangent": 10, "plastic-tangent": 6, "space": 76, "yielding-space": 20, "creep-space": 19,
    "tangent-space": 12, "hexes": 27, "yielding-hexes": 16, "creep-hexes": 10, "joints-hexes": 12, "pictures": 5,
    "restitution": 4,
}  # fmt: skip
"""About how many kernels a folder of each kind has."""
QUIET_SECONDS = 5.0
"""Between two lines on how far compiling has come."""
PROCESSES = 8
"""At most so many compile at the same time: the kernel that takes longest takes a fifth of the time of all."""
MEMORY = 700e6
"""Of one of them, at most [bytes]."""
FEW = 20
"""So many kernels are compiled in less time than it takes to start processes for them."""


def prepare_kernels(comm: SerialComm, log: Log, warm_ups: Mapping[str, Callable[[], None]]) -> Path:
    """Collective: load or compile kernels, those of one kind after those of another; returns the last cache folder of
    this rank. warm_ups: by kind, what calls all of its kernels once, a function that can be pickled; each kind has a
    folder of its own. Rank 0 says how far it is.

    Must run before any module with kernels is imported: numba settles the folder of a kernel when it meets it. When
    a folder has still to be filled, one rank of each machine type goes first, then one of each host, then the rest,
    so that nothing is compiled twice on a shared file system and each local disk gets its copy. Who fills a folder does
    so with processes on the cores of all ranks of its host, which wait.
    """
    folder, writable = cache_folder()
    folders = {folder.with_name(f"{folder.name}-{kind}") if kind else folder: kind for kind in warm_ups}
    progress = _Progress(log, {folder: KERNELS.get(kind, 0) for folder, kind in folders.items()})
    if comm.rank == 0 and progress.total:
        threaded = os.environ.get("NUMBA_NUM_THREADS", "1") != "1"
        log.info(
            f"compiling about {progress.total} kernels{' for several threads' if threaded else ''} (first run of this "
            f"version on this machine{'; runs with one thread, -j 1, have their own' if threaded else ''})"
        )
    ready = all(folder.is_dir() for folder in folders)
    ranks = comm.allgather((socket.gethostname(), folder.name, ready, launch.mask()))
    host, key, *_ = ranks[comm.rank]
    turn = 0 if all(ready for _, _, ready, _ in ranks) else turn_of([rank[:2] for rank in ranks], comm.rank)

    parts = {folder: warm_ups[kind] for folder, kind in folders.items()}
    cores = frozenset().union(*(rank[3] for rank in ranks if rank[0] == host))
    damaged, problem = False, ""
    for now in range(3):
        if now == turn:
            problem = _compile_beside(parts, cores, progress)
            with progress.told():
                damaged = not all([load_kernels(*part) for part in parts.items()])
            _loaded.update(parts)
        patient_barrier(comm)

    if comm.any(not writable):
        log.warn(f"the kernel cache under {cache_base()} cannot be written; using {folder}. NUMBA_CACHE_DIR moves it")
    if problem := next(filter(None, comm.allgather(problem)), ""):
        log.warn(f"processes that compiled kernels failed, so one went on alone ({problem})")
    if comm.any(damaged):
        log.warn("the kernel cache was damaged: kernels were compiled for this run only, the next run fills it again")
    if comm.rank == 0:
        for one in folders:
            tidy(one)
    return list(folders)[-1]


def turn_of(ranks: Sequence[tuple[str, str]], rank: int) -> int:
    """When a rank compiles, 0 to 2: first one of each machine type, then one of each host, then the rest. ranks: host
    and machine type of each."""
    host, key = ranks[rank]
    if next(r for r, one in enumerate(ranks) if one[1] == key) == rank:
        return 0
    return 1 if next(r for r, one in enumerate(ranks) if one[0] == host) == rank else 2


class _Progress:
    """Says from time to time how many of so many kernels are compiled, and how long the others may take.

    total: of all kinds that are missing now.
    """

    def __init__(self, log: Log, kernels: Mapping[Path, int]):
        self.log = log
        self.kernels = {folder: count for folder, count in kernels.items() if not folder.is_dir()}
        self.total = sum(self.kernels.values())
        self.began = self.last = time.monotonic()

    def tell(self) -> None:
        """Unless it has just done so."""
        now = time.monotonic()
        if now - self.last < QUIET_SECONDS:
            return
        self.last = now
        places = (folder if folder.is_dir() else private(folder) for folder in self.kernels)
        done = sum(len(list(place.rglob("*.nbc"))) for place in places)
        if 0 < done < self.total:
            left = (now - self.began) / done * (self.total - done)
            self.log.info(f"{done} of about {self.total} kernels are compiled, some {math.ceil(left)} s left")

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """While this process compiles."""
        from numba.core import event

        class Listener(event.Listener):
            def on_start(listener, _: event.Event) -> None:
                """Nothing: kernels that are called by others are compiled within these."""

            def on_end(listener, _: event.Event) -> None:
                self.tell()

        with event.install_listener("numba:compile", Listener()) if self.total else contextlib.nullcontext():
            yield


def _compile_beside(parts: Mapping[Path, Callable[[], None]], cores: frozenset[int], progress: _Progress) -> str:
    """Fill the missing folders with several processes, if that is worth while; what went wrong, if anything."""
    missing = {folder for folder in parts if not folder.is_dir()}
    quota, memory = cgroups.cpu_quota(Path("/")), cgroups.memory(Path("/"))
    limits = (quota, memory and memory / MEMORY)
    count = int(min(len(cores), PROCESSES, *(round(limit) for limit in limits if limit is not None)))
    if count < 2 or sum(progress.kernels.get(folder, 0) for folder in missing) <= FEW:
        return ""
    all_parts = [
        Part(private(folder) if folder in missing else folder, warm, folder in missing)
        for folder, warm in (_loaded | dict(parts)).items()
    ]
    try:
        return compile_in_processes(all_parts, count, cores, progress.tell)
    except (OSError, pickle.PicklingError, AttributeError) as error:  # no more processes; a warm-up of a closure
        return f"{type(error).__name__}: {error}"


_loaded: dict[Path, Callable[[], None]] = {}
"""The folders that this process has settled, with their warm-ups."""


def private(folder: Path) -> Path:
    """Where this process fills a folder."""
    return folder.with_name(f"{folder.name}{BUILDING}{socket.gethostname()}-{os.getpid()}")


def load_kernels(folder: Path, warm: Callable[[], None]) -> bool:
    """Run `warm` with the folder if it is there, else fill it; False if the cache had to be given up."""
    import numba

    building = None if folder.is_dir() else private(folder)
    numba.config.CACHE_DIR = str(building or folder)  # type: ignore[attr-defined]
    (_only_read.add if building is None else _only_read.discard)(building or folder)
    try:
        count = len(late)
        name_kernels_apart()
        spare_c_entries()
        _protect_complete_folders()
        warm()
        if building is not None:
            del late[count:]  # of other folders, within those that are compiled for this one
    except Exception:
        # numba passes on whatever a damaged file makes pickle or LLVM say. If it is no cache error it comes again.
        give_up_cache()
        shutil.rmtree(building or folder, ignore_errors=True)
        warm()
        return False
    if building is not None and building.is_dir():
        with contextlib.suppress(OSError):  # another job was faster
            building.rename(folder)
        shutil.rmtree(building, ignore_errors=True)
        numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
        _only_read.update((building, folder))  # the kernels of this process still have it under its first name
    return True


def keep_here(modules: Sequence[ModuleType]) -> None:
    """Kernels of these modules belong to the folder that is set now, even if they were imported with others before."""
    from numba.core.caching import FunctionCache
    from numba.core.dispatcher import Dispatcher

    for module in modules:
        for thing in vars(module).values():
            if isinstance(thing, Dispatcher) and thing.py_func.__module__ == module.__name__:
                if isinstance(thing._cache, FunctionCache):  # type: ignore[attr-defined]
                    thing.enable_caching()  # type: ignore[attr-defined]


late: list[str] = []
"""Kernels that this process has compiled for itself, as they were not in their folder: a warm-up lacks them."""
_only_read: set[Path] = set()
_plain_save: Any = None


def _protect_complete_folders() -> None:
    """See to it that numba writes nothing into complete folders: neither now, when kernels that are compiled have those
    of other folders in them, nor later, when many processes may do so at the same time. A warm-up that compiles with
    its folder complete is late as well: its kernels were imported before their folder was known."""
    global _plain_save
    from numba.core.caching import FunctionCache

    if _plain_save is None:
        _plain_save = FunctionCache.save_overload

    def save(cache: Any, signature: Any, kernel: Any) -> None:
        if _only_read.isdisjoint(Path(cache.cache_path).parents):
            _plain_save(cache, signature, kernel)
        else:
            late.append(f"{kernel.fndesc.modname}.{kernel.fndesc.qualname}{signature}")

    FunctionCache.save_overload = save  # type: ignore[method-assign]


def give_up_cache() -> None:
    """No kernel of hpcdem reads or writes the disk any more in this process."""
    from numba.core.dispatcher import Dispatcher

    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "hpcdem":
            for thing in vars(module).values():
                if isinstance(thing, Dispatcher):
                    thing._cache.disable()  # type: ignore[attr-defined]


# -- the folder ------------------------------------------------------------------------------------------------


def cache_folder(environ: Mapping[str, str] = os.environ) -> tuple[Path, bool]:
    """The folder for this version, machine type and user; False with it if it had to go to the temporary folder."""
    key = cache_key()
    base = cache_base(environ)
    if can_write(base):
        return base / key, True
    return temporary_base() / key, False


def cache_base(environ: Mapping[str, str] = os.environ) -> Path:
    """NUMBA_CACHE_DIR if set, else the user's cache folder."""
    given = environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given).absolute()
    return Path(environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hpcdem"


def can_write(base: Path) -> bool:
    """Whether files can be made in the folder, which is made first."""
    try:
        base.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=base):
            return True
    except OSError:
        return False


def temporary_base() -> Path:
    """A folder on this host that is ours alone: numba executes what it reads from its cache."""
    if hasattr(os, "getuid"):
        mine = Path(tempfile.gettempdir()) / f"hpcdem-{os.getuid()}"
        with contextlib.suppress(OSError):
            mine.mkdir(mode=0o700, exist_ok=True)
            found = mine.lstat()
            if found.st_uid == os.getuid() and found.st_mode & 0o170077 == 0o040000 and can_write(mine):
                return mine
    return Path(tempfile.mkdtemp(prefix="hpcdem-"))


def cache_key() -> str:
    """Name of a cache folder: all that compiled code depends on.

    numba compares the source file of a kernel, but not of the functions that are inlined into it, and knows nothing
    of constants: hence the digest over the sources of all kernels and of those who call them. It keeps kernels apart by
    the place of their source, and so does the digest: the folder of one copy of hpcdem would look complete to another
    one, and many ranks would fill it at once. A run with threads has kernels of its own, and a folder must be complete
    when it gets its name: hence a folder for runs with one thread and one for runs with more.
    """
    import llvmlite.binding as llvm
    import numba

    package = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(str(package).encode() + b"\0")
    for source in kernel_sources(package):
        digest.update(str(source.relative_to(package)).encode() + b"\0" + source.read_bytes())
    features = llvm.get_host_cpu_features().flatten()
    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k in COMPILER_SETTINGS)
    threaded = os.environ.get("NUMBA_NUM_THREADS", "1") != "1"
    digest.update(repr((sys.version_info[:2], llvm.get_host_cpu_name(), features, settings, threaded)).encode())
    release = version().split()[0]
    return f"{release}-numba{numba.__version__}-{llvm.get_host_cpu_name()}-{digest.hexdigest()[:12]}"


def kernel_sources(package: Path) -> list[Path]:
    """The modules that decide what is compiled: those with kernels, all that they take functions or constants from, and
    those that call them, with arguments of types of their choice."""
    texts = {path: path.read_text(encoding="utf-8") for path in package.rglob("*.py")}
    imports = {path: _imported(text, package) & texts.keys() for path, text in texts.items()}
    kernels = {path for path, text in texts.items() if _COMPILES.search(text)}
    found, wanted = set(kernels), list(kernels)
    while wanted:
        more = imports[wanted.pop()] - found
        found |= more
        wanted += more
    callers = {path for path, used in imports.items() if used & kernels}
    warm_ups = set(package.rglob("warm_up.py"))
    return sorted(found | callers | warm_ups)  # what they call is what the folders hold


def _imported(text: str, package: Path) -> set[Path]:
    """Files that the statements ``from hpcdem.a import b`` of a module may mean."""
    files = set()
    for module, names in _IMPORTS.findall(text):
        folder = package.joinpath(*module.split(".")[1:])
        files |= {folder.with_suffix(".py"), *(folder / f"{name}.py" for name in re.findall(r"\w+", names))}
    return files


_COMPILES = re.compile(r"^\s*from numba import .*njit", re.MULTILINE)
_IMPORTS = re.compile(r"^\s*from (hpcdem[\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)

COMPILER_SETTINGS = frozenset(
    f"NUMBA_{name}"
    for name in ("DISABLE_INTEL_SVML", "CPU_NAME", "CPU_FEATURES", "OPT", "BOUNDSCHECK", "THREADING_LAYER")
)
"""Variables that change the code numba makes, or the library it calls, without numba's cache seeing it."""


def tidy(folder: Path) -> None:
    """Note that the folder was used, and remove its neighbours that were not for two months."""
    with contextlib.suppress(OSError):
        os.utime(folder)
        for other in folder.parent.iterdir():
            age = (time.time() - other.stat().st_mtime) / 86400.0
            if "-numba" in other.name and age > (1 if BUILDING in other.name else UNUSED_DAYS):
                shutil.rmtree(other, ignore_errors=True)


def warmup(log: Log, prepare: Callable[[], Path]) -> None:
    """Compile for later runs, as on a login node: `hpcdem warmup`."""
    began = time.monotonic()
    folder = prepare()
    log.info(f"kernels ready in {time.monotonic() - began:.1f} s: {folder}")
