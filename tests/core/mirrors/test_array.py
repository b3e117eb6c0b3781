import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tbcad
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, numbered_directions
from tbcad.core.spec.errors import SpecError
from tests.mirror_arrays import mirror_array

SIZES = st.tuples(
    *(st.floats(60, 250), st.floats(-30, 30), st.floats(-250, -60)),
    *(st.floats(70, 160), st.floats(10, 60)),
)


def attempt(*settings: str) -> tuple[MirrorArray | None, str]:
    """Camera a's mirrors, or the message of the error."""
    try:
        return mirror_array(*settings), ""
    except SpecError as error:
        return None, str(error)


@pytest.mark.parametrize("n", [2, 3, 5, 8, 17, 24])
def test_traced_mirrors_all_see_the_target(n: int) -> None:
    array = mirror_array(f"n={n}")
    curved = array.mirrors.radius < 29.9999 * array.half_width
    assert array.coverage.min() > 60.6 - 0.01
    assert array.coverage[curved].max(initial=0) < 60.6 + 0.01
    assert (array.mirrors.radius > 0).all()
    assert np.isfinite(array.mirrors.radius).all()


def test_stretched_directions_are_those_of_the_mirrors() -> None:
    array = mirror_array("n=9", "stretch=[1.3, 1.1]")
    expected, _ = numbered_directions(9, (1.3, 1.1))
    assert np.array_equal(array.u, expected[: len(array)])
    assert array.coverage == pytest.approx(60.6, abs=0.01)
    plain = mirror_array("n=9")
    assert len(array) == len(plain)
    assert np.average(array.u[:, 2]) < np.average(plain.u[:, 2])


def test_each_mirror_has_a_margin_of_its_own() -> None:
    even = mirror_array("n=4", "margin_mm=0.5")
    own = np.random.default_rng(1).uniform(0.5, 3, len(even)).round(2)
    array = mirror_array("n=4", "margin_mm=0.5", f"own_margins_mm={own.tolist()}")
    curved = array.mirrors.radius < 29.9999 * array.half_width
    gap = array.coverage - (60 + own)
    assert gap[curved] == pytest.approx(0.0, abs=1e-3)
    assert gap.min() > -1e-3
    assert curved.sum() > len(even) / 2
    same = mirror_array("n=4", "margin_mm=0.2", f"own_margins_mm={[0.5] * len(even)}")
    assert (same.mirrors.radius == even.mirrors.radius).all()


def test_margins_of_other_mirrors_are_refused() -> None:
    _, message = attempt("n=4", "own_margins_mm=[1, 1]")
    assert "own_margins_mm has 2 margins" in message
    assert "49 mirrors" in message
    _, message = attempt("n=2", "margin_mm=2", "own_margins_mm=[2, 1.5]")
    assert "less than margin_mm 2" in message


def test_coat_is_an_offset_of_the_radius() -> None:
    bare, coated = mirror_array("n=8"), mirror_array("n=8", "coating_um=40")
    assert coated.mirrors.radius == pytest.approx(bare.mirrors.radius, rel=1e-12)
    m = len(coated)
    body = coated.modelled_cells.surfaces
    assert 1 / body.curvature[:m] == pytest.approx(coated.mirrors.radius - 0.04, rel=1e-12)
    assert body.centre[:m] == pytest.approx(coated.mirrors.centre, abs=1e-9)


def test_coat_thicker_than_a_mirror_is_refused() -> None:
    sizes = "camera_mm=[5, 0, -5]", "semi_minor_mm=6", "capture_diameter_mm=5"
    with pytest.raises(SpecError, match="coating_um"):
        mirror_array("n=18", "coating_um=500", *sizes)


def test_other_half_is_the_mirror_image(small_design: MirrorDesign) -> None:
    a, b = small_design.arrays
    flip = [-1, 1, 1]
    assert np.array_equal(a.u * flip, b.u)
    assert np.array_equal(a.mirrors.centre * flip, b.mirrors.centre)
    assert a.ids[6] == "a0007"
    assert b.ids[6] == "b0007"
    seam = a.u[:, 0] == 0
    assert np.array_equal(a.u[seam], b.u[seam])  # the same virtual camera
    assert np.array_equal(a.area, b.area)


def test_numbers_run_from_the_zenith_down() -> None:
    every, faces = numbered_directions(6)
    half_a = every[(every[:, 0] >= 0) & (every[:, 2] >= 0)]
    assert half_a[0] == pytest.approx([0, 0, 1])
    assert (np.diff(half_a[:, 2]) < 1e-8).all()
    assert np.linalg.det(every[faces]).min() > 0


def test_hopeless_targets_name_the_mirrors() -> None:
    """So long an ellipsoid leaves its outer spheres no radius at which they still meet."""
    sizes = "camera_mm=[174, 24, -243]", "semi_minor_mm=78", "capture_diameter_mm=36"
    with pytest.raises(SpecError, match=r"a\d{4} \(\d+\.\d+ of \d+\.\d+ mm\).*change optics\.n"):
        mirror_array("n=9", *sizes)


def test_mirrors_that_no_lens_takes_in_are_refused_before_their_radii_are_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Some hundred steps, each as long as a design of few mirrors."""
    monkeypatch.setattr("tbcad.core.mirrors.array.solve_radii", None)
    with pytest.raises(SpecError, match=r"no lens takes in all mirrors: .* have to be 180"):
        mirror_array("n=18", "camera_mm=[100, 0, -20]", "capture_diameter_mm=20")


def check_any_geometry(n: int, x: float, y: float, z: float, b: float, capture: float) -> None:
    """It reaches its target or says which mirror cannot."""
    place = f"n={n}", f"camera_mm=[{x}, {y}, {z}]", f"semi_minor_mm={b}"
    array, message = attempt(*place, f"capture_diameter_mm={capture}")
    if array is None:
        assert "\n" not in message
        assert re.search("change|make|bring", message)
        return
    assert array.coverage.min() > capture + 0.6 - 0.01
    assert (array.area > 0).all()


@settings(max_examples=5)
@given(n=st.integers(2, 4), sizes=SIZES)
def test_any_geometry(n: int, sizes: tuple[float, ...]) -> None:
    check_any_geometry(n, *sizes)


@pytest.mark.slow
@settings(max_examples=30)
@given(n=st.integers(2, 10), sizes=SIZES)
def test_any_geometry_of_more_mirrors(n: int, sizes: tuple[float, ...]) -> None:
    check_any_geometry(n, *sizes)


@pytest.mark.parametrize("settings", [(), ("radius_rule=flat", "name=plane")])
def test_notebooks_show_it(settings: tuple[str, ...]) -> None:
    text = tbcad.design(n=3, settings=settings)._repr_html_()
    tree = ET.fromstring(text)
    assert tree.findtext(".//caption") == ("plane" if settings else "turtleback")
    assert ("planar" in text) == bool(settings)
    assert not re.search("nan", text)
