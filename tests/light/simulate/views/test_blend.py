"""Blends of several virtual cameras, against a search among all cameras and all of their pixels."""

import numpy as np
import pytest

from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.blend import CAMERAS, SIGMA_PX, blend_cameras
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import RayBundle
from tbcad.light.simulate.views.synthesis import nearby_rays, search_radius
from tbcad.types import Bools, Floats, Ints
from tests.light.simulate.views.test_nearest import targets_of

SIZE = (96, 72)


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
