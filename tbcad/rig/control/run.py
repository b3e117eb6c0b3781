"""A whole run: export, port, camera and folder in, photographs out."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.machines import RunOptions
from tbcad.options.shared import exposures
from tbcad.output.manifest import refuse_inside
from tbcad.output.single_files import refuse_inputs
from tbcad.records.run import DARK_LIT, PhaseTimes, read_record
from tbcad.rig.control.base import Base
from tbcad.rig.control.cameras import (
    check_camera_name,
    check_can_expose,
    connected_camera,
)
from tbcad.rig.control.grbl import Grbl
from tbcad.rig.control.klipper import PREFIX, Klipper, Moonraker, read_address
from tbcad.rig.control.klipper_base import DrivenMachine, KlipperBase, read_klipper_files
from tbcad.rig.control.messages import SerialPort
from tbcad.rig.control.plan import ControlPlan, MachineFault, read_control_plan
from tbcad.rig.control.selection import (
    BYTES_PER_PX,
    CAPTURE_S,
    DryRun,
    Outcome,
    RunSelection,
    chosen_frames,
    chosen_phases,
    count,
    disk_bytes,
    expected_seconds,
)
from tbcad.rig.control.session import Session
from tbcad.rig.runs import DiskFault, check_new, check_same_export, read_run
from tbcad.types import Progress


def dry_run(options: RunOptions) -> DryRun:
    """What a run would do, without port and camera; nothing is written."""
    plan, chosen = _prepared(options)
    taken = set(read_run(Path(options.out)).exposures) if options.resume else set[str]()
    remaining = chosen.left(taken)
    seconds = expected_seconds(plan, remaining, CAPTURE_S)
    each = BYTES_PER_PX * chosen.size_px[0] * chosen.size_px[1]
    return DryRun(plan, remaining, sum(seconds.values()), disk_bytes(count(remaining), each))


def run_machine(options: RunOptions) -> Outcome:
    """Photograph what is asked for, and leave base held and lights off, whatever happens.

    The outcome of a preflight alone is nothing. InputError: something was wrong before the first
    photograph of the run.
    """
    if options.port is None:
        raise InputError(
            "--port is missing: name the controller's serial port, such as /dev/ttyUSB0, or "
            "moonraker:http://HOST for Klipper, or look at what would be done with --dry-run"
        )
    if options.ask is None:
        raise InputError("nobody can be asked to turn the object: give ask, or say --yes")
    out, note, port, ask = Path(options.out), options.progress, options.port, options.ask
    plan, chosen = _prepared(options)
    check_camera_name(options.camera)
    check_can_expose(options.camera, chosen.times)
    with ExitStack() as stack:
        base = machine_at(port, Path(options.exports), plan, note, stack)
        with _faults_as_input_errors(port):
            base.connect()
            base.check_settings(note, send=options.send_settings)
        with _secured(base, note):
            camera = connected_camera(options.camera, options.timeout_s)
            stack.callback(camera.close)
            session = Session(plan, chosen, (base, camera), (ask, note))
            with _faults_as_input_errors(port):
                session.begin(out, resume=options.resume, look=options.preflight)
            if options.preflight == "only":
                return Outcome(out, 0, 0, 0, {}, "", base.secure(), 0.0)
            return session.photograph(options.show or partial(stages, silent=True))


@contextmanager
def _secured(base: DrivenMachine, note: Progress) -> Iterator[None]:
    """Hold the base and switch lights off if an error comes through; tell what is not safe."""
    try:
        yield
    except BaseException:
        if unsafe := base.secure():
            note(f"LOOK AT THE MACHINE: {unsafe}")
        raise


@contextmanager
def _faults_as_input_errors(port: str) -> Iterator[None]:
    """Before the first photograph a fault is one of the input: there is nothing to lose."""
    try:
        yield
    except MachineFault as fault:
        raise InputError(f"{port}: {fault}") from None
    except DiskFault as fault:
        raise InputError(f"{fault}: make room, or name another folder") from None


def _prepared(options: RunOptions) -> tuple[ControlPlan, RunSelection]:
    """Plan and choice, or those of the run that is resumed."""
    exports, out, asked = Path(options.exports), Path(options.out), options.size()
    times = PhaseTimes(*exposures(options.exposure_leds_s, options.exposure_lit_s))
    plan = read_control_plan(exports)
    phases = chosen_phases(plan, options.phases, times)
    frames = chosen_frames(plan, options.stops, options.runs or "ab")
    size = asked or plan.size_px
    if not options.resume:
        refuse_inputs(out, (exports,))
        refuse_inside(out, out.resolve())
        check_new(out)
        return plan, RunSelection(frames, phases, size, times)
    record = read_record(out)
    if record.source != "camera":
        raise InputError(f"{out} is a simulated run: name another folder")
    check_same_export(out, record, exports)
    known = ",".join(name for name in record.phases if name != DARK_LIT)
    recorded = chosen_phases(plan, known, record.times)
    phases = chosen_phases(plan, options.phases, record.times)
    given = (
        ("--phases", options.phases, phases == recorded),
        ("--stops", options.stops or options.runs, frames == record.frames),
        ("--size", asked, size == (record.width_px, record.height_px)),
        (
            "--exposure",
            times if times != PhaseTimes() else None,
            all(times.of(phase) == record.times.of(phase) for phase in record.phases),
        ),
    )
    for name, value, same in given:
        if value is not None and not same:
            raise InputError(f"{out} was begun with another {name}: leave it out with --resume")
    size = record.width_px, record.height_px
    return plan, RunSelection(record.frames, recorded, size, record.times)


def machine_at(
    port: str, folder: Path, plan: ControlPlan, note: Progress, stack: ExitStack
) -> DrivenMachine:
    """Open a port, which the stack closes: of a serial line, or "moonraker:" and a URL."""
    if port.startswith(PREFIX):
        server = Moonraker(read_address(port.removeprefix(PREFIX)))
        return KlipperBase(Klipper(server, note), plan, read_klipper_files(folder))
    if "://" in port:
        raise InputError(f"--port is {port!r:.60}: for Klipper say {PREFIX}http://HOST")
    line = SerialPort(port)
    stack.callback(line.close)
    return Base(Grbl(line, note), plan)
