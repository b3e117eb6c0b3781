"""A controller on a pseudo-terminal that follows GRBL's protocol, with a base and lights.

It knows states, `ok`, `error:n` and `ALARM:n`, realtime characters, a planner of one motion, soft
reset, homing, G92, and the outputs of M64, M65, M8 and M9.
While it homes it is silent, grblHAL unless bit 12 of $10 is set; a hold comes after it, a reset
ends it by ALARM:6. A reset in mid-motion and an alarm let the motor go, unless $37 of grblHAL keeps
it on; sleep does always. After ALARM:1 and 2 it takes a reset only, and GRBL answers nothing else.
Its time runs faster than the clock. Faults are injected by a function that sees each line.
Sources: doc/markdown/interface.md, commands.md and settings.md of GRBL 1.1h; grbl/gcode.c,
limits.c, protocol.c and stepper.c there; report.c, gcode.c, machine_limits.c, motion_control.c and
stepper.c of grblHAL core.
"""

import os
import pty
import re
import select
import threading
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import monotonic

LINE = 79
BANNERS = {
    "grblhal": "GrblHAL 1.1f ['$' or '$HELP' for help]",
    "grbl": "Grbl 1.1h ['$' for help]",
}
BUILD_INFO = {
    "grblhal": ("[VER:1.1f.20260818:]", "[OPT:VNMSL,35,1024,4,0]", "[FIRMWARE:grblHAL]"),
    "grbl": ("[VER:1.1h.20190830:]", "[OPT:V,15,128]"),
}
REPORTS_HOMING = 1 << 12  # of $10, in grblHAL
LOCKED = "[MSG:'$H'|'$X' to unlock]"
WORD = re.compile(r"([A-Z])\s*(-?\d+\.?\d*)")
KNOWN = {
    *("G0", "G1", "G4", "G21", "G54", "G90", "G92", "G92.1", "G94"),
    *("M2", "M8", "M9", "M64", "M65"),
}
OUTPUTS = 8
TICK_S, SPEED = 0.0005, 2000.0
Fault = Callable[[int, str], str | None]
"""By a line's number and text: drop_ok, drop_line, reset, power, error, alarm, silence."""
Answer = int | Iterator[None] | None
"""To a line: the number of an error, or what is to be waited for before its `ok`."""


@dataclass
class Machine:
    """What the controller moves and switches."""

    angle: float  # of the base, degrees, as it truly is
    lights: set[int] = field(default_factory=set)  # outputs that are on
    relay: bool = False  # whether the camera's release is closed
    let_go: int = 0  # how often the motor let go of the base


class Double:
    """What controls a machine, in a time that runs faster than the clock."""

    def __init__(self, switch_deg: float, angle: float = 3.7) -> None:
        """Control a machine whose home switch and base are at angles, degrees."""
        self.speed, self._since, self._until_then = SPEED, monotonic(), 0.0
        self.switch_deg, self.machine = switch_deg, Machine(angle)
        self.see: Callable[[Machine], None] = lambda _: None  # when it rests and a line is done
        self.released: Callable[[Machine], None] = lambda _: None
        self.fault: Fault = lambda number, line: None
        self.on_line: Callable[[int], None] = lambda number: None
        self.lines: list[str] = []

    @property
    def now(self) -> float:
        return self._until_then + (monotonic() - self._since) * self.speed

    def run_at(self, speed: float) -> None:
        """Let its time run at another speed from now on."""
        self._until_then, self._since, self.speed = self.now, monotonic(), speed

    def switch_light(self, output: int, *, on: bool) -> None:
        (self.machine.lights.add if on else self.machine.lights.discard)(output)

    def switch_relay(self, *, on: bool) -> None:
        """Switch the camera's release; a photograph comes when it closes."""
        if on and not self.machine.relay:
            self.released(self.machine)
        self.machine.relay = on


@dataclass
class Motion:
    begin: float
    end: float
    start_s: float
    seconds: float

    def at(self, now: float) -> float:
        share = (now - self.start_s) / self.seconds if self.seconds else 1.0
        return self.begin + min(1.0, max(0.0, share)) * (self.end - self.begin)


