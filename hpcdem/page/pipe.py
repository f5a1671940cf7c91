"""The words between `hpcdem console --pipe` and the page that started it."""

MARK = "\x1e"
"""Begins a line that is for the page, not for the reader: JSON with the entry `what`."""
READY, DONE = "ready", "done"
