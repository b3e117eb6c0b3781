import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics import ball_light
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances, reflected_rays
from tbcad.core.optics.windows import (
    Windows,
    aimed,
    cell_windows,
    coverage_diameters,
    cut_positions,
    seam_gaps,
)
from tests.mirror_arrays import mirror_array
from tests.sphere_misses import sphere_miss_distances

PINHOLE = np.array([100.0, 0.0, -100.0])
CAPTURE = 30.0


@pytest.fixture(scope="module")
def seen(paper_array: MirrorArray) -> Windows:
    return cell_windows(paper_array.cells, paper_array.camera.pinhole)


def own_spheres(array: MirrorArray, angle: float = 0.0) -> tuple[np.ndarray, ...]:
    """Every mirror's own sphere, its window rotated about the vertical."""
    axis = np.broadcast_to([0.0, 0.0, 1.0], array.u.shape)
    mirrors = array.mirrors
    return mirrors.centre, mirrors.radius, axis, np.full(len(array), angle)


def test_own_spheres_cover_what_the_shell_covers(paper_array: MirrorArray, seen: Windows) -> None:
    expected = coverage_diameters(paper_array.cells, paper_array.camera.pinhole)
    assert seen.coverage(*own_spheres(paper_array)) == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("i", [0, 300])
def test_turned_windows_against_brute_force(
    paper_array: MirrorArray, seen: Windows, i: int
) -> None:
    """2001 points on every side, turned by another library."""
    angle = 0.004
    coverage = seen.coverage(*own_spheres(paper_array, angle))[i]
    arcs = seen.arc[seen.mirror == i]
    t = np.linspace(0, 1, 2001)
    points = [seen.cells.arcs.at(np.full(len(t), arc), t) for arc in arcs]
    ray = unit(np.concatenate(points) - seen.pinhole)
    ray = Rotation.from_rotvec([0, 0, angle]).apply(ray)
    mirrors = paper_array.mirrors
    miss = sphere_miss_distances(seen.pinhole, ray, mirrors.centre[i], np.array(mirrors.radius[i]))
    assert coverage == pytest.approx(2 * miss.min(), abs=1e-3)


def test_windows_hold_their_own_apex_and_not_the_next(
    paper_array: MirrorArray, seen: Windows
) -> None:
    direction = unit(paper_array.mirrors.apex - seen.pinhole)
    no_rotation = np.zeros(len(direction))
    assert seen.contains(direction, direction, no_rotation).all()
    assert not seen.contains(np.roll(direction, 60, axis=0), direction, no_rotation).any()


def brute_force_coverage(cells: Cells, pinhole: np.ndarray, i: int, reach: float) -> float:
    """Twice the smallest miss distance of rays over points of sphere i that another one covers.

    It looks at a grid of points and at every other surface, and knows nothing of arcs. A mirror
    halved by the seam must not be asked for.
    """
    surfaces = cells.surfaces
    normal, radius = surfaces.normal[i], surfaces.radius[i]
    first = unit(np.cross(normal, [0.1, 0.9, 0.3]))
    step = np.linspace(-reach, reach, 701)
    a, b = np.meshgrid(step, step)
    flat = a[..., None] * first + b[..., None] * np.cross(normal, first)
    point = surfaces.centre[i] + radius * unit(radius * normal + flat)
    away = norm(surfaces.apex[: cells.mirrors] - surfaces.apex[i])
    near = [*np.argsort(away)[1:25], *range(cells.mirrors, len(surfaces))]
    hidden = np.zeros(a.shape, dtype=bool)
    for j in near:
        hidden |= surfaces.value(np.array(j), point) < 0
    miss = miss_distances(pinhole, point, (point - surfaces.centre[i]) / radius)
    return 2 * float(miss[hidden].min())


