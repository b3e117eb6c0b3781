"""A whole run: export, port, camera and folder in, photographs out."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from tbcad.control.base import Base
from tbcad.control.cameras.choice import (
    check_camera_name,
    check_can_expose,
    connected_camera,
)
from tbcad.control.grbl import Grbl
from tbcad.control.klipper.base import KlipperBase
from tbcad.control.klipper.files import read_klipper_files
from tbcad.control.klipper.host import Klipper
from tbcad.control.klipper.moonraker import PREFIX, Moonraker, read_address
from tbcad.control.machine import DrivenMachine, MachineFault
from tbcad.control.outcome import DryRun, Outcome
from tbcad.control.plan import ControlPlan, read_control_plan
from tbcad.control.port import SerialPort
from tbcad.control.selection import (
    BYTES_PER_PX,
    CAPTURE_S,
    Preflight,
    RunSelection,
    Shots,
    chosen_frames,
    chosen_phases,
    count,
    disk_bytes,
    expected_seconds,
)
from tbcad.control.session import Ask, Session, Show
from tbcad.errors import InputError
from tbcad.output.content import refuse_inside
from tbcad.output.inputs import refuse_inputs
from tbcad.records.exposure import DARK_LIT, PhaseTimes, exposure_name
from tbcad.records.run import RunRecord, read_record
from tbcad.runs.photographs import read_run
from tbcad.runs.writing import DiskFault, check_new
from tbcad.types import Progress

STOPPED = "stopped by the operator"
TIMEOUT_S = 30.0


@dataclass(frozen=True)
class RunRequest:
    """What is asked for.

    Attributes:
        phases: names with commas between; None: all, or those of the run that is resumed.
        stops: numbers and ranges with commas between; None likewise.
        runs: "a", "b" or "ab"; None: both, or as in the run that is resumed.
        size_px: columns and rows of the photographs; None: those of the design's camera.
        resume: go on with the run in the folder.
        times: of exposure; where none is said, the camera's, or those of the run that is resumed.
        preflight: whether one stop is looked at before a new run, and whether the run follows.
    """

    exports: Path
    out: Path
    phases: str | None = None
    stops: str | None = None
    runs: str | None = None
    size_px: tuple[int, int] | None = None
    resume: bool = False
    times: PhaseTimes = field(default_factory=PhaseTimes)
    preflight: Preflight = "first"


def dry_run(request: RunRequest) -> DryRun:
    """What a run would do, without port and camera; nothing is written."""
    plan, options = _prepared(request)
    taken = set(read_run(request.out).exposures) if request.resume else set[str]()
    names = [phase.name for phase in options.phases]
    remaining = [
        Shots(frame, left)
        for frame in options.frames
        if (left := tuple(name for name in names if exposure_name(frame, name) not in taken))
    ]
    seconds = expected_seconds(plan, remaining, CAPTURE_S)
    each = BYTES_PER_PX * options.size_px[0] * options.size_px[1]
    return DryRun(plan, remaining, sum(seconds.values()), disk_bytes(count(remaining), each))


def run_machine(
    request: RunRequest,
    port: str,
    camera: str,
    ask: Ask,
    show: Show,
    note: Progress,
    *,
    send_settings: bool = False,
    timeout_s: float = TIMEOUT_S,
) -> Outcome:
    """Photograph what is asked for, and leave base held and lights off, whatever happens.

    Args:
        request: what is asked for.
        port: of the controller, or "moonraker:" and a URL.
        camera: gphoto2, command:... or folder:...
        ask: asks the operator to do something.
        show: shows progress.
        note: called with what the operator should know before the first position.
        send_settings: send the controller the settings that differ from the export's.
        timeout_s: how long a photograph may take.

    Returns:
        What was photographed; nothing, if only the preflight is asked for.

    Raises:
        InputError: something was wrong before the first photograph of the run.
    """
    plan, options = _prepared(request)
    check_camera_name(camera)
    check_can_expose(camera, options.times)
    with ExitStack() as stack:
        base = machine_at(port, request.exports, plan, note, stack)
        with _faults_as_input_errors(port):
            base.connect()
            base.check_settings(note, send=send_settings)
        with _secured(base, note):
            chosen = connected_camera(camera, timeout_s)
            stack.callback(chosen.close)
            session = Session(plan, options, base, chosen)
            with _faults_as_input_errors(port):
                look = request.preflight
                session.begin(request.out, ask, note, resume=request.resume, look=look)
            if look == "only":
                return Outcome(request.out, 0, 0, 0, {}, "", base.secure(), 0.0)
            return _photographed(session, ask, show)


def _photographed(session: Session, ask: Ask, show: Show) -> Outcome:
    begun, before, stopped = monotonic(), session.taken, ""
    try:
        session.photograph(ask, show)
    except (MachineFault, DiskFault) as fault:
        stopped = str(fault)
    except KeyboardInterrupt:
        stopped = STOPPED
    return session.finish(stopped, monotonic() - begun, before)


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


def _prepared(request: RunRequest) -> tuple[ControlPlan, RunSelection]:
    """Plan and choice, or those of the run that is resumed."""
    plan = read_control_plan(request.exports)
    phases = chosen_phases(plan, request.phases, request.times)
    frames = chosen_frames(plan, request.stops, request.runs or "ab")
    size = request.size_px or plan.size_px
    if not request.resume:
        refuse_inputs(request.out, (request.exports,))
        refuse_inside(request.out, request.out.resolve())
        check_new(request.out)
        return plan, RunSelection(frames, phases, size, request.times)
    record = read_record(request.out)
    _check_same_export(request, plan, record)
    known = ",".join(name for name in record.phases if name != DARK_LIT)
    recorded = chosen_phases(plan, known, record.times)
    phases = chosen_phases(plan, request.phases, record.times)
    given = (
        ("--phases", request.phases, phases == recorded),
        ("--stops", request.stops or request.runs, frames == record.frames),
        ("--size", request.size_px, size == (record.width_px, record.height_px)),
        (
            "--exposure",
            request.times if request.times != PhaseTimes() else None,
            all(request.times.of(phase) == record.times.of(phase) for phase in record.phases),
        ),
    )
    for name, value, same in given:
        if value is not None and not same:
            raise InputError(
                f"{request.out} was begun with another {name}: leave it out with --resume"
            )
    size = record.width_px, record.height_px
    return plan, RunSelection(record.frames, recorded, size, record.times)


def _check_same_export(request: RunRequest, plan: ControlPlan, record: RunRecord) -> None:
    if record.source != "camera":
        raise InputError(f"{request.out} is a simulated run: name another folder")
    other = [
        name for name, digest in plan.sha256.items() if record.export_sha256.get(name) != digest
    ]
    if other:
        raise InputError(
            f"{request.out} is a run of another export: {other[0]} of {request.exports} differs; "
            "name the export that it was begun with"
        )


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
