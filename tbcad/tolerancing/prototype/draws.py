"""Random errors of simulated prototypes: how far base, balls and camera of each are off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.tables import StopRow
from tbcad.tolerancing.montecarlo.draws import Shape, draw_kinds
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.types import Bools, Floats

FIRST_STREAM = 1000  # random streams of a build begin here, beyond those of its shells


@dataclass(frozen=True)
class PrototypeDraws:
    """Errors of s prototypes of k balls and t stops, in the order of the builds.

    The base goes through its stops twice, for camera a's mirrors and for camera b's. A point x of
    the designed base is moved to R(tilt) R(axis, stop's angle + angle) x + runout.
    """

    radius: Floats  # by which balls are too large, mm, (s, k)
    seat: Floats  # of the balls' centres on the base, mm, (s, k, 3)
    cap_tilt: Floats  # of caps about two axes across their own, radians, (s, k, 2)
    angle: Floats  # of the base at stops of both runs, with gravity, radians, (s, 2, t)
    runout: Floats  # of the axis there, along azimuth zero and across it, mm, (s, 2, t, 2)
    tilt: Floats  # of the axis about azimuth zero and across, at the object, radians, (s, 2)
    camera_shift: Floats  # of the pinhole, mm, (s, 3)
    camera_tilt: Floats  # rotation vectors about the pinhole, radians, (s, 3)
    focal: Floats  # focal length over the designed one, (s,)

    def __len__(self) -> int:
        return len(self.focal)


def draw_prototypes(
    errors: Errors, seed: int, builds: Sequence[int], is_cap: Bools, wind_up: Floats
) -> PrototypeDraws:
    """Errors of some prototypes; see tbcad.tolerancing.montecarlo.draws.draw_kinds.

    Purchased balls have the errors of their grade, caps (k,) those of a mirror that is a part of
    its own (`Errors.whole_radius`), each with its centre unchanged. Gravity turns the base at the
    t stops of one run by the wind-up, radians, (t,).
    """
    shapes = _shapes(len(is_cap), len(wind_up))
    errors = replace(errors, sphere_radius=errors.whole_radius)
    drawn = draw_kinds(errors, seed, builds, shapes, FIRST_STREAM)
    return PrototypeDraws(
        radius=np.where(is_cap, drawn["sphere_radius"], drawn["ball_radius"]),
        seat=drawn["seat"],
        cap_tilt=np.where(is_cap[:, None], drawn["cap_tilt"], 0.0),
        angle=drawn["rotation_angle"] + drawn["wind_up"][:, None, None] * wind_up,
        runout=drawn["axis_runout"],
        tilt=drawn["axis_tilt"],
        camera_shift=drawn["camera_shift"],
        camera_tilt=drawn["camera_tilt"],
        focal=1 + drawn["camera_focal"],
    )


def _shapes(k: int, t: int) -> dict[str, Shape]:
    """Shape of each kind's errors, in the order of their random streams; only append to it."""
    return {
        "ball_radius": (k,),
        "sphere_radius": (k,),
        "seat": (k, 3),
        "rotation_angle": (2, t),
        "axis_runout": (2, t, 2),
        "axis_tilt": (2,),
        "camera_shift": (3,),
        "camera_tilt": (3,),
        "camera_focal": (),
        "cap_tilt": (k, 2),
        "wind_up": (),
    }


def read_wind_up(export: ExportedDesign, plan: Plan) -> Floats:
    """Angles (t,) by which the base is beyond those of the plan at its t stops, radians.

    Motor and belt yield to the base's weight: see tbcad.prototype.drive.loads. InputError if the
    file is missing, malformed, or of another plan.
    """
    path = export.folder / StopRow.FILE
    rows = StopRow.read(export.folder)
    if [row.stop for row in rows] != list(range(1, len(plan.angle) + 1)):
        raise InputError(
            f"{path}: stops are not those of the plan, 1 to {len(plan.angle)}: {REBUILD}"
        )
    return np.radians([row.wind_up_deg for row in rows])
