"""Which spot is which highlight: by a machine that is brought nearer to them step by step.

At one LED a time every sphere shows one spot, so neighbours are far apart. At first the whole
picture may be shifted by dozens of pixels, mostly alike: the shift that most pairs of spots and
expected places agree on is taken. Then the machine is estimated from the nearest pairs, and paired
again.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import vignetting, vignetting_slope
from tbcad.core.optics.led_dome import Waves, dome_images
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibration.detection.spots import BrightSpots, stacked
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import Estimate, estimate
from tbcad.rig.machine.machine import Highlights, Machine
from tbcad.types import Bools, Floats, Ints, Progress

MARGIN_PX = 6.0  # of the picture: highlights nearer to its edge are not whole
SHIFT_PX, BIN_PX = 160.0, 8.0  # farthest shift that is looked for, and how finely
FIRST_FRAMES = 40  # that the first estimate is made of
# Farthest spot from an expected place, pixels, before and after an estimate, and how far off spots
# are taken to be in it: what the machine's model leaves open.
FIRST_PX, NEAR_PX, FINAL_PX = 30.0, 10.0, 2.5
FIRST_SIGMA_PX, SIGMA_PX = 2.0, 0.3
FEW = 4  # highlights of a frame
MIN_HIGHLIGHTS = 4  # of a frame, to say where it is
MIN_FRAMES = 3  # on either side of a move
MIN_MOVE_PX, MOVE_SIGMAS = 0.15, 8.0  # less is no move
FEW_PAIRS = 0.3  # share of the usual number of pairs: fewer are not where the machine shows them


@dataclass(frozen=True)
class Room:
    """Room of an object on the stage: an upright cylinder about z."""

    radius: float  # mm
    bottom: float  # height z of the disc that it stands on, mm
    top: float  # height z, mm


def object_room(export: ExportedDesign) -> Room:
    """Room of an object in the design: on the disc, within the capture sphere."""
    stage = export.spec.prototype.stage
    radius = stage.object_diameter_mm / 2
    return Room(radius, stage.top_mm, math.sqrt((export.capture_mm / 2) ** 2 - radius**2))


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
    wave: Waves  # of its image, as of DomeImages, (n, 2)


def expected_highlights(machine: Machine, dome: float) -> Expected:
    """All highlights of a machine whose LEDs have domes of a radius in mm."""
    camera = machine.camera
    shape = len(machine.angle), len(machine.radius), len(machine.leds)
    frame, sphere, led = (index.ravel() for index in np.indices(shape))
    place = machine.leds[led]
    centre = machine.reflecting_centres(frame, sphere, place)
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
        wave=image.wave,
    )


def maybe_hidden(machine: Machine, expected: Expected, room: Room | None) -> Bools:
    """Which highlights (n,) an object in its room may hide, by the straight way from LED to sphere.

    The way is crossed with the infinite cylinder, and its heights there with the room's.
    """
    if room is None:
        return np.zeros(len(expected.led), dtype=bool)
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


class NoPairs(Exception):
    """No spot is near any highlight that the machine should show."""


def match(
    prior: Prior, spots: BrightSpots, dome: float, progress: Progress
) -> tuple[Expected, Ints, Estimate]:
    """Pair spots with highlights of a prior's machine, whose LEDs have domes of a radius in mm.

    Gives the highlights that the machine should show; the spot of each, or -1, (n,); and the
    machine that was estimated on the way. NoPairs: the spots fit no machine near the prior.
    """
    expected = expected_highlights(prior.mean, dome)
    some = np.unique(np.linspace(0, len(prior.mean.angle) - 1, FIRST_FRAMES).astype(np.int64))
    first = np.isin(expected.frame, some)
    places = _places(expected) + _common_shift(expected, spots)
    partner = np.where(first, paired(expected, places, spots, FIRST_PX), -1)
    progress("first estimate")
    found = _estimated(prior, expected, partner, spots, FIRST_SIGMA_PX)
    for radius in (NEAR_PX, FINAL_PX):
        expected = expected_highlights(found.machine, dome)
        partner = paired(expected, _places(expected), spots, radius)
        if radius > FINAL_PX:
            progress("second estimate")
            found = _estimated(prior, expected, partner, spots, SIGMA_PX)
    return expected, partner, found


def _places(expected: Expected) -> Floats:
    return expected.pixel + expected.centroid


def _common_shift(expected: Expected, spots: BrightSpots) -> Floats:
    """Shift (2,) from expected places to spots on which most pairs agree."""
    mine, theirs = _tree(expected, _places(expected))
    others = cKDTree(stacked(spots.frame, spots.led, spots.pixel))
    pairs = others.sparse_distance_matrix(theirs, SHIFT_PX, output_type="ndarray")
    spot, highlight = pairs["i"], mine[pairs["j"]]
    shift = spots.pixel[spot] - _places(expected)[highlight]
    if not len(shift):
        raise NoPairs
    edges = np.arange(-SHIFT_PX, SHIFT_PX + BIN_PX, BIN_PX)
    count, _, _ = np.histogram2d(shift[:, 0], shift[:, 1], bins=[edges, edges])
    # A peak is often on an edge between bins: four bins count together.
    four = count[:-1, :-1] + count[1:, :-1] + count[:-1, 1:] + count[1:, 1:]
    best = np.unravel_index(int(four.argmax()), four.shape)
    return np.asarray(edges[np.array(best) + 1])


def shift_of(expected: Expected, spots: BrightSpots) -> Floats:
    """Middle shift (2,) of spots from the highlights next to them; NaN where few are near."""
    partner = paired(expected, _places(expected), spots, NEAR_PX)
    near = np.flatnonzero(partner >= 0)
    if len(near) < FEW * len(np.unique(spots.frame)):
        return np.full(2, np.nan)
    return np.asarray(np.median(spots.pixel[partner[near]] - _places(expected)[near], axis=0))


def paired(expected: Expected, places: Floats, spots: BrightSpots, radius: float) -> Ints:
    """The spot of each highlight, or -1, (n,): each is the other's nearest within a radius."""
    partner = np.full(len(places), -1)
    mine, tree = _tree(expected, places)
    places_of_spots = stacked(spots.frame, spots.led, spots.pixel)
    if not len(mine) or not len(spots):
        return partner
    nearest = np.array(cKDTree(places_of_spots).query(tree.data, distance_upper_bound=radius)[1])
    back = np.array(tree.query(places_of_spots)[1])
    near = np.flatnonzero(nearest < len(spots))  # others have no neighbour within the radius
    mutual = near[back[nearest[near]] == near]
    partner[mine[mutual]] = nearest[mutual]
    return partner


