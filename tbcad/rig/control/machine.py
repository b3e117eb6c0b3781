"""The machine as a run sees it, whatever controls it."""

from typing import Protocol

from tbcad.errors import one_line
from tbcad.rig.control.plan import Move
from tbcad.types import Progress

PIN_FIRST = (
    "leave the supply on, for only the motor holds the base: zero pin in first, or the base falls"
)
"""What is safe when a machine does not do what it is told."""


class _Fault(Exception):
    def __init__(self, text: str) -> None:
        """Keep the text as one line: parts of it come from a controller or a camera."""
        super().__init__(one_line(text))


class MachineFault(_Fault):
    """The base cannot go on: the run stops here, and can be resumed."""


class ControllerReset(MachineFault):
    """The controller began anew in mid-run: it has forgotten its angle."""


class CameraFault(_Fault):
    """A photograph that was not taken, or cannot be used: the run goes on with the next."""


class DrivenMachine(Protocol):
    """Motions and lights of one machine; all but `secure` raise MachineFault when it fails."""

    switch_s: float  # that it needs for the lights of a photograph

    def connect(self) -> None:
        """Wait until the controller answers."""

    def check_settings(self, note: Progress, *, send: bool) -> None:
        """Refuse settings that are not the build's by an InputError, or send and tell them."""

    def home(self) -> None:
        """Bring the base to a known angle, all lights off."""

    def drive(self, move: Move, settle_s: float = 0.0) -> None:
        """Drive to a place and rest there."""

    def light(self, output: int, *, on: bool) -> None:
        """Switch a light; the base is at rest then."""

    def wait(self, seconds: float) -> None:
        """Let lights that were switched settle."""

    def release(self) -> None:
        """Close the camera's relay for as long as it needs."""

    def secure(self) -> str:
        """Hold the base and switch all lights off; return what could not be done, if anything."""
