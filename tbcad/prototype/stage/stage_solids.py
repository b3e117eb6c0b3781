"""The object stage as solids."""

from tbcad.prototype.printing.item_solids import printed
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.printer import PrinterSpec


def parts(numbers: StageLayout, printer: PrinterSpec) -> list[PlacedSolid]:
    """Disc, crown and post, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, printer) for item in numbers.items]
