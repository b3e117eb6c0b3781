"""Where a bright direction lies in each format of a picture of the surroundings."""

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.reflectance.environment import LightFormat, LightPixels, environment, light_pixels

SHAPES: tuple[tuple[LightFormat, int, int], ...] = (
    ("latlong", 60, 120),
    ("angular", 120, 120),
    ("mirror-ball", 120, 120),
    ("cross", 160, 120),
    ("cross", 120, 160),
)
EVERY = pytest.mark.parametrize(("kind", "height", "width"), SHAPES)


def pixels(kind: LightFormat, height: int, width: int) -> LightPixels:
    return light_pixels(np.zeros((height, width, 3)), kind, "sky.hdr")


def shown_at(kind: LightFormat, shape: tuple[int, int], u: float, v: float) -> np.ndarray:
    """What the pixel at shares of width and height shows."""
    found = pixels(kind, *shape)
    off = (found.column + 0.5 - u * shape[1]) ** 2 + (found.row + 0.5 - v * shape[0]) ** 2
    return found.direction[off.argmin()]


@EVERY
def test_every_direction_once(kind: LightFormat, height: int, width: int) -> None:
    """All of the sphere; the mean of z squared over it is 1/3; no direction weighs more."""
    found = pixels(kind, height, width)
    assert np.linalg.norm(found.direction, axis=1) == pytest.approx(1)
    assert found.solid_angle.sum() == pytest.approx(4 * np.pi)
    moments = (found.direction * found.solid_angle[:, None]).T @ found.direction / (4 * np.pi)
    assert moments == pytest.approx(np.eye(3) / 3, abs=5e-3)
    assert found.solid_angle @ found.direction == pytest.approx(np.zeros(3), abs=0.02)
    assert len(np.unique(found.row * width + found.column)) == len(found.row)


HALF, BALL = 0.25, np.sqrt(0.5) / 2  # radii, as shares of the side, of 90 degrees from the middle


@pytest.mark.parametrize(
    ("kind", "shape", "places"),
    [
        ("latlong", (200, 400), [(0.5, 0.5), (0.5, 0), (0.75, 0.5), (0, 0.5)]),
        ("angular", (401, 401), [(0.5, 0.5), (0.5, 0.5 - HALF), (0.5 + HALF, 0.5), (0.5, 1)]),
        ("mirror-ball", (401, 401), [(0.5, 0.5), (0.5, 0.5 - BALL), (0.5 + BALL, 0.5), (0.5, 1)]),
        ("cross", (400, 300), [(0.5, 0.375), (0.5, 0.125), (5 / 6, 0.375), (0.5, 0.875)]),
        ("cross", (300, 400), [(0.375, 0.5), (0.375, 1 / 6), (0.625, 0.5), (0.875, 0.5)]),
    ],
)
def test_middle_top_right_and_back(
    kind: LightFormat, shape: tuple[int, int], places: list[tuple[float, float]]
) -> None:
    expected = [[1, 0, 0], [0, 0, 1], [0, -1, 0], [-1, 0, 0]]
    found = [shown_at(kind, shape, *place) for place in places]
    atol = 0.15 if kind == "mirror-ball" else 0.03  # whose rim shows 8 degrees in a pixel
    assert np.array(found) == pytest.approx(np.array(expected), abs=atol)


@EVERY
def test_neighbouring_pixels_show_neighbouring_directions(
    kind: LightFormat, height: int, width: int
) -> None:
    """Within faces and across those edges that touch in the picture: no face lies wrongly."""
    found = pixels(kind, height, width)
    grid = np.full((height, width, 3), np.nan)
    grid[found.row, found.column] = found.direction
    for axis in (0, 1):
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=2)
        assert np.nanmax(step) < (0.4 if kind == "mirror-ball" else 0.07)


@EVERY
def test_the_same_surroundings_give_the_same_light(
    kind: LightFormat, height: int, width: int
) -> None:
    """Light of (1 + a.d)^2, of which the upper half is known, whatever the format and the turn."""
    found = pixels(kind, height, width)
    picture = np.full((height, width, 3), np.nan)  # what is outside is not read
    toward = np.array([0.6, -0.5, 0.3])
    picture[found.row, found.column] = ((1 + found.direction @ toward) ** 2)[:, None]
    turn = 0.7
    light = environment(picture, turn, kind)
    assert (light.direction[:, 2] > 0).all()
    axis = np.array(
        [
            0.6 * np.cos(turn) + 0.5 * np.sin(turn),
            0.6 * np.sin(turn) - 0.5 * np.cos(turn),
            0.3,
        ]
    )
    level, moment = 2 * np.pi * (1 + 0.3 + toward @ toward / 3), light.light[:, 0].sum()
    assert moment == pytest.approx(level, rel=0.02)
    about = light.light[:, 0] @ light.direction[:, :2]
    # Of 2 a.d and of 2 a_z z (a.d), over the hemisphere.
    assert about == pytest.approx(axis[:2] * (4 * np.pi / 3 + 0.15 * np.pi), rel=0.02)


@pytest.mark.parametrize(
    ("kind", "height", "width"),
    [(None, 64, 64), (None, 60, 121), ("angular", 64, 128), ("cross", 100, 100), ("cross", 3, 5)],
)
def test_other_shapes_are_refused(kind: LightFormat | None, height: int, width: int) -> None:
    with pytest.raises(InputError, match=r"--light-format latlong \| angular \| mirror-ball"):
        light_pixels(np.zeros((height, width, 3)), kind, "sky.hdr")
