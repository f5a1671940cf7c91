"""Measurements of finished runs: what the program `hpcdem measure` writes, and the functions behind it for programs of
one's own. Modules by subject; `report.py` runs them over the frames of a folder."""
