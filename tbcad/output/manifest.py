"""manifest.json: what was written, and by which versions."""

import hashlib
import platform
import stat
from importlib.metadata import version
from pathlib import Path

from pydantic import ValidationError

from tbcad.records.manifest import NAME, SCHEMA, Entry, Kind, Manifest
from tbcad.version import __version__

MANIFEST, VERDICT, REPORT = NAME, "verify.json", "report.html"
# Written after the manifest, and not in it: verdict and page come when the files are verified.
UNLISTED = (MANIFEST, VERDICT, REPORT)
# How report.html begins, so that no page of the user is taken for it.
REPORT_BEGIN = "<!doctype html>\n<!-- tbcad report -->"
LIBRARIES = ("cadquery-ocp", "numpy", "scipy", "manifold3d", "lib3mf", "trimesh")

_MAX_MANIFEST_BYTES = 4_000_000


def write_manifest(folder: Path, kind: Kind) -> None:
    """Write manifest.json over all files of the folder but itself, the verdict and the page.

    Files in folders of the folder are listed with their path: images/a0001.png.
    """
    paths = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if is_file(path))
    names = sorted(name for name in paths if name not in UNLISTED)
    versions = {"tbcad": __version__, **{name: version(name) for name in LIBRARIES}}
    Manifest(
        schema_name=SCHEMA,
        kind=kind,
        files={name: Entry.model_validate(fingerprint(folder / name)) for name in names},
        versions={**versions, "python": platform.python_version()},
    ).write(folder / MANIFEST)


def fingerprint(path: Path) -> dict[str, str | int]:
    """sha256 and size of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    return {"sha256": digest.hexdigest(), "size": path.stat().st_size}


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest of a folder if tbcad can have written it, None for any other file."""
    path = folder / MANIFEST
    try:
        if not is_file(path) or path.lstat().st_size > _MAX_MANIFEST_BYTES:
            return None
        return Manifest.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def is_listed(path: Path, entry: Entry | None) -> bool:
    """Tell whether a file is as its entry in the manifest says; no entry is no."""
    # The size first: it settles most without reading the file.
    return (
        entry is not None
        and is_file(path)
        and entry.size == path.lstat().st_size
        and entry.model_dump() == fingerprint(path)
    )


def is_report(path: Path) -> bool:
    """Tell a page of `tbcad report` from any other file."""
    begin = REPORT_BEGIN.encode()
    if not is_file(path):
        return False
    with path.open("rb") as file:
        return file.read(len(begin)) == begin


def is_file(path: Path) -> bool:
    """Tell a plain file from folders, links and devices."""
    return stat.S_ISREG(path.lstat().st_mode)
