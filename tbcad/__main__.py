"""`python -m tbcad`: the command `tbcad`."""

from tbcad.cli import main

if __name__ == "__main__":
    main()
