"""`python -m tbcad`: the command `tbcad`."""

from tbcad.app.cli import main

if __name__ == "__main__":
    main()
