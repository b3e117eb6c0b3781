"""The shroud: its sheets, and when there is none."""

import numpy as np
import pytest

from tbcad.core.geometry.primitives import Component, box
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import LightSpec
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.light.shroud import ShroudLayout, shroud_layout
from tbcad.prototype.part import FrameLayout
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout

PARTS = load_parts()


@pytest.fixture(scope="module")
def shroud(frame: FrameLayout, stage: StageLayout, keep_out: KeepOut) -> ShroudLayout:
    static = (*frame.printed, *frame.purchased, *stage.components)
    found = shroud_layout(LightSpec(), static, keep_out, -238.0, PARTS)
    assert found is not None
    return found


def test_sheets_hold_the_panels_or_are_refused(shroud: ShroudLayout, keep_out: KeepOut) -> None:
    long = Component("bar", "bar", (box(np.zeros(3), np.array([1500.0, 10, 10]), np.eye(3)),))
    assert shroud_layout(LightSpec(), [long], keep_out, -238.0, PARTS) is None
    with pytest.raises(SpecError, match=r"no sheet in sheets\.csv is large enough .* of 1\d{3} mm"):
        shroud_layout(LightSpec(shroud=True), [long], keep_out, -238.0, PARTS)
    assert shroud_layout(LightSpec(shroud=False), [long], keep_out, -238.0, PARTS) is None
    area = sum(np.prod(panel.cut_size) for panel in shroud.panels)
    sheet = shroud.sheet["length_mm"] * shroud.sheet["width_mm"]
    assert area / sheet <= shroud.sheets <= len(shroud.panels)
