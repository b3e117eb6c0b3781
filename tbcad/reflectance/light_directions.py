"""Directions of the pixels of a picture of the surroundings, in the formats that are in use.

In all of them +x is in the middle, up (+z) is up, and -y is to the right: as one sees the
surroundings from the inside. The names are those of HDRShop (P. Debevec and others):

- latlong, 2:1: longitude along the rows, latitude down the columns.
- angular, 1:1: a disc; the angle from +x grows evenly to 180 degrees at the rim.
- mirror-ball, 1:1: a disc; the sine of half that angle grows evenly, as on a ball that reflects.
  The photograph of a ball itself is the mirror image, with the camera's direction in the middle.
- cross, 3:4 or 4:3: the faces of a cube about the one toward +x; the sixth is below the others and
  upside down, or at the right end.
"""

from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from tbcad.errors import InputError
from tbcad.types import Floats, Ints

LightFormat: TypeAlias = Literal["latlong", "angular", "mirror-ball", "cross"]

ASPECTS: dict[LightFormat, tuple[tuple[int, int], ...]] = {
    "latlong": ((2, 1),),
    "angular": ((1, 1),),
    "mirror-ball": ((1, 1),),
    "cross": ((3, 4), (4, 3)),
}
TO_XYZ = np.diag([1.0, -1.0, 1.0])  # of a direction as forward, right, up
# Faces of a cross by row and column: which way its middle, its right and its top lie.
_FACES = {
    (0, 1): ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    (1, 0): ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    (1, 1): ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    (1, 2): ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    (2, 1): ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
}
_BACK = {
    (3, 1): ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    (1, 3): ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
}


class LightPixels(NamedTuple):
    """Pixels that show a part of the surroundings.

    Attributes:
        row, column: of each, (p,).
        direction: unit vectors toward what they show, (p, 3).
        solid_angle: of it, sr, (p,); all together 4 pi.
    """

    row: Ints
    column: Ints
    direction: Floats
    solid_angle: Floats


def light_pixels(picture: Floats, kind: LightFormat | None, name: str) -> LightPixels:
    """The pixels of a picture (h, w, 3) that show something.

    Args:
        picture: of the surroundings.
        kind: its format; None: latlong, if it has the shape of one.
        name: of the picture, for the error.

    Raises:
        InputError: its shape is not that of its format.
    """
    height, width = picture.shape[:2]
    aspects = ASPECTS[kind or "latlong"]
    if not any(width * high == height * wide and width % wide == 0 for wide, high in aspects):
        allowed = " or ".join(f"{wide}:{high}" for wide, high in aspects)
        others = " | ".join(get_args(LightFormat))
        raise InputError(
            f"{name} is {width} x {height} pixels, {kind or 'a panorama (latlong)'} is {allowed}: "
            f"say what it is by --light-format {others}, or cut it"
        )
    if kind == "cross":
        return _cross(height, width)
    return _disc(height, kind) if kind in {"angular", "mirror-ball"} else _latlong(height, width)


def _latlong(height: int, width: int) -> LightPixels:
    edges = np.pi / 2 - np.pi * np.arange(height + 1) / height
    solid_angle = (np.sin(edges[:-1]) - np.sin(edges[1:])) * 2 * np.pi / width
    row, column = (k.ravel() for k in np.indices((height, width)))
    elevation = ((edges[:-1] + edges[1:]) / 2)[row]
    azimuth = (np.pi - 2 * np.pi * (np.arange(width) + 0.5) / width)[column]
    level = np.cos(elevation)
    parts = level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)
    return LightPixels(row, column, np.stack(parts, axis=1), solid_angle[row])


def _disc(side: int, kind: LightFormat | None) -> LightPixels:
    """Pixels whose middle is within the circle: what they show depends on their radius in it."""
    at = (2 * np.arange(side) + 1) / side - 1
    row, column = np.nonzero(at[:, None] ** 2 + at**2 < 1)
    right, up = at[column], -at[row]
    radius = np.hypot(right, up)
    if kind == "angular":
        forward, aside = np.cos(np.pi * radius), np.pi * np.sinc(radius)
        density = aside
    else:
        forward, aside = 1 - 2 * radius**2, 2 * np.sqrt(1 - radius**2)
        density = np.ones(len(radius))
    local = np.stack([forward, aside * right, aside * up], axis=1)
    return LightPixels(row, column, local @ TO_XYZ, density * (4 * np.pi / density.sum()))


def _cross(height: int, width: int) -> LightPixels:
    side = max(height, width) // 4
    at = (2 * np.arange(side) + 1) / side - 1
    row, column = (k.ravel() for k in np.indices((side, side)))
    right, up = at[column], -at[row]
    density = (1 + right**2 + up**2) ** -1.5
    back = (3, 1) if height > width else (1, 3)
    faces = _FACES | {back: _BACK[back]}
    place = np.stack([np.ones(len(row)), right, up], axis=1)
    toward = np.concatenate([place @ np.array(axes) for axes in faces.values()])
    corner = np.repeat(side * np.array(list(faces)), side**2, axis=0)
    return LightPixels(
        row=np.tile(row, 6) + corner[:, 0],
        column=np.tile(column, 6) + corner[:, 1],
        direction=toward / np.linalg.norm(toward, axis=1)[:, None] @ TO_XYZ,
        solid_angle=np.tile(density * (4 * np.pi / 6 / density.sum()), 6),
    )
