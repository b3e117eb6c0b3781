"""A large lens made of many pinholes (section 4.3 of the paper): the mean of their pictures."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.optics.camera import Camera
from tbcad.simulate.parallel import THREADS, in_threads
from tbcad.simulate.scene.rays import unit_directions
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import (
    Colours,
    Rays,
    SynthesisedView,
    nearby_rays,
    ray_colours,
    search_radius,
)
from tbcad.simulate.views.two_plane import two_plane_along
from tbcad.types import Bools, Floats, Progress

# The paper's 69 pinholes: so many points of a square lattice lie within this radius in its steps.
LATTICE_RADIUS2 = 20


@dataclass(frozen=True)
class Focus:
    """A lens.

    Attributes:
        aperture_mm: its diameter.
        plane_mm: the plane that it makes sharp, across its axis, from the origin toward the lens.
    """

    aperture_mm: float
    plane_mm: float

    def check(self, view: Camera, capture_mm: float) -> None:
        """Refuse what cannot be.

        Raises:
            InputError: no aperture, or the plane that is to be sharp is not near the object.
        """
        if not 0 < self.aperture_mm < np.inf:
            raise InputError(f"--aperture {self.aperture_mm:g} is no diameter: give mm above 0")
        limit = min(capture_mm, float(np.linalg.norm(view.pinhole)) - 1)
        if not -limit <= self.plane_mm <= limit:
            raise InputError(
                f"--focus {self.plane_mm:g} is far from the object: allowed is "
                f"{-limit:g} to {limit:g} mm from its middle, toward the camera"
            )


def lens_pinholes() -> Floats:
    """Places (n, 2) of pinholes on the unit disc: a square lattice, 69 of them."""
    reach = int(np.sqrt(LATTICE_RADIUS2))
    x, y = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    inside = x**2 + y**2 <= LATTICE_RADIUS2
    places: Floats = np.stack([x[inside], y[inside]], axis=1) / np.sqrt(LATTICE_RADIUS2)
    return places


def lens_rays(
    view: Camera, focus: Focus, place: Floats, shift: tuple[float, float] = (0.0, 0.0)
) -> Rays:
    """Rays from a point of the lens to where its middle sees each pixel on the sharp plane.

    Args:
        view: middle of the lens, and the picture.
        focus: the lens.
        place: on the lens, right and down from its middle, mm, (2,).
        shift: from the pixels' centres, in pixels.

    Returns:
        Origins and unit directions, (h, w, 3) each.
    """
    down = np.cross(view.forward, view.right)
    start = view.pinhole + place[0] * view.right + place[1] * down
    depth = -float(view.pinhole @ view.forward) - focus.plane_mm
    way = unit_directions(view, range(view.height_px), shift, depth, start - view.pinhole)
    return np.broadcast_to(start, way.shape), way


def refocus(tiles: MirrorTiles, view: Camera, focus: Focus) -> SynthesisedView:
    """The picture of a lens, as the mean of what 69 pinholes all over it see.

    Args:
        tiles: the light field.
        view: the middle of the lens, and the picture.
        focus: the lens.

    Where some pinholes saw nothing, because they lie outside of the hemisphere that was captured,
    the mean is of the others.
    """
    points = lens_pinholes() * focus.aperture_mm / 2
    slab = two_plane_along(view.forward, view.right, tiles.source.capture_mm)
    edge = [_meeting(tiles, view, focus, place) for place in _outermost(points)]
    corners = [np.concatenate(part) for part in zip(*(rays for rays, _ in edge), strict=True)]
    near = nearby_rays(tiles, slab, (corners[0], corners[1]), search_radius(tiles))
    total = np.zeros((view.height_px, view.width_px, 3), dtype=np.float32)
    count = np.zeros((view.height_px, view.width_px), dtype=np.float32)

    def one(place: Floats) -> tuple[Bools, Colours, Bools]:
        rays, meets = _meeting(tiles, view, focus, place)
        return meets, *ray_colours(near, rays)

    for first in range(0, len(points), 2 * THREADS):
        for meets, found, seen in in_threads(one, points[first : first + 2 * THREADS]):
            total[meets] += found
            count += ~meets
            count[meets] += seen
    mean = total / np.maximum(count, 1)[..., None]
    return SynthesisedView(mean.astype(np.float32), count > 0)


def refocus_sweep(
    tiles: MirrorTiles,
    view: Camera,
    aperture_mm: float,
    count: int,
    progress: Progress = lambda _: None,
) -> list[NDArray[np.uint8]]:
    """Pictures (h, w, 3) focused on planes from the back of the capture sphere to its front."""
    half = tiles.source.capture_mm / 2
    pictures = []
    for k, plane in enumerate(np.linspace(-half, half, count).tolist()):
        progress(f"picture {k + 1} of {count}")
        pictures.append(refocus(tiles, view, Focus(aperture_mm, plane)).image)
    return pictures


def _meeting(tiles: MirrorTiles, view: Camera, focus: Focus, place: Floats) -> tuple[Rays, Bools]:
    """Rays from a place on the lens that meet the capture sphere (n, 3), and which, (h, w)."""
    origin, way = lens_rays(view, focus, place)
    start = origin[0, 0]
    along = np.einsum("hwx,x->hw", way, start)  # BLAS rounds by its own number of threads
    meets: Bools = start @ start - along**2 <= (tiles.source.capture_mm / 2) ** 2
    inside = way[meets]
    return (np.broadcast_to(start, inside.shape), inside), meets


def _outermost(points: Floats) -> Floats:
    """The four corners of the square about places (n, 2)."""
    reach = float(np.abs(points).max(initial=0.0))
    return np.array([[-reach, -reach], [reach, -reach], [-reach, reach], [reach, reach]])
