"""Walls of pedestals among the faces of a STEP file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.pedestals import PedestalWalls
from tbcad_verify.step.step_file import StepFaces
from tbcad_verify.types import Floats


def fronts(faces: StepFaces, ids: frozenset[str]) -> frozenset[str]:
    """Names of the faces that are mirrors, whose names are `ids`, or walls below them."""
    return frozenset(name for name in faces.names if ids.issuperset(name.split("_")))


def wall_errors(
    faces: StepFaces, ids: Sequence[str], walls: PedestalWalls | None
) -> tuple[list[str], Floats]:
    """Names of all walls of M mirrors, and how far each one's plane is off.

    Args:
        faces: of the file; a wall has the names of its mirror and of the one across its groove.
        ids: (M,) names of the mirrors.
        walls: by the record.

    Returns:
        Names (W,), and the larger of distance (mm) and difference of the normals, (W,); infinite
        for a wall that is missing, no plane, or not in the record.

    Raises:
        Unknown: the mirrors stand on no pedestals.
    """
    if walls is None:
        raise Unknown("the mirrors stand on no pedestals")
    row, column = np.nonzero(walls.real & (walls.across < len(ids)))
    across = walls.across[row, column].tolist()
    names = [f"{ids[i]}_{ids[j]}" for i, j in zip(row.tolist(), across, strict=True)]
    index = {one: k for k, one in enumerate(faces.names)}
    face = np.array([index.get(one, -1) for one in names], dtype=np.intp)
    outward = -walls.normal[row, column]
    off = ((faces.point[face] - walls.point[row, column]) * outward).sum(axis=1)
    error = np.maximum(np.abs(off), np.linalg.norm(faces.normal[face] - outward, axis=1))
    error[(face < 0) | (faces.kind[face] != "plane")] = np.inf
    extra = sorted(fronts(faces, frozenset(ids)) - {*names} - {*ids})
    return names + extra, np.append(error, np.full(len(extra), np.inf))
