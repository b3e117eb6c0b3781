"""Input that is allowed but unlikely to be meant: one line of warning, and work goes on."""

import warnings
from collections.abc import Iterable, Sequence

from tbcad.errors import PlausibilityWarning

# An object in inches that fits the capture sphere is 25.4 times smaller than was meant.
SMALL_SHARE = 1 / 20
UNITS_MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "m": 1000.0}
# A lens as wide as it is far away is seen from the object under 53 degrees: wider than F/1.
WIDE_LENS = 1.0


def warn_of_small_object(
    name: str, size_mm: float, capture_mm: float, other_units: Iterable[str]
) -> None:
    """Warn of an object whose size is likely to be in another unit.

    Args:
        name: of the object.
        size_mm: longest side of the box that holds it.
        capture_mm: diameter of the capture sphere.
        other_units: in which it would have the size of an object.
    """
    if size_mm >= SMALL_SHARE * capture_mm:
        return
    units = " or ".join(f"--unit {unit}" for unit in other_units) or "another --unit"
    _warn(
        f"{name} is {size_mm:.3g} mm large, the capture sphere {capture_mm:g} mm: give {units}, "
        "scale it, or use --fit"
    )


def warn_of_left_out(name: str, what: Sequence[str]) -> None:
    """Warn of what an object's file names that was not found, not understood or left out."""
    _warn(f"{name}: {'; '.join(what)}")


def warn_of_wide_lens(aperture_mm: float, distance_mm: float) -> None:
    """Warn of a lens that is wider than its distance from the object."""
    if aperture_mm > WIDE_LENS * distance_mm:
        _warn(
            f"--aperture {aperture_mm:g} is more than --distance {distance_mm:g}: a lens so wide "
            "blurs all but one plane and looks past the mirrors; both are in mm"
        )


def units_that_fit(size: float, capture_mm: float) -> list[str]:
    """Units in which a size is that of an object that fills a good part of the capture sphere."""
    return [
        name for name, mm in UNITS_MM.items() if SMALL_SHARE * capture_mm <= size * mm <= capture_mm
    ]


def _warn(text: str) -> None:
    warnings.warn(text, PlausibilityWarning, stacklevel=3)
