"""Views of a light field or a field: one after the other as asked for, and a turntable of many."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from threading import Lock

import numpy as np

from tbcad.common.atomic_files import replace_files
from tbcad.common.compiled import compiled_loop
from tbcad.common.figure_files import image_bytes
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.datasets.pictures import PinholePictures, pinhole_pictures
from tbcad.light.depth.depth_map import DepthViews, depth_views
from tbcad.light.depth.plane_sweep import QUICK, FacingCameras, facing_cameras, nearest_cameras
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.picture import STRIDE, field_picture
from tbcad.light.simulate.parallel import chunks, first_then_threads
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import ThinLens, lens_pinholes, refocus
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.viewer.page import Query, filled
from tbcad.output.single_files import check_file
from tbcad.types import Bools, Bytes, Floats, Progress

# Pixels along the sides of blocks that are looked up in the same virtual cameras; so many of them.
BLOCK_PX, CAMERAS = 8, 16
ROWS_PER_CHUNK = 4 * BLOCK_PX


def moving_view(pictures: PinholePictures, view: Camera) -> Bytes:
    """The picture (h, w, 3) that a pinhole camera would see; black where nothing shows it.

    The camera looks at the origin.
    """
    image = np.zeros((view.height_px, view.width_px, 3), dtype=np.uint8)
    cameras = facing_cameras(pictures, view)
    place, radius = view.axes @ view.pinhole, pictures.capture_mm / 2
    lens = np.array([view.pixel_pitch, *place, place @ place - radius**2])

    def fill(rows: slice) -> None:
        _fill_rows(image, (rows.start, rows.stop), lens, cameras, pictures.picture, pictures.mask)

    first_then_threads(fill, chunks(view.height_px, ROWS_PER_CHUNK))
    return image


@compiled_loop
def _fill_rows(
    image: Bytes,
    rows: tuple[int, int],
    lens: Floats,
    cameras: FacingCameras,
    picture: Bytes,
    mask: Bools,
) -> None:
    """Fill some rows, the first that of a block.

    `lens`: pixel pitch; the pinhole along right, down, forward; its power to the sphere. `picture`
    (m, s, s, 3) and `mask` (m, s, s) are those of all cameras.
    """
    height, width, _ = image.shape
    pitch, half = lens[0], (BLOCK_PX - 1) / 2
    for top in range(rows[0], rows[1], BLOCK_PX):
        for left in range(0, width, BLOCK_PX):
            x, y = left + half - (width - 1) / 2, top + half - (height - 1) / 2
            near = nearest_cameras(cameras.place, x * pitch, y * pitch, CAMERAS)
            for row in range(top, min(top + BLOCK_PX, rows[1])):
                y = (row - (height - 1) / 2) * pitch
                for column in range(left, min(left + BLOCK_PX, width)):
                    x = (column - (width - 1) / 2) * pitch
                    along = x * lens[1] + y * lens[2] + lens[3]
                    if along * along < lens[4] * (1 + x * x + y * y):
                        continue  # passes the capture sphere
                    best, k, i, j = np.inf, -1, 0.0, 0.0
                    for c in near:
                        across = cameras.place[c, 0] - cameras.place[c, 2] * x
                        down = cameras.place[c, 1] - cameras.place[c, 2] * y
                        squared = across * across + down * down
                        if squared < best:
                            there = _place_in_picture(cameras.matrix, c, x, y, -lens[3])
                            if _known(mask, cameras.number[c], *there):
                                best, k, i, j = squared, cameras.number[c], *there
                    if k >= 0:
                        _interpolate(image, row, column, picture, k, i, j)


@compiled_loop
def _place_in_picture(
    matrix: Floats, c: int, x: float, y: float, plane: float
) -> tuple[float, float]:
    """Row and column in a camera's picture of image point (x, y), at a distance, mm."""
    away = matrix[c, 2, 0] * x + matrix[c, 2, 1] * y + matrix[c, 2, 2]
    across = matrix[c, 0, 0] * x + matrix[c, 0, 1] * y + matrix[c, 0, 2]
    down = matrix[c, 1, 0] * x + matrix[c, 1, 1] * y + matrix[c, 1, 2]
    scale = 1 / (away * plane + matrix[c, 2, 3])
    return (down * plane + matrix[c, 1, 3]) * scale, (across * plane + matrix[c, 0, 3]) * scale


