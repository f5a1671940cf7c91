"""`python -m faults`: see cli.py."""

from faults.cli import main

main()
