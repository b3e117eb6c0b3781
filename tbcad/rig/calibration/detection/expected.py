"""Where a machine shows its LEDs, how large, and what may hide them."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import vignetting, vignetting_slope
from tbcad.core.optics.led_dome import dome_images
from tbcad.rig.machine.machine import Machine
from tbcad.types import Bools, Floats, Ints

MARGIN_PX = 6.0  # of the picture: highlights nearer to its edge are not whole


@dataclass(frozen=True)
class Room:
    """What an object on the stage may fill: an upright cylinder about z."""

    radius: float  # mm
    bottom: float  # height z of the disc that it stands on, mm
    top: float  # height z, mm


@dataclass(frozen=True)
class Expected:
    """Highlights that a machine shows, over n of them."""

    frame: Ints  # from 0, (n,)
    sphere: Ints  # from 0, (n,)
    led: Ints  # from 0, (n,)
    pixel: Floats  # column and row of the LED's own place, (n, 2)
    centroid: Floats  # of its dome's image, from there, pixels, (n, 2)
    spread: Floats  # mean square of that image about its centroid, square pixels, (n, 2, 2)
    brighter: Floats  # share by which the lens lets more light through a pixel on, (n, 2)
    light: Floats  # area of the image times the lens's share of light there, square pixels, (n,)
    inside: Bools  # whether it is whole in the picture, (n,)


def expected_highlights(machine: Machine, dome: float) -> Expected:
    """All highlights of a machine whose LEDs have domes of a radius in mm."""
    camera = machine.camera
    shape = len(machine.angle), len(machine.radius), len(machine.leds)
    frame, sphere, led = (index.ravel() for index in np.indices(shape))
    centre, place = machine.centres(frame, sphere), machine.leds[led]
    image = dome_images(camera, centre, machine.radius[sphere], place, dome)
    size = np.array([camera.width_px, camera.height_px])
    ahead = camera.shows(image.direction)
    inside = ((image.place >= MARGIN_PX) & (image.place <= size - 1 - MARGIN_PX)).all(axis=1)
    through = vignetting(camera, image.direction)
    return Expected(
        frame=frame,
        sphere=sphere,
        led=led,
        pixel=image.place,
        centroid=image.centroid,
        spread=image.spread,
        brighter=vignetting_slope(camera, image.place),
        light=image.area * through,
        inside=inside & ahead,
    )


def maybe_hidden(machine: Machine, expected: Expected, room: Room) -> Bools:
    """Which highlights (n,) an object in its room may hide, by the straight way from LED to sphere.

    The way is crossed with the infinite cylinder, and its heights there with the room's.
    """
    centre = machine.centres(expected.frame, expected.sphere)
    start = machine.leds[expected.led]
    way = unit(centre - start)
    level = norm(way[:, :2]) ** 2
    along = -dot(start[:, :2], way[:, :2]) / np.maximum(level, np.finfo(float).tiny)
    nearest = start + along[:, None] * way
    inside = room.radius**2 - norm(nearest[:, :2]) ** 2
    half = np.sqrt(np.maximum(inside, 0) / np.maximum(level, np.finfo(float).tiny))
    first, last = along - half, along + half
    low, high = (start[:, 2] + end * way[:, 2] for end in (np.maximum(first, 0), last))
    crosses = (np.minimum(low, high) < room.top) & (np.maximum(low, high) > room.bottom)
    return np.asarray((inside > 0) & (last > 0) & crosses)