@compiled_loop
def _known(mask: Bools, k: int, i: float, j: float) -> bool:
    """Whether the four pixels round a row and column of picture k are known."""
    last = mask.shape[1] - 1
    if not (0 <= i < last and 0 <= j < last):
        return False
    top, left = int(i), int(j)
    return bool(
        mask[k, top, left]
        and mask[k, top, left + 1]
        and mask[k, top + 1, left]
        and mask[k, top + 1, left + 1]
    )


@compiled_loop
def _interpolate(
    image: Bytes, row: int, column: int, picture: Bytes, k: int, i: float, j: float
) -> None:
    """Set a pixel from the four round a row and column of picture k."""
    top, left = int(i), int(j)
    down, across = i - top, j - left
    for channel in range(3):
        upper = (1 - across) * picture[k, top, left, channel]
        upper += across * picture[k, top, left + 1, channel]
        lower = (1 - across) * picture[k, top + 1, left, channel]
        lower += across * picture[k, top + 1, left + 1, channel]
        image[row, column, channel] = int((1 - down) * upper + down * lower + 0.5)


View = Callable[[Camera], Bytes]  # what makes the picture (h, w, 3) of a camera
JPEG_QUALITY = 88
# While the view moves, a lens has 9 pinholes instead of 69, at half the width and height.
MOVING_RADIUS2 = 2
MOVING_STEP = 2
MOVING_STRIDE = 1.0  # distances of a field's nodes between samples, while the view moves
MAX_BYTES = 6_000_000
BEGIN = "<!doctype html>\n<!-- tbcad turntable -->"
# Tried one after the other until the page is small enough.
WEBP_QUALITIES = (85, 75, 65, 50, 35, 20)
LOWEST_DEG, HIGHEST_DEG = 15.0, 75.0
KIND = "data:image/webp;base64,"


class Superseded(Exception):
    """Another view has been asked for meanwhile."""


