import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.geodesic import geodesic, icosahedron, stretched


def test_icosahedron_is_regular_and_z_is_a_two_fold_axis() -> None:
    vertices, faces = icosahedron()
    sides = norm(vertices[faces] - vertices[np.roll(faces, -1, axis=1)])
    assert np.ptp(sides) < 1e-15
    turned = vertices * [-1, -1, 1]
    assert {tuple(v) for v in np.round(turned, 12)} == {tuple(v) for v in np.round(vertices, 12)}


@pytest.mark.parametrize("n", [*range(1, 7), 31, 60])
def test_counts_unit_length_and_topology(n: int) -> None:
    vertices, faces = geodesic(n)
    assert len(vertices) == 10 * n * n + 2
    assert len(faces) == 20 * n * n
    assert np.allclose(norm(vertices), 1, rtol=0, atol=1e-15)
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    directed = edges[:, 0] * len(vertices) + edges[:, 1]
    assert len(np.unique(directed)) == len(directed)
    assert np.array_equal(np.sort(directed), np.sort(edges[:, 1] * len(vertices) + edges[:, 0]))


@pytest.mark.parametrize("n", [1, 18])
def test_faces_look_outward_and_cover_the_sphere_once(n: int) -> None:
    vertices, faces = geodesic(n)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    triple = np.einsum("fx,fx->f", a, np.cross(b, c))
    assert triple.min() > 0
    # Van Oosterom and Strackee (1983): solid angle of a triangle seen from the centre.
    below = 1 + np.einsum("fx,fx->f", a, b) + np.einsum("fx,fx->f", b, c)
    solid_angle = 2 * np.arctan2(triple, below + np.einsum("fx,fx->f", c, a))
    assert solid_angle.sum() == pytest.approx(4 * np.pi, rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 5, 18])
def test_mirror_symmetry_in_every_coordinate_plane_is_exact_on_the_planes(n: int) -> None:
    vertices, _ = geodesic(n)
    rounded = {tuple(v) for v in np.round(vertices, 10) + 0.0}
    for axis in range(3):
        flipped = vertices.copy()
        flipped[:, axis] *= -1
        assert {tuple(v) for v in np.round(flipped, 10) + 0.0} == rounded
        size = np.abs(vertices[:, axis])
        assert not np.any((size > 0) & (size < 1e-6))


def test_stretched_directions_keep_planes_azimuth_and_follow_the_tangent() -> None:
    """With one factor s for x and y the tangent of the angle from the zenith grows by s."""
    u = geodesic(6)[0]
    v = stretched(u, 1.6, 1.6)
    assert np.allclose(norm(v), 1, rtol=0, atol=1e-15)
    assert np.array_equal(v == 0, u == 0)
    assert np.array_equal(np.sign(v), np.sign(u))
    assert np.allclose(np.arctan2(v[:, 1], v[:, 0]), np.arctan2(u[:, 1], u[:, 0]), atol=1e-12)
    assert np.allclose(
        np.hypot(v[:, 0], v[:, 1]) * u[:, 2], 1.6 * np.hypot(u[:, 0], u[:, 1]) * v[:, 2]
    )
    across = stretched(u, 2.0, 0.5)
    assert np.allclose(across[:, 0] * u[:, 1], 4 * u[:, 0] * across[:, 1])
