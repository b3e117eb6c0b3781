"""The child process: `python -m tbcad_verify.step FILE ANSWER` reads FILE twice, writes JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tbcad_verify.step.kernel import read_solid
from tbcad_verify.step.text import read_text

if __name__ == "__main__":
    file, answer = map(Path, sys.argv[1:])
    try:
        found = {"text": read_text(file), "solid": read_solid(file)}
    except ValueError as error:
        sys.exit(str(error))
    answer.write_text(json.dumps(found), encoding="utf-8")
