"""Where the lamps of a reflectance field are: given, or where the virtual cameras are.

A projector in the place of a camera, by a half mirror, throws the pixels of a mirror's cell
through that mirror onto the object: as light from the virtual camera (the paper, section 2). All
pixels of a cell at once are a lamp in that place, whose light is as wide as the capture sphere.
Mirrors are convex, so these places are not far behind them: light falls off over the object.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry import vectors
from tbcad.core.geometry.loop_vectors import vector
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.mirror_light import reflection
from tbcad.core.spec.csv_rows import number, read_rows
from tbcad.errors import InputError
from tbcad.light.datasets.virtual_cameras import (
    MirrorId,
    chosen_mirrors,
    spread_evenly,
    virtual_cameras,
)
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.lamps import Spots, lit_cosine
from tbcad.types import Floats

MIRRORS = "mirrors"
COLUMNS = ("x_mm", "y_mm", "z_mm")
MAX_MM = 1e9
PROJECTORS = "projectors"
# A plane is taken as a sphere so large that it differs by 1e-5 mm over a cell.
LEAST_CURVATURE = 1e-7
# Both halves of a mirror on the seam have one direction, and one virtual camera.
SAME_DIRECTION = 1e-9


@dataclass(frozen=True)
class LampPlaces:
    """Lamps."""

    name: tuple[str, ...]  # of the mirror, or lamp0001 ...
    place: Floats  # mm, (l, 3)


def read_lamp_places(path: Path, capture_mm: float) -> LampPlaces:
    """Lamps of a table with the columns x_mm, y_mm and z_mm.

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

    InputError: no mirror gives a virtual camera.
    """
    both = [_halves(source, one) for one in chosen_mirrors(source, None, 1)]
    mirrors = [one for one, *others in both if one.frame == "a" or not others]
    u = np.array([source.frames[one.frame].u[one.index] for one in mirrors])
    kept = spread_evenly(u, -(-len(mirrors) // every))
    virtual = virtual_cameras(source, [mirrors[k] for k in kept])
    if not len(virtual):
        raise InputError("no mirror of the capture gives a virtual camera: give lamps as a table")
    return LampPlaces(tuple(one.name for one in virtual.mirrors), virtual.centre)


@dataclass(frozen=True)
class MirrorPixels:
    """The pixels of a projector that one mirror throws onto the object."""

    camera: Camera  # the projector's pinhole and pixels
    number: int  # of the mirror, from 1
    owner: NDArray[np.uint16]  # number of the mirror that each pixel is on, (h, w)
    centre: Floats  # of the sphere, mm, (3,)
    radius: float  # mm
    at_origin: float  # how far light spreads until it is at the origin, mm2

    def light(self, embree: Any, spots: Spots) -> Floats:
        """Light on spots (k,), if a white surface at the origin that faces it gets 1."""
        light = np.zeros(len(spots.place))
        height = vectors.dot(self.centre - spots.place, spots.normal)
        faces = np.flatnonzero(height + self.radius > 0)  # the sphere is not all below the horizon
        some = Spots(spots.place[faces], spots.normal[faces], spots.facet_normal[faces])
        known, spread = reflected(self.centre, self.radius, self.camera.pinhole, some.place)
        toward = known - some.place
        cosine = lit_cosine(embree, some, toward / norm(toward)[:, None])
        light[faces] = np.where(self._owns(known), cosine * self.at_origin / spread, 0.0)
        return light

    def _owns(self, points: Floats) -> NDArray[np.bool_]:
        """Whether a pixel of this mirror is where points (k, 3) of its sphere appear."""
        column, row = np.rint(self.camera.project(points)).astype(np.int64).T
        height, width = self.owner.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        owner = self.owner[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        return np.asarray(inside & (owner == self.number))


def projectors(source: LightField, lamps: Iterable[MirrorId]) -> list[tuple[MirrorPixels, ...]]:
    """Light of projectors in the places of the cameras, thrown by mirrors.

    By one for each lamp, or by both halves of one on the seam.
    """
    owner = {name: np.asarray(frame.planes["mirror"][:]) for name, frame in source.frames.items()}
    return [
        tuple(_pixels(source, one, owner[one.frame]) for one in _halves(source, lamp))
        for lamp in lamps
    ]


def _halves(source: LightField, mirror: MirrorId) -> list[MirrorId]:
    """A mirror, and its other half if it is on the seam."""
    found, direction = [mirror], source.frames[mirror.frame].u[mirror.index]
    for name, frame in source.frames.items():
        same = np.flatnonzero(norm(frame.u - direction) < SAME_DIRECTION)
        found += [MirrorId(name, int(k)) for k in same if name != mirror.frame]
    return found


def _pixels(source: LightField, mirror: MirrorId, owner: NDArray[np.uint16]) -> MirrorPixels:
    frame = source.frames[mirror.frame]
    surface = frame.mirrors
    radius = 1 / max(float(surface.curvature[mirror.index]), LEAST_CURVATURE)
    centre = surface.apex[mirror.index] - radius * surface.normal[mirror.index]
    _, spread = reflected(centre, radius, frame.camera.pinhole, np.zeros((1, 3)))
    return MirrorPixels(frame.camera, mirror.index + 1, owner, centre, radius, float(spread[0]))


@compiled_loop
def reflected(
    centre: Floats, radius: float, pinhole: Floats, place: Floats
) -> tuple[Floats, Floats]:
    """Points (k, 3) of a sphere that reflect a pinhole into others, and how far light spreads.

    The latter, (k,), mm2, is that of `tbcad.core.optics.mirror_light.reflection`.
    """
    points, spread = np.empty_like(place), np.empty(len(place))
    middle, start = vector(centre), vector(pinhole)
    for k in range(len(place)):
        point, spread[k] = reflection(middle, radius, start, vector(place[k]))
        points[k, 0], points[k, 1], points[k, 2] = point
    return points, spread
