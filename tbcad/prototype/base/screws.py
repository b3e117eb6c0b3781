"""Which dowels and screws join the pieces of the base, and what their holes need."""

from dataclasses import dataclass

from tbcad.prototype.purchased.parts import PurchasedPart, load_parts
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import BaseSpec

FLOOR_MM = 1.0  # below holes
BITE_MM = 4.0  # of a screw in its insert: 1.3 diameters
BEYOND_MM = 0.5  # of a hole beyond its dowel
KEY_MM = 0.55  # round a screw's head


@dataclass(frozen=True)
class JointHardware:
    """Purchased parts of joints: names, and what their holes need, mm."""

    dowel: str
    dowel_depth: float
    screw: str
    head: float


def joint_hardware(keys: BaseSpec) -> JointHardware:
    """The longest dowel and the shortest M3 screw for the flanges' thickness.

    Raises:
        SpecError: when none is in the lists.
    """
    parts = load_parts().values()
    _check_insert(keys)
    most = 2 * (keys.joint_mm - FLOOR_MM - BEYOND_MM)
    pins = [p for p in parts if p.kind == "dowels" and _is(p, keys.dowel_mm) and p.sizes[1] <= most]
    if not pins:
        raise SpecError(
            f"no dowel of {keys.dowel_mm:g} mm is at most {most:g} mm long: make "
            "prototype.base.joint_mm larger or prototype.base.dowel_mm smaller"
        )
    least, longest = keys.joint_mm + BITE_MM, keys.joint_mm + keys.insert_depth_mm
    screws = [
        p for p in parts if p.kind == "screws" and _is(p, 3) and least <= p.sizes[1] <= longest
    ]
    if not screws:
        raise SpecError(
            f"no M3 screw is {least:g} to {longest:g} mm long: make prototype.base.joint_mm one "
            "of the lengths on sale less 4"
        )
    pin, screw = max(pins, key=lambda p: p.sizes[1]), min(screws, key=lambda p: p.sizes[1])
    return JointHardware(pin.name, pin.sizes[1] / 2 + BEYOND_MM, screw.name, screw.sizes[2])


def _is(part: PurchasedPart, size: float) -> bool:
    return abs(part.sizes[0] - size) < 1e-9


def _check_insert(keys: BaseSpec) -> None:
    if keys.joint_mm < keys.insert_depth_mm + FLOOR_MM:
        raise SpecError(
            f"flanges of {keys.joint_mm:g} mm are too thin for inserts: make "
            f"prototype.base.joint_mm at least {keys.insert_depth_mm + FLOOR_MM:g}"
        )


def access_radius(size: JointHardware) -> float:
    """Radius of what is kept clear over a screw's head, mm."""
    return size.head / 2 + KEY_MM
