"""The answer in words, tables, plots and JSON."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from tbcad.simulate.study.study import Figure, Study
from tbcad.simulate.study.tables import Table
from tbcad.tolerance.analysis import TRIED, Analysis
from tbcad.tolerance.montecarlo.builds import Yield, yielded
from tbcad.tolerance.plots import directions, in_words, panels
from tbcad.tolerance.process.process import process_dict
from tbcad.types import Floats

SCHEMA = "tbcad-tolerance/1"
SHARES = (0.01, 0.05, 0.5)
NOTES = (
    "Coverage of a virtual camera: twice the least distance from the object's middle of all rays "
    "camera -> edge of its mirror -> reflected. A machine is good when every virtual camera has "
    "the capture diameter or more. Intervals of yields: Wilson, 95 %.",
    "Pointing: distance from the object's middle of the ray of each mirror's middle pixel, as an "
    "uncalibrated machine takes it. Calibration makes rays known; it does not give coverage back.",
    "Loosest: what one kind of error, alone, may be multiplied by for the wanted yield.",
)


def summary_text(found: Analysis) -> str:
    """One paragraph."""
    process, target = found.process, found.target
    lines = [
        f"Made by {process.name} ({process.title}), {_share(found.yielded)} of the machines see "
        f"{target:g} mm with every virtual camera; the worst camera of a machine sees "
        f"{np.median(found.result.worst):.2f} mm (median; 1 % see less than "
        f"{np.quantile(found.result.worst, 0.01):.2f})."
    ]
    if found.single_errors:
        first = found.single_errors[0]
        lines.append(
            f"Most is lost by {in_words(first.kind)}: {first.loss:.2f} mm by itself; "
            f"{_factor(first.times)}."
        )
    if found.margin.mm is not None:
        lines.append(
            f"A margin of {found.margin.mm:.2f} mm (tbcad build --radius-rule traced --set "
            f"mirrors.margin_mm={found.margin.mm:.2f}) makes {found.margin.share:.1%} good."
        )
    else:
        lines.append(f"No margin was found that makes it do: {found.margin.reason}.")
    lines.append(_which(found))
    sharp = found.sharpness
    lines.append(
        f"Pictures: SSIM {sharp.designed.mean():.3f} as designed, {sharp.uncalibrated.mean():.3f} "
        f"taken for the designed machine, {sharp.calibrated.mean():.3f} once calibrated."
    )
    if found.stands is not None:
        plain, known = (
            yielded(one.worst, target) for one in (found.stands.plain, found.stands.known)
        )
        lines.append(
            f"Prototype: {_share(plain)} good without calibration, {_share(known)} with it."
        )
    return " ".join(lines)


def document(found: Analysis) -> dict[str, Any]:
    """tolerance.json."""
    worst = found.result.worst
    return {
        "schema": SCHEMA,
        "words": summary_text(found),
        "process": process_dict(found.process),
        "machines": len(worst),
        "seed": found.wishes.seed,
        "target_mm": found.target,
        "wanted_yield": found.wishes.wanted,
        "yield": _yield(found.yielded),
        "worst_camera_mm": {f"{share:g}": float(np.quantile(worst, share)) for share in SHARES},
        "pointing_mm": _pointing(found),
        "alone": [
            {"kind": a.kind, "loss_mm": a.loss, "tail_mm": a.tail, "may_be_times": _finite(a.times)}
            for a in found.single_errors
        ],
        "margin_needed_mm": found.margin.mm,
        "margin_reason": found.margin.reason,
        "processes": [
            {
                "name": choice.name,
                "machines": TRIED,
                "yield": _yield(choice.yielded),
                "margin_needed_mm": choice.margin.mm,
                "reason": choice.margin.reason,
            }
            for choice in found.choices
        ],
        "ssim": {
            "designed": float(found.sharpness.designed.mean()),
            "uncalibrated": float(found.sharpness.uncalibrated.mean()),
            "calibrated": float(found.sharpness.calibrated.mean()),
            "calibration_leaves_mrad": 1000 * found.wishes.left,
        },
        "prototype": _prototype(found),
    }


def study(found: Analysis) -> Study:
    """Tables and plots."""
    tables = (_machines(found), _alone(found), _choices(found), _cameras(found))
    notes = (summary_text(found), *NOTES)
    return Study("tolerance", _figures(found), tables, panels(found), notes)


def json_text(found: Analysis) -> str:
    """tolerance.json as text."""
    return json.dumps(document(found), indent=1, allow_nan=False) + "\n"


def _figures(found: Analysis) -> tuple[Figure, ...]:
    worst = found.result.worst
    return (
        Figure("good machines", "%", 100 * found.yielded.share),
        Figure("worst camera, median", "mm", float(np.median(worst))),
        Figure("worst camera, 1 % see less", "mm", float(np.quantile(worst, 0.01))),
        Figure("margin needed", "mm", found.margin.mm),
        *(Figure(f"loss by {in_words(e.kind)} alone", "mm", e.loss) for e in found.single_errors),
        *(Figure(f"good machines by {c.name}", "%", 100 * c.yielded.share) for c in found.choices),
    )


def _machines(found: Analysis) -> Table:
    result = found.result
    offset = np.array([_rms(row) for row in result.offset])
    columns = zip(result.worst.tolist(), result.worst_camera.tolist(), offset.tolist(), strict=True)
    rows = tuple((number, *row) for number, row in enumerate(columns))
    return Table(
        "tolerance-machines",
        ("machine", "worst_coverage_mm", "worst_camera", "pointing_rms_mm"),
        rows,
    )


def _alone(found: Analysis) -> Table:
    process = dict(found.process)
    rows = []
    for one in found.single_errors:
        key = next((key for key in process if key.rpartition("_")[0] == one.kind), one.kind)
        now = [float(getattr(process[key], name, math.nan)) for name in ("magnitude", "mean")]
        may = [None if math.isinf(one.times) else one.times * value for value in now]
        if one.kind == "coating":
            may[1] = None  # a part of its mean is what the design allows for
        rows.append((key, *now, one.loss, one.tail, _finite(one.times), *may))
    columns = (
        *("kind", "magnitude", "mean", "loss_mm", "tail_mm"),
        *("may_be_times", "may_be_magnitude", "may_be_mean"),
    )
    return Table("tolerance-sensitivity", columns, tuple(rows))


def _choices(found: Analysis) -> Table:
    columns = (
        "process",
        "machines",
        "yield",
        "yield_low",
        "yield_high",
        "margin_needed_mm",
        "reason",
    )
    return Table(
        "tolerance-processes",
        columns,
        tuple(
            (
                c.name,
                TRIED,
                c.yielded.share,
                c.yielded.low,
                c.yielded.high,
                c.margin.mm,
                c.margin.reason,
            )
            for c in found.choices
        ),
    )


def _cameras(found: Analysis) -> Table:
    coverage = found.result.coverage
    low, middle = found.result.quantiles((0.05, 0.5))
    short = (coverage < found.target).mean(axis=0)
    u = directions(found)
    columns = ("virtual_camera", "ux", "uy", "uz", "median_mm", "five_percent_mm", "share_short")
    numbers = np.column_stack([u, middle, low, short]).tolist()
    rows = tuple((k, *row) for k, row in enumerate(numbers))
    return Table("tolerance-cameras", columns, rows)


def _pointing(found: Analysis) -> dict[str, float]:
    offset = found.result.offset
    return {
        "rms": _rms(offset),
        "largest_median": float(np.median(np.where(np.isfinite(offset), offset, 0).max(axis=1))),
        "rays_lost": float((~np.isfinite(offset)).mean()),
    }


def _prototype(found: Analysis) -> dict[str, Any] | None:
    if found.stands is None:
        return None
    return {
        name: {
            "yield": _yield(yielded(one.worst, found.target)),
            "worst_camera_mm": {f"{s:g}": float(np.quantile(one.worst, s)) for s in SHARES},
            "pointing_rms_mm": _rms(one.offset),
            "rays_lost": float((~np.isfinite(one.offset)).mean()),
        }
        for name, one in (("uncalibrated", found.stands.plain), ("calibrated", found.stands.known))
    }


def _rms(offset: Floats) -> float:
    """Root mean square, mm, of the rays that meet their mirror at all; 0 where none does."""
    met = offset[np.isfinite(offset)]
    return float(np.sqrt((met**2).mean())) if met.size else 0.0


def _which(found: Analysis) -> str:
    """Which processes do, with which margin."""
    do = [f"{c.name} with {c.margin.mm:.2f} mm" for c in found.choices if c.margin.mm is not None]
    not_ = [c.name for c in found.choices if c.margin.mm is None]
    text = f"Margins needed for {100 * found.wishes.wanted:.6g}%: {', '.join(do) or 'none found'}"
    return text + (f"; none was found for {' and '.join(not_)}." if not_ else ".")


def _yield(found: Yield) -> dict[str, float]:
    return {"share": found.share, "low": found.low, "high": found.high}


def _share(found: Yield) -> str:
    return f"{found.share:.1%} ({found.low:.1%} to {found.high:.1%})"


def _factor(times: float) -> str:
    if times == 0:
        return "without it and all others the design itself falls short"
    return f"alone it may be {times:.2g} times what it is" if math.isfinite(times) else "harmless"


def _finite(times: float) -> float | None:
    return times if math.isfinite(times) else None
