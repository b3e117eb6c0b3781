"""One object from all rays of a light field."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.errors import InputError
from tbcad.options.call import keywords
from tbcad.options.captures import ReconstructOptions
from tbcad.options.checks import LIGHT_FIELD_FILE, check_is_capture
from tbcad.options.shared import AnyPath

if TYPE_CHECKING:
    from trimesh import Trimesh

    from tbcad.light.reconstruction.field import Field
    from tbcad.light.simulate.capture.light_field import LightField

# Bytes at the most, as measured (docs/reconstruct.md): of each pixel of all photographs, and of
# each node of the finest cube.
PIXEL_BYTES, NODE_BYTES = 300, 110
EVERY = "all"
SURFACE = "surface"
# For the time left: of a pixel that is read, of a pixel and node by each epoch, and of the surface.
READ_S, EPOCH_S, SURFACE_S, CHOICE_EPOCHS = 2e-6, 2e-8, 10.0, 6


@dataclass(frozen=True)
class Reconstructed:
    """A field that was written."""

    file: Path  # where
    field: Field  # itself
    kept: bool  # whether it was there already
    meshes: dict[str, Any]  # each file with its surface, and what is known of that

    def record(self) -> dict[str, Any]:
        """For other programs."""
        return {
            "file": str(self.file),
            "kept": self.kept,
            **self.field.facts,
            "meshes": self.meshes,
        }


@keywords(ReconstructOptions)
def reconstruct(options: ReconstructOptions) -> Field:
    """Fit one field of density and colour to all rays of a light field, and write it.

    A frame may be "all": each, started from the one before, in files with its number.

    Returns:
        The field, of the last frame if there are several.

    Raises:
        InputError: the light field cannot be read or shows nothing, or a file cannot be written.
    """
    return reconstruct_files(options, checked_frames(options))[-1].field


@dataclass(frozen=True)
class FrameFiles:
    """The files of one frame, or of the capture itself."""

    number: int | None  # of the frame
    field: Path
    part: Path  # checkpoint of the field
    meshes: tuple[Path, ...]
    volumes: tuple[Path, ...]  # one, if it is asked for

    @classmethod
    def of(cls, options: ReconstructOptions, number: int | None) -> FrameFiles:
        """Those that are asked for; of all frames, each with its number."""
        from tbcad.light.reconstruction.field import field_file
        from tbcad.light.reconstruction.start import part_file

        end = f"-{number}" if options.frame == EVERY else ""

        def numbered(file: AnyPath) -> Path:
            return Path(file).with_stem(Path(file).stem + end)

        field = numbered(options.out) if options.out else field_file(_folder(options), number)
        volumes = tuple(numbered(file) for file in (options.volume,) if file is not None)
        meshes = tuple(map(numbered, options.meshes))
        return cls(number, field, part_file(field), meshes, volumes)


def _folder(options: ReconstructOptions) -> Path:
    """Of the light field."""
    capture = Path(options.capture)
    return capture if capture.is_dir() else capture.parent


def reconstruct_files(options: ReconstructOptions, frames: list[FrameFiles]) -> list[Reconstructed]:
    """Reconstruct and write all that is asked for."""
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.capture.sequence import sequence_frame

    done: list[Reconstructed] = []
    with LightField.open(Path(options.capture)) as stored:
        check_memory(stored, options)
        for frame in frames:
            source, staged = stored, options
            if frame.number is not None:
                source = sequence_frame(stored, _folder(options), frame.number)
            if options.frame == EVERY:
                staged = replace(options, progress=partial(_tell, options, frame))
            last = done[-1].field if done else None
            done.append(_reconstructed(source, staged, frame, last))
    return done


def _tell(options: ReconstructOptions, frame: FrameFiles, stage: str) -> None:
    options.progress(f"frame {frame.number}: {stage}")


def _reconstructed(
    source: LightField, options: ReconstructOptions, frame: FrameFiles, last: Field | None
) -> Reconstructed:
    from tbcad.common.atomic_files import replace_files
    from tbcad.light.reconstruction.field import read_field, write_field
    from tbcad.light.reconstruction.files import volume_file
    from tbcad.light.reconstruction.fitted import asked_for, reconstruction
    from tbcad.light.reconstruction.picture import write_preview
    from tbcad.light.reconstruction.start import check_same

    kept = options.resume and frame.field.exists()
    show = partial(write_preview, Path(options.preview)) if options.preview else lambda _: None
    if kept:
        made = read_field(frame.field)
        check_same(frame.field, made.facts, asked_for(source, options, last))
    else:
        if not options.resume:
            frame.part.unlink(missing_ok=True)
        made = reconstruction(source, options, frame.part, last, show)
        write_field(frame.field, made)
    frame.part.unlink(missing_ok=True)
    for volume in frame.volumes:
        if options.force or not volume.exists():
            replace_files(volume.parent, {volume.name: volume_file(made)})
    return Reconstructed(frame.field, made, kept, _meshes(made, source, options, frame))


def checked_frames(options: ReconstructOptions) -> list[FrameFiles]:
    """Refuse, before any work, what cannot be read or written; the files of each frame."""
    capture, folder = Path(options.capture), _folder(options)
    check_is_capture(capture)
    if options.blur_px and options.rays == 1:
        raise InputError(
            f"--blur {options.blur_px:g} is for several rays a pixel: add --rays 12, or leave it "
            "out"
        )
    if options.force and options.resume:
        raise InputError("--force and --resume exclude each other: leave one out")
    from tbcad.light.simulate.capture.sequence import NAME, frame_count
    from tbcad.output.single_files import check_file

    numbers = range(frame_count(folder)) if options.frame == "all" else (options.frame,)
    frames = [FrameFiles.of(options, number) for number in numbers]
    light_field = folder / LIGHT_FIELD_FILE if capture.is_dir() else capture
    taken: set[Path] = set()
    for file, suffixes, may_be in _files(options, frames):
        check_file(file, may_be, (light_field, folder / NAME), suffixes)
        if (place := file.parent.resolve() / file.name) in taken:
            raise InputError(f"{file} is named twice: choose another name")
        taken.add(place)
    for part in (frame.part for frame in frames):
        if part.exists() and not (options.resume or options.force):
            raise InputError(f"{part} exists: go on with --resume, or begin anew with --force")
    return frames


def _files(
    options: ReconstructOptions, frames: list[FrameFiles]
) -> Iterator[tuple[Path, tuple[str, ...], bool]]:
    """Each file to write, its suffixes, and whether it may exist."""
    from tbcad.light.reconstruction.field import SUFFIX
    from tbcad.light.reconstruction.files import MESH_SUFFIXES, VOLUME_SUFFIX

    may_be = options.force or options.resume
    if options.preview is not None:
        yield Path(options.preview), (".png",), may_be
    for frame in frames:
        yield frame.field, (SUFFIX,), may_be
        done = options.force or (options.resume and frame.field.exists())
        yield from ((mesh, MESH_SUFFIXES, done) for mesh in frame.meshes)
        yield from ((volume, (VOLUME_SUFFIX,), done) for volume in frame.volumes)


def expected_seconds(options: ReconstructOptions, frames: list[FrameFiles]) -> dict[str, float]:
    """About how long each stage takes, by its title, on two cores."""
    from tbcad.light.reconstruction.fitted import CHOICE, READING, level_name, levels
    from tbcad.light.simulate.capture.light_field import LightField

    with LightField.open(Path(options.capture)) as source:
        count = pixels(source)
    of_fit = {level_name(one): EPOCH_S * count * one.nodes * one.epochs for one in levels(options)}
    coarsest, *_, finest = [*of_fit] * 2
    of_fit[finest] *= options.rays
    of_frame = {READING: READ_S * count, CHOICE: CHOICE_EPOCHS * of_fit[coarsest], **of_fit}
    if options.meshes:
        of_frame[SURFACE] = SURFACE_S
    if options.frame != EVERY:
        return of_frame
    return {
        f"frame {number}: {stage}": seconds
        for number in range(len(frames))
        for stage, seconds in of_frame.items()
        if number == 0 or stage not in (CHOICE, coarsest)
    }


def pixels(source: LightField) -> int:
    """Number of all pixels of both photographs."""
    return sum(frame.camera.width_px * frame.camera.height_px for frame in source.frames.values())


def check_memory(source: LightField, options: ReconstructOptions) -> None:
    """Refuse what this computer has no memory for."""
    count = pixels(source)
    needed = (PIXEL_BYTES * count + NODE_BYTES * options.nodes**3) / 1e9
    free = available_memory_gb()
    if free is not None and needed > free:
        raise InputError(
            f"memory is short: {needed:.1f} GB are needed for {count} pixels and --nodes "
            f"{options.nodes}, {free:.1f} GB are free: end other programs, or take fewer nodes"
        )


def available_memory_gb() -> float | None:
    """Memory that new work may take; None where the system does not say."""
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii")
    except OSError:
        return None
    match = re.search(r"^MemAvailable:\s+(\d+) kB", text, re.MULTILINE)
    return int(match[1]) * 1024 / 1e9 if match else None


def _meshes(
    made: Field, source: LightField, options: ReconstructOptions, frame: FrameFiles
) -> dict[str, Any]:
    """Write the files of the surface that are not there yet; what is known of them."""
    files = [file for file in frame.meshes if options.force or not file.exists()]
    if not files:
        return {}
    from tbcad.common.atomic_files import replace_files
    from tbcad.light.reconstruction.files import mesh_file
    from tbcad.light.reconstruction.surface import field_mesh

    options.progress(SURFACE)
    if (level := made.facts["surface_level"]) is None:
        raise InputError(f"{frame.field} is empty, without a surface: leave out --mesh")
    surface = field_mesh(made, level, made.facts["resolved_mm"])
    for file in files:
        replace_files(file.parent, {file.name: mesh_file(surface, file.suffix)})
    known = {"triangles": len(surface.faces)}
    if frame.number is None:
        known |= _distances(surface, source, _folder(options))
    return {str(file): known for file in files}


def _distances(surface: Trimesh, source: LightField, folder: Path) -> dict[str, Any]:
    """How far a surface is from the true one, if the capture has it as it stood."""
    from tbcad.light.reconstruction.files import mesh_distance
    from tbcad.light.reconstruction.rays import captured_rays
    from tbcad.light.simulate.capture.files import OBJECT, read_object

    if not (folder / OBJECT).is_file():
        return {}
    return asdict(mesh_distance(surface, read_object(folder), captured_rays(source)))
