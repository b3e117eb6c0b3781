"""Where a number of LEDs tells most: found among places in the stage's room.

LEDs come in pairs half a turn about z apart, so that the object's half turn between both runs
leaves their shadows as they were. Pairs are added one by one, each where it helps most; then each
is moved once more, until none gets better.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tbcad.core.geometry.vectors import norm
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.leds import POCKET_PLAY_MM, hidden_by_object, pillar_radius
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tbcad.rig.calibration.estimate.parameters import Block, Prior, prior_of
from tbcad.rig.calibration.uncertainty import SPHERE_MM, ray_slopes
from tbcad.rig.machine.designed import designed_shell, read_leds
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Progress

RINGS, AZIMUTHS, HEIGHTS = 2, 18, 5  # of the places that are tried; azimuths over half a turn
NUMBERS = (4, 6, 8, 16)
USUAL_PX, USUAL_PROCESS = 0.05, "fdm"
FREE, PRIOR_MM = np.inf, 0.025
MAX_ROUNDS = 6
DIGITS = 2  # of places in mm


@dataclass(frozen=True)
class SphereInformation:
    """Of m spheres, centre x, y, z and radius."""

    # of one highlight of each of l LEDs with noise of one pixel, 1/mm^2, (l, m, 4, 4); zero where
    # the LED is not seen
    by_led: Floats
    # derivatives of the rays to the object's centre: place along two directions, mm, and rotation,
    # radians, (m, 4, 4)
    rays: Floats


def ray_errors(
    information: SphereInformation,
    chosen: list[int],
    noise_px: float,
    sigma: tuple[float, float],
) -> tuple[Floats, Floats]:
    """Root mean square errors of rays at the object's centre, mm, and of directions, mrad, (m,).

    By chosen LEDs and noise of each figure of a highlight, px. Prior standard deviations of centre
    and radius, mm, are infinite for none, 0 for known.
    """
    data = information.by_led[chosen].sum(axis=0) / noise_px**2
    known = np.array([sigma[0]] * 3 + [sigma[1]])
    free = known > 0
    prior = np.diag(1 / known[free] ** 2)
    inverse = np.linalg.pinv(data[:, free][:, :, free] + prior, hermitian=True)
    slopes = information.rays[:, :, free]
    spread = np.diagonal(slopes @ inverse @ slopes.swapaxes(1, 2), axis1=1, axis2=2)
    return np.sqrt(spread[:, :2].sum(axis=1)), 1000 * np.sqrt(spread[:, 2:].sum(axis=1))


@dataclass(frozen=True)
class LedRoom:
    """The room for LEDs on a stage."""

    inner: float  # least distance from the axis, mm
    outer: float  # radius about the origin within which an LED and its pillar stay, mm
    lowest: float  # least height z, mm
    apart: float  # least distance of two pillars' axes, mm
    pillar: float  # radius of a pillar, mm

    def places(self) -> Floats:
        """Places that are tried: one of each pair, mm, (p, 3)."""
        azimuth = np.pi * np.arange(AZIMUTHS) / AZIMUTHS
        ring = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.ones(AZIMUTHS)])
        highest = np.sqrt(self.outer**2 - (self.inner + self.pillar) ** 2)
        rows = []
        for z in np.linspace(self.lowest, highest, HEIGHTS):
            farthest = np.sqrt(self.outer**2 - z**2) - self.pillar
            for radius in np.unique(np.linspace(self.inner, max(farthest, self.inner), RINGS)):
                rows.append(ring * [radius, radius, z])
        return np.round(np.concatenate(rows), DIGITS) + 0.0

    def fits(self, places: Floats, chosen: list[int], new: int) -> bool:
        """Whether a pair's pillars are clear of each other and of the chosen ones."""
        here, opposite = places[new] * np.stack([np.ones(3), HALF_TURN])
        others = np.concatenate([opposite[None], with_partners(places[chosen])])
        return bool(norm((others - here)[:, :2]).min() >= self.apart)


def with_partners(places: Floats) -> Floats:
    """Places and, after all of them, those half a turn apart, (2 p, 3)."""
    return np.concatenate([places, places * HALF_TURN])


