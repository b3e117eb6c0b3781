import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics import ball_light
from tbcad.core.optics.reflection import miss_distances, reflected_rays
from tests.sphere_misses import sphere_miss_distances

CAPTURE = 30.0


@pytest.fixture(scope="module")
def sampled(paper_array: MirrorArray) -> np.ndarray:
    """Some mirrors that are whole: those on the seam are aimed beyond it, balls are not."""
    return np.flatnonzero(~paper_array.cells.halved)[::60]


@pytest.fixture(scope="module")
def outline(paper_array: MirrorArray, sampled: np.ndarray) -> np.ndarray:
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[sampled])
    pinhole = norm(paper_array.camera.pinhole)
    return ball_light.used_outlines(at, paper_array.mirrors.radius[sampled], pinhole, CAPTURE)


def test_rays_off_the_outline_touch_the_capture_sphere(
    paper_array: MirrorArray, sampled: np.ndarray, outline: np.ndarray
) -> None:
    mirrors, azimuth = paper_array.mirrors, paper_array.azimuth[sampled]
    point = rotated_about_x(outline, azimuth[:, None]) @ paper_array.ellipsoid.frame()
    centre, radius = mirrors.centre[sampled][:, None], mirrors.radius[sampled][:, None]
    assert norm(point - centre) == pytest.approx(np.broadcast_to(radius, point.shape[:2]))
    miss = miss_distances(paper_array.camera.pinhole, point, unit(point - centre))
    assert miss == pytest.approx(CAPTURE, abs=1e-6)


def test_light_lies_in_its_hulls(
    paper_array: MirrorArray, sampled: np.ndarray, outline: np.ndarray
) -> None:
    """Rays over all of the part in use, by points along them."""
    pinhole = norm(paper_array.camera.pinhole)
    camera = np.array([pinhole, 0.0, 0.0])
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[sampled])
    radius = paper_array.mirrors.radius[sampled][:, None, None]
    centre = (at.apex - radius[:, 0] * at.normal)[:, None]
    to_object, to_camera = ball_light.light_hulls(outline, pinhole, CAPTURE)
    for share in (0.0, 0.4, 0.8, 1.0):
        inner = at.apex[:, None] + share * (outline - at.apex[:, None])
        point = centre + radius * unit(inner - centre)
        out = reflected_rays(camera, point, (point - centre) / radius)
        end = point - (point * out).sum(axis=-1, keepdims=True) * out
        for t in np.linspace(0, 1, 11):
            assert outside(to_camera, point + t * (camera - point)) < 1e-9
            assert outside(to_object, point + t * (end - point)) < 1e-9


def outside(cones: RoundCones, point: np.ndarray) -> float:
    """How far points (m, s, 3) lie outside their hull, by 2001 spheres of it."""
    flat = np.concatenate([cones.start, cones.end], axis=1)
    share = np.linspace(0, 1, 2001)[:, None]
    worst = -np.inf
    for (a, b, c, d), r, s, points in zip(
        flat, cones.start_radius, cones.end_radius, point, strict=True
    ):
        spine = np.concatenate([a + share * (c - a), b + share * (d - b), 0 * share], axis=1)
        gap = norm(points[:, None] - spine) - (r + share * (s - r))[:, 0]
        worst = max(worst, float(gap.min(axis=1).max()))
    return worst


@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (3.0, 1.5)])
def test_area_of_an_ellipse(a: float, b: float) -> None:
    turn = 2 * np.pi * np.arange(ball_light.OUTLINE_POINTS) / ball_light.OUTLINE_POINTS
    curve = np.stack([7 + a * np.cos(turn), b * np.sin(turn) - 2], axis=-1)[None]
    assert ball_light.enclosed_areas(curve)[0] == pytest.approx(np.pi * a * b, rel=1e-12)


def test_pixels_against_counting(paper_array: MirrorArray) -> None:
    """Rays through the centres of all pixels about a mirror that meet the capture sphere."""
    camera, mirrors, i = paper_array.camera, paper_array.mirrors, 400
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[[i]])
    outline = ball_light.used_outlines(at, mirrors.radius[[i]], norm(camera.pinhole), CAPTURE)
    frame = paper_array.ellipsoid.frame()
    pixels = ball_light.pixel_counts(camera, frame, outline, paper_array.azimuth[[i]])[0]
    size = 2 * camera.half_sizes[0] / camera.width_px / 4  # sixteen rays a pixel
    axes = np.stack([camera.right, np.cross(camera.forward, camera.right)])
    apex_ray = mirrors.apex[i] - camera.pinhole
    apex_image = axes @ apex_ray / (apex_ray @ camera.forward)
    x, y = np.meshgrid(*(centre + size * np.arange(-400, 401) for centre in apex_image))
    ray = unit(camera.forward + np.stack([x, y], axis=-1) @ axes)
    sphere = mirrors.centre[i], np.array(mirrors.radius[i])
    miss = sphere_miss_distances(camera.pinhole, ray, *sphere)
    assert pixels == pytest.approx((miss <= CAPTURE).sum() / 16, rel=2e-3)


def test_field_angles_against_the_scalar_product_with_the_axis(paper_array: MirrorArray) -> None:
    pinhole = paper_array.camera.pinhole
    ray = unit(paper_array.mirrors.apex - pinhole)
    expected = np.arccos(ray @ unit(-pinhole))
    assert ball_light.field_angles(paper_array.ellipsoid, paper_array.polar) == pytest.approx(
        expected
    )
