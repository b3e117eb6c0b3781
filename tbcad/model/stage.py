"""The object stage as solids."""

from tbcad.design.base_keys import Base as Keys
from tbcad.design.stage import StageNumbers
from tbcad.model.bed import Part
from tbcad.model.bodies import printed


def parts(numbers: StageNumbers, keys: Keys) -> list[Part]:
    """Disc, crown and post, laid on the bed.

    Raises:
        SpecError: when one does not fit on it.
        InvalidSolidError: when the kernel fails.
    """
    return [printed(item, keys) for item in numbers.items]
