"""Purchased parts: one CSV file for each kind in this folder."""

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError

COMMON_COLUMNS = ("part", "what", "material", "mass_g")
SIZES: dict[str, tuple[str, ...]] = {
    "motors": (
        *("frame_mm", "length_mm", "shaft_mm", "shaft_length_mm", "pilot_mm", "pilot_height_mm"),
        *("hole_square_mm", "thread_mm", "holding_nmm", "full_steps"),
        *("rated_a", "resistance_ohm", "radial_n"),
    ),
    "stages": ("top_mm", "hole_circle_mm", "hole_mm", "ratio", "holding_nmm", "full_steps"),
    "wheels": ("teeth", "pitch_mm", "width_mm", "bore_mm"),
    "belts": ("teeth", "pitch_mm", "width_mm", "rating_n", "stiffness_n"),
    "couplings": ("bore_mm", "flange_mm", "hole_circle_mm", "hole_mm"),
    "shafts": ("diameter_mm", "length_mm"),
    "bearings": ("bore_mm", "outer_mm", "width_mm", "load_n"),
    "screws": ("thread_mm", "length_mm", "head_mm", "head_height_mm"),
    "setscrews": ("thread_mm", "length_mm"),
    "inserts": ("thread_mm", "length_mm", "outer_mm", "hole_mm"),
    "dowels": ("diameter_mm", "length_mm"),
    "magnets": ("diameter_mm", "height_mm"),
    "leds": ("diameter_mm", "flange_mm", "height_mm", "forward_v", "max_ma"),
    "strips": ("width_mm", "thickness_mm", "cut_mm", "supply_v", "watt_m", "lumen_m"),
    "sheets": ("length_mm", "width_mm", "thickness_mm"),
    "resistors": ("power_w",),
    "wires": ("outer_mm", "max_ma"),
    "connectors": ("pins",),
    "electronics": (),
    "extrusions": ("side_mm", "slot_mm", "length_mm"),
    "tnuts": ("thread_mm", "slot_mm"),
    "nuts": ("thread_mm", "width_mm", "height_mm"),
    "washers": ("thread_mm", "outer_mm", "thickness_mm"),
    "collars": ("bore_mm", "outer_mm", "width_mm"),
    "plates": ("length_mm", "width_mm", "thickness_mm"),
}
"""Columns that describe each kind of part, all above zero.

shaft_length_mm is the length of a motor's shaft from the face that its screws pull on the plate.
radial_n is the load at the end of a motor's shaft that its bearings bear for 30,000 h.
hole_square_mm is the side of a square of holes, hole_circle_mm the diameter of a circle of holes.
"""
MAX_VALUE = 1e6  # of any size or mass
SAME_SIZE_MM = 1e-6  # sizes are equal up to rounding


@dataclass(frozen=True)
class PurchasedPart:
    """A purchased part."""

    kind: str  # its list, a key of SIZES
    name: str  # unique in all lists
    what: str  # description with standard
    material: str  # of it
    mass_g: float  # grams
    sizes: tuple[float, ...]  # numbers in the order of SIZES, units in their names
    source: str  # where they come from

    def __getitem__(self, size: str) -> float:
        """One of the sizes, by its name in SIZES."""
        return self.sizes[SIZES[self.kind].index(size)]


Parts = dict[str, PurchasedPart]
"""Purchased parts by name."""


def package_lists() -> Traversable:
    """The folder of tbcad's own lists."""
    return files("tbcad.prototype.purchased")


def load_parts(folder: Traversable | None = None) -> Parts:
    """All purchased parts by name.

    Args:
        folder: that holds a CSV file for each kind; without, tbcad's own.

    Raises:
        SpecError: when a file is wrong; it names line and column.
    """
    folder, names, parts = folder or package_lists(), set[str](), []
    for kind, sizes in SIZES.items():
        name = f"{kind}.csv"
        for where, row in read_rows(folder / name, name, (*COMMON_COLUMNS, *sizes, "source")):
            check_unique(where, row, "part", names)
            parts.append(_part(where, kind, row))
    return {part.name: part for part in parts}


def _part(where: str, kind: str, row: Row) -> PurchasedPart:
    name, what, material, source = (
        required_text(where, row, column) for column in ("part", "what", "material", "source")
    )
    mass, *sizes = (
        positive_number(where, row, column, MAX_VALUE) for column in ("mass_g", *SIZES[kind])
    )
    return PurchasedPart(kind, name, what, material, mass, tuple(sizes), source)


def of_kind(parts: Parts, kind: str, **sizes: float) -> list[PurchasedPart]:
    """Parts of one kind, of those only the ones with the sizes given by name, such as thread_mm."""
    return [
        part
        for part in parts.values()
        if part.kind == kind
        and all(abs(part[name] - value) < SAME_SIZE_MM for name, value in sizes.items())
    ]


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
