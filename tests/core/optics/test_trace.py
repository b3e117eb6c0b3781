import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.windows import coverage_diameters, parabola_minima, samples_about_minima
from tests.mirror_arrays import mirror_array

PINHOLE = np.array([100.0, 0.0, -100.0])


def test_minimum_of_a_parabola_is_exact_between_samples() -> None:
    vertex = np.array([[0.43], [0.07], [0.99]])
    values = 3.0 + 7.0 * (np.linspace(0, 1, 9) - vertex) ** 2
    assert parabola_minima(values[:2]) == pytest.approx(3.0, rel=1e-14)
    assert parabola_minima(values[2:])[0] == values[2, -1]  # the smallest sample is the last


def test_rounds_of_samples_close_in_on_the_minimum() -> None:
    centre = np.array([[0.317], [0.0], [1.0]])
    samples = samples_about_minima(lambda t: np.abs(t - centre), 3, rounds=4)
    assert samples.min(axis=1) == pytest.approx(0.0, abs=1 / 512)


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


@pytest.mark.parametrize("rule", ["paper", "traced"])
def test_coverage_against_brute_force(rule: str) -> None:
    array = mirror_array(f"radius_rule={rule}")
    whole = np.flatnonzero(array.u[:, 0] > 0)
    extremes = whole[np.argsort(array.coverage[whole])[[0, 1, -1]]]
    for i in [*extremes, *whole[:: len(whole) // 6]]:
        brute_force = brute_force_coverage(array.cells, PINHOLE, i, 2.2 * array.half_width[i])
        # The grid's step is a third of a percent of its reach, and so is its error.
        assert brute_force == pytest.approx(array.coverage[i], rel=4e-3)


def test_the_seam_does_not_limit_halved_mirrors(paper_array: MirrorArray) -> None:
    """With the cut counted a halved mirror would see nothing: its apex lies on the cut."""
    halved = paper_array.u[:, 0] == 0
    assert halved.sum() == 37
    assert coverage_diameters(paper_array.cells, PINHOLE)[halved].min() > 60


def test_smaller_radius_sees_more(paper_array: MirrorArray) -> None:
    cells = paper_array.cells
    before = coverage_diameters(cells, PINHOLE)
    finer = Cells(
        cells.surfaces.with_curvature(1.01 * cells.surfaces.curvature),
        cells.triangles,
        cells.corners,
    )
    assert (coverage_diameters(finer, PINHOLE) > before).all()
