"""Limits of caps against what exact rays show, and their drawings."""

import re
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.entities import Text
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.balls.selection import ball_candidates
from tbcad.prototype.base.caps import SHARES, cap_limits
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.drawings.caps import cap_sheet
from tbcad.records.prototype import CapRecord

CAPTURE_MM = 60.0


@pytest.fixture(scope="module")
def design() -> Spec:
    return load_spec(
        None, ["n=6", "prototype.k=6", "prototype.snap=nearest", "prototype.base.hold=glue"]
    )


@pytest.fixture(scope="module")
def base(design: Spec, layout: PrototypeLayout) -> BaseLayout:
    return base_layout(design.prototype.base, layout)


@pytest.fixture(scope="module")
def limits(design: Spec, base: BaseLayout, layout: PrototypeLayout) -> tuple[CapRecord, ...]:
    return cap_limits(design, base, layout)


def lost(layout: PrototypeLayout, radius: np.ndarray, which: int) -> float:
    """Coverage lost by the mirrors of a ball when its radius is another, mm; the median."""
    groups: MirrorGroups = layout.groups
    candidates = ball_candidates(layout.array, groups, CAPTURE_MM)
    before, after = (candidates.coverage(one, True) for one in (layout.balls.radius, radius))
    return float(np.median(np.abs(after - before)[groups.group_of == which]))


def test_each_cap_has_limits(limits: tuple[CapRecord, ...], layout: PrototypeLayout) -> None:
    assert [one.ball - 1 for one in limits] == np.flatnonzero(layout.balls.cap).tolist()
    assert len(limits) > 0


def test_a_radius_off_by_its_tolerance_costs_its_share(
    design: Spec, limits: tuple[CapRecord, ...], layout: PrototypeLayout
) -> None:
    """The formula is paraxial; oblique rays and windows that are not round differ from it."""
    share = design.mirrors.margin_mm / SHARES**0.5
    for one in limits:
        radius = layout.balls.radius.copy()
        radius[one.ball - 1] += one.radius_tolerance_mm
        assert 0.3 * share < lost(layout, radius, one.ball - 1) < 2 * share


def test_slope_errors_of_the_irregularity_cost_their_share(
    design: Spec, limits: tuple[CapRecord, ...], layout: PrototypeLayout
) -> None:
    """A saddle of that height over the effective diameter has this slope at its rim."""
    share = design.mirrors.margin_mm / SHARES**0.5
    for one in limits:
        height = one.irregularity_fringes * 546.07e-6 / 2
        slope = 2 * height / (one.aperture_mm / 2)
        distance = float(np.linalg.norm(layout.apices()[one.ball - 1]))
        assert 4 * distance * slope == pytest.approx(share)


def test_tilt_moves_the_front_by_its_lever(
    limits: tuple[CapRecord, ...], layout: PrototypeLayout
) -> None:
    for one in limits:
        lever = np.linalg.norm((layout.centres() - layout.body_centres())[one.ball - 1])
        assert one.centre_shift_mm == pytest.approx(lever * np.sin(np.radians(one.tilt_deg)))


def test_light_comes_in_at_the_angle_between_normal_and_camera(
    limits: tuple[CapRecord, ...], layout: PrototypeLayout
) -> None:
    for one in limits:
        k = one.ball - 1
        to_camera = layout.array.camera.pinhole - layout.apices()[k]
        cosine = float(layout.normals()[k] @ to_camera / np.linalg.norm(to_camera))
        assert np.cos(np.radians(one.incidence_deg)) == pytest.approx(cosine)


def test_the_sheet_says_the_limits(
    base: BaseLayout, limits: tuple[CapRecord, ...], layout: PrototypeLayout, tmp_path: Path
) -> None:
    for one in limits:
        sheet = cap_sheet("design", base, layout, one)
        texts = [entity.text for entity in sheet.entities if isinstance(entity, Text)]
        (radius,) = (text for text in texts if text.startswith("R "))
        found = re.fullmatch(r"R ([\d.]+) \+-([\d.]+) CX", radius)
        assert found
        assert float(found[1]) == pytest.approx(layout.balls.radius[one.ball - 1], abs=0.051)
        assert float(found[2]) == pytest.approx(one.radius_tolerance_mm, abs=0.006)
        assert any(text.startswith(f"3/ -({one.irregularity_fringes:.1f})") for text in texts)
        sheet.write(tmp_path)
        assert {path.suffix for path in tmp_path.glob(f"drawing_cap_{one.ball}.*")} == {
            ".pdf",
            ".dxf",
        }
