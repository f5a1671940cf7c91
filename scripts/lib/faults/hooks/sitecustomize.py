"""Put in front of a run by PYTHONPATH: lets a chosen call to the operating system be the last one of the process.

The environment variable FAULTS_PLAN holds JSON:

strike: {"rank", "call", "suffix", "nth", "part", "how"}: in the nth `call` (pwritev, fsync, replace, append) of this
    rank on a file with this suffix, after `part` (0 to 1) of its work, `how`: SIGKILL, SIGSTOP, or an error (EIO)
clock: [[after, jump], ...] [s]: the wall clock jumps, so long after the start
slow: seconds that every row appended to a series takes
tally: a file that gets the number of calls, as JSON, at the end
"""

import atexit
import builtins
import errno
import json
import os
import signal
import threading
import time
from collections import Counter

_RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID")
plan = json.loads(os.environ.get("FAULTS_PLAN") or "{}")
rank = int(next((os.environ[name] for name in _RANKS if name in os.environ), "0"))
calls: Counter = Counter()
_lock = threading.Lock()


def path_of(what):
    """Path of a file, given by name or by descriptor."""
    try:
        return os.readlink(f"/proc/self/fd/{what}") if isinstance(what, int) else os.fspath(what)
    except (OSError, TypeError):
        return ""


def due(call, what):
    """Count a call; whether it is the one."""
    strike, path = plan.get("strike", {}), str(path_of(what))
    name = os.path.basename(path)
    kind = ""
    for suffix in (".sav", ".vtkhdf", ".dat", ".csv", ".json"):
        if name.endswith((suffix, suffix + ".tmp")):
            kind = suffix
    with _lock:
        calls[f"{call} {kind}"] += 1
        found = calls[f"{call} {kind}"]
    return (
        strike.get("rank", 0) == rank
        and strike.get("call") == call
        and strike.get("suffix") == kind
        and strike.get("nth") == found
    )


def act():
    """Die, stop, or fail."""
    how = plan["strike"]["how"]
    if how.startswith("SIG"):
        os.kill(os.getpid(), getattr(signal, how))
        time.sleep(0.05)  # until a signal to the process has arrived
        return
    number = getattr(errno, how)
    raise OSError(number, os.strerror(number))


def before(part):
    """Whether the process ends before this part of the work."""
    return plan["strike"].get("part", 0.0) < part


def wrap(name):
    """Stand before a function of os that takes a file first."""
    real = getattr(os, name)

    def call(*args, **named):
        if not due(name, args[0]):
            return real(*args, **named)
        if name == "pwritev":
            handle, buffers, at = args
            data = b"".join(bytes(piece) for piece in buffers)
            os.pwrite(handle, data[: int(plan["strike"].get("part", 0.0) * len(data))], at)
            act()
            return real(*args, **named)
        if before(0.5):
            act()
            return real(*args, **named)
        result = real(*args, **named)
        act()
        return result

    setattr(os, name, call)


class Series:
    """A text file that is appended to."""

    def __init__(self, file, path):
        self._file, self._path = file, path

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._file.close()

    def __getattr__(self, name):
        return getattr(self._file, name)

    def write(self, text):
        if plan.get("slow"):
            time.sleep(plan["slow"])
        if not due("append", self._path):
            return self._file.write(text)
        first = int(plan["strike"].get("part", 0.0) * len(text))
        self._file.write(text[:first])
        self._file.flush()
        act()
        return self._file.write(text[first:])


def wrap_open():
    """Series are opened with mode "a"."""
    real = builtins.open

    def call(file, mode="r", *args, **named):
        opened = real(file, mode, *args, **named)
        return Series(opened, file) if mode == "a" else opened

    builtins.open = call


def wrap_clock():
    """time.time jumps."""
    real, began = time.time, time.monotonic()

    def call():
        past = time.monotonic() - began
        return real() + sum(jump for after, jump in plan["clock"] if past >= after)

    time.time = call


if plan.get("strike") or plan.get("tally"):
    for function in ("pwritev", "fsync", "replace"):
        wrap(function)
if plan.get("strike") or plan.get("tally") or plan.get("slow"):
    wrap_open()
if plan.get("clock"):
    wrap_clock()
if plan.get("tally") and rank == 0:

    @atexit.register
    def tell():
        """The tally of a run that came to its end."""
        with open(plan["tally"], "w") as file:
            json.dump(calls, file)
