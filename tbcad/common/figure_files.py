"""Pictures and plots as bytes of files: one palette, legends beside the data, bytes that repeat."""

from collections.abc import Callable
from io import BytesIO
from threading import RLock
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.common.colours import CYCLE, SHADES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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


def figure_file(
    draw: "Callable[[Figure], None]", inches: tuple[float, float], kind: PlotFormat = "png"
) -> bytes:
    """Return the file of a figure; the same drawing gives the same bytes.

    Args:
        draw: draws on an empty figure. "C0", "C1" ... are the colours of `palette.CYCLE`.
        inches: width and height.
        kind: of file.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with _SETTINGS, matplotlib.rc_context(_settings()):
        figure = Figure(figsize=inches, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure)
        file = BytesIO()
        figure.savefig(file, format=kind, metadata=METADATA[kind])
    return file.getvalue()


def _settings() -> dict[Any, Any]:
    """Return matplotlib's settings; a user's own must not change the picture."""
    import matplotlib
    from cycler import cycler

    settings: dict[Any, Any] = {**matplotlib.rcParamsDefault}
    settings |= {"svg.hashsalt": NAMES_IN_SVG, "image.cmap": SHADES}
    return settings | {"axes.prop_cycle": cycler(color=CYCLE)}


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
