"""An analysis as a summary in words, tables, plots and JSON."""

import json
import math
from dataclasses import asdict
from typing import Any

import numpy as np

from tbcad.common.results import Figure, Record, Study, Table
from tbcad.tolerancing.analysis import Analysis
from tbcad.tolerancing.margin import Margin
from tbcad.tolerancing.montecarlo.builds import (
    CoverageResult,
    estimate_yield,
    percent,
    yield_sentence,
)
from tbcad.tolerancing.montecarlo.sensitivity import FACTOR_TOLERANCE, SingleErrorEffect
from tbcad.tolerancing.plots import directions, in_words, panels, spread_dict, spread_sentence
from tbcad.tolerancing.process.kinds import ErrorSpec
from tbcad.tolerancing.process.process import Process
from tbcad.types import Floats

SCHEMA = "tbcad-tolerance/2"
NOT_SEARCHED = "not searched for: add --margins"
QUANTILES = (0.01, 0.05, 0.5)
NOTES = (
    "Coverage of a virtual camera: twice the minimum distance from the object's centre of all rays "
    "camera -> edge of its mirror -> reflected. A build is good when every virtual camera covers "
    "the capture diameter or more. Intervals of yields: Wilson, 95 %.",
    "Pointing: distance from the object's centre of the ray of each mirror's centre pixel in an "
    "uncalibrated build. Calibration makes rays known; it does not restore coverage.",
    "Tolerable factor: factor on one kind of error, without any other, that still gives the wanted "
    "yield.",
)

UNITS = {
    "um": "micrometres",
    "mm": "mm",
    "permille": "per mille",
    "percent": "%",
    "mrad": "mrad",
    "deg": "degrees",
}
ERROR_COLUMNS = (
    *("kind", "magnitude", "mean", "loss_mm", "loss_at_yield_mm"),
    *("tolerable_factor", "tolerable_magnitude", "tolerable_mean"),
)


def summary_text(analysis: Analysis) -> str:
    """The result in one paragraph."""
    sentences = (
        yield_sentence(analysis.process, analysis.result.worst, analysis.target),
        _largest_loss_sentence(analysis),
        _margin_sentence(analysis),
        _processes_sentence(analysis),
        _sharpness_sentence(analysis),
        spread_sentence(analysis),
        _prototype_sentence(analysis),
    )
    return " ".join(filter(None, sentences))


def _largest_loss_sentence(analysis: Analysis) -> str:
    if not analysis.single_errors:
        return ""
    largest = analysis.single_errors[0]
    limit = _limit_text(analysis, largest)
    return f"Largest loss by {in_words(largest.kind)}: {largest.loss:.2f} mm by itself; {limit}."


def _limit_text(analysis: Analysis, effect: SingleErrorEffect) -> str:
    """How large an error may be when there is no other, against how large it is."""
    factor = effect.tolerable_factor
    if factor == 0:
        return "the design itself falls short even without errors"
    if not math.isfinite(factor):
        return "harmless"
    key = _keys(analysis.process)[effect.kind]
    error: ErrorSpec = getattr(analysis.process, key)
    size, unit = error.magnitude or error.mean, UNITS[key.rpartition("_")[2]]
    few = f"fewer than {_wanted(analysis)} of the builds are good"
    if abs(factor - 1) <= FACTOR_TOLERANCE:
        return f"at {size:g} {unit} it is at its limit: with more, and no other error, {few}"
    return (
        f"with no other error, {few} above {factor * size:.3g} {unit} "
        f"({analysis.process.name} has {size:g})"
    )


def _keys(process: Process) -> dict[str, str]:
    """The process's key of each kind of error, which ends in its unit."""
    return {key.rpartition("_")[0]: key for key, _ in process}


def _wanted(analysis: Analysis) -> str:
    return f"{100 * analysis.options.wanted_yield:.6g}%"


