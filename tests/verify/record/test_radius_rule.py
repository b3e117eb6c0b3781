"""Radii by the rule of the spec, on designs of tbcad."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.step.recorded_checks import rule_check

from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.output.manifest import write_manifest


def record(folder: Path, rule: str, *more: str) -> Export:
    options = ["n=4", f"radius_rule={rule}", "camera.width_px=416", "camera.height_px=310", *more]
    write_record(folder, design(load_spec(None, options)), shells=True)
    write_manifest(folder, "build")
    return read_export(folder)


@pytest.fixture(scope="module", params=["traced", "paper", "flat"])
def export(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Export:
    return record(tmp_path_factory.mktemp("rule"), request.param)


def with_spec(export: Export, **keys: object) -> Export:
    mirrors = export.spec.mirrors.model_copy(update=keys)
    return replace(export, spec=export.spec.model_copy(update={"mirrors": mirrors}))


def test_radii_are_by_their_rule_only(export: Export) -> None:
    own = export.spec.mirrors.radius_rule
    for rule in ("traced", "paper", "flat"):
        assert rule_check(with_spec(export, radius_rule=rule)).passed == (rule == own)


def test_margin_and_largest_radius_belong_to_the_rule(export: Export) -> None:
    rule = export.spec.mirrors.radius_rule
    assert rule_check(with_spec(export, margin_mm=0.7)).passed == (rule != "traced")
    for widths in (31.0, 29.0, 12.0):
        assert rule_check(with_spec(export, max_radius_widths=widths)).passed == (rule == "flat")


@pytest.mark.parametrize("key", ["radius_mm", "coverage_mm"])
@pytest.mark.parametrize("share", [1 - 1e-4, 1 + 1e-4])
def test_one_mirror_that_is_off_is_named(export: Export, key: str, share: float) -> None:
    rule = export.spec.mirrors.radius_rule
    k = int(np.nanargmin(export.mirrors.coverage_mm))
    values = getattr(export.mirrors, key).copy()
    values[k] *= share
    mirrors = export.mirrors.model_copy(update={key: values})
    check = rule_check(replace(export, mirrors=mirrors))
    matters = {"traced": "coverage_mm", "paper": "radius_mm"}.get(rule)
    assert check.passed == (key != matters)
    if key == matters:
        assert export.mirrors.ids[k] in check.detail


def test_margins_of_single_mirrors(tmp_path: Path) -> None:
    own = [0.6 + 0.01 * k for k in range(49)]
    export = record(tmp_path, "traced", f"own_margins_mm={own}")
    assert rule_check(export).passed
    for wrong in ([], own[:-1], own[::-1], [*own[:30], own[30] + 0.01, *own[31:]]):
        assert not rule_check(with_spec(export, own_margins_mm=wrong)).passed
    assert not rule_check(with_spec(export, margin_mm=0.7)).passed
