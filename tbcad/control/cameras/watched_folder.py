"""A folder that another program puts photographs into, one for each release of the camera."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

from tbcad.control.cameras.camera import Shot
from tbcad.control.cameras.image_facts import image_facts, suffix_of
from tbcad.control.faults import CameraFault
from tbcad.errors import InputError
from tbcad.formats.pictures import visible_files

POLL_S = 0.05
QUIET_S = 0.3  # a file that has not grown for so long, and can be read, is complete


class WatchedFolder:
    """The new file that appears after a release is the photograph."""

    def __init__(
        self, folder: Path, timeout_s: float, clock: Callable[[], float] = monotonic
    ) -> None:
        """Watch a folder.

        Raises:
            InputError: there is none.
        """
        if not folder.is_dir():
            raise InputError(f"--camera folder:{folder}: there is no such folder: make it first")
        self._folder, self._timeout_s, self._clock = folder, timeout_s, clock
        self._known: set[str] = set()
        self.released = True

    def expose(self, seconds: float) -> None:
        """Refuse: a relay tells a camera nothing."""
        raise CameraFault(f"a camera on a relay cannot be told to expose for {seconds:g} s")

    def expect(self) -> None:
        """Remember which files are there."""
        self._known = self._names()

    def photograph(self) -> Shot:
        """Wait until a new file is there and complete."""
        end, sizes = self._clock() + self._timeout_s, dict[str, tuple[int, float]]()
        fault = f"no photograph came into {self._folder} within {self._timeout_s:g} s"
        while self._clock() < end:
            new = sorted(self._names() - self._known)
            if len(new) > 1:
                raise CameraFault(f"{len(new)} photographs came into {self._folder}, not one")
            if new and self._rests(self._folder / new[0], sizes):
                data, suffix = (self._folder / new[0]).read_bytes(), suffix_of(new[0])
                try:
                    image_facts(data, suffix)
                except CameraFault as error:  # more of it may come
                    fault = str(error)
                else:
                    return Shot(data, suffix, {})
            sleep(POLL_S)
        raise CameraFault(fault)

    def _rests(self, path: Path, sizes: dict[str, tuple[int, float]]) -> bool:
        """Whether a file has had its size for a while."""
        try:
            size, now = path.stat().st_size, self._clock()
        except FileNotFoundError:
            return False
        before, since = sizes.setdefault(path.name, (size, now))
        if size != before:
            sizes[path.name] = (size, now)
            return False
        return size > 0 and now - since >= QUIET_S

    def _names(self) -> set[str]:
        try:
            return {path.name for path in visible_files(self._folder)}
        except OSError as error:
            raise CameraFault(f"{self._folder} cannot be read: {error.strerror}") from None

    def again(self) -> None:
        """Connect anew: nothing to do."""

    def close(self) -> None:
        """Give up: nothing to do."""
