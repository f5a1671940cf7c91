"""A process that makes what the page asks for, and the line of those who wait for it.

Making a specimen cannot be interrupted from within, and while a slider moves only the last position counts: so the work
is done by a process of its own (maker.py), which is ended and replaced when there is a newer request and the answer
under way takes long. Both ends write a code, a length and that many bytes into a pipe.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import IO, Any

from hpcdem.core.errors import HpcdemError

OVERTAKEN_AFTER = 0.5
"""Time after which superseded work is stopped [s]; shorter work is awaited, which is cheaper."""
LONGEST = 120.0
"""Longest time of a piece of work [s], unless a Worker sets another."""
WAITING = 4
"""Largest number of waiting requests that must all be answered."""
FRAME = struct.Struct("<BQ")
"""Header of each message: one of the codes below, and its length."""
READY, ASKED, MADE, REFUSED, BROKEN = range(5)
"""Codes of messages: kernels compiled; request; answer; message for the user; internal error."""


class SupersededError(HpcdemError):
    """Superseded by a newer request: nobody waits for this answer."""

    status = 409
    """HTTP status: conflict."""


class Maker:
    """One process that makes specimens."""

    def __init__(self) -> None:
        root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        # A session of its own: Ctrl-C in the terminal is for the server, which then ends this one.
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "hpcdem.page.maker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": path},
            start_new_session=True,
        )
        self.ready = False

    def get_ready(self) -> None:
        """Wait until it is: the first time on a machine kernels are compiled, which takes half a minute."""
        if not self.ready:
            self._answer()
            self.ready = True

    def ask(self, task: str, request: dict[str, Any]) -> tuple[int, bytes]:
        """Code and answer. OSError if the process has ended."""
        assert self.process.stdin is not None
        words = json.dumps([task, request]).encode()
        self.process.stdin.write(FRAME.pack(ASKED, len(words)) + words)
        self.process.stdin.flush()
        return self._answer()

    def _answer(self) -> tuple[int, bytes]:
        assert self.process.stdout is not None
        code, length = FRAME.unpack(_read(self.process.stdout, FRAME.size))
        return code, _read(self.process.stdout, length)

    @property
    def alive(self) -> bool:
        """Return whether the process is still running."""
        return self.process.poll() is None

    def end(self) -> str:
        """End it, and say how it ended."""
        self.process.kill()
        code = self.process.wait()
        return f"signal {-code}" if code < 0 else f"exit code {code}"


def _read(pipe: IO[bytes], length: int) -> bytes:
    """Read exactly `length` bytes. Raises BrokenPipeError if the other end has closed."""
    content = pipe.read(length)
    if len(content) != length:
        raise BrokenPipeError
    return content


class Worker:
    """Asks a maker, one thing at a time.

    newest_wins: a request makes all earlier ones superfluous; otherwise they are answered in sequence. longest:
    seconds after which work is ended in any case."""

    def __init__(self, newest_wins: bool, longest: float = LONGEST) -> None:
        self.newest_wins, self.longest = newest_wins, longest
        self.turn = threading.Condition()
        self.asked = 0
        """Number of the last request."""
        self.waiting = 0
        self.busy = 0
        """Number of the request that is worked on, or 0."""
        self.began: float | None = None
        """Start of the present work; None while the maker gets ready, and must not be ended."""
        self.ended = 0
        """The last request whose maker was ended."""
        self.maker: Maker | None = None
        self.spare: Maker | None = None
        """A second one, once answers have become slow, so that nobody waits for a new process."""
        self.closed = False

    def start(self) -> None:
        """Start the process now, so that the first answer does not wait for its imports."""
        with self.turn:
            self._maker()

    def ask(self, task: str, request: dict[str, Any]) -> bytes:
        """The maker's answer to a request (`maker.TASKS`).

        Raises HpcdemError with the maker's message, and SupersededError if a newer request took its place."""
        mine, maker = self._queue()
        limit = threading.Timer(self.longest, self._too_long, [mine])
        limit.daemon = True
        took = 0.0
        try:
            maker.get_ready()
            began = time.monotonic()
            with self.turn:
                self.began = began
                self.turn.notify_all()
            limit.start()
            code, answer = maker.ask(task, request)
            took = time.monotonic() - began
        except OSError:
            raise self._why(mine, maker) from None
        finally:
            limit.cancel()
            with self.turn:
                self.busy, self.began = 0, None
                if self.newest_wins and took > 0.5 * OVERTAKEN_AFTER and self.spare is None and not self.closed:
                    self.spare = Maker()
                self.turn.notify_all()
        if code == BROKEN:
            raise HpcdemError(f"internal error: {answer.decode()}; the terminal of hpcdem shows more")
        if code == REFUSED:
            raise HpcdemError(answer.decode())
        return answer

    def close(self) -> None:
        """End the processes; later requests are refused."""
        with self.turn:
            self.closed = True
            for maker in (self.maker, self.spare):
                if maker is not None:
                    maker.end()

    def _queue(self) -> tuple[int, Maker]:
        """Wait for one's turn; the number of the request and who shall answer it."""
        with self.turn:
            if self.waiting >= WAITING and not self.newest_wins:
                raise HpcdemError("other files are still being written: try again in a moment")
            self.asked += 1
            mine = self.asked
            self.waiting += 1
            self.turn.notify_all()
            try:
                while self.busy and not self._superseded(mine):
                    rest = self.longest
                    if self.newest_wins and self.began is not None and self.ended != self.busy:
                        rest = self.began + OVERTAKEN_AFTER - time.monotonic()
                        if rest <= 0.0:
                            self._end()
                            continue
                    self.turn.wait(rest)
                if self._superseded(mine):
                    raise SupersededError("superseded by a newer request")
                maker = self._maker()
                self.busy, self.began = mine, None
            finally:
                self.waiting -= 1
            return mine, maker

    def _superseded(self, number: int) -> bool:
        return self.newest_wins and number != self.asked

    def _too_long(self, number: int) -> None:
        with self.turn:
            if self.busy == number:
                self._end()

    def _why(self, number: int, maker: Maker) -> HpcdemError:
        """Return the error to report after the process that makes specimens has ended."""
        how = maker.end()
        with self.turn:
            if self.closed:
                return HpcdemError("the server is shutting down")
            if self.ended != number:
                return HpcdemError(f"the process that makes specimens has ended: {how}")
            if self._superseded(number):
                return SupersededError("superseded by a newer request")
        return HpcdemError(f"not finished after {self.longest:g} s: choose fewer grains, or a larger void ratio")

    def _end(self) -> None:
        """End the work under way, and the process with it."""
        self.ended = self.busy
        if self.maker is not None:
            self.maker.end()
        self.maker, self.spare = self.spare, None

    def _maker(self) -> Maker:
        """The process that answers, started if necessary."""
        if self.closed:
            raise HpcdemError("the server is shutting down")
        if self.maker is None or not self.maker.alive:
            self.maker = Maker()
        return self.maker
