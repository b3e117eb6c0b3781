"""The light of the LEDs in the balls, point by point: once reflected, and twice."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.led_dome import disc_images, dome_samples
from tbcad.core.optics.pedestals.cells import GrooveWalls
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.sphere_forms import effective_centres
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.ball_rays import (
    ON_BALL_MM,
    ball_hits,
    balls_between,
    points_within_walls,
)
from tbcad.light.simulate.prototype.run import HALF_TURN, SPHERES
from tbcad.light.simulate.scene.ray_casting import distances_to, embree_scene
from tbcad.light.simulate.scene.upper_lamps import upper_facets
from tbcad.records.prototype import NAME, PrintedPartRecord, Prototype
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.types import Bools, Floats, Ints

NEAR_MM = 0.05  # of the LED: its dome stands in its pocket
DOME_MM = 1.5  # radius of a 3 mm LED
ROUNDS = 5  # of the search for both points of a light that is reflected twice
# Less light than this of an LED that fills a pixel is nothing: 0.1 of 255, spread over four pixels.
FAINT_PX2 = 2e-3


@dataclass(frozen=True)
class Occluders:
    """Meshes before LEDs."""

    # scene of the object, as it stands in the first run; None without an object
    subject: Any | None
    # scene of the stage, which does not turn; None where its meshes are not there
    stage: Any | None

    def hide(self, point: Floats, led: Floats, turned: bool) -> Bools:
        """Which of n points (n, 3) have something between them and places on LEDs (n, 3)."""
        way = led - point
        length = norm(way)
        direction = way / length[:, None]
        flip = HALF_TURN if turned else np.ones(3)
        hidden = _nearer(self.subject, point * flip, direction * flip, length)
        return hidden | _nearer(self.stage, point, direction, length)


def _nearer(scene: Any | None, origin: Floats, direction: Floats, length: Floats) -> Bools:
    if scene is None or len(origin) == 0:
        return np.zeros(len(origin), dtype=bool)
    return np.asarray(distances_to(scene, origin, direction) < length - NEAR_MM)


def stage_scene(folder: Path) -> Any | None:
    """Stage's printed parts of a build, and rods and boards of the LEDs above; None: none."""
    parts = Prototype.read(folder / NAME).with_role("stage")
    facets = [*(_placed(folder, part) for part in parts), upper_facets(folder)]
    facets = [one for one in facets if len(one)]
    return embree_scene(np.concatenate(facets)) if facets else None


def _placed(folder: Path, part: PrintedPartRecord) -> Floats:
    """Facets of a part by their corners, mm, (f, 3, 3), back from the printer's bed."""
    import trimesh

    path = folder / Path(part.stl).name
    try:
        mesh: Any = trimesh.load(path, file_type="stl", force="mesh", process=False)
        corners = np.asarray(mesh.triangles, dtype=np.float64)
    except Exception as error:  # trimesh's readers raise whatever their libraries do
        raise InputError(f"{path} cannot be read: {error}: build it again") from None
    return np.asarray((corners - part.origin_mm) @ np.array(part.axes).T)


class LightPoints(NamedTuple):
    """Points of light in a picture, over n of them."""

    led: Ints  # that each is of, from 0, (n,)
    pixel: Floats  # column and row, (n, 2)
    # square pixels that each stands for, (n,); its light, if its surface is as bright as fills a
    # pixel
    area: Floats

    def of(self, led: int) -> tuple[Floats, Floats]:
        """Pixels and areas of one LED."""
        own = self.led == led
        return self.pixel[own], self.area[own]


def balls_of_frame(built: BuiltPrototype, frame: int) -> Floats:
    """All balls in a frame, (k, 8), as tbcad.light.simulate.prototype.run.PrototypeRun has them."""
    machine = built.machine
    spheres = np.arange(len(machine.radius))
    frames = np.full(len(spheres), frame)
    bodies = machine.on_spheres(built.body_centre, frames, spheres)
    forms = [] if machine.forms is None else [machine.forms_in(frames, spheres)]
    return np.column_stack(
        [machine.centres(frames, spheres), machine.radius, bodies, built.body_radius, *forms]
    )


def led_light(
    built: BuiltPrototype,
    frame: int,
    turned: bool,
    occluders: Occluders,
    dome: float = DOME_MM,
    faint: float = FAINT_PX2,
    reflectance: float = 1.0,
) -> LightPoints:
    """All light of the LEDs that reaches the camera over the balls in a frame, from 0.

    The object may be turned by 180 degrees; LEDs have domes of a radius in mm. Images of images
    with less than a faint area, square pixels, are not followed, and are darker than images by the
    balls' reflectance.
    """
    balls = balls_of_frame(built, frame)
    once = _reflected_once(built, balls, turned, occluders, dome)
    twice = _reflected_twice(built, balls, turned, occluders, (dome, faint))
    twice = twice._replace(area=reflectance * twice.area)
    return LightPoints(*(np.concatenate(pair) for pair in zip(once, twice, strict=True)))


