"""Where a user's program is, and how its mistakes are told."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hpcdem import session
from hpcdem.core.errors import CommandError, EquilibriumError, HpcdemError, ScriptError

PACKAGE = str(Path(__file__).resolve().parent.parent)
HELP = "see help(hpcdem.Simulation)"


def place() -> tuple[str, int]:
    """File and line of the user's program that is being carried out."""
    frame: Any = sys._getframe(1)
    while frame is not None and frame.f_code.co_filename.startswith(PACKAGE):
        frame = frame.f_back
    return (frame.f_code.co_filename, frame.f_lineno) if frame is not None else ("python", 0)


def carried_out(at: tuple[str, int], name: str, make: Callable[[], Any], advice: str = HELP) -> Any:
    """What `make` returns. Errors of a command leave with file and line of the program; values of a wrong kind too."""
    session.refuse_after_stop()
    try:
        return make()
    except CommandError as error:
        raise ScriptError(*at, f"{name}: {error}") from error
    except EquilibriumError as error:
        raise EquilibriumError(f"{at[0]}:{at[1]}: {name}: {error}") from error
    except (TypeError, ValueError) as error:
        if raised_by_the_user(error):
            raise
        raise ScriptError(*at, f"{name}: {error}; {advice}") from error
    except HpcdemError as error:
        if type(error) is not HpcdemError:
            raise
        # A file that could not be written: the line is not wrong, the exit code is that of a run that failed.
        raise HpcdemError(f"{at[0]}:{at[1]}: {name}: {error}") from error


def raised_by_the_user(error: BaseException) -> bool:
    """Whether a function of the program, called by us, raised it: then it is the program's affair."""
    trace, inside = error.__traceback__, False
    while trace is not None:
        ours = trace.tb_frame.f_code.co_filename.startswith(PACKAGE)
        if inside and not ours and "site-packages" not in trace.tb_frame.f_code.co_filename:
            return True
        inside, trace = inside or ours, trace.tb_next
    return False
