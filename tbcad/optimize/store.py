"""The file of candidates, from which a search that was stopped goes on: JSON lines."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TypeAlias

import numpy as np

from tbcad.errors import InputError
from tbcad.formats.checked_files import parse_json
from tbcad.optimize.candidate import Candidate, Figures, Place

SCHEMA = "tbcad-candidates/2"

Record: TypeAlias = dict[str, object]


def store_bytes(key: str, judged: dict[Place, Candidate]) -> bytes:
    """The file of candidates of the design with a key."""
    head = {"schema": SCHEMA, "design": key}
    rows = [head, *map(asdict, judged.values())]
    return "".join(json.dumps(row) + "\n" for row in rows).encode()


def read_store(store: Path, key: str) -> dict[Place, Candidate]:
    """Judgements of an earlier search; none where there is no file.

    Raises:
        InputError: it is no such file, or one of another design.
    """
    if not store.exists():
        return {}
    try:
        head, *rows = map(parse_json, store.read_text(encoding="utf-8").splitlines())
        known = head["design"] == key
        found = [_candidate(row) for row in rows]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(f"{store}: no list of candidates ({error}): remove it") from None
    if not known:
        raise InputError(
            f"{store}: of another design or method: name another --out, or remove the file"
        )
    return {one.place: one for one in found}


def _candidate(row: Record) -> Candidate:
    place, figures = row["place"], row["figures"]
    x, z, semi_minor, along_x, along_y = np.array(place, dtype=float).tolist()
    if figures is not None and not isinstance(figures, dict):
        raise ValueError("figures are not an object")
    numbers = {
        name: None if number is None else float(number) for name, number in (figures or {}).items()
    }
    return Candidate(
        (x, z, semi_minor, along_x, along_y),
        Figures(**numbers) if figures else None,  # type: ignore[arg-type]
        str(row["reason"]),
    )
