"""Whole commands as a user runs them, a process each, beside the state before they were sped up.

    python benchmarks/commands.py                 all of them
    python benchmarks/commands.py --only "n = 18" those whose name has this in it
    python benchmarks/commands.py --python OTHER/bin/python --out results/before.json

A run that was stopped goes on where it was; results of other code are measured again.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from builds import INSTALLED, Build, run
from circumstances import RESULTS, circumstances

FILE = RESULTS / "commands.json"
# At this size float32 rounding costs facets up to 0.7 mm of coverage: docs/construction.md.
LARGEST = ("--n", "60", "--set", "mirrors.margin_mm=1")
PACKAGES = "import tbcad, tbcad_verify; print(tbcad.__file__, tbcad_verify.__file__, sep='\\n')"


@dataclass(frozen=True)
class Limit:
    """What a command may take at most, as shares of the state before or in seconds.

    Attributes:
        seconds: on the clock.
        wall_share: of the clock's seconds.
        cpu_share: of the seconds of all cores.
        answer: seconds to the first answer.
    """

    seconds: float | None = None
    wall_share: float | None = None
    cpu_share: float | None = None
    answer: float | None = None


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes:
        name: in the table.
        arguments: of tbcad; EXPORT and OUT are replaced by folders.
        cold: without the machine code that an earlier command compiled.
        refused: it must be refused as bad input.
        limit: of what it takes.
        answer: words of its first answer, where that is timed.
    """

    name: str
    arguments: Sequence[str]
    cold: bool = False
    refused: bool = False
    limit: Limit = Limit()
    answer: str = ""


EXPORT, OUT = "EXPORT", "OUT"
BUILD = ("build", "--out", OUT)
TOLERANCE = ("tolerance", EXPORT, "--out", OUT)
WHOLE, SHELLS = Limit(wall_share=0.3, cpu_share=0.35), Limit(wall_share=0.5, cpu_share=0.5)
COMMANDS = (
    Command("--help", ["--help"], limit=Limit(0.3)),
    Command("bad input", ["build", "--n", "99"], refused=True, limit=Limit(0.3)),
    Command("build, n = 18", ["build", "--out", EXPORT, "--force", "--n", "18"], limit=WHOLE),
    Command("build, n = 18, the first ever", [*BUILD, "--n", "18"], cold=True),
    Command("build, n = 18, shells", [*BUILD, "--n", "18", "--parts", "shell"], limit=SHELLS),
    Command("build, n = 36", [*BUILD, "--n", "36"]),
    Command("build, n = 36, shells", [*BUILD, "--n", "36", "--parts", "shell"]),
    Command("build, n = 60, margin 1 mm", [*BUILD, *LARGEST]),
    Command("tolerance", [*TOLERANCE], limit=Limit(60)),
    Command(
        "tolerance, one process",
        [*TOLERANCE, "--process", "sla"],
        limit=Limit(60, answer=20),
        answer="Built by",
    ),
    Command("capture", ["capture", EXPORT, "--out", OUT]),
    Command("capture, the first ever", ["capture", EXPORT, "--out", OUT], cold=True),
)


def measure(commands: Sequence[Command], python: Path, file: Path, n: str = "") -> None:
    """Run what is not measured yet, and write the file after each command.

    Args:
        commands: to run.
        python: interpreter that has tbcad.
        file: to write, or to go on with.
        n: subdivision of all builds, to try the commands; none: their own.
    """
    code = digest(python)
    record = known(file, code) or {**circumstances(), "code": code, "commands": {}}
    folder = Path(tempfile.gettempdir()) / f"tbcad-benchmarks-{code}"
    folder.mkdir(exist_ok=True)
    for command in commands:
        if command.name not in record["commands"]:
            taken = one(command, python, folder, n)
            record["commands"][command.name] = asdict(taken)
            file.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
            print(
                f"{command.name}: {taken.seconds:.2f} s, {taken.cpu:.2f} s of all cores,"
                f" {taken.memory:.2f} GB",
                flush=True,
            )


def one(command: Command, python: Path, folder: Path, n: str = "") -> Build:
    """Run one command; the export that it needs is built first."""
    export = folder / f"export{n}"
    if EXPORT in command.arguments and command.arguments[0] != "build" and not export.exists():
        run(folder, "build", "--n", n or "18", "--out", str(export), python=python)
    with tempfile.TemporaryDirectory(dir=folder) as name:
        cache, out = Path(name) / "numba", Path(name) / "out"
        places = {EXPORT: str(export), OUT: str(out)}
        arguments = [places.get(argument, argument) for argument in command.arguments]
        if n and "--n" in arguments and not command.refused:
            arguments[arguments.index("--n") + 1] = n
        where = {"NUMBA_CACHE_DIR": str(cache)} if command.cold else {}
        return run(
            folder,
            *arguments,
            environment=where,
            python=python,
            refused=command.refused,
            answer=command.answer,
        )


def known(file: Path, code: str) -> dict[str, Any] | None:
    """What a file holds of this code; None: nothing."""
    if not file.exists():
        return None
    record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return record if record.get("code") == code else None


def digest(python: Path) -> str:
    """Of both packages' modules, as an interpreter finds them."""
    answer = subprocess.run(
        [python, "-c", PACKAGES],
        env=os.environ | INSTALLED,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    modules = (
        module for line in answer.stdout.splitlines() for module in Path(line).parent.rglob("*.py")
    )
    return sha256(b"".join(module.read_bytes() for module in sorted(modules))).hexdigest()[:12]


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure whole commands and write a JSON file.")
    parser.add_argument("--only", default="", help="commands whose name has this in it")
    parser.add_argument(
        "--python", type=Path, default=Path(sys.executable), help="interpreter with another tbcad"
    )
    parser.add_argument("--out", type=Path, default=FILE, help="file to write, or to go on with")
    parser.add_argument("--try", dest="n", default="", help="n of all builds, to try the commands")
    options = parser.parse_args()
    if options.n and options.out == FILE:
        parser.error("--try N measures nothing of worth: name another file with --out")
    chosen = [command for command in COMMANDS if options.only in command.name]
    measure(chosen, options.python.absolute(), options.out, options.n)


if __name__ == "__main__":
    main()
