"""An estimate of the carrier's mass from its layout, before there are solids.

Wall and rings are solids of revolution (Pappus), ribs are plates, bosses and hub are cylinders;
flanges of joints, numbers and screw holes are left out. The estimate chooses a drive early and
serves overviews; the solids decide.
"""

import numpy as np

from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import at_azimuths
from tbcad.prototype.drive.balance import PointMasses
from tbcad.types import Floats


def carrier_masses(base: BaseLayout, density: float) -> PointMasses:
    """The carrier's pieces as point masses, by a density in g/cm^3."""
    inner, outer = base.inner, base.outer
    wall = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    revolved = _revolved(base, np.concatenate([wall, np.stack(base.rings)]))
    pieces = [revolved, _ribs(base), _bosses(base), _hub(base)]
    volume, centre = (np.concatenate(each) for each in zip(*pieces, strict=True))
    return PointMasses(volume / 1000 * density, centre)


def _revolved(base: BaseLayout, quads: Floats) -> tuple[Floats, Floats]:
    """Volumes (n,) and centres (n, 3) of quadrilaterals (n, 4, 2) of (z, r) over the sector."""
    middle, (low, high) = quads.mean(axis=1), base.sector
    angle = high - low
    # The centre of gravity of an arc is nearer to the axis by the chord over the arc.
    arc = np.column_stack([middle[:, 0], middle[:, 1] * np.sin(angle / 2) / (angle / 2)])
    centre = at_azimuths(arc, np.array([(low + high) / 2]))[0] @ base.axes
    return _area(quads) * middle[:, 1] * angle, centre


def _ribs(base: BaseLayout) -> tuple[Floats, Floats]:
    """Each rib as one plate between the wall and the ribs' outline."""
    section = np.vstack([base.outline, base.outer[::-1]])
    volume = np.full(len(base.ribs), float(_area(section[None])[0]) * base.spec.rib_mm)
    return volume, at_azimuths(section.mean(axis=0)[None], base.ribs)[:, 0] @ base.axes


def _bosses(base: BaseLayout) -> tuple[Floats, Floats]:
    """Bosses outside of the wall, without their cups and pockets."""
    seats = base.seats
    length = np.maximum(seats.back - seats.front - base.spec.thickness_mm, 0.0)
    depth = seats.cup - seats.front
    cup = np.pi * depth**2 * (3 * seats.cup - depth) / 3
    pocket = np.pi * seats.pocket**2 * np.maximum(seats.bottom - seats.radius, 0.0)
    volume = np.maximum(np.pi * seats.boss**2 * length - cup - pocket, 0.0)
    return volume, seats.at_depth((seats.front + seats.back) / 2)


def _hub(base: BaseLayout) -> tuple[Floats, Floats]:
    hub = base.hub
    disc = np.pi * (hub.disc**2 - hub.bore**2) * (hub.front - hub.back)
    boss = np.pi * max(hub.boss**2 - hub.bore**2, 0.0) * (hub.back - hub.face)
    along = np.array([(hub.front + hub.back) / 2, (hub.back + hub.face) / 2])
    return np.array([disc, boss]), along[:, None] * base.frame[0]


def _area(polygons: Floats) -> Floats:
    """Areas (n,) of polygons (n, p, 2), by the shoelace formula."""
    x, y = np.moveaxis(polygons, -1, 0)
    return np.asarray(
        np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)) / 2
    )
