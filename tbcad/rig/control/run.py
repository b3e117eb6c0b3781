"""A whole run: build, port, camera and folder in, photographs out."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from time import monotonic

from tbcad.common.screen import stages
from tbcad.core.spec.prototype import Firmware
from tbcad.errors import InputError
from tbcad.options.machines import Ask, Preflight, RunOptions, Show
from tbcad.options.shared import exposures
from tbcad.output.manifest import refuse_inside
from tbcad.output.single_files import refuse_inputs
from tbcad.records.run import DARK_LIT, Frame, PhaseTimes, exposure_name, read_record
from tbcad.rig.control.base import FIRMWARES, Base
from tbcad.rig.control.cameras import (
    check_camera_name,
    check_can_expose,
    connected_camera,
)
from tbcad.rig.control.grbl import Grbl
from tbcad.rig.control.klipper import PREFIX, Klipper, Moonraker, read_address
from tbcad.rig.control.klipper_base import DrivenMachine, KlipperBase, read_klipper_files
from tbcad.rig.control.messages import SerialPort
from tbcad.rig.control.photographs import (
    Photograph,
    RunCamera,
    Shot,
    check_like_record,
    faults_refused,
    light_on,
    run_record,
    taken_twice,
)
from tbcad.rig.control.plan import (
    KLIPPER,
    CameraFault,
    ControlPlan,
    MachineFault,
    read_control_plan,
)
from tbcad.rig.control.selection import (
    BYTES_PER_PX,
    CAPTURE_S,
    DryRun,
    Outcome,
    RunSelection,
    Shots,
    bytes_each,
    check_disk,
    chosen_frames,
    chosen_phases,
    count,
    disk_bytes,
    duration_text,
    expected_seconds,
    size_text,
)
from tbcad.rig.runs import (
    DiskFault,
    RunWriter,
    check_new,
    check_same_export,
    exposure_of,
    new_run,
    read_run,
    resumed_run,
)
from tbcad.types import Progress

STOPPED = "stopped by the operator"
MOST_MISSED = 12  # photographs one after the other: the camera is gone, not one photograph
STRAIGHT, TURNED = "object straight", "object turned by 180 degrees about z"


class Session:
    """One machine and one run."""

    def __init__(
        self,
        plan: ControlPlan,
        options: RunSelection,
        machine: tuple[DrivenMachine, RunCamera],
        operator: tuple[Ask, Progress],
    ) -> None:
        """Run with a machine and camera that are connected, and an operator to ask and to tell."""
        self._plan, self._options = plan, options
        self._base, self._camera = machine
        self._ask, self._note = operator
        self._missed: dict[str, str] = {}
        self._homed = False
        self._expected: dict[str, float] = {}
        self._in_row = 0
        self._writer: RunWriter

    def begin(self, folder: Path, *, resume: bool, look: Preflight = "off") -> None:
        """Take a photograph with each exposure to know the camera, and begin or resume the folder.

        A new run begins with a preflight, unless `look` is "off"; nothing is written if it is
        "only". A camera on the controller's relay is released when the base is homed, not before.

        InputError: camera, disk, folder or exposure will not do; nothing was photographed;
        MachineFault: the machine does not do what it is told.
        """
        if resume:
            self._note("the photographs that are there are compared with their sha256")
            self._writer = resumed_run(folder)
        remaining = self._options.left(self._writer.taken if resume else ())
        if not remaining:
            return
        if self._camera.released:
            self._get_known_angle(_turned(remaining))
        trials = self._trials()
        if resume:
            with faults_refused(str(folder), ": set the camera as it was"):
                for phase, trial in trials.items():
                    check_like_record(self._writer.record, phase, trial)
        trial = max(trials.values(), key=lambda one: len(one.shot.data))
        if look != "off" and not resume:
            self._preflight(trial, remaining)
            if look == "only":
                return
        each_s = sum(one.seconds for one in trials.values()) / len(trials)
        self._expected = expected_seconds(self._plan, remaining, each_s + self._base.switch_s)
        seconds = sum(self._expected.values())
        each = bytes_each(len(trial.shot.data), *trial.size_px)
        needed = disk_bytes(count(remaining), each)
        check_disk(folder, needed)
        if not resume:
            self._writer = new_run(folder, run_record(self._plan, self._options, trials, seconds))
        self._writer.log("resumed" if resume else "started", camera=trial.model)
        self._note(
            f"{count(remaining)} photographs at {len(remaining)} positions take about "
            f"{duration_text(seconds)} and {size_text(needed)} of disk"
        )

    def _trials(self) -> dict[str, Photograph]:
        """A photograph for each phase that is not kept; one for all with the same exposure."""
        times = self._options.capture_times
        first = {seconds: self._trial(seconds) for seconds in dict.fromkeys(times.values())}
        return {name: first[seconds] for name, seconds in times.items()}

    def _trial(self, seconds: float | None) -> Photograph:
        with faults_refused():
            trial = taken_twice(self._camera, self._base, seconds, lambda _: None)
        (width, height), want = trial.size_px, self._options.size_px
        if trial.size_px != want:
            raise InputError(
                f"the camera gives {width} x {height} pixels, {want[0]} x {want[1]} are wanted: "
                f"set its image size, or say --size {width}x{height}"
            )
        return trial

    def _preflight(self, trial: Photograph, remaining: list[Shots]) -> None:
        """Look at the middle stop of the first run under each light; nothing is kept."""
        from tbcad.rig.control.preflight import preflight  # numerical libraries, for this alone

        if not self._homed:
            self._get_known_angle(_turned(remaining))
        first = [one for one in remaining if _turned([one]) == _turned(remaining)]
        shots = first[len(first) // 2]
        self._base.drive(self._plan.program.start)
        self._base.drive(self._plan.program.stops[shots.frame.stop], self._plan.motion.settle_s)

        def look(phase: str, seconds: float | None) -> Shot:
            with faults_refused(), self._light(phase):
                return taken_twice(self._camera, self._base, seconds, lambda _: None).shot

        where = f"{trial.model}, {shots.title}"
        preflight(self._options.capture_times, look, where, self._note)

    def _light(self, phase: str) -> AbstractContextManager[None]:
        lights = {one.name: one for one in self._options.phases}
        return light_on(self._base, lights[phase], self._plan.motion.light_s)

    def photograph(self, show: Show) -> Outcome:
        """Photograph what remains; then hold the base, switch lights off, close the journal."""
        begun, before, stopped = monotonic(), len(self._writer.taken), ""
        try:
            self._photograph(show)
        except (MachineFault, DiskFault) as fault:
            stopped = str(fault)
        except KeyboardInterrupt:
            stopped = STOPPED
        seconds, unsafe, writer = monotonic() - begun, self._base.secure(), self._writer
        with suppress(DiskFault):
            writer.log("stopped" if stopped else "finished", reason=stopped)
        return Outcome(
            folder=writer.folder,
            wanted=len(writer.record.frames) * len(writer.record.phases),
            taken=len(writer.taken),
            new=len(writer.taken) - before,
            missed=self._missed,
            stopped=stopped,
            unsafe=unsafe,
            seconds=seconds,
        )

    def _photograph(self, show: Show) -> None:
        """Home, and photograph what remains; MachineFault or DiskFault: it cannot go on."""
        left = self._options.left(self._writer.taken)
        runs = [list(run) for _, run in groupby(left, lambda one: one.frame.object_turn_deg)]
        for number, run in enumerate(runs):
            if number:
                self._base.drive(self._plan.program.start)
                self._have_done(self._plan.program.turn)
            elif not self._homed:
                self._get_known_angle(_turned(run))
            with show({one.title: self._expected[one.title] for one in run}) as screen:
                self._base.drive(self._plan.program.start)
                for shots in run:
                    screen.stage(shots.title)
                    self._position(shots, screen.note)
        if self._expected:
            self._base.drive(self._plan.program.end)

    def _get_known_angle(self, turned: bool) -> None:
        """Have the operator prepare the machine, and home."""
        ready = self._plan.program.ready
        self._have_done(ready.replace(STRAIGHT, TURNED) if turned else ready)
        self._note("homing" if self._plan.program.homes else "angle zero as the pin has it")
        self._base.home()
        self._homed = True

    def _have_done(self, text: str) -> None:
        """Ask for what a pause of the program says; MachineFault: the operator will not."""
        if not self._ask(text.removesuffix("? Then resume").removesuffix(", then resume")):
            raise MachineFault("the operator did not go on")

    def _position(self, shots: Shots, note: Progress) -> None:
        self._base.drive(self._plan.program.stops[shots.frame.stop], self._plan.motion.settle_s)
        for name in shots.phases:
            with self._light(name):
                self._one(shots.frame, name, note)

    def _one(self, frame: Frame, phase: str, note: Progress) -> None:
        name = exposure_name(frame, phase)
        check = partial(check_like_record, self._writer.record, phase)
        try:
            seconds = self._options.times.of(phase)
            photograph = taken_twice(self._camera, self._base, seconds, check)
        except CameraFault as fault:
            self._missed[name] = str(fault)
            self._writer.log("missed", name=name, reason=str(fault))
            note(f"{name} is missing: {fault}")
            self._in_row += 1
            if self._in_row >= MOST_MISSED:
                raise MachineFault(
                    f"{MOST_MISSED} photographs in a row are missing: {fault}"
                ) from None
        else:
            shot, seconds = photograph.shot, photograph.told_s or photograph.asked_s
            image = shot.data, shot.suffix, photograph.size_px
            now, settings = datetime.now(UTC), photograph.settings
            self._writer.add(exposure_of(frame, phase, image, seconds, now, settings), shot.data)
            self._in_row = 0


def _turned(remaining: list[Shots]) -> bool:
    return bool(remaining and remaining[0].frame.object_turn_deg)


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
        raise InputError("no way to confirm the turn of the object: give ask, or use --yes")
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
    to_klipper = port.startswith(PREFIX)
    if to_klipper != (plan.firmware == KLIPPER) and (to_klipper or "://" not in port):
        raise InputError(_other_firmware(port, plan.firmware))
    if to_klipper:
        server = Moonraker(read_address(port.removeprefix(PREFIX)))
        return KlipperBase(Klipper(server, note), plan, read_klipper_files(folder))
    if "://" in port:
        raise InputError(f"--port is {port!r:.60}: for Klipper say {PREFIX}http://HOST")
    line = SerialPort(port)
    stack.callback(line.close)
    return Base(Grbl(line, note), plan)


def _other_firmware(port: str, firmware: Firmware) -> str:
    klipper = firmware == KLIPPER
    wanted = f"{PREFIX}http://HOST" if klipper else "the controller's serial port"
    other = "grblhal" if klipper else KLIPPER
    return (
        f"--port is {port:.60}, but the build is for {FIRMWARES[firmware]}: say {wanted}, or build "
        f"again with --set prototype.motion.controller={other}"
    )
