"""What the paper (J. Imaging Sci. Technol. 66(6) 060406) states, and first measurements, anew.

The paper's figures are read from tbcad.studies.paper, each with its place. Where an exact figure
differs from one measured first, the test states both.
"""

from pathlib import Path

import numpy as np
import pytest

from tbcad.common.results import Study
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray, numbered_directions
from tbcad.core.mirrors.radii import half_angles
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.views.refocus import lens_pinholes
from tbcad.studies.depth_of_field import LensOptions, depth_of_field
from tbcad.studies.elevation import elevation
from tbcad.studies.paper import (
    BalancedSensor,
    balanced_sensors,
    claimed,
    claims,
    is_table_i,
)
from tbcad.studies.resolution import PITCH_DEG, apices_in_frame, disc_pixels
from tests.mirror_arrays import mirror_array

ELLIPSOID = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0)
ROWS = balanced_sensors()
PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"


def all_directions(n: int) -> np.ndarray:
    return numbered_directions(n)[0]


def camera_a(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions of camera a's mirrors and all directions."""
    every = all_directions(n)
    return every[(every[:, 0] >= 0) & (every[:, 2] >= 0)], every


@pytest.fixture(scope="module")
def angles() -> Study:
    return elevation(load_spec(None))


# Table I


def test_default_design_is_that_of_table_i() -> None:
    spec = load_spec(None)
    assert is_table_i(spec)
    assert spec.optics.n == claimed("design_n")
    assert spec.camera.width_px == claimed("width_px")
    assert spec.camera.height_px == claimed("height_px")


def test_short_axis_is_the_semi_minor_one() -> None:
    """As a whole axis, b = 50 mm, mirrors would be 18.3 mm from the centre, inside the object."""
    pinhole = np.array([claimed("camera_x"), 0.0, claimed("camera_z")])
    nearest = [
        Ellipsoid(pinhole, b).radial_distance(camera_a(18)[0]).min()
        for b in (claimed("short_axis") / 2, claimed("short_axis"))
    ]
    radius = claimed("capture_diameter") / 2
    assert nearest[0] == pytest.approx(18.3, abs=0.05)
    assert nearest[0] < radius < nearest[1]


# Table II


def test_second_column_of_table_ii_is_a_number_of_mirrors() -> None:
    """Mirrors of both arrays whose apex is in the frame, at one pitch for all four rows.

    764, 1688, 3472 and 6602: three exact, 3474 off by one pair of mirrors, which is the smallest
    step of the count. One angle is fitted to four numbers.
    """
    spec, pitches = load_spec(None), np.arange(-30.0, 60.0, 0.25)
    paper = np.array([row.average_of_virtual_camera_resolution for row in ROWS])
    tried = [[apices_in_frame(spec, row.n, pitch) for row in ROWS] for pitch in pitches.tolist()]
    off = np.abs(np.array(tried) - paper).sum(axis=1)
    assert pitches[off == off.min()] == pytest.approx(PITCH_DEG, abs=0.25)
    count = np.array([apices_in_frame(spec, row.n) for row in ROWS])
    assert (count - paper).tolist() == [0, 0, -2, 0]
    every = np.array([2 * len(camera_a(row.n)[0]) for row in ROWS])
    assert (every > paper).all()
    assert (every < 1.01 * paper).all()


def test_first_column_of_table_ii_is_no_number_of_mirrors() -> None:
    """A number of mirrors rises as 5 n^2 + c n with one c; for the first column c is -9 ... 10.

    For the second c is 3.4 ... 3.8.
    """
    c = np.array([[(value - 5 * row.n**2) / row.n for value in row.printed] for row in ROWS])
    assert c[:, 0].min() < -9
    assert c[:, 0].max() > 10
    assert np.ptp(c[:, 1]) < 0.5


@pytest.mark.parametrize(
    "rows", [ROWS[:1], pytest.param(ROWS, marks=pytest.mark.slow)], ids=["smallest", "all"]
)
def test_first_column_of_table_ii_is_a_number_of_pixels(rows: tuple[BalancedSensor, ...]) -> None:
    """Pixels of the disc that fits in each mirror and see the object, with the paper's radii.

    The smallest sensor has the largest pixels: 883 against 844, 4.6 per cent. All four are within
    2.5 per cent, root mean square.
    """
    share = [disc_pixels(load_spec(None), row) / row.number_of_virtual_camera for row in rows]
    off = np.array(share) - 1
    assert off[0] == pytest.approx(0.046, abs=0.001)
    if len(rows) > 1:
        assert np.sqrt((off**2).mean()) == pytest.approx(0.025, abs=0.001)


# Section 1 and 4.1


def test_planar_array_of_mukaigawa() -> None:
    """50 virtual cameras (section 1); n = 4 gives 49 to one array (section 4.1)."""
    assert len(camera_a(int(claimed("planar_n")))[0]) == claimed("planar_cameras") - 1


def test_more_viewpoints_than_the_display_needs() -> None:
    assert claimed("virtual_cameras") > claimed("display_viewpoints")
    assert (all_directions(18)[:, 2] >= 0).sum() > claimed("display_viewpoints")


# Sections 4.2, 5.1, 6: what follows the angles


def test_pixels_fall_with_elevation(angles: Study) -> None:
    """Fig. 7b: fewer pixels the higher a mirror; smaller, and farther from the camera."""
    bands = angles.tables[1]
    assert (np.diff(bands.numbers("mean_seeing_px")) < 0).all()
    assert (np.diff(bands.numbers("mean_area_mm2")) < 0).all()
    assert (np.diff(bands.numbers("mean_to_camera_mm")) > 0).all()


def test_mirrors_near_the_object_are_small(angles: Study) -> None:
    """Section 6, and that pixels are uneven: 31 times between the fewest and the most."""
    areas = angles.tables[2].where(of="area")
    (row,) = areas.where(**{"with": "distance from the object"}).records()
    assert float(row["correlation"]) > 0.9  # type: ignore[arg-type]
    pixels = angles.tables[0].numbers("seeing_px")
    assert pixels.max() / pixels.min() > 10


# Section 4.3


def test_pinholes_of_the_synthetic_aperture() -> None:
    """69 (Fig. 8); the aperture is larger than the object (section 7)."""
    assert len(lens_pinholes()) == claimed("refocus_pinholes")
    assert claimed("refocus_aperture") > claimed("capture_diameter")


# Section 6


@pytest.fixture(scope="module")
def depths() -> dict[str, float]:
    with pytest.MonkeyPatch.context() as patch:  # pupils count pixels: tests/studies/test_files.py
        patch.setattr("tbcad.studies.depth_of_field.default_sensors", lambda _: ())
        study = depth_of_field(load_spec(None), LensOptions())
    return {f.quantity: f.value for f in study.figures if isinstance(f.value, float)}


def test_flat_mirrors_keep_the_images_at_one_distance(depths: dict[str, float]) -> None:
    """Rounding only: both distances to a point of the ellipse sum to 2 a."""
    assert depths["camera to images of the centre, flat radii: farthest less nearest"] < 1e-9


def test_convex_mirrors_need_more_depth_of_field(depths: dict[str, float]) -> None:
    """Images closer to the mirrors, at many distances: 2.6 times the range, in dioptres."""
    assert depths["1/near - 1/far of traced radii over flat, distances"] > 2
    far = depths["camera to farthest image, traced radii"]
    assert far < depths["camera to nearest image, flat radii"]


def test_range_of_distances_cannot_be_that_of_table_i(
    paper_array: MirrorArray, depths: dict[str, float]
) -> None:
    """150 ... 250 mm (section 6): no mirror is farther than 187 mm, its image 4 mm more.

    The images of the flat mirrors' centres are the only ones near the upper end, at 2 a = 245 mm.
    """
    to_mirror = norm(paper_array.mirrors.apex - paper_array.camera.pinhole)
    assert to_mirror.max() < 190 < claimed("depth_far")
    assert depths["camera to farthest image, traced radii"] - to_mirror.max() < 5
    assert 2 * paper_array.ellipsoid.semi_major == pytest.approx(claimed("depth_far"), rel=0.025)
    assert depths["camera to nearest image, traced radii"] < claimed("depth_near")


# First measurements


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


# The page


def page_rows() -> list[list[str]]:
    lines = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line[:2] == "| "]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("key", sorted(claims()))
def test_page_has_every_claim(key: str) -> None:
    """One row at least with the claim's place and its figure."""
    claim = claims()[key]
    wanted = f"{claim.value:g}"
    rows = [row for row in page_rows() if len(row) > 2 and claim.where in row[1]]
    assert any(wanted in row[2].replace(",", "") for row in rows), (claim.where, wanted)
