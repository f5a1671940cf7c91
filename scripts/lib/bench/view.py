"""How fast `hpcdem view` is: frames of so many objects are made up, and its page is asked as a browser asks it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.strain_stress import make_frames
from bench.tables import Lines

KINDS = ("discs", "triangles")
WIDTH, HEIGHT = 1280, 720
PICTURES = 30
DIFFERENT = 3
"""Frames that are made up; the others of a folder are further names of these."""
LOOK = 0.8
"""Seconds between two looks of the page at its folder."""


def measure(kind: str, size: int, frames: int, lines: Lines) -> None:
    """Time to the first picture from the start of the program, pictures per second while the camera moves and while
    frames go by, time of a click, time until a new frame is shown, and largest memory of the server."""
    with tempfile.TemporaryDirectory() as folder:
        make = make_frames if kind == "discs" else _blocks
        made = make(Path(folder), size, min(DIFFERENT, frames), "vtkhdf")
        paths = sorted(Path(folder).iterdir())
        for path in paths:  # into the cache of the system: frames are warm
            path.read_bytes()
        for k in range(len(paths), frames):
            _named(paths, k)
        began = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "hpcdem", "view", folder, "--no-browser"], stdout=subprocess.PIPE, text=True
        )
        try:
            assert process.stdout is not None
            url = re.match(r"Page: (\S+)", process.stdout.readline())[1]  # type: ignore[index]
            row = _asked(
                url, began, "vx" if kind == "discs" else "stress_yy", lambda: _named(paths, frames), process.pid
            )
            status = Path(f"/proc/{process.pid}/status").read_text()
            row["memory_mb"] = int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1e3  # type: ignore[index]
        finally:
            process.terminate()
            process.wait()
    lines.add({"code": "hpcdem view", "kind": kind, "objects": made, "frames": frames, **row})


def _named(paths: list[Path], number: int) -> None:
    """Frame `number` of the folder is one of these."""
    stem = paths[0].name.partition("_")[0]
    os.link(paths[number % len(paths)], paths[0].with_name(f"{stem}_{10**6 + number:010d}.vtkhdf"))


def _processor(pid: int) -> float:
    """Seconds that a process has computed: on a busy machine they tell more than those of the clock."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _asked(url: str, began: float, field: str, write: Callable[[], None], pid: int) -> dict[str, Any]:
    state = json.loads(_ask(url, "state", {}))
    count = len(state["sources"][0]["frames"])
    about = json.loads(_ask(url, "about", {}))
    left, right, bottom, top = about["whole"]
    # All of the model, at the shape of the window.
    half = 0.5 * max(top - bottom, (right - left) * HEIGHT / WIDTH)
    wide = half * WIDTH / HEIGHT
    x, y = 0.5 * (left + right), 0.5 * (bottom + top)
    about["view"]["layers"][0]["field"] = field

    def wanted(shift: float, frame: int) -> dict[str, Any]:
        camera = [x - wide + shift * wide, x + wide + shift * wide, y - half, y + half]
        return {"view": about["view"] | {"camera": camera}, "frame": frame, "width": WIDTH, "height": HEIGHT}

    _ask(url, "picture", wanted(0.0, count - 1))
    first, computed = time.perf_counter() - began, [_processor(pid)]
    moving = _pace(lambda k: _ask(url, "picture", wanted(1e-3 * (k + 1), count - 1)))
    computed.append(_processor(pid))
    scrubbing = _pace(lambda k: _ask(url, "picture", wanted(0.0, k % count)))
    computed.append(_processor(pid))
    asked = time.perf_counter()
    _ask(url, "pick", wanted(0.0, (PICTURES - 1) % count) | {"column": WIDTH // 2, "row": HEIGHT // 2})
    pick = time.perf_counter() - asked
    written = time.perf_counter()
    write()
    time.sleep(LOOK)  # the page has just looked
    assert len(json.loads(_ask(url, "state", {}))["sources"][0]["frames"]) == count + 1
    _ask(url, "picture", wanted(0.0, count))
    return {
        "first_s": first, "moving_per_s": moving, "scrubbing_per_s": scrubbing, "pick_ms": 1e3 * pick,
        "new_frame_s": time.perf_counter() - written, "first_processor_s": computed[0],
        "moving_processor_ms": 1e3 * (computed[1] - computed[0]) / PICTURES,
        "scrubbing_processor_ms": 1e3 * (computed[2] - computed[1]) / PICTURES,
    }  # fmt: skip


def _pace(one: Any) -> float:
    began = time.perf_counter()
    for k in range(PICTURES):
        one(k)
    return PICTURES / (time.perf_counter() - began)


def _ask(url: str, name: str, content: dict[str, Any]) -> bytes:
    request = urllib.request.Request(url + name, json.dumps(content).encode(), {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=120) as response:
        return response.read()


def _blocks(folder: Path, size: int, frames: int, suffix: str) -> int:
    """Triangles of squares, with a stress that differs from frame to frame."""
    from hpcdem.core.comm import SerialComm
    from hpcdem.io.frame import Table
    from hpcdem.io.vtkhdf_mesh import MeshFrame, write_mesh_frame

    side = int((size / 2) ** 0.5)
    x, y = (v.ravel().astype(float) for v in np.meshgrid(np.arange(side), np.arange(side)))
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], float)
    at = (np.stack([x, y], 1)[:, None] + square).reshape(-1, 2)
    count = 2 * side * side
    number = (4 * np.arange(count)[:, None] + np.arange(3)).ravel()
    no_joints = {name: np.zeros(0, np.int64) for name in ("number", "first", "last")}
    for k in range(frames):
        stress = np.sin(0.05 * np.arange(count) / side + 0.3 * k)
        frame = MeshFrame(
            k, 0.1 * k, 0.1, Table({"number": number, "x": at[:, 0], "y": at[:, 1]}, 0, len(at)),
            Table({"number": np.arange(count), "corners": np.full(count, 3), "stress_yy": stress}, 0, count),
            Table(no_joints | {"state": np.zeros(0), "mode": np.zeros(0)}, 0, 0), {},
        )  # fmt: skip
        write_mesh_frame(folder / f"rock_{k:010d}.{suffix}", frame, SerialComm())  # type: ignore[arg-type]
    return count
