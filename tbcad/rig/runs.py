"""A run's folder: photographs of all stops and what is known of each, real or simulated.

Each photograph is safe on disk before the next is taken, and counts when its sidecar is there and
fits it. The image takes its name first, the sidecar second, the journal's line last; each is on the
disk before the next step. So whatever ends a run leaves photographs that count, and at most one
that is taken again.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.checked_files import parse_json
from tbcad.cad.formats.pictures import PICTURE_SUFFIXES, picture_of, read_picture
from tbcad.cad.formats.pixels import Picture
from tbcad.common.atomic_files import InFolder
from tbcad.errors import InputError
from tbcad.records.prototype import Prototype
from tbcad.records.run import (
    JOURNAL,
    PHOTOGRAPHS,
    RECORD,
    Exposure,
    Frame,
    RunRecord,
    Setting,
    exposure_name,
    read_record,
)
from tbcad.types import Floats

Image16: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]
AGAIN = Exposure.MISSING
PARTIAL = ".tbcad-"  # begin of the names of files that are not complete
TAKEN = "taken"


def read_image(path: Path) -> Image16:
    """The photograph in a file, (h, w, 3), 8 or 16 bits; InputError: it cannot be read exactly."""
    return _three_channels(read_picture(path), str(path))


def decoded_image(data: bytes, name: str) -> Image16:
    """The photograph in the bytes of a file of this name; else as `read_image`."""
    return _three_channels(picture_of(data, name), name)


def _three_channels(picture: Picture, name: str) -> Image16:
    whole: NDArray[Any] = _in_16_bits(picture, name) if picture.dtype == np.float32 else picture
    return whole if whole.ndim == 3 else np.repeat(whole[..., None], 3, axis=2)


def _in_16_bits(light: Picture, name: str) -> Image16:
    """Floating-point light, 0 to 1, to the nearest of 65,535 steps."""
    if light.max() > 1:
        raise InputError(
            f"{name} has light of {light.max():g}: allowed in floating point is 0 to 1: scale all "
            "photographs alike"
        )
    return np.rint(light.astype(np.float64) * 65_535).astype(np.uint16)


@dataclass(frozen=True)
class Run(InFolder):
    """A run's folder."""

    folder: Path  # where it lies
    record: RunRecord  # what was to be photographed
    exposures: Mapping[str, Exposure]  # what has been, by name
    faults: Mapping[str, str]  # for each name that is missing or unusable, why, in one line

    def __repr__(self) -> str:
        """The run in a line: where it lies, and how many photographs are usable or not."""
        missing = f", {len(self.faults)} missing or unusable" if self.faults else ""
        return f"<Run {self.folder}: {len(self.exposures)} photographs{missing}>"

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


def frames_of(angle: Floats) -> tuple[Frame, ...]:
    """The frames of both runs through stops at base angles (s,), radians."""
    turns: tuple[Literal[0, 180], ...] = (0, 180)
    return tuple(
        Frame(object_turn_deg=turn, stop=stop, base_angle_deg=degrees)
        for turn in turns
        for stop, degrees in enumerate(np.degrees(angle).tolist(), 1)
    )


def read_run(folder: Path) -> Run:
    """Read record and sidecars of a run; photographs themselves are read when they are needed.

    InputError: the folder is no run; a photograph that is missing or unlike the others is no error
    but a fault, and the rest goes on.
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
    """The image of an exposure, (h, w, 3); InputError: it is not what was photographed."""
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


def exposure_of(
    frame: Frame,
    phase: str,
    image: tuple[bytes, str, tuple[int, int]],
    exposure_s: float | None,
    taken: datetime,
    settings: Mapping[str, Setting] | None = None,
) -> Exposure:
    """The sidecar of a photograph: its file's bytes and suffix, and columns and rows."""
    data, suffix, (width, height) = image
    return Exposure(
        frame=frame,
        phase=phase,
        file=exposure_name(frame, phase) + suffix,
        sha256=hashlib.sha256(data).hexdigest(),
        width_px=width,
        height_px=height,
        exposure_s=exposure_s,
        taken=taken,
        settings=dict(settings or {}),
    )


def export_digests(
    exports: Path, names: Iterable[str], if_there: Iterable[str] = ()
) -> dict[str, str]:
    """sha256 of files of a build by name, of some only where they are there.

    InputError: one is not there, or cannot be read.
    """
    digests = {}
    for name in (*names, *(one for one in if_there if (exports / one).exists())):
        try:
            digests[name] = hashlib.sha256((exports / name).read_bytes()).hexdigest()
        except FileNotFoundError:
            raise InputError(f"{exports / name} is not there: {Prototype.MISSING}") from None
        except OSError as error:
            raise InputError(f"{exports / name} cannot be read: {error.strerror}") from None
    return digests


