"""Cheap copies of an export, and changes to them that never reach the original."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

TEXTS = ("id", "camera")  # columns of mirrors.csv
VERDICT = "verify.json"  # written by every verification, so never shared


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


def load_mirrors(folder: Path) -> list[dict[str, Any]]:
    """The rows of mirrors.csv: numbers, texts in the first two columns, None where it is empty."""
    with (folder / "mirrors.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [
        {key: cell if key in TEXTS else float(cell) if cell else None for key, cell in row.items()}
        for row in rows
    ]


def store_mirrors(folder: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Put rows as mirrors.csv."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    put(folder, "mirrors.csv", stream.getvalue().encode())


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
