"""An analysis as a summary in words, tables, plots and JSON."""

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.tolerancing.analysis import NOT_SEARCHED, Analysis
from tbcad.tolerancing.montecarlo.builds import (
    FACTOR_TOLERANCE,
    CoverageResult,
    SingleErrorEffect,
    estimate_yield,
    percent,
    yield_sentence,
)
from tbcad.tolerancing.montecarlo.coverage import virtual_camera_numbers
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel
from tbcad.tolerancing.montecarlo.form import ray_spread
from tbcad.tolerancing.process.chain import MICROMETRE, ErrorSpec
from tbcad.types import Floats

SCHEMA = "tbcad-tolerance/2"
QUANTILES = (0.01, 0.05, 0.5)
LOW_SHARE = 0.05  # share of the builds whose coverage lies below what table and map show
NOTES = (
    "Coverage of a virtual camera: twice the minimum distance from the object's centre of all rays "
    "camera -> edge of its mirror -> reflected. Yield: share of the builds in which every "
    "virtual camera covers the capture diameter or more; intervals: Wilson, 95 %.",
    "Pointing: distance from the object's centre of the ray of each mirror's centre pixel in an "
    "uncalibrated build. Calibration makes rays known; it does not restore coverage.",
    "Tolerable factor: factor on one kind of error, without any other, that still gives the wanted "
    "yield.",
)
UNITS = {
    **{"um": "micrometres", "mm": "mm", "permille": "per mille", "percent": "%"},
    **{"mrad": "mrad", "deg": "degrees"},
}
ERROR_COLUMNS = (
    *("kind", "magnitude", "mean", "loss_mm", "loss_at_yield_mm"),
    *("tolerable_factor", "tolerable_magnitude", "tolerable_mean"),
)


def summary_text(analysis: Analysis) -> str:
    """The result in one paragraph."""
    return " ".join(_sentences(analysis))


def _sentences(analysis: Analysis) -> Iterator[str]:
    yield yield_sentence(analysis.process, analysis.result.worst, analysis.target)
    for largest in analysis.single_errors[:1]:
        lost = f"{in_words(largest.kind)}: {largest.loss:.2f} mm by itself"
        yield f"Largest loss by {lost}; {_limit_text(analysis, largest)}."
    needed = analysis.margin or NOT_SEARCHED
    if needed.mm is not None:
        yield (
            f"A margin of {needed.mm:.2f} mm (tbcad build --radius-rule traced --set "
            f"mirrors.margin_mm={needed.mm:.2f}) yields {needed.share:.1%}."
        )
    elif analysis.margin:
        yield f"No margin was found that is enough: {needed.reason}."
    if len(options := analysis.process_options) > 1:
        yields = (f"{one.name} {one.estimate.share:.1%}" for one in options)
        yield f"Yields of {options[0].builds} builds each: {', '.join(yields)}."
        if analysis.margin:
            yield _margins_sentence(analysis)
    ssim = {name: values.mean() for name, values in vars(analysis.sharpness).items()}
    yield (
        f"Pictures by {analysis.options.optics} optics: SSIM {ssim['designed']:.3f} as designed, "
        f"{ssim['uncalibrated']:.3f} without calibration, {ssim['calibrated']:.3f} with it."
    )
    if analysis.process.waviness_um.magnitude:
        spread = spread_dict(analysis)
        yield (
            f"Waviness displaces a mirror's rays by {spread['median']:.2g} mm at the object (RMS, "
            f"median of the mirrors), where a pixel is {spread['pixel_width_median']:.2g} mm wide."
        )
    if analysis.prototype is not None:
        both = analysis.prototype.uncalibrated, analysis.prototype.calibrated
        plain, known = (percent(estimate_yield(one.worst, analysis.target)) for one in both)
        yield f"Prototype: yield {plain} without calibration, {known} with it."


def in_words(kind: str) -> str:
    """A kind of error in words."""
    return kind.replace("_", " ")


def _limit_text(analysis: Analysis, effect: SingleErrorEffect) -> str:
    """How large an error may be when there is no other, against how large it is."""
    factor = effect.tolerable_factor
    if factor == 0:
        return "the design itself falls short even without errors"
    if not math.isfinite(factor):
        return "harmless"
    key, error = _error_of(analysis, effect)
    size, unit_name = error.magnitude or error.mean, UNITS[key.rpartition("_")[2]]
    few = f"the yield is below {_wanted(analysis)}"
    if abs(factor - 1) <= FACTOR_TOLERANCE:
        return f"at {size:g} {unit_name} it is at its limit: with more, and no other error, {few}"
    return (
        f"with no other error, {few} above {factor * size:.3g} {unit_name} "
        f"({analysis.process.name} has {size:g})"
    )


