"""The tables of benchmarks/README.md are those of the committed JSON files."""

import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "benchmarks"


def test_tables_are_made_from_the_results() -> None:
    code = "import sys; from table import filled; sys.stdout.write(filled(sys.stdin.read()))"
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert {"<!-- table: all -->", "<!-- table: commands -->"} <= set(page.splitlines())
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=FOLDER,
        input=page,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert run.stdout == page