def _tree(expected: Expected, places: Floats) -> tuple[Ints, cKDTree]:
    """Numbers of the highlights that are in the picture, and a tree of their places (n, 2)."""
    which = np.flatnonzero(expected.inside)
    return which, cKDTree(stacked(expected.frame[which], expected.led[which], places[which]))


def highlights_of(
    expected: Expected, partner: Ints, spots: BrightSpots, sigma: Floats | float
) -> Highlights:
    """Paired highlights, their places less what shifts their centroids.

    That is the dome's shape, and the lens, which lets more light through on one side of a spot.
    """
    which = np.flatnonzero(partner >= 0)
    spot = partner[which]
    # Mean square of one way: what the dome's image does not explain is blur, alike in all ways.
    square, dome = (spots.shot / spots.light)[spot], expected.spread[which]
    blur = square - np.trace(dome, axis1=1, axis2=2) / 2
    brighter = expected.brighter[which]
    lens = (dome @ brighter[..., None])[..., 0] + blur[:, None] * brighter
    pixel = spots.pixel[spot] - expected.centroid[which] - lens
    known = np.broadcast_to(sigma, len(partner))[which]
    return Highlights(
        expected.frame[which], expected.sphere[which], expected.led[which], pixel, known
    )


def sampling_shifts(expected: Expected, partner: Ints, spots: BrightSpots) -> Floats:
    """Pixels by which paired spots' centroids are off by sampling, for a lens's contrast of 1.

    Pixels take the light of their area, so a centroid of them is exact but for lines of one cycle
    a pixel, of which they pass none, but their slope: by Poisson's sum it is off by
    -1 / pi times the mean of sin(2 pi x) over the light, and the contrast of its blur, (n, 2).
    """
    which = np.flatnonzero(partner >= 0)
    phase = np.exp(2j * np.pi * spots.pixel[partner[which]])
    return np.asarray(-(expected.wave[which] * phase).imag / np.pi)


def _estimated(
    prior: Prior, expected: Expected, partner: Ints, spots: BrightSpots, sigma: float
) -> Estimate:
    if (partner < 0).all():
        raise NoPairs
    return estimate(prior, highlights_of(expected, partner, spots, sigma))


@dataclass(frozen=True)
class CameraMove:
    """A move of the camera."""

    first: int  # number of the first frame after it
    kept: Bools  # whether each frame is on the side that is kept, (f,)


def find_move(estimate: Estimate, frames: int, spots: Floats) -> CameraMove | None:
    """The one move of the camera that residuals, and spots in each frame (f,), show; or None."""
    frame = estimate.highlights.frame
    count = np.bincount(frame, minlength=frames).astype(np.int64)
    lost = (count < FEW_PAIRS * np.median(count[count > 0])) & (spots > 0)
    # All that is lost comes before or after one frame.
    if lost.sum() >= MIN_FRAMES and np.count_nonzero(np.diff(lost.astype(int))) == 1:
        return CameraMove(int(np.flatnonzero(lost != lost[0])[0]), ~lost)
    return _step(estimate, count)


def _step(estimate: Estimate, count: Ints) -> CameraMove | None:
    known = np.flatnonzero(count >= MIN_HIGHLIGHTS)
    if len(known) < 2 * MIN_FRAMES:
        return None
    frame = estimate.highlights.frame
    middle = np.array([np.median(estimate.residual[frame == f], axis=0) for f in known])
    before = np.arange(1, len(known))[:, None]
    sums = np.cumsum(middle, axis=0)
    step = (sums[-1] - sums[:-1]) / (len(known) - before) - sums[:-1] / before
    # A step in the middle is known better than one near an end.
    weight = np.sqrt(before * (len(known) - before) / len(known))
    score = norm(step * weight)
    score[: MIN_FRAMES - 1] = score[len(known) - MIN_FRAMES :] = 0
    best = int(score.argmax())
    scatter = float(np.median(np.abs(np.diff(middle, axis=0)))) + np.finfo(float).eps
    if norm(step[best]) < MIN_MOVE_PX or score[best] < MOVE_SIGMAS * scatter:
        return None
    first = int(known[best + 1])
    after = np.arange(len(count)) >= first
    return CameraMove(first, after if after.sum() > (~after).sum() else ~after)
