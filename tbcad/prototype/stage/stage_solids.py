"""The object stage as solids."""

from tbcad.prototype.printing.item_solids import printed
from tbcad.prototype.printing.placing import Part
from tbcad.prototype.stage.layout import StageNumbers
from tbcad.spec.base_keys import Base as Keys


def parts(numbers: StageNumbers, keys: Keys) -> list[Part]:
    """Disc, crown and post, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, keys) for item in numbers.items]
