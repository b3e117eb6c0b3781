"""Pictures and plots as bytes of files, which repeat, and their colours, with the curve of sRGB.

Colours of plots are told apart by people with any colour vision.
"""

import re
from collections.abc import Callable
from io import BytesIO
from threading import RLock
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.types import Bytes, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# M. Okabe and K. Ito, Color Universal Design, 2008; without yellow, which is faint on white.
BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"
PURPLE, ORANGE, SKY, BLACK = "#cc79a7", "#e69f00", "#56b4e9", "#000000"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Colours of lines and points, in this order."""

SHADES = "viridis"
"""matplotlib's name of the map for shades of one quantity."""
_VIRIDIS = (
    *((68, 1, 84), (71, 45, 123), (59, 82, 139), (44, 114, 142), (33, 145, 140)),
    *((40, 174, 128), (94, 201, 98), (173, 220, 48), (253, 231, 37)),
)


def shades(values: Floats) -> list[str]:
    """Colours `#rrggbb` of values (m,), from the smallest to the largest, as of viridis.

    Linear between nine of its colours, off by up to 0.07 of a channel, so that no plotting library
    is needed.
    """
    span = float(np.ptp(values)) or 1.0
    colours = shade_bytes((values - values.min()) / span)
    return ["#{:02x}{:02x}{:02x}".format(*rgb) for rgb in colours.tolist()]


def shade_bytes(share: Floats) -> Bytes:
    """The same colours (..., 3), 0 to 255, of shares from 0 to 1."""
    table, place = np.array(_VIRIDIS).T, np.asarray(share) * (len(_VIRIDIS) - 1)
    channels = [np.interp(place, range(len(_VIRIDIS)), row) for row in table]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def srgb(light: Floats) -> Floats:
    """Light, 0 to 1, as IEC 61966-2-1 encodes it, 0 to 1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def srgb_light(values: Floats) -> Floats:
    """The inverse of `srgb`."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def shown_colour(factor: Bytes) -> tuple[float, ...]:
    """Red, green, blue (sRGB) and opacity of a factor of glTF: bytes of light and of opacity."""
    *light, opacity = factor / 255
    return (*srgb(np.array(light)).tolist(), float(opacity))


def image_bytes(
    picture: NDArray[np.uint8] | NDArray[np.uint16], kind: str = "PNG", **options: int
) -> bytes:
    """Return a picture as a file of a kind that Pillow writes.

    Red, green, blue, 0 to 255, (h, w, 3), or grey, of 8 or 16 bits, (h, w).
    """
    from PIL import Image

    file = BytesIO()
    Image.fromarray(np.ascontiguousarray(picture)).save(file, kind, **options)
    return file.getvalue()


DPI = 120
LEGEND_POINTS = 36  # below the axes: numbers and label of the axis come first
LEGEND_COLUMNS = 2

PlotFormat: TypeAlias = Literal["png", "svg", "pdf"]
# Without what would differ from run to run.
METADATA: dict[PlotFormat, dict[str, None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
_SETTINGS = RLock()  # of the process: threads take turns
NAMES_IN_SVG = "tbcad"  # in place of random ones
_PLACES, _DIGITS = re.compile(rb' (?:d|x|y)="[^"]*"'), re.compile(rb"(\.\d\d)\d+")


def figure_file(
    draw: "Callable[[Figure], None]", inches: tuple[float, float], kind: PlotFormat = "png"
) -> bytes:
    """Return the file of a figure of a width and height; the same drawing gives the same bytes.

    What draws gets an empty figure, where "C0", "C1" ... are the colours of CYCLE.
    """
    import matplotlib
    from cycler import cycler
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # A user's own settings must not change the picture.
    settings: dict[Any, Any] = {**matplotlib.rcParamsDefault, "svg.hashsalt": NAMES_IN_SVG}
    settings |= {"image.cmap": SHADES, "axes.prop_cycle": cycler(color=CYCLE)}
    with _SETTINGS, matplotlib.rc_context(settings):
        figure = Figure(figsize=inches, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure)
        file = BytesIO()
        figure.savefig(file, format=kind, metadata=METADATA[kind])
    return rounded_svg(file.getvalue()) if kind == "svg" else file.getvalue()


def rounded_svg(data: bytes) -> bytes:
    """An SVG with places to a hundredth of a point: smaller, and the same by any processor."""
    return _PLACES.sub(lambda found: _DIGITS.sub(rb"\1", found[0]), data)


def legend_below(axes: "Axes") -> None:
    """Put the legend below the axes, where it hides no data."""
    from matplotlib.transforms import ScaledTranslation

    inches = axes.figure.dpi_scale_trans
    axes.legend(
        fontsize=8,
        loc="upper center",
        bbox_to_anchor=(0.5, 0),
        bbox_transform=axes.transAxes + ScaledTranslation(0, -LEGEND_POINTS / 72, inches),
        ncols=LEGEND_COLUMNS,
        frameon=False,
    )
