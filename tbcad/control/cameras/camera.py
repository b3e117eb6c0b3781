"""What a run asks of a camera."""

from dataclasses import dataclass
from typing import Protocol

from tbcad.runs.exposure import Setting


@dataclass(frozen=True)
class Shot:
    """A photograph as the camera gives it.

    Attributes:
        data: bytes of the image file, unchanged.
        suffix: of its name, in small letters, with the dot.
        settings: that the camera itself reports for it; the file may tell more.
    """

    data: bytes
    suffix: str
    settings: dict[str, Setting]


class Camera(Protocol):
    """A camera that is connected.

    Attributes:
        released: whether the controller's relay releases it.
    """

    released: bool

    def expect(self) -> None:
        """Get ready for a photograph: what was there before is none.

        Raises:
            CameraFault: the camera does not answer.
        """

    def photograph(self) -> Shot:
        """Take a photograph, or wait for the one that was released.

        Raises:
            CameraFault: there is none.
        """

    def again(self) -> None:
        """Connect anew, after a fault.

        Raises:
            CameraFault: that failed.
        """

    def close(self) -> None:
        """Give the camera up."""
