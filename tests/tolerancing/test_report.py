"""The answer says what the figures say, in words, tables and JSON alike."""

import csv
import io
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from tbcad.common.results import study_files
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.photograph import Sensor, count_pixels
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.options.builds import ToleranceOptions
from tbcad.tolerancing.analysis import NOT_SEARCHED, Analysis, ProcessOption
from tbcad.tolerancing.margin import Margin
from tbcad.tolerancing.montecarlo.builds import (
    MonteCarloCase,
    SingleErrorEffect,
    YieldEstimate,
    estimate_yield,
    simulate,
)
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import Sharpness
from tbcad.tolerancing.process.process import load_process
from tbcad.tolerancing.prototype.windows import PrototypeResult
from tbcad.tolerancing.report import json_text, report_dict, summary_text, tolerance_study

BUILDS, TARGET = 25, 60.0
ALONE = (
    SingleErrorEffect("sphere_centre", 1.25, 1.75, 0.375),
    SingleErrorEffect("facets", 0.36, 0.36, 1.5),
    SingleErrorEffect("camera_tilt", 0.0, 0.0, math.inf),
)
PROCESS_OPTIONS = (
    ProcessOption(
        "fdm", YieldEstimate(0.0, 0.0, 0.04), Margin(None, 0.2, "it would need more than 20 mm")
    ),
    ProcessOption("sla", YieldEstimate(0.25, 0.2, 0.3), Margin(3.71, 0.99)),
    ProcessOption("diamond", YieldEstimate(1.0, 0.96, 1.0), Margin(0.56, 0.99)),
)
SHARP = Sharpness(np.array([0.9, 0.8]), np.array([[0.7, 0.6]]), np.array([[0.84, 0.74]]))


@pytest.fixture(scope="module")
def little() -> MirrorDesign:
    return design(load_spec(None, ["n=4"]))


@pytest.fixture(scope="module")
def analysis(little: MirrorDesign) -> Analysis:
    """Real builds, some good and some not; all else made up."""
    cameras = reflectors(little)
    models = edge_models(cameras)
    errors = Errors(sphere_centre=Error(0.012))
    return Analysis(
        process=load_process("sla"),
        options=ToleranceOptions("", builds=BUILDS, seed=4),
        target=TARGET,
        cameras=cameras,
        edge_models=models,
        result=simulate(MonteCarloCase(models, errors, 4), BUILDS),
        single_errors=ALONE,
        process_options=PROCESS_OPTIONS,
        margin=PROCESS_OPTIONS[1].margin,
        sharpness=SHARP,
        prototype=None,
    )


def prototype_yield(plain: float, known: float, offset: float = 2.0) -> PrototypeResult:
    """Ten prototypes each, the shares of which are good."""
    offsets = np.full((10, 3), offset)
    one, other = (
        np.where(np.arange(10) < round(10 * share), 61.0, 59.0)[:, None] for share in (plain, known)
    )
    return PrototypeResult(one, offsets, other, offsets)


def rows_of(analysis: Analysis, name: str) -> list[dict[str, str]]:
    text = study_files(tolerance_study(analysis))[f"tolerance-{name}.csv"].decode()
    return list(csv.DictReader(io.StringIO(text)))


