"""The photographs of a run, each read with its sidecar, none changed."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tbcad.common.atomic_files import InFolder
from tbcad.errors import InputError
from tbcad.records.exposure import PHOTOGRAPHS, Exposure, Frame, exposure_name
from tbcad.records.run import RunRecord, read_record
from tbcad.rig.runs.images import Image16, decoded_image

AGAIN = Exposure.MISSING


@dataclass(frozen=True)
class Run(InFolder):
    """A run's folder."""

    folder: Path  # where it lies
    record: RunRecord  # what was to be photographed
    exposures: Mapping[str, Exposure]  # what has been, by name
    faults: Mapping[str, str]  # for each name that is missing or unusable, why, in one line

    def exposure(self, frame: Frame, phase: str) -> Exposure | None:
        """The exposure of a frame in a phase, if it is usable."""
        return self.exposures.get(exposure_name(frame, phase))

    def of_frames(self, frames: tuple[Frame, ...]) -> "Run":
        """The same run with some of its frames only."""
        names = {exposure_name(frame, phase) for frame in frames for phase in self.record.phases}
        return Run(
            self.folder,
            self.record.model_copy(update={"frames": frames}),
            {name: one for name, one in self.exposures.items() if name in names},
            {name: fault for name, fault in self.faults.items() if name in names},
        )


def read_run(folder: Path) -> Run:
    """Read record and sidecars of a run; photographs themselves are read when they are needed.

    Raises:
        InputError: the folder is no run; a photograph that is missing or unlike the others is no
            error but a fault, and the rest goes on.
    """
    record = read_record(folder)
    exposures: dict[str, Exposure] = {}
    faults: dict[str, str] = {}
    for frame in record.frames:
        for phase in record.phases:
            name = exposure_name(frame, phase)
            try:
                exposures[name] = _exposure(folder, record, frame, phase)
            except InputError as error:
                faults[name] = str(error)
    return Run(folder, record, exposures, faults)


def read_photograph(run: Run, exposure: Exposure) -> Image16:
    """The image of an exposure, (h, w, 3), 8 or 16 bits a channel.

    Raises:
        InputError: the file is damaged, changed since it was taken, or of another size.
    """
    path = run.folder / PHOTOGRAPHS / exposure.file
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: {AGAIN}") from None
    if hashlib.sha256(data).hexdigest() != exposure.sha256:
        raise InputError(f"{path} is not the file that was photographed: {AGAIN}")
    pixels = decoded_image(data, str(path))
    if pixels.shape[:2] != (exposure.height_px, exposure.width_px):
        raise InputError(f"{path} has another size than its sidecar says: {AGAIN}")
    return pixels


def _exposure(folder: Path, record: RunRecord, frame: Frame, phase: str) -> Exposure:
    """The sidecar of one photograph, if it fits the record."""
    path = folder / PHOTOGRAPHS / f"{exposure_name(frame, phase)}.json"
    found = Exposure.read(path)
    if (found.frame, found.phase) != (frame, phase) or Path(found.file).stem != path.stem:
        raise InputError(f"{path} is of another photograph: {AGAIN}")
    if (found.width_px, found.height_px) != (record.width_px, record.height_px):
        raise InputError(f"{path}: the photograph has another size than the run: {AGAIN}")
    locked = record.locked_in(phase)
    changed = [name for name, value in locked.items() if found.settings.get(name) != value]
    if changed:
        raise InputError(f"{path}: {changed[0]} is not what the run is locked to: {AGAIN}")
    return found


def check_same_export(run: Run, exports: Path) -> None:
    """Compare the files that the run depends on with what they were when it began.

    Raises:
        InputError: one has changed or is missing.
    """
    for name, digest in run.record.export_sha256.items():
        path = exports / name
        if not path.is_file():
            raise InputError(f"{path} is not there, but {run.folder} was photographed with it")
        if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            raise InputError(
                f"{path} is not the file that {run.folder} was photographed with: name the export "
                "of that run with --exports"
            )
