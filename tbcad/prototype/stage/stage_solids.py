"""The object stage as solids."""

from tbcad.prototype.printing.item_solids import printed
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.base_keys import BaseSpec


def parts(numbers: StageLayout, keys: BaseSpec) -> list[PlacedSolid]:
    """Disc, crown and post, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, keys) for item in numbers.items]
