"""Purchased parts of the base: magnets, and what the hub and the joints need."""

from collections import Counter

from tbcad.prototype.base.hub import KEY_DEPTH_MM, KEY_MM, ZERO_DISC_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.screws import M3_MM, joint_hardware
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.purchased.parts import SAME_SIZE_MM, Parts, load_parts, of_kind
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import BaseSpec


def base_purchased_parts(base: BaseLayout, split: BaseSplit) -> dict[str, int]:
    """Purchased parts of the base, without balls and without what bolts the drive to it.

    Args:
        base: in numbers.
        split: its pieces and joints.

    Returns:
        Names as in the parts lists, and how many of each.

    Raises:
        SpecError: when a part is in no list.
    """
    return dict(Counter(magnets(base)) + Counter(fasteners(base, split)))


def magnets(base: BaseLayout) -> dict[str, int]:
    """Magnets behind the balls, by name; those in caps are not among them.

    Raises:
        SpecError: when one is in no list.
    """
    parts, diameters = load_parts(), base.seats.magnet.tolist()
    return dict(Counter(magnet_name(base, one, parts) for one in diameters if one > 0))


def fasteners(base: BaseLayout, split: BaseSplit) -> dict[str, int]:
    """Screws, inserts and dowels of hub and joints, by name.

    Raises:
        SpecError: when one is in no list.
    """
    parts = load_parts()
    counts, insert = _hub_fasteners(base, parts), _insert(base.spec, parts)
    counts[_key(parts)] += 1
    for joint in split.joints:
        hardware, screws = joint_hardware(base.spec), len(joint.screws)
        counts.update({hardware.dowel: len(joint.dowels), hardware.screw: screws, insert: screws})
    return dict(+counts)


def _key(parts: Parts) -> str:
    """The longest dowel through the zero disc into the hub's hole."""
    dowels = of_kind(parts, "dowels", diameter_mm=KEY_MM)
    room = ZERO_DISC_MM + KEY_DEPTH_MM
    dowels = [dowel for dowel in dowels if dowel["length_mm"] <= room]
    if not dowels:
        raise SpecError(f"no dowel of {KEY_MM:g} mm is at most {room:g} mm long: add one")
    return max(dowels, key=lambda part: part["length_mm"]).name


def magnet_name(base: BaseLayout, diameter: float, parts: Parts) -> str:
    """Name of the disc magnet of a diameter (mm) and of the spec's height.

    Raises:
        SpecError: when it is in no list.
    """
    height = base.spec.magnet_height_mm
    for part in of_kind(parts, "magnets", diameter_mm=diameter, height_mm=height):
        return part.name
    raise SpecError(
        f"no magnet of {diameter:g} x {height:g} mm is in magnets.csv: change "
        "prototype.base.magnets_mm or prototype.base.magnet_height_mm"
    )


def _hub_fasteners(base: BaseLayout, parts: Parts) -> Counter[str]:
    """Inserts of the drive's holes and of the lock, and the lock's screws."""
    hub, spec = base.hub, base.spec
    counts: Counter[str] = Counter()
    if abs(hub.hole - spec.insert_hole_mm) < SAME_SIZE_MM:
        counts[_insert(spec, parts)] += len(hub.holes)
    # A set screw reaches from the shaft to the boss's face at most; the clamp's screw from face to
    # face.
    across = 2 * (hub.boss**2 - ((hub.bore + hub.boss) / 2) ** 2) ** 0.5 if hub.boss else 0.0
    screws = {"set-screws": (2, "setscrews", hub.boss - hub.bore), "clamp": (1, "screws", across)}
    if hub.lock:
        count, kind, room = screws[hub.lock]
        counts[_insert(spec, parts)] += count
        counts[_longest_screw(kind, room, parts)] += count
    return counts


def _longest_screw(kind: str, room: float, parts: Parts) -> str:
    """The longest M3 screw no longer than a length (mm)."""
    screws = of_kind(parts, kind, thread_mm=M3_MM)
    screws = [screw for screw in screws if screw["length_mm"] <= room]
    if not screws:
        raise SpecError(f"no M3 screw of at most {room:.1f} mm is in {kind}.csv: add one")
    return max(screws, key=lambda part: part["length_mm"]).name


def _insert(spec: BaseSpec, parts: Parts) -> str:
    """The longest M3 insert that the holes of the spec take."""
    inserts = of_kind(parts, "inserts", thread_mm=M3_MM, hole_mm=spec.insert_hole_mm)
    inserts = [insert for insert in inserts if insert["length_mm"] <= spec.insert_depth_mm]
    if not inserts:
        raise SpecError(
            f"no M3 insert for holes of {spec.insert_hole_mm:g} mm, {spec.insert_depth_mm:g} mm "
            "deep, is in inserts.csv: change prototype.base.insert_hole_mm or insert_depth_mm"
        )
    return max(inserts, key=lambda part: part["length_mm"]).name