def best_layout(
    room: LedRoom,
    places: Floats,
    number: int,
    cost: Callable[[list[int]], float],
    progress: Progress = lambda _: None,
) -> list[int]:
    """Numbers of so many LEDs among `with_partners(places)` that cost least."""
    p = len(places)

    def of_pairs(pairs: list[int]) -> float:
        return cost([*pairs, *(one + p for one in pairs)])

    def best(others: list[int]) -> int:
        fitting = [one for one in range(p) if room.fits(places, others, one)]
        return min(fitting, key=lambda one: of_pairs([*others, one]))

    pairs: list[int] = []
    for _ in range(number // 2):
        pairs.append(best(pairs))
        progress(f"{2 * len(pairs)} LEDs placed")
    for _ in range(MAX_ROUNDS):
        before = list(pairs)
        for k in range(len(pairs)):
            pairs[k] = best(pairs[:k] + pairs[k + 1 :])
        if pairs == before:
            break
    return [*pairs, *(one + p for one in pairs)]


@dataclass(frozen=True)
class Layout:
    """Places of LEDs."""

    name: str  # "design" or "best"
    leds: Floats  # mm, (l, 3)


def layouts(export: ExportedDesign, progress: Progress) -> list[Layout]:
    """The design's places of LEDs, and the best of each number."""
    room = led_room(export)
    places = room.places()
    information = shell_information(export, with_partners(places))
    layouts = [Layout("design", read_leds(export.folder))]
    for number in NUMBERS:
        chosen = best_layout(
            room, places, number, lambda leds: layout_cost(information, leds), progress
        )
        layouts.append(Layout("best", with_partners(places)[chosen]))
    return layouts


def led_room(export: ExportedDesign) -> LedRoom:
    """Where LEDs may be on the stage of a build."""
    stage = export.spec.prototype.stage
    part = load_parts()[stage.led]
    pillar = pillar_radius(stage, part)
    return LedRoom(
        inner=pillar + max(stage.disc_mm, stage.object_diameter_mm) / 2 + POCKET_PLAY_MM,
        outer=export.capture_mm / 2,
        lowest=float(read_leds(export.folder)[:, 2].min()),
        apart=2 * pillar,
        pillar=pillar,
    )


def shell_information(export: ExportedDesign, leds: Floats) -> SphereInformation:
    """What LEDs tell of each mirror of camera a, by one photograph."""
    prior = only_spheres(designed_shell(export.reflectors[0], leds))
    virtual = export.reflectors[0].u * mirror_distance(export)
    hidden = hidden_by_object(export.spec.prototype.stage, leds, virtual, export.capture_mm / 2)
    values, sphere = np.zeros(len(prior.free)), np.arange(len(virtual))
    frame = 0 * sphere

    def own(slopes: csr_array) -> Floats:
        """Of each sphere by itself: a row has entries of no other."""
        return slopes.sorted_indices().data.reshape(len(sphere), -1, 4)

    slopes = [
        own(highlights_with_slopes(prior, values, frame, sphere, frame + led)[1])
        for led in range(len(leds))
    ]
    by_led = np.stack([one.swapaxes(1, 2) @ one for one in slopes])
    rays, _ = ray_slopes(prior, values, frame, sphere)
    return SphereInformation(by_led * ~hidden.T[:, :, None, None], own(rays))


def only_spheres(machine: Machine) -> Prior:
    """A prior of deviations of 1 mm of centres and radii, all else known."""
    still = np.zeros(1, dtype=np.int64)
    return prior_of(machine, still, {Block.CENTRES: 1.0, Block.RADII: 1.0})


def layout_cost(information: SphereInformation, leds: list[int]) -> float:
    """Mean square error of rays within the capture sphere, mm^2."""
    mm, mrad = ray_errors(information, leds, USUAL_PX, (PRIOR_MM, PRIOR_MM))
    return float((mm**2 + (SPHERE_MM * mrad / 1000) ** 2).mean())


def mirror_distance(export: ExportedDesign) -> float:
    """Of the virtual cameras from the object's centre, mm: the ellipsoid's major axis."""
    apex = export.reflectors[0].mirrors.apex[0]
    return float(norm(apex) + norm(apex - export.reflectors[0].camera.pinhole))
