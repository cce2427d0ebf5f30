"""``python -m etendue``: the command line of the Python that runs, where none is on the path."""

from etendue.cli import main

if __name__ == "__main__":
    main()
