"""Shells of any optics are built and verified, or refused in one line that is right."""

import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from tbcad_verify.run.verify import verify

import tbcad
from tbcad.errors import InputError
from tbcad.output.overview import overview
from tests.verify.optical_setups import IN_PROCESS

MESSAGE = 600  # characters of a line that says why something cannot be made
# A quarter of the pixels: mirrors of n = 3 are hundreds of them across.
SENSOR = ("width_px=1040", "height_px=776")

pytestmark = [pytest.mark.designs, pytest.mark.usefixtures("standing")]


def of_optics(camera: list[float], semi_minor: float, diameter: float) -> list[str]:
    """Options of a design of n = 3."""
    numbers = [f"semi_minor_mm={semi_minor}", f"capture_diameter_mm={diameter}"]
    return ["n=3", f"camera_mm={camera}", *numbers]


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
    return of_optics([round(x, 1) for x in camera], round(minor, 1), round(diameter, 1))


@given(options=optics())
@example(
    options=of_optics([61.3, 0, -51.4], 82.6, 35)
)  # holes whose strips send light to the object
@example(options=of_optics([231.2, 0, -84.1], 53.8, 20))  # a mirror that bends into the foot
@example(options=of_optics([49.3, 0, -63], 37.5, 20))  # the object stands in its own light
@example(options=of_optics([97.2, 0, -52], 35.4, 20))  # arcs shorter than the strip along rims
@example(options=of_optics([62.3, 0, -50.2], 36.1, 22.2))  # the same, at sharper corners
@example(options=of_optics([70.0, 0, -38.8], 33.8, 20))  # light fans out by a right angle
@example(options=of_optics([163.6, 0, -127], 67.9, 24.6))  # a cell whose foot side bends inward
@example(options=of_optics([216.3, -19.4, -109.2], 64.6, 26.2))  # not symmetrical
@settings(
    max_examples=8,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_any_optics(options: list[str], tmp_path: Path) -> None:
    """Shells are built and verified, and the prototype is laid out or left out with its reason.

    What cannot be made is refused in one line.
    """
    message = ""
    try:
        spec = tbcad.load_spec(None, [*options, *SENSOR])
        out = tmp_path / "exports"
        built = tbcad.build(spec, out, parts=["shell"], verify=False, force=True)
        message = overview(built.design, optional_prototype=True).note
    except InputError as error:
        message = str(error)
    else:
        report = verify(out, options=IN_PROCESS)
        assert report.passed, (options, report)
    assert message.isprintable()
    assert len(message) < MESSAGE
