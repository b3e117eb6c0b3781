import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
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


@pytest.fixture(scope="module")
def traced() -> MirrorArray:
    return mirror_array("n=6")


@pytest.fixture(scope="module")
def paper() -> MirrorArray:
    return mirror_array("n=6", "radius_rule=paper")


def test_a_mirror_is_aimed_at_a_point_of_the_x_axis(paper: MirrorArray) -> None:
    wanted = np.linspace(0, 3, len(paper))
    turned = aimed(paper.mirrors, paper.ellipsoid.pinhole, wanted)
    ray = reflected_rays(paper.ellipsoid.pinhole, turned.apex, turned.normal)
    to_point = np.column_stack([-wanted, 0 * wanted, 0 * wanted]) - turned.apex
    along = to_point / np.linalg.norm(to_point, axis=1)[:, None]
    assert np.abs(ray - along).max() < 1e-12
    assert (turned.normal[0] == paper.mirrors.normal[0]).all()


def test_halves_overlap_by_the_margin(traced: MirrorArray) -> None:
    """Over the object and its margin each half sees half the margin beyond x = 0, no more."""
    position = cut_positions(traced.cells, traced.ellipsoid.pinhole, 30.3)
    assert position[traced.cells.halved] == pytest.approx(-0.3, abs=1e-4)
    assert (position[~traced.cells.halved] == -np.inf).all()
    assert not seam_gaps(traced.cells, traced.ellipsoid.pinhole, 30.0).any()


def test_a_gap_counts_against_coverage(paper: MirrorArray) -> None:
    gap = seam_gaps(paper.cells, paper.ellipsoid.pinhole, 30.0)
    halved = paper.cells.halved
    assert not gap[~halved].any()
    assert gap[halved].max() > 3
    wide = gap > 0
    assert (paper.coverage[wide] <= 60 - gap[wide]).all()
