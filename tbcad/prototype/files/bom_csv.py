"""bom.csv: everything to buy and to print; and the drive's loads for prototype.json."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad.formats.csv_table import Cell, Row
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import BaseBalance, cap_volume
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.spec.errors import SpecError, short_text
from tbcad.spec.prototype import MotionSpec

COLUMNS = (
    *("item", "quantity", "part", "what", "material", "mass_g", "total_mass_g"),
    *("print_volume_mm3", "from"),
)
ALWAYS = {"GLUE-EPOXY": 1, "GRBL-BOARD": 1, "RELAY": 1, "SUPPLY-24V": 1}
PRINT_MATERIAL = "PETG"


@dataclass(frozen=True)
class PrintedItem:
    """A part to be printed.

    Attributes:
        name: of the part and of its files.
        what: it is for.
        volume: mm^3.
    """

    name: str
    what: str
    volume: float


def bom_rows(
    prototype: PrototypeLayout,
    drive: Drive,
    purchased: Mapping[str, int],
    printed: Iterable[PrintedItem],
    density: float,
    parts: Parts,
) -> list[Row]:
    """One record for each kind of part, in the order of COLUMNS, items numbered from 1.

    Balls and caps come first, by size, then the drive, other purchased parts, and last what is
    printed.

    Args:
        prototype: with its balls.
        drive: of the base.
        purchased: quantity of each other purchased part, by its name in the lists.
        printed: parts to print, without caps.
        density: of their material, g/cm^3.
        parts: the lists.

    Raises:
        SpecError: when a part is in no list.
    """
    rows = [
        *_balls(prototype),
        *(_printed(cap, density) for cap in _caps(prototype)),
        *(_purchased(part, 1) for part in drive.parts),
        *_other_purchased(purchased, parts),
        *(_printed(item, density) for item in printed),
    ]
    return [{"item": item, **row} for item, row in enumerate(rows, 1)]


def drive_record(
    balance: BaseBalance,
    drive: Drive,
    motion: MotionSpec,
    swing: tuple[float, float],
    radius: float,
) -> dict[str, Cell | list[float]]:
    """What the drive must bear and does, for prototype.json.

    Args:
        balance: masses on the base.
        drive: chosen for them.
        motion: of the base.
        swing: smallest and largest base angle, radians.
        radius: at which a counterweight would be, mm.
    """
    torque = balance.max_torque(*swing)
    acceleration = float(np.radians(motion.acceleration_deg_s2))
    return {
        "mass_g": balance.mass_g,
        "centre_mm": (balance.centre + 0.0).tolist(),
        "moment_g_mm": balance.moment,
        "azimuth_deg": float(np.degrees(balance.azimuth)),
        "inertia_g_mm2": balance.inertia,
        "worst_torque_nmm": torque,
        "safety": motion.safety,
        "required_torque_nmm": balance.required_torque(*swing, acceleration, motion.safety),
        "holding_torque_nmm": drive.holds_nmm,
        "drive": drive.name,
        "motor": drive.motor.name,
        "ratio": drive.ratio,
        "steps_per_deg": drive.steps_per_deg(motion.microsteps),
        "wind_up_deg": float(np.degrees(drive.wind_up_angle(torque))),
        "belt_pull_n": drive.belt_pull(torque),
        "belt_centre_mm": drive.centre_mm,
        "counterweight_g": balance.moment / radius,
        "counterweight_radius_mm": radius,
    }


def _row(
    quantity: int, part: str, what: str, material: str, mass: float, volume: float | None = None
) -> Row:
    """A row; with a volume (mm^3) the part is printed."""
    return {
        "quantity": quantity,
        "part": part,
        "what": what,
        "material": material,
        "mass_g": mass,
        "total_mass_g": quantity * mass,
        "print_volume_mm3": volume,
        "from": "bought" if volume is None else "printed",
    }


def _purchased(part: PurchasedPart, quantity: int) -> Row:
    return _row(quantity, part.name, part.what, part.material, part.mass_g)


def _printed(item: PrintedItem, density: float) -> Row:
    mass = item.volume * 1e-3 * density
    return _row(1, item.name, item.what, PRINT_MATERIAL, mass, item.volume)


def _balls(prototype: PrototypeLayout) -> Iterator[Row]:
    """Purchased balls by rising diameter."""
    balls, grade = prototype.balls, prototype.grade.grade
    for k, count in sorted(Counter(balls.stock[~balls.cap].tolist()).items()):
        ball = balls.catalogue.balls[k]
        what = f"steel ball {ball.size} {ball.standard} {grade}"
        yield _row(count, f"ball {ball.size}", what, "steel", ball.mass_g)


def _caps(prototype: PrototypeLayout) -> Iterator[PrintedItem]:
    """Caps by number of their ball: no two are alike."""
    balls, volume = prototype.balls, cap_volume(prototype.balls)
    for j in np.flatnonzero(balls.cap).tolist():
        front, body = balls.radius[j], 2 * balls.body_radius[j]
        what = f"front of radius {front:.1f} mm on a ball of {body:.3f} mm"
        yield PrintedItem(f"cap {j + 1}", what, float(volume[j]))


def _other_purchased(purchased: Mapping[str, int], parts: Parts) -> list[Row]:
    """Parts by name, in the order of the lists; those of none are left out."""
    counts = Counter(ALWAYS) + Counter(purchased)
    if unknown := [name for name in counts if name not in parts]:
        raise SpecError(f"{short_text(unknown[0])} is in no list of purchased parts: add it to one")
    return [_purchased(part, counts[name]) for name, part in parts.items() if counts[name]]
