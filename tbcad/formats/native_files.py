"""Files that native libraries write: they may report a full disk late, oddly, or not at all."""

import errno
from pathlib import Path

TAIL_BYTES = 64  # of a file, in which its last mark must be


def incomplete(path: Path) -> OSError:
    """The error of a file that could not be written in full."""
    return OSError(errno.EIO, "a file could not be written in full; is the disk full?", str(path))


def check_complete(path: Path, mark: bytes) -> None:
    """Check that a file is there and ends as its format demands.

    Args:
        path: of the file.
        mark: that is among its last bytes.

    Raises:
        OSError: it is missing or cut.
    """
    if not path.is_file():
        raise incomplete(path)
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - TAIL_BYTES, 0))
        if mark not in file.read():
            raise incomplete(path)
