"""One object from all rays of a light field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tbcad.errors import InputError
from tbcad.options.call import silent

if TYPE_CHECKING:
    from trimesh import Trimesh

    from tbcad.reconstruction.field import Field
    from tbcad.reconstruction.options import Options
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.types import Progress

LIGHT_FIELD = "lightfield.h5"
PREVIEW_DEG, PREVIEW_MM, PREVIEW_PX = (30.0, 30.0), 640.0, (480, 360)
# Bytes at the most, as measured (docs/reconstruct.md): of each pixel of all photographs, and of
# each node of the finest cube.
PIXEL_BYTES, NODE_BYTES = 300, 110
EVERY: Literal["all"] = "all"
SURFACE = "surface"
# For the time left: of a pixel that is read, of a pixel and node by each epoch, and of the surface.
READ_S, EPOCH_S, SURFACE_S, CHOICE_EPOCHS = 2e-6, 2e-8, 10.0, 6


@dataclass(frozen=True)
class Wanted:
    """Files of a reconstruction.

    Attributes:
        capture: folder of a capture or merged run, or its light field.
        out: the field; None: beside the light field.
        frame: of the capture's sequence, "all" one after the other, or None for the capture itself.
        meshes: files to write the surface to.
        preview: picture that is written after each epoch.
        resume: go on with what was interrupted, and keep what is done.
        force: replace files that exist.
        volume: file to write density and colours on the whole lattice to.
    """

    capture: Path
    out: Path | None = None
    frame: int | Literal["all"] | None = None
    meshes: tuple[Path, ...] = ()
    preview: Path | None = None
    resume: bool = False
    force: bool = False
    volume: Path | None = None

    @property
    def folder(self) -> Path:
        """Of the light field."""
        return self.capture if self.capture.is_dir() else self.capture.parent

    def field_file(self, number: int | None) -> Path:
        """Where the field of a frame is written, or that of the capture itself."""
        from tbcad.reconstruction.field import field_file

        if self.out is None:
            return field_file(self.folder, number)
        return self._numbered(self.out, number)

    def mesh_files(self, number: int | None) -> list[Path]:
        """Where the surface of a frame is written, or that of the capture itself."""
        return [self._numbered(file, number) for file in self.meshes]

    def volume_file(self, number: int | None) -> Path | None:
        """Where the volume of a frame is written, or that of the capture itself."""
        return None if self.volume is None else self._numbered(self.volume, number)

    def part_file(self, number: int | None) -> Path:
        """The checkpoint of that field."""
        from tbcad.reconstruction.checkpoint import part_file

        return part_file(self.field_file(number))

    def _numbered(self, file: Path, number: int | None) -> Path:
        return file.with_stem(f"{file.stem}-{number}") if self.frame == EVERY else file


@dataclass(frozen=True)
class Reconstructed:
    """A field that was written.

    Attributes:
        file: where.
        field: itself.
        kept: whether it was there already.
        meshes: each file with its surface, and what is known of that.
    """

    file: Path
    field: Field
    kept: bool
    meshes: dict[str, Any]

    def record(self) -> dict[str, Any]:
        """For other programs."""
        return {
            "file": str(self.file),
            "kept": self.kept,
            **self.field.facts,
            "meshes": self.meshes,
        }


def reconstruct(
    capture: Path | str,
    *,
    out: Path | str | None = None,
    options: Options | None = None,
    frame: int | Literal["all"] | None = None,
    meshes: Sequence[Path | str] = (),
    volume: Path | str | None = None,
    preview: Path | str | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> Field:
    """Fit one field of density and colour to all rays of a light field, and write it.

    Args:
        capture: folder that `capture` or `merge` wrote, or its light field.
        out: file to write, .npz; None: field.npz beside the light field, field-K.npz for a frame.
        options: grid, epochs, view dependence, rays of a pixel, blur of the lens, seed.
        frame: of the capture's sequence, from 0; "all": each, started from the one before, and each
            file has the frame's number at the end of its name; None: the capture itself.
        meshes: files to write the surface to, .glb, .ply or .stl.
        volume: file to write density and colours on the whole lattice to, .vti.
        preview: PNG file that shows the field after each epoch.
        resume: go on with a fit that was interrupted, and keep what is done.
        force: replace files that exist.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The field, of the last frame if there are several.

    Raises:
        InputError: the light field cannot be read or shows nothing, or a file cannot be written.
    """
    from tbcad.reconstruction.options import Options

    wanted = Wanted(
        Path(capture),
        None if out is None else Path(out),
        frame,
        tuple(map(Path, meshes)),
        None if preview is None else Path(preview),
        resume,
        force,
        None if volume is None else Path(volume),
    )
    return reconstruct_files(wanted, options or Options(), progress, detail)[-1].field


def reconstruct_files(
    wanted: Wanted, options: Options, progress: Progress = silent, detail: Progress = silent
) -> list[Reconstructed]:
    """Reconstruct and write all that is wanted; arguments as for `reconstruct`."""
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.capture.sequence import sequence_frame

    numbers = checked_frames(wanted)
    done: list[Reconstructed] = []
    with LightField.open(wanted.capture) as stored:
        check_memory(stored, options)
        for number in numbers:
            source = stored if number is None else sequence_frame(stored, wanted.folder, number)
            stage = partial(_of_frame, progress, number) if wanted.frame == EVERY else progress
            last = done[-1].field if done else None
            done.append(_reconstructed(source, wanted, number, last, (options, stage, detail)))
    return done


def _of_frame(progress: Progress, number: int | None, stage: str) -> None:
    progress(f"frame {number}: {stage}")


def _reconstructed(
    source: LightField,
    wanted: Wanted,
    number: int | None,
    last: Field | None,
    how: tuple[Options, Progress, Progress],
) -> Reconstructed:
    from tbcad.reconstruction.checkpoint import check_same
    from tbcad.reconstruction.field import read_field, write_field
    from tbcad.reconstruction.fitted import Told, asked_for, reconstruction

    options, stage, detail = how
    file, part = wanted.field_file(number), wanted.part_file(number)
    kept = wanted.resume and file.exists()
    if kept:
        made = read_field(file)
        check_same(file, made.facts, asked_for(source, options, last))
    else:
        if not wanted.resume:
            part.unlink(missing_ok=True)
        told = Told(stage, detail, partial(_show, wanted.preview))
        made = reconstruction(source, options, told, part, last)
        write_field(file, made)
    part.unlink(missing_ok=True)
    _write_volume(made, wanted.volume_file(number), wanted.force)
    return Reconstructed(file, made, kept, _meshes(made, source, wanted, number, stage))


def _write_volume(made: Field, file: Path | None, force: bool) -> None:
    """Write the volume, unless it is there already."""
    if file is None or (file.exists() and not force):
        return
    from tbcad.atomic_files import replace_files
    from tbcad.reconstruction.files import volume_file

    replace_files(file.parent, {file.name: volume_file(made)})


def _show(preview: Path | None, made: Field) -> None:
    """Write how the object looks now."""
    if preview is None:
        return
    from math import radians

    from tbcad.reconstruction.picture import field_picture
    from tbcad.simulate.image_files import write_images
    from tbcad.simulate.scene.viewpoint import camera_around_object

    azimuth, elevation = map(radians, PREVIEW_DEG)
    at = camera_around_object(azimuth, elevation, PREVIEW_MM, made.grid.width_mm, PREVIEW_PX)
    write_images({preview: field_picture(made, at).image})


def checked_frames(wanted: Wanted) -> list[int | None]:
    """Refuse, before any work, what cannot be read or written; the frames, None for the capture.

    Raises:
        InputError: as said.
    """
    from tbcad.output.single_files import check_file
    from tbcad.simulate.capture.sequence import NAME, frame_count
    from tbcad.simulate.image_files import check_image_path

    if wanted.force and wanted.resume:
        raise InputError("--force and --resume exclude each other: leave one out")
    numbers: list[int | None] = [wanted.frame] if wanted.frame != EVERY else []
    if wanted.frame == EVERY:
        numbers = list(range(frame_count(wanted.folder)))
    light_field = wanted.folder / LIGHT_FIELD if wanted.capture.is_dir() else wanted.capture
    inputs = (light_field, wanted.folder / NAME)
    taken: set[Path] = set()
    for file, suffixes, may_be in _files(wanted, numbers):
        check_image_path(file, True, suffixes)
        check_file(file, may_be, inputs)
        if (place := file.parent.resolve() / file.name) in taken:
            raise InputError(f"{file} is named twice: choose another name")
        taken.add(place)
    for part in map(wanted.part_file, numbers):
        if part.exists() and not (wanted.resume or wanted.force):
            raise InputError(f"{part} exists: go on with --resume, or begin anew with --force")
    return numbers


def _files(wanted: Wanted, numbers: list[int | None]) -> list[tuple[Path, tuple[str, ...], bool]]:
    """Each file to write, its suffixes, and whether it may exist."""
    from tbcad.reconstruction.field import SUFFIX
    from tbcad.reconstruction.files import MESH_SUFFIXES, VOLUME_SUFFIX

    files: list[tuple[Path, tuple[str, ...], bool]] = []
    may_be = wanted.force or wanted.resume
    if wanted.preview is not None:
        files.append((wanted.preview, (".png",), may_be))
    for number in numbers:
        made = wanted.field_file(number)
        files.append((made, (SUFFIX,), may_be))
        done = wanted.force or (wanted.resume and made.exists())
        files += [(mesh, MESH_SUFFIXES, done) for mesh in wanted.mesh_files(number)]
        if (dense := wanted.volume_file(number)) is not None:
            files.append((dense, (VOLUME_SUFFIX,), done))
    return files


def expected_seconds(
    wanted: Wanted, options: Options, numbers: list[int | None]
) -> dict[str, float]:
    """About how long each stage takes, by its title, on two cores."""
    from tbcad.reconstruction.fitted import CHOICE, READING, level_name, levels
    from tbcad.simulate.capture.light_field import LightField

    with LightField.open(wanted.capture) as source:
        count = pixels(source)
    of_fit = {level_name(one): EPOCH_S * count * one.nodes * one.epochs for one in levels(options)}
    *_, finest = of_fit
    of_fit[finest] *= options.rays
    of_frame = {
        READING: READ_S * count,
        CHOICE: CHOICE_EPOCHS * next(iter(of_fit.values())),
        **of_fit,
    }
    if wanted.meshes:
        of_frame[SURFACE] = SURFACE_S
    if wanted.frame != EVERY:
        return of_frame
    return {
        f"frame {number}: {stage}": seconds
        for number in numbers
        for stage, seconds in of_frame.items()
        if number == 0 or stage not in (CHOICE, next(iter(of_fit)))
    }


def pixels(source: LightField) -> int:
    """Number of all pixels of both photographs."""
    return sum(frame.camera.width_px * frame.camera.height_px for frame in source.frames.values())


def check_memory(source: LightField, options: Options) -> None:
    """Refuse what this computer has no memory for.

    Raises:
        InputError: as said.
    """
    from tbcad.doctor import available_memory_gb

    count = pixels(source)
    needed = (PIXEL_BYTES * count + NODE_BYTES * options.nodes**3) / 1e9
    free = available_memory_gb()
    if free is not None and needed > free:
        raise InputError(
            f"memory is short: {needed:.1f} GB are needed for {count} pixels and --nodes "
            f"{options.nodes}, {free:.1f} GB are free: end other programs, or take fewer nodes"
        )


def _meshes(
    made: Field, source: LightField, wanted: Wanted, number: int | None, stage: Progress
) -> dict[str, Any]:
    """Write the files of the surface that are not there yet; what is known of them."""
    files = [file for file in wanted.mesh_files(number) if wanted.force or not file.exists()]
    if not files:
        return {}
    from tbcad.atomic_files import replace_files
    from tbcad.reconstruction.files import mesh_file
    from tbcad.reconstruction.surface import field_mesh

    stage(SURFACE)
    if (level := made.facts["surface_level"]) is None:
        raise InputError(
            f"{wanted.field_file(number)} is empty, without a surface: leave out --mesh"
        )
    surface = field_mesh(made, level, made.facts["resolved_mm"])
    for file in files:
        replace_files(file.parent, {file.name: mesh_file(surface, file.suffix)})
    known = {"triangles": len(surface.faces), **_distances(surface, source, wanted, number)}
    return {str(file): known for file in files}


def _distances(
    surface: Trimesh, source: LightField, wanted: Wanted, number: int | None
) -> dict[str, float]:
    """How far a surface is from the true one, if the capture has it as it stood."""
    from tbcad.reconstruction.mesh_distance import mesh_distance
    from tbcad.reconstruction.rays import captured_rays
    from tbcad.simulate.capture.files import OBJECT, read_object

    if number is not None or not (wanted.folder / OBJECT).is_file():
        return {}
    return asdict(mesh_distance(surface, read_object(wanted.folder), captured_rays(source)))
