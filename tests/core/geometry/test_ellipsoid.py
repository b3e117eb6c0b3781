import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.geodesic import geodesic

cameras = st.tuples(
    st.floats(20, 400), st.floats(-100, 100), st.floats(-400, -20), st.floats(20, 300)
)


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


@given(cameras)
def test_normals_are_the_gradient_of_the_ellipsoid_inward(
    camera: tuple[float, float, float, float],
) -> None:
    ellipsoid = Ellipsoid(np.array(camera[:3]), camera[3])
    u, _ = geodesic(3)
    away = ellipsoid.apices(u) - ellipsoid.pinhole / 2
    along = dot(away, ellipsoid.axis)[:, None] * ellipsoid.axis
    gradient = along / ellipsoid.semi_major**2 + (away - along) / ellipsoid.semi_minor**2
    assert np.allclose(unit(gradient), -ellipsoid.normals(u), atol=1e-9)


def test_figures_of_the_paper() -> None:
    ellipsoid = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)
    assert ellipsoid.semi_major == pytest.approx(122.474, abs=5e-4)  # DESIGN.md section 2
    assert ellipsoid.camera_distance == pytest.approx(244.949, abs=5e-4)


def test_polar_angle_and_azimuth() -> None:
    ellipsoid = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)
    u = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0], [0, -1.0, 0]])
    polar, azimuth = np.degrees(ellipsoid.polar_azimuth(u))
    assert polar == pytest.approx([45, 135, 90, 90])
    # Counter-clockwise seen against the axis, which runs down to +x: from the zenith to -y.
    assert azimuth == pytest.approx([0, 0, -90, 90])


@given(cameras, st.floats(0.01, 3.1), st.floats(-3.1, 3.1))
def test_azimuth_is_the_right_handed_rotation_about_the_axis(
    camera: tuple[float, float, float, float], polar: float, azimuth: float
) -> None:
    ellipsoid = Ellipsoid(np.array(camera[:3]), camera[3])
    axis, zero, _ = ellipsoid.frame()
    at_zero = np.cos(polar) * axis + np.sin(polar) * zero
    u = Rotation.from_rotvec(azimuth * axis).apply(at_zero)[None]
    assert np.ravel(ellipsoid.polar_azimuth(u)) == pytest.approx([polar, azimuth], abs=1e-9)
