"""Cameras and lenses that exist: CSV lists with their sources, which users extend by their own."""

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError

CAMERA_SIZES = ("sensor_width_mm", "sensor_height_mm", "width_px", "height_px")
CAMERA_COLUMNS = ("name", "mount", *CAMERA_SIZES, "control", "source")
LENS_SIZES = (
    *("focal_min_mm", "focal_max_mm", "f_number_min", "f_number_max"),
    *("min_focus_m", "image_circle_mm"),
)
LENS_COLUMNS = ("name", "mounts", *LENS_SIZES, "source")
MAX_VALUE = 1e5  # of any figure
_MIRRORLESS = ("Canon RF", "Nikon Z", "Sony E", "Fujifilm G")
# Mounts on which lenses of another mount sit by a plain ring, which keeps the lens's distance.
ADAPTERS = {
    "Canon EF": _MIRRORLESS,
    "Canon EF-S": ("Canon RF", "Sony E"),
    "Nikon F": (*_MIRRORLESS, "Canon EF"),
    "C": ("CS",),
}


@dataclass(frozen=True)
class CameraBody:
    """A camera with square pixels."""

    name: str  # maker and model
    mount: str  # of lenses
    width_mm: float  # of the sensor's picture
    height_mm: float  # of it
    width_px: float  # its columns
    height_px: float  # its rows
    control: str  # by which a computer triggers it
    source: str  # of the figures

    @property
    def pixel_mm(self) -> float:
        """Width of a pixel."""
        return self.width_mm / self.width_px


@dataclass(frozen=True)
class RectilinearLens:
    """A lens that keeps straight lines straight."""

    name: str  # maker and model
    mounts: tuple[str, ...]  # in which it is sold
    focal_min_mm: float  # shortest focal length, for a distant object
    focal_max_mm: float  # longest; the same where it does not zoom
    f_number_min: float  # fully open at the shortest focal length
    f_number_max: float  # fully stopped down
    min_focus_mm: float  # smallest distance from the sensor to what is in focus
    image_circle_mm: float  # diagonal of the sensor that it covers
    source: str  # of the figures

    def fits(self, mount: str) -> bool:
        """Whether it sits on a mount, by itself or by an adapter without optics."""
        return any(mount == own or mount in ADAPTERS.get(own, ()) for own in self.mounts)


def load_cameras(user_list: Path | None = None) -> list[CameraBody]:
    """Cameras of the built-in list, then of a user's; InputError names the line and column."""
    return [_camera(*one) for one in _rows("cameras.csv", user_list, CAMERA_COLUMNS, CAMERA_SIZES)]


def load_lenses(user_list: Path | None = None) -> list[RectilinearLens]:
    """Lenses of the built-in list, then of a user's; errors as of `load_cameras`."""
    return [_lens(*one) for one in _rows("lenses.csv", user_list, LENS_COLUMNS, LENS_SIZES)]


def _camera(where: str, row: Row) -> CameraBody:
    mount, source = (required_text(where, row, column) for column in ("mount", "source"))
    width, height, columns, rows = (
        positive_number(where, row, size, MAX_VALUE) for size in CAMERA_SIZES
    )
    return CameraBody(row["name"], mount, width, height, columns, rows, row["control"], source)


def _lens(where: str, row: Row) -> RectilinearLens:
    short, long, wide_open, stopped, metres, circle = (
        positive_number(where, row, size, MAX_VALUE) for size in LENS_SIZES
    )
    for low, high, name in ((short, long, "focal_max_mm"), (wide_open, stopped, "f_number_max")):
        if high < low:
            raise SpecError(
                f"{where}, column {name}: {high:g}, allowed is {low:g} or more: correct it"
            )
    mounts = tuple(required_text(where, row, "mounts").split("|"))
    source = required_text(where, row, "source")
    return RectilinearLens(
        row["name"], mounts, short, long, wide_open, stopped, 1000 * metres, circle, source
    )


def _rows(
    name: str, user_list: Path | None, columns: tuple[str, ...], sizes: tuple[str, ...]
) -> list[tuple[str, Row]]:
    lists: list[tuple[Path | Traversable, str]] = [(files("tbcad.core.camera") / name, name)]
    if user_list is not None:
        lists.append((user_list, str(user_list)))
    names: set[str] = set()
    rows = [row for file, shown in lists for row in read_rows(file, shown, columns, sizes)]
    for where, row in rows:
        required_text(where, row, "name")
        check_unique(where, row, "name", names)
    return rows
