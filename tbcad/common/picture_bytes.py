"""Pictures as bytes of PNG files."""

from io import BytesIO

import numpy as np
from numpy.typing import NDArray


def png_bytes(picture: NDArray[np.uint8] | NDArray[np.uint16], largest_px: int = 0) -> bytes:
    """Return a picture as a PNG file, every k-th pixel where it is too large.

    Args:
        picture: red, green, blue, 0 to 255, (h, w, 3), or grey, of 8 or 16 bits, (h, w).
        largest_px: of the longer side; 0: any.
    """
    from PIL import Image

    step = -(-max(picture.shape[:2]) // largest_px) if largest_px else 1
    file = BytesIO()
    Image.fromarray(picture[::step, ::step]).save(file, format="PNG")
    return file.getvalue()
