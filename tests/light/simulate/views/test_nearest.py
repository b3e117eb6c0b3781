"""The nearest captured ray, and blends of several cameras, against a search among all of them."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.blend import CAMERAS, SIGMA_PX, _of_rank, blend_cameras
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles, convergence_point
from tbcad.light.simulate.views.ray_bundle import RayBundle, TwoPlane, nearest_rays, two_plane_along
from tbcad.light.simulate.views.synthesis import Rays, nearby_rays, search_radius
from tbcad.types import Bools, Floats, Ints

CAPTURE_MM = 60.0
EXACT = 0.9995
SIZE = (96, 72)


def every_ray(source: LightField, name: str) -> np.ndarray:
    """Origins or directions of all captured rays."""
    frames = source.frames.values()
    return np.concatenate([frame.planes[name][frame.planes["mirror"] > 0] for frame in frames])


def targets_of(view: Camera) -> tuple[TwoPlane, Rays]:
    two_plane = two_plane_along(view.forward, view.right, CAPTURE_MM)
    way = view_directions(view).reshape(-1, 3)
    meets = np.linalg.norm(np.cross(view.pinhole, way), axis=1) < CAPTURE_MM / 2
    way = way[meets]
    return two_plane, (np.broadcast_to(view.pinhole, way.shape), way)


@given(
    azimuth=st.floats(-180, 180),
    elevation=st.floats(0, 90),
    distance=st.floats(60, 2000),
)
# Along the seam most rays end at the edge of a mirror, whose halves must not hide nearer ones.
@example(azimuth=92, elevation=40, distance=120)
@example(azimuth=-90, elevation=40, distance=120)
@settings(max_examples=6)
def test_equals_a_k_d_tree_over_all_rays(
    light_field: LightField, tiles: MirrorTiles, azimuth: float, elevation: float, distance: float
) -> None:
    """Share of a view's rays whose nearest captured ray, if within the limit, is found."""
    view = camera_around_object(
        np.radians(azimuth), np.radians(elevation), distance, CAPTURE_MM, (160, 120)
    )
    two_plane, rays = targets_of(view)
    targets = two_plane.coordinates(*rays)
    captured = (every_ray(light_field, name) for name in ("origin", "direction"))
    points = two_plane.coordinates(*captured)
    nearest, _ = cKDTree(points[~np.isnan(points[:, 0])]).query(targets)
    bundle = nearby_rays(tiles, two_plane, rays, search_radius(tiles))
    assert bundle is not None
    found = nearest_rays(bundle, targets)
    found_distance = np.linalg.norm(bundle.points[found] - targets, axis=1)
    exact = found_distance <= nearest * (1 + 1e-9)
    beyond = nearest > bundle.limit
    assert (found[beyond] < 0).all()
    # The descent may end beside the nearest where a mirror's pixels have a notch: 2 of the
    # 2,950,000 rays of a grid of 288 views.
    assert np.where(beyond, True, exact & (found >= 0)).mean() > EXACT


def test_distance_in_two_plane_coordinates_is_that_of_the_rays_in_the_capture_sphere() -> None:
    """Root mean square over the depth -R ... R, by quadrature."""
    rng = np.random.default_rng(4)
    two_plane = two_plane_along(np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]), CAPTURE_MM)
    origin = rng.normal(size=(2, 3)) * [20, 20, 5] + [0, 0, 100]
    way = rng.normal(size=(2, 3)) * [0.2, 0.2, 0] + [0, 0, -1]
    assert np.isnan(two_plane.coordinates(origin, np.array([[1.0, 0, 0], [0, 0, 1]]))).all()
    a, b = two_plane.coordinates(origin, way / np.linalg.norm(way, axis=1)[:, None])
    z = np.linspace(-30, 30, 20001)
    at = [o[:2] + ((o[2] - z) / -w[2])[:, None] * w[:2] for o, w in zip(origin, way, strict=True)]
    apart = ((at[0] - at[1]) ** 2).sum(axis=1)
    assert np.linalg.norm(a - b) == pytest.approx(np.sqrt(np.trapezoid(apart, z) / 60), rel=1e-6)


