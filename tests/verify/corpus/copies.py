"""Cheap copies of an export, and changes to them that never reach the original."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

VERDICT = "verify.json"  # written by every proof, so never shared


def copy(export: Path, folder: Path) -> Path:
    """A copy whose files are hard links; only `put` may write to it."""
    return Path(shutil.copytree(export, folder, copy_function=_link, ignore=_verdict))


def put(folder: Path, name: str, data: bytes) -> None:
    """Write a file as a new one: through a link the original would change too."""
    fresh = folder / f"{name}.new"
    fresh.write_bytes(data)
    fresh.replace(folder / name)


def change(folder: Path, name: str, how: Callable[[bytes], bytes]) -> None:
    """Put what a function makes of a file's bytes."""
    put(folder, name, how((folder / name).read_bytes()))


def load(folder: Path, name: str) -> Any:
    """The JSON in a file."""
    return json.loads((folder / name).read_text(encoding="utf-8"))


def store(folder: Path, name: str, value: object) -> None:
    """Put a value as JSON."""
    put(folder, name, json.dumps(value, indent=1).encode())


def sign(folder: Path, more: Iterable[str] = ()) -> None:
    """Put a manifest that is right for what is there now; files that are gone leave it."""
    manifest = load(folder, "manifest.json")
    names = [name for name in (*manifest["files"], *more) if (folder / name).is_file()]
    manifest["files"] = {name: _entry(folder / name) for name in names}
    store(folder, "manifest.json", manifest)


def digests(folder: Path) -> dict[str, str]:
    """sha256 of every file but the verdict, by name."""
    return {path.name: _entry(path)["sha256"] for path in folder.iterdir() if path.name != VERDICT}


def _entry(path: Path) -> dict[str, Any]:
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return {"sha256": digest, "size": path.stat().st_size}


def _link(source: str, target: str) -> str:
    try:
        os.link(source, target)
    except OSError:  # another disk, or none that can link
        shutil.copy2(source, target)
    return target


def _verdict(_: str, names: list[str]) -> set[str]:
    return {VERDICT} & set(names)
