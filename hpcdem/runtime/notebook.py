"""Progress in a notebook: bars that are drawn over themselves below the cell."""

from __future__ import annotations

import html
import sys
import time
from typing import Any


def in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    if "ipykernel" not in sys.modules:
        return False
    from IPython import get_ipython

    return type(get_ipython()).__name__ == "ZMQInteractiveShell"


class NotebookBar:
    """Two bars, the command's and the script's, as `progress.Bar` on a terminal."""

    REDRAW = 0.5

    def __init__(self, name: str, steps: int, script_steps: int, script_done: int) -> None:
        from IPython.display import HTML, display

        self._html = HTML
        self._name, self._steps, self._script_steps = html.escape(name), steps, script_steps
        self._began, self._drawn = time.monotonic(), 0.0
        self._first: int | None = None
        self._at = 0, script_done
        self._handle: Any = display(HTML(self._text()), display_id=True)

    def update(self, done: int, script_done: int) -> None:
        """Move the bars; redrawn twice a second."""
        self._first = done if self._first is None else self._first
        self._at = done, script_done
        now = time.monotonic()
        if now - self._drawn > self.REDRAW:
            self._handle.update(self._html(self._text()))
            self._drawn = now

    def print(self, text: str) -> None:
        """A line of the cell."""
        print(text, flush=True)

    def close(self) -> None:
        """Leave the bars as they are at the end."""
        self._handle.update(self._html(self._text()))

    def _text(self) -> str:
        done, script_done = self._at
        spent = time.monotonic() - self._began
        here = done - (self._first or 0)
        left = f", {spent * (self._steps - done) / here:.0f} s left" if here and done < self._steps else ""
        bars = f"{self._name} {_bar(done, self._steps)} {done} of {self._steps} steps{left}"
        if self._script_steps:
            bars += f"<br>script {_bar(script_done, self._script_steps)}"
        return f'<div style="font-family:monospace">{bars}</div>'


def _bar(done: int, total: int) -> str:
    return f'<progress value="{done}" max="{max(total, 1)}" style="width:20em"></progress>'
