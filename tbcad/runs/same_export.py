"""Whether an export is that of the machine that was photographed."""

import hashlib
from pathlib import Path

from tbcad.errors import InputError
from tbcad.runs.photographs import Run


def check_same_export(run: Run, exports: Path) -> None:
    """Compare the files that the run depends on with what they were when it began.

    Raises:
        InputError: one has changed or is missing.
    """
    for name, digest in run.record.export_sha256.items():
        path = exports / name
        if not path.is_file():
            raise InputError(f"{path} is not there, but {run.folder} was photographed with it")
        if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            raise InputError(
                f"{path} is not the file that {run.folder} was photographed with: name the export "
                "of that run with --exports"
            )
