"""What is bought for the base: magnets, what the hub and the joints need, by names of the lists."""

from collections import Counter

from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.screws import joint_hardware
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.purchased.parts import PurchasedPart, load_parts
from tbcad.spec.errors import SpecError

# In the hub: set screws, or the one screw of the clamp.
LOCKS = {"set-screws": 2, "clamp": 1}
PLAY_MM = 1e-6


def base_purchased_parts(base: BaseLayout, plan: BaseSplit) -> dict[str, int]:
    """Purchased parts of the base, without balls and without what bolts the drive to it.

    Args:
        base: in numbers.
        plan: its pieces and joints.

    Returns:
        Names as in the parts lists, and how many of each.

    Raises:
        SpecError: when a part is in no list.
    """
    found = Counter(magnets(base)) + Counter(fasteners(base, plan))
    return dict(sorted(found.items()))


def magnets(base: BaseLayout) -> dict[str, int]:
    """Magnets behind the balls, by name; those in caps are not among them.

    Raises:
        SpecError: when one is in no list.
    """
    parts, sizes_mm = load_parts(), base.seats.magnet.tolist()
    return dict(Counter(magnet_name(base, size, parts) for size in sizes_mm if size > 0))


def fasteners(base: BaseLayout, plan: BaseSplit) -> dict[str, int]:
    """Screws, inserts and dowels of hub and joints, by name.

    Raises:
        SpecError: when one is in no list.
    """
    parts = load_parts()
    found, insert = Counter(_hub(base, parts)), _insert(base, parts)
    for joint in plan.joints:
        size = joint_hardware(base.keys)
        found.update({size.dowel: len(joint.dowels), size.screw: len(joint.screws)})
        found[insert] += len(joint.screws)
    return {name: count for name, count in found.items() if count}


def magnet_name(base: BaseLayout, size: float, parts: dict[str, PurchasedPart]) -> str:
    """Name of the disc magnet of a diameter (mm) and of the spec's height.

    Raises:
        SpecError: when it is in no list.
    """
    wanted = (size, base.keys.magnet_height_mm)
    for part in parts.values():
        if part.kind == "magnets" and _same(part.sizes, wanted):
            return part.name
    raise SpecError(
        f"no magnet of {wanted[0]:g} x {wanted[1]:g} mm is in magnets.csv: change "
        "prototype.base.magnets_mm or prototype.base.magnet_height_mm"
    )


def _same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(abs(a - b) < PLAY_MM for a, b in zip(one, other, strict=True))


def _hub(base: BaseLayout, parts: dict[str, PurchasedPart]) -> dict[str, int]:
    """Inserts of the drive's holes and of the lock, and the lock's screws."""
    held, keys = base.hub, base.keys
    found: Counter[str] = Counter()
    if abs(held.hole - keys.insert_hole_mm) < PLAY_MM:
        found[_insert(base, parts)] += len(held.holes)
    if held.lock:
        count = LOCKS[held.lock]
        found[_insert(base, parts)] += count
        # A set screw reaches from the shaft to the boss's face at most; the clamp's screw from
        # face to face.
        room = held.boss - held.bore if held.lock == "set-screws" else _across(base)
        kind = "setscrews" if held.lock == "set-screws" else "screws"
        found[_screw(kind, room, parts)] += count
    return dict(found)


def _across(base: BaseLayout) -> float:
    """Length of the clamp's screw hole, mm."""
    held = base.hub
    return float(2 * (held.boss**2 - ((held.bore + held.boss) / 2) ** 2) ** 0.5)


def _screw(kind: str, room: float, parts: dict[str, PurchasedPart]) -> str:
    """The longest M3 screw no longer than a length (mm)."""
    fit = [
        part
        for part in parts.values()
        if part.kind == kind and abs(part.sizes[0] - 3) < PLAY_MM and part.sizes[1] <= room
    ]
    if not fit:
        raise SpecError(f"no M3 screw of at most {room:.1f} mm is in {kind}.csv: add one")
    return max(fit, key=lambda part: part.sizes[1]).name


def _insert(base: BaseLayout, parts: dict[str, PurchasedPart]) -> str:
    """The longest M3 insert that the holes of the spec take."""
    keys = base.keys
    fit = [
        part
        for part in parts.values()
        if part.kind == "inserts"
        and abs(part.sizes[0] - 3) < PLAY_MM
        and part.sizes[1] <= keys.insert_depth_mm
        and abs(part.sizes[3] - keys.insert_hole_mm) < PLAY_MM
    ]
    if not fit:
        raise SpecError(
            f"no M3 insert for holes of {keys.insert_hole_mm:g} mm, {keys.insert_depth_mm:g} mm "
            "deep, is in inserts.csv: change prototype.base.insert_hole_mm or insert_depth_mm"
        )
    return max(fit, key=lambda part: part.sizes[1]).name
