"""Command line: `python -m tbcad_verify DIR`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tbcad_verify.errors import BadExport
from tbcad_verify.printing.profile import built_in
from tbcad_verify.run.verify import VerifyOptions, verify
from tbcad_verify.run.watch import STAGE_LIMIT_S

ABOUT = """Verify the files in DIR, which `tbcad build` wrote: every virtual camera sees the whole
object, and the parts are those of the record. The result is written to DIR/verify.json.
Exit status: 0 verified, 1 not verified, 2 DIR is not an export."""
PIPED_WIDTH = 160  # columns of the table when stdout is no terminal


def main(argv: Sequence[str] | None = None) -> int:
    """Verify a folder, print the table and the verdict.

    Args:
        argv: arguments without the program's name; None: those of the process.

    Returns:
        0 verified, 1 not verified, 2 bad input.
    """
    parser = argparse.ArgumentParser("tbcad_verify", description=ABOUT)
    parser.add_argument("folder", metavar="DIR", type=Path, help="a folder that tbcad build wrote")
    parser.add_argument("-q", "--quiet", action="store_true", help="print the verdict only")
    parser.add_argument(
        "--printer",
        metavar="NAME|FILE",
        action="append",
        default=[],
        help="fail unless every part can be made by this printer: "
        f"{', '.join(built_in())}, or a TOML file; repeatable",
    )
    parser.add_argument(
        "--clients", action="store_true", help="also ask FreeCAD, gmsh, PrusaSlicer and admesh"
    )
    parser.add_argument(
        "--time-limit",
        metavar="S",
        type=float,
        default=STAGE_LIMIT_S,
        help="seconds for each stage, file and program (default: %(default)g)",
    )
    arguments = parser.parse_args(argv)
    if not arguments.time_limit > 0:
        parser.error("--time-limit must be more than 0 seconds")
    options = VerifyOptions(
        seconds=arguments.time_limit,
        printers=tuple(arguments.printer),
        clients=arguments.clients,
    )
    try:
        return _verify(arguments.folder, options, arguments.quiet)
    except BadExport as error:
        print(f"tbcad_verify: {error}", file=sys.stderr)
        return 2


def _verify(folder: Path, options: VerifyOptions, quiet: bool) -> int:
    from rich.console import Console

    report = verify(folder, (lambda _: None) if quiet else _print_stage, options)
    if quiet:
        print(report.verdict)
    else:
        report.show(Console() if sys.stdout.isatty() else Console(width=PIPED_WIDTH))
    return 0 if report.passed else 1


def _print_stage(stage: str) -> None:
    print(f"verify: {stage}", file=sys.stderr, flush=True)
