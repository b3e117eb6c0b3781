"""How well the LEDs' reflections fix the balls: the covariance to expect of each centre."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.spec.prototype import StageSpec
from tbcad.prototype.stage.leds import MIN_SEEN, hidden_by_object
from tbcad.records.prototype import CentreEstimate
from tbcad.types import Floats, Ints

NOISE_PX = 0.05  # standard deviation of a highlight's place in a photograph, each way
STEP_MM = 1e-3  # of the centres, for derivatives


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

    Args:
        stage: section of the stage.
        array: mirrors of the design, in place of the balls that show them.
        leds: centres of the domes, mm, (l, 3).
        capture: radius of the capture sphere, mm.
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
