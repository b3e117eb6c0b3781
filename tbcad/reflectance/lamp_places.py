"""Where the lamps of a reflectance field are: given, or where the virtual cameras are.

A projector in the place of a camera, by a half mirror, throws the pixels of a mirror's cell
through that mirror onto the object: as light from the virtual camera (the paper, section 2). All
pixels of a cell at once are a lamp in that place, whose light is as wide as the capture sphere.
Mirrors are convex, so these places are not far behind them: light falls off over the object.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tbcad.datasets.crops import MirrorId, chosen_mirrors, spread_evenly
from tbcad.datasets.virtual_cameras import virtual_cameras
from tbcad.errors import InputError
from tbcad.simulate.capture.light_field import LightField
from tbcad.spec.csv_rows import number, read_rows
from tbcad.types import Floats

MIRRORS = "mirrors"
COLUMNS = ("x_mm", "y_mm", "z_mm")
MAX_MM = 1e9
# Both halves of a mirror on the seam have one virtual camera.
ON_SEAM = 1e-9


@dataclass(frozen=True)
class LampPlaces:
    """Lamps.

    Attributes:
        name: of the mirror, or lamp0001 ...
        place: mm, (l, 3).
    """

    name: tuple[str, ...]
    place: Floats


def read_lamp_places(path: Path, capture_mm: float) -> LampPlaces:
    """Lamps of a table with the columns x_mm, y_mm and z_mm.

    Raises:
        InputError: it cannot be read, has no rows, or a lamp is in the capture sphere.
    """
    if not path.exists():
        raise InputError(f"{path} is not there: give a table with {','.join(COLUMNS)}, or mirrors")
    rows = list(read_rows(path, str(path), COLUMNS, COLUMNS, others=True))
    if not rows:
        raise InputError(f"{path} has no lamps: give a row for each")
    place = np.array([[number(where, row, one, MAX_MM) for one in COLUMNS] for where, row in rows])
    inside = np.flatnonzero(np.linalg.norm(place, axis=1) <= capture_mm / 2)
    if len(inside):
        raise InputError(
            f"{rows[inside[0]][0]}: a lamp in the capture sphere: place it more than "
            f"{capture_mm / 2:g} mm from the origin"
        )
    return LampPlaces(tuple(f"lamp{k + 1:04d}" for k in range(len(place))), place)


def lamps_of_mirrors(source: LightField, every: int) -> LampPlaces:
    """Lamps at virtual cameras: one of so many, the kept ones spread evenly.

    Raises:
        InputError: no mirror gives a virtual camera.
    """
    mirrors = [one for one in chosen_mirrors(source, None, 1) if not _second_half(source, one)]
    u = np.array([source.frames[one.frame].u[one.index] for one in mirrors])
    kept = spread_evenly(u, -(-len(mirrors) // every))
    virtual = virtual_cameras(source, [mirrors[k] for k in kept])
    if not len(virtual):
        raise InputError("no mirror of the capture gives a virtual camera: give lamps as a table")
    return LampPlaces(tuple(one.name for one in virtual.mirrors), virtual.centre)


def _second_half(source: LightField, mirror: MirrorId) -> bool:
    on_seam = abs(float(source.frames[mirror.frame].u[mirror.index, 0])) < ON_SEAM
    return mirror.frame == "b" and "a" in source.frames and on_seam
