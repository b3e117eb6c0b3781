"""The base and its lights, driven by a controller."""

from math import inf
from time import sleep

from tbcad.errors import InputError
from tbcad.rig.control.grbl import HOME, SYNC, Grbl
from tbcad.rig.control.messages import Status
from tbcad.rig.control.plan import PIN_FIRST, SETTINGS, ControlPlan, MachineFault, Move
from tbcad.types import Progress

SEEK_SETTING, TRAVEL_SETTING = 25, (130, 131, 132, 133)
HOMING_SPARE_S = 30.0  # to find the switch again slowly, and to pull off
HOMING_SEARCH = 1.5  # times the travel: as far as GRBL searches for the switch
PLACE_DEG = 0.05  # a controller reports steps of 0.02 degrees
PLACE_TRIES = 5  # a report may be from just before the end of a motion
SAME = 1e-4  # of settings, relative to their values
FIRMWARES = {"grblhal": "grblHAL", "grbl": "GRBL 1.1", "klipper": "Klipper"}
UNLOCK = "$X"
SHOWN = 4


class Base:
    """Motions and lights of one machine."""

    switch_s = 0.02  # two lines

    def __init__(self, grbl: Grbl, plan: ControlPlan) -> None:
        """Drive a machine as its build says."""
        self._grbl, self._plan = grbl, plan
        self._offset: float | None = None
        self._at = plan.program.start.angle_deg

    def connect(self) -> None:
        """Wait until the controller answers, and tells that it has the build's firmware.

        Nothing is set before: settings have other meanings in another firmware.
        """
        self._grbl.connect()
        wanted, found = self._plan.firmware, self._grbl.firmware()
        if found == wanted:
            return
        name, told = FIRMWARES[wanted], self._grbl.greeting
        again = f"build again with --set prototype.motion.controller={found}, or " if found else ""
        raise InputError(
            f"the controller is {FIRMWARES.get(found, 'neither grblHAL nor GRBL 1.1')} "
            f"({told!r:.60}), the build is for {name}; nothing was set: {again}put {name} on the "
            "board"
        )

    def settings_that_differ(self) -> dict[int, tuple[float | None, float]]:
        """Settings of the controller that are not the build's: by number, found and wanted.

        A board without a setting is without what the setting switches off by zero.
        """
        found = self._grbl.settings()
        return {
            number: (found.get(number), wanted)
            for number, wanted in self._plan.settings.items()
            if (number in found or wanted)
            and abs(found.get(number, inf) - wanted) > SAME * max(1.0, abs(wanted))
        }

    def check_settings(self, note: Progress, *, send: bool) -> None:
        """Compare the controller's settings with the build's; send what differs, or refuse."""
        differing = self.settings_that_differ()
        if send:
            for number, (was, wanted) in differing.items():
                self._grbl.command(f"${number}={wanted:.7g}")
                note(f"${number} was {_shown(was)}, is {wanted:g}")
            differing = self.settings_that_differ()
        if differing:
            shown = [
                f"${number} is {_shown(found)}, not {wanted:g}"
                for number, (found, wanted) in [*differing.items()][:SHOWN]
            ]
            raise InputError(
                f"the controller is not set as {SETTINGS} says: {', '.join(shown)}"
                f"{' ...' if len(differing) > SHOWN else ''}: send them with --send-settings"
            )

    def home(self) -> None:
        """Bring the base to a known angle, all lights off."""
        program = self._plan.program
        status = self._grbl.status_in_alarm()
        if not program.homes and status is not None and status.state == "Alarm":
            self._grbl.command(UNLOCK)
        for line in program.known_angle:
            if line == HOME:
                seconds = self._homing_s()
                self._grbl.command(line, expected_s=seconds, silent_s=seconds)
            else:
                self._grbl.command(line)
        self.lights_off()
        self._grbl.command(SYNC)
        status = self._grbl.status()
        place = status.place("MPos", self._plan.axis)
        self._at = program.known_deg
        self._offset = None if place is None else place - self._at

    def _homing_s(self) -> float:
        settings = self._plan.settings
        travel = max(settings.get(number, 0.0) for number in TRAVEL_SETTING)
        seek = settings.get(SEEK_SETTING, self._plan.motion.feed_deg_min)
        return HOMING_SEARCH * travel / seek * 60 + HOMING_SPARE_S

    def drive(self, move: Move, settle_s: float = 0.0) -> None:
        """Drive to a place and rest there, or a MachineFault."""
        self._grbl.command(move.line)
        expected = travel_s(abs(move.angle_deg - self._at), self._plan)
        dwell = f"G4 P{settle_s:.3f}" if settle_s else SYNC
        self._grbl.command(dwell, expected_s=expected + settle_s)
        self._at = move.angle_deg
        self._check_place(move)

    def _check_place(self, move: Move) -> None:
        for _ in range(PLACE_TRIES):
            status = self._grbl.status()
            angle = self._angle(status)
            if status.state == "Idle" and (
                angle is None or abs(angle - move.angle_deg) <= PLACE_DEG
            ):
                return
        seen = "unknown" if angle is None else f"{angle:.3f} degrees"
        raise MachineFault(
            f"{move.line}: the controller is {status.state} at {seen} and not at "
            f"{move.angle_deg:.3f}: look at its settings"
        )

    def _angle(self, status: Status) -> float | None:
        if (work := status.place("WPos", self._plan.axis)) is not None:
            return work
        place = status.place("MPos", self._plan.axis)
        return None if place is None or self._offset is None else place - self._offset

    def light(self, output: int, *, on: bool) -> None:
        """Switch a light; the base is at rest then."""
        self._grbl.command(f"M{64 if on else 65} P{output}")

    def lights_off(self) -> None:
        """Switch all lights off."""
        for output in self._plan.outputs:
            self.light(output, on=False)

    def wait(self, seconds: float) -> None:
        """Let lights settle."""
        sleep(seconds)

    def release(self) -> None:
        """Close the camera's relay for as long as it needs."""
        self._grbl.command("M8")
        self._grbl.command(f"G4 P{self._plan.motion.trigger_s:.3f}", self._plan.motion.trigger_s)
        self._grbl.command("M9")

    def secure(self) -> str:
        """Hold the base and switch all lights off; return what could not be done, if anything."""
        try:
            wrong = self._hold_and_darken()
        except MachineFault as fault:
            wrong = f"lights may be on: {fault}"
        except KeyboardInterrupt:
            wrong = "interrupted before all was safe: lights may be on, the base may move"
        return wrong and f"{wrong}; {PIN_FIRST}"

    def _hold_and_darken(self) -> str:
        """What is wrong, if anything."""
        self._grbl.hold()
        status = self._grbl.status_in_alarm()
        if status is None:
            return "the controller does not answer: lights may be on"
        if not status.resting:
            return f"the base did not stop ({status.state}): a reset would let it fall"
        if status.state != "Idle" or self._grbl.pending:
            self._grbl.reset()
            self._grbl.command(UNLOCK)
        self.lights_off()
        self._grbl.command("M9")
        return ""


def _shown(value: float | None) -> str:
    return "missing" if value is None else f"{value:g}"


def travel_s(degrees: float, plan: ControlPlan) -> float:
    """Duration of a motion from rest to rest, s."""
    speed, rise = plan.motion.feed_deg_min / 60, plan.motion.acceleration_deg_s2
    if degrees * rise < speed**2:
        return float(2 * (degrees / rise) ** 0.5)
    return float(degrees / speed + speed / rise)
