"""The shroud: a closed box, whose patterns have the panels' sizes and flaps."""

import numpy as np
import pytest

from tbcad.cad.formats.entities import Layer, Line, Polyline
from tbcad.core.geometry.primitives import Component, box, volume
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import LightSpec
from tbcad.prototype.frame.layout import FrameLayout
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.light.shroud import FLAP_MM, NOTCH_MM, ShroudLayout, pattern, shroud_layout
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout

PARTS = load_parts()


@pytest.fixture(scope="module")
def shroud(frame: FrameLayout, stage: StageLayout, keep_out: KeepOut) -> ShroudLayout:
    static = (*frame.printed, *frame.purchased, *stage.components)
    found = shroud_layout(LightSpec(), static, keep_out, -238.0, PARTS)
    assert found is not None
    return found


def corners(shroud: ShroudLayout, name: str) -> np.ndarray:
    (panel,) = (panel for panel in shroud.panels if panel.name == f"shroud_{name}")
    (body,) = panel.component.added
    points = np.vstack([body.corners, body.corners + body.along])  # type: ignore[union-attr]
    return np.stack([points.min(axis=0), points.max(axis=0)])


def test_panels_close_a_box_round_what_the_base_sweeps(
    shroud: ShroudLayout, keep_out: KeepOut
) -> None:
    every = np.stack([corners(shroud, panel.name[7:]) for panel in shroud.panels])
    outer = np.ptp(every.reshape(-1, 3), axis=0)
    inner = outer - 2 * shroud.sheet["thickness_mm"]
    card = sum(volume(body) for panel in shroud.panels for body in panel.component.added)
    assert card == pytest.approx(float(np.prod(outer) - np.prod(inner)))

    low, high = corners(shroud, "right")[1, 1], corners(shroud, "left")[0, 1]
    x = np.linspace(-150, 150, 31)
    for y in (low, high):
        points = np.array([[a, y, b] for a in x for b in np.linspace(-150, 150, 31)])
        assert keep_out.to_swept(points).min() >= 9.9


def test_patterns_have_panels_and_flaps(shroud: ShroudLayout) -> None:
    for panel in shroud.panels:
        drawn = pattern(panel, shroud.sheet)
        (outline,) = (one for one in drawn if isinstance(one, Polyline))
        folds = [one for one in drawn if isinstance(one, Line)]
        assert outline.layer is Layer.CUT
        assert len(folds) == len(panel.flaps)
        assert np.ptp(np.array(outline.corners), axis=0) == pytest.approx(panel.cut_size)
        x, y = np.array(outline.corners).T
        area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
        flaps = sum((np.hypot(*np.subtract(one.end, one.start)) - 5.0) * FLAP_MM for one in folds)
        notch = np.prod(NOTCH_MM) if panel.notched else 0.0
        assert area == pytest.approx(np.prod(panel.size) + flaps - notch)


def test_sheets_hold_the_panels_or_are_refused(shroud: ShroudLayout, keep_out: KeepOut) -> None:
    long = Component("bar", "bar", (box(np.zeros(3), np.array([1500.0, 10, 10]), np.eye(3)),))
    assert shroud_layout(LightSpec(), [long], keep_out, -238.0, PARTS) is None
    with pytest.raises(SpecError, match=r"no sheet in sheets\.csv is large enough .* of 1\d{3} mm"):
        shroud_layout(LightSpec(shroud=True), [long], keep_out, -238.0, PARTS)
    assert shroud_layout(LightSpec(shroud=False), [long], keep_out, -238.0, PARTS) is None
    area = sum(np.prod(panel.cut_size) for panel in shroud.panels)
    sheet = shroud.sheet["length_mm"] * shroud.sheet["width_mm"]
    assert area / sheet <= shroud.sheets <= len(shroud.panels)
