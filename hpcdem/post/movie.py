"""Pictures put together to a film: an animated GIF, or MP4 where ffmpeg is at hand."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path

FASTEST_GIF = 50.0
"""Frames per second of a GIF: viewers slow down what is faster."""
_PAGE = re.compile(r"(\D*)(\d+)(_ini)?(.*)\.jpe?g", re.IGNORECASE)
_SAMPLES = 8
_EXACT = 160
_RIMS = 0.0, 0.35, 0.65


def pages(folder: str | os.PathLike, without: Collection[str] = ()) -> list[Path]:
    """Return the numbered pictures *.jpg of a folder in the order of time, as `frames.list_frames`; the most frequent
    kind if there are several. without: names of frames whose pictures are ignored. Raises HpcdemError without frames.
    """
    try:
        names = sorted(os.listdir(folder))
    except OSError as failure:
        raise HpcdemError(f"cannot read the folder {os.fspath(folder)}: {failure.strerror}") from None
    kinds: dict[tuple[str, str], list[tuple[int, bool, str]]] = {}
    for name in names:
        found = _PAGE.fullmatch(name)
        if found and f"{found[1]}{found[2]}{found[3] or ''}" not in without:
            kinds.setdefault((found[1], found[4]), []).append((int(found[2]), found[3] is not None, name))
    if not kinds:
        raise HpcdemError(f"no pictures <name><step>.jpg in {os.fspath(folder)}: make them with zdemss first")
    most = max(kinds, key=lambda kind: len(kinds[kind]))
    return [Path(folder) / name for _, _, name in sorted(kinds[most])]


def write_gif(
    pictures: Sequence[Path], path: str | os.PathLike, fps: float, width: int | None = None, keep: Sequence[str] = ()
) -> Path:
    """Write an animated GIF that repeats endlessly. Raises HpcdemError.

    keep: colours "#rrggbb" of thin lines that stay in the palette even if they have few pixels; width: of the film
    [pixels] (default: that of the widest picture). All frames share one palette, in which the colours of particles are
    exact. A frame equal to the previous one extends its duration.
    """
    size = film_size(pictures, width)
    palette = _palette([_fitted(p, size) for p in _some(pictures)], keep)
    frames = (_indexed(_fitted(p, size), palette) for p in pictures)
    # GIFs count in hundredths of a second; rounding the ends and not the lengths keeps the film as long as it is.
    ends = np.rint(100.0 / min(fps, FASTEST_GIF) * np.arange(len(pictures) + 1)).astype(int)
    durations = [int(10 * d) for d in np.diff(ends)]
    path = Path(path)
    with atomic_path(path) as temporary:
        first = next(frames)
        first.save(
            temporary, format="GIF", save_all=True, append_images=frames, duration=durations, loop=0, optimize=False
        )  # fmt: skip
    return path


def write_mp4(pictures: Sequence[Path], path: str | os.PathLike, fps: float, width: int | None = None) -> Path:
    """Write an MP4 (H.264, or MPEG-4 with an ffmpeg without it). Raises HpcdemError, also without ffmpeg."""
    program = ffmpeg()
    if program is None:
        raise HpcdemError(
            f"cannot make {os.fspath(path)}: ffmpeg was not found: install it, or `pip install imageio-ffmpeg`, or "
            "make a GIF"
        )
    size = film_size(pictures, width)
    size = size[0] + size[0] % 2, size[1] + size[1] % 2  # H.264 halves the colours' resolution
    path = Path(path)
    codecs = ["-c:v", "libx264", "-crf", "18", "-preset", "medium"], ["-c:v", "mpeg4", "-q:v", "2"]
    with atomic_path(path) as temporary:
        for codec in codecs:
            output = _encode(program, pictures, size, fps, codec, temporary)
            if output is None:
                return path
        raise HpcdemError(f"cannot make {path}: ffmpeg reports: {output}")


def _encode(
    program: str, pictures: Sequence[Path], size: tuple[int, int], fps: float, codec: list[str], path: str
) -> str | None:
    """Feed ffmpeg; return its last line of output if it failed."""
    command = [
        program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}",
        "-r", f"{fps:g}", "-i", "-", *codec, "-threads", "1", "-pix_fmt", "yuv420p", "-movflags", "+faststart",
        "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1", "-f", "mp4", path,
    ]  # fmt: skip
    try:
        ffmpeg_at_work = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    except OSError as failure:
        return str(failure.strerror)
    with ffmpeg_at_work as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            for picture in pictures:
                process.stdin.write(_fitted(picture, size).tobytes())
            process.stdin.close()
        except BrokenPipeError:  # it has ended, and says why
            pass
        except BaseException:
            process.kill()
            raise
        output = process.stderr.read().decode(errors="replace").strip()
        failed = process.wait() != 0
    return (output.splitlines() or ["nothing"])[-1] if failed else None


def ffmpeg() -> str | None:
    """Return the path of ffmpeg: from PATH, or from the package imageio-ffmpeg."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            from imageio_ffmpeg import get_ffmpeg_exe

            found = get_ffmpeg_exe()
        except (ImportError, RuntimeError):
            pass
    return found


