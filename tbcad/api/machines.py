"""The machine as it is built: photographed, calibrated, merged, drawn."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.api.arguments import silent

if TYPE_CHECKING:
    from tbcad.calibration.intrinsics.checkerboard import SolvedLens
    from tbcad.calibration.options import CalibrationOptions
    from tbcad.calibration.run import WrittenCalibration
    from tbcad.control.outcome import Outcome
    from tbcad.control.selection import Preflight
    from tbcad.control.session import Ask, Show
    from tbcad.merged_run.corrections import Options as MergeOptions
    from tbcad.runs.photographs import Run
    from tbcad.simulate.object_files.contents import Up
    from tbcad.simulate.scene.object_from_file import Unit
    from tbcad.simulated_run.options import RunOptions
    from tbcad.types import Progress


def run(
    exports: Path | str,
    out: Path | str,
    *,
    port: str,
    ask: Ask,
    camera: str = "gphoto2",
    phases: str | None = None,
    stops: str | None = None,
    runs: str | None = None,
    size_px: tuple[int, int] | None = None,
    exposure_leds_s: float | None = None,
    exposure_lit_s: float | None = None,
    preflight: Preflight = "first",
    resume: bool = False,
    send_settings: bool = False,
    timeout_s: float = 30.0,
    show: Show | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Drive the prototype of a build through its stops and photograph it under each light.

    Args:
        exports: folder that `build` wrote.
        out: folder of the run: new, or with `resume` the one to go on with.
        port: serial port of the controller, with GRBL 1.1 or grblHAL, or "moonraker:" and the URL
            of Moonraker, for Klipper.
        ask: called with what a person must do, such as turn the object; whether it is done.
        camera: "gphoto2", "command:PROGRAM ... {output}" or "folder:PATH".
        phases: names of the lights with commas between, "leds" for all LEDs; None: all.
        stops: numbers and ranges such as "1-10,40"; None: all.
        runs: "a", object straight, "b", turned by 180 degrees, or "ab"; None: both.
        size_px: columns and rows of a photograph; None: those of the design.
        exposure_leds_s: exposure time by LEDs and in the dark, s; None: see the next.
        exposure_lit_s: of the lit object, s; one alone is for all, none leaves the camera's own.
        preflight: "first": one stop is looked at under each light before a new run; "only": and
            nothing is photographed; "off": it is not.
        resume: take what is missing in the folder.
        send_settings: send the controller the settings that differ from the export's.
        timeout_s: how long one photograph may take.
        show: shows stages with their expected seconds, as `tbcad.screen.stages`; None: nothing.
        progress: called with the expected duration, and what the operator should know.

    Returns:
        What was photographed, what is missing, and why the run stopped if it did.

    Raises:
        InputError: something was wrong before the first photograph of the run, also an exposure.
    """
    from tbcad.control.run import RunRequest, run_machine
    from tbcad.runs.exposure import PhaseTimes
    from tbcad.screen import stages

    times = PhaseTimes(exposure_leds_s, exposure_lit_s)
    request = RunRequest(
        Path(exports), Path(out), phases, stops, runs, size_px, resume, times, preflight
    )
    return run_machine(
        request,
        port,
        camera,
        ask,
        show or partial(stages, silent=True),
        progress,
        send_settings=send_settings,
        timeout_s=timeout_s,
    )


def simulate_run(
    exports: Path | str,
    out: Path | str,
    process: str = "fdm",
    object_file: Path | str | None = None,
    *,
    up: Up | None = None,
    unit: Unit | None = None,
    options: RunOptions | None = None,
    progress: Progress = silent,
    detail: Progress = silent,
    answer: Progress = silent,
) -> Run:
    """Simulate all photographs of a run by a random build of the prototype, or of the shell.

    Args:
        exports: folder that `build` wrote, with a prototype.
        out: folder to write, which must not hold anything.
        process: "fdm", "sls", "sla", "cnc", "diamond", or a TOML file.
        object_file: triangle mesh about the origin; None for a built-in knot.
        up: axis of that file that points up, "y" or "z"; None: y for glTF, else z.
        unit: of that file, "mm", "cm", "m" or "in"; None: m for glTF, what a 3MF says, else mm.
        options: seed, stops, phases, noise ...
        progress: called with the name of each stage.
        detail: called with the state of a stage.
        answer: called with a line that says how the object's file was taken.

    Returns:
        The run as it is read back; the build is in its folder, as truth.json.

    Raises:
        InputError: export, process or object cannot be read, or the folder cannot be written.
    """
    from tbcad.output.inputs import files_named
    from tbcad.runs.photographs import read_run
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object_from_file import ObjectOptions
    from tbcad.simulated_run.options import RunOptions
    from tbcad.simulated_run.simulate import check_is_free, prepare_run, run_object, write_run
    from tbcad.tolerance.process.process import load_process, process_errors

    folder = Path(out)
    check_is_free(folder, (exports, object_file, *files_named(process)))
    errors = process_errors(load_process(process))
    progress("build and object")
    export = read_export(Path(exports))
    subject = run_object(export, object_file, ObjectOptions(up=up, unit=unit), answer)
    runs, phases = prepare_run(export, errors, subject, options or RunOptions())
    progress("photographs")
    write_run(runs, phases, export.folder, folder, detail)
    return read_run(folder)


