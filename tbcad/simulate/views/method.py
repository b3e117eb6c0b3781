"""The method of synthesis that suits a light field."""

from typing import NamedTuple

from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method

# docs/light-field.md: with more, a blend on a plane shows ghosts (a lower SSIM than nearest rays).
MAX_SHIFT_PX = 6.0


class MethodChoice(NamedTuple):
    """A method, and in words why it was chosen."""

    method: Method
    reason: str


def suitable_method(tiles: MirrorTiles) -> MethodChoice:
    """Choose the method whose views resemble the ground truth more.

    A blend takes the object for a plane. Neighbouring virtual cameras see a point that lies a
    capture radius before or behind that plane in different places; where these are many pixels
    apart, the mean of several cameras shows the point several times.

    Args:
        tiles: the light field.
    """
    shift_mm = tiles.camera_spacing * tiles.source.capture_mm / 2
    shift_px = shift_mm / tiles.pixel_pitch
    method: Method = "blend" if shift_px <= MAX_SHIFT_PX else "nearest"
    compared = "at most" if method == "blend" else "more than"
    return MethodChoice(
        method,
        f"neighbouring virtual cameras see a point of the capture sphere {shift_px:.1f} pixels "
        f"apart, {compared} {MAX_SHIFT_PX:g}",
    )
