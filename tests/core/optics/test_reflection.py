import numpy as np
import pytest

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import miss_distances, reflected_rays
from tests.sphere_misses import sphere_miss_distances


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


def test_rays_find_their_points_on_the_spheres(paper_array: MirrorArray) -> None:
    """Points beside the apices, given and found again by the intersection with the sphere."""
    mirrors, pinhole = paper_array.mirrors, paper_array.camera.pinhole
    normal = unit(mirrors.normal + 0.01 * unit(np.random.default_rng(1).normal(size=(847, 3))))
    point = mirrors.centre + mirrors.radius[:, None] * normal
    ray = unit(point - pinhole)
    found = sphere_miss_distances(pinhole, ray, mirrors.centre, mirrors.radius)
    assert found == pytest.approx(miss_distances(pinhole, point, normal), abs=1e-9)


def test_rays_past_a_sphere_or_away_from_the_origin_miss_by_infinity() -> None:
    pinhole, radius = np.array([-50.0, 0.0, 0.0]), np.array(10.0)
    ray = unit(np.array([[1.0, 0.2, 0.0], [1.0, 0.0, 0.0]]))
    miss = sphere_miss_distances(pinhole, ray, np.array([100.0, 0.0, 0.0]), radius)
    assert miss[0] == np.inf
    assert miss[1] == 0
    before_the_origin = np.array([-20.0, 0.0, 0.0])
    assert sphere_miss_distances(pinhole, ray[1], before_the_origin, radius) == np.inf
