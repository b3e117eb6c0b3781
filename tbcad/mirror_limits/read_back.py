"""Tolerances in a STEP file as a reader gets them, compared with those that were meant."""

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from tbcad.cad.formats.step import StepError
from tbcad.cad.formats.step_tolerances import FaceTolerances, ReadTolerance, read_tolerances
from tbcad.types import Floats

Key = TypeVar("Key", str, int, frozenset[str])
SAME = 1e-9  # mm: numbers in a file have 15 digits
SAME_PLANE = 1e-6  # of normal and distance (mm): at n = 18 no two walls are closer than 2e-4
NO_WALLS: Mapping[str, Floats] = {}
EITHER_WAY = np.array([1.0, -1.0])


def check_read_back(
    path: Path,
    given: FaceTolerances,
    centres: Mapping[str, Floats],
    walls: Mapping[str, Floats] = NO_WALLS,
) -> None:
    """Compare all zones and radii in a file with what they should be.

    Centres of the mirrors' spheres are by id, mm; walls of pedestals by their faces' names, point
    (mm) and normal, (6,). StepError if one is missing, doubled, or not as given: a fault of tbcad.
    """
    read = read_tolerances(path)
    flat = sorted(one.value for one in read if one.kind == "flatness")
    written = sorted(given.flatness.values())
    _same(path, "flatness", dict(enumerate(flat)), dict(enumerate(written)))
    zones = [one for one in read if one.kind == "profile"]
    if any(one.datums != tuple(given.datums) for one in zones):
        raise StepError(f"{path.name}: a zone is not in the frame of the datums")
    of_walls = [one for one in zones if one.planes]
    of_mirrors = [one for one in zones if not one.planes]
    _same(path, "zones", _by_mirror(of_mirrors, centres), given.profile)
    common = {frozenset(names): width for names, width in given.common_profile.items()}
    _same(path, "zones of walls", _by_walls(of_walls, walls), common)
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


def _by_walls(
    read: list[ReadTolerance], walls: Mapping[str, Floats]
) -> dict[frozenset[str], float]:
    """Values by the names of the walls whose planes the faces are on."""
    names, known = list(walls), _plane_numbers(np.array(list(walls.values())).reshape(-1, 2, 3))
    values = {}
    for one in read:
        planes = _plane_numbers(np.array(one.planes))
        either = EITHER_WAY[:, None, None] * planes[:, None, None]
        distance = np.linalg.norm(either - known, axis=3).min(axis=1)
        if distance.min(axis=1).max() > SAME_PLANE:
            raise StepError("a zone is on no wall of a pedestal")
        values[frozenset(names[k] for k in distance.argmin(axis=1))] = one.value
    return values


def _plane_numbers(planes: Floats) -> Floats:
    """Normals and distances from the origin (mm) of planes by points and normals, (w, 4)."""
    point, normal = planes[:, 0], planes[:, 1]
    return np.column_stack([normal, (point * normal).sum(axis=1)])


def _same(path: Path, what: str, read: Mapping[Key, float], given: Mapping[Key, float]) -> None:
    if read.keys() != given.keys():
        raise StepError(f"{path.name}: {len(read)} {what} are read, {len(given)} were written")
    if any(abs(read[key] - given[key]) > SAME for key in read):
        raise StepError(f"{path.name}: {what} are read otherwise than they were written")
