"""What a real camera in the same place would photograph, ray-traced: the ground truth."""

import numpy as np

from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.capture.photograph import subpixel_shifts
from tbcad.light.simulate.scene.ray_casting import Scene, colours_along
from tbcad.light.simulate.scene.viewpoint import view_directions
from tbcad.light.simulate.views.refocus import ThinLens, lens_rays
from tbcad.types import Colours, Floats, Progress

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


def pinhole_picture(scene: Scene, view: Camera, samples: int = 4) -> Colours:
    """The picture (h, w, 3), 0 to 255, of a pinhole camera, samples x samples rays a pixel."""
    total = np.zeros((view.height_px, view.width_px, 3), dtype=np.float32)
    for shift in subpixel_shifts(samples):
        direction = view_directions(view, shift)
        flat = direction.reshape(-1, 3)
        origin = np.broadcast_to(view.pinhole, flat.shape)
        total += colours_along(scene, origin, flat).reshape(total.shape)
    return total / np.float32(samples**2)


def lens_picture(
    scene: Scene,
    view: Camera,
    focus: ThinLens,
    samples: int = 256,
    progress: Progress = lambda _: None,
) -> Colours:
    """The picture (h, w, 3), 0 to 255, of a camera with a thin lens.

    Args:
        scene: the object.
        view: the middle of the lens, and the picture.
        focus: diameter of the lens, and the plane that it makes sharp.
        samples: rays a pixel, each through another point of the lens and of the pixel.
        progress: called with each step.
    """
    total = np.zeros((view.height_px, view.width_px, 3), dtype=np.float32)
    for k, (point, shift) in enumerate(
        zip(disc_points(samples), pixel_points(samples), strict=True)
    ):
        progress(f"ray {k + 1} of {samples}")
        rays = lens_rays(view, focus, point * focus.aperture_mm / 2, shift)
        colours = colours_along(scene, *(part.reshape(-1, 3) for part in rays))
        total += colours.reshape(total.shape)
    return total / np.float32(samples)


def disc_points(count: int) -> Floats:
    """Points (n, 2) spread evenly over the unit disc, on Vogel's spiral."""
    k = np.arange(count)
    radius, angle = np.sqrt((k + 0.5) / count), GOLDEN_ANGLE * k
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def pixel_points(count: int) -> list[tuple[float, float]]:
    """Points spread evenly over a pixel, from its centre (the R2 sequence of M. Roberts, 2018)."""
    plastic = 1.324717957244746
    steps = np.arange(count)[:, None] / np.array([plastic, plastic**2])
    places = (0.5 + steps) % 1 - 0.5
    return [(float(x), float(y)) for x, y in places]
