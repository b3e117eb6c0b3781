"""The public functions of `import tbcad`: design, build, verify, capture, analyse.

The commands of `tbcad` call the same functions. Heavy libraries are imported inside them, so that
bad input is refused before they are loaded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from tbcad.errors import InputError
from tbcad.loading import large_libraries
from tbcad.spec.design import Spec
from tbcad.spec.load import load_spec, option_texts

if TYPE_CHECKING:
    from tbcad_verify.report.as_made import AsMade
    from tbcad_verify.report.report import Report
    from tbcad_verify.run.verify import VerifyOptions

    from tbcad.simulate.capture.geometry import CameraPhotographs, Geometry
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.scene.object import Paint, SceneObject
    from tbcad.tolerance.analysis import Analysis
    from tbcad.tolerance.options import ToleranceOptions
    from tbcad.types import Progress
    from tbcad.whole_design import Design

Settings = Mapping[str, str] | Sequence[str]
AS_MADE_STAGE = "simulated builds by each process"


def silent(_: str) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class Build:
    """What a build wrote.

    Attributes:
        folder: that holds all files.
        design: the mirrors.
        parts: what was built: "shell", "prototype" or both.
        note: why the prototype was left out; empty when it was not.
        report: the verification of the files; None when it was not asked for.
    """

    folder: Path
    design: Design
    parts: tuple[str, ...]
    note: str
    report: Report | None

    def __repr__(self) -> str:
        """Return folder and verdict."""
        verdict = "not verified" if self.report is None else self.report.verdict
        return f"<Build {self.folder}: {' and '.join(self.parts)}; {verdict}>"

    @property
    def passed(self) -> bool:
        """Whether the files are verified and pass every check."""
        return self.report is not None and self.report.passed


def design(
    spec: Spec | Path | str | None = None,
    *,
    n: int | None = None,
    settings: Settings = (),
    detail: Progress = silent,
) -> Design:
    """Compute the mirrors of both cameras.

    Args:
        spec: a spec, a design file (TOML), or None for the design of the paper.
        n: subdivision of the icosahedron, in place of the spec's.
        settings: "key=value" texts or a mapping of them, on top of a design file.
        detail: called with the state of the search for the radii.

    Raises:
        SpecError: the spec is not allowed, or its mirrors cannot be made; it says what to change.

    >>> import tbcad
    >>> tbcad.design(n=4)
    <Design 'turtleback': n = 4, 49 + 49 mirrors, minimum coverage 60.60 mm>
    """
    from tbcad.mirrors.array import design as mirror_design
    from tbcad.whole_design import Design

    mirrors = mirror_design(_spec(spec, n, settings), detail)
    return Design(mirrors.spec, mirrors.arrays)


def _spec(spec: Spec | Path | str | None, n: int | None, settings: Settings) -> Spec:
    if isinstance(spec, Spec):
        if settings or n is not None:
            raise InputError("n and settings go with a design file: give them to load_spec")
        return spec
    options = option_texts(settings) + ([f"optics.n={n}"] if n is not None else [])
    return load_spec(None if spec is None else Path(spec), options)


def build(
    spec: Spec | Path | str | None = None,
    out: Path | str = "exports",
    *,
    parts: Sequence[str] | None = None,
    verify: bool = True,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> Build:
    """Compute the mirrors, write all files into a folder, and verify the files written.

    The folder is replaced as a whole or not at all.

    Args:
        spec: a spec, a design file (TOML), or None for the design of the paper.
        out: folder to write.
        parts: "shell", "prototype" or both; None: both, but no prototype where none can be made.
        verify: verify the files before they replace those of an earlier build.
        force: keep files in the folder that tbcad did not write, instead of refusing.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Raises:
        InputError: the folder cannot be replaced, or the spec is not allowed; nothing is written.
    """
    with large_libraries():
        from tbcad.background import background_process
        from tbcad.output.build import write_export
        from tbcad.output.folder import check_replaceable, replacing
        from tbcad.output.parts import SHELL, default_parts
        from tbcad.whole_design import Design

    chosen, out = _spec(spec, None, ()), Path(out)
    asked = tuple(parts) if parts is not None else default_parts(chosen)
    check_replaceable(out, force)
    started = monotonic()
    progress("mirrors: radii and cells")
    mirrors = design(chosen, detail=detail)
    with replacing(out, force) as folder:
        with background_process() as submit:
            simulated = submit(_as_made, mirrors) if verify and SHELL in asked else None
            export = write_export(
                mirrors, folder, asked, progress, submit, optional_prototype=parts is None
            )
        finished = Design(export.spec, mirrors.arrays)
        report = None
        if verify:
            # The files are read back before they replace the old ones.
            report = replace(
                _verify(folder, progress=progress),
                folder=out,
                note=export.note,
                as_made=simulated.result() if simulated else None,
                seconds=monotonic() - started,
            )
    return Build(out, finished, export.parts, export.note, report)


def _as_made(mirrors: Design) -> AsMade:
    """Simulate a few builds of a design by every built-in process."""
    from tbcad.simulate.scene.reflector import reflectors
    from tbcad.tolerance.as_made import as_made

    spec = mirrors.spec
    target, coat = spec.optics.capture_diameter_mm, spec.mirrors.coating_um
    return as_made(reflectors(mirrors), target, coat)


def as_made(
    exports: Path | str, progress: Progress = silent, detail: Progress = silent
) -> AsMade | None:
    """Simulate a few builds of an export by every built-in process.

    Returns:
        Their yields; None where no shell was built, or its record cannot be read.
    """
    from tbcad.simulate.scene.exported import read_export
    from tbcad.tolerance.as_made import as_made as simulated

    folder = Path(exports)
    if not (folder / "shell_a.stl").is_file():
        return None
    progress(AS_MADE_STAGE)
    try:
        export = read_export(folder)
    except InputError:  # the verification says what is wrong with it
        return None
    coat = export.spec.mirrors.coating_um
    return simulated(export.reflectors, export.capture_mm, coat, detail)


def verify(
    exports: Path | str,
    options: VerifyOptions | None = None,
    *,
    progress: Progress = silent,
) -> Report:
    """Verify the files of a build with code that shares nothing with the code that wrote them.

    Args:
        exports: folder that `build` wrote.
        options: what else to check, and how long a stage may take.
        progress: called with the name of each stage.

    Returns:
        The report; `report.passed` is the verdict. It is written to verify.json too.

    Raises:
        InputError: the folder is no readable export.
    """
    from tbcad_verify.errors import BadExport
    from tbcad_verify.run.verify import VerifyOptions
    from tbcad_verify.run.verify import verify as verify_files

    def stage(name: str) -> None:
        progress(f"verification: {name}")

    try:
        return verify_files(Path(exports), stage, options or VerifyOptions())
    except BadExport as error:
        raise InputError(str(error)) from None


_verify = verify  # the parameter of build has the same name


def capture(
    exports: Path | str,
    object_file: Path | str | None = None,
    *,
    out: Path | str | None = None,
    geometry: Geometry = "spheres",
    fit: bool = False,
    paint: Paint = "own",
    samples: int = 1,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> LightField:
    """Simulate the photographs of both cameras through the mirrors of a build.

    Args:
        exports: folder that `build` wrote.
        object_file: triangle mesh, mm, z up, about the origin; None for a built-in knot.
        out: folder to write photographs and light field to, as `tbcad capture` does; None: none.
        geometry: mirrors of the record ("spheres"), of the exported meshes ("mesh"), or the
            prototype's balls, stop by stop ("prototype").
        fit: move and scale the object into the capture sphere.
        paint: colours of the file ("own"), a pattern, or plain grey.
        samples: a pixel is the mean of samples x samples rays.
        force: keep files in the folder that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The light field, in memory: for every pixel the ray it sees along and its colour.

    Raises:
        InputError: export or object cannot be read, or the folder cannot be replaced.
    """
    from tbcad.simulate.capture.light_field import LightField, light_field_in_memory

    photographs = photograph(exports, object_file, geometry, fit, paint, samples, progress, detail)
    if out is not None:
        write_photographs(photographs, Path(out), force, progress)
        return LightField.read(Path(out))
    progress("photographs and light field")
    bands = ((reflector, bands()) for reflector, bands in photographs.cameras)
    return light_field_in_memory(bands, photographs.capture_mm, photographs.facts)


@dataclass(frozen=True)
class Photographs:
    """Both photographs before they are taken: light is traced when their bands are asked for.

    Attributes:
        cameras: each camera with what gives its bands of pixel rows.
        subject: the object before the cameras.
        capture_mm: diameter of the capture sphere.
        facts: how they are taken: design, n, geometry, samples.
    """

    cameras: CameraPhotographs
    subject: SceneObject
    capture_mm: float
    facts: dict[str, Any]


def photograph(
    exports: Path | str,
    object_file: Path | str | None,
    geometry: Geometry,
    fit: bool,
    paint: Paint,
    samples: int,
    progress: Progress,
    detail: Progress,
) -> Photographs:
    """Prepare both photographs; arguments as for `capture`."""
    from tbcad.simulate.capture.geometry import camera_photographs
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object import load_or_built_in
    from tbcad.simulate.scene.ray_casting import prepared_scene

    progress("object and scene")
    export = read_export(Path(exports))
    subject = load_or_built_in(object_file, export.capture_mm, fit, paint)
    cameras = camera_photographs(export, prepared_scene(subject), geometry, samples, detail)
    facts = {
        "object": subject.name,
        "design": export.spec.name,
        "n": export.spec.optics.n,
        "geometry": geometry,
        "samples": samples,
    }
    return Photographs(cameras, subject, export.capture_mm, facts)


def write_photographs(
    photographs: Photographs, out: Path, force: bool, progress: Progress
) -> dict[str, Any]:
    """Take both photographs and replace a folder by their files; return the record of them."""
    from tbcad.output.folder import replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.simulate.capture.files import write_capture

    progress("photographs and light field")
    with replacing(out, force) as folder:
        record = write_capture(
            folder,
            photographs.cameras,
            photographs.subject,
            photographs.capture_mm,
            photographs.facts,
        )
        write_manifest(folder)
    return record


def analyse(
    exports: Path | str,
    process: str | None = None,
    object_file: Path | str | None = None,
    *,
    settings: Settings = (),
    options: ToleranceOptions | None = None,
    progress: Progress = silent,
    detail: Progress = silent,
    answer: Progress = silent,
) -> Analysis:
    """Simulate many builds by a manufacturing process, and find what limits their yield.

    Args:
        exports: folder that `build` wrote.
        process: "fdm", "sls", "sla", "cnc", "diamond", or a TOML file; by default "sla", and the
            yields of all built-in processes are compared.
        object_file: mesh that is photographed for the sharpness; None for a built-in knot.
        settings: "kind=value" texts that change errors of the process.
        options: number of builds, wanted yield, seed, whether margins are searched for ...
        progress: called with the name of each stage.
        detail: called with the state of a stage.
        answer: called with the yield, in words, as soon as it is known.

    Raises:
        InputError: export or process cannot be read, or mirrors are planar.
    """
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object import load_or_built_in
    from tbcad.tolerance.analysis import analyse as analyse_export
    from tbcad.tolerance.options import ToleranceOptions
    from tbcad.tolerance.process.process import DEFAULT_PROCESS, load_process
    from tbcad.tolerance.stages import RECORD

    asked = options or ToleranceOptions()
    asked = asked if process else replace(asked, every_process=True)
    made_by = load_process(process or DEFAULT_PROCESS, option_texts(settings))
    progress(RECORD)
    export = read_export(Path(exports))
    subject = load_or_built_in(object_file, export.capture_mm)
    return analyse_export(export, made_by, subject, asked, progress, detail, answer)
