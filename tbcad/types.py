"""Types that all of tbcad shares: arrays by their elements, and reports of progress."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
Colours: TypeAlias = NDArray[np.float32]
Progress: TypeAlias = Callable[[str], None]
"""A function that is given the name of each stage as it begins."""
