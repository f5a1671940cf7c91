"""Limits of what the page may request. Larger specimens are made on the command line only."""

from __future__ import annotations

LIMITS: dict[str, tuple[float, float]] = {
    "number": (10, 20_000),
    "slenderness": (0.2, 5.0),
    "void_ratio": (0.1, 3.0),
    "l_over_d": (1.0, 4.0),
    "deviation": (0.0, 54.5),
    "roundness": (0.0, 1.0),
    "seed": (0, 2**53 - 1),  # whole numbers that a browser can hold
}
"""Least and largest value of each field with a slider or a number."""
MOST_ROWS = 60
"""Largest number of rows of the table."""
KINDS: dict[str, tuple[type, ...]] = {
    **dict.fromkeys(("source", "frame", "width", "height", "number", "column", "row", "since"), (int,)),
    **dict.fromkeys(("object", "format", "label", "name", "what", "text", "line", "language", "stamp"), (str,)),
    **dict.fromkeys(("x", "chart", "to"), (str,)),
    **dict.fromkeys(("fine", "dark"), (bool,)),
    "fps": (float, int), "view": (dict,), "y": (list,),
}  # fmt: skip
"""Kinds of the arguments of requests to `hpcdem view`, by name, for all calls; null means not given."""
MOST_PIXELS = 3840 * 2160
"""Largest number of pixels of a picture of `hpcdem view`; larger windows enlarge the picture."""
LONGEST_SIDE = 4096
"""Largest number of pixels along a side."""
PICTURES = 16
"""Largest number of simultaneous requests for pictures, clicks and lists of fields; the other CONVERSATIONS remain for
requests without a picture, such as to interrupt a run."""
LONGEST_FILM = 1000
"""Largest number of frames of a film made by the page."""
