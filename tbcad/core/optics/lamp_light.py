"""Light of Lambertian lamps on surfaces, no shadows cast: rectangles in tiles, and small LEDs."""

from dataclasses import dataclass, field

import numpy as np

from tbcad.core.geometry.vectors import norm, unit
from tbcad.types import Floats

TILES = (2, 5)  # across and along a lamp's face
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class RectangularLamps:
    """Equal rectangular lamps, upright or level, with Lambertian faces."""

    places: Floats  # middles of the faces, mm, (l, 3)
    inward: Floats  # unit directions that they face, level, (l, 3)
    width: float  # of a face, across, mm
    length: float  # of a face, upward, mm
    lumen: float  # light of each
    # places of the LEDs above, mm, (k, 3), which face the origin, and the candela of each
    leds: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    candela: float = 0.0

    def tiles(self) -> tuple[Floats, Floats]:
        """Middles (t, 3) of the tiles of all faces, and the directions that they face, (t, 3)."""
        sides = zip(TILES, (self.width, self.length), strict=True)
        across, along = (((np.arange(n) + 0.5) / n - 0.5) * size for n, size in sides)
        x, z = (values.ravel() for values in np.meshgrid(across, along, indexing="ij"))
        side = np.cross(UP, self.inward)
        middles = self.places[:, None] + x[:, None] * side[:, None] + z[:, None] * UP
        return middles.reshape(-1, 3), np.repeat(self.inward, len(x), axis=0)

    def tile_sides(self) -> Floats:
        """Half sides (t, 2, 3) of those tiles, mm."""
        side = self.width / TILES[0] / 2 * np.cross(UP, self.inward)
        up = np.broadcast_to(self.length / TILES[1] / 2 * UP, side.shape)
        return np.repeat(np.stack([side, up], axis=1), TILES[0] * TILES[1], axis=0)

    def sources(self) -> tuple[Floats, Floats, Floats]:
        """Tiles and LEDs: places (t, 3), unit directions (t, 3) and candela along those, (t,)."""
        middles, facing = self.tiles()
        tile = self.lumen * len(self.places) / len(middles) / np.pi
        candela = np.repeat([tile, self.candela], [len(middles), len(self.leds)])
        faces = np.concatenate([facing, -unit(self.leds)])
        return np.concatenate([middles, self.leds]), faces, candela


def irradiance(lamps: RectangularLamps, points: Floats, normals: Floats) -> Floats:
    """Irradiance (n,) of surfaces at points (n, 3) with unit normals (n, 3), lux.

    A tile that gives F lumen in all, Lambertian, gives F / pi cos cos' / r^2 at a distance r.
    """
    return lambertian(*lamps.sources(), points, normals)


def lambertian(
    places: Floats, facing: Floats, candela: Floats, points: Floats, normals: Floats
) -> Floats:
    """Irradiance (n,) by small Lambertian faces at places (l, 3) with normals (l, 3), lux.

    Of surfaces at points (n, 3) with unit normals (n, 3); candela: along each face's normal, (l,).
    """
    total = np.zeros(len(points))
    for place, way, power in zip(places, facing, candela, strict=True):
        toward = place - points
        distance = norm(toward)
        leaves = np.maximum(-(toward @ way), 0) / distance
        meets = np.maximum((toward * normals).sum(axis=1), 0) / distance
        total += 1e6 * power * leaves * meets / distance**2
    return total
