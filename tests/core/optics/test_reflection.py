import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import miss_distances, reflected_rays, reflection_points
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