def _reflected_once(
    built: BuiltPrototype, balls: Floats, turned: bool, occluders: Occluders, dome: float
) -> LightPoints:
    machine = built.machine
    camera = machine.camera
    ball, led = np.indices((len(balls), len(machine.leds))).reshape(2, -1)
    centre, radius, place = balls[ball, :3], balls[ball, 3], machine.leds[led]
    if balls.shape[1] > SPHERES:  # near where the LED is shown each is as this sphere
        centre = effective_centres(centre, radius, balls[ball, SPHERES:], place, camera.pinhole)
    disc = disc_images(camera, centre, radius, place, dome)
    from_place, share = dome_samples(disc.axes)
    # As bright everywhere in the image: what is shown larger gives more light.
    within = from_place @ disc.axes[:, :2].swapaxes(1, 2)
    growth = (within @ disc.growth[..., None])[..., 0]
    area = share * disc.area[:, None] * np.maximum(1 + growth, 0)
    # Only samples that shine are followed. The eye sees them in the disc behind the dome.
    which, sample = np.nonzero(share)
    light = place[which] + dome * from_place[which, sample]
    seen = np.einsum("na,nax->nx", within[which, sample], disc.axes[which, :2])
    in_disc = place[which] + dome * seen
    point = reflection_points(centre[which], radius[which], in_disc, camera.pinhole)
    shown = _seen(camera, balls, built.walls, point, ball[which])
    shown &= ~balls_between(point, light, balls, built.walls.of_mirrors(len(balls)))
    shown[shown] = ~occluders.hide(point[shown], light[shown], turned)
    which, sample, pixel = which[shown], sample[shown], camera.project(point[shown])
    return LightPoints(led[which], pixel, area[which, sample])


def _seen(
    camera: LensCamera, balls: Floats, walls: GrooveWalls, point: Floats, ball: Ints
) -> Bools:
    """Which points (n, 3) on balls (n,) the camera sees, on their front."""
    direction = unit(point - camera.pinhole)
    hits = ball_hits(camera.pinhole, balls[None], direction, 0 * ball, walls)
    return np.asarray(hits.ball == ball + 1)


def _reflected_twice(
    built: BuiltPrototype,
    balls: Floats,
    turned: bool,
    occluders: Occluders,
    dome_and_faint: tuple[float, float],
) -> LightPoints:
    """Images of images, each a point with the area that it has at normal incidence."""
    dome, faint = dome_and_faint
    camera = built.machine.camera
    first, last, led = np.indices((len(balls), len(balls), len(built.machine.leds))).reshape(3, -1)
    place = built.machine.leds[led]
    bright = (first != last) & (_largest_area(camera, balls, first, last, dome) > faint)
    first, last, led, place = first[bright], last[bright], led[bright], place[bright]
    one, two = _path(balls, first, last, place, camera.pinhole)
    area = _area_twice(camera, balls, (first, last), (place, one, two), dome)
    walls = built.walls.of_mirrors(len(balls))
    normal = one - balls[first, :3]
    shown = (area > faint) & (dot(normal, place - one) > 0) & (dot(normal, two - one) > 0)
    shown &= norm(one - balls[first, 4:7]) <= balls[first, 7] + ON_BALL_MM  # on its mirror
    shown &= points_within_walls(one, first, walls)
    shown &= _seen(camera, balls, built.walls, two, last)
    shown &= ~balls_between(one, place, balls, walls) & ~balls_between(two, one, balls, walls)
    shown[shown] = ~occluders.hide(one[shown], place[shown], turned)
    return LightPoints(led[shown], camera.project(two[shown]), area[shown])


def _largest_area(
    camera: LensCamera, balls: Floats, first: Ints, last: Ints, dome: float
) -> Floats:
    """More than the area of any image of an image, square pixels, (n,).

    Zero where spheres meet, as those of caps do beyond their rims: no light is followed there.
    """
    between = norm(balls[first, :3] - balls[last, :3]) - balls[first, 3] - balls[last, 3]
    from_camera = norm(balls[last, :3] - camera.pinhole) - balls[last, 3]
    half = balls[last, 3] / 2
    apart = np.maximum(between, 0.0)
    seen = half / (half + apart) * dome * camera.focal.max() / from_camera
    return np.asarray(np.where(apart > 0, np.pi * seen**2, 0.0))


def _path(
    balls: Floats, first: Ints, last: Ints, place: Floats, pinhole: Floats
) -> tuple[Floats, Floats]:
    """Where light from places (n, 3) meets one ball and then another on its way to the camera."""
    one = balls[first, :3] + balls[first, 3:4] * unit(place - balls[first, :3])
    two = one
    # Balls that touch may leave no way between both points: it is none, and shows nothing.
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(ROUNDS):
            two = reflection_points(balls[last, :3], balls[last, 3], one, pinhole)
            one = reflection_points(balls[first, :3], balls[first, 3], place, two)
    return one, two


def _area_twice(
    camera: LensCamera,
    balls: Floats,
    pair: tuple[Ints, Ints],
    way: tuple[Floats, Floats, Floats],
    dome: float,
) -> Floats:
    """A convex mirror of radius r shows what is at a distance d smaller by r / (r + 2 d)."""
    size = np.full(len(pair[0]), dome)
    for ball, start, end in zip(pair, way, way[1:], strict=False):
        radius = balls[ball, 3]
        size *= radius / (radius + 2 * norm(end - start))
    return np.asarray(np.pi * (size * camera.focal.mean() / norm(way[2] - camera.pinhole)) ** 2)
