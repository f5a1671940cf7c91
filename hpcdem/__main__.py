"""`python -m hpcdem` is the program hpcdem."""

from hpcdem.cli import main

if __name__ == "__main__":
    main()
