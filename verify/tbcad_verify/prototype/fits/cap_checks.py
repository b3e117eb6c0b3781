"""Caps by their STEP files: the spigot that takes up their tilt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.report.checks import Check, CheckName, Unknown, each_at_most
from tbcad_verify.step.solids_text import TextSolid, distance_to_line

# Once the LEDs have shown it, a degree takes 0.06 mm of the 60: so much tilt takes what a design's
# balls have to spare (0.04 mm at n = 18), a tenth of its share of the margin (docs/prototype.md).
TILT_DEG = 0.5
ON_AXIS_MM, PARALLEL = 1e-5, 1e-6
CHECKS = {"cap tilt": "deg"}


@dataclass(frozen=True)
class Key:
    """Spigot and its pocket, mm: radii, and the spigot's end behind the body's centre."""

    spigot: float
    socket: float
    end: float

    @property
    def tilt_deg(self) -> float:
        """Largest tilt about the body's centre."""
        return math.degrees(math.asin((self.socket - self.spigot) / self.end))


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    carriers: list[TextSolid],
    caps: list[TextSolid],
) -> list[Check]:
    """Tilt of each cap, from its solid and its seat's."""
    balls = context.prototype.balls
    which = np.flatnonzero(balls.cap)
    pairs = zip(which.tolist(), caps, strict=True)
    tilt = np.array([_key(context, cap, carriers, k).tilt_deg for k, cap in pairs])
    return [each_at_most(names[0], balls.names(which), tilt, TILT_DEG, "deg", "tilts: ")]


def _key(context: PrototypeContext, cap: TextSolid, carriers: list[TextSolid], k: int) -> Key:
    """The cap's outer cylinder on its axis, and the carrier's hollow one round it."""
    spigots = [face for face in _on_axis(context, cap, k) if not face[2]]
    if len({round(radius, 6) for radius, _, _ in spigots}) != 1:
        raise Unknown(f"the cap of ball {k + 1} has no spigot")
    radius = spigots[0][0]
    end = max(end for _, end, _ in spigots)
    sockets = [face[0] for base in carriers for face in _on_axis(context, base, k) if face[2]]
    if not sockets:
        raise Unknown(f"there is no pocket behind ball {k + 1}")
    if min(sockets) <= radius:
        raise Unknown(f"the spigot of ball {k + 1} does not go into its pocket")
    return Key(radius, min(sockets), end)


def _on_axis(
    context: PrototypeContext, solid: TextSolid, k: int
) -> Iterator[tuple[float, float, bool]]:
    """Radius, end behind the body's centre and hollowness of cylinders on a seat's axis."""
    balls = context.prototype.balls
    centre, back = balls.columns("bx", 3)[:, k], -balls.columns("nx", 3)[:, k]
    for face in solid.faces:
        parallel = np.linalg.norm(np.cross(face.axis, back)) < PARALLEL
        if face.kind != "cylinder" or not parallel:
            continue
        if distance_to_line(centre, face.point, face.axis) < ON_AXIS_MM:
            end = max(float((face.point + one * face.axis - centre) @ back) for one in face.span)
            if end > 0:
                yield face.radius, end, face.hollow
