"""Caps by their STEP files: the spigot that takes up their tilt, and limits of their drawings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.purchases import Solids
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_sections import CapRecord
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, each_at_most, short_list
from tbcad_verify.step.solids_text import TextSolid, distance_to_line

# Once the LEDs have shown it, a degree takes 0.06 mm of the 60: so much tilt takes what a design's
# balls have to spare (0.04 mm at n = 18), a tenth of its share of the margin (docs/prototype.md).
TILT_DEG = 0.5
ON_AXIS_MM, PARALLEL = 1e-5, 1e-6
SHARE = 1e-6
SHARES = 4  # of the margin: radius, figure, tilt, seat
MIN_MARGIN_MM = 0.3
FRINGE_MM = 546.07e-6 / 2  # ISO 10110-5
ROUGHNESS_UM = {  # ISO 3290-1
    **{"G3": 0.010, "G5": 0.014, "G10": 0.020, "G16": 0.025, "G20": 0.032, "G24": 0.040},
    **{"G28": 0.050, "G40": 0.060, "G60": 0.080, "G100": 0.100, "G200": 0.150},
}
REFLECTANCE = 0.55  # of polished steel, as the balls
CHECKS = {"cap tilt": "deg", "cap drawings": "faults"}


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


def checks(names: list[CheckName], context: PrototypeContext, solids: Solids) -> list[Check]:
    """Tilt from the solids; the record against it, and limits against the design."""
    balls = context.prototype.balls
    caps = np.flatnonzero(balls.cap).tolist()
    keys = {k: _key(context, solids, k, i) for i, k in enumerate(caps)}
    tilt = np.array([key.tilt_deg for key in keys.values()])
    faults = [*_record_faults(context, keys)]
    return [
        each_at_most(
            names[0], balls.names(np.array(caps, dtype=np.int64)), tilt, TILT_DEG, "deg", "tilts: "
        ),
        at_most(names[1], len(faults), 0, short_list(faults)),
    ]


def _key(context: PrototypeContext, solids: Solids, k: int, cap: int) -> Key:
    """The cap's outer cylinder on its axis, and the carrier's hollow one round it."""
    spigots = [face for face in _on_axis(context, solids.caps[cap], k) if not face[2]]
    if len({round(radius, 6) for radius, _, _ in spigots}) != 1:
        raise Unknown(f"the cap of ball {k + 1} has no spigot")
    radius = spigots[0][0]
    end = max(end for _, end, _ in spigots)
    sockets = [face[0] for base in solids.base for face in _on_axis(context, base, k) if face[2]]
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


def _record_faults(context: PrototypeContext, keys: Mapping[int, Key]) -> Iterator[str]:
    records = {one.ball - 1: one for one in context.prototype.caps}
    if list(records) != list(keys) or len(records) != len(context.prototype.caps):
        yield "caps are not those of the balls"
        return
    for k, key in keys.items():
        record = records[k]
        for name, value in _figures(context, k, key).items():
            if not abs(getattr(record, name) - value) <= SHARE * abs(value):
                yield f"cap {k + 1}: {name} is {getattr(record, name):.4g}, not {value:.4g}"
        yield from _word_faults(context, k, record)


def _figures(context: PrototypeContext, k: int, key: Key) -> dict[str, float]:
    """Sizes and limits of a cap, from the solids and the balls' list."""
    balls, spec, seat = context.prototype.balls, context.export.spec, context.prototype.seats[k]
    radius, body = float(balls.radius_mm[k]), float(balls.body_radius_mm[k])
    apex, normal, centre, front = (balls.columns(key, 3)[:, k] for key in ("px", "nx", "bx", "cx"))
    used = min(body / math.sqrt(2), radius) - spec.prototype.cap_rim_mm
    distance = float(np.linalg.norm(apex))
    share = max(spec.mirrors.margin_mm, MIN_MARGIN_MM) / math.sqrt(SHARES)
    slope = share / (4 * distance)
    steep = float(np.mean(seat.normals @ normal))
    tilt = math.radians(key.tilt_deg)
    toward = context.pinhole - apex
    return {
        "spigot_mm": 2 * key.spigot,
        "socket_mm": 2 * key.socket,
        "spigot_end_mm": key.end,
        "tilt_deg": key.tilt_deg,
        "centre_shift_mm": float(np.linalg.norm(front - centre)) * math.sin(tilt),
        "aperture_mm": 2 * used,
        "radius_tolerance_mm": slope * radius**2 / used,
        "body_tolerance_mm": 2 * slope * radius * abs(steep),
        "irregularity_fringes": slope * used / 2 / FRINGE_MM,
        "roughness_ra_um": ROUGHNESS_UM[spec.prototype.grade],
        "reflectance_min": REFLECTANCE,
        "incidence_deg": math.degrees(math.acos(normal @ toward / float(np.linalg.norm(toward)))),
    }


def _word_faults(context: PrototypeContext, k: int, record: CapRecord) -> Iterator[str]:
    """Material, finish and polarity are said; the drawing has the cap's figures."""
    for name in ("material", "finish", "polarity"):
        if not getattr(record, name).strip():
            yield f"cap {k + 1} has no {name}"
    if "north" not in record.polarity:
        yield f"cap {k + 1}: its polarity does not say where north is"
    radius = float(context.prototype.balls.radius_mm[k])
    words = (
        f"R {radius:.1f} +-{record.radius_tolerance_mm:.2f} CX",
        f"3/ -({record.irregularity_fringes:.1f})",
        f"Ra {record.roughness_ra_um:g} um",
        f"spigot {record.spigot_mm:.2f}",
    )
    for file in (record.pdf, record.dxf):
        try:
            text = read(context.export.folder, file, MAX_TEXT_BYTES).data.tobytes()
        except BadExport:
            yield f"there is no {file}"
            continue
        # A PDF has a backslash before each bracket in its texts.
        plain = text.replace(b"\\", b"")
        yield from (f"{file} lacks {word}" for word in words if word.encode() not in plain)
