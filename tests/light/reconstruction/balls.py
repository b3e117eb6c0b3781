"""Fields with closed forms, and the rays of captures of them."""

from collections.abc import Callable

import numpy as np

from tbcad.core.optics.geodesic import geodesic
from tbcad.light.reconstruction.field import Field, Grid
from tbcad.light.reconstruction.marching import MATT
from tbcad.light.reconstruction.rays import CapturedRays, entries
from tbcad.types import Bools, Floats
from tests.ray_fields import captured_along

WIDTH_MM, NODES, RADIUS, STEEP = 20.0, 41, 7.0, 8.0
COLOUR = (0.6, 0.3, 0.1)
BELOW = 1.0 - 0.01 / 4  # the number whose density is 1/mm


def made_of(number: Callable[[Floats], Floats], columns: int = MATT) -> Field:
    """A field on the whole lattice with that number at points (v, 3)."""
    grid = Grid.about(np.ones((NODES,) * 3, dtype=bool), WIDTH_MM)
    values = np.zeros((len(grid), columns), dtype=np.float32)
    values[:, 0], values[:, 1:MATT] = number(grid.points), COLOUR
    return Field(grid, values)


def ball(radius: float = RADIUS, steep: float = STEEP) -> Field:
    """A ball about the origin that is 1/mm dense at its surface."""
    return made_of(lambda at: BELOW + steep * (radius - np.linalg.norm(at, axis=1)))


def nothing() -> Field:
    """A field without nodes."""
    grid = Grid.about(np.zeros((NODES,) * 3, dtype=bool), WIDTH_MM)
    return Field(grid, np.zeros((0, MATT), dtype=np.float32))


def parallel_rays(
    bright: Callable[[Floats], Bools], across: int = 61, capture_mm: float = WIDTH_MM
) -> CapturedRays:
    """Rays of beams from the upper hemisphere, a mirror each, some bright by their distance."""
    u = geodesic(3)[0]
    u = u[u[:, 2] > 0]
    x, y = (k.ravel() for k in np.meshgrid(*[np.linspace(-1, 1, across) * capture_mm / 2] * 2))
    origins, mirrors = [], np.repeat(np.arange(len(u)), len(x))
    for toward in u:
        first = np.cross(toward, np.eye(3)[np.argmin(np.abs(toward))])
        first /= np.linalg.norm(first)
        second = np.cross(toward, first)
        origins.append(capture_mm * toward + x[:, None] * first + y[:, None] * second)
    origin, direction = np.concatenate(origins), -np.repeat(u, len(x), axis=0)
    entry, length = entries(origin, direction, capture_mm / 2)
    met = length > 0.05
    away = np.tile(np.hypot(x, y), len(u))
    colour = np.broadcast_to(np.where(bright(away)[:, None], 0.7, 0.0), entry.shape)
    columns = (column[met] for column in (entry, direction, length, colour, mirrors))
    return captured_along(*columns, capture_mm=capture_mm)
