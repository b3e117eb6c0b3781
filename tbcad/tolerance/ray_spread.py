"""What form errors within mirrors cost in sharpness: how far they spread the rays of a mirror."""

from typing import Any

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.tolerance.analysis import Analysis
from tbcad.tolerance.montecarlo.edge_model import EdgeModel
from tbcad.tolerance.montecarlo.form import ray_spread
from tbcad.types import Floats

MICROMETRE = 1e-3  # mm


def mirror_spreads(model: EdgeModel, waviness: float) -> Floats:
    """Root mean square displacement at the object of the rays of each mirror of a half, mm, (m,).

    Args:
        model: the half as designed.
        waviness: root mean square of the mirrors' form errors, mm.
    """
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
