"""A design whose object stands in its own light is refused, with sizes that work."""

import re

import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.clearance import closest_passage
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec

NARROW = ("n=3", "camera_mm=[49.3, 0, -63]", "semi_minor_mm=37.5", "capture_diameter_mm=20")


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
    [NARROW, ("n=4", "capture_diameter_mm=63"), ("n=4", "radius_rule=flat", "semi_minor_mm=96")],
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
    message = refusal(
        "n=3", "camera_mm=[30.3, 0, -82.9]", "semi_minor_mm=82.1", "capture_diameter_mm=59.1"
    )
    assert "semi_minor_mm" not in message
    size = re.search(r"make optics\.capture_diameter_mm ([\d.]+) or less \(tried\)$", message)
    assert size
    assert (
        clearance(
            "n=3",
            "camera_mm=[30.3, 0, -82.9]",
            "semi_minor_mm=82.1",
            f"capture_diameter_mm={size[1]}",
        )
        >= 0
    )
