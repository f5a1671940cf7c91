"""`python -m bench`: see cli.py."""

from bench.cli import main

main()
