"""`python -m soak`: see cli.py."""

from soak.cli import main

main()
