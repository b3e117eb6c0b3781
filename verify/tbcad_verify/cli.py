"""Command line: `python -m tbcad_verify DIR`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tbcad_verify.errors import BadExport

ABOUT = """Prove on the files in DIR, which `tbcad build` wrote, that every virtual camera sees the
whole object. Writes DIR/verify.json. Exit status: 0 proved, 1 not proved, 2 DIR is no export."""
WIDE = 160  # columns of the table when nobody's terminal says otherwise


def main(argv: Sequence[str] | None = None) -> int:
    """Verify a folder, print the table and the verdict.

    Args:
        argv: arguments without the program's name; None takes the process's own.

    Returns:
        0 proved, 1 not proved, 2 bad input.
    """
    parser = argparse.ArgumentParser("tbcad_verify", description=ABOUT)
    parser.add_argument("folder", metavar="DIR", type=Path, help="a folder that tbcad build wrote")
    parser.add_argument("-q", "--quiet", action="store_true", help="print the verdict only")
    options = parser.parse_args(argv)
    try:
        return _verify(options.folder, options.quiet)
    except BadExport as error:
        print(f"tbcad_verify: {error}", file=sys.stderr)
        return 2


def _verify(folder: Path, quiet: bool) -> int:
    from rich.console import Console

    from tbcad_verify.proof import verify

    report = verify(folder, (lambda _: None) if quiet else _say)
    if quiet:
        print(report.verdict)
    else:
        report.show(Console() if sys.stdout.isatty() else Console(width=WIDE))
    return 0 if report.passed else 1


def _say(stage: str) -> None:
    print(f"verify: {stage}", file=sys.stderr, flush=True)
