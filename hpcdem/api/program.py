"""Errors in a user's program, reported with its file and line."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from typing import Any

from hpcdem import session
from hpcdem.core.errors import CommandError, EquilibriumError, HpcdemError, ScriptError, WrongTypeError, WrongValueError
from hpcdem.core.nearest import hint
from hpcdem.core.place import PACKAGE

HELP = "see help(hpcdem.Simulation)"
_BOTH = (("color", "colour"), ("colors", "colours"), ("center", "centre"))
TWINS = {one: other for pair in _BOTH for one, other in (pair, pair[::-1])}
"""Words with two spellings."""
_UNKNOWN = re.compile(r"got an unexpected keyword argument '(\w+)'")
_OWN_NAME = re.compile(r"^\w+(\.\w+)*\(\) ")


def spelt(options: dict[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Return the arguments by the names of the method: color is colour, and center is centre."""
    twins = {name: TWINS[name] for name in options if name not in names and TWINS.get(name) in names}
    if any(twin in options for twin in twins.values()):
        return options  # both: the method says that one is too many
    return {twins.get(name, name): value for name, value in options.items()}


def carried_out(
    at: tuple[str, int], name: str, make: Callable[[], Any], advice: str = HELP, names: Collection[str] = ()
) -> Any:
    """Return the result of `make`. Errors of a command, and values of a wrong type, get file and line of the program.
    names: arguments of the method; the nearest is suggested for a mistyped one.
    """
    session.refuse_after_stop()
    try:
        return make()
    except ScriptError:
        raise
    except CommandError as error:
        raise WrongValueError(*at, f"{name}: {error}") from error
    except EquilibriumError as error:
        raise EquilibriumError(f"{at[0]}:{at[1]}: {name}: {error}") from error
    except (TypeError, ValueError) as error:
        if raised_by_the_user(error):
            raise
        kind = WrongTypeError if isinstance(error, TypeError) else WrongValueError
        raise kind(*at, f"{name}: {_wrong(str(error), names)}; {advice}") from error
    except HpcdemError as error:
        if type(error) is not HpcdemError:
            raise
        # A file that could not be written: the line is not wrong, the exit code is that of a run that failed.
        raise HpcdemError(f"{at[0]}:{at[1]}: {name}: {error}") from error


def _wrong(text: str, names: Collection[str]) -> str:
    """Shorten Python's message about a call, and suggest the argument that was meant."""
    if (found := _UNKNOWN.search(text)) and names:
        return f"there is no argument '{found[1]}'{hint(found[1], names)}; available: {', '.join(names)}"
    return _OWN_NAME.sub("", text)


def raised_by_the_user(error: BaseException) -> bool:
    """Return whether a function of the user's program, called by hpcdem, raised the error."""
    trace, inside = error.__traceback__, False
    while trace is not None:
        ours = trace.tb_frame.f_code.co_filename.startswith(PACKAGE)
        if inside and not ours and "site-packages" not in trace.tb_frame.f_code.co_filename:
            return True
        inside, trace = inside or ours, trace.tb_next
    return False
