import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, cKDTree
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.conics import Ellipsoid, Spheroid, enclosing_offset, wall_offset
from tbcad.core.geometry.primitives import (
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    Slot,
    box,
    enclosing_triangles,
    volume,
)
from tbcad.core.geometry.rotations import rotated, rotated_about_x
from tbcad.core.geometry.round_cones import RoundCones, contact_angle, smallest_sphere, spheres
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.geodesic import geodesic

LENGTHS = st.floats(-100, 100)
OUT = st.floats(0, 100)
RADII = st.floats(0.1, 40)
BALLS = st.tuples(LENGTHS, OUT, RADII)
TILTED = np.array([0.6, 0.0, 0.8])
RANDOM = np.random.default_rng(4)
VECTORS, AXES = RANDOM.normal(size=(20, 3)), unit(RANDOM.normal(size=(20, 3)))
ANGLES = RANDOM.uniform(-7, 7, 20)
ELLIPSOID = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)
cameras = st.tuples(
    st.floats(20, 400), st.floats(-100, 100), st.floats(-400, -20), st.floats(20, 300)
)


def at(along: float, out: float) -> np.ndarray:
    return np.array([[along, out]])


def cone(start: np.ndarray, end: np.ndarray, first: float, last: float) -> RoundCones:
    return RoundCones(start, end, np.array([first]), np.array([last]))


BALL, ROD = spheres(at(-20, 80), np.array([15.0])), cone(at(20, 0), at(-20, 0), 1.0, 1.0)


@pytest.mark.parametrize(
    ("cones", "place", "radius", "expected"),
    [
        # Two balls of one height touch at the chord: 2 * 80 * sin(angle / 2) = 15 + 9 and a margin.
        (BALL, at(-20, 80), 9.0, 2 * np.arcsin(24 / 160)),
        (BALL.grown(4.0), at(-20, 80), 9.0, 2 * np.arcsin(28 / 160)),
        (BALL, at(30, 80), 9.0, 0.0),  # far apart along the axis
        (cone(at(0, 0), at(0, 50), 5.0, 1.0), at(0, 4), 2.0, np.pi),  # over the axis
        # Neither end of a rod on the axis is within reach of the ball, the middle is or is not.
        (ROD, at(0, 1.9), 1.0, np.pi),
        (ROD, at(0, 2.1), 1.0, 0.0),
        # A ray out from the axis at the ball's height: sin(angle) * out = sum of radii.
        (cone(at(0, 0), at(0, 1000), 3.0, 3.0), at(0, 100), 7.0, np.arcsin(10 / 100)),
    ],
)
def test_angles_of_contact(
    cones: RoundCones, place: np.ndarray, radius: float, expected: float
) -> None:
    found = contact_angle(place, np.array([radius]), cones)[0, 0]
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-15)


@settings(max_examples=100)
@given(BALLS, BALLS, st.tuples(LENGTHS, st.floats(1, 100), RADII))
def test_against_many_spheres(
    start: tuple[float, ...], end: tuple[float, ...], ball: tuple[float, ...]
) -> None:
    """The hull as a row of 1001 spheres, the ball at 361 angles."""
    hull = cone(at(*start[:2]), at(*end[:2]), start[2], end[2])
    height, distance, size = ball
    angle = contact_angle(at(height, distance), np.array([size]), hull)[0, 0]
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


@pytest.mark.parametrize(
    ("body", "rounding"),
    [
        (box(np.zeros(3), np.array([2.0, 3.0, 4.0]), np.eye(3)), 0.0),
        (Prism(np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.array([1.0, 2.0, 5.0])), 0.0),
        (Cylinder(np.ones(3), TILTED, 2.0, 7.0), 0.01),
        (Slot(np.ones(3), np.array([0.0, 3.0, 0.0]), 2.0, 7 * TILTED), 0.01),
        (Revolved(np.array([[0.0, 0.0], [0.0, 3.0], [5.0, 1.0], [5.0, 0.0]])), 0.01),
    ],
    ids=["box", "oblique prism", "cylinder", "slot", "cone"],
)
def test_volume_of_convex_bodies(body: Primitive, rounding: float) -> None:
    """The circumscribed polygons of round bodies enclose up to 0.4 % more."""
    hull = ConvexHull(enclosing_triangles(body).reshape(-1, 3)).volume
    assert volume(body) <= hull * (1 + 1e-12)
    assert volume(body) == pytest.approx(hull, rel=rounding or 1e-12)


def test_rotations_about_axes_against_quaternions() -> None:
    expected = Rotation.from_rotvec(ANGLES[:, None] * AXES).apply(VECTORS)
    assert rotated(VECTORS, AXES, ANGLES) == pytest.approx(expected, abs=1e-14)
    turned = rotated_about_x(VECTORS, ANGLES)
    x = np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx(rotated(VECTORS, x, ANGLES), abs=1e-14)
    assert np.array_equal(turned[:, 0], VECTORS[:, 0])


@pytest.mark.parametrize("shape", [(3,), (1, 3), (7, 300, 3), (2000, 2), (0, 3)])
@pytest.mark.parametrize("by_columns", [False, True])
def test_lengths_are_numpys_to_the_bit(shape: tuple[int, ...], by_columns: bool) -> None:
    random = np.random.default_rng(5)
    vectors = random.normal(size=shape) * 10 ** random.uniform(-9, 9, size=shape)
    vectors = np.asfortranarray(vectors) if by_columns else vectors
    assert np.array_equal(norm(vectors), np.linalg.norm(vectors, axis=-1))


