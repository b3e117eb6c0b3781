"""Designs of many sizes are built and verified, or refused in one line that is right."""

import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import tbcad
from tbcad.errors import InputError
from tbcad.output.overview import overview

MESSAGE = 600  # characters of a line that says why something cannot be made

pytestmark = pytest.mark.designs


@pytest.mark.parametrize("n", [3, 5, 7, 11, 13, 22, 31, 36])
def test_subdivisions(n: int, tmp_path: Path) -> None:
    built = tbcad.build(tbcad.load_spec(None, [f"n={n}"]), tmp_path / "exports")
    assert built.report is not None
    assert built.passed, built.report
    assert (built.parts, built.note) == (("shell", "prototype"), "")


@st.composite
def optics(draw: st.DrawFn) -> list[str]:
    """A camera, a capture sphere and an ellipsoid round it, at n = 3."""
    distance = draw(st.floats(80, 250))
    polar = math.radians(draw(st.floats(110, 160)))
    camera = [distance * math.sin(polar), 0.0, distance * math.cos(polar)]
    diameter = draw(st.floats(20, 80))
    # The sphere fits the ellipsoid: its focus is this far inside.
    smallest = math.sqrt(diameter**2 / 4 + diameter * distance / 2)
    minor = smallest * draw(st.floats(1.05, 2.5))
    assume(minor < 400)
    numbers = [f"camera_mm={[round(x, 1) for x in camera]}", f"semi_minor_mm={minor:.1f}"]
    return ["n=3", f"capture_diameter_mm={diameter:.1f}", *numbers]


@pytest.mark.xfail(
    strict=True,
    reason="the verification takes two mirrors for one where they meet smoothly (camera_mm = "
    "[231.2, 0, -84.1], semi_minor_mm = 53.8, capture_diameter_mm = 20), and finds two mirrors too "
    "many in a few coarse shells ([61.3, 0, -51.4], 82.6, 35)",
)
@given(options=optics())
@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_any_optics(options: list[str], tmp_path: Path) -> None:
    """Shells are built and verified, and the prototype is laid out or left out with its reason.

    What cannot be made is refused in one line. Where the object stands in the light, which the
    shape of an ellipsoid that is narrow for it cannot avoid, the verification says so.
    """
    message = ""
    try:
        spec = tbcad.load_spec(None, options)
        built = tbcad.build(spec, tmp_path / "exports", parts=["shell"], force=True)
        message = overview(built.design, optional_prototype=True).note
    except InputError as error:
        message = str(error)
    else:
        assert built.report is not None
        failed = {check.name for check in built.report.checks if check.passed is not True}
        assert failed - {"object clearance"} == set(), (options, built.report)
    assert message.isprintable()
    assert len(message) < MESSAGE
