"""Which dowels and screws join the pieces of the base, and what their holes need."""

from dataclasses import dataclass

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.purchased.parts import load_parts, of_kind

M3_MM = 3.0
FLOOR_MM = 1.0  # below holes
MIN_ENGAGEMENT_MM = 4.0  # of a screw in its insert: 1.3 diameters
BEYOND_DOWEL_MM = 0.5  # depth of a hole beyond its dowel
KEY_PLAY_MM = 0.55  # round a screw's head


@dataclass(frozen=True)
class JointHardware:
    """Purchased parts of joints: names, and what their holes need, mm.

    The access radius is that of what is kept clear over a screw's head.
    """

    dowel: str
    dowel_depth: float
    screw: str
    access_radius: float


def joint_hardware(spec: BaseSpec) -> JointHardware:
    """The longest dowel and the shortest M3 screw for the flanges' thickness.

    Raises:
        SpecError: when none is in the lists.
    """
    parts = load_parts()
    _check_insert(spec)
    longest_dowel = 2 * (spec.joint_mm - FLOOR_MM - BEYOND_DOWEL_MM)
    dowels = of_kind(parts, "dowels", diameter_mm=spec.dowel_mm)
    dowels = [dowel for dowel in dowels if dowel["length_mm"] <= longest_dowel]
    if not dowels:
        raise SpecError(
            f"no dowel of {spec.dowel_mm:g} mm is at most {longest_dowel:g} mm long: make "
            "prototype.base.joint_mm larger or prototype.base.dowel_mm smaller"
        )
    shortest, longest = spec.joint_mm + MIN_ENGAGEMENT_MM, spec.joint_mm + spec.insert_depth_mm
    screws = of_kind(parts, "screws", thread_mm=M3_MM)
    screws = [screw for screw in screws if shortest <= screw["length_mm"] <= longest]
    if not screws:
        raise SpecError(
            f"no M3 screw is {shortest:g} to {longest:g} mm long: make prototype.base.joint_mm one "
            "of the lengths on sale less 4"
        )
    dowel = max(dowels, key=lambda part: part["length_mm"])
    screw = min(screws, key=lambda part: part["length_mm"])
    depth = dowel["length_mm"] / 2 + BEYOND_DOWEL_MM
    return JointHardware(dowel.name, depth, screw.name, screw["head_mm"] / 2 + KEY_PLAY_MM)


def _check_insert(spec: BaseSpec) -> None:
    minimum = spec.insert_depth_mm + FLOOR_MM
    if spec.joint_mm < minimum:
        raise SpecError(
            f"flanges of {spec.joint_mm:g} mm are too thin for inserts: make "
            f"prototype.base.joint_mm at least {minimum:g}"
        )
