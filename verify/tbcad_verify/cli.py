"""Command line: `python -m tbcad_verify DIR`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tbcad_verify.errors import BadExport
from tbcad_verify.printing.profile import built_in
from tbcad_verify.run.verify import Options, verify
from tbcad_verify.run.watch import SECONDS

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
    parser.add_argument(
        "--printer",
        metavar="NAME|FILE",
        action="append",
        default=[],
        help=f"fail unless every part suits this machine: {', '.join(built_in())}, or a TOML file",
    )
    parser.add_argument(
        "--clients", action="store_true", help="ask FreeCAD, gmsh, PrusaSlicer and admesh too"
    )
    parser.add_argument(
        "--time-limit", metavar="S", type=float, default=SECONDS, help="seconds for each stage"
    )
    options = parser.parse_args(argv)
    if not options.time_limit > 0:
        parser.error("--time-limit must be more than 0 seconds")
    try:
        wishes = Options(
            seconds=options.time_limit,
            printers=tuple(options.printer),
            clients=options.clients,
        )
        return _verify(options.folder, wishes, options.quiet)
    except BadExport as error:
        print(f"tbcad_verify: {error}", file=sys.stderr)
        return 2


def _verify(folder: Path, wishes: Options, quiet: bool) -> int:
    from rich.console import Console

    report = verify(folder, (lambda _: None) if quiet else _say, wishes)
    if quiet:
        print(report.verdict)
    else:
        report.show(Console() if sys.stdout.isatty() else Console(width=WIDE))
    return 0 if report.passed else 1


def _say(stage: str) -> None:
    print(f"verify: {stage}", file=sys.stderr, flush=True)
