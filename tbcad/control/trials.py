"""What a run is locked to, by a photograph with each exposure time that is not kept."""

from collections.abc import Iterable, Mapping

from tbcad.control.faults import CameraFault
from tbcad.control.plan import Plan
from tbcad.control.selection import RunOptions
from tbcad.control.shooting import SHUTTER, Photograph
from tbcad.errors import InputError
from tbcad.records.exposure import Setting
from tbcad.records.run import PhaseExposure, RunRecord

OF_EXPOSURE = (SHUTTER, "shutterspeed2", "exposure_s")  # settings that an exposure time changes


def run_record(
    plan: Plan, options: RunOptions, trials: Mapping[str, Photograph], seconds: float
) -> RunRecord:
    """The record of a run.

    Args:
        plan: of the export.
        options: what is photographed.
        trials: a photograph for each phase.
        seconds: expected duration.

    Raises:
        InputError: the camera changes more than the exposure time.
    """
    try:
        locked = common_settings(trials.values())
    except CameraFault as fault:
        raise InputError(f"the camera: {fault}") from None
    trial = next(iter(trials.values()))
    return RunRecord(
        export_sha256=plan.sha256,
        source="camera",
        camera=trial.model,
        width_px=trial.facts.width_px,
        height_px=trial.facts.height_px,
        phases=tuple(trials),
        frames=options.frames,
        locked=locked,
        exposures={
            name: PhaseExposure(
                asked_s=one.asked_s,
                settings={key: value for key, value in one.settings.items() if key not in locked},
            )
            for name, one in trials.items()
            if one.asked_s is not None
        },
        seconds=round(seconds, 1),
    )


def common_settings(photographs: Iterable[Photograph]) -> dict[str, Setting]:
    """Settings that are the same at all exposure times.

    Raises:
        CameraFault: one differs that the exposure time should leave as it is.
    """
    first, *others = [photograph.settings for photograph in photographs]
    for other in others:
        for name in sorted((first.keys() | other.keys()) - {*OF_EXPOSURE}):
            if first.get(name) != other.get(name):
                raise CameraFault(
                    f"{name} is {first.get(name)} at one exposure time and {other.get(name)} at "
                    "another: set it to one value"
                )
    same = [name for name in first if all(first[name] == other.get(name) for other in others)]
    return {name: first[name] for name in same}
