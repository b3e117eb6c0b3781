"""Types that all of tbcad shares: arrays by their elements, and reports of progress."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.common.progress import Progress

__all__ = ["Bools", "Bytes", "Colours", "Floats", "Ints", "Progress"]

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
Colours: TypeAlias = NDArray[np.float32]
