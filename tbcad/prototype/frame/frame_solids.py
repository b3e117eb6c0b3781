"""The frame as solids: brackets to print, and what is bought as it stands in the rig."""

from OCP.TopoDS import TopoDS_Solid

from tbcad.prototype.frame.layout import FrameLayout
from tbcad.prototype.printing.item_solids import printed, solid
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.spec.printer import PrinterSpec


def parts(numbers: FrameLayout, printer: PrinterSpec) -> list[PlacedSolid]:
    """Head, feet, clamp and bracket, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, printer) for item in numbers.printed]


def bought(numbers: FrameLayout) -> list[tuple[str, TopoDS_Solid]]:
    """Simple solids of plate, uprights, bearings, shaft, wheels, motor and camera, by name.

    Raises:
        InvalidSolidError: when the kernel fails.
    """
    return [(item.name, solid(item)) for item in numbers.bought]
