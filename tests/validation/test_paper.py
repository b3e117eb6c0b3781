"""Figures of the paper (J. Imaging Sci. Technol. 66(6) 060406) and of the first measurements.

Where an exact figure differs from one measured first, the test states both.
"""

import numpy as np
import pytest

from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray, numbered_directions
from tbcad.core.mirrors.radii import half_angles
from tbcad.studies.paper import claimed
from tests.mirror_arrays import mirror_array

ELLIPSOID = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)


def camera_a(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions of camera a's mirrors and all directions."""
    every, _ = numbered_directions(n)
    return every[(every[:, 0] >= 0) & (every[:, 2] >= 0)], every


def test_numbers_of_virtual_cameras() -> None:
    """1657 (Table I); 847 a camera, the 37 on the seam counted for both."""
    half_a, every = camera_a(int(claimed("design_n")))
    assert (every[:, 2] >= 0).sum() == claimed("virtual_cameras")
    assert len(half_a) == 847
    assert (half_a[:, 0] == 0).sum() == 37


@pytest.mark.parametrize("n", [4, 18])
def test_flat_capture_diameter(n: int) -> None:
    """2 d sin(min theta_0): 21.0 and 4.6 mm measured; the paper has 21.2 and 4.8 (section 4.1).

    Within 5 per cent: no orientation and no order of subdivision gives the paper's pair exactly.
    """
    paper_mm = claimed(f"flat_capture_n{n}")
    half_a, every = camera_a(n)
    theta0 = half_angles(ELLIPSOID, half_a, every)
    diameter = 2 * ELLIPSOID.camera_distance * np.sin(theta0.min())
    assert diameter == pytest.approx(paper_mm, rel=0.05)


def test_traced_coverage_of_flat_mirrors_agrees_with_their_cones() -> None:
    """Two ways to one figure: minimum coverage of traced planar cells, and 2 d sin(theta_0).

    Measured on cells the shell's own borders count, seam and foot, not the neighbours beyond.
    """
    half = mirror_array("n=4", "radius_rule=flat")
    inner = (half.u[:, 0] > 0.4) & (half.u[:, 2] > 0.4)
    cone = 2 * ELLIPSOID.camera_distance * np.sin(half.theta0)
    assert half.coverage[inner] == pytest.approx(cone[inner], rel=1e-6)
    assert half.coverage.min() == pytest.approx(21.2, rel=0.05)


def test_largest_object_that_does_not_block() -> None:
    """62.0 mm at the zenith mirror; the paper: the limit is 60 mm (section 4.1).

    Ours is that of single rays at the apices; the paper states whole millimetres, and an object
    of its limit blocks nothing.
    """
    half_a, _ = camera_a(18)
    apex = ELLIPSOID.apices(half_a)
    toward = unit(ELLIPSOID.pinhole - apex)
    passing = norm(np.cross(apex, toward))
    assert dot(-apex, toward).min() > 0  # every ray comes nearest on its way
    assert 2 * passing.min() == pytest.approx(62.0, abs=0.05)
    assert claimed("occlusion_limit") <= 2 * passing.min() < 1.05 * claimed("occlusion_limit")
    assert half_a[passing.argmin()] == pytest.approx([0, 0, 1])


def test_angle_of_incidence() -> None:
    half_a, _ = camera_a(18)
    angle = np.degrees(np.arccos(dot(ELLIPSOID.normals(half_a), -half_a)))
    assert (round(angle.min()), round(angle.max())) == (16, 35)


def test_radii_by_equation_2() -> None:
    """8.00 ... 65.4 mm, strongly tied to the polar angle of 45 ... 135 degrees."""
    half = mirror_array("radius_rule=paper")
    radius = half.mirrors.radius
    assert radius.min() == pytest.approx(8.00, abs=0.005)
    assert radius.max() == pytest.approx(65.4, abs=0.06)
    assert np.degrees([half.polar.min(), half.polar.max()]) == pytest.approx([45, 135], abs=1)
    assert np.corrcoef(half.polar, np.log(radius))[0, 1] < -0.9


def test_equation_2_falls_short() -> None:
    """Exact coverage of eq. 2's radii: far from the 60 mm claimed.

    Measured before: 50.8 ... 64.3, median 53.6, 845 of 847 short. Exact here: 50.34 ... 66.22,
    median 53.05, 845 short. tests/core/optics/test_windows.py confirms the lower figures by brute
    force; the one per cent looks like the first measurement's sampling of the cells' edges. The
    largest is the mirror (1, 0, 0), whose coverage the foot plane's place decides.
    """
    coverage = mirror_array("radius_rule=paper").coverage
    assert (coverage < 60).sum() == 845
    assert coverage.min() == pytest.approx(50.34, abs=0.005)
    assert coverage.min() == pytest.approx(50.8, rel=0.01)
    assert np.median(coverage) == pytest.approx(53.05, abs=0.005)
    assert np.median(coverage) == pytest.approx(53.6, rel=0.011)
    assert coverage.max() == pytest.approx(66.22, abs=0.005)


def test_radii_that_reach_60_mm() -> None:
    """Before: 6.98 ... 68.4 mm, 0.88 of eq. 2. Exact here: 6.84 ... 67.11, 0.863."""
    half = mirror_array("margin_mm=0")
    assert half.coverage == pytest.approx(np.full(847, 60.0), abs=0.01)
    radius = half.mirrors.radius
    assert radius.min() == pytest.approx(6.98, rel=0.021)
    assert radius.max() == pytest.approx(68.4, rel=0.021)
    ratio = radius * mirror_array("radius_rule=paper").mirrors.curvature
    assert np.median(ratio) == pytest.approx(0.88, rel=0.021)


def test_graph_of_the_cells(paper_array: MirrorArray) -> None:
    """V - E + F = 1. Before: 1738 - 2584 + 847, with a corner split in two at 44 places."""
    arcs = paper_array.cells.arcs
    corners = len(np.unique(np.concatenate([arcs.start, arcs.end])))
    assert (corners, len(arcs), paper_array.cells.mirrors) == (1694, 2540, 847)
    assert corners - len(arcs) + 847 == 1


def test_number_of_equatorial_mirrors(paper_array: MirrorArray) -> None:
    """37 a camera, by Table I: it gives 1657 virtual cameras for n = 18, z = 0 included.

    The polyhedron has 10 n^2 + 2 = 3242 vertices and mirror symmetry in z = 0, so 2 * 1657 - 3242
    = 72 of them are on the equator. It is symmetric in x = 0, too, and as n is even the edges'
    middles (0, 1, 0) and (0, -1, 0) are vertices: two of the 72 are on the seam and count for
    both cameras, the other 70 are shared evenly.
    """
    on_equator = numbered_directions(18)[0][:, 2] == 0
    assert on_equator.sum() == 2 * 1657 - 3242 == 72
    equatorial = paper_array.u[paper_array.u[:, 2] == 0]
    assert (equatorial[:, 0] == 0).sum() == 2
    assert len(equatorial) == 70 // 2 + 2 == 37