def film_size(pictures: Sequence[Path], width: int | None = None) -> tuple[int, int]:
    """Return width and height [pixels] that contain all pictures, each scaled to the width."""
    from PIL import Image

    sizes = []
    for picture in pictures:
        try:
            with Image.open(picture) as image:
                sizes.append(image.size)
        except OSError as failure:
            raise HpcdemError(f"cannot read the picture {picture}: {failure}") from None
    width = max(w for w, _ in sizes) if width is None else width
    return width, max(max(1, round(h * width / w)) for w, h in sizes)


def _fitted(picture: Path, size: tuple[int, int]) -> Any:
    """The picture in the width of the film, on white where it is lower."""
    from PIL import Image

    try:
        with Image.open(picture) as file:
            image: Any = file.convert("RGB")
    except OSError as failure:
        raise HpcdemError(f"cannot read the picture {picture}: {failure}") from None
    height = max(1, round(image.size[1] * size[0] / image.size[0]))
    if image.size != (size[0], height):
        image = image.resize((size[0], height), Image.Resampling.LANCZOS)
    if image.size != size:
        page = Image.new("RGB", size, "white")
        page.paste(image, (0, 0))
        image = page
    return image


def _some(pictures: Sequence[Path]) -> list[Path]:
    """The first, the last and some between."""
    chosen = np.unique(np.linspace(0, len(pictures) - 1, min(_SAMPLES, len(pictures))).round().astype(int))
    return [pictures[k] for k in chosen]


def _palette(images: Sequence[Any], keep: Sequence[str] = ()) -> np.ndarray:
    """The palette (256, 3) of a film: `keep` and their shades at the rims of lines, the most frequent colours as they
    are, the others by their median."""
    from PIL import Image

    lines = np.array([[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in keep]).reshape(-1, 3)
    shades = np.concatenate([lines + (255 - lines) * part for part in _RIMS]).round().astype(np.uint8)
    free = 256 - len(shades)
    pixels = np.concatenate([np.asarray(image).reshape(-1, 3) for image in images])
    codes = _codes(pixels)
    found, counts = np.unique(codes, return_counts=True)
    order = np.lexsort((found, -counts))
    exact, others = found[order[: min(_EXACT, free)]], found[order[min(_EXACT, free) :]]
    colours = _colours(exact)
    if len(others) and free > len(exact):
        rest = Image.fromarray(np.ascontiguousarray(pixels[np.isin(codes, others)][None, :, :]))
        cut = rest.quantize(free - len(exact), method=Image.Quantize.MEDIANCUT)
        middle = np.array(cut.getpalette(), np.uint8).reshape(-1, 3)[: free - len(exact)]
        colours = np.concatenate([colours, middle])
    colours = np.concatenate([colours, shades])
    return np.concatenate([colours, np.repeat(colours[-1:], 256 - len(colours), axis=0)])


def _indexed(image: Any, palette: np.ndarray) -> Any:
    """The image with each pixel in the nearest colour of the palette."""
    from PIL import Image
    from scipy.spatial import cKDTree

    found, place = np.unique(_codes(np.asarray(image).reshape(-1, 3)), return_inverse=True)
    nearest = cKDTree(palette.astype(float)).query(_colours(found).astype(float))[1].astype(np.uint8)
    result = Image.fromarray(nearest[place].reshape(image.size[1], image.size[0]))
    result.putpalette(palette.tobytes())
    return result


def _codes(pixels: np.ndarray) -> np.ndarray:
    """Convert colours to one number each: (n, 3) bytes to (n,)."""
    return pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)


def _colours(codes: np.ndarray) -> np.ndarray:
    """The colours (n, 3) of such numbers."""
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1).astype(np.uint8)
