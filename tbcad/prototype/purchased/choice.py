"""Choice of purchased parts by their sizes."""

from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind
from tbcad.spec.errors import SpecError


def choose_part(
    parts: Parts, kind: str, key: str, hint: str, order: str = "length_mm", **sizes: float
) -> PurchasedPart:
    """The smallest purchased part of a kind that has all sizes, and at least the size in order.

    Args:
        parts: lists of purchased parts.
        kind: a list.
        key: of the spec that asks for it.
        hint: what to change when there is none.
        order: size that must only be large enough; the smallest is taken.
        sizes: required.

    Raises:
        SpecError: when the list has none.
    """
    exact = {size: value for size, value in sizes.items() if size != order}
    candidates = [
        part for part in of_kind(parts, kind, **exact) if part[order] >= sizes.get(order, 0.0)
    ]
    if not candidates:
        required = ", ".join(f"{size} {value:.4g}" for size, value in sizes.items())
        raise SpecError(f"no part with {required} in {kind}.csv, which {key} needs: {hint}")
    return min(candidates, key=lambda part: part[order])


def choose_screw(parts: Parts, thread: float, length: float) -> PurchasedPart:
    """The shortest socket head screw of a thread that is at least so long, mm."""
    hint = "make prototype.frame.flange_mm smaller"
    key = "prototype.frame.flange_mm"
    return choose_part(parts, "screws", key, hint, thread_mm=thread, length_mm=length)
