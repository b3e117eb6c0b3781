"""Limits of caps against what exact rays show, and their drawings."""

import re
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.entities import Text
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.balls.selection import ball_candidates
from tbcad.prototype.base.caps import SHARES, cap_limits, cap_sheet
from tbcad.prototype.base.layout import base_layout

CAPTURE_MM = 60.0


def test_limits_and_sheets(layout: PrototypeLayout, tmp_path: Path) -> None:
    spec = load_spec(None, ["n=6", "prototype.k=6", "snap=nearest", "base.hold=glue"])
    base, balls = base_layout(spec.prototype.base, layout), layout.balls
    limits = cap_limits(spec, base, layout)
    assert [one.ball - 1 for one in limits] == np.flatnonzero(balls.cap).tolist() != []
    candidates = ball_candidates(layout.array, layout.groups, CAPTURE_MM)
    before = candidates.coverage(balls.radius, True)
    share = spec.mirrors.margin_mm / SHARES**0.5
    for one in limits:
        k = one.ball - 1
        # The formula is paraxial; oblique rays and windows that are not round differ from it.
        radius = balls.radius + one.radius_tolerance_mm * (np.arange(len(balls)) == k)
        lost = np.abs(candidates.coverage(radius, True) - before)[layout.groups.group_of == k]
        assert 0.3 * share < np.median(lost) < 2 * share
        # A saddle as high as the irregularity over the aperture has this slope at its rim.
        slope = 2 * one.irregularity_fringes * 546.07e-6 / 2 / (one.aperture_mm / 2)
        assert 4 * norm(layout.apices()[k]) * slope == pytest.approx(share)
        lever = norm((layout.centres() - layout.body_centres())[k])
        assert one.centre_shift_mm == pytest.approx(lever * np.sin(np.radians(one.tilt_deg)))
        cosine = layout.normals()[k] @ unit(layout.array.camera.pinhole - layout.apices()[k])
        assert np.cos(np.radians(one.incidence_deg)) == pytest.approx(cosine)

        sheet = cap_sheet("design", base, layout, one)
        texts = [entity.text for entity in sheet.entities if isinstance(entity, Text)]
        (told,) = filter(
            None, (re.fullmatch(r"R ([\d.]+) CX, within \+-([\d.]+) by 3/", t) for t in texts)
        )
        assert float(told[1]) == pytest.approx(balls.radius[k], abs=0.051)
        assert float(told[2]) == pytest.approx(one.radius_tolerance_mm, abs=0.006)
        figures = one.power_fringes, one.irregularity_fringes, one.symmetric_fringes
        code = "3/ {:.1f}({:.1f}/{:.1f}), fringes".format(*figures)
        assert any(text.startswith(code) for text in texts)
        # ISO 10110-5: A is the sagitta error of a radius at its tolerance.
        half, wrong = one.aperture_mm / 2, balls.radius[k] + one.radius_tolerance_mm
        sags = [r - np.sqrt(r**2 - half**2) for r in (balls.radius[k], wrong)]
        assert (sags[0] - sags[1]) / (546.07e-6 / 2) == pytest.approx(one.power_fringes, rel=0.05)
        sheet.write(tmp_path)
        suffixes = {path.suffix for path in tmp_path.glob(f"drawing_cap_{one.ball}.*")}
        assert suffixes == {".pdf", ".dxf"}
