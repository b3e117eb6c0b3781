"""The machine as it is built: photographed, calibrated, merged, drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.errors import InputError
from tbcad.options.call import keywords
from tbcad.options.checks import (
    check_is_any_calibration,
    check_is_calibration,
    check_is_export,
    check_is_object,
    check_is_run,
)
from tbcad.options.machines import (
    AsBuiltOptions,
    CalibrateOptions,
    IntrinsicsOptions,
    MergeOptions,
    RunOptions,
    SimulateRunOptions,
)

if TYPE_CHECKING:
    from tbcad.rig.calibration.intrinsics.checkerboard import SolvedLens
    from tbcad.rig.calibration.run import WrittenCalibration
    from tbcad.rig.control.selection import Outcome
    from tbcad.rig.runs import Run


@keywords(RunOptions)
def run(options: RunOptions) -> Outcome:
    """Drive the prototype of a build through its stops and photograph it under each light.

    Returns:
        What was photographed, what is missing, and why the run stopped if it did.

    Raises:
        InputError: something was wrong before the first photograph of the run, also an exposure.
    """
    from tbcad.rig.control.run import run_machine

    return run_machine(options)


@keywords(SimulateRunOptions)
def simulate_run(options: SimulateRunOptions) -> Run:
    """Simulate all photographs of a run by a random build of the prototype, or of the shell.

    Returns:
        The run as it is read back; the build is in its folder, as truth.json.

    Raises:
        InputError: build, process or object cannot be read, or the folder cannot be written.
    """
    exports, folder, file = Path(options.exports), Path(options.out), options.object_file
    check_is_export(exports)
    check_is_object(options.object_file, options.up, options.unit)
    options.check()  # before what is heavy is loaded
    from tbcad.light.simulate.scene.object_from_file import ObjectOptions
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.output.single_files import files_named
    from tbcad.rig.runs import read_run
    from tbcad.rig.simulated_run.simulate import check_is_free, prepare_run, run_object, write_run
    from tbcad.tolerancing.process.process import load_process, process_errors

    check_is_free(folder, (exports, file, *files_named(options.process)))
    process = load_process(options.process)
    options.progress("build and object")
    export = read_export(exports)
    errors = process_errors(process, caps=export.spec.prototype.caps)
    taken = ObjectOptions(up=options.up, unit=options.unit)
    subject = run_object(export, file, taken, options.answer)
    runs, phases = prepare_run(export, errors, subject, options)
    options.progress("photographs")
    write_run(runs, phases, export.folder, folder, options.detail)
    return read_run(folder)


@keywords(CalibrateOptions)
def calibrate(options: CalibrateOptions) -> WrittenCalibration:
    """Find the machine that took the photographs of a run, and how well its rays are known.

    Returns:
        The calibration, with its verdict.

    Raises:
        InputError: a file cannot be read, they do not belong together, there is nothing to
            calibrate from, or out cannot be replaced.
    """
    check_is_run(Path(options.run))
    check_is_export(Path(options.exports))
    if options.intrinsics is not None and not Path(options.intrinsics).is_file():
        raise InputError(
            f"{options.intrinsics}: no such file; give the one that `tbcad intrinsics` wrote"
        )
    from tbcad.tolerancing.process.process import load_process

    if options.process is not None:
        load_process(options.process, options.settings)  # before what is heavy is loaded
    from tbcad.rig.calibration.run import calibrate_run

    return calibrate_run(options)


@keywords(IntrinsicsOptions)
def intrinsics(options: IntrinsicsOptions) -> SolvedLens:
    """Solve the lens of a camera from photographs of a checkerboard or ChArUco board.

    Raises:
        InputError: too few boards are found, or the file cannot be written or exists.
    """
    from tbcad.common.atomic_files import replace_files
    from tbcad.output.single_files import check_file
    from tbcad.rig.calibration.intrinsics.boards import Board, parse_dictionary, parse_squares
    from tbcad.rig.calibration.intrinsics.checkerboard import solve_lens
    from tbcad.rig.calibration.intrinsics.lens import opencv_text

    folder, out = Path(options.folder), Path(options.out)
    squares = parse_squares(options.squares)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; name one with photographs of a board")
    check_file(out, options.force, folder.glob("*"))
    options.progress("corners of boards")
    dictionary = None if options.charuco is None else parse_dictionary(options.charuco)
    board = Board(squares, options.size, dictionary, options.marker)
    solved = solve_lens(folder, board, options.detail)
    text = opencv_text(solved.lens, solved.facts())
    replace_files(out.parent, {out.name: text.encode()})
    return solved


@keywords(MergeOptions)
def merge(options: MergeOptions) -> dict[str, Any]:
    """Merge the photographs of a run into the light field that the shell would have given.

    Returns:
        What is in capture.json: also which mirrors are missing, and why.

    Raises:
        InputError: a file cannot be read, they do not belong together, or out cannot be replaced.
    """
    run, known = Path(options.run), Path(options.calibration)
    check_is_run(run)
    check_is_any_calibration(known)
    if options.exports is not None:
        check_is_export(Path(options.exports))
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.rig.machine.shells import export_of
    from tbcad.rig.merged_run.merge import prepared_merge, write_merge

    built = export_of(known) if options.exports is None else Path(options.exports)
    out, inputs = options.folder, (run, known, built, *options.flat)
    check_replaceable(out, "merged run", options.force, inputs)
    options.progress("run and calibration")
    prepared = prepared_merge(run, known, built, options)
    options.progress("photographs and light field")
    with replacing(out, "merged run", options.force, inputs) as folder:
        record = write_merge(folder, prepared, options.detail)
        write_manifest(folder, "merged run")
    return record


@keywords(AsBuiltOptions)
def as_built(options: AsBuiltOptions) -> dict[str, Any]:
    """Write the balls of a calibrated prototype as exact solids, coloured by their errors.

    Returns what is in as_built.json. InputError: a file cannot be read, they do not belong
    together, or out cannot be replaced.
    """
    known, out = Path(options.calibration), Path(options.out)
    check_is_calibration(known)
    if options.exports is not None:
        check_is_export(Path(options.exports))
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.rig.machine.shells import export_of

    built = export_of(known) if options.exports is None else Path(options.exports)
    check_replaceable(out, "as-built", options.force, (known, built))
    options.progress("solids")
    from tbcad.rig.calibrated_solids import as_built as write_files

    with replacing(out, "as-built", options.force, (known, built)) as folder:
        record = write_files(known, built, folder)
        write_manifest(folder, "as-built")
    return record