def on_spheroid(spheroid: Spheroid, points: np.ndarray) -> np.ndarray:
    """Zero on the spheroid: sum of the distances to its foci less its length."""
    major, minor = spheroid.semi_axes
    focus = np.sqrt(major**2 - minor**2) * spheroid.ellipsoid.axis
    total = norm(points - spheroid.centre - focus) + norm(points - spheroid.centre + focus)
    result: np.ndarray = total - 2 * major
    return result


@given(st.floats(0, 30), st.floats(-40, 60), st.integers(0, 2))
def test_sections_lie_on_plane_and_spheroid(offset: float, height: float, axis: int) -> None:
    spheroid, normal = Spheroid(ELLIPSOID, offset), np.eye(3)[axis]
    ellipse = spheroid.section(normal, height)
    points = ellipse.at(np.linspace(0, 6, 17))
    assert np.abs(points @ normal - height).max() < 1e-9
    assert np.abs(on_spheroid(spheroid, points)).max() < 1e-9
    assert ellipse.major @ ellipse.minor == pytest.approx(0, abs=1e-6)
    assert norm(ellipse.major) >= norm(ellipse.minor) - 1e-9


def test_a_plane_beyond_is_refused() -> None:
    with pytest.raises(ValueError, match="does not meet"):
        Spheroid(ELLIPSOID, 0.0).section(np.array([1.0, 0, 0]), 500.0)
    with pytest.raises(ValueError, match="does not meet"):
        Spheroid(ELLIPSOID, 0.0).crossing(500.0, 0.0)


def test_arc_goes_through_the_side_asked_for() -> None:
    spheroid = Spheroid(ELLIPSOID, 2.0)
    low, high = spheroid.crossing(5.0, 3.0)
    arc = spheroid.section(np.array([1.0, 0, 0]), 5.0).arc(low, high, np.array([5.0, 0, 1e6]))
    assert arc.at(np.array([0.0, 1.0])) == pytest.approx(np.stack([low, high]))
    assert (arc.at(np.linspace(0, 1, 50))[:, 2] >= 3 - 1e-9).all()
    steps = norm(np.diff(arc.by_length(np.linspace(0, 1, 40)), axis=0))
    assert np.ptp(steps) < 1e-2 * steps.mean()


@given(st.floats(0.5, 20), st.floats(0, 10))
def test_wall_between_spheroids(wall: float, inner: float) -> None:
    outer = wall_offset(ELLIPSOID, inner, wall)
    rng = np.random.default_rng(1)
    a, b = (
        Spheroid(ELLIPSOID, offset).from_sphere @ unit(rng.normal(size=(4000, 3))).T
        for offset in (inner, outer)
    )
    assert cKDTree(b.T).query(a.T)[0].min() >= wall - 1e-9
    # and no thicker than the elongation of the ellipsoid makes it anyway
    assert outer - inner <= 1.1 * wall


def test_smallest_spheroid_that_encloses_points() -> None:
    spheroid = Spheroid(ELLIPSOID, 7.5)
    rng = np.random.default_rng(2)
    points = spheroid.centre + unit(rng.normal(size=(50, 3))) @ spheroid.from_sphere
    inside = spheroid.centre + 0.9 * (points - spheroid.centre)
    assert enclosing_offset(ELLIPSOID, np.concatenate([inside, points])) == pytest.approx(7.5)


@given(cameras, st.integers(1, 12))
def test_poses_lie_on_the_ellipsoid_and_reflect_focus_to_focus(
    camera: tuple[float, float, float, float], n: int
) -> None:
    ellipsoid = Ellipsoid(np.array(camera[:3]), camera[3])
    u, _ = geodesic(n)
    apex, normal = ellipsoid.apices(u), ellipsoid.normals(u)
    to_pinhole = ellipsoid.pinhole - apex
    # The two distances to the foci add up to 2 a: the definition of the ellipsoid.
    total = norm(apex) + norm(to_pinhole)
    assert np.allclose(total, ellipsoid.camera_distance, rtol=1e-12)
    ray = unit(to_pinhole)
    reflected = -ray + 2 * dot(ray, normal)[:, None] * normal
    assert np.allclose(np.cross(reflected, -u), 0, atol=1e-9)
    assert np.allclose(norm(normal), 1)
    assert (dot(normal, apex - ellipsoid.pinhole / 2) < 0).all()  # inward


@given(cameras, st.floats(0.01, 3.1), st.floats(-3.1, 3.1))
def test_azimuth_is_the_right_handed_rotation_about_the_axis(
    camera: tuple[float, float, float, float], polar: float, azimuth: float
) -> None:
    ellipsoid = Ellipsoid(np.array(camera[:3]), camera[3])
    axis, zero, _ = ellipsoid.frame()
    at_zero = np.cos(polar) * axis + np.sin(polar) * zero
    u = Rotation.from_rotvec(azimuth * axis).apply(at_zero)[None]
    assert np.ravel(ellipsoid.polar_azimuth(u)) == pytest.approx([polar, azimuth], abs=1e-9)
