"""What a cap must keep: limits of its mirror, from the coverage that the design sets aside.

At the rim of the part in use, e from the apex, a ray is reflected past the capture sphere's edge.
A change of the normal there by a small angle a moves it at the object, at a distance L, by 2 L a,
and coverage, which is twice its distance from the origin, by 4 L a. The margin of the mirrors is
shared equally (root sum of squares) by radius, figure, tilt and seat.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.cap_solids import cap_spigot, cap_tilt
from tbcad.prototype.base.layout import BaseLayout
from tbcad.spec.design import Spec

SHARES = 4  # of the margin: radius, figure, tilt, seat
MIN_MARGIN_MM = 0.3
FRINGE_MM = 546.07e-6 / 2  # ISO 10110-5: half a wavelength of the green mercury line
MIN_REFLECTANCE = 0.55  # of polished steel, as the balls
MATERIAL = "resin"
FINISH = "polished and coated with aluminium as its drawing asks"
POLARITY = "north pole toward the object, as all magnets of the seats"


@dataclass(frozen=True)
class CapLimits:
    """Sizes and limits of one cap, mm unless named.

    Attributes:
        ball: its number, from 0.
        radius: of the front.
        body: diameter of the body.
        aperture: diameter of the part in use.
        edge: diameter where front and body meet.
        thickness: from the apex to the end of the spigot.
        radius_tolerance: to either side.
        body_tolerance: of the body's radius to either side.
        irregularity: of the front over the aperture, fringes of 546 nm.
        roughness_um: arithmetic mean.
        spigot: diameter.
        socket: diameter of its pocket.
        end: of the spigot behind the body's centre.
        tilt_deg: that the spigot's play allows.
        centre_shift: of the front's centre by that tilt.
        incidence_deg: angle of incidence at the apex.
    """

    ball: int
    radius: float
    body: float
    aperture: float
    edge: float
    thickness: float
    radius_tolerance: float
    body_tolerance: float
    irregularity: float
    roughness_um: float
    spigot: float
    socket: float
    end: float
    tilt_deg: float
    centre_shift: float
    incidence_deg: float

    @property
    def drawing(self) -> str:
        """Name of the drawing's files."""
        return f"drawing_cap_{self.ball + 1}"


def cap_limits(spec: Spec, base: BaseLayout, prototype: PrototypeLayout) -> list[CapLimits]:
    """Limits of all caps by the number of their ball."""
    caps = np.flatnonzero(prototype.balls.cap).tolist()
    return [_limits(spec, base, prototype, k) for k in caps]


def _limits(spec: Spec, base: BaseLayout, prototype: PrototypeLayout, k: int) -> CapLimits:
    balls, apex = prototype.balls, prototype.apices()[k]
    radius, body = float(balls.radius[k]), float(balls.body_radius[k])
    edge = min(body / np.sqrt(2), radius)
    used = edge - spec.prototype.cap_rim_mm
    distance = float(norm(apex))
    share = max(spec.mirrors.margin_mm, MIN_MARGIN_MM) / np.sqrt(SHARES)
    slope = share / (4 * distance)
    (spigot, end), tilt = cap_spigot(base, k), cap_tilt(base, k)
    depth = float(balls.body_depth[k])
    to_camera = prototype.array.camera.pinhole - apex
    # Object and pinhole are seen from an apex at the same angle from its normal.
    between = float(-apex @ to_camera / distance / norm(to_camera))
    return CapLimits(
        ball=k,
        radius=radius,
        body=2 * body,
        aperture=2 * used,
        edge=2 * edge,
        thickness=depth + end,
        radius_tolerance=slope * radius**2 / used,
        body_tolerance=slope * radius * float(np.cos(base.seats.tilt)),
        irregularity=slope * used / 2 / FRINGE_MM,
        roughness_um=prototype.grade.roughness_ra_um,
        spigot=2 * spigot,
        socket=2 * float(base.seats.pocket[k]),
        end=end,
        tilt_deg=float(np.degrees(tilt)),
        centre_shift=abs(radius - depth) * float(np.sin(tilt)),
        incidence_deg=float(np.degrees(np.arccos(between))) / 2,
    )
