"""Light from all around, as a picture by direction, and the lamps that stand for it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tbcad.errors import InputError
from tbcad.formats.light_pictures import read_light
from tbcad.geometry.vectors import norm, unit
from tbcad.reflectance.light_directions import LightFormat, light_pixels
from tbcad.simulate.scene.point_lights import PointLights
from tbcad.types import Floats

# So far away light from one direction is parallel: 60 mm apart it differs by 0.003 degrees.
FAR_MM = 1e6
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green, blue: ITU-R BT.709


@dataclass(frozen=True)
class Environment:
    """Light from above the horizon; what lies below lights no lamp.

    Attributes:
        direction: unit vectors toward it, (p, 3).
        light: red, green, blue, times the solid angle it comes from, (p, 3).
    """

    direction: Floats
    light: Floats

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
    """The light of a picture (h, w, 3) of the surroundings.

    Args:
        picture: linear red, green, blue.
        turn: about z, radians.
        kind: format of the picture; None: latlong, if it has the shape of one.
        name: of the picture, for the error.

    Raises:
        InputError: its shape is not that of its format.
    """
    pixels = light_pixels(picture, kind, name)
    above = pixels.direction[:, 2] > 0
    cosine, sine = np.cos(turn), np.sin(turn)
    about_z = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    light = picture[pixels.row[above], pixels.column[above]]
    return Environment(pixels.direction[above] @ about_z, light * pixels.solid_angle[above, None])


def read_environment(path: Path, turn: float = 0.0, kind: LightFormat | None = None) -> Environment:
    """The light of a file; else as `environment`.

    Raises:
        InputError: it cannot be read, is not of that format, or is dark above the horizon.
    """
    found = environment(read_light(path), turn, kind, str(path))
    if not (found.light > 0).any():
        raise InputError(f"{path} is dark above the horizon: it must have light there")
    return found
