"""Serve the additional calls of `hpcdem view --run`: edit the scripts of one folder, check them, and execute commands
in a separate process.

Whoever may open the page may run programs with it, as at a terminal. Therefore it must be requested on the command
line, and why the page's key, loopback and the check of the origin (server.py) stand before all of it.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections import deque
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang import detect
from hpcdem.page.pipe import DONE, MARK, READY
from hpcdem.page.server import Answer, Call, as_json
from hpcdem.runtime import run_folder

LANGUAGES = ("pcdc", "zdem")
LINES = 5000
"""Number of lines of output that are kept."""
LONGEST_LINE = 2000
SCRIPT = re.compile(r"[^\W.][\w .+-]{0,99}\.(sc|py)")
"""Names of scripts: in the folder itself, not hidden."""
LARGEST_SCRIPT = 512 * 1024
"""Largest size of a script that the page shows [bytes]."""


class Console:
    """A process that carries out what it is given, and what it has printed.

    outdir: of its results; threads: of the process.
    """

    def __init__(self, folder: Path, outdir: Path, threads: int = 1) -> None:
        self.folder, self.outdir, self.threads = folder, outdir, threads
        self.language = LANGUAGES[0]
        self.process: subprocess.Popen[str] | None = None
        self.lines: deque[tuple[int, str, str]] = deque(maxlen=LINES)
        self.count = 0
        self.ready = False
        self.waiting = 0
        """Texts that were handed over and are not at their end."""
        self.lock = threading.RLock()

    @property
    def busy(self) -> bool:
        """Return whether the process is starting or executing commands."""
        return self.alive and (not self.ready or self.waiting > 0)

    def output_since(self, number: Any) -> dict[str, Any]:
        """Lines after this one, and the state."""
        with self.lock:
            since = number if isinstance(number, int) and 0 <= number <= self.count else 0
            return {
                "lines": [[text, kind] for n, text, kind in self.lines if n > since], "last": self.count,
                "busy": self.busy, "language": self.language, "alive": self.alive,
            }  # fmt: skip

    def carry_out(self, text: str, language: str, name: str = "") -> None:
        """Hand over a text; name: of a script, which gets a process of its own. HpcdemError while it is at work."""
        with self.lock:
            if self.busy:
                raise HpcdemError("the console is busy: interrupt it first")
            if name or not self.alive or language != self.language:
                self.start(language)
            assert self.process is not None and self.process.stdin is not None
            for line in [f"run {name}"] if name else text.rstrip("\n").split("\n"):
                self._note(line, "asked")
            try:
                self.process.stdin.write(json.dumps({"text": text, "name": name}) + "\n")
                self.process.stdin.flush()
                self.waiting += 1
            except OSError:
                raise HpcdemError("the console has ended: restart it") from None

    def start(self, language: str) -> None:
        """Begin with an empty model."""
        if language not in LANGUAGES:
            raise HpcdemError(f"language: expected one of {', '.join(LANGUAGES)}")
        with self.lock:
            self.end()
            for frame in (self.outdir / run_folder.PRESENT).glob("*.vtkhdf"):  # of a model that is no more
                frame.unlink(missing_ok=True)
            self.language = language
            root = str(Path(__file__).resolve().parents[2])
            path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
            words = [sys.executable, "-P", "-m", "hpcdem", "console", "--pipe", "--outdir", str(self.outdir)]
            words += ["-j", str(self.threads), *(["--zdem"] if language == "zdem" else [])]
            # A session of its own: Ctrl-C in the terminal is for the server, which then ends this one.
            self.process = subprocess.Popen(
                words, cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                env=os.environ | {"PYTHONPATH": path, "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8:replace"},
                encoding="utf-8", errors="replace", start_new_session=True,
            )  # fmt: skip
            threading.Thread(target=self._listen, args=[self.process], daemon=True).start()

    def interrupt(self) -> None:
        """Interrupt the run like Ctrl-C: the run is saved and stops; a second call stops it at once."""
        with self.lock:
            if not self.busy or self.process is None:
                raise HpcdemError("nothing is running")
            with contextlib.suppress(OSError):
                os.kill(self.process.pid, signal.SIGINT)

    def end(self) -> None:
        """End the process."""
        with self.lock:
            process, self.process, self.ready, self.waiting = self.process, None, False, 0
        if process is not None and process.poll() is None:
            with contextlib.suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    @property
    def alive(self) -> bool:
        """Return whether the process is running, busy or idle."""
        return self.process is not None and self.process.poll() is None

    def _listen(self, process: subprocess.Popen[str]) -> None:
        """Take down what a process prints, until it ends."""
        assert process.stdout is not None
        for line in process.stdout:
            with self.lock:
                if process is not self.process:
                    return
                if not line.startswith(MARK):
                    if line := line.rstrip("\n"):
                        self._note(line[:LONGEST_LINE], "said")
                    continue
                with contextlib.suppress(ValueError):
                    what = json.loads(line[1:]).get("what")
                    self.ready = self.ready or what == READY
                    self.waiting -= what == DONE
        code = process.wait()
        with self.lock:
            if process is self.process:
                self._note(f"(the console has ended, exit code {code})", "ended")

    def _note(self, text: str, kind: str) -> None:
        with self.lock:
            self.count += 1
            self.lines.append((self.count, text, kind))


class Desk:
    """folder: where the scripts lie; first: the one that the editor begins with."""

    def __init__(self, folder: Path, outdir: Path, first: str = "", threads: int = 1) -> None:
        self.folder, self.first = folder, first
        self.console = Console(folder, outdir, threads)

    def calls(self) -> dict[str, Call]:
        """Return the handlers of POST requests by name."""
        return {
            "console": lambda wanted: as_json(self.console.output_since(wanted.get("since"))),
            "say": self._input,
            "interrupt": self._interrupt,
            "restart": self._restart,
            "whole": lambda wanted: as_json({"whole": whole(wanted.get("text"), wanted.get("language"))}),
            "complete": lambda wanted: as_json(complete(wanted.get("line"), wanted.get("language"))),
            "check": lambda wanted: as_json(check(wanted.get("text"), str(wanted.get("name") or "script"))),
            "scripts": lambda wanted: as_json({"names": self.names(), "first": self.first}),
            "read": lambda wanted: as_json(self.read(wanted.get("name"))),
            "rename": lambda wanted: as_json(self.rename(wanted.get("name"), wanted.get("to"), wanted.get("stamp"))),
            "write": lambda wanted: as_json(self.write(wanted.get("name"), wanted.get("text"), wanted.get("stamp"))),
        }

    def _interrupt(self, wanted: dict[str, Any]) -> Answer:
        self.console.interrupt()
        return as_json({})

    def _restart(self, wanted: dict[str, Any]) -> Answer:
        self.console.start(str(wanted.get("language")))
        return as_json({})

    def _input(self, wanted: dict[str, Any]) -> Answer:
        text, name = wanted.get("text"), wanted.get("name") or ""
        if not isinstance(text, str) or not isinstance(name, str) or not text.strip():
            raise HpcdemError("text: expected commands")
        language = wanted.get("language") or self.console.language
        if name:
            self._path(name)
            language = detect.kind(text, name)
            if language not in LANGUAGES:
                raise HpcdemError(f"{name} is a program in Python: start it with `hpcdem {name}` or `python {name}`")
        self.console.carry_out(text, str(language), name)
        return as_json({"language": language})

    # ---- scripts ---------------------------------------------------------------------------------------------------

    def names(self) -> list[str]:
        """List the file names of the scripts in the folder."""
        with os.scandir(self.folder) as found:
            return sorted(entry.name for entry in found if entry.is_file() and SCRIPT.fullmatch(entry.name))

    def _path(self, name: Any) -> Path:
        """The file of a script. HpcdemError if it would not lie in the folder."""
        if not isinstance(name, str) or SCRIPT.fullmatch(name) is None:
            raise HpcdemError("a script needs a name such as push.py or ucs.sc, without folders")
        path = self.folder / name
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise HpcdemError(f"{name} is not a regular file")
        return path

    def read(self, name: Any) -> dict[str, Any]:
        """Return a script, with a stamp that shows later changes of its file."""
        path = self._path(name)
        try:
            if path.stat().st_size > LARGEST_SCRIPT:
                raise HpcdemError(f"{name} has more than {LARGEST_SCRIPT} bytes: edit it elsewhere")
            return {"name": name, "text": path.read_bytes().decode("utf-8"), "stamp": _stamp(path)}
        except OSError as problem:
            raise HpcdemError(f"cannot read {name}: {problem.strerror}") from None
        except UnicodeDecodeError:
            raise HpcdemError(f"{name} is not UTF-8 text") from None

    def write(self, name: Any, text: Any, stamp: Any) -> dict[str, Any]:
        """Save a script. HpcdemError if its file is not the one that was read (stamp: None for a new one)."""
        path = self._path(name)
        if not isinstance(text, str) or len(text) > LARGEST_SCRIPT:
            raise HpcdemError(f"text: expected at most {LARGEST_SCRIPT} characters")
        if (_stamp(path) if path.exists() else None) != stamp:
            raise HpcdemError(f"{name} was changed by another program: open it again, or save under another name")
        try:
            with tempfile.NamedTemporaryFile("wb", dir=self.folder, prefix=".", suffix=".tmp", delete=False) as file:
                file.write(text.encode())
                file.flush()
                os.fsync(file.fileno())
            mode = path.stat().st_mode if path.exists() else 0o666 & ~_umask()
            os.chmod(file.name, mode & 0o7777)
            os.replace(file.name, path)
        except OSError as problem:
            raise HpcdemError(f"cannot write {name}: {problem.strerror}") from None
        return {"name": name, "stamp": _stamp(path)}

    def rename(self, name: Any, to: Any, stamp: Any) -> dict[str, Any]:
        """Give a script another name. HpcdemError if there is one of that name, or others have changed it meanwhile."""
        path, new = self._path(name), self._path(to)
        try:
            if _stamp(path) != stamp:
                raise HpcdemError(f"{name} was changed by another program: open it again")
            try:
                os.link(path, new)  # unlike os.replace it refuses a name that is taken
                path.unlink()
            except FileExistsError:
                raise
            except OSError:  # a file system without links
                if new.exists():
                    raise FileExistsError from None
                path.rename(new)
        except FileExistsError:
            raise HpcdemError(f"script {to} exists") from None
        except OSError as problem:
            raise HpcdemError(f"cannot rename {name}: {problem.strerror}") from None
        return {"name": to, "stamp": _stamp(new)}


def _stamp(path: Path) -> str:
    status = path.stat()
    return f"{status.st_mtime_ns} {status.st_size}"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def whole(text: Any, language: Any) -> bool:
    """Return whether the input can be executed as it stands. A block of Python that continues ends with an empty
    line."""
    if not isinstance(text, str) or len(text) > LARGEST_SCRIPT:
        raise HpcdemError("text: expected commands")
    if language == "zdem":
        return True
    from hpcdem.lang.pcdc.console import is_whole

    return is_whole(text.rstrip(" \t"))


def complete(line: Any, language: Any) -> dict[str, Any]:
    """The words that may continue a line, and how many of its last characters they replace."""
    if not isinstance(line, str) or len(line) > LONGEST_LINE:
        raise HpcdemError("line: expected text")
    from hpcdem.lang.pcdc.complete import candidates as of_pcdc
    from hpcdem.lang.zdem.complete import candidates as of_zdem

    last = "" if not line or line[-1].isspace() else line.split()[-1]
    if language == "zdem":
        words = of_zdem(line)
    elif line.lstrip().startswith("pcdc "):
        words = of_pcdc(line)
    else:
        words = ["pcdc"] if last and "pcdc".startswith(last) and line.strip() == last else []
    return {"words": words[:40], "last": len(last)}


def check(text: Any, name: str) -> dict[str, Any]:
    """Check a script like `hpcdem --check`. Returns its language and a summary, or the wrong line and its problem."""
    if not isinstance(text, str):
        raise HpcdemError("text: expected a script")
    result: dict[str, Any] = {"language": None, "summary": "", "line": None, "problem": ""}
    try:
        result["language"] = detect.kind(text, name)
        if result["language"] == "zdem":
            from hpcdem.lang.zdem import check as of_zdem
            from hpcdem.lang.zdem.execute import refuse_unexecuted
            from hpcdem.lang.zdem.parser import parse_text

            script = parse_text(text, name)
            refuse_unexecuted(script.statements)
            result["summary"] = of_zdem.summary(script, None)
        elif result["language"] == "pcdc":
            from hpcdem.lang.pcdc import check as of_pcdc

            result["summary"] = of_pcdc.summary(text, name)
    except ScriptError as error:
        result["line"], result["problem"] = error.line, error.message
    except HpcdemError as error:
        result["problem"] = str(error)
    return result
