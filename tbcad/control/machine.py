"""The machine as a run sees it, whatever controls it."""

from typing import Protocol

from tbcad.control.program import Move
from tbcad.types import Progress


class Machine(Protocol):
    """Motions and lights of one machine; all but `secure` raise MachineFault when it fails.

    Attributes:
        switch_s: that it needs for the lights of a photograph.
    """

    switch_s: float

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
