"""What each mirror covers, by exact rays; and cells as windows, and what a ball shows in them.

The halves of a mirror that the seam halves are two spheres. The seam's plane cuts both, and
astigmatism turns the image of the cut at the object, the other way in each half: at one end each
half sees beyond x = 0, at the other neither sees what is next to it. So each half is aimed at a
point beyond x = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.optics.side_rays import misses_of_balls, misses_of_mirrors
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

SAMPLES = 9  # of each arc: over all of it, then between the neighbours of the smallest
ROUNDS = 3  # after three rounds the samples are a 128th of the arc apart; a parabola does the rest
# After four rounds the samples are a 512th of the side apart, and the smallest miss distance is
# right to a micrometre.
WINDOW_ROUNDS = 4
X = np.array([1.0, 0.0, 0.0])
CUT_SAMPLES = 65  # of an arc of the cut: the image is less than 1 um off the chords between them
ROUNDING_MM = 1e-9  # the image of the cut through a planar mirror is the plane x = 0 itself


def cell_sides(cells: Cells) -> tuple[Ints, Ints]:
    """Mirror (e,) and arc (e,) of each side of a cell."""
    arc, which = np.nonzero(cells.arcs.faces < cells.mirrors)
    return cells.arcs.faces[arc, which], arc


def limiting_sides(cells: Cells) -> tuple[Ints, Ints]:
    """Mirror (e,) and arc (e,) of each side of a cell that limits what its mirror covers.

    The cut of a halved mirror does not: its other half belongs to the other camera and shares its
    virtual camera, so the cut itself does not limit the two together.
    """
    mirror, arc = cell_sides(cells)
    cut = (cells.arcs.faces[arc] == cells.seam).any(axis=1)
    limiting = ~(cells.halved[mirror] & cut)
    return mirror[limiting], arc[limiting]


def coverage_diameters(cells: Cells, pinhole: Floats) -> Floats:
    """Coverage diameter of each mirror by exact rays, mm, (m,).

    It is twice the smallest distance from the origin of all rays camera -> edge of the cell ->
    reflected. The virtual camera sees the whole capture sphere of the paper's section 3 when its
    coverage diameter is at least that of the sphere.
    """
    mirror, arc = limiting_sides(cells)

    surfaces, points, weight = cells.surfaces, cells.arcs.points[arc], cells.arcs.weight[arc]
    mirrors = np.column_stack([surfaces.apex, surfaces.normal, surfaces.curvature])

    def miss(t: Floats) -> Floats:
        return misses_of_mirrors(points, weight, mirror, mirrors, pinhole, t)

    smallest = parabola_minima(samples_about_minima(miss, len(arc), ROUNDS))
    return 2 * minima_by_mirror(mirror, smallest, cells.mirrors)


def samples_about_minima(function: Callable[[Floats], Floats], curves: int, rounds: int) -> Floats:
    """Values (k, SAMPLES) about the minimum on [0, 1] of a function of parameters (k, SAMPLES).

    Each round samples evenly between the neighbours of the last round's smallest sample.
    """
    low, high = np.zeros(curves), np.ones(curves)
    row = np.arange(curves)
    for _ in range(rounds):
        t = np.linspace(low, high, SAMPLES, axis=1)
        values = function(t)
        best = np.argmin(values, axis=1)
        low, high = t[row, np.maximum(best - 1, 0)], t[row, np.minimum(best + 1, SAMPLES - 1)]
    return values


def parabola_minima(values: Floats) -> Floats:
    """Minimum (k,) of each row (k, s) of even samples, on the parabola through its neighbours.

    For samples a, b, c with the smallest in the middle the parabola's vertex lies
    (c - a)^2 / (8 (a - 2 b + c)) below b. Where the smallest is at an end, it is the minimum.
    """
    row, best = np.arange(len(values)), np.argmin(values, axis=1)
    middle = np.clip(best, 1, values.shape[1] - 2)
    before, centre, after = (values[row, middle + k] for k in (-1, 0, 1))
    bend, slope = before - 2 * centre + after, after - before
    inside = (best == middle) & (bend > 0)
    result: Floats = values[row, best]
    result[inside] -= (slope**2)[inside] / (8 * bend)[inside]
    return result


def minima_by_mirror(mirror: Ints, values: Floats, mirrors: int) -> Floats:
    """Smallest of the values (e,) of each mirror's sides, (mirrors,); infinite without sides."""
    smallest = np.full(mirrors, np.inf)
    np.minimum.at(smallest, mirror, values)
    return smallest


