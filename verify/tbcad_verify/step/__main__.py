"""The child process: `python -m tbcad_verify.step SECONDS PROCESSES FILE ANSWER [FILE ANSWER ...]`.

It reads each FILE twice, in forks of its own, and writes JSON, or why it cannot be read.
"""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from tbcad_verify.step.forks import for_each
from tbcad_verify.step.text import read_text


def read_file(read_solid: Callable[[Path], dict[str, Any]], file: Path, answer: Path) -> None:
    """Read one file as text and by the kernel, and write the answer."""
    try:
        content: dict[str, Any] = {"text": read_text(file), "solid": read_solid(file)}
    except ValueError as error:
        content = {"refused": str(error)}
    except Exception as error:
        content = {"refused": f"{type(error).__name__}: {error}"}
    write(answer, content)


def write(answer: Path, content: dict[str, Any]) -> None:
    """Write an answer; it appears whole or not at all."""
    draft = answer.with_suffix(".draft")
    draft.write_text(json.dumps(content), encoding="utf-8")
    draft.replace(answer)


def main(seconds: float, processes: int, paths: list[Path]) -> None:
    """Read all files, each within a time limit."""
    gc.disable()  # it would go through the kernel's names again and again while they are loaded
    from tbcad_verify.step.kernel.reading import read_solid

    pairs = list(zip(paths[::2], paths[1::2], strict=True))
    for (_, answer), reason in for_each(partial(read_file, read_solid), pairs, seconds, processes):
        if reason:
            write(answer, {"refused": reason})


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]), [Path(path) for path in sys.argv[3:]])
