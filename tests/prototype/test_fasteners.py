"""Bodies of fasteners: sizes of standards, in their places."""

import numpy as np
import pytest

from tbcad.cad.kernel.checks import volume as solid_volume
from tbcad.core.geometry.primitives import enclosing_triangles, volume
from tbcad.prototype.fasteners import PROFILES, Fastener, core_radius, fastener_component, numbered
from tbcad.prototype.printed import component_solid
from tbcad.prototype.purchased.parts import load_parts, of_kind

PARTS = load_parts()
PLACE, ALONG = np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, -0.8])
LEVEL = np.array([0.6, 0.8, 0.0])
LENGTHS = dict.fromkeys(("screws", "setscrews", "inserts", "dowels"), "length_mm")
LENGTHS |= dict.fromkeys(("nuts", "magnets", "leds"), "height_mm")


@pytest.mark.parametrize(
    ("thread", "core"), [(2.0, 1.509), (3.0, 2.387), (4.0, 3.141), (5.0, 4.019), (6.0, 4.773)]
)
def test_core_diameters_are_those_of_iso_724(thread: float, core: float) -> None:
    """d3 of coarse threads, as the standard lists it."""
    assert 2 * core_radius(thread) == pytest.approx(core, abs=1e-3)


@pytest.mark.parametrize("kind", [*PROFILES, "tnuts"])
def test_bodies_are_in_their_places(kind: str) -> None:
    for part in of_kind(PARTS, kind):
        check_body(numbered([Fastener(part, PLACE, LEVEL, ("plate",))])[0])


def check_body(one: Fastener) -> None:
    body = fastener_component(one)
    along = (enclosing_triangles(body.added[0]).reshape(-1, 3) - PLACE) @ LEVEL
    head = one.part["head_height_mm"] if one.part.kind == "screws" else 0.0
    thickness = one.part["thickness_mm"] if one.part.kind == "washers" else 0.0
    assert along.min() == pytest.approx(0.5 if one.part.kind == "tnuts" else -head - thickness)
    if (length := LENGTHS.get(one.part.kind)) is not None:
        assert along.max() == pytest.approx(one.part[length])
    assert body.part == one.part.name
    if not body.removed:
        assert solid_volume(component_solid(body)) == pytest.approx(volume(body.added[0]), rel=1e-9)


def test_names_are_unique_and_of_letters_and_digits() -> None:
    some = [Fastener(PARTS[name], PLACE, ALONG, ("plate",)) for name in ("UNC1/4-20x12.7", "M3x8")]
    assert [one.name for one in numbered([*some, *some])] == [
        "UNC1_4_20x12_7_1",
        "M3x8_1",
        "UNC1_4_20x12_7_2",
        "M3x8_2",
    ]
