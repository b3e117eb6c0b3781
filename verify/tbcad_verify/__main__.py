"""`python -m tbcad_verify DIR`."""

from __future__ import annotations

import sys

from tbcad_verify.cli import main

if __name__ == "__main__":
    sys.exit(main())
