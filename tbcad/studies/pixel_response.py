"""What blurs a photograph before its pixels: an optical low-pass filter, a lens out of focus.

Each is a point spread function: a pixel is the mean of rays spread over its area and over that.
"""

from tbcad.simulate.capture.photograph import subpixel_shifts
from tbcad.simulate.scene.rays import Shift
from tbcad.simulate.views.ground_truth import disc_points, pixel_points


def low_pass_shifts(separation_px: float, samples: int) -> tuple[Shift, ...]:
    """Rays of a pixel behind a birefringent low-pass filter.

    Two crossed plates split every point into four, at the corners of a square. Along rows and
    columns f cycles a pixel pass by |cos(pi separation f)|, and 1 / (2 separation) not at all
    (J. E. Greivenkamp, Applied Optics 29, 676, 1990).

    Args:
        separation_px: side of the square, pixels.
        samples: each of the four images has samples x samples rays.
    """
    ends = (-separation_px / 2, separation_px / 2)
    return tuple(
        (x + column, y + row)
        for x, y in subpixel_shifts(samples)
        for row in ends
        for column in ends
    )


def defocus_shifts(diameter_px: float, count: int) -> tuple[Shift, ...]:
    """Rays of a pixel behind a lens out of focus, each through another point of both.

    Args:
        diameter_px: of the even blur circle, pixels.
        count: number of rays.
    """
    circle = (disc_points(count) * diameter_px / 2).tolist()
    pairs = zip(circle, pixel_points(count), strict=True)
    return tuple((x + column, y + row) for (x, y), (column, row) in pairs)
