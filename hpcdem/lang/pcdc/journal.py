"""Values that a running script received, so that it can be brought back to where it was.

A script is Python, and where Python is cannot be saved. So a run that resumes from a checkpoint runs its script again,
up to the command in which the checkpoint was written: commands are skipped, and what the script looks at is
answered with what it saw the first time, so that its loops and decisions are the same. The journal is the list of
these commands and answers; it is part of every numbered checkpoint.
"""

from __future__ import annotations

import base64
import json
import math
import os
import zlib
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, EquilibriumError, HpcdemError, PhysicsError, ScriptError, UsageError

MOST = 64 << 20
"""Largest size of recorded answers in bytes; a run whose script queried more cannot resume from a checkpoint."""
ENTRY = 32
"""Smallest size counted for an entry [bytes]."""

COMMAND, READ, NAMES, ERROR = "command", "look", "names", "error"
ASK, ALONE, CALL, DONE = "ask", "alone", "call", "done"
_ERRORS: dict[str, type[HpcdemError]] = {
    kind.__name__: kind for kind in (HpcdemError, CommandError, EquilibriumError, PhysicsError, UsageError)
}


class Journal:
    """entries, in order: [COMMAND, checksum]; [READ, answer]; [NAMES, variables and functions] of a restored file;
    [ERROR, kind, file, line, message] of a command or look that failed; [ASK, checksum] of a method of particles, its
    READ or ERROR follows, or [ALONE, answer] if it sees one rank only (None: there were several); [CALL, number] and
    [DONE] around what a function did that was called in the middle of a command or method.

    functions: those that are called so, by number. keeps_calls: ASK and what follows are kept, as they have not always
    been. lost: there was too much to keep, `when_lost` was called. failure: the script took another way than before; it
    cannot get past this by catching the error."""

    def __init__(self, when_lost: Callable[[], None] = lambda: None) -> None:
        self.entries: list[list[Any]] = []
        self.lost = False
        self.when_lost = when_lost
        self.failure: UsageError | None = None
        self.functions: list[Callable[[], object]] = []
        self.keeps_calls = True
        self._bytes = 0
        self._past: list[list[Any]] = []
        self._at = 0

    # ---- while a script runs -------------------------------------------------------------------------------------

    def note(self, *entry: Any) -> None:
        """Add an entry."""
        self._bytes += ENTRY + sum(len(part) for part in entry[1:2] if isinstance(part, str))
        if not self.lost and self._bytes > MOST:
            self.lost = True
            self.entries.clear()
            self.when_lost()
        if not self.lost:
            self.entries.append(list(entry))

    def note_error(self, error: HpcdemError) -> None:
        """Record that a command or query failed; the script may catch the error and continue."""
        if isinstance(error, ScriptError):
            self.note(ERROR, "ScriptError", error.file, error.line, error.message)
        elif type(error).__name__ in _ERRORS:
            self.note(ERROR, type(error).__name__, "", 0, str(error))

    def query(self, make: Callable[[], Any]) -> Any:
        """Return the result of `make`, or the recorded one when replaying."""
        if self.replays:
            self._fail_again()
            if self._past[self._at][0] != READ:
                raise self._differs("the script reads values of the model that it did not read there before")
            return decoded(self._next()[1])
        try:
            value = make()
        except HpcdemError as error:
            self.note_error(error)
            raise
        if not self.lost:
            self.note(READ, encoded(value))
        return value

    def ask(self, checksum: int, make: Callable[[], Any], again: Callable[[], Any] | None, fails_again: bool) -> Any:
        """Answer of a method of particles, which may also change them, with these arguments. again: what is done in
        its place on the way back, None: nothing, the answer is that of the first time. fails_again: what failed is not
        tried again then, the error is."""
        if not self.replays:
            self.note(ASK, checksum)
            return self.query(make)
        self._meet_call(checksum)
        if again is None:
            self.call_again()
            return self.query(make)
        if fails_again:
            self._fail_again()
        try:
            return again()
        finally:
            if self.replays and self._past[self._at][0] in (READ, ERROR):
                self._next()

    def ask_alone(self, checksum: int, make: Callable[[], Any], again: bool, alone: bool) -> Any:
        """Answer of a query of this rank's particles, which are all particles if it is alone. again: ask it on the way
        back, too. UsageError on the way back if there were several ranks the first time."""
        if not self.replays:
            value = make()
            self.note(ASK, checksum)
            self.note(ALONE, encoded(value) if alone and not self.lost else None)
            return value
        self._meet_call(checksum)
        if self._past[self._at][0] != ALONE:
            raise self._differs(_NO_CALL)
        answer = self._next()[1]
        if again:
            return make()
        if answer is None:
            raise UsageError("no answer")
        return decoded(answer)

    def _meet_call(self, checksum: int) -> None:
        if self._past[self._at] != [ASK, checksum]:
            raise self._differs(_NO_CALL)
        self._next()

    # ---- functions that are called in the middle of a command ------------------------------------------------------

    def call(self, number: int) -> object:
        """Call a function, and note what it does."""
        if self.replays:
            if self._past[self._at] != [CALL, number]:
                raise self._differs("a function is called that was not called there before")
            self._next()
        else:
            self.note(CALL, number)
        value = self.functions[number]()
        if not self.replays:
            self.note(DONE)
        elif self._next()[0] != DONE:
            raise self._differs("a function that is called at some steps executes less than before")
        return value

    def call_again(self) -> None:
        """Call the functions that the skipped command or method had called."""
        while self.replays and self._past[self._at][0] == CALL:
            number = self._past[self._at][1]
            if number >= len(self.functions):
                raise self._differs("a function that was called here before is missing")
            self.call(number)

    # ---- bringing it back ----------------------------------------------------------------------------------------

    def replay(self, entries: list[list[Any]]) -> None:
        """Answer with these entries from now on, until they are used up. The last one, and calls of functions in it, is
        the command in which the checkpoint was written."""
        inside = 0
        last = len(entries) - 1
        while last >= 0 and (inside or entries[last][0] == DONE):
            inside += {DONE: 1, CALL: -1}.get(entries[last][0], 0)
            last -= 1
        if last < 0 or entries[last][0] != COMMAND:
            raise UsageError("the checkpoint is damaged: its journal does not end with a command")
        self._past, self._at = entries, 0

    @property
    def replays(self) -> bool:
        """Return whether the journal still replays recorded entries."""
        if self.failure is not None:
            raise self.failure
        return self._at < len(self._past)

    def meet(self, checksum: int) -> bool:
        """Compare the next command of the script with the recorded one.

        Returns True if the run continues with this command, False if the command is skipped; functions that it had
        called are called. Raises UsageError if it is another command, and an error that it had raised."""
        if self._past[self._at] != [COMMAND, checksum]:
            raise self._differs("another line, or other values, were executed there before")
        self._next()
        self.call_again()
        if not self.replays:
            return True
        self._fail_again()
        return False

    def names(self) -> dict[str, Any] | None:
        """Return the names that the command just skipped had restored, if it was `model restore`."""
        return self._next()[1] if self.replays and self._past[self._at][0] == NAMES else None

    def _fail_again(self) -> None:
        if self._past[self._at][0] == ERROR:
            _, kind, file, line, message = self._next()
            raise ScriptError(file, line, message) if kind == "ScriptError" else _ERRORS[kind](message)

    def _next(self) -> list[Any]:
        entry = self._past[self._at]
        self._at += 1
        self.note(*entry)
        return entry

    def _differs(self, why: str) -> UsageError:
        self.failure = UsageError(
            f"{why}: the script was changed, or its path depends on the clock or on changed files. Start again, or "
            "start another script with pcdc model restore"
        )
        return self.failure


