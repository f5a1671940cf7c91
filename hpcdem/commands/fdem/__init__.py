"""The commands of a model of blocks: one function per command, called by the language PCDC and by Python programs.

The first argument is the `Project`: the simulation and what a script has prepared for it. All are collective and
raise CommandError for what makes no sense, equal on all ranks.
"""

from hpcdem.commands.fdem.project import Project

__all__ = ["Project"]
