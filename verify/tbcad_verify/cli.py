"""Command line: `python -m tbcad_verify DIR`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tbcad_verify.as_built.verify import verify_as_built
from tbcad_verify.errors import BadExport
from tbcad_verify.printing.profile import built_in
from tbcad_verify.report.report import Output
from tbcad_verify.report.text import WIDTH
from tbcad_verify.run.verify import LARGEST_CUTTER_MM, STAGE_LIMIT_S, VerifyOptions, verify
from tbcad_verify.types import Progress

ABOUT = """Verify the files in DIR, which `tbcad build` wrote: every virtual camera sees the whole
object, and the parts are those of the record. The result is written to DIR/verify.json.
Exit status: 0 verified, 1 not verified, 2 DIR is not a build."""
INTERRUPTED = 130  # exit status of a program that is stopped from the keyboard
OUTPUTS = {
    "full": "print every check, too",
    "quiet": "print the verdict only",
    "json": "print the summary as JSON",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Verify a folder, print the summary.

    Args:
        argv: arguments without the program's name; None: those of the process.

    Returns:
        0 verified, 1 not verified, 2 bad input.
    """
    parser = argparse.ArgumentParser("tbcad_verify", description=ABOUT)
    parser.add_argument("folder", metavar="DIR", type=Path, help="a folder that tbcad build wrote")
    for name, text in OUTPUTS.items():
        flags = [f"--{name}", *(["-q"] if name == "quiet" else [])]
        parser.add_argument(*flags, action="append_const", dest="output", const=name, help=text)
    parser.add_argument(
        "--printer",
        metavar="NAME|FILE",
        action="append",
        default=[],
        help="fail unless every part can be made by this printer: "
        f"{', '.join(built_in())}, or a TOML file; repeatable",
    )
    parser.add_argument(
        "--cutter",
        metavar="MM",
        type=float,
        help="fail unless a ball cutter of this radius reaches all mirrors of a mandrel",
    )
    parser.add_argument(
        "--strict", action="store_true", help="fail also where lists or other paper were changed"
    )
    parser.add_argument(
        "--clients", action="store_true", help="also ask FreeCAD, gmsh and PrusaSlicer"
    )
    parser.add_argument(
        "--as-built",
        metavar="DIR",
        type=Path,
        help="instead of the files, verify the prototype as tbcad calibrate found it",
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
    if arguments.cutter is not None and not 0 < arguments.cutter <= LARGEST_CUTTER_MM:
        parser.error(f"--cutter must be above 0 and at most {LARGEST_CUTTER_MM:g} mm")
    options = VerifyOptions(
        seconds=arguments.time_limit,
        printers=tuple(arguments.printer),
        clients=arguments.clients,
        strict=arguments.strict,
        cutter_mm=arguments.cutter,
    )
    outputs = dict.fromkeys(arguments.output or ["summary"])
    if len(outputs) > 1:
        return _refused(f"{' and '.join(f'--{name}' for name in outputs)}: give only one of them")
    try:
        if arguments.as_built is not None:
            return _verify_as_built(arguments.folder, arguments.as_built, *outputs)
        return _verify(arguments.folder, options, *outputs)
    except BadExport as error:
        return _refused(str(error))
    except KeyboardInterrupt:
        print("tbcad_verify: stopped; nothing was changed", file=sys.stderr)
        return INTERRUPTED


def _verify(folder: Path, options: VerifyOptions, output: Output) -> int:
    from rich.console import Console

    silent = output == "quiet"
    report = verify(folder, (lambda _: None) if silent else _stage_printer(), options)
    report.show(Console() if sys.stdout.isatty() else Console(width=WIDTH), output)
    return 0 if report.passed else 1


def _verify_as_built(folder: Path, calibration: Path, output: Output) -> int:
    from rich.console import Console

    report = verify_as_built(folder, calibration)
    report.show(Console() if sys.stdout.isatty() else Console(width=WIDTH), output)
    return 0 if report.passed else 1


def _refused(reason: str) -> int:
    print(f"tbcad_verify: {reason}", file=sys.stderr)
    return 2


def _stage_printer() -> Progress:
    started = time.monotonic()

    def show(stage: str) -> None:
        seconds = time.monotonic() - started
        print(f"[{seconds:4.0f} s] verify: {stage}", file=sys.stderr, flush=True)

    return show
