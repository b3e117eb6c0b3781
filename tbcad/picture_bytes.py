"""Pictures as bytes of PNG files, for notebooks."""

from io import BytesIO

from tbcad.types import Bytes


def png_bytes(picture: Bytes, largest_px: int = 0) -> bytes:
    """Return a picture (h, w, 3) as a PNG file, every k-th pixel where it is too large.

    Args:
        picture: red, green, blue, 0 to 255.
        largest_px: of the longer side; 0: any.
    """
    from PIL import Image

    step = -(-max(picture.shape[:2]) // largest_px) if largest_px else 1
    file = BytesIO()
    Image.fromarray(picture[::step, ::step]).save(file, format="PNG")
    return file.getvalue()