def _margin_sentence(analysis: Analysis) -> str:
    needed = analysis.margin
    if needed is None:
        return ""
    if needed.mm is None:
        return f"No margin was found that is enough: {needed.reason}."
    return (
        f"A margin of {needed.mm:.2f} mm (tbcad build --radius-rule traced --set "
        f"mirrors.margin_mm={needed.mm:.2f}) makes {needed.share:.1%} good."
    )


def _processes_sentence(analysis: Analysis) -> str:
    """Of all processes the yields, and the margins if they were searched for."""
    if len(analysis.process_options) < 2:
        return ""
    yields = (f"{one.name} {one.estimate.share:.1%}" for one in analysis.process_options)
    text = f"Good builds, of {analysis.process_options[0].builds} each: {', '.join(yields)}."
    return text if analysis.margin is None else f"{text} {_margins_sentence(analysis)}"


def _margins_sentence(analysis: Analysis) -> str:
    margins = {option.name: _margin(option.margin)[0] for option in analysis.process_options}
    enough = [f"{name} with {mm:.2f} mm" for name, mm in margins.items() if mm is not None]
    none = [name for name, mm in margins.items() if mm is None]
    text = f"Margins needed for {_wanted(analysis)}: {', '.join(enough) or 'none found'}"
    return text + (f"; none was found for {' and '.join(none)}." if none else ".")


def _margin(margin: Margin | None) -> tuple[float | None, str]:
    """Margin, mm, and why there is none."""
    return (None, NOT_SEARCHED) if margin is None else (margin.mm, margin.reason)


def _sharpness_sentence(analysis: Analysis) -> str:
    ssim = analysis.sharpness
    return (
        f"Pictures: SSIM {ssim.designed.mean():.3f} as designed, {ssim.uncalibrated.mean():.3f} "
        f"without calibration, {ssim.calibrated.mean():.3f} with it."
    )


def _prototype_sentence(analysis: Analysis) -> str:
    if analysis.prototype is None:
        return ""
    without, with_it = (
        percent(estimate_yield(result.worst, analysis.target))
        for result in (analysis.prototype.uncalibrated, analysis.prototype.calibrated)
    )
    return f"Prototype: {without} good without calibration, {with_it} with it."


def json_text(analysis: Analysis) -> str:
    """tolerance.json as text."""
    return json.dumps(report_dict(analysis), indent=1, allow_nan=False) + "\n"


def report_dict(analysis: Analysis) -> dict[str, Any]:
    """tolerance.json."""
    sharp, prototype = analysis.sharpness, analysis.prototype
    return {
        "schema": SCHEMA,
        "summary": summary_text(analysis),
        "process": analysis.process.model_dump(mode="json", by_alias=True),
        "builds": len(analysis.result),
        "seed": analysis.options.seed,
        "target_mm": analysis.target,
        "wanted_yield": analysis.options.wanted_yield,
        **_result_dict(analysis.result, analysis.target),
        "single_errors": _error_table(analysis).records(),
        "margin_needed_mm": _margin(analysis.margin)[0],
        "margin_reason": _margin(analysis.margin)[1],
        "processes": _process_table(analysis).records(),
        "ssim": {
            "designed": float(sharp.designed.mean()),
            "uncalibrated": float(sharp.uncalibrated.mean()),
            "calibrated": float(sharp.calibrated.mean()),
            "calibration_residual_mrad": analysis.options.calibrated_mrad,
        },
        "ray_spread_mm": spread_dict(analysis),
        "prototype": prototype
        and {
            "uncalibrated": _result_dict(prototype.uncalibrated, analysis.target),
            "calibrated": _result_dict(prototype.calibrated, analysis.target),
        },
    }


def _result_dict(result: CoverageResult, target: float) -> dict[str, Any]:
    offset, met = result.offset, np.isfinite(result.offset)
    return {
        "yield": asdict(estimate_yield(result.worst, target)),
        "worst_camera_mm": {f"{q:g}": float(np.quantile(result.worst, q)) for q in QUANTILES},
        "pointing_mm": {
            "rms": _rms(offset),
            "largest_median": float(np.median(np.where(met, offset, 0).max(axis=1))),
            "rays_lost": float((~met).mean()),
        },
    }


