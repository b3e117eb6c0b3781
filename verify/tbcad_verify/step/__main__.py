"""The child process: `python -m tbcad_verify.step SECONDS PROCESSES FILE ANSWER ORIGINAL [...]`.

It reads each FILE twice, in forks of this process, and writes JSON, or why it cannot be read. The
kernel reads no FILE that is the mirror image of its ORIGINAL; one without an original has itself
there.
"""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tbcad_verify.step.forks import Paths, for_each
from tbcad_verify.step.mirror_image import is_mirror_image
from tbcad_verify.step.text import ascii_text, read_text

SMALL_BYTES = 100_000  # the kernel reads such a file in the time of some forks


def read_file(
    read_solid: Callable[[Path], dict[str, Any]], file: Path, answer: Path, original: Path
) -> None:
    """Read one file as text and by the kernel, and write the answer.

    Its solid is none where the kernel need not read it.
    """
    try:
        content: dict[str, Any] = {"text": read_text(file), "solid": None}
        if original == file or not is_mirror_image(*(ascii_text(one) for one in (original, file))):
            content["solid"] = read_solid(file)
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
    jobs = list(zip(paths[::3], paths[1::3], paths[2::3], strict=True))
    work = partial(read_file, _kernel())
    for (_, answer, _), reason in for_each(work, _batches(jobs), seconds, processes):
        if reason:
            write(answer, {"refused": reason})


def _kernel() -> Callable[[Path], dict[str, Any]]:
    """What reads a solid, loaded without looking for garbage among the kernel's many names."""
    enabled = gc.isenabled()
    gc.disable()
    from tbcad_verify.step.kernel.reading import read_solid

    gc.freeze()
    if enabled:
        gc.enable()
    return read_solid


def _batches(jobs: Sequence[Paths]) -> list[list[Paths]]:
    """Large files each in a fork of its own, then all small ones in one."""
    small = [job for job in jobs if job[0].stat().st_size < SMALL_BYTES]
    large = [[job] for job in jobs if job not in small]
    return [*large, small] if small else large


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]), [Path(path) for path in sys.argv[3:]])
