import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tbcad
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import (
    MirrorArray,
    MirrorDesign,
    closest_passage,
    design,
    numbered_directions,
    passing_distances,
)
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tests.mirror_arrays import mirror_array

SIZES = st.tuples(
    *(st.floats(60, 250), st.floats(-30, 30), st.floats(-250, -60)),
    *(st.floats(70, 160), st.floats(10, 60)),
)
NARROW = ("n=3", "camera_mm=[49.3, 0, -63]", "semi_minor_mm=37.5", "capture_diameter_mm=20")
STEPS = 401


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


def test_coat_is_an_offset_of_the_radius() -> None:
    bare, coated = mirror_array("n=8"), mirror_array("n=8", "coating_um=40")
    assert coated.mirrors.radius == pytest.approx(bare.mirrors.radius, rel=1e-12)
    m = len(coated)
    body = coated.modelled_cells.surfaces
    assert 1 / body.curvature[:m] == pytest.approx(coated.mirrors.radius - 0.04, rel=1e-12)
    assert body.centre[:m] == pytest.approx(coated.mirrors.centre, abs=1e-9)


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("n=4", "own_margins_mm=[1, 1]"), "own_margins_mm has 2 margins.* 49 mirrors"),
        (("n=2", "margin_mm=2", "own_margins_mm=[2, 1.5]"), "less than margin_mm 2"),
        (
            ("coating_um=500", "camera_mm=[5, 0, -5]", "semi_minor_mm=6", "capture_diameter_mm=5"),
            "coating_um",  # thicker than a mirror
        ),
        (  # so long an ellipsoid leaves its outer spheres no radius at which they still meet
            ("n=9", "camera_mm=[174, 24, -243]", "semi_minor_mm=78", "capture_diameter_mm=36"),
            r"a\d{4} \(\d+\.\d+ of \d+\.\d+ mm\).*change optics\.n",
        ),
    ],
)
def test_what_is_hopeless_is_refused(options: tuple[str, ...], message: str) -> None:
    assert re.search(message, attempt(*options)[1])


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


def clearance(*options: str) -> float:
    spec = load_spec(None, [*options])
    array, radius = design(spec).arrays[0], spec.optics.capture_diameter_mm / 2
    return closest_passage(array.cells, array.ellipsoid.pinhole, radius)[0] - radius


def test_one_line_with_cause_place_and_limit() -> None:
    message = attempt(*NARROW)[1]
    assert message.startswith("the object stands in its own light: on the way from mirror a0001 ")
    assert "passes 8.764 mm from the object's centre" in message
    assert "radius of 10 mm" in message
    assert message.isprintable()


@pytest.mark.parametrize(
    "options",
    [
        NARROW,
        ("n=4", "radius_rule=flat", "semi_minor_mm=96"),
        ("n=3", "camera_mm=[30.3, 0, -82.9]", "semi_minor_mm=82.1", "capture_diameter_mm=59.1"),
    ],
)
def test_the_sphere_that_is_named_is_not_in_the_light(options: tuple[str, ...]) -> None:
    size = re.search(r"capture_diameter_mm ([\d.]+) or less", attempt(*options)[1])
    assert size
    assert clearance(*options, f"capture_diameter_mm={size[1]}") >= 0


def brute_force(array: MirrorArray, i: int, capture: float, reach: float) -> float:
    """Smallest distance over a grid on mirror i, of rays that meet the capture sphere."""
    surfaces, pinhole = array.cells.surfaces, array.ellipsoid.pinhole
    normal, k = surfaces.normal[i], surfaces.curvature[i]
    first = unit(np.cross(normal, [0.1, 0.9, 0.3]))
    a, b = np.meshgrid(*2 * [np.linspace(-reach, reach, STEPS)])
    square = a**2 + b**2
    height = -k * square / (1 + np.sqrt(np.maximum(1 - k**2 * square, 0)))
    flat = a[..., None] * first + b[..., None] * np.cross(normal, first)
    point = surfaces.apex[i] + flat + height[..., None] * normal
    mirror_normal = surfaces.gradient(np.array(i), point)
    hidden = (k**2 * square > 1) | (dot(point - pinhole, mirror_normal) > 0)
    for j in range(len(surfaces)):
        hidden |= surfaces.value(np.array(j), point) < (-np.inf if j == i else -1e-9)
    ray = reflected_rays(pinhole, point, mirror_normal)
    used = ~hidden & (norm(np.cross(point, ray)) <= capture)
    way = np.linspace(0, 1, STEPS)[:, None, None] * (point[used] - pinhole) + pinhole
    return float(norm(way).min())


@pytest.mark.parametrize(
    "options",
    [
        ("camera_mm=[231.2, 0, -84.1]", "semi_minor_mm=53.8", "capture_diameter_mm=20"),
        ("radius_rule=flat",),
    ],
)
def test_against_brute_force(options: tuple[str, ...]) -> None:
    array = mirror_array("n=3", *options)
    capture = load_spec(None, [*options]).optics.capture_diameter_mm / 2
    distance, mirror = closest_passage(array.cells, array.ellipsoid.pinhole, capture)
    nearest = passing_distances(array.ellipsoid.pinhole, array.mirrors.apex).argsort()[:3]
    reach = 2.5 * array.half_width
    found = [brute_force(array, int(i), capture, reach[i]) for i in {mirror, *nearest}]
    # The grid's step is a hundredth of a mirror, and what it finds is never nearer than the truth.
    assert distance == pytest.approx(min(found), abs=0.02 * array.half_width[mirror])
    assert distance < min(found) + 1e-3


def test_the_paper_s_limit() -> None:
    """ "The limit is 60 mm": the object would block the zenith mirror's light from 62.0 mm on."""
    array = mirror_array("n=18", "capture_diameter_mm=62")
    distance, mirror = closest_passage(array.cells, array.ellipsoid.pinhole, 31)
    assert distance == pytest.approx(31.0, abs=0.02)
    assert array.u[mirror] == pytest.approx([0, 0, 1])