@dataclass(frozen=True)
class Windows:
    """Sides of the cells of m mirrors as the camera sees them, over e of them.

    A cell halved by the seam has no side there: the other half belongs to the other camera and
    shows what this one does not. Windows can be rotated about axes through the pinhole, each by
    an axis (m, 3) of unit length and an angle (m,) in radians.
    """

    cells: Cells  # of the m mirrors
    pinhole: Floats  # mm, (3,)
    mirror: Ints  # mirror of each side, (e,)
    arc: Ints  # arc of each side, (e,)

    def only(self, mirrors: Bools) -> "Windows":
        """The sides of some mirrors (m,)."""
        kept = mirrors[self.mirror]
        return Windows(self.cells, self.pinhole, self.mirror[kept], self.arc[kept])

    def rays(self, t: Floats, axis: Floats, angle: Floats) -> Floats:
        """Unit rays (e, s, 3) from the camera through the rotated sides at parameters t (e, s)."""
        point = self.cells.arcs.at(np.broadcast_to(self.arc[:, None], t.shape), t)
        ray = unit(point - self.pinhole)
        return rotated(ray, axis[self.mirror][:, None], angle[self.mirror][:, None])

    def coverage(
        self,
        centre: Floats,
        radius: Floats,
        axis: Floats,
        angle: Floats,
        pinhole: Floats | None = None,
    ) -> Floats:
        """Coverage diameter (m,) of one ball for each mirror within its rotated window, mm.

        It is twice the smallest distance from the origin of all rays through the window's edge
        after the ball, infinite without sides. Whether the ball shows the origin inside the window
        is a question to `contains`. Windows are turned about unit axes (m, 3) by angles (m,); the
        camera that sees the balls is at the windows' own pinhole unless another is given.
        """
        pinholes = np.stack([self.pinhole, self.pinhole if pinhole is None else pinhole])
        balls = np.column_stack([centre, radius, axis, np.cos(angle), np.sin(angle)])
        points, weight = self.cells.arcs.points[self.arc], self.cells.arcs.weight[self.arc]

        def miss(t: Floats) -> Floats:
            return misses_of_balls(points, weight, self.mirror, balls, pinholes, t)

        smallest = samples_about_minima(miss, len(self.arc), WINDOW_ROUNDS).min(axis=1)
        return 2 * minima_by_mirror(self.mirror, smallest, self.cells.mirrors)

    def contains(self, direction: Floats, axis: Floats, angle: Floats) -> Bools:
        """Whether each rotated window contains a direction (m, 3) from the pinhole, (m,).

        The window's sides wind once about a direction inside and not at all about one outside;
        those of a halved window wind half about the middle of the cut.
        """
        t = np.broadcast_to(np.linspace(0, 1, SAMPLES), (len(self.arc), SAMPLES))
        ray, about = self.rays(t, axis, angle), direction[self.mirror][:, None]
        flat = ray - dot(ray, np.broadcast_to(about, ray.shape))[..., None] * about
        before, after = flat[:, :-1], flat[:, 1:]
        about = np.broadcast_to(about, before.shape)
        winding = np.arctan2(dot(np.cross(before, after), about), dot(before, after)).sum(axis=1)
        forward = self.cells.arcs.left[self.arc] == self.mirror
        total = np.zeros(self.cells.mirrors)
        np.add.at(total, self.mirror, np.where(forward, winding, -winding))
        return np.asarray(np.abs(total) > np.where(self.cells.halved, np.pi / 2, np.pi))


def cell_windows(cells: Cells, pinhole: Floats) -> Windows:
    """The windows of all mirrors as a camera with this pinhole (3,) sees them."""
    return Windows(cells, pinhole, *limiting_sides(cells))


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
    CUT_SAMPLES).
    """
    mirror, arc = cell_sides(cells)
    cut = cells.halved[mirror] & (cells.arcs.faces[arc] == cells.seam).any(axis=1)
    mirror, arc = (
        np.broadcast_to(one[cut, None], (cut.sum(), CUT_SAMPLES)) for one in (mirror, arc)
    )
    point = cells.arcs.at(arc, np.broadcast_to(np.linspace(0, 1, CUT_SAMPLES), arc.shape))
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
