"""Pixels' rays off the exact mirrors, against a search over all of them."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import design
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.rays import TracedRays, exact_tracer, pixel_directions
from tbcad.light.simulate.scene.reflector import Reflector, reflectors

Cameras = tuple[Reflector, Reflector]


def every_row(at: Reflector) -> TracedRays:
    return exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0))


def searched(at: Reflector, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First mirror, from 1, of rays (k, 3), and how far it is, by trying all of them.

    With the rows' own quadratic formula for sphere centres, not the one under test; no mirror
    where the point lies beyond seam or foot, or inside another sphere.
    """
    mirrors = at.mirrors
    to_centre = mirrors.centre - at.camera.pinhole
    along = way @ to_centre.T
    rest = mirrors.radius**2 - dot(to_centre, to_centre) + along**2
    reach = np.where((rest > 0) & (along > 0), along - np.sqrt(np.maximum(rest, 0)), np.inf)
    finite = np.where(np.isfinite(reach), reach, 0)
    x, z = (at.camera.pinhole[i] + finite * way[:, [i]] for i in (0, 2))
    reach[(at.side * x < 0) | (z < at.foot)] = np.inf
    first = reach.argmin(axis=1)
    t = reach[np.arange(len(way)), first]
    point = at.camera.pinhole + np.where(np.isfinite(t), t, 0)[:, None] * way
    away = [norm(point - centre) for centre in mirrors.centre]
    inside = np.stack(away, axis=1) < mirrors.radius - 1e-7
    there = np.isfinite(t) & ~inside.any(axis=1)
    return np.where(there, first + 1, 0), t


@pytest.mark.parametrize("camera", [0, 1])
def test_first_mirror_is_the_one_that_a_search_finds(cameras: Cameras, camera: int) -> None:
    at = cameras[camera]
    rays = every_row(at)
    way = unit(pixel_directions(at.camera, range(at.camera.height_px)))
    found, reach = searched(at, way.reshape(-1, 3))
    assert np.array_equal(rays.mirror.ravel(), found)
    on = found > 0
    assert norm(rays.origin.reshape(-1, 3)[on] - at.camera.pinhole) == pytest.approx(reach[on])


def points_in_cells(at: Reflector) -> tuple[np.ndarray, np.ndarray]:
    """Value of each pixel's point for its own surface, and the least for any surface."""
    rays = every_row(at)
    on = rays.mirror > 0
    points, owner = rays.origin[on], rays.mirror[on] - 1
    value = points @ at.mirrors.gradient_at_origin.T + at.mirrors.value_at_origin
    value += at.mirrors.curvature / 2 * dot(points, points)[:, None]
    return value[np.arange(len(owner)), owner], value.min(axis=1)


def test_nothing_is_seen_inside_the_wall_beyond_the_foot() -> None:
    """A wide lens sees rays that enter a mirror's sphere below the foot, where there is none."""
    settings = ["n=6", "hfov_deg=110", "width_px=416", "height_px=310"]
    own, least = points_in_cells(reflectors(design(load_spec(None, settings)))[0])
    assert np.abs(own).max() < 1e-9
    assert least.min() > -1e-9


def test_reflection_obeys_its_law(cameras: Cameras) -> None:
    """The angles to the normal are equal, and both rays and the normal lie in one plane."""
    at = cameras[1]
    rays = every_row(at)
    on = rays.mirror > 0
    point, out = rays.origin[on], rays.direction[on]
    normal = at.mirrors.gradient(rays.mirror[on] - 1, point)
    back = unit(at.camera.pinhole - point)
    assert norm(out) == pytest.approx(np.ones(len(out)))
    assert dot(out, normal) == pytest.approx(dot(back, normal), abs=1e-12)
    assert dot(np.cross(out, normal), back) == pytest.approx(np.zeros(len(out)), abs=1e-12)
    assert miss_distances(at.camera.pinhole, point, normal) == pytest.approx(
        norm(np.cross(point, out))
    )


def test_every_mirror_shows_the_whole_capture_sphere_of_its_record(cameras: Cameras) -> None:
    """Rays of the pixels on a cell's rim pass the sphere by: the design's own coverage."""
    at = cameras[0]
    rays = every_row(at)
    seen = np.bincount(rays.mirror[rays.meeting(30.0)], minlength=len(at) + 1)[1:]
    assert (seen > 0).all()
    # Where a neighbour's pixel is next, the ray must already have left the sphere, by a pixel's
    # width at most; at the seam and the foot no neighbour shows that.
    right = rays.mirror[:, 1:] != rays.mirror[:, :-1]
    both = right & (rays.mirror[:, 1:] > 0) & (rays.mirror[:, :-1] > 0)
    miss = norm(np.cross(rays.origin, rays.direction))
    step = np.abs(np.diff(miss, axis=1))[~right & (rays.mirror[:, 1:] > 0)].max()
    assert miss[:, 1:][both].min() > 30.0 - step
    assert miss[:, :-1][both].min() > 30.0 - step


def test_bands_and_shifts_are_parts_of_one_picture(cameras: Cameras) -> None:
    at = cameras[0]
    whole, trace = every_row(at), exact_tracer(at)
    part = trace(range(100, 140), (0.0, 0.0))
    assert np.array_equal(part.mirror, whole.mirror[100:140])
    assert np.array_equal(part.direction, whole.direction[100:140])
    shifted = trace(range(100, 140), (1.0, 2.0))
    assert np.array_equal(shifted.mirror[:-2, :-1], part.mirror[2:, 1:])


def test_planar_mirrors() -> None:
    at, _ = reflectors(
        design(load_spec(None, ["n=4", "radius_rule=flat", "width_px=208", "height_px=155"]))
    )
    rays = every_row(at)
    on = rays.mirror > 0
    assert set(np.unique(rays.mirror[on])) == set(range(1, len(at) + 1))
    # All rays off a planar mirror come from one point, the virtual camera d u.
    camera = at.u * 2 * np.hypot(100.0, np.sqrt(2) * 50)
    past = np.cross(rays.origin[on] - camera[rays.mirror[on] - 1], rays.direction[on])
    assert norm(past).max() < 1e-9


def test_pixels_of_points_undo_directions(cameras: Cameras) -> None:
    view = cameras[0].camera
    way = pixel_directions(view, range(5, 9))
    place = view.project(view.pinhole + 7 * way)
    assert place[..., 0] == pytest.approx(np.broadcast_to(np.arange(view.width_px), (4, 416)))
    assert place[:, 0, 1] == pytest.approx([5, 6, 7, 8])