def calibrate(
    run: Path | str,
    exports: Path | str,
    options: CalibrationOptions | None = None,
    *,
    out: Path | str,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> WrittenCalibration:
    """Find the machine that took the photographs of a run, and how well its rays are known.

    Args:
        run: folder that `tbcad run` or `tbcad simulate-run` wrote.
        exports: folder that `build` wrote.
        options: the process that made the machine, measured radii, the camera's lens.
        out: folder to write the calibration to.
        force: replace an earlier one, and keep files that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The calibration, with its verdict.

    Raises:
        InputError: one cannot be read, they do not belong together, there is nothing to calibrate
            from, or out cannot be replaced.
    """
    from tbcad.calibration.options import CalibrationOptions
    from tbcad.calibration.run import calibrate_run

    asked = options or CalibrationOptions()
    return calibrate_run(Path(run), Path(exports), Path(out), asked, force, progress, detail)


def solve_intrinsics(
    folder: Path | str,
    squares: tuple[int, int],
    size_mm: float,
    *,
    charuco: str | None = None,
    marker_mm: float | None = None,
    out: Path | str | None = None,
    force: bool = False,
    detail: Progress = silent,
) -> SolvedLens:
    """Solve the lens of a camera from photographs of a checkerboard or ChArUco board.

    Args:
        folder: with the photographs.
        squares: columns and rows of the board.
        size_mm: width of a square.
        charuco: dictionary of a ChArUco board's markers, such as "4x4_50".
        marker_mm: width of its markers.
        out: file to write, as OpenCV's YAML; None: none.
        force: replace a file that exists.
        detail: called with the name of each photograph.

    Raises:
        InputError: too few boards are found, or the file cannot be written or exists.
    """
    from tbcad.atomic_files import replace_files
    from tbcad.calibration.intrinsics.boards import Board, parse_dictionary
    from tbcad.calibration.intrinsics.checkerboard import solve_lens
    from tbcad.calibration.intrinsics.opencv import opencv_text
    from tbcad.output.single_files import check_file

    if out is not None:
        check_file(Path(out), force, Path(folder).glob("*"))
    dictionary = None if charuco is None else parse_dictionary(charuco)
    solved = solve_lens(Path(folder), Board(squares, size_mm, dictionary, marker_mm), detail)
    if out is not None:
        file = Path(out)
        text = opencv_text(solved.lens, solved.facts())
        replace_files(file.parent, {file.name: text.encode()})
    return solved


def merge(
    run: Path | str,
    calibration: Path | str,
    exports: Path | str | None = None,
    options: MergeOptions | None = None,
    *,
    out: Path | str,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> dict[str, Any]:
    """Merge the photographs of a run into the light field that the shell would have given.

    Args:
        run: folder that `tbcad run` or `tbcad simulate-run` wrote.
        calibration: folder that `tbcad calibrate` wrote.
        exports: folder that `build` wrote; by default the one that the calibration names.
        options: how the photographs are corrected.
        out: folder to write pictures and light field to, as of a capture.
        force: replace an earlier one, and keep files that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        What is in capture.json: also which mirrors are missing, and why.

    Raises:
        InputError: one cannot be read, they do not belong together, or out cannot be replaced.
    """
    from tbcad.machine.calibrated_export import export_of
    from tbcad.merged_run.corrections import Options as MergeOptions
    from tbcad.merged_run.files import write_merge
    from tbcad.merged_run.merge import prepared_merge
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest

    known, chosen = Path(calibration), options or MergeOptions()
    built = export_of(known) if exports is None else Path(exports)
    inputs = (run, known, built, *chosen.flat)
    check_replaceable(Path(out), "merged run", force, inputs)
    progress("run and calibration")
    prepared = prepared_merge(Path(run), known, built, chosen)
    progress("photographs and light field")
    with replacing(Path(out), "merged run", force, inputs) as folder:
        record = write_merge(folder, prepared, detail)
        write_manifest(folder, "merged run")
    return record


def as_built(
    calibration: Path | str,
    exports: Path | str | None = None,
    *,
    out: Path | str,
    force: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Write the balls of a calibrated prototype as exact solids, coloured by what they are off.

    Args:
        calibration: folder that `tbcad calibrate` wrote.
        exports: folder that `build` wrote; by default the one that the calibration names.
        out: folder to write.
        force: keep files in the folder that tbcad did not write.
        progress: called with the name of each stage.

    Returns:
        What is in as_built.json.

    Raises:
        InputError: one cannot be read, they do not belong together, or out cannot be replaced.
    """
    from tbcad.machine.calibrated_export import export_of
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest

    known = Path(calibration)
    built = export_of(known) if exports is None else Path(exports)
    check_replaceable(Path(out), "as-built", force, (known, built))
    progress("solids")
    from tbcad.as_built.export import as_built as write_files

    with replacing(Path(out), "as-built", force, (known, built)) as folder:
        record = write_files(known, built, folder)
        write_manifest(folder, "as-built")
    return record
