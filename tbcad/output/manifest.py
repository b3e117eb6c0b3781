"""manifest.json: what was written, and by which versions; the kind of content of a folder."""

import hashlib
import json
import platform
import stat
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tbcad.errors import InputError
from tbcad.records.document import NAME, SCHEMA, Entry, Kind, Manifest
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
        files={name: fingerprint(folder / name) for name in names},
        versions={**versions, "python": platform.python_version()},
    ).write(folder / MANIFEST)


def fingerprint(path: Path) -> Entry:
    """sha256 and size of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    return Entry(sha256=digest.hexdigest(), size=path.stat().st_size)


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
        and entry == fingerprint(path)
    )


def written_file(folder: Path, manifest: Manifest | None, name: str, remedy: str) -> Path:
    """A file as it was written. InputError: it is missing, with a remedy, or it is another."""
    path = folder / name
    if not path.is_file():
        raise InputError(f"{path} is missing: {remedy}")
    if not is_listed(path, manifest.files.get(name) if manifest else None):
        raise InputError(
            f"{path} is not as tbcad wrote it (cut off, or changed since): build it again"
        )
    return path


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


RUN_RECORD, RUN_SCHEMA = "run.json", "tbcad-run/"  # of a run, which has no manifest
WORDS: dict[str, str] = {
    "order": "an order",
    "as-built": "solids as built",
    "": "content of tbcad of an unknown kind",
}
COSTLY: tuple[Kind, ...] = ("capture", "merged run", "calibration")  # hours, and read by others
RUNS = ("[!.]*/run.json", "[!.]*/[!.]*/run.json")
_MAX_RECORD_BYTES = 64_000_000


def kind_of(folder: Path) -> str | None:
    """The kind of content that tbcad wrote; "" where it is unknown, None for other folders."""
    if str(_record(folder / RUN_RECORD).get("schema", "")).startswith(RUN_SCHEMA):
        return "run"
    manifest = read_manifest(folder)
    return manifest.kind if manifest else None


def refuse_other_content(out: Path, target: Path, kind: Kind, force: bool) -> None:
    """Refuse to replace another kind of content, and without force what cost hours.

    out is the folder as the user names it, target its path with links resolved.

    InputError as said, or the folder is inside a folder that tbcad wrote, or above one.
    """
    refuse_inside(out, target)
    present = kind_of(target)
    if present is None:
        _refuse_inner(out, target)
        return
    if present == "run":
        raise InputError(f"{out} is a run, and photographs are not replaced: name another folder")
    if present != kind:
        raise InputError(
            f"{out} is {words(present)}, which {words(kind)} does not replace: name another "
            "folder, or remove that one"
        )
    _refuse_inner(out, target)
    if force:
        return
    if kind in COSTLY:
        raise InputError(
            f"{out} is {words(kind)} already: name another folder, or replace it with --force"
        )
    if kind == "build" and (run := next(_runs_of(target), None)):
        raise InputError(
            f"{out} is the build that {run} photographed, which is of no use without it: name "
            "another folder, or replace it with --force"
        )


def refuse_inside(out: Path, target: Path) -> None:
    """Refuse a folder inside a folder that tbcad wrote."""
    for above in target.parents:
        if (outer := kind_of(above)) is not None:
            raise InputError(f"{out} is inside {above}, {words(outer)}: name a folder outside it")


def _refuse_inner(out: Path, target: Path) -> None:
    """Refuse a folder that has others in it which tbcad wrote."""
    if not target.is_dir():
        return
    for inner in _folders(target, 2):
        if (kind := kind_of(inner)) is not None:
            name = inner.relative_to(target)
            raise InputError(
                f"{out} holds {name}, {words(kind)}: name another folder, such as {out / 'new'}"
            )


def _folders(folder: Path, depth: int) -> Iterator[Path]:
    """Folders below one, as deep as is said; links are left out."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not path.is_symlink():
            yield path
            if depth > 1:
                yield from _folders(path, depth - 1)


def _runs_of(build: Path) -> Iterator[Path]:
    """Runs beside a build, or where the user works, that photographed it as it is now."""
    for place in dict.fromkeys((build.parent, Path.cwd())):
        for record in (path for pattern in RUNS for path in sorted(place.glob(pattern))):
            digests = _record(record).get("export_sha256")
            if isinstance(digests, Mapping) and digests and _is_as(build, digests):
                yield record.parent


def _is_as(build: Path, digests: Mapping[str, Any]) -> bool:
    files = {build / name: digest for name, digest in digests.items()}
    return all(
        path.is_file() and fingerprint(path).sha256 == digest for path, digest in files.items()
    )


def _record(path: Path) -> dict[str, Any]:
    """Return the object of a JSON file; an empty one where there is none."""
    try:
        if not is_file(path) or path.lstat().st_size > _MAX_RECORD_BYTES:
            return {}
        record = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def words(kind: str) -> str:
    """Return a kind with its article."""
    return WORDS.get(kind, f"a {kind}")