def test_convergence_point_of_rays() -> None:
    """Rays through one point meet there; parallel ones anywhere along, at their spread."""
    rng = np.random.default_rng(1)
    way = rng.normal(size=(50, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    point, spread = convergence_point(np.array([1.0, 2, 3]) + 5 * way, way)
    assert point == pytest.approx([1, 2, 3])
    assert spread == pytest.approx(0, abs=1e-6)
    sides = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    point, spread = convergence_point(sides, np.array([[0.0, 0, 1], [0, 0, 1]]))
    assert point == pytest.approx([0, 0, 0])
    assert spread == pytest.approx(1)


def bundle_and_targets(
    tiles: MirrorTiles, azimuth: float, elevation: float
) -> tuple[RayBundle, Floats]:
    place = np.radians(azimuth), np.radians(elevation)
    view = camera_around_object(*place, 640.0, 60.0, SIZE)
    two_plane, rays = targets_of(view)
    bundle = nearby_rays(tiles, two_plane, rays, search_radius(tiles))
    assert bundle is not None
    return bundle, two_plane.coordinates(*rays)


def depths(targets: Floats, kind: str) -> Floats:
    """Surfaces: a plane, a smooth one, and one with edges from each target to the next."""
    if kind == "plane":
        return np.full(len(targets), -0.3)
    if kind == "bumps":
        return np.asarray(np.sin(targets[:, 0] / 4) * np.cos(targets[:, 1] / 5))
    return np.random.default_rng(5).uniform(-1, 1, len(targets))


def searched(bundle: RayBundle, target: Floats, depth: float) -> Floats:
    """Colour and total weight of one target, (4,), by its definition."""
    point = target[:2] + depth * target[2:]
    ahead = depth - bundle.pinholes[:, 2]
    usable = (bundle.tiles[:, 3] >= 0) & (ahead > 0)
    deviation = np.linalg.norm(
        (point - bundle.pinholes[:, :2]) / ahead[:, None] - target[2:], axis=1
    )
    deviation = np.where(usable, deviation, np.inf)
    order = np.argsort(deviation, kind="stable")[: CAMERAS + 1]
    total = np.zeros(4)
    for k in order[:-1]:
        weight = 1 - deviation[k] / deviation[order[-1]]
        total += weight * pixels_of(bundle, bundle.tiles[k], point, depth)
    return np.append(total[:3] / total[3], total[3])


def pixels_of(bundle: RayBundle, tile: Ints, point: Floats, depth: float) -> Floats:
    """The sum (4,) of the pixel nearest to a point, of all of a mirror's, and of its neighbours."""
    first, height, width, _ = tile
    rays = bundle.points[first : first + height * width]
    places = rays[:, :2] + depth * rays[:, 2:]
    distance = np.linalg.norm(places - point, axis=1)
    pixel = int(np.nanargmin(distance))
    if distance[pixel] > bundle.limit:
        return np.zeros(4)
    beside = pixel + np.array([-1, 1, -width, width])
    pitch2 = np.nanmean(((places[beside] - places[pixel]) ** 2).sum(axis=1))
    around = pixel + np.add.outer([-width, 0, width], [-1, 0, 1]).ravel()
    share = np.nan_to_num(np.exp(-(distance[around] ** 2) / (2 * SIGMA_PX**2 * pitch2)))
    return np.append(share @ bundle.colour[first + around], share.sum())


@pytest.mark.parametrize(
    ("azimuth", "elevation", "kind"),
    [(20.0, 25.0, "plane"), (90.0, 60.0, "bumps"), (20.0, 25.0, "edges")],
)
def test_equals_a_search_among_all_pixels(
    tiles: MirrorTiles, azimuth: float, elevation: float, kind: str
) -> None:
    """But for pixels far from the point, and the width of the bell curve, found a pixel beside."""
    bundle, targets = bundle_and_targets(tiles, azimuth, elevation)
    depth = depths(targets, kind)
    colour, seen = blend_cameras(bundle, targets, depth)
    some = np.random.default_rng(8).choice(len(targets), 400, replace=False)
    expected = np.array([searched(bundle, targets[i], depth[i]) for i in some])
    assert seen[some].tolist() == (expected[:, 3] > 0).tolist()
    differ = np.abs(colour[some] - expected[:, :3]).max(axis=1)
    assert differ.mean() < 0.25
    assert differ.max() < 6


def test_a_surface_behind_all_cameras_is_not_seen(tiles: MirrorTiles) -> None:
    bundle, targets = bundle_and_targets(tiles, 0.0, 45.0)
    behind = np.full(len(targets), 2 * bundle.pinholes[:, 2].min())
    seen: Bools = blend_cameras(bundle, targets, behind)[1]
    assert not seen.any()


@pytest.mark.parametrize("count", [1, CAMERAS, CAMERAS + 1, 40])
def test_a_value_by_its_rank_is_that_of_numpy(count: int) -> None:
    """With equal values and infinite ones."""
    values = np.random.default_rng(count).integers(0, 9, count).astype(float)
    values[values > 7] = np.inf
    expected = np.partition(values, CAMERAS)[CAMERAS] if count > CAMERAS else np.inf
    assert _of_rank(values, CAMERAS) == expected