class GrblDouble(threading.Thread, Double):
    """A controller; `port` is the port to open."""

    lines_before = 12  # from the connection to the first photograph

    def __init__(
        self,
        settings: dict[int, float],
        switch_deg: float,
        firmware: str = "grblhal",
        angle: float = 3.7,
    ) -> None:
        """Control a machine by settings, by number; the firmware is grblhal or grbl."""
        threading.Thread.__init__(self, daemon=True)
        Double.__init__(self, switch_deg, angle)
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.firmware, self.greeting = firmware, BANNERS[firmware]
        self.settings = dict(settings)
        self.asked: list[float] = []
        self.held, self.homed = 0, False
        self.deaf = False  # to a feed hold
        self.boots = False  # whether opening its port lets it begin anew, as many boards do
        self._closing, self._silent = False, False
        self._mpos, self._zero = 0.0, self.machine.angle
        self._reports = 0
        self._clear()
        self.state = "Alarm" if self.settings.get(22) else "Idle"

    def _clear(self) -> None:
        self._rx = bytearray()
        self._motion: Motion | None = None
        self._steps: Iterator[None] = iter(())  # of the line that is done now
        self._reply, self._dropped = False, False
        self._homing: Motion | None = None
        self._hold_later, self._blocked = False, False
        self._offset, self._feed, self._checking = 0.0, 0.0, False

    @property
    def moving(self) -> bool:
        return self._motion is not None

    def run(self) -> None:
        while not self._closing:
            if select.select([self._master], [], [], TICK_S)[0]:
                self._receive(os.read(self._master, 4096))
            self._advance()

    def close(self) -> None:
        self._closing = True
        self.join()
        os.close(self._master)
        os.close(self._slave)

    def put_into(self, state: str) -> None:
        """Sleep, check mode or an open door, by a person at the machine."""
        self.state = state
        self._checking = state == "Check"
        self.machine.let_go += state == "Sleep"  # whatever the settings are

    def stop_by_limit(self) -> None:
        """A switch is pressed."""
        self._halt(1)

    def _say(self, text: str) -> None:
        if not self._silent:
            os.write(self._master, text.encode() + b"\r\n")

    def _receive(self, data: bytes) -> None:
        if self.boots:
            self.boots = False
            self.power_cycle()
            return
        for byte in data:
            match byte:
                case 0x18:
                    self.reset()
                case 0x3F:
                    self.asked.append(monotonic())
                    self._report()
                case 0x21:
                    self._hold()
                case _:
                    self._rx.append(byte)

    def _hold(self) -> None:
        self._hold_later = self.state == "Home"
        if self._motion is None or self.deaf:
            return
        self.held += 1
        self._mpos = self._motion.at(self.now)
        self._follow()
        self._motion = None  # a resume is not needed here
        self.state = "Hold:0"

    def reset(self) -> None:
        """Soft reset: what moved is lost; digital outputs stay as they are."""
        if self._motion is not None:
            self._mpos = self._motion.at(self.now)
            self._follow()
            self._halt(3)
        elif self._homing is not None:
            self.machine.angle = self._homing.at(self.now)
            self._alarm(6)
        self._clear()
        self.machine.relay = False
        self._say("")
        self._say(self.greeting)
        if self.state in ("Alarm", "Sleep"):
            self.state = "Alarm"
            self._say(LOCKED)
        elif not self.state.startswith("Door"):
            self.state = "Idle"

    def _alarm(self, code: int) -> None:
        self.state = "Alarm"
        self._say(f"ALARM:{code}")

    def _halt(self, code: int) -> None:
        """An alarm that lets the motor go, unless grblHAL is told to keep it on."""
        self._alarm(code)
        self._blocked = code in (1, 2)
        if self.firmware == "grbl" or not self.settings.get(37):
            self.machine.let_go += 1

    def unplug(self) -> None:
        """Answer nothing any more."""
        self._silent = True

    def plug_in(self) -> None:
        """Answer again after a silence."""
        self._silent = False
        self.power_cycle()

    def power_cycle(self) -> None:
        """Switched off and on: all outputs off."""
        self._clear()
        self.machine.lights.clear()
        self.machine.relay = False
        self.homed = False
        self._say("")
        self._say(self.greeting)
        self.state = "Alarm" if self.settings.get(22) else "Idle"
        if self.state == "Alarm":
            self._say("ALARM:11")

    def _report(self) -> None:
        plain = self.firmware == "grbl"
        reports = not plain and int(self.settings.get(10, 0)) & REPORTS_HOMING
        if (self.state == "Home" and not reports) or (plain and self._blocked):
            return
        place = self._motion.at(self.now) if self._motion else self._mpos
        state = "Run" if self._motion else self.state
        self._reports += 1
        work = f"|WCO:{self._offset:.3f},0.000,0.000" if self._reports % 10 == 1 else ""
        self._say(f"<{state}|MPos:{place:.3f},0.000,0.000|FS:0,0{work}>")

    def _follow(self) -> None:
        """Turn the base to the controller's place."""
        self.machine.angle = self._mpos + self._zero

    def _advance(self) -> None:
        if self._motion and self.now >= self._motion.start_s + self._motion.seconds:
            self._mpos, self._motion = self._motion.end, None
            self._follow()
        for _ in self._steps:
            return
        self._ok()
        if self._blocked or self.state.startswith(("Hold", "Sleep")):
            return
        if b"\n" not in self._rx:
            return
        end = self._rx.index(b"\n")
        line = self._rx[:end].decode("ascii")
        del self._rx[: end + 1]
        self._line(line)

    def _line(self, line: str) -> None:
        self.lines.append(line)
        number = len(self.lines)
        self.on_line(number)
        fault = self.fault(number, line)
        faults: dict[str | None, Callable[[], None]] = {
            "drop_line": lambda: None,
            "reset": self.reset,
            "power": self.power_cycle,
            "silence": self.unplug,
            "error": lambda: self._say("error:1"),
            "alarm": self.stop_by_limit,
        }
        if fault in faults:
            return faults[fault]()
        answer = self._run_line(line)
        if isinstance(answer, int):
            return self._say(f"error:{answer}")
        self._steps, self._dropped, self._reply = answer or iter(()), fault == "drop_ok", True

    def _ok(self) -> None:
        """End the line that was done, if there was one."""
        if not self._reply:
            return
        self._reply = False
        if not self.moving:
            self.see(self.machine)
        if not self._dropped:
            self._say("ok")

    def _run_line(self, line: str) -> Answer:
        if len(line) > LINE:
            return 11
        if line.startswith("$"):
            return self._system(line)
        if self.state == "Alarm":
            return 9
        if self._checking:
            return None
        words = WORD.findall(re.sub(r"\(.*?\)", "", line))
        codes = {f"{letter}{float(number):g}" for letter, number in words if letter in "GM"}
        return self._gcode(codes, words)

    def _system(self, line: str) -> Answer:
        if line == "$H":
            return self._homed() if self.settings.get(22) else 5
        if line == "$$":
            for number, value in sorted(self.settings.items()):
                self._say(f"${number}={value:.3f}")
        elif line == "$I":
            for text in BUILD_INFO[self.firmware]:
                self._say(text)
        elif line == "$X":
            if self.state.startswith("Door"):
                return 13
            self.state = "Idle"
        elif match := re.fullmatch(r"\$(\d+)=(-?[\d.]+)", line):
            if self.state not in ("Idle", "Alarm") or self._motion:
                return 8
            self.settings[int(match[1])] = float(match[2])
        else:
            return 3
        return None

    def _homed(self) -> Iterator[None]:
        self.state = "Home"
        seconds = abs(self.machine.angle - self.switch_deg) / self.settings[25] * 60
        self._homing = Motion(self.machine.angle, self.switch_deg, self.now, seconds)
        yield from self._until(self.now + seconds)
        pull_off = self.settings[27]
        self._mpos = -self.settings[130] + pull_off
        self._zero = self.switch_deg + pull_off - self._mpos
        self._follow()
        self._homing = None
        self.state, self.homed = "Hold:0" if self._hold_later else "Idle", True

    def _until(self, time: float) -> Iterator[None]:
        while self.now < time:
            yield

    def _at_rest(self) -> Iterator[None]:
        while self.moving:
            yield

    def _gcode(self, codes: set[str], words: list[tuple[str, str]]) -> Answer:
        values = {letter: float(number) for letter, number in words if letter in "XAFP"}
        self._feed = values.get("F", self._feed)
        if not codes <= KNOWN:
            return 20
        if "G92.1" in codes:
            self._offset = 0.0
        elif "G92" in codes:
            self._offset = self._mpos - values["X"]
        elif "G4" in codes:
            return self._dwell(values.get("P", 0.0))
        elif codes & {"M64", "M65"}:
            return self._output(int(values["P"]), on="M64" in codes)
        elif codes & {"M8", "M9"}:
            return self._release(on="M8" in codes)
        elif "X" in values:
            return self._move(values["X"] + self._offset) if self._feed else 22
        return None

    def _dwell(self, seconds: float) -> Iterator[None]:
        yield from self._at_rest()
        yield from self._until(self.now + seconds)

    def _output(self, output: int, *, on: bool) -> Answer:
        if self.firmware == "grbl":
            return 20
        if output >= OUTPUTS:
            return 39
        self.switch_light(output, on=on)
        return None

    def _release(self, *, on: bool) -> Iterator[None]:
        yield from self._at_rest()
        self.switch_relay(on=on)

    def _move(self, target: float) -> Iterator[None]:
        yield from self._at_rest()
        if self.settings.get(20) and not -self.settings[130] <= target <= 0:
            return self._halt(2)
        speed = min(self._feed, self.settings[110]) / 60
        seconds = abs(target - self._mpos) / speed + speed / self.settings[120]
        self._motion = Motion(self._mpos, target, self.now, seconds)
