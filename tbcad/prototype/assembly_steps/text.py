"""The words of a step."""

from typing import NamedTuple


class Text(NamedTuple):
    """Words of a step: what is done, what must be true afterwards, and other fits."""

    does: tuple[str, ...]
    checks: tuple[str, ...]
    fits: tuple[str, ...] = ()


def lines(*texts: str) -> tuple[str, ...]:
    """Those that are not empty."""
    return tuple(text for text in texts if text)
