import cv2
import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.camera import (
    Camera,
    LensCamera,
    vignetting,
    vignetting_slope,
    without_distortion,
)
from tbcad.core.optics.led_dome import disc_images, dome_images, dome_samples, sight_axes
from tbcad.core.optics.reflection import miss_distances, reflected_rays, reflection_points
from tests.rig.machine.test_machine import MACHINE

AXIS = unit(np.array([0.3, -0.5, 0.8]))
CAMERA = LensCamera(
    pinhole=np.array([10.0, -20.0, 5.0]),
    axes=rotated(np.eye(3), AXIS, np.full(3, 0.4)),
    focal=np.array([1000.0, 1010.0]),
    principal=np.array([630.0, 480.0]),
    distortion=np.array([-0.1, 0.02, 1e-3, -5e-4, 3e-3]),
    width_px=1280,
    height_px=960,
)
ELEVATIONS = np.radians([-50.0, -10.0, 0.0, 20.0, 60.0, 90.0])
GRID, FINE = 100, 1e-3  # of places across a disc; step of differences
GRID_PX = 1e-3
TOWARD = np.stack([np.cos(ELEVATIONS), 0 * ELEVATIONS, np.sin(ELEVATIONS)], axis=1)


def test_all_mirrors_of_the_paper_are_in_the_frame(paper_array: MirrorArray) -> None:
    """89 degrees across 2080 x 1552 pixels hold camera a's 847 mirrors."""
    camera = paper_array.camera
    assert camera.fill(paper_array.cells.corners) <= 1
    assert camera.forward @ camera.right == pytest.approx(0, abs=1e-12)
    assert abs(camera.forward[1]) < 1e-9  # the array is symmetric, and so is the camera


def test_no_small_tilt_does_better(paper_array: MirrorArray) -> None:
    camera, corners = paper_array.camera, paper_array.cells.corners
    best = camera.fill(corners)
    for tilt in (-1e-3, 1e-3):
        for axis in (camera.right, np.cross(camera.forward, camera.right)):
            forward = camera.forward + tilt * axis
            forward /= np.linalg.norm(forward)
            right = camera.right - (camera.right @ forward) * forward
            other = type(camera)(
                camera.pinhole, forward, right / np.linalg.norm(right), 2080, 1552, camera.hfov
            )
            assert other.fill(corners) >= best - 1e-9


def test_a_camera_projects_as_opencv_and_back_and_as_designed() -> None:
    rng = np.random.default_rng(3)
    pixels = rng.uniform([0, 0], [1279, 959], size=(200, 2))
    distance = rng.uniform(50, 400, size=(200, 1))
    points = CAMERA.pinhole + distance * CAMERA.directions(pixels)
    matrix = np.array([[1000.0, 0, 630], [0, 1010, 480], [0, 0, 1]])
    turn, _ = cv2.Rodrigues(CAMERA.axes)
    shift = -CAMERA.axes @ CAMERA.pinhole
    expected, _ = cv2.projectPoints(points, turn, shift, matrix, CAMERA.distortion)
    assert CAMERA.project(points) == pytest.approx(expected[:, 0], abs=1e-8)
    along = unit(points - CAMERA.pinhole)
    assert CAMERA.directions(CAMERA.project(points)) == pytest.approx(along, abs=1e-10)
    designed = Camera(CAMERA.pinhole, CAMERA.axes[2], CAMERA.axes[0], 1280, 960, 1.2)
    found = without_distortion(designed).project(points)
    assert found == pytest.approx(designed.project(points), abs=1e-9)


def test_slope_of_vignetting_is_that_of_its_logarithm() -> None:
    camera = without_distortion(
        Camera(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0]), 640, 480, 1.2)
    )
    pixels = np.array([[30.0, 40.0], [319.5, 239.5], [600.0, 100.0]])
    for axis, step in enumerate(0.01 * np.eye(2)):
        there, back = (
            np.log(vignetting(camera, camera.directions(pixels + side * step))) for side in (1, -1)
        )
        slope = (there - back) / 0.02
        assert vignetting_slope(camera, pixels)[:, axis] == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_mirrored_camera_sees_the_mirrored_array_alike(paper_array: MirrorArray) -> None:
    flipped = paper_array.cells.corners * [-1, 1, 1]
    camera = paper_array.camera
    assert camera.mirrored().fill(flipped) == pytest.approx(camera.fill(paper_array.cells.corners))
    assert np.linalg.det(
        [camera.right, np.cross(camera.forward, camera.right), camera.forward]
    ) == pytest.approx(1)


def test_ray_over_the_apex_passes_the_origin(paper_array: MirrorArray) -> None:
    """On the seam, where a half is aimed beyond it, the x axis at camera b's side instead."""
    mirrors, halved = paper_array.mirrors, paper_array.cells.halved
    pinhole = paper_array.camera.pinhole
    whole = mirrors.subset(np.flatnonzero(~halved))
    assert miss_distances(pinhole, whole.apex, whole.normal).max() < 1e-9
    seam = mirrors.subset(np.flatnonzero(halved))
    ray = reflected_rays(pinhole, seam.apex, seam.normal)
    across = unit(np.cross(ray, [1.0, 0.0, 0.0]))
    assert np.abs(np.einsum("md,md->m", across, seam.apex)).max() < 1e-9
    away = np.linalg.norm(seam.apex[:, 1:], axis=1) / np.linalg.norm(ray[:, 1:], axis=1)
    assert (seam.apex[:, 0] + away * ray[:, 0]).max() < 1e-9


@pytest.mark.parametrize("radius", [1.0, 20.0, 300.0, 5000.0])
def test_light_of_the_led_is_reflected_to_the_pinhole(radius: float) -> None:
    """Angles of incidence and of reflection are equal, also on spheres much larger than the rig."""
    rng = np.random.default_rng(1)
    pinhole, place = np.array([100.0, 0.0, -100.0]), np.array([5.0, 20.0, -3.0])
    apex = unit(rng.normal(loc=(0, 0, 1.5), size=(200, 3))) * 150
    normal = unit(unit(place - apex) + unit(pinhole - apex) + 0.05 * rng.normal(size=(200, 3)))
    centre = apex - radius * normal
    point = reflection_points(centre, np.full(200, radius), place, pinhole)
    assert norm(point - centre) == pytest.approx(np.full(200, radius))
    to_led, to_pinhole = unit(place - point), unit(pinhole - point)
    assert norm(np.cross(unit(to_led + to_pinhole), unit(point - centre))).max() < 1e-9


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
        flat = at @ discs.slope[k]
        wave = np.exp(2j * np.pi * (flat - flat.mean(axis=0))).mean(axis=0)
        assert np.abs(wave - found.wave[k]).max() < 0.03