def tolerance_study(analysis: Analysis) -> Study:
    """Tables and plots."""
    tables = (
        _builds_table(analysis),
        _error_table(analysis),
        _process_table(analysis),
        _cameras_table(analysis),
    )
    notes = (summary_text(analysis), *NOTES)
    return Study("tolerance", _figures(analysis), tables, panels(analysis), notes)


def _figures(analysis: Analysis) -> tuple[Figure, ...]:
    worst = analysis.result.worst
    losses = [
        Figure(f"loss by {in_words(effect.kind)} alone", "mm", effect.loss)
        for effect in analysis.single_errors
    ]
    yields = [
        Figure(f"good builds by {option.name}", "%", 100 * option.estimate.share)
        for option in analysis.process_options
    ]
    return (
        Figure("good builds", "%", 100 * analysis.estimate.share),
        Figure("worst camera, median", "mm", float(np.median(worst))),
        Figure("worst camera, 1 % cover less", "mm", float(np.quantile(worst, 0.01))),
        *([Figure("margin needed", "mm", analysis.margin.mm)] if analysis.margin else []),
        *losses,
        *yields,
    )


def _builds_table(analysis: Analysis) -> Table:
    result = analysis.result
    columns = {
        "build": np.arange(len(result)),
        "worst_coverage_mm": result.worst,
        "worst_camera": result.worst_camera,
        "pointing_rms_mm": np.array([_rms(offset) for offset in result.offset]),
    }
    return Table.of_columns("tolerance-builds", columns)


def _error_table(analysis: Analysis) -> Table:
    process, effects = analysis.process, analysis.single_errors
    records = [_error_record(effect, _keys(process)[effect.kind], process) for effect in effects]
    return Table.of_records("tolerance-sensitivity", records, columns=ERROR_COLUMNS)


def _error_record(effect: SingleErrorEffect, key: str, process: Process) -> Record:
    """One kind of error; magnitudes and means are in the unit of the process's key."""
    error: ErrorSpec = getattr(process, key)
    factor = effect.tolerable_factor if math.isfinite(effect.tolerable_factor) else None
    tolerable = [None if factor is None else factor * x for x in (error.magnitude, error.mean)]
    if effect.kind == "coating":
        tolerable[1] = None  # the design allows for a part of its mean
    cells = (
        *(key, error.magnitude, error.mean, effect.loss, effect.loss_at_yield),
        *(factor, *tolerable),
    )
    return dict(zip(ERROR_COLUMNS, cells, strict=True))


def _process_table(analysis: Analysis) -> Table:
    records: list[Record] = [
        {
            "process": option.name,
            "builds": option.builds,
            "yield": option.estimate.share,
            "yield_low": option.estimate.low,
            "yield_high": option.estimate.high,
            "margin_needed_mm": _margin(option.margin)[0],
            "reason": _margin(option.margin)[1],
        }
        for option in analysis.process_options
    ]
    return Table.of_records("tolerance-processes", records)


def _cameras_table(analysis: Analysis) -> Table:
    coverage, u = analysis.result.coverage, directions(analysis)
    low, middle = analysis.result.quantiles((0.05, 0.5))
    columns = {
        "virtual_camera": np.arange(len(u)),
        "ux": u[:, 0],
        "uy": u[:, 1],
        "uz": u[:, 2],
        "median_mm": middle,
        "five_percent_mm": low,
        "share_short": (coverage < analysis.target).mean(axis=0),
    }
    return Table.of_columns("tolerance-cameras", columns)


def _rms(offset: Floats) -> float:
    """Root mean square, mm, of the rays that meet their mirror; 0 where none does."""
    met = offset[np.isfinite(offset)]
    return float(np.sqrt((met**2).mean())) if met.size else 0.0
