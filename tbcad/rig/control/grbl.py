"""A GRBL 1.1 or grblHAL controller, spoken to line by line: each line waits for its `ok`.

All lines of a run may be sent twice: places are absolute, outputs are set and not toggled. So a
line whose `ok` is lost is sent once more, when the controller says that it is idle. `$C` is never
sent: it ends in a soft reset, which clears G92.

Both leave `?` unanswered while they home, grblHAL unless bit 12 of $10 is set, and GRBL 1.1 after
ALARM:1 and ALARM:2. A soft reset (0x18) is read at once in all states. In mid-motion it lets the
motor go; during homing it stops the base at once, as the switch would, with the motor on.
Sources: doc/markdown/interface.md and commands.md, grbl/limits.c, protocol.c and st_go_idle of
stepper.c of GRBL 1.1h; machine_limits.c, motion_control.c, stepper.c and report.c of grblHAL core.
"""

from collections import deque
from collections.abc import Iterator
from time import monotonic

from tbcad.rig.control.messages import (
    RESTING,
    STATES,
    Message,
    SerialPort,
    Status,
    firmware_of,
    parse,
    told,
)
from tbcad.rig.control.plan import ControllerReset, MachineFault
from tbcad.types import Progress

RESET, HOLD, QUERY = b"\x18", b"!", b"?"
HOME, BUILD_INFO = "$H", "$I"
SYNC = "G4 P0.01"  # waits until all motions before it are done
STATUS_S = 0.2  # 5 Hz, as often as GRBL may be asked
SILENCE_S = 3.0  # without any answer the controller is gone
LOST_OK_S = 2.0  # idle for so long without `ok`: the line or its `ok` was lost
BANNER_S = 2.5  # boards that reset when the port is opened greet within this
LATE_S = 0.3  # answers to a line that was given up come within this
TRIES = 2
MAX_LINE = 79
GONE = "the controller does not answer: is it plugged in and switched on?"


