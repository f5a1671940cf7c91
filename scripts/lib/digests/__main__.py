"""`python -m digests`: see cli.py."""

from digests.cli import main

main()
