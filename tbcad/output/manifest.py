"""manifest.json: what was written, and by which versions."""

import hashlib
import json
import platform
from importlib.metadata import version
from pathlib import Path

from tbcad.version import __version__

MANIFEST, VERDICT = "manifest.json", "verify.json"
SCHEMA = "tbcad-manifest/1"
LIBRARIES = ("cadquery-ocp", "numpy", "scipy", "manifold3d", "lib3mf", "trimesh")


def write_manifest(folder: Path) -> None:
    """Write manifest.json over all files of the folder but itself and the verdict."""
    names = sorted(p.name for p in folder.iterdir() if p.name not in (MANIFEST, VERDICT))
    versions = {"tbcad": __version__, **{name: version(name) for name in LIBRARIES}}
    document = {
        "schema": SCHEMA,
        "files": {name: fingerprint(folder / name) for name in names},
        "versions": {**versions, "python": platform.python_version()},
    }
    text = json.dumps(document, indent=1) + "\n"
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def fingerprint(path: Path) -> dict[str, str | int]:
    """sha256 and size of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    return {"sha256": digest.hexdigest(), "size": path.stat().st_size}
