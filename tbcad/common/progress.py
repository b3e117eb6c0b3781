"""Reports of progress, for modules that load no numpy too."""

from collections.abc import Callable
from typing import TypeAlias

Progress: TypeAlias = Callable[[str], None]
"""A function that is given the name of each stage as it begins."""
