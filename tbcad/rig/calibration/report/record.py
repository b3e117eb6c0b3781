"""calibration.json and covariance.npz: what a calibration is based on, and all that it knows."""

from io import BytesIO
from typing import Any

import numpy as np

from tbcad.records.calibration import (
    CalibrationRecord,
    HalvesRecord,
    HighlightFigures,
    OutlierRecord,
    ParameterBlock,
    PulledParameter,
    RayFigures,
)
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.estimate.covariance import Covariance
from tbcad.rig.calibration.report.tables import sphere_covariances
from tbcad.rig.calibration.report.verdict import CalibrationVerdict, outliers, parameter_names
from tbcad.types import Floats

DIGITS = 6


def calibration_record(
    result: MachineCalibration, judged: CalibrationVerdict, known: Covariance, basis: dict[str, Any]
) -> CalibrationRecord:
    """What calibration.json says.

    Args:
        result: the calibration.
        judged: its verdict.
        known: covariance of its parameters.
        basis: names of run, export, process and lens.
    """
    found = result.found
    return CalibrationRecord(
        **basis,
        verdict=judged.answer.value,
        rays=RayFigures(
            mirrors=len(result.rays.ids),
            mirrors_without_frame=result.rays.absent,
            place_mm_median=_short(judged.place_mm[0]),
            place_mm_95=_short(judged.place_mm[1]),
            turn_mrad_median=_short(judged.turn_mrad[0]),
            turn_mrad_95=_short(judged.turn_mrad[1]),
            in_run_mm_median=_short(judged.in_run[0]),
            in_run_mrad_median=_short(judged.in_run[1]),
            in_design_mm_median=_short(judged.whole_mm[0]),
            in_design_mrad_median=_short(judged.whole_mrad[0]),
            needed_mm_median=_short(judged.needed_mm),
            share_short_of_need=_short(judged.short),
        ),
        highlights=HighlightFigures(
            given=len(found.highlights),
            used=int(found.used.sum()),
            rejected_by_detection=_counts(result),
            noise_factor=_short(found.noise_factor),
            residual_px=_short(float(np.sqrt((found.residual[found.used] ** 2).mean()))),
            degrees_of_freedom=round(found.freedom),
        ),
        outliers=tuple(
            OutlierRecord(photograph=name, ball=ball, led=led, sigmas=_short(sigma))
            for name, ball, led, sigma in outliers(result)
        ),
        halves=tuple(
            HalvesRecord(
                apart=half.by,
                highlights=half.counts,
                found_mm=_short(half.found_mm),
                expected_mm=_short(half.expected_mm),
            )
            for half in result.halves
        ),
        faults=result.detection.faults,
        doubts=judged.doubts,
        unlike_the_process=tuple(
            PulledParameter(parameter=name, sigmas=_short(sigma)) for name, sigma in judged.pulled
        ),
        parameters=_parameters(result, known),
    )


def covariance_bytes(result: MachineCalibration, known: Covariance) -> bytes:
    """covariance.npz: the same calibration gives the same bytes.

    Arrays: parameter (q,) names of the free ones; value and prior_sigma (q,), in prior standard
    deviations and in units; information (its upper half as row, column, entry) in prior standard
    deviations; sphere (k, 4, 4) mm^2 of centres at base angle zero and radii; ray (m, 4, 4) of
    places, mm, and rotations, rad.
    """
    found, prior = result.found, result.found.prior
    names = parameter_names(prior)
    upper = found.information.tocoo()
    kept = upper.row <= upper.col
    file = BytesIO()
    np.savez_compressed(
        file,
        allow_pickle=False,
        parameter=np.array([names[i] for i in prior.free]),
        value=found.values,
        prior_sigma=prior.flat_sigma[prior.free],
        information_row=upper.row[kept].astype(np.int32),
        information_column=upper.col[kept].astype(np.int32),
        information=upper.data[kept],
        sphere=sphere_covariances(result, known),
        ray=result.rays.known.whole.covariance,
    )
    return file.getvalue()


def _parameters(result: MachineCalibration, known: Covariance) -> dict[str, ParameterBlock]:
    """Each block's priors and results: deviations before and after, median of its parameters."""
    prior = result.found.prior
    after = np.zeros(len(prior.flat_sigma))
    after[prior.free] = known.sigma() * prior.flat_sigma[prior.free]
    return {
        block: ParameterBlock(
            number=prior.sigma[block].size,
            free=int((prior.sigma[block] > 0).sum()),
            prior_sigma=_median(prior.sigma[block].ravel()),
            sigma=_median(after[start : start + prior.sigma[block].size]),
        )
        for block, start in prior.first.items()
    }


def _median(values: Floats) -> float | None:
    free = values[values > 0]
    return _short(float(np.median(free))) if len(free) else None


def _counts(result: MachineCalibration) -> dict[str, int]:
    reasons = [rejected.reason.value for rejected in result.detection.rejected]
    return {reason: reasons.count(reason) for reason in sorted(set(reasons))}


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