_NO_CALL = "another call, or other values, were executed there before"


def described(value: Any) -> str:
    """An argument of a method as text that is the same in each run: for its checksum."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        return f"{value.dtype.str}{value.shape}{zlib.crc32(np.ascontiguousarray(value).tobytes())}"
    if isinstance(value, dict):
        return "{" + ",".join(f"{name}:{described(value[name])}" for name in sorted(value, key=str)) + "}"
    if isinstance(value, (tuple, list)):
        return "(" + ",".join(map(described, value)) + ")"
    if isinstance(value, os.PathLike):
        return repr(os.fspath(value))
    if value is None or isinstance(value, (str, int, float)) or is_dataclass(value):
        return repr(value)
    return str(getattr(value, "__qualname__", type(value).__qualname__))


def encoded(value: Any) -> str:
    """A value as JSON text, to the last bit: numbers, truth values, texts, tuples and dicts of them (keys: texts
    or whole numbers), and arrays of numpy."""
    return json.dumps(_encoded(value))


def _encoded(value: Any) -> list[Any]:
    if isinstance(value, np.ndarray):
        packed = zlib.compress(np.ascontiguousarray(value).tobytes(), 1)
        return ["array", value.dtype.str, list(value.shape), base64.b64encode(packed).decode("ascii")]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, tuple):
        return ["tuple", [_encoded(item) for item in value]]
    if isinstance(value, dict) and not all(isinstance(name, str) for name in value):
        return ["pairs", [[name, _encoded(item)] for name, item in value.items()]]
    if isinstance(value, dict):
        return ["dict", {name: _encoded(item) for name, item in value.items()}]
    if isinstance(value, float):
        return ["float", value.hex()]
    return ["plain", value]


def decoded(text: str) -> Any:
    """Inverse of `encoded`. UsageError for what it cannot have made."""
    try:
        return _decoded(json.loads(text))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, zlib.error) as problem:
        raise UsageError(f"the checkpoint is damaged: an answer in its journal: {problem!r}") from None


def _decoded(given: list[Any]) -> Any:
    kind, *rest = given
    if kind == "array":
        dtype = np.dtype(rest[0])
        if dtype.kind not in "biufU":
            raise ValueError(f"an array of {rest[0]}")
        size = dtype.itemsize * math.prod(rest[1])
        data = zlib.decompressobj().decompress(base64.b64decode(rest[2], validate=True), size + 1)
        return np.frombuffer(data, dtype).reshape(rest[1]).copy()
    if kind == "dict":
        return {name: _decoded(item) for name, item in rest[0].items()}
    if kind == "tuple":
        return tuple(_decoded(item) for item in rest[0])
    if kind == "pairs":
        return {name: _decoded(item) for name, item in rest[0]}
    return float.fromhex(rest[0]) if kind == "float" else {"plain": rest[0]}[kind]
