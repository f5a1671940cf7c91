"""Ensembles: one script with many values of its parameters, each member a run in a folder of its own.

`design` makes the members, `plan` keeps them on disk, `member` carries one out, `driver` many at once on this machine,
`array` hands them to Slurm, `tables` and `figures` make the report. From Python: `Sweep` (docs/sweep.md).
"""

from hpcdem.sweep.api import Sweep

__all__ = ["Sweep"]
