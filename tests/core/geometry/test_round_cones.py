import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.geometry.round_cones import RoundCones, contact_angle, smallest_sphere, spheres

LENGTHS = st.floats(-100, 100)
OUT = st.floats(0, 100)
RADII = st.floats(0.1, 40)
BALLS = st.tuples(LENGTHS, OUT, RADII)


def at(along: float, out: float) -> np.ndarray:
    return np.array([[along, out]])


@pytest.mark.parametrize("margin", [0.0, 4.0])
def test_two_balls_of_one_height_touch_at_the_chord(margin: float) -> None:
    """Closed form: 2 * 80 * sin(angle / 2) = 15 + 9 and the margin."""
    balls = spheres(at(-20, 80), np.array([15.0])).grown(margin)
    angle = contact_angle(at(-20, 80), np.array([9.0]), balls)[0, 0]
    assert angle == pytest.approx(2 * np.arcsin((24 + margin) / 160), rel=1e-12)


def test_balls_far_apart_along_the_axis_never_meet() -> None:
    assert contact_angle(at(30, 80), np.array([9.0]), spheres(at(-20, 80), np.array([15.0]))) == 0


def test_ball_over_the_axis_is_always_met() -> None:
    cone = RoundCones(at(0, 0), at(0, 50), np.array([5.0]), np.array([1.0]))
    assert contact_angle(at(0, 4), np.array([2.0]), cone)[0, 0] == np.pi


def test_rod_on_the_axis_is_met_between_its_ends() -> None:
    """Neither end is within reach of the ball, the middle is at every angle."""
    rod = RoundCones(at(20, 0), at(-20, 0), np.array([1.0]), np.array([1.0]))
    assert contact_angle(at(0, 1.9), np.array([1.0]), rod)[0, 0] == np.pi
    assert contact_angle(at(0, 2.1), np.array([1.0]), rod)[0, 0] == 0


def test_capsule_across_the_orbit_is_met_at_the_tangent() -> None:
    """A ray out from the axis at the ball's height: sin(angle) * out = sum of radii."""
    cone = RoundCones(at(0, 0), at(0, 1000), np.array([3.0]), np.array([3.0]))
    angle = contact_angle(at(0, 100), np.array([7.0]), cone)[0, 0]
    assert angle == pytest.approx(np.arcsin(10 / 100), rel=1e-9)


@settings(max_examples=100)
@given(BALLS, BALLS, st.tuples(LENGTHS, st.floats(1, 100), RADII))
def test_against_many_spheres(
    start: tuple[float, ...], end: tuple[float, ...], ball: tuple[float, ...]
) -> None:
    """The hull as a row of 1001 spheres, the ball at 361 angles."""
    ends = (np.array([point[:2]]) for point in (start, end))
    cone = RoundCones(*ends, np.array([start[2]]), np.array([end[2]]))
    height, distance, size = ball
    angle = contact_angle(at(height, distance), np.array([size]), cone)[0, 0]
    share = np.linspace(0, 1, 1001)[:, None]
    along, out, radius = (p + share * (q - p) for p, q in zip(start, end, strict=True))
    rotation = np.linspace(0, np.pi, 361)
    squared = (along - height) ** 2 + out**2 + distance**2 - 2 * out * distance * np.cos(rotation)
    gap = (np.sqrt(np.maximum(squared, 0)) - radius - size).min(axis=0)
    assert (gap[rotation < angle - 1e-6] < 2e-2).all()
    assert (gap[rotation > angle + 1e-6] > -1e-6).all()


@pytest.mark.parametrize(
    ("points", "middle", "radius"),
    [
        ([[1, 2, 3]], [1, 2, 3], 0),
        ([[0, 0, 0], [2, 0, 0]], [1, 0, 0], 1),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0]], [2, 0, 0], 2),
        ([[0, 0, 5], [6, 0, 5], [0, 8, 5]], [3, 4, 5], 5),
        ([[0, 0, 0], [10, 0, 0], [5, 1, 0]], [5, 0, 0], 5),
        ([[-1, -1, 7], [1, -1, 7], [1, 1, 7], [-1, 1, 7], [0, 0, 7]], [0, 0, 7], np.sqrt(2)),
        ([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [0, 0, 0], np.sqrt(3)),
    ],
)
def test_closed_forms(points: list[list[float]], middle: list[float], radius: float) -> None:
    found, reach = smallest_sphere(np.array(points, dtype=np.float64))
    assert found == pytest.approx(middle, abs=1e-9)
    assert reach == pytest.approx(radius)


@pytest.mark.parametrize("thickness", [1.0, 1e-6, 1e-13, 0.0])
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_no_other_middle_is_nearer_to_all(thickness: float, shift: float) -> None:
    """The middle minimises a convex function, so no small step may make the reach shorter."""
    random = np.random.default_rng(4)
    points = random.normal(size=(300, 3)) * [1, 1, thickness] + shift
    middle, reach = smallest_sphere(points)
    for step in np.vstack([1e-3 * random.normal(size=(50, 3)), 1e-3 * np.eye(3)]):
        assert np.linalg.norm(points - middle - step, axis=1).max() > reach - 1e-9