def check_same_export(folder: Path, record: RunRecord, exports: Path) -> None:
    """Refuse a build whose files are not those that a run began with; InputError: which."""
    for name, digest in record.export_sha256.items():
        if export_digests(exports, [name])[name] != digest:
            raise InputError(
                f"{exports / name} is not the file that {folder} was photographed with: name the "
                "build of that run"
            )


class DiskFault(Exception):
    """A file of the run cannot be written; what was written before is safe."""


@dataclass(frozen=True)
class RunWriter:
    """Adds photographs to a run's folder that `new_run` or `resumed_run` prepared."""

    folder: Path
    record: RunRecord  # what is to be photographed
    taken: set[str]  # names of the photographs that count

    def add(self, exposure: Exposure, data: bytes) -> None:
        """Write a photograph with its sidecar and line; DiskFault: it does not count then."""
        photographs = self.folder / PHOTOGRAPHS
        name = exposure_name(exposure.frame, exposure.phase)
        with _disk_faults(self.folder):
            photographs.mkdir(exist_ok=True)
            write_safely(photographs / exposure.file, data)
            write_safely(photographs / f"{name}.json", exposure.text().encode())
        self.log(TAKEN, name=name)
        self.taken.add(name)

    def log(self, event: str, **facts: Any) -> None:
        """Add a line to the journal; DiskFault: the disk is full, or fails."""
        line = json.dumps({"time": datetime.now(UTC).isoformat(), "event": event} | facts)
        with _disk_faults(self.folder), (self.folder / JOURNAL).open("ab") as file:
            file.write(line.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())


def check_new(folder: Path) -> None:
    """Refuse a folder that holds anything; InputError: it does."""
    if folder.is_dir() and all(path.name.startswith(PARTIAL) for path in folder.iterdir()):
        return
    if (folder / RECORD).is_file():
        raise InputError(f"{folder} holds a run: go on with it by --resume, or name another folder")
    if folder.exists():
        raise InputError(f"{folder} is not empty: name a new folder")


def new_run(folder: Path, record: RunRecord) -> RunWriter:
    """Begin a run in a folder; InputError: it is not empty, or cannot be written."""
    check_new(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_safely(folder / RECORD, record.text().encode())
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written: {error.strerror}: choose another folder"
        ) from None
    return RunWriter(folder, record, set())


def resumed_run(folder: Path) -> RunWriter:
    """Go on with a run: keep each photograph that is complete, and remove remains of others."""
    record = read_record(folder)
    run = read_run(folder)
    kept = {name: one for name, one in run.exposures.items() if _is_whole(folder, one)}
    writer = RunWriter(folder, record, set(kept))
    names = {exposure_name(frame, phase) for frame in record.frames for phase in record.phases}
    try:
        _remove_remains(folder, names, kept)
        told = _end_journal(folder / JOURNAL)
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written: {error.strerror}: make it writable"
        ) from None
    for name in sorted(set(kept) - told):
        writer.log(TAKEN, name=name, found=True)
    return writer


def _is_whole(folder: Path, exposure: Exposure) -> bool:
    """Whether the image is there, byte for byte."""
    try:
        with (folder / PHOTOGRAPHS / exposure.file).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == exposure.sha256
    except OSError:
        return False


def _remove_remains(folder: Path, names: set[str], kept: dict[str, Exposure]) -> None:
    """Remove what is left of photographs that do not count, and files that were not complete."""
    for path in (*folder.glob(f"{PARTIAL}*"), *(folder / PHOTOGRAPHS).glob(f"{PARTIAL}*")):
        path.unlink()
    whole = {f"{name}.json" for name in kept} | {one.file for one in kept.values()}
    for path in (folder / PHOTOGRAPHS).glob("*"):
        ours = path.stem in names and path.suffix in (*PICTURE_SUFFIXES, ".json")
        if ours and path.name not in whole:
            path.unlink()


def _end_journal(path: Path) -> set[str]:
    """Cut off a line that is not complete; names of the photographs that the others tell."""
    if not path.exists():
        return set()
    data = path.read_bytes()
    whole = data[: data.rfind(b"\n") + 1]
    if whole != data:
        with path.open("r+b") as file:
            file.truncate(len(whole))
            os.fsync(file.fileno())
    return {name for name in map(_name_taken, whole.splitlines()) if name}


def _name_taken(line: bytes) -> str:
    try:
        told = parse_json(line)
    except ValueError:
        return ""
    taken = isinstance(told, dict) and told.get("event") == TAKEN
    return str(told.get("name", "")) if taken else ""


def write_safely(path: Path, data: bytes) -> None:
    """Write a file that has its name only when it is whole and on the disk; OSError: it is not."""
    partial = path.with_name(PARTIAL + path.name)
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make names in a folder safe, where the system can."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _disk_faults(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise DiskFault(f"{folder} cannot be written: {error.strerror or error}") from None