class Renderer:
    """Pictures of a light field or a field; one is made at a time, by all cores."""

    def __init__(
        self, method: str, lens: MirrorTiles | None, capture_mm: float, rest: View, moving: View
    ) -> None:
        """Prepare for requests; the method is that of `rest`, of views that do not move.

        A lens's pictures are added up from a light field; None: there are none.
        """
        self.method, self.lens, self.capture_mm = method, lens, capture_mm
        self._rest, self._moving = rest, moving
        self._lock = Lock()
        self._numbers = count(1)
        self._latest = 0

    def jpeg(self, query: Query) -> bytes:
        """The picture of a query, as a JPEG file.

        Superseded: another one was asked for while the lens's pinholes were being added up.
        """
        number = self._latest = next(self._numbers)

        def proceed() -> None:
            if number != self._latest:
                raise Superseded

        with self._lock:
            image = self.picture(query, proceed)
        return image_bytes(image, "JPEG", quality=JPEG_QUALITY)

    def picture(self, query: Query, proceed: Callable[[], None] = lambda: None) -> Bytes:
        """The picture (h, w, 3) of a query; a lens that moves gives a smaller one.

        `proceed` is called now and then while a lens's pinholes are added up; it may raise.
        InputError where a lens is asked for of a field without its light field.
        """
        view = query.camera(self.capture_mm)
        if query.aperture == 0:
            return self._rest(view) if query.still else self._moving(view)
        if self.lens is None:
            raise InputError(f"aperture {query.aperture:g}: a field alone has none, give 0")
        lens = ThinLens(query.aperture, query.focus)
        if query.still:
            return refocus(self.lens, view, lens, proceed=proceed).image
        width, height = (max(side // MOVING_STEP, 1) for side in (query.width, query.height))
        smaller = replace(query, width=width, height=height).camera(self.capture_mm)
        return refocus(self.lens, smaller, lens, lens_pinholes(MOVING_RADIUS2)).image


def light_field_renderer(
    tiles: MirrorTiles, method: str = "depth", progress: Progress = lambda _: None
) -> Renderer:
    """Of a light field, whose file stays open: makes the pictures of all its virtual cameras."""
    pictures, reach = pinhole_pictures(tiles.source, progress), tiles.source.capture_mm
    rest = _synthesised(tiles, method, lambda: DepthViews(tiles, pictures))
    return Renderer(method, tiles, reach, rest, lambda at: moving_view(pictures, at))


def field_renderer(made: Field, lens: MirrorTiles | None = None) -> Renderer:
    """Of a field, and of its light field, whose file stays open, where it is at hand."""
    fast = partial(_of_field, made, stride=MOVING_STRIDE)
    return Renderer("field", lens, capture_mm(made), partial(_of_field, made), fast)


def _of_field(made: Field, view: Camera, stride: float = STRIDE) -> Bytes:
    return field_picture(made, view, stride).image


def _synthesised(tiles: MirrorTiles, method: str, by_depth: Callable[[], DepthViews]) -> View:
    if method == "depth":
        views = by_depth()
        return lambda view: views.of(view)[0].image
    return lambda view: synthesise(tiles, view).image


def capture_mm(pictured: MirrorTiles | Field) -> float:
    """Diameter of the capture sphere of a light field or a field."""
    if isinstance(pictured, Field):
        return pictured.grid.width_mm
    return pictured.source.capture_mm


@dataclass(frozen=True)
class Turntable:
    """Which pictures a turntable has."""

    columns: int  # views once around
    elevations_deg: tuple[float, ...]  # a row of views each
    distance: float  # of the camera from the middle of the object, mm
    size: tuple[int, int]  # columns and rows of a picture
    method: str  # how they are made: nearest or depth, of a light field, or field


def even_elevations(rows: int, middle_deg: float) -> tuple[float, ...]:
    """Elevations of rows: one at `middle_deg`, more evenly from LOWEST_DEG to HIGHEST_DEG."""
    if rows == 1:
        return (middle_deg,)
    return tuple(np.linspace(LOWEST_DEG, HIGHEST_DEG, rows).tolist())


def check_turntable_path(file: Path, force: bool) -> None:
    """Refuse, before any work, a file that cannot be written or that exists."""
    if file.suffix.lower() != ".html" or not file.parent.is_dir() or file.is_dir():
        raise InputError(f"{file}: give a file that ends in .html, in a folder that exists")
    check_file(file, force)


def write_turntable(
    file: Path, shown: MirrorTiles | Field, table: Turntable, title: str, progress: Progress
) -> int:
    """Write the page of a light field or a field; its size in bytes.

    InputError: it cannot be written, or so many views do not fit into MAX_BYTES.
    """
    picture = (
        partial(_of_field, shown)
        if isinstance(shown, Field)
        else _synthesised(shown, table.method, lambda: depth_views(shown, QUICK, progress))
    )
    pictures = []
    azimuths = (2 * np.pi * np.arange(table.columns) / table.columns).tolist()
    for k, elevation in enumerate(table.elevations_deg):
        progress(f"row {k + 1} of {len(table.elevations_deg)}, elevation {elevation:.0f} degrees")
        place = float(np.radians(elevation)), table.distance, capture_mm(shown), table.size
        pictures.append([picture(camera_around_object(one, *place)) for one in azimuths])
    page = smallest_loss(pictures, table, title)
    replace_files(file.parent, {file.name: page})
    return len(page)


def smallest_loss(
    pictures: Sequence[Sequence[Bytes]], table: Turntable, title: str, most: int = MAX_BYTES
) -> bytes:
    """The page with the best pictures that fit; InputError: none fit."""
    for quality in WEBP_QUALITIES:
        page = turntable_page(pictures, table, title, quality).encode("utf-8")
        if len(page) <= most:
            return page
    raise InputError(
        f"{table.columns} x {len(pictures)} views do not fit into {most / 1e6:g} MB: give fewer "
        "--frames or --rows, or a smaller --width and --height"
    )


def turntable_page(
    pictures: Sequence[Sequence[Bytes]], table: Turntable, title: str, quality: int
) -> str:
    """The page with its pictures (h, w, 3), row by row, in WebP of a quality."""
    kind = {"quality": quality, "method": 4}
    frames = [
        [b64encode(image_bytes(picture, "WEBP", **kind)).decode() for picture in row]
        for row in pictures
    ]
    data = {
        "size": table.size,
        "elevations": table.elevations_deg,
        "row": len(frames) // 2,
        "kind": KIND,
        "frames": frames,
    }
    views = sum(map(len, frames))
    about = f"{views} views of {table.size[0]} x {table.size[1]} pixels."
    return filled("turntable", title, data, begin=BEGIN, images="data: blob:", about=about)
