"""Errors a user can act on, and the exit codes of the programs.

A message is one clear sentence (``file:line: what was read, what was expected``); the command line prints it
without a traceback and stops every rank.
"""

from __future__ import annotations

EXIT_OK = 0
EXIT_ERROR = 1
"""Exit code of a run that failed: physics (NaN, runaway particle), files, launch."""
EXIT_USAGE = 2
"""Exit code of an invalid command line or script; nothing was run or written."""
EXIT_UNBALANCED = 3
"""Exit code of a script that requires equilibrium (model solve) which the model did not reach."""
EXIT_CHECKPOINT = 85
"""Exit code of a run stopped on request (signal or time limit) after writing a checkpoint; run again with --resume.
HTCondor uses 85 for "checkpointed, please start me again"."""


class HpcdemError(Exception):
    """A failure that is explained by its message alone."""

    exit_code = EXIT_ERROR


class UsageError(HpcdemError):
    """A wrong command line or launch."""

    exit_code = EXIT_USAGE


class ScriptError(HpcdemError):
    """A script line that cannot be understood or executed: ``file:line: message``."""

    exit_code = EXIT_USAGE

    def __init__(self, file: str, line: int, message: str) -> None:
        super().__init__(f"{file}:{line}: {message}")
        self.file, self.line, self.message = file, line, message


class WrongValueError(ScriptError, ValueError):
    """A line of a Python program gives a value that makes no sense; it can be caught as a ValueError too."""


class WrongTypeError(ScriptError, TypeError):
    """A line of a Python program gives a value of a wrong kind, or an unknown argument: a TypeError too."""


class UnknownNameError(ScriptError, KeyError):
    """A line of a Python program requests an unknown field: a KeyError too."""

    __str__ = Exception.__str__  # that of KeyError puts the sentence in quotes


class CommandError(HpcdemError):
    """A command received values that make no sense; the script language adds file and line."""

    exit_code = EXIT_USAGE


class PhysicsError(HpcdemError):
    """The state became invalid: a number is not finite, or a particle moves too far in one step."""


class EquilibriumError(HpcdemError):
    """The steps do not reach the required equilibrium."""

    exit_code = EXIT_UNBALANCED


class StoppedWithCheckpoint(BaseException):
    """The run stopped on request after writing a checkpoint. It is no error that a script could handle: like
    KeyboardInterrupt, it passes `except Exception`."""

    exit_code = EXIT_CHECKPOINT
