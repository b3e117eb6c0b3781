"""calibration.json, covariance.npz and the tables: all that a calibration is based on and knows."""

from io import BytesIO
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tbcad.common.results import Table
from tbcad.records.calibration import CalibrationRecord, ParameterBlock
from tbcad.records.document import RecordSection
from tbcad.records.run import exposure_name
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.estimate.parameters import Block, Of
from tbcad.rig.calibration.estimate.slopes import Slopes, base_slopes
from tbcad.rig.calibration.estimate.solve import Estimate
from tbcad.rig.calibration.report.verdict import CalibrationVerdict, outliers, parameter_names
from tbcad.rig.machine.designed import is_cap
from tbcad.types import Floats, Ints

AXES = ("x", "y", "z")
SPHERE = ("x_mm", "y_mm", "z_mm", "radius_mm")
DIGITS = 6
Section = TypeVar("Section", bound=RecordSection)


def spheres_table(result: MachineCalibration) -> Table:
    """Centres at base angle zero and radii: designed, estimated, difference, deviation."""
    designed, found = result.setup.designed, result.found.machine
    before = np.column_stack([designed.centre, designed.radius])
    after = np.column_stack([found.centre, found.radius])
    sigma = np.sqrt(np.diagonal(sphere_covariances(result), axis1=1, axis2=2))
    h, used = result.found.highlights, result.found.used
    count = np.bincount(h.sphere[used], minlength=len(before))
    caps = is_cap(result.setup.plan)
    columns: dict[str, ArrayLike] = {
        "ball": np.arange(1, len(before) + 1),
        "kind": np.where(caps, "cap", "ball"),
        "highlights": count,
    }
    for heading, values in (
        ("designed", before),
        ("estimated", after),
        ("difference", after - before),
        ("sigma", sigma),
    ):
        columns |= {f"{heading}_{name}": values[:, i] for i, name in enumerate(SPHERE)}
    return Table.of_columns("spheres", columns)


def sphere_covariances(result: MachineCalibration) -> Floats:
    """Of each sphere's centre at base angle zero and radius, mm^2, (k, 4, 4)."""
    found = result.found
    return found.covariances(base_slopes(found.prior, found.values))


def angles_table(result: MachineCalibration) -> Table:
    """Of each frame: planned and estimated angle, deviation, and where the base is shifted to."""
    found, planned = result.found, np.degrees(result.setup.designed.angle)
    machine, frames = found.machine, result.setup.frames
    angle = np.degrees(machine.angle)
    h = found.highlights
    none = np.zeros((len(frames), 3))
    turn = 1000 * (none if machine.turn is None else machine.turn)
    shift = none if machine.shift is None else machine.shift
    columns: dict[str, ArrayLike] = {
        "object_turn_deg": [frame.object_turn_deg for frame in frames],
        "stop": [frame.stop for frame in frames],
        "highlights": np.bincount(h.frame[found.used], minlength=len(frames)),
        "planned_deg": planned,
        "estimated_deg": angle,
        "difference_deg": angle - planned,
        "sigma_deg": np.degrees(angle_sigmas(found)),
        **{f"turn_{axis}_mrad": turn[:, i] for i, axis in enumerate(AXES)},
        "sigma_turn_mrad": 1000 * _frame_sigmas(found, Block.TURN),
        **{f"shift_{axis}_mm": shift[:, i] for i, axis in enumerate(AXES)},
        "sigma_shift_mm": _frame_sigmas(found, Block.SHIFT),
    }
    return Table.of_columns("angles", columns)


def rays_table(result: MachineCalibration) -> Table:
    """How well the middle ray of each mirror is known."""
    known, frames = result.rays.known, result.setup.frames
    columns: dict[str, ArrayLike] = {
        "mirror": result.rays.ids,
        "object_turn_deg": [frames[i].object_turn_deg for i in known.frame],
        "stop": [frames[i].stop for i in known.frame],
        "ball": known.sphere + 1,
        **{f"direction_{axis}": known.direction[:, i] for i, axis in enumerate(AXES)},
        "sigma_mrad": known.relative.turn_mrad,
        "sigma_mm": known.relative.place_mm,
        "sigma_in_run_mrad": known.in_run.turn_mrad,
        "sigma_in_run_mm": known.in_run.place_mm,
        "sigma_in_design_mrad": known.whole.turn_mrad,
        "sigma_in_design_mm": known.whole.place_mm,
        "pixel_mm": known.pixel_mm,
    }
    return Table.of_columns("rays", columns)


