"""Plots of an analysis: the yield, the loss by each error, and the coverage of virtual cameras."""

from typing import Any

import numpy as np

from tbcad.common.results import PlotPanel, Series
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.tolerancing.analysis import Analysis
from tbcad.tolerancing.montecarlo.coverage import virtual_camera_numbers
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel
from tbcad.tolerancing.montecarlo.form import ray_spread
from tbcad.types import Floats

LOW_SHARE = 0.05  # share of the builds whose coverage lies below what the map shows
MICROMETRE = 1e-3  # mm


def panels(analysis: Analysis) -> tuple[PlotPanel, ...]:
    """All plots."""
    return (_yield_curve(analysis), _loss_bars(analysis), _coverage_map(analysis))


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
    bars = Series("", loss, np.arange(len(loss), dtype=np.float64), "bars")
    return PlotPanel(
        "Loss by each kind of error alone", "loss of coverage, mm", "", (bars,), names=names
    )


def _coverage_map(analysis: Analysis) -> PlotPanel:
    u = directions(analysis)
    low = analysis.result.quantiles((LOW_SHARE,))[0]
    from_zenith = np.degrees(np.arccos(np.clip(u[:, 2], -1, 1)))
    horizontal = np.maximum(np.hypot(u[:, 0], u[:, 1]), 1e-12)
    x, y = from_zenith * u[:, 0] / horizontal, from_zenith * u[:, 1] / horizontal
    dots = Series("", x, y, ".", low, f"coverage that {LOW_SHARE:.0%} do not reach, mm")
    return PlotPanel(
        "Virtual cameras, the zenith in the middle",
        "angle from the zenith along x, degrees",
        "angle from the zenith along y, degrees",
        (dots,),
    )


def directions(analysis: Analysis) -> Floats:
    """Directions of the virtual cameras, (v, 3)."""
    number = virtual_camera_numbers(analysis.edge_models[1].halved)
    of_mirrors = np.concatenate([camera.u for camera in analysis.cameras])
    result = np.zeros((int(number.max()) + 1, 3))
    result[number[::-1]] = of_mirrors[::-1]  # the first mirror of a camera counts
    return result


def in_words(kind: str) -> str:
    """A kind of error in words."""
    return kind.replace("_", " ")


def mirror_spreads(model: EdgeModel, waviness: float) -> Floats:
    """RMS displacement at the object of the rays of each mirror of a half, mm, (m,)."""
    away = unit(model.view.pinhole - model.apex)
    incidence = np.arccos(np.clip(dot(away, model.normal), -1, 1))
    return ray_spread(waviness, model.cell_radius, norm(model.apex), incidence)


def spread_dict(analysis: Analysis) -> dict[str, Any]:
    """The spread of rays by waviness, for tolerance.json."""
    waviness = analysis.process.waviness_um.magnitude * MICROMETRE
    spread = np.concatenate([mirror_spreads(model, waviness) for model in analysis.edge_models])
    return {
        "median": float(np.median(spread)),
        "largest": float(spread.max()),
        "pixel_width_median": _pixel_width(analysis),
    }


def _pixel_width(analysis: Analysis) -> float:
    """Width of a pixel at the object, mm: the target's disc shared among a mirror's pixels."""
    pixels = np.median(analysis.result.pixels)
    return float(analysis.target * np.sqrt(np.pi / 4 / pixels)) if pixels else 0.0


def spread_sentence(analysis: Analysis) -> str:
    """The same in words; nothing where the process has no waviness."""
    if analysis.process.waviness_um.magnitude == 0:
        return ""
    spread = spread_dict(analysis)
    return (
        f"Waviness displaces a mirror's rays by {spread['median']:.2g} mm at the object (RMS, "
        f"median of the mirrors), where a pixel is {spread['pixel_width_median']:.2g} mm wide."
    )
