"""The share of simulated builds that is to be good."""

from tbcad.errors import InputError


def check_yield(wanted_yield: float) -> None:
    """Refuse a share of good builds that is not between 0 and 1.

    Raises:
        InputError: it is not.
    """
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")
