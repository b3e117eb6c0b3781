import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.windows import Windows, cell_windows, coverage_diameters
from tests.sphere_misses import sphere_miss_distances


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


def test_only_some(paper_array: MirrorArray, seen: Windows) -> None:
    kept = np.arange(len(paper_array)) % 7 == 0
    coverage = seen.only(kept).coverage(*own_spheres(paper_array))
    assert np.isinf(coverage[~kept]).all()
    assert (coverage[kept] == seen.coverage(*own_spheres(paper_array))[kept]).all()