def test_coverage_against_brute_force() -> None:
    array = mirror_array("radius_rule=paper")
    whole = np.flatnonzero(array.u[:, 0] > 0)
    extremes = whole[np.argsort(array.coverage[whole])[[0, 1, -1]]]
    for i in [*extremes, *whole[:: len(whole) // 3]]:
        brute_force = brute_force_coverage(array.cells, PINHOLE, i, 2.2 * array.half_width[i])
        # The grid's step is a third of a percent of its reach, and so is its error.
        assert brute_force == pytest.approx(array.coverage[i], rel=4e-3)


def test_a_mirror_is_aimed_at_a_point_of_the_x_axis() -> None:
    paper = mirror_array("n=6", "radius_rule=paper")
    wanted = np.linspace(0, 3, len(paper))
    turned = aimed(paper.mirrors, paper.ellipsoid.pinhole, wanted)
    ray = reflected_rays(paper.ellipsoid.pinhole, turned.apex, turned.normal)
    to_point = np.column_stack([-wanted, 0 * wanted, 0 * wanted]) - turned.apex
    along = to_point / np.linalg.norm(to_point, axis=1)[:, None]
    assert np.abs(ray - along).max() < 1e-12
    assert (turned.normal[0] == paper.mirrors.normal[0]).all()


def test_halves_overlap_by_the_margin() -> None:
    """Over the object and its margin each half sees half the margin beyond x = 0, no more."""
    traced = mirror_array("n=6")
    position = cut_positions(traced.cells, traced.ellipsoid.pinhole, 30.3)
    assert position[traced.cells.halved] == pytest.approx(-0.3, abs=1e-4)
    assert (position[~traced.cells.halved] == -np.inf).all()
    assert not seam_gaps(traced.cells, traced.ellipsoid.pinhole, 30.0).any()


def test_a_gap_counts_against_coverage() -> None:
    paper = mirror_array("n=6", "radius_rule=paper")
    gap = seam_gaps(paper.cells, paper.ellipsoid.pinhole, 30.0)
    halved = paper.cells.halved
    assert not gap[~halved].any()
    assert gap[halved].max() > 3
    wide = gap > 0
    assert (paper.coverage[wide] <= 60 - gap[wide]).all()


@pytest.fixture(scope="module")
def sampled(paper_array: MirrorArray) -> np.ndarray:
    """Some mirrors that are whole: those on the seam are aimed beyond it, balls are not."""
    return np.flatnonzero(~paper_array.cells.halved)[::60]


@pytest.fixture(scope="module")
def outline(paper_array: MirrorArray, sampled: np.ndarray) -> np.ndarray:
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[sampled])
    pinhole = norm(paper_array.camera.pinhole)
    return ball_light.used_outlines(at, paper_array.mirrors.radius[sampled], pinhole, CAPTURE)


def test_rays_off_the_outline_touch_the_capture_sphere(
    paper_array: MirrorArray, sampled: np.ndarray, outline: np.ndarray
) -> None:
    mirrors, azimuth = paper_array.mirrors, paper_array.azimuth[sampled]
    point = rotated_about_x(outline, azimuth[:, None]) @ paper_array.ellipsoid.frame()
    centre, radius = mirrors.centre[sampled][:, None], mirrors.radius[sampled][:, None]
    assert norm(point - centre) == pytest.approx(np.broadcast_to(radius, point.shape[:2]))
    miss = miss_distances(paper_array.camera.pinhole, point, unit(point - centre))
    assert miss == pytest.approx(CAPTURE, abs=1e-6)


def test_light_lies_in_its_hulls(
    paper_array: MirrorArray, sampled: np.ndarray, outline: np.ndarray
) -> None:
    """Rays over all of the part in use, by points along them."""
    pinhole = norm(paper_array.camera.pinhole)
    camera = np.array([pinhole, 0.0, 0.0])
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[sampled])
    radius = paper_array.mirrors.radius[sampled][:, None, None]
    centre = (at.apex - radius[:, 0] * at.normal)[:, None]
    to_object, to_camera = ball_light.light_hulls(outline, pinhole, CAPTURE)
    for share in (0.0, 0.4, 0.8, 1.0):
        inner = at.apex[:, None] + share * (outline - at.apex[:, None])
        point = centre + radius * unit(inner - centre)
        out = reflected_rays(camera, point, (point - centre) / radius)
        end = point - (point * out).sum(axis=-1, keepdims=True) * out
        for t in np.linspace(0, 1, 11):
            assert outside(to_camera, point + t * (camera - point)) < 1e-9
            assert outside(to_object, point + t * (end - point)) < 1e-9


def outside(cones: RoundCones, point: np.ndarray) -> float:
    """How far points (m, s, 3) lie outside their hull, by 2001 spheres of it."""
    flat = np.concatenate([cones.start, cones.end], axis=1)
    share = np.linspace(0, 1, 2001)[:, None]
    worst = -np.inf
    for (a, b, c, d), r, s, points in zip(
        flat, cones.start_radius, cones.end_radius, point, strict=True
    ):
        spine = np.concatenate([a + share * (c - a), b + share * (d - b), 0 * share], axis=1)
        gap = norm(points[:, None] - spine) - (r + share * (s - r))[:, 0]
        worst = max(worst, float(gap.min(axis=1).max()))
    return worst


def test_pixels_against_counting(paper_array: MirrorArray) -> None:
    """Rays through the centres of all pixels about a mirror that meet the capture sphere."""
    camera, mirrors, i = paper_array.camera, paper_array.mirrors, 400
    at = ball_light.ball_poses(paper_array.ellipsoid, paper_array.polar[[i]])
    outline = ball_light.used_outlines(at, mirrors.radius[[i]], norm(camera.pinhole), CAPTURE)
    frame = paper_array.ellipsoid.frame()
    pixels = ball_light.pixel_counts(camera, frame, outline, paper_array.azimuth[[i]])[0]
    size = 2 * camera.half_sizes[0] / camera.width_px / 4  # sixteen rays a pixel
    axes = np.stack([camera.right, np.cross(camera.forward, camera.right)])
    apex_ray = mirrors.apex[i] - camera.pinhole
    apex_image = axes @ apex_ray / (apex_ray @ camera.forward)
    x, y = np.meshgrid(*(centre + size * np.arange(-400, 401) for centre in apex_image))
    ray = unit(camera.forward + np.stack([x, y], axis=-1) @ axes)
    sphere = mirrors.centre[i], np.array(mirrors.radius[i])
    miss = sphere_miss_distances(camera.pinhole, ray, *sphere)
    assert pixels == pytest.approx((miss <= CAPTURE).sum() / 16, rel=2e-3)
