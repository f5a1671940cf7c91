"""The words between `hpcdem console --pipe` and the page that started it."""

MARK = "\x1e"
"""First character of a line for the page instead of the reader: JSON with the entry `what`."""
READY, DONE = "ready", "done"
