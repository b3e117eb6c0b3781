"""The child process: `python -m tbcad_verify.step FILE ANSWER [FILE ANSWER ...]`.

It reads each FILE twice and writes JSON, or why it cannot be read.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from tbcad_verify.step.kernel import read_solid
from tbcad_verify.step.text import read_text


def main(file: Path, answer: Path) -> None:
    """Read one file; the answer appears whole or not at all."""
    try:
        content: dict[str, Any] = {"text": read_text(file), "solid": read_solid(file)}
    except ValueError as error:
        content = {"refused": str(error)}
    draft = answer.with_suffix(".draft")
    draft.write_text(json.dumps(content), encoding="utf-8")
    draft.replace(answer)


if __name__ == "__main__":
    for pair in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        main(*map(Path, pair))
