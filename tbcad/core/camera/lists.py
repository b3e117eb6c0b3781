"""Cameras and lenses on sale, with sizes and sources: the lists of tbcad and of users."""

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError

CAMERA_SIZES = ("sensor_width_mm", "sensor_height_mm", "width_px", "height_px")
BODY_SIZES = ("body_width_mm", "body_height_mm", "body_depth_mm", "axis_mm", "thread_mm", "mass_g")
CAMERA_COLUMNS = ("name", "mount", *CAMERA_SIZES, "control", "trigger", *BODY_SIZES, "source")
LENS_SIZES = (
    *("focal_min_mm", "focal_max_mm", "f_number_min", "f_number_max"),
    *("min_focus_m", "image_circle_mm"),
)
BARREL_SIZES = "diameter_mm", "length_mm", "mass_g"
LENS_COLUMNS = ("name", "mounts", *LENS_SIZES, *BARREL_SIZES, "source")
TEXTS = "name", "mount", "mounts", "control", "trigger", "source"
MAX_VALUE = 1e5  # of any figure
_MIRRORLESS = ("Canon RF", "Nikon Z", "Sony E", "Fujifilm G")
# From a mount's flange to the sensor, mm.
FLANGE_MM = {
    **{"Canon EF": 44.0, "Canon EF-S": 44.0, "Canon RF": 20.0, "Nikon F": 46.5, "Nikon Z": 16.0},
    **{"Sony E": 18.0, "Fujifilm G": 26.7, "C": 17.526, "CS": 12.526},
}
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
    # What a wire triggers it by, and its outline with what its tripod thread is in, lens excluded.
    # None: not known.
    trigger: str = ""
    body_width_mm: float | None = None  # across, the optical axis in its middle
    body_height_mm: float | None = None  # from the face that it stands on
    body_depth_mm: float | None = None  # from the lens's flange to its back
    axis_mm: float | None = None  # optical axis over the face that it stands on
    thread_mm: float | None = None  # tripod thread behind the lens's flange
    mass_g: float | None = None  # grams

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
    diameter_mm: float | None = None  # of its barrel, None: not known
    length_mm: float | None = None  # from its flange to its front
    mass_g: float | None = None  # grams

    def fits(self, mount: str) -> bool:
        """Whether it sits on a mount, by itself or by an adapter without optics."""
        return mount in self.mounts or any(mount in ADAPTERS.get(own, ()) for own in self.mounts)

    def ring_mm(self, mount: str) -> float:
        """Length of the adapter with which it sits on a mount that it fits, 0 without one, mm."""
        if mount in self.mounts:
            return 0.0
        own = next(one for one in self.mounts if mount in ADAPTERS.get(one, ()))
        return FLANGE_MM[own] - FLANGE_MM[mount]


def load_cameras(user_list: Path | None = None) -> list[CameraBody]:
    """Cameras of the built-in list, then of a user's; InputError names the line and column."""
    return [_camera(*one) for one in _rows("cameras.csv", user_list, CAMERA_COLUMNS)]


def load_lenses(user_list: Path | None = None) -> list[RectilinearLens]:
    """Lenses of the built-in list, then of a user's; errors as of `load_cameras`."""
    return [_lens(*one) for one in _rows("lenses.csv", user_list, LENS_COLUMNS)]


def _camera(where: str, row: Row) -> CameraBody:
    mount, source = (required_text(where, row, column) for column in ("mount", "source"))
    width, height, columns, rows = (
        positive_number(where, row, size, MAX_VALUE) for size in CAMERA_SIZES
    )
    outline = (_known(where, row, size) for size in BODY_SIZES)
    named = row["name"], mount, width, height, columns, rows, row["control"], source
    return CameraBody(*named, row["trigger"], *outline)


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
    barrel = (_known(where, row, size) for size in BARREL_SIZES)
    figures = short, long, wide_open, stopped, 1000 * metres, circle
    return RectilinearLens(row["name"], mounts, *figures, source, *barrel)


def _known(where: str, row: Row, size: str) -> float | None:
    """A cell with a size; None of an empty one."""
    return positive_number(where, row, size, MAX_VALUE) if row[size] else None


def _rows(name: str, user_list: Path | None, columns: tuple[str, ...]) -> list[tuple[str, Row]]:
    sizes = [column for column in columns if column not in TEXTS]
    lists: list[tuple[Path | Traversable, str]] = [(files("tbcad.core.camera") / name, name)]
    if user_list is not None:
        lists.append((user_list, str(user_list)))
    names: set[str] = set()
    rows = [row for file, shown in lists for row in read_rows(file, shown, columns, sizes)]
    for where, row in rows:
        required_text(where, row, "name")
        check_unique(where, row, "name", names)
    return rows
