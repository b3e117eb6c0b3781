"""LEDs on the stage: whether they can be used, and how well their reflections fix the balls."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import StageSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.records.prototype import CentreEstimate
from tbcad.types import Floats, Ints

POCKET_PLAY_MM = 0.1  # to either side
MIN_FLATNESS_MM = 1.0  # of the LEDs about the nearest plane, square root of the sum of squares
MIN_SEEN = 2  # LEDs that fix a sphere's centre, two figures each, where its radius is known
TINY = 1e-12  # keeps a division by zero away
NOISE_PX = 0.05  # standard deviation of a highlight's place in a photograph, each way
STEP_MM = 1e-3  # of the centres, for derivatives


def check_leds(
    stage: StageSpec,
    prototype: PrototypeLayout,
    capture: float,
    led: PurchasedPart,
    pockets: Floats,
    plate: float,
) -> None:
    """Refuse LEDs that are outside the sphere, collide, are in one plane or seen too little.

    capture is the sphere's radius, pockets (l,) the floors of the pockets and plate the crown's
    upper face (z), mm.
    """
    domes, pillar = np.array(stage.leds_mm).reshape(-1, 3), pillar_radius(stage, led)
    from_axis, tip = norm(domes[:, :2]), led["diameter_mm"] / 2
    reach = np.hypot(from_axis + pillar, pockets).clip(norm(domes) + tip)
    min_from_axis = pillar + max(stage.disc_mm, stage.object_diameter_mm) / 2 + POCKET_PLAY_MM
    for i, dome in enumerate(domes):
        name = f"prototype.stage.leds_mm: LED {i + 1}"
        if pockets[i] < plate:
            raise SpecError(
                f"{name} is too low for its pocket: make its z at least "
                f"{dome[2] + plate - pockets[i]:.1f}, or prototype.stage.top_mm smaller"
            )
        if reach[i] > capture:
            raise SpecError(
                f"{name} with its pillar reaches {reach[i]:.1f} mm from the origin, beyond the "
                f"capture sphere of {capture:g} mm: move it inward, or set leds_mm to []"
            )
        if from_axis[i] < min_from_axis:
            raise SpecError(
                f"{name} is in the object's room: move it outward to {min_from_axis:.1f} mm from "
                "the axis, or make prototype.stage.object_diameter_mm or disc_mm smaller"
            )
        for j in range(i):
            if norm(dome[:2] - domes[j, :2]) < 2 * pillar:
                raise SpecError(f"{name} collides with LED {j + 1}: move one of them")
    if len(domes):
        if float(np.linalg.svd(domes - domes.mean(axis=0))[1][-1]) < MIN_FLATNESS_MM:
            raise SpecError(
                "prototype.stage.leds_mm: the LEDs lie nearly in one plane, which does not "
                "calibrate: move one of them up or down"
            )
        _check_seen(stage, domes, prototype, led, capture)


def _check_seen(
    stage: StageSpec, domes: Floats, prototype: PrototypeLayout, led: PurchasedPart, capture: float
) -> None:
    """Refuse LEDs of which some mirror sees too few to find its centre."""
    seen = visible(stage, domes, virtual_cameras(prototype), led, capture).sum(axis=1)
    if seen.min() < MIN_SEEN:
        mirror = int(seen.argmin())
        raise SpecError(
            f"prototype.stage.leds_mm: mirror {prototype.array.ids[mirror]} sees {seen[mirror]} of "
            f"{len(domes)} LEDs past an object in its room and other LEDs, but needs {MIN_SEEN}: "
            "put LEDs on all sides of the object, or make prototype.stage.object_diameter_mm "
            "smaller"
        )


def visible(
    stage: StageSpec, domes: Floats, cameras: Floats, led: PurchasedPart, capture: float
) -> NDArray[np.bool_]:
    """Which of l LEDs (l, 3) are seen from which of m points (m, 3), (m, l).

    Past an object that fills its room, and past the pillars of the other LEDs.
    """
    tip = led["diameter_mm"] / 2
    hidden = hidden_by_object(stage, domes, cameras, capture)
    return ~(hidden | _hidden_by_pillars(domes, cameras, pillar_radius(stage, led), tip))


def _hidden_by_pillars(
    domes: Floats, cameras: Floats, pillar: float, tip: float
) -> NDArray[np.bool_]:
    """A pillar is taken to reach as high as its LED, (m, l)."""
    sight = cameras[:, None] - domes
    level = np.maximum(norm(sight[..., :2]), TINY)[..., None]
    direction = sight[..., :2] / level
    between = domes[None, :, :2] - domes[:, None, :2]
    along = np.einsum("mix,ijx->mij", direction, between)
    beside = (between**2).sum(axis=-1) - along**2
    enters = along - np.sqrt(np.maximum(pillar**2 - beside, 0))
    height = domes[:, 2, None] - tip + enters * (sight[..., 2, None] / level)
    hidden = (beside < pillar**2) & (along > 0) & (height < domes[:, 2] + tip)
    hidden[:, np.arange(len(domes)), np.arange(len(domes))] = False
    return np.asarray(hidden.any(axis=2))


def virtual_cameras(prototype: PrototypeLayout) -> Floats:
    """From where the m mirrors see the object, mm, (m, 3)."""
    return np.asarray(prototype.array.ellipsoid.camera_distance * prototype.array.u)


def hidden_by_object(
    stage: StageSpec, domes: Floats, cameras: Floats, capture: float
) -> NDArray[np.bool_]:
    """Which of l LEDs an object that fills its room hides from which of m points, (m, l).

    The room is an upright cylinder from the disc to the capture sphere's height at its radius.
    """
    radius = stage.object_diameter_mm / 2
    high = np.sqrt(max(capture**2 - radius**2, 0.0))
    sight = cameras[:, None] - domes
    a = (sight[..., :2] ** 2).sum(axis=-1)
    b = (sight[..., :2] * domes[:, :2]).sum(axis=-1)
    root = b**2 - a * ((domes[:, :2] ** 2).sum(axis=-1) - radius**2)
    reach = np.sqrt(np.maximum(root, 0)), np.maximum(a, TINY)
    ends = np.stack([(-b - reach[0]) / reach[1], (-b + reach[0]) / reach[1]])
    height = domes[:, 2] + np.clip(ends, 0, 1) * sight[..., 2]
    crosses = (root > 0) & (ends[1] > 0) & (ends[0] < 1)
    return np.asarray(crosses & (height.min(axis=0) < high) & (height.max(axis=0) > stage.top_mm))


def pillar_radius(stage: StageSpec, led: PurchasedPart) -> float:
    """Radius of the pillar round a pocket, mm."""
    return led["flange_mm"] / 2 + POCKET_PLAY_MM + stage.led_wall_mm


@dataclass(frozen=True)
class CalibrationEstimate:
    """Standard deviations of spheres' centres from one photograph of the LEDs, radii known."""

    seen: Ints  # LEDs that each mirror sees past an object in its room, (m,)
    worst: Floats  # of each centre in its least certain direction, mm, (m,)
    across: Floats  # in the directions across the line of sight, root mean square, mm, (m,)

    def record(self) -> CentreEstimate:
        """Figures for prototype.json."""
        return CentreEstimate(
            noise_px=NOISE_PX,
            leds_seen_min=int(self.seen.min()),
            centre_um_median=round(1000 * float(np.median(self.worst)), 3),
            centre_um_95=round(1000 * float(np.percentile(self.worst, 95)), 3),
            across_um_median=round(1000 * float(np.median(self.across)), 3),
        )


