"""The frame as solids: brackets to print, and what is bought as it stands in the rig."""

from OCP.TopoDS import TopoDS_Solid

from tbcad.prototype.frame.layout import FrameNumbers
from tbcad.prototype.printing.item_solids import printed, solid
from tbcad.prototype.printing.placing import Part
from tbcad.spec.base_keys import Base as Keys


def parts(numbers: FrameNumbers, keys: Keys) -> list[Part]:
    """Head, feet, clamp and bracket, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, keys) for item in numbers.printed]


def bought(numbers: FrameNumbers) -> list[tuple[str, TopoDS_Solid]]:
    """Simple solids of plate, uprights, bearings, shaft, wheels, motor and camera, by name.

    Raises:
        InvalidSolidError: when the kernel fails.
    """
    return [(item.name, solid(item)) for item in numbers.bought]