def residuals_table(result: MachineCalibration) -> Table:
    """Every highlight: where it is, how far from where the machine would show it."""
    found, h = result.found, result.found.highlights
    frames = result.setup.frames
    pairs = zip(h.frame.tolist(), h.led.tolist(), strict=True)
    columns: dict[str, ArrayLike] = {
        "photograph": [exposure_name(frames[i], f"led_{led + 1}") for i, led in pairs],
        "ball": h.sphere + 1,
        "led": h.led + 1,
        "column_px": h.pixel[:, 0],
        "row_px": h.pixel[:, 1],
        "residual_column_px": found.residual[:, 0],
        "residual_row_px": found.residual[:, 1],
        "sigma_px": h.sigma,
        "sigmas_off": found.sigmas_off,
        "used": found.used.astype(np.int64),
    }
    return Table.of_columns("residuals", columns)


def angle_sigmas(found: Estimate) -> Floats:
    """Of each frame's angle, with the offset of its series, radians, (f,)."""
    of, one = _of_frames(found), np.ones((len(found.prior.series), 1, 1))
    both = found.covariances(Slopes(of, {Block.OFFSET: one, Block.ANGLES: one}))
    return np.asarray(np.sqrt(both[:, 0, 0]))


def _frame_sigmas(found: Estimate, block: Block) -> Floats:
    """Standard deviation of a block's vector in each frame, (f,)."""
    each = np.broadcast_to(np.eye(block.size), (len(found.prior.series), block.size, block.size))
    known = found.covariances(Slopes(_of_frames(found), {block: each}))
    return np.asarray(np.sqrt(np.trace(known, axis1=1, axis2=2)))


def _of_frames(found: Estimate) -> dict[Of, Ints]:
    series = found.prior.series
    return {Of.FRAME: np.arange(len(series)), Of.SERIES: series}


def calibration_record(
    result: MachineCalibration, judged: CalibrationVerdict, basis: dict[str, Any]
) -> CalibrationRecord:
    """Contents of calibration.json; the basis names run, build, process and lens."""
    return CalibrationRecord(
        **basis,
        verdict=judged.answer.value,
        rays=_short(judged.rays),
        highlights=_short(judged.highlights),
        outliers=tuple(map(_short, outliers(result))),
        halves=tuple(map(_short, result.halves)),
        faults=result.detection.faults,
        doubts=judged.doubts,
        unlike_the_process=tuple(map(_short, judged.pulled)),
        parameters=_parameters(result),
    )


def covariance_bytes(result: MachineCalibration) -> bytes:
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
        sphere=sphere_covariances(result),
        ray=result.rays.known.whole.covariance,
    )
    return file.getvalue()


def _parameters(result: MachineCalibration) -> dict[str, ParameterBlock]:
    """Each block's priors and results: deviations before and after, median of its parameters."""
    found = result.found
    before, after = found.prior.sigma, found.sigmas()
    return {
        block: _short(
            ParameterBlock(
                number=before[block].size,
                free=int((before[block] > 0).sum()),
                prior_sigma=_median(before[block]),
                sigma=_median(after[block]),
            )
        )
        for block in Block
    }


def _median(values: Floats) -> float | None:
    free = values[values > 0]
    return float(np.median(free)) if len(free) else None


def _short(figures: Section) -> Section:
    """The same with numbers of so many digits."""
    numbers = {name: value for name, value in figures if isinstance(value, float)}
    return figures.model_copy(
        update={name: float(f"{value:.{DIGITS}g}") for name, value in numbers.items()}
    )