class Grbl:
    """A controller on a port."""

    def __init__(self, port: SerialPort, note: Progress) -> None:
        """Speak to a controller; notes are what the operator should know."""
        self._port, self._note = port, note
        self._unread, self._messages = b"", deque[Message]()
        self._asked = self._heard = monotonic()
        self._held = False
        self._stopped = False  # by an alarm, since when GRBL may answer a reset only
        self.pending = ""
        self.last: Status | None = None
        self.greeting = ""

    def connect(self) -> Status:
        """Wait until the controller answers, and begin afresh; return its status.

        A controller that did not begin anew when the port was opened may have part of a line from
        a program that was killed: a soft reset at rest clears it and keeps the motor on. One that
        is silent homes, or was stopped by an alarm, which a soft reset ends as well.
        """
        for message in self._heard_within(BANNER_S, ask=True):
            if message.kind == "banner":
                self.greeting = message.text
            if message.kind in ("banner", "status"):
                break
        if self.greeting:
            self.forget()  # grblHAL tells after its greeting that it must home
        else:
            self.hold()
            self.reset()
        if (status := self.status_in_alarm()) is None:
            raise MachineFault(GONE)
        return status

    def firmware(self) -> str:
        """Firmware of the controller, as it tells: grblhal, grbl or "" (neither)."""
        found = firmware_of([self.greeting])
        if found == "grblhal":
            return found
        return firmware_of([self.greeting, *(one.text for one in self.command(BUILD_INFO))])

    def status(self) -> Status:
        """A fresh status report; MachineFault: there is none, an alarm, or a new beginning."""
        self._drain("?")
        begun = monotonic()
        asked = False
        while monotonic() - begun < SILENCE_S:
            asked = self._ask() or asked
            if (message := self._next()) is None:
                continue
            if asked and message.status is not None:
                return message.status
            self._refuse(message, "?")
        raise MachineFault(self._gone(SILENCE_S))

    def command(self, line: str, expected_s: float = 0.0, silent_s: float = 0.0) -> list[Message]:
        """Send a line and wait until it is taken; return what else came meanwhile.

        It may keep the controller busy for the expected time, and `?` unanswered for the silent
        one, as homing does. MachineFault: it is refused, answered by an alarm, or not answered;
        ControllerReset: the controller began anew.
        """
        if len(line) > MAX_LINE:
            raise MachineFault(f"{line!r} is longer than {MAX_LINE} characters")
        self._drain(line)
        self.pending = line
        for _ in range(TRIES):
            self._port.write(line.encode("ascii") + b"\n")
            if (answer := self._answer(line, expected_s, silent_s)) is not None:
                self.pending = ""
                return answer
            self._note(f"{line}: no ok came; once more")
            self._drain(line, LATE_S)
        state = self.last.state if self.last else "Idle"
        raise MachineFault(
            f"{line!r}: the controller is {state.lower()} but sends no ok: {STATES[state]}"
        )

    def _gone(self, seconds: float) -> str:
        """The fault of a silence, with the state that it began in."""
        state = "homing" if self.pending == HOME else self.last.state if self.last else "unknown"
        return f"{GONE} (silent for {seconds:.0f} s; its last state: {state})"

    def _answer(self, line: str, expected_s: float, silent_s: float) -> list[Message] | None:
        """Lines before the `ok`; None if it is lost."""
        began, idle, others = monotonic(), None, list[Message]()
        self._heard = began
        while True:
            message = self._next()
            now = monotonic()
            if message is not None:
                self._heard = now
                if message.kind == "ok":
                    return others
                self._refuse(message, line)
                others += [message] if message.kind != "status" else []
                if message.status is not None:
                    idle = self._idle_since(message.status, idle, now)
            elif now - self._heard > SILENCE_S + silent_s:
                raise MachineFault(f"{line!r}: {self._gone(now - self._heard)}")
            if idle is not None and now - idle > LOST_OK_S + expected_s:
                return None
            self._ask(began)

    def _idle_since(self, status: Status, idle: float | None, now: float) -> float | None:
        """Since when the controller rests; says so once when a person holds it."""
        held = status.state in ("Hold", "Door")
        if held and not self._held:
            self._note(f"the controller is in {status.state}: resume it at the machine to go on")
        self._held = held
        return (idle or now) if status.state in RESTING else None

    def settings(self) -> dict[int, float]:
        """The controller's settings by number."""
        return {one.code: one.value for one in self.command("$$") if one.kind == "setting"}

    def hold(self) -> None:
        """Bring a motion to rest, if there is one; the place stays known, but for homing."""
        if self.pending == HOME or self._stopped:  # may be silent, and knows no hold
            self.reset()
        elif (status := self.status_in_alarm()) is not None and not status.resting:
            if status.state == "Home":
                self.reset()
                return
            self._port.write(HOLD)
            for message in self._heard_within(SILENCE_S, ask=True):
                if message.status and message.status.resting:
                    break

    def reset(self) -> None:
        """Reset the controller, which must rest or home, and wait for its greeting."""
        self._port.write(RESET)
        for message in self._heard_within(BANNER_S):
            if message.kind == "banner":
                self.greeting = message.text
                self.pending, self._stopped = "", False
                self.forget()
                return
        raise MachineFault(f"{GONE} (no greeting after a reset)")

    def forget(self) -> None:
        """Ignore whatever was sent until now, or is about to come."""
        for _ in self._heard_within(LATE_S):
            pass

    def status_in_alarm(self) -> Status | None:
        """A status report, in alarm too; None: no answer."""
        heard = self._heard_within(SILENCE_S, ask=True)
        return next((message.status for message in heard if message.status), None)

    def _heard_within(self, seconds: float, ask: bool = False) -> Iterator[Message]:
        """Whatever comes within a time, while the status is asked for or not."""
        begun = monotonic()
        while monotonic() - begun < seconds:
            if ask:
                self._ask()
            if message := self._next():
                yield message

    def _refuse(self, message: Message, line: str) -> None:
        if message.kind == "error":
            self.pending = ""
            raise MachineFault(f"the controller refuses {told(line, message)}")
        if message.kind == "alarm":
            self._stopped = True
            raise MachineFault(f"the controller stopped at {told(line, message)}")
        if message.kind == "banner":
            raise ControllerReset(
                f"the controller began anew at {line!r} ({message.text}): it has forgotten its "
                "angle, and the motor may have let go; zero pin in before you touch supply or cable"
            )

    def _drain(self, line: str, seconds: float = 0.0) -> None:
        """Take answers that came late, so that none is taken for the next line's."""
        begun = monotonic()
        while (message := self._next(wait=seconds > 0)) or monotonic() - begun < seconds:
            if message:
                self._refuse(message, line)

    def _ask(self, not_before: float = float("-inf")) -> bool:
        """Ask for the status, if it was not asked within STATUS_S; tell whether it was."""
        now = monotonic()
        if now - max(self._asked, not_before) < STATUS_S:
            return False
        self._asked = now
        self._port.write(QUERY)
        return True

    def _next(self, wait: bool = True) -> Message | None:
        if not self._messages:
            self._unread += self._port.read(wait)
            *lines, self._unread = self._unread.split(b"\n")
            texts = (line.decode("ascii", "replace").strip() for line in lines)
            self._messages.extend(parse(text) for text in texts if text)
        if not self._messages:
            return None
        message = self._messages.popleft()
        self.last = message.status or self.last
        return message
