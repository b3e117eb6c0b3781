"""The lit object in a frame: itself, and its images in the balls."""

import numpy as np

from tbcad.optics.lens_camera import LensCamera
from tbcad.optics.pedestals.walls import NO_WALLS, GrooveWalls
from tbcad.simulate.capture.photograph import row_bands
from tbcad.simulate.prototype.ball_rays import ball_hits, reflected_colours
from tbcad.simulate.prototype.plan import HALF_TURN
from tbcad.simulate.scene.ray_casting import Scene, object_in_front
from tbcad.types import Colours, Floats


def pixel_directions(camera: LensCamera) -> Floats:
    """Unit directions (h, w, 3) through all pixels."""
    return camera.directions(pixel_places(camera))


def pixel_places(camera: LensCamera) -> Floats:
    """Column and row of all pixels, (h, w, 2)."""
    row, column = np.mgrid[: camera.height_px, : camera.width_px]
    return np.stack([column, row], axis=-1).astype(np.float64)


def object_light(
    pinhole: Floats,
    directions: Floats,
    balls: Floats,
    scene: Scene,
    turned: bool,
    walls: GrooveWalls = NO_WALLS,
) -> Colours:
    """What a camera sees of a lit object, 0 to 255, (h, w, 3).

    Args:
        pinhole: of the camera, mm, (3,).
        directions: of its pixels, (h, w, 3).
        balls: in the frame, (k, 8).
        scene: the object as it stands in the first run.
        turned: whether it is turned by 180 degrees.
        walls: of the balls.
    """
    # Seen from the object, which rests, camera and balls are turned instead.
    flip = HALF_TURN if turned else np.ones(3)
    pinhole, walls = pinhole * flip, walls.flipped(flip)
    balls = balls * np.concatenate([flip, [1.0], flip, [1.0]])
    bands = (directions[rows.start : rows.stop] * flip for rows in row_bands(len(directions)))
    return np.concatenate([_band(pinhole, balls, walls, scene, band) for band in bands])


def _band(
    pinhole: Floats, balls: Floats, walls: GrooveWalls, scene: Scene, directions: Floats
) -> Colours:
    direction = directions.reshape(-1, 3)
    stop = np.zeros(len(direction), dtype=np.int64)
    hits = ball_hits(pinhole, balls[None], direction, stop, walls)
    front, direct = object_in_front(scene, pinhole, direction, hits.distance)
    colours = np.where(front[:, None], direct, reflected_colours(scene, hits))
    return np.asarray(colours.reshape(directions.shape))
