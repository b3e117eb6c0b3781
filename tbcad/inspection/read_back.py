"""Tolerances in a STEP file as a reader gets them, compared with those that were meant."""

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from tbcad.formats.step import StepError
from tbcad.formats.step_tolerances import FaceTolerances, ReadTolerance, read_tolerances
from tbcad.types import Floats

Key = TypeVar("Key", str, int)
SAME = 1e-9  # mm: numbers in a file have 15 digits


def check_read_back(path: Path, given: FaceTolerances, centres: Mapping[str, Floats]) -> None:
    """Compare all zones and radii in a file with what they should be.

    Args:
        path: file.
        given: what was written.
        centres: of the mirrors' spheres, by id, mm.

    Raises:
        StepError: one is missing, doubled, or not as given: a fault of tbcad.
    """
    read = read_tolerances(path)
    flat = sorted(one.value for one in read if one.kind == "flatness")
    written = sorted(given.flatness.values())
    _same(path, "flatness", dict(enumerate(flat)), dict(enumerate(written)))
    zones = [one for one in read if one.kind == "profile"]
    if any(one.datums != tuple(given.datums) for one in zones):
        raise StepError(f"{path.name}: a zone is not in the frame of the datums")
    _same(path, "zones", _by_mirror(zones, centres), given.profile)
    radii = [one for one in read if one.kind == "radius"]
    limits = {name: limit for name, (_, limit) in given.radius.items()}
    nominal = {name: radius for name, (radius, _) in given.radius.items()}
    _same(path, "limits of radii", _by_mirror(radii, centres), limits)
    _same(path, "radii", _by_mirror(radii, centres, "nominal"), nominal)


def _by_mirror(
    read: list[ReadTolerance], centres: Mapping[str, Floats], which: str = "value"
) -> dict[str, float]:
    """Values by the mirror on whose sphere each face is."""
    names, known = list(centres), np.array(list(centres.values()))
    values = {}
    for one in read:
        if one.centre is None:
            raise StepError("a tolerance of a mirror is not on a sphere")
        distance = np.linalg.norm(known - one.centre, axis=1)
        values[names[int(distance.argmin())]] = float(getattr(one, which))
    return values


def _same(path: Path, what: str, read: Mapping[Key, float], given: Mapping[Key, float]) -> None:
    if read.keys() != given.keys():
        raise StepError(f"{path.name}: {len(read)} {what} are read, {len(given)} were written")
    if any(abs(read[key] - given[key]) > SAME for key in read):
        raise StepError(f"{path.name}: {what} are read otherwise than they were written")
