import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.catalogue import load_catalogue
from tbcad.prototype.balls.placement import (
    SOLVER_MARGIN,
    allowed_azimuths,
    min_separations,
    obstacles,
)
from tbcad.prototype.balls.selection import Balls, ball_candidates, balls_with_radii, group_mirrors
from tests.helpers import segment_distances

LIMITS = load_spec(None).prototype
K = 12


@pytest.fixture(scope="module")
def balls(paper_array: MirrorArray) -> Balls:
    """As large as stock has them, so that they stand in each other's light too."""
    groups = group_mirrors(paper_array.polar, paper_array.mirrors.radius, K, 0.25)
    candidates = ball_candidates(paper_array, groups, 60.0)
    catalogue = load_catalogue(["metric"])
    stock = np.full(K, len(catalogue) - 1)
    return balls_with_radii(candidates, np.full(K, 30.0), stock, catalogue, 2.0)


def rays(balls: Balls, j: int, pinhole: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the light's segments (s, 3) at ball j, at azimuth zero."""
    camera = np.array([pinhole, 0.0, 0.0])
    share = np.linspace(0, 1, 15)[:, None, None]
    inner = balls.poses.apex[j] + share * (balls.outline[j] - balls.poses.apex[j])
    normal = unit(inner.reshape(-1, 3) - balls.centre[j])
    point = balls.centre[j] + balls.radius[j] * normal
    out = reflected_rays(camera, point, normal)
    end = point - dot(point, out)[:, None] * out
    return np.tile(point, (2, 1)), np.concatenate([end, np.broadcast_to(camera, end.shape)])


def test_light_passes_beyond_the_angle_and_hardly_within(
    paper_array: MirrorArray, balls: Balls
) -> None:
    """Against rays over the part in use: never blocked beyond, and at it closer than 2.6 mm."""
    pinhole = norm(paper_array.camera.pinhole)
    _, dark = min_separations(balls, LIMITS, pinhole, 30.0)
    azimuth = np.radians(np.arange(0, 60, 0.5))
    nearest = np.full((K, K), np.inf)
    for j in range(K):
        start, end = rays(balls, j, pinhole)
        for i in set(range(K)) - {j}:
            place = np.concatenate([[dark[i, j]], azimuth[azimuth > dark[i, j]]])
            centre = rotated_about_x(np.broadcast_to(balls.body_centre[i], (len(place), 3)), place)
            distance = segment_distances(start, end, centre).min(axis=0)
            gap = distance - balls.body_radius[i] - LIMITS.light_margin_mm
            assert gap.min() > 0
            nearest[i, j] = gap[0]
    # The light of one of the two sets the angle.
    nearest = np.minimum(nearest, nearest.T)[dark > 0]
    assert len(nearest) > 10
    assert nearest.max() < 2.6


def test_balls_touch_within_the_angle(paper_array: MirrorArray, balls: Balls) -> None:
    touch, _ = min_separations(balls, LIMITS, norm(paper_array.camera.pinhole), 30.0)
    assert (touch == touch.T).all()
    for i, j in ((0, 1), (3, 5), (6, 7)):
        other = rotated_about_x(balls.body_centre[i], np.array(touch[i, j] - SOLVER_MARGIN))
        assert norm(other - balls.body_centre[j]) == pytest.approx(60 + LIMITS.ball_wall_mm)


def test_post_lies_straight_below(paper_array: MirrorArray, balls: Balls) -> None:
    """Its half-plane is opposite to the mirrors; only the lowest polar angles come near it."""
    frame = paper_array.ellipsoid.frame()
    post, camera = obstacles(LIMITS, frame, paper_array.camera, 400.0)
    assert post.azimuth == pytest.approx(np.pi)
    assert post.cone.end[0] == pytest.approx(400 * np.array([1, 1]) / np.sqrt(2))
    assert camera.cone.start[0] == pytest.approx([np.sqrt(2) * 100, 0])
    floor, ceiling = allowed_azimuths(balls, LIMITS, [post])
    assert floor == pytest.approx(-ceiling)
    near = ceiling < np.pi
    assert near[0]
    assert not near[-1]
    at = rotated_about_x(balls.body_centre[0], np.array(ceiling[0])) @ frame
    distance = np.hypot(at[0], at[1])
    assert distance == pytest.approx(30 + LIMITS.post_diameter_mm / 2 + LIMITS.ball_wall_mm)
