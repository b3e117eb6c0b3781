"""A run from its start, or from where it stopped, to its end."""

from contextlib import AbstractContextManager, suppress
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from time import monotonic

from tbcad.errors import InputError
from tbcad.options.machines import Ask, Preflight, Show
from tbcad.records.run import Frame, exposure_name
from tbcad.rig.control.klipper_base import DrivenMachine
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
from tbcad.rig.control.plan import CameraFault, ControlPlan, MachineFault
from tbcad.rig.control.selection import (
    Outcome,
    RunSelection,
    Shots,
    bytes_each,
    check_disk,
    count,
    disk_bytes,
    duration_text,
    expected_seconds,
    size_text,
)
from tbcad.rig.runs import DiskFault, RunWriter, exposure_of, new_run, resumed_run
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
        """One photograph, or why there is none."""
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
