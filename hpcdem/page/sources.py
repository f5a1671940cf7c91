"""Sources of `hpcdem view`: frames in folders and single files, which grow during a run, and its histories."""

from __future__ import annotations

import json
import os
import signal
import socket
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError
from hpcdem.io.frames import FrameFile, list_frames, mesh_frames_by_name
from hpcdem.io.run_record import PROGRESS
from hpcdem.page.curves import Curves
from hpcdem.post.view.moment import Moment, read_moment
from hpcdem.runtime import kernels, run_folder

MOMENTS = 3
"""Number of frames kept in memory: the present one and its neighbours."""
OBJECTS = 500_000
"""Largest number of objects in memory at which another frame is kept beside them."""
SIGNALS = {"stop": signal.SIGUSR1, "save": signal.SIGUSR2}


@dataclass
class Source:
    """Frames that follow each other. folder: None for a single file."""

    name: str
    folder: Path | None
    frames: list[FrameFile] = field(default_factory=list)


class Sources:
    """Everything named on the command line. Raises HpcdemError if there is nothing to show, unless that is allowed
    (empty).

    The first folder is that of the run; below it may lie what a console shows of its model (commands/present.py).
    """

    def __init__(self, paths: Sequence[Path], empty: bool = False) -> None:
        self.paths, self.empty = list(paths), empty
        self.found: list[Source] = []
        self.moments: OrderedDict[tuple[str, int, int], Moment] = OrderedDict()
        self.lock = threading.Lock()
        self._curves: Curves | None = None
        self.coming = {path for path in self.paths if self._to_be_made(path)}
        self.refresh()
        for path in self.paths:
            if empty or not path.is_dir() or run_folder.running(path) is not None or path in self.coming:
                continue
            if not any(s.folder == path for s in self.found):
                raise HpcdemError(
                    f"no frame all_*.vtkhdf, all_*.dat or <name>_*.vtkhdf in {path}. Start the run that writes there, "
                    "or open a console beside the page: hpcdem view --run"
                )
        self._see_one()

    @staticmethod
    def _to_be_made(path: Path) -> bool:
        """Return whether a run that has just been started may still create this folder: it compiles kernels before."""
        nothing = not any(path.iterdir()) if path.is_dir() else not (path.exists() or path.suffix)
        return nothing and bool(kernels.builder())

    def _see_one(self) -> None:
        """HpcdemError if there are frames, and none of their first ones can be shown."""
        failure: HpcdemError | None = None
        for source in self.found:
            try:
                self.moment(source.frames[0])
                return
            except HpcdemError as problem:
                failure = failure or problem
        if failure is not None:
            raise failure

    def refresh(self) -> None:
        """See which frames there are now."""
        found: list[Source] = []
        for path in self.paths:
            if not path.is_dir():
                if not path.exists() and (self.empty or path in self.coming):
                    continue
                if not path.is_file():
                    raise HpcdemError(f"cannot read {path}: there is no such file")
                found.append(Source(path.name, None, [FrameFile(path, read_moment(path).step, False)]))
                continue
            label = path.resolve().name
            if files := list_frames(path):
                found.append(Source(f"{label}: all", path, files))
            for stem, files in mesh_frames_by_name(path).items():
                found.append(Source(f"{label}: {stem}", path, files))
        self.found = found

    def source(self, number: Any) -> Source:
        """Return a source by its index. Raises HpcdemError for an unknown one."""
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < len(self.found):
            raise HpcdemError("unknown frames")
        return self.found[number]

    def frame(self, number: Any, place: Any) -> FrameFile:
        """A frame by its source and its place, -1 the last. HpcdemError for an unknown one."""
        frames = self.source(number).frames
        if not isinstance(place, int) or isinstance(place, bool) or not -1 <= place < len(frames) or not frames:
            raise HpcdemError("there is no such frame")
        return frames[place]

    def moment(self, file: FrameFile) -> tuple[tuple[str, int, int], Moment]:
        """Return the contents of a frame and its key in the store, which changes when the file is rewritten. Raises
        HpcdemError."""
        key = self._key(file)
        with self.lock:
            if key not in self.moments:
                while self.moments and (len(self.moments) >= MOMENTS or self._objects() > OBJECTS):
                    self.moments.popitem(last=False)
                self.moments[key] = read_moment(file.path)
            self.moments.move_to_end(key)
            return key, self.moments[key]

    def kept(self, file: FrameFile) -> bool:
        """Return whether a frame is in memory."""
        return self._key(file) in self.moments

    @staticmethod
    def _key(file: FrameFile) -> tuple[str, int, int]:
        try:
            status = os.stat(file.path)
        except OSError:
            raise HpcdemError(f"cannot read {file.path}: there is no such file") from None
        return str(file.path), status.st_mtime_ns, status.st_size

    def _objects(self) -> int:
        return sum(objects.count for moment in self.moments.values() for objects in moment.objects.values())

    # ---- the run ---------------------------------------------------------------------------------------------------

    def folders(self) -> list[Path]:
        """List each folder once."""
        return [path for path in self.paths if path.is_dir()]

    def state(self) -> dict[str, Any]:
        """Frames by source, with what tells whether the last one was written again; of the first folder whether a run
        writes there, its progress, and its histories."""
        self.refresh()
        answer: dict[str, Any] = {
            "sources": [
                {
                    "name": source.name,
                    "frames": [[file.step, file.ini] for file in source.frames],
                    "stamp": _stamp(source.frames[-1].path),
                }
                for source in self.found
            ],
            "run": None,
            "histories": self.curves().state(),
        }
        for folder in self.folders()[:1]:
            answer["run"] = _run(folder)
        return answer

    def waiting(self) -> dict[str, Any]:
        """Explain why there is no frame yet: kernels are being compiled, a run is active, or the folder is empty."""
        folder = self.folders()[0] if self.folders() else self.paths[0]
        holder = run_folder.running(folder) if folder.is_dir() else None
        if holder is not None:
            return {"kind": "first", "folder": str(folder)}
        who = kernels.builder()
        return {"kind": "compiling" if who else "empty", "who": who, "folder": str(folder)}

    def curves(self) -> Curves:
        """Return the curves that the run of the first folder has recorded."""
        folder = next(iter(self.folders()), self.paths[0])
        if self._curves is None or self._curves.folder != folder:
            self._curves = Curves(folder)
        return self._curves

    def send_signal(self, what: Any) -> str:
        """Ask the run that writes into the first folder to stop after a checkpoint, or to save one: the same signals as
        from a terminal. HpcdemError where none runs on this machine."""
        if what not in SIGNALS:
            raise HpcdemError("expected stop or checkpoint")
        folder = next(iter(self.folders()), None)
        holder = None if folder is None else run_folder.running(folder)
        if holder is None:
            raise HpcdemError("no run is writing into this folder")
        if holder.get("host") != socket.gethostname() or not isinstance(holder.get("pid"), int):
            raise HpcdemError(
                f"the run is on {holder.get('host', 'another machine')}: send it {SIGNALS[what].name} there"
            )
        try:
            os.kill(holder["pid"], SIGNALS[what])
        except OSError as problem:
            raise HpcdemError(f"process {holder['pid']} cannot be reached: {problem.strerror}") from None
        return f"process {holder['pid']}: {SIGNALS[what].name}"


def _stamp(path: Path) -> str:
    try:
        return str(os.stat(path).st_mtime_ns)
    except OSError:
        return ""


def _progress(folder: Path) -> dict[str, Any] | None:
    """Read the progress that the run has noted in its folder; None if there is no valid note."""
    try:
        progress = json.loads((folder / PROGRESS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return progress if isinstance(progress, dict) else None


def _run(folder: Path) -> dict[str, Any] | None:
    """Summarize run.json and the process that holds the folder; None if neither exists."""
    try:
        record = run_folder.read(folder)
    except HpcdemError as problem:
        return {"state": str(problem), "running": False}
    holder = run_folder.running(folder)
    if record is None and holder is None:
        return None
    state = record.state if record is not None else "running"
    if state == "running" and holder is None:
        state = "killed"
    return {
        "progress": _progress(folder) if holder is not None else None,
        "state": state, "running": holder is not None, "script": Path(record.script).name if record is not None else "",
        "step": record.step if record is not None else 0, "host": (holder or {}).get("host", ""),
    }  # fmt: skip
