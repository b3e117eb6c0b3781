"""The mirrors that the seam halves: how two halves see the object without a gap between them.

The halves of one mirror are two spheres. The seam's plane cuts both, and astigmatism turns the
image of the cut at the object, the other way in each half: at one end each half sees beyond x = 0,
at the other neither sees what is next to it. So each half is aimed at a point beyond x = 0.
"""

import numpy as np

from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.optics.windows import cell_sides
from tbcad.types import Floats, Ints

X = np.array([1.0, 0.0, 0.0])
# Of each arc of the cut: the image is less than a micrometre off the chords between them.
SAMPLES = 65
# Rounding: the image of the cut through a planar mirror is the plane x = 0 itself.
ROUNDING_MM = 1e-9


def aimed(mirrors: Surfaces, pinhole: Floats, aim: Floats) -> Surfaces:
    """Camera a's mirrors, turned to send the ray at the apex to x = -aim, mm, (m,) each."""
    to_point = -aim[:, None] * X - mirrors.apex
    normal = unit(unit(pinhole - mirrors.apex) + unit(to_point))
    normal = np.where((aim == 0)[:, None], mirrors.normal, normal)
    return Surfaces(mirrors.apex, normal, mirrors.curvature)


def cut_positions(cells: Cells, pinhole: Floats, radius: float | Floats) -> Floats:
    """Largest x of the image of each halved mirror's cut over the object, mm, (m,).

    The image is where the rays camera -> cut -> reflected pierce the plane through the origin that
    faces the virtual camera. Camera a's half sees what lies at larger x, camera b's, its mirror
    image, what lies at smaller -x. Above zero neither sees a stretch twice as wide. It counts
    within a radius along the seam, () or (m,), and is minus infinity for whole mirrors.
    """
    mirror, x, along = cut_images(cells, pinhole)
    largest = np.full(cells.mirrors, -np.inf)
    within = np.broadcast_to(radius, cells.mirrors)[mirror, None]
    np.maximum.at(largest, mirror, _largest_within(x, along, within))
    return largest


def seam_gaps(cells: Cells, pinhole: Floats, radius: float) -> Floats:
    """Widest stretch of the object that neither half of each mirror sees, mm, (m,); or zero."""
    position = cut_positions(cells, pinhole, radius)
    return np.where(position > ROUNDING_MM, 2 * position, 0.0)


def cut_images(cells: Cells, pinhole: Floats) -> tuple[Ints, Floats, Floats]:
    """Images of the cuts of camera a's mirrors, in the plane through the origin.

    The mirror of each arc on a cut, (e,), x and place along the seam of its image, mm, (e,
    SAMPLES).
    """
    mirror, arc = cell_sides(cells)
    cut = cells.halved[mirror] & (cells.arcs.faces[arc] == cells.seam).any(axis=1)
    mirror, arc = (np.broadcast_to(one[cut, None], (cut.sum(), SAMPLES)) for one in (mirror, arc))
    point = cells.arcs.at(arc, np.broadcast_to(np.linspace(0, 1, SAMPLES), arc.shape))
    ray = reflected_rays(pinhole, point, cells.surfaces.gradient(mirror, point))
    u = unit(cells.surfaces.apex[mirror])
    image = point - (dot(point, u) / dot(ray, u))[..., None] * ray
    return mirror[:, 0], image[..., 0], dot(image, np.cross(u, X))


def _largest_within(x: Floats, along: Floats, radius: Floats) -> Floats:
    """Largest x (e,) of polylines (e, s) as far as they lie within radii (e, 1) along the seam."""
    start, end = along[:, :-1], along[:, 1:]
    step = np.where(start == end, 1.0, end - start)
    ends = (np.clip(one, -radius, radius) - start for one in (start, end))
    within = (np.minimum(start, end) <= radius) & (np.maximum(start, end) >= -radius)
    at_ends = np.max([x[:, :-1] + np.diff(x) * end / step for end in ends], axis=0)
    return np.asarray(np.where(within, at_ends, -np.inf).max(axis=1))