class TestWords:
    def test_builds(self, analysis: Analysis) -> None:
        said, worst = summary_text(analysis), analysis.result.worst
        share = estimate_yield(worst, TARGET)
        assert 0 < share.share < 1
        assert (
            repr(analysis) == f"<Analysis of sla: yield {share.share:.1%} of {len(worst)} builds>"
        )
        good, low, high = (100 * x for x in (share.share, share.low, share.high))
        assert f"{good:.1f}% ({low:.1f}% to {high:.1f}%) of the builds cover 60 mm" in said
        assert f"covers {np.median(worst):.2f} mm (median" in said
        assert f"1 % cover less than {np.quantile(worst, 0.01):.2f})" in said

    def test_spread_of_rays_by_waviness(self, analysis: Analysis, little: MirrorDesign) -> None:
        spread = report_dict(analysis)["ray_spread_mm"]
        assert 0 < spread["median"] <= spread["largest"]
        array, sensor = little.arrays[0], Sensor(little.spec.camera.width_px, 1552)
        on = count_pixels(array, sensor, TARGET / 2).on
        halved = array.u[:, 0] == 0
        pixels = np.concatenate([np.where(halved, 2 * on, on), on[~halved]])
        area = np.median(pixels) * spread["pixel_width_median"] ** 2
        assert area == pytest.approx(np.pi * TARGET**2 / 4, rel=0.01)
        said = f"displaces a mirror's rays by {spread['median']:.2g} mm at the object"
        assert said in summary_text(analysis)
        smooth = replace(analysis, process=load_process("sla", ["waviness_um=0"]))
        assert report_dict(smooth)["ray_spread_mm"]["largest"] == 0
        assert "Waviness" not in summary_text(smooth)

    def test_margins_worst_kind_of_error_and_processes(self, analysis: Analysis) -> None:
        """The largest loss in the unit of the process: 0.375 times the 5 micrometres of sla."""
        said = summary_text(analysis)
        for words in (
            "A margin of 3.71 mm (tbcad build --radius-rule traced --set mirrors.margin_mm=3.71)",
            "Largest loss by sphere centre: 1.25 mm by itself",
            "above 1.88 micrometres (sla has 5)",
            "Yields of 100 builds each: fdm 0.0%, sla 25.0%, diamond 100.0%.",
            "sla with 3.71 mm, diamond with 0.56 mm; none was found for fdm.",
        ):
            assert words in said
        assert "none" not in summary_text(replace(analysis, process_options=PROCESS_OPTIONS[1:]))
        none = summary_text(replace(analysis, process_options=PROCESS_OPTIONS[:1] * 2))
        assert "Margins needed for 99%: none found; none was found for fdm." in none

    def test_margins_that_were_not_searched_for(self, analysis: Analysis) -> None:
        options = tuple(replace(option, margin=NOT_SEARCHED) for option in PROCESS_OPTIONS)
        plain = replace(analysis, margin=None, process_options=options)
        said = summary_text(plain)
        assert "diamond 100.0%." in said
        assert "argin" not in said
        read = json.loads(json_text(plain))
        assert read["margin_needed_mm"] is None
        assert read["margin_reason"] == "not searched for: add --margins"
        assert all(row["reason"] == read["margin_reason"] for row in rows_of(plain, "processes"))
        names = {str(row[0]) for row in tolerance_study(plain).summary.rows}
        assert "margin needed" not in names


def test_json_says_what_was_found(analysis: Analysis) -> None:
    """What may be anything has no number."""
    both = replace(analysis, prototype=prototype_yield(0.1, 0.7))
    assert not re.search("NaN|Infinity", json_text(both))
    read = json.loads(json_text(both))
    assert read["summary"] == summary_text(both)
    assert (read["builds"], read["seed"], read["target_mm"]) == (BUILDS, 4, TARGET)
    assert read["yield"]["share"] == (analysis.result.worst >= TARGET).mean()
    assert read["worst_camera_mm"]["0.5"] == np.median(analysis.result.worst)
    assert read["margin_needed_mm"] == 3.71
    assert [one["margin_needed_mm"] for one in read["processes"]] == [None, 3.71, 0.56]
    assert read["ssim"]["calibration_residual_mrad"] == 0.5
    told = {one["kind"]: one["tolerable_factor"] for one in read["single_errors"]}
    assert told == {"sphere_centre_um": 0.375, "facets_mm": 1.5, "camera_tilt_mrad": None}
    plain, known = read["prototype"]["uncalibrated"], read["prototype"]["calibrated"]
    assert (plain["yield"]["share"], known["yield"]["share"]) == (0.1, 0.7)
    assert (known["pointing_mm"]["rms"], known["worst_camera_mm"]["0.5"]) == (2, 61)


def test_table_of_cameras(analysis: Analysis, little: MirrorDesign) -> None:
    rows, coverage = rows_of(analysis, "cameras"), analysis.result.coverage
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    assert column["share_short"].tolist() == (coverage < TARGET).mean(axis=0).tolist()
    assert column["share_short"].max() > 0
    assert column["median_mm"].tolist() == np.median(coverage, axis=0).tolist()
    assert (column["five_percent_mm"] < column["median_mm"]).all()
    u = np.stack([column[name] for name in ("ux", "uy", "uz")], axis=1)
    assert np.array_equal(u[: len(little.arrays[0])], analysis.cameras[0].u)
    # One for each direction of both halves.
    every = np.concatenate([at.u for at in analysis.cameras])
    assert norm(every[:, None] - u).min(axis=1) == pytest.approx(0, abs=1e-9)
    assert (norm(u[:, None] - u) + np.eye(len(u))).min() > 0.1
