"""The dome of an LED as spheres show it, against closed forms."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.led_dome import disc_images, dome_images, dome_samples, sight_axes
from tbcad.core.optics.reflection import reflection_points
from tests.rig.machine.test_machine import MACHINE

ELEVATIONS = np.radians([-50.0, -10.0, 0.0, 20.0, 60.0, 90.0])
GRID, FINE = 100, 1e-3  # of places across a disc; step of differences
GRID_PX = 1e-3
TOWARD = np.stack([np.cos(ELEVATIONS), 0 * ELEVATIONS, np.sin(ELEVATIONS)], axis=1)


def test_samples_have_the_area_and_the_centroid_of_the_lit_half() -> None:
    axes = sight_axes(TOWARD)
    points, share = dome_samples(axes)
    rise = np.sin(ELEVATIONS)
    assert share.sum(axis=1) == pytest.approx((1 + rise) / 2)
    centroid = np.einsum("ns,nsx,nax->na", share, points, axes[:, :2]) / share.sum(axis=1)[:, None]
    assert centroid[:, 0] == pytest.approx(0, abs=1e-12)
    # Half a disc above half an ellipse: first moments 2/3 and -2/3 sin^2 of areas pi/2 and
    # pi/2 sin. From below the edge is curved, which samples follow to a hundredth.
    assert centroid[:, 1] == pytest.approx(4 / (3 * np.pi) * (1 - rise), abs=0.01)


def _lit(rise: float) -> np.ndarray:
    """Places (s, 2) of a fine grid in the lit part of a unit disc."""
    line = (np.arange(GRID) + 0.5) * 2 / GRID - 1
    level, above = (one.ravel() for one in np.meshgrid(line, line))
    lit = (level**2 + above**2 < 1) & (above > -rise * np.sqrt(np.maximum(1 - level**2, 0)))
    return np.stack([level, above], axis=1)[lit]


def test_images_are_those_of_fine_grids() -> None:
    """Each point with the area of its own image, by differences about it."""
    frame, sphere, led = (index.ravel() for index in np.indices((2, 3, 2)))
    centre, radius = MACHINE.centres(frame, sphere), MACHINE.radius[sphere]
    place, dome = MACHINE.leds[led], 1.5
    found = dome_images(MACHINE.camera, centre, radius, place, dome)
    assert found.place == pytest.approx(MACHINE.highlights(frame, sphere, led))
    discs = disc_images(MACHINE.camera, centre, radius, place, dome)
    for k, axes in enumerate(discs.axes):

        def image(at: np.ndarray, k: int = k, axes: np.ndarray = axes) -> np.ndarray:
            light = place[k] + dome * at @ axes[:2]
            many = np.ones((len(light), 1))
            point = reflection_points(
                many * centre[k], radius[k] * many[:, 0], light, MACHINE.camera.pinhole
            )
            return MACHINE.camera.project(point) - found.place[k]

        at = _lit(axes[2, 2])
        slopes = [(image(at + d) - image(at - d)) / (2 * FINE) for d in FINE * np.eye(2)]
        area = np.abs(np.linalg.det(np.stack(slopes, axis=1)))
        centroid = area @ image(at) / area.sum()
        bent = norm(found.centroid[k] - 4 / (3 * np.pi) * (1 - axes[2, 2]) * discs.slope[k, 1])
        # To second order: an order better than what the second order adds, or than the grid.
        assert norm(centroid - found.centroid[k]) < 0.1 * bent + GRID_PX
        assert area.sum() * (2 / GRID) ** 2 == pytest.approx(found.area[k], rel=5e-3)
