import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.conics import Ellipsoid, Spheroid, enclosing_offset, wall_offset
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.geodesic import geodesic

ELLIPSOID = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)
cameras = st.tuples(
    st.floats(20, 400), st.floats(-100, 100), st.floats(-400, -20), st.floats(20, 300)
)


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
