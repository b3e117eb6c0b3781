"""A design whose object stands in its own light is refused, with sizes that work."""

import re

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.mirrors.clearance import closest_passage, passing_distances
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tests.mirror_arrays import mirror_array

NARROW = ("n=3", "camera_mm=[49.3, 0, -63]", "semi_minor_mm=37.5", "capture_diameter_mm=20")
STEPS = 401


def refusal(*options: str) -> str:
    with pytest.raises(SpecError) as caught:
        design(load_spec(None, [*options]))
    return str(caught.value)


def clearance(*options: str) -> float:
    spec = load_spec(None, [*options])
    array, radius = design(spec).arrays[0], spec.optics.capture_diameter_mm / 2
    return closest_passage(array.cells, array.ellipsoid.pinhole, radius)[0] - radius


def test_one_line_with_cause_place_and_limit() -> None:
    message = refusal(*NARROW)
    assert message.startswith("the object stands in its own light: on the way from mirror a0001 ")
    assert "passes 8.764 mm from the object's centre" in message
    assert "radius of 10 mm" in message
    assert message.isprintable()


@pytest.mark.parametrize(
    "options",
    [NARROW, ("n=4", "radius_rule=flat", "semi_minor_mm=96")],
)
def test_both_remedies_work_and_no_less_does(options: tuple[str, ...]) -> None:
    message = refusal(*options)
    remedies = re.findall(r"optics\.(\w+) ([\d.]+) or (less|more)", message)
    assert [key for key, *_ in remedies] == ["capture_diameter_mm", "semi_minor_mm"]
    assert message.endswith("(both tried)")
    for key, size, which in remedies:
        assert 0 <= clearance(*options, f"{key}={size}") < 0.2
        worse = float(size) * (1.02 if which == "less" else 0.98)
        assert "own light" in refusal(*options, f"{key}={worse:.2f}")


def test_no_ellipsoid_is_wide_enough_for_a_camera_so_close() -> None:
    close = "n=3", "camera_mm=[30.3, 0, -82.9]", "semi_minor_mm=82.1"
    message = refusal(*close, "capture_diameter_mm=59.1")
    assert "semi_minor_mm" not in message
    size = re.search(r"make optics\.capture_diameter_mm ([\d.]+) or less \(tried\)$", message)
    assert size
    assert clearance(*close, f"capture_diameter_mm={size[1]}") >= 0


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