def _error_of(analysis: Analysis, effect: SingleErrorEffect) -> tuple[str, ErrorSpec]:
    """The process's key of a kind of error, which ends in its unit, and its figures."""
    kinds = ((k, v) for k, v in analysis.process if k.rpartition("_")[0] == effect.kind)
    return next(kinds)


def _wanted(analysis: Analysis) -> str:
    return f"{100 * analysis.options.wanted_yield:.6g}%"


def _margins_sentence(analysis: Analysis) -> str:
    options = analysis.process_options
    margins = {one.name: one.margin.mm for one in options}
    enough = [f"{name} with {mm:.2f} mm" for name, mm in margins.items() if mm is not None]
    none = [name for name, mm in margins.items() if mm is None]
    text = f"Margins needed for {_wanted(analysis)}: {', '.join(enough) or 'none found'}"
    return text + (f"; none was found for {' and '.join(none)}." if none else ".")


def json_text(analysis: Analysis) -> str:
    """tolerance.json as text."""
    return json.dumps(report_dict(analysis), indent=1, allow_nan=False) + "\n"


def report_dict(analysis: Analysis) -> dict[str, Any]:
    """tolerance.json."""
    prototype, options, target = analysis.prototype, analysis.options, analysis.target
    ssim = {name: float(values.mean()) for name, values in vars(analysis.sharpness).items()}
    margin = analysis.margin or NOT_SEARCHED
    return {
        "schema": SCHEMA,
        "summary": summary_text(analysis),
        "process": analysis.process.model_dump(mode="json", by_alias=True),
        "builds": len(analysis.result),
        "seed": options.seed,
        "target_mm": target,
        "wanted_yield": options.wanted_yield,
        **_result_dict(analysis.result, target),
        "single_errors": _error_table(analysis).records(),
        "margin_needed_mm": margin.mm,
        "margin_reason": margin.reason,
        "processes": _process_table(analysis).records(),
        "ssim": {
            **ssim,
            "optics": options.optics,
            "calibration_residual_mrad": options.calibrated_mrad,
        },
        "ray_spread_mm": spread_dict(analysis),
        "prototype": prototype
        and {
            "uncalibrated": _result_dict(prototype.uncalibrated, target),
            "calibrated": _result_dict(prototype.calibrated, target),
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


def _rms(offset: Floats) -> float:
    """Root mean square, mm, of the rays that meet their mirror; 0 where none does."""
    met = offset[np.isfinite(offset)]
    return float(np.sqrt((met**2).mean())) if met.size else 0.0


def spread_dict(analysis: Analysis) -> dict[str, Any]:
    """The spread of rays by waviness, for tolerance.json; pixels share the target's disc."""
    waviness = analysis.process.waviness_um.magnitude * MICROMETRE
    spread = np.concatenate([_mirror_spreads(model, waviness) for model in analysis.edge_models])
    numbers = virtual_camera_numbers(analysis.edge_models[1].halved)
    pixels = np.bincount(numbers, np.concatenate([*map(_picture_sizes, analysis.cameras)]))
    return {
        "median": float(np.median(spread)),
        "largest": float(spread.max()),
        "pixel_width_median": float(analysis.target * np.sqrt(np.pi / 4 / np.median(pixels))),
    }


def _picture_sizes(at: Reflector) -> Floats:
    """Size of each cell's picture as designed, by the polygon of its corners, pixels, (m,)."""
    arcs, corner = at.cells.arcs, at.camera.project(at.cells.corners)
    (x, y), (next_x, next_y) = corner[arcs.start].T, corner[arcs.end].T
    area, total = (x * next_y - next_x * y) / 2, np.zeros(len(at.cells.surfaces))
    np.add.at(total, arcs.left, area)
    np.subtract.at(total, arcs.right, area)
    return np.abs(total[: len(at)])


def _mirror_spreads(model: EdgeModel, waviness: float) -> Floats:
    """RMS displacement at the object of the rays of each mirror of a half, mm, (m,)."""
    away = unit(model.view.pinhole - model.apex)
    incidence = np.arccos(np.clip(dot(away, model.normal), -1, 1))
    return ray_spread(waviness, model.cell_radius, norm(model.apex), incidence)


def tolerance_study(analysis: Analysis) -> Study:
    """Tables and plots."""
    result, u = analysis.result, directions(analysis)
    low, middle = result.quantiles((LOW_SHARE, 0.5))
    builds = {
        "build": np.arange(len(result)),
        "worst_coverage_mm": result.worst,
        "worst_camera": result.worst_camera,
        "pointing_rms_mm": np.array([_rms(offset) for offset in result.offset]),
    }
    cameras = {
        "virtual_camera": np.arange(len(u)),
        **dict(zip(("ux", "uy", "uz"), u.T, strict=True)),
        "median_mm": middle,
        "five_percent_mm": low,
        "share_short": (result.coverage < analysis.target).mean(axis=0),
    }
    tables = (
        Table.of_columns("tolerance-builds", builds),
        _error_table(analysis),
        _process_table(analysis),
        Table.of_columns("tolerance-cameras", cameras),
    )
    panels = (_yield_curve(analysis), _loss_bars(analysis), _coverage_map(u, low))
    notes = (summary_text(analysis), *NOTES)
    return Study("tolerance", tuple(_figures(analysis)), tables, panels, notes)


def _figures(analysis: Analysis) -> Iterator[Figure]:
    worst = analysis.result.worst
    yield Figure("yield", "%", 100 * analysis.estimate.share)
    yield Figure("worst camera, median", "mm", float(np.median(worst)))
    yield Figure("worst camera, 1 % cover less", "mm", float(np.quantile(worst, 0.01)))
    if analysis.margin:
        yield Figure("margin needed", "mm", analysis.margin.mm)
    for effect in analysis.single_errors:
        yield Figure(f"loss by {in_words(effect.kind)} alone", "mm", effect.loss)
    for option in analysis.process_options:
        yield Figure(f"yield by {option.name}", "%", 100 * option.estimate.share)


def _error_table(analysis: Analysis) -> Table:
    """Each kind of error; magnitudes and means are in the unit of the process's key."""
    records: list[Record] = []
    for effect in analysis.single_errors:
        key, error = _error_of(analysis, effect)
        factor = effect.tolerable_factor if math.isfinite(effect.tolerable_factor) else None
        most = [None if factor is None else factor * x for x in (error.magnitude, error.mean)]
        if effect.kind == "coating":
            most[1] = None  # the design allows for a part of its mean
        losses = effect.loss, effect.loss_at_yield
        cells = (key, error.magnitude, error.mean, *losses, factor, *most)
        records.append(dict(zip(ERROR_COLUMNS, cells, strict=True)))
    return Table.of_records("tolerance-sensitivity", records, columns=ERROR_COLUMNS)


def _process_table(analysis: Analysis) -> Table:
    records: list[Record] = [
        {
            "process": option.name,
            "builds": option.builds,
            "yield": option.estimate.share,
            "yield_low": option.estimate.low,
            "yield_high": option.estimate.high,
            "margin_needed_mm": option.margin.mm,
            "reason": option.margin.reason,
        }
        for option in analysis.process_options
    ]
    return Table.of_records("tolerance-processes", records)


def directions(analysis: Analysis) -> Floats:
    """Directions of the virtual cameras, (v, 3)."""
    number = virtual_camera_numbers(analysis.edge_models[1].halved)
    of_mirrors = np.concatenate([camera.u for camera in analysis.cameras])
    result = np.zeros((int(number.max()) + 1, 3))
    result[number[::-1]] = of_mirrors[::-1]  # the first mirror of a camera counts
    return result


def _yield_curve(analysis: Analysis) -> PlotPanel:
    worst = np.sort(analysis.result.worst)
    share = 1 - np.arange(len(worst)) / len(worst)
    target = np.array([analysis.target, analysis.target])
    series = (
        Series(analysis.process.name, worst, 100 * share, "C0-"),
        Series(f"{analysis.target:g} mm", target, np.array([0.0, 100.0]), "k--"),
    )
    return PlotPanel("Yield", "minimum coverage of a build, mm", "builds that reach it, %", series)


def _loss_bars(analysis: Analysis) -> PlotPanel:
    loss = np.array([effect.loss for effect in analysis.single_errors])
    names = tuple(in_words(effect.kind) for effect in analysis.single_errors)
    bars = (Series("", loss, np.arange(len(loss), dtype=np.float64), "bars"),)
    title = "Loss by each kind of error alone"
    return PlotPanel(title, "loss of coverage, mm", "", bars, names=names)


def _coverage_map(u: Floats, low: Floats) -> PlotPanel:
    from_zenith = np.degrees(np.arccos(np.clip(u[:, 2], -1, 1)))
    horizontal = np.maximum(np.hypot(u[:, 0], u[:, 1]), 1e-12)
    x, y = from_zenith * u[:, 0] / horizontal, from_zenith * u[:, 1] / horizontal
    dots = Series("", x, y, ".", low, f"{LOW_SHARE * 100:.0f}th percentile of coverage, mm")
    along_x, along_y = (f"angle from the zenith along {axis}, degrees" for axis in "xy")
    title = "Virtual cameras, the zenith in the middle"
    return PlotPanel(title, along_x, along_y, (dots,))
