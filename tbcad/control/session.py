"""A run from its start, or from where it stopped, to its end."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path

from tbcad.control.cameras.camera import Camera
from tbcad.control.estimate import (
    Shots,
    bytes_each,
    check_disk,
    count,
    disk_bytes,
    duration_text,
    expected_seconds,
    size_text,
)
from tbcad.control.faults import CameraFault, MachineFault
from tbcad.control.machine import Machine
from tbcad.control.outcome import Outcome
from tbcad.control.plan import Phase, Plan
from tbcad.control.shooting import (
    Photograph,
    check_like_record,
    exposure_of,
    take,
)
from tbcad.errors import InputError
from tbcad.runs.exposure import Frame, exposure_name
from tbcad.runs.record import RunRecord
from tbcad.runs.writing import DiskFault, RunWriter, new_run, resumed_run
from tbcad.screen import Stages
from tbcad.types import Progress

MOST_MISSED = 12  # photographs one after the other: the camera is gone, not one photograph
STRAIGHT, TURNED = "object straight", "object turned by 180 degrees about z"

Ask = Callable[[str], bool]
"""Asks the operator to do something; False: the operator will not."""
Show = Callable[[Mapping[str, float]], AbstractContextManager[Stages]]
"""Shows stages with their expected seconds while a block runs."""


@dataclass(frozen=True)
class RunOptions:
    """What is photographed, and how.

    Attributes:
        frames: positions in order.
        phases: lights at each, in order.
        size_px: columns and rows that photographs must have.
        send_settings: whether the controller's settings are sent to it where they differ.
    """

    frames: tuple[Frame, ...]
    phases: tuple[Phase, ...]
    size_px: tuple[int, int]
    send_settings: bool = False


class Session:
    """One machine and one run."""

    def __init__(self, plan: Plan, options: RunOptions, base: Machine, camera: Camera) -> None:
        """Run with a machine and a camera that are connected."""
        self._plan, self._options = plan, options
        self._base, self._camera = base, camera
        self._missed: dict[str, str] = {}
        self._homed = False
        self._expected: dict[str, float] = {}
        self._note: Progress = lambda _: None
        self._in_row = 0
        self._writer: RunWriter

    def begin(self, folder: Path, ask: Ask, note: Progress, *, resume: bool) -> None:
        """Take one photograph to know the camera, and begin or resume the folder.

        A camera on the controller's relay is released when the base is homed, not before.

        Raises:
            InputError: camera, disk or folder will not do; nothing was photographed.
            MachineFault: the machine does not do what it is told.
        """
        self._note = note
        if resume:
            note("the photographs that are there are compared with their sha256")
            self._writer = resumed_run(folder)
            if not self._remaining():
                return
        remaining = self._remaining() if resume else self._all()
        if self._camera.released:
            self._get_known_angle(_turned(remaining), ask)
        trial = self._trial()
        if resume:
            self._check_same_run(folder, trial)
        self._expected = expected_seconds(
            self._plan, remaining, trial.seconds + self._base.switch_s
        )
        seconds = sum(self._expected.values())
        facts = trial.facts
        each = bytes_each(len(trial.shot.data), facts.width_px, facts.height_px)
        needed = disk_bytes(count(remaining), each)
        check_disk(folder, needed)
        if not resume:
            self._writer = new_run(folder, self._record(trial, seconds))
        self._writer.log("resumed" if resume else "started", camera=trial.model)
        note(
            f"{count(remaining)} photographs at {len(remaining)} positions take about "
            f"{duration_text(seconds)} and {size_text(needed)} of disk"
        )

    def _trial(self) -> Photograph:
        """One photograph that is not kept."""
        try:
            trial = self._photograph(lambda _: None)
        except CameraFault as fault:
            raise InputError(f"the camera: {fault}") from None
        size = trial.facts.width_px, trial.facts.height_px
        if size != self._options.size_px:
            want = self._options.size_px
            raise InputError(
                f"the camera gives {size[0]} x {size[1]} pixels, {want[0]} x {want[1]} are wanted: "
                f"set its image size, or say --size {size[0]}x{size[1]}"
            )
        return trial

    def _photograph(self, check: Callable[[Photograph], None]) -> Photograph:
        """A photograph that passes a check; a second one, over a new session, if the first fails.

        Raises:
            CameraFault: both fail.
        """
        try:
            photograph = take(self._camera, self._base)
            check(photograph)
        except CameraFault:
            self._camera.again()
            photograph = take(self._camera, self._base)
            check(photograph)
        return photograph

    def _record(self, trial: Photograph, seconds: float) -> RunRecord:
        return RunRecord(
            export_sha256=self._plan.sha256,
            source="camera",
            camera=trial.model,
            width_px=trial.facts.width_px,
            height_px=trial.facts.height_px,
            phases=tuple(phase.name for phase in self._options.phases),
            frames=self._options.frames,
            locked=trial.settings,
            seconds=round(seconds, 1),
        )

    def _check_same_run(self, folder: Path, trial: Photograph) -> None:
        try:
            check_like_record(self._writer.record, trial)
        except CameraFault as fault:
            raise InputError(f"{folder}: {fault}: set the camera as it was") from None

    def _all(self) -> list[Shots]:
        names = tuple(phase.name for phase in self._options.phases)
        return [Shots(frame, names) for frame in self._options.frames]

    def _remaining(self) -> list[Shots]:
        """What is not yet there, in the order of photographing."""
        taken = self._writer.taken
        left = [
            Shots(
                one.frame,
                tuple(name for name in one.phases if exposure_name(one.frame, name) not in taken),
            )
            for one in self._all()
        ]
        return [one for one in left if one.phases]

    def photograph(self, ask: Ask, show: Show) -> None:
        """Home, and photograph what remains.

        Raises:
            MachineFault: the machine cannot go on, or the operator will not.
            DiskFault: the disk cannot.
        """
        for number, (turned, run) in enumerate(self._runs()):
            if number:
                self._base.drive(self._plan.program.start)
                _have_done(ask, self._plan.program.turn)
            elif not self._homed:
                self._get_known_angle(turned, ask)
            with show({one.title: self._expected[one.title] for one in run}) as screen:
                self._base.drive(self._plan.program.start)
                for shots in run:
                    screen.stage(shots.title)
                    self._position(shots, screen.note)
        if self._expected:
            self._base.drive(self._plan.program.end)

    def _runs(self) -> Iterator[tuple[bool, list[Shots]]]:
        for turn, run in groupby(self._remaining(), lambda one: one.frame.object_turn_deg):
            yield bool(turn), list(run)

    def _get_known_angle(self, turned: bool, ask: Ask) -> None:
        """Have the operator prepare the machine, and home."""
        ready = self._plan.program.ready
        _have_done(ask, ready.replace(STRAIGHT, TURNED) if turned else ready)
        self._note("homing" if self._plan.program.homes else "angle zero as the pin has it")
        self._base.home()
        self._homed = True

    def _position(self, shots: Shots, note: Progress) -> None:
        """All photographs at one position."""
        self._base.drive(self._plan.program.stops[shots.frame.stop], self._plan.motion.settle_s)
        outputs = {phase.name: phase.output for phase in self._plan.phases}
        for name in shots.phases:
            if (output := outputs[name]) is not None:
                self._base.light(output, on=True)
            self._base.wait(self._plan.motion.light_s)
            self._one(shots.frame, name, note)
            if output is not None:
                self._base.light(output, on=False)

    def _one(self, frame: Frame, phase: str, note: Progress) -> None:
        """One photograph, or why there is none."""
        name = exposure_name(frame, phase)
        try:
            photograph = self._photograph(partial(check_like_record, self._writer.record))
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
            self._writer.add(exposure_of(photograph, frame, phase), photograph.shot.data)
            self._in_row = 0

    def finish(self, stopped: str, seconds: float, before: int) -> Outcome:
        """Hold the base, switch lights off, close the journal."""
        unsafe = self._base.secure()
        writer = self._writer
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

    @property
    def taken(self) -> int:
        """Number of photographs that are there."""
        return len(self._writer.taken)


def _turned(remaining: list[Shots]) -> bool:
    """Whether the object is turned at the first position."""
    return bool(remaining and remaining[0].frame.object_turn_deg)


def _have_done(ask: Ask, text: str) -> None:
    """Ask for what a pause of the program says.

    Raises:
        MachineFault: the operator will not.
    """
    if not ask(text.removesuffix("? Then resume").removesuffix(", then resume")):
        raise MachineFault("the operator did not go on")
