"""bom.csv: everything to buy and to print; and what the drive must bear, for the record."""

from collections import Counter
from dataclasses import dataclass, field

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
BOUGHT, PRINTED = "bought", "printed"
ALWAYS = {"GRBL-BOARD": 1, "RELAY": 1, "SUPPLY-24V": 1}


@dataclass(frozen=True)
class Printed:
    """A part to be printed.

    Attributes:
        name: of the part and of its files.
        what: it is for.
        volume: of one, mm^3.
        quantity: how many.
    """

    name: str
    what: str
    volume: float
    quantity: int = 1


@dataclass(frozen=True)
class PartsNeeded:
    """What balls and drive do not tell.

    Attributes:
        bought: quantity of each purchased part, by its name in the lists.
        printed: parts to print, caps not among them.
        print_material: what they are printed of.
        print_density: of it, g/cm^3.
        cap_material: what caps are made of; None: printed as well.
        cap_density: of it, g/cm^3.
        leds: on the object stage.
        led: name of the part.
    """

    bought: dict[str, int] = field(default_factory=dict)
    printed: tuple[Printed, ...] = ()
    print_material: str = "PETG"
    print_density: float = 1.27
    cap_material: str | None = None
    cap_density: float = 7.81
    leds: int = 4
    led: str = "LED-3"


def rows(made: PrototypeLayout, drive: Drive, needed: PartsNeeded, parts: Parts) -> list[Row]:
    """One record for each kind of part, in the order of COLUMNS, items numbered from 1.

    Balls and caps come first, by size, then what is bought for them and for the drive, then what
    the caller asks for, and last what is printed.

    Raises:
        SpecError: when a part is in no list.
    """
    found = [
        *_balls(made),
        *_caps(made, needed),
        *(_bought(part, 1) for part in drive.parts),
        *_asked(needed, parts),
        *(_print(one, needed) for one in needed.printed if one.quantity),
    ]
    return [
        dict(zip(COLUMNS, [item, *values], strict=True)) for item, values in enumerate(found, 1)
    ]


def drive_record(
    summed: BaseBalance, drive: Drive, motion: MotionSpec, swing: tuple[float, float], radius: float
) -> dict[str, Cell | list[float]]:
    """What the drive must bear and does, for prototype.json.

    Args:
        summed: masses on the base.
        drive: chosen for them.
        motion: of the base.
        swing: least and largest base angle, radians.
        radius: at which a counterweight would be, mm.
    """
    worst = summed.max_torque(*swing)
    acceleration = float(np.radians(motion.acceleration_deg_s2))
    return {
        "mass_g": summed.mass_g,
        "centre_mm": (summed.centre + 0.0).tolist(),
        "moment_g_mm": summed.moment,
        "azimuth_deg": float(np.degrees(summed.azimuth)),
        "inertia_g_mm2": summed.inertia,
        "worst_torque_nmm": worst,
        "safety": motion.safety,
        "needed_nmm": summed.required_torque(*swing, acceleration, motion.safety),
        "holds_nmm": drive.holds_nmm,
        "drive": drive.name,
        "motor": drive.motor.name,
        "ratio": drive.ratio,
        "steps_per_deg": drive.steps_per_deg(motion.microsteps),
        "sag_deg": float(np.degrees(drive.wind_up_angle(worst))),
        "belt_pull_n": drive.belt_pull(worst),
        "belt_centre_mm": drive.centre_mm,
        "counterweight_g": summed.counterweight(radius).mass_g,
        "counterweight_radius_mm": radius,
    }


def _values(quantity: int, name: str, what: str, material: str, mass: float) -> list[Cell]:
    return [quantity, name, what, material, mass, quantity * mass]


def _bought(part: PurchasedPart, quantity: int) -> list[Cell]:
    what = _values(quantity, part.name, part.what, part.material, part.mass_g)
    return [*what, None, BOUGHT]


def _balls(made: PrototypeLayout) -> list[list[Cell]]:
    """Bought balls by rising diameter."""
    balls, grade = made.balls, made.grade.grade
    counts = Counter(balls.stock[~balls.cap].tolist())
    return [
        [
            *_values(
                count,
                f"ball {ball.size}",
                f"steel ball {ball.size} {ball.standard} {grade}",
                "steel",
                ball.mass_g,
            ),
            *(None, BOUGHT),
        ]
        for ball, count in ((balls.catalogue.balls[k], n) for k, n in sorted(counts.items()))
    ]


def _caps(made: PrototypeLayout, needed: PartsNeeded) -> list[list[Cell]]:
    """Caps by number of their ball: no two are alike."""
    balls, volume = made.balls, cap_volume(made.balls)
    own, density = needed.cap_material, needed.cap_density
    result = []
    for j in np.flatnonzero(balls.cap).tolist():
        front, body = balls.radius[j], 2 * balls.body_radius[j]
        what = f"front of radius {front:.1f} mm on a ball of {body:.3f} mm"
        mass = float(volume[j]) * 1e-3 * (density if own else needed.print_density)
        values = _values(1, f"cap {j + 1}", what, own or needed.print_material, mass)
        result.append([*values, float(volume[j]), "turned" if own else PRINTED])
    return result


def _asked(needed: PartsNeeded, parts: Parts) -> list[list[Cell]]:
    """Parts by name, in the order of the lists; those of none are left out."""
    counts = Counter({**ALWAYS, needed.led: needed.leds}) + Counter(needed.bought)
    if unknown := [name for name in counts if name not in parts]:
        raise SpecError(f"{short_text(unknown[0])} is in no list of purchased parts: add it to one")
    return [_bought(part, counts[name]) for name, part in parts.items() if counts[name]]


def _print(one: Printed, needed: PartsNeeded) -> list[Cell]:
    mass = one.volume * 1e-3 * needed.print_density
    values = _values(one.quantity, one.name, one.what, needed.print_material, mass)
    return [*values, one.volume, PRINTED]
