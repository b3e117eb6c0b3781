"""What can go wrong while a run is under way: none of it is bad input."""

from tbcad.errors import one_line

PIN_FIRST = (
    "leave the supply on, for only the motor holds the base: zero pin in first, or the base falls"
)
"""What is safe when a machine does not do what it is told."""


class MachineFault(Exception):
    """The base cannot go on: the run stops here, and can be resumed."""

    def __init__(self, text: str) -> None:
        """Keep the text as one line: parts of it come from a controller."""
        super().__init__(one_line(text))


class ControllerReset(MachineFault):
    """The controller began anew in mid-run: it has forgotten its angle."""


class CameraFault(Exception):
    """A photograph that was not taken, or cannot be used: the run goes on with the next."""

    def __init__(self, text: str) -> None:
        """Keep the text as one line: parts of it come from a camera."""
        super().__init__(one_line(text))
