"""Light from all around, as a picture by direction, and the lamps that stand for it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from scipy.spatial import cKDTree

from tbcad.cad.formats.light_pictures import EXR_SIGNATURE, HDR_SIGNATURE, exr_picture, hdr_picture
from tbcad.cad.formats.pictures import picture_of
from tbcad.core.geometry.vectors import norm, unit
from tbcad.errors import InputError
from tbcad.light.simulate.scene.lamps import PointLights
from tbcad.light.simulate.views.refocus import GOLDEN_ANGLE
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
_BACK = {(3, 1): ((-1, 0, 0), (0, 1, 0), (0, 0, -1)), (1, 3): ((-1, 0, 0), (0, -1, 0), (0, 0, 1))}
# So far away light from one direction is parallel: 60 mm apart it differs by 0.003 degrees.
FAR_MM = 1e6
GIVE = "give a picture of light: Radiance (.hdr), OpenEXR (.exr) or TIFF in floating point"
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green, blue: ITU-R BT.709


class LightPixels(NamedTuple):
    """Pixels that show a part of the surroundings."""

    row: Ints  # (p,)
    column: Ints  # (p,)
    direction: Floats  # unit vectors toward what they show, (p, 3)
    solid_angle: Floats  # of it, sr, (p,); all together 4 pi


def light_pixels(picture: Floats, kind: LightFormat | None, name: str) -> LightPixels:
    """The pixels of a picture (h, w, 3) of the surroundings that show something.

    Without a format it is latlong, if it has the shape of one. InputError, which names the picture:
    its shape is not that of its format.
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


@dataclass(frozen=True)
class Environment:
    """Light from above the horizon; what lies below lights no lamp."""

    direction: Floats  # unit vectors toward it, (p, 3)
    light: Floats  # red, green, blue, times the solid angle it comes from, (p, 3)

    def by_nearest(self, direction: Floats) -> Floats:
        """Sums of light (l, 3) over what is nearest to each of some unit directions (l, 3)."""
        _, owner = cKDTree(direction).query(self.direction)
        total = np.zeros((len(direction), 3))
        np.add.at(total, owner, self.light)
        return total

    def on_lamps(self, place: Floats) -> PointLights:
        """Lamps in given places (l, 3), each as bright as what it stands for."""
        return PointLights(place, self.by_nearest(unit(place)))

    def far_lights(self, count: int) -> PointLights:
        """So many lamps far away: of each part of the sky one, in the middle of its light."""
        even = even_directions(count)
        _, owner = cKDTree(even).query(self.direction)
        middle = np.zeros((count, 3))
        np.add.at(middle, owner, self.direction * (self.light @ LUMINANCE)[:, None])
        direction = np.where(norm(middle)[:, None] > 0, unit(middle), even)
        return PointLights(FAR_MM * direction, self.by_nearest(even))


def even_directions(count: int) -> Floats:
    """Unit directions (count, 3) spread evenly over the upper hemisphere, on a Fibonacci spiral."""
    k = np.arange(count)
    z, azimuth = (k + 0.5) / count, GOLDEN_ANGLE * k
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)


def environment(
    picture: Floats, turn: float = 0.0, kind: LightFormat | None = None, name: str = "the picture"
) -> Environment:
    """The light of a picture (h, w, 3) of the surroundings: linear red, green, blue.

    It is turned about z, radians; format, name and errors are as of `light_pixels`.
    """
    pixels = light_pixels(picture, kind, name)
    above = pixels.direction[:, 2] > 0
    cosine, sine = np.cos(turn), np.sin(turn)
    about_z = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    light = picture[pixels.row[above], pixels.column[above]]
    return Environment(pixels.direction[above] @ about_z, light * pixels.solid_angle[above, None])


def read_environment(path: Path, turn: float = 0.0, kind: LightFormat | None = None) -> Environment:
    """The light of a file; else as `environment`.

    InputError: it cannot be read, is not of that format, or is dark above the horizon.
    """
    found = environment(read_light(path), turn, kind, str(path))
    if not (found.light > 0).any():
        raise InputError(f"{path} is dark above the horizon: it must have light there")
    return found


def read_light(path: Path) -> Floats:
    """Red, green and blue (h, w, 3), linear, colours of Rec. 709, from the top row down.

    InputError: it cannot be read, or is no picture of light.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {GIVE}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: {GIVE}") from None
    if data.startswith(HDR_SIGNATURE):
        return hdr_picture(data, str(path))
    light = exr_picture(path) if data.startswith(EXR_SIGNATURE) else picture_of(data, str(path))
    if light.dtype != np.float32:
        raise InputError(f"{path} has whole numbers, which clip what is bright: {GIVE}")
    grey = light[..., None] if light.ndim == 2 else light
    return np.broadcast_to(grey, (*light.shape[:2], 3)).astype(np.float64)