def calibration_estimate(
    stage: StageSpec, array: MirrorArray, leds: Floats, capture: float
) -> CalibrationEstimate:
    """Covariance (J^T J)^-1 sigma^2 of each sphere's centre, J the highlights' derivatives.

    The array's mirrors stand for the balls that show them; leds (l, 3) are the centres of the domes
    and capture the radius of the capture sphere, mm.
    """
    cameras = array.ellipsoid.camera_distance * array.u
    seen = ~hidden_by_object(stage, leds, cameras, capture)
    curved = array.mirrors.curvature > 0
    moved = np.stack([_derivatives(array, place) for place in leds])
    weight = np.where(seen.T & curved, 1.0, 0.0)
    information = np.einsum("lm,lmij,lmik->mjk", weight, moved, moved)
    enough = curved & (seen.sum(axis=1) >= MIN_SEEN)
    covariance = NOISE_PX**2 * np.linalg.inv(information[enough])
    sight = unit(array.mirrors.centre[enough] - array.camera.pinhole)
    along = np.einsum("mi,mij,mj->m", sight, covariance, sight)
    total = np.trace(covariance, axis1=1, axis2=2)
    return CalibrationEstimate(
        seen=seen.sum(axis=1),
        worst=np.sqrt(np.linalg.eigvalsh(covariance)[:, -1]),
        across=np.sqrt(np.maximum(total - along, 0) / 2),
    )


def _derivatives(array: MirrorArray, place: Floats) -> Floats:
    """Of a highlight's column and row by the centre's coordinates, px/mm, (m, 2, 3)."""
    view, centre = array.camera, array.mirrors.centre
    columns = []
    for axis in np.eye(3):
        ends = [
            view.project(
                reflection_points(centre + step * axis, array.mirrors.radius, place, view.pinhole)
            )
            for step in (-STEP_MM, STEP_MM)
        ]
        columns.append((ends[1] - ends[0]) / (2 * STEP_MM))
    return np.stack(columns, axis=2)
