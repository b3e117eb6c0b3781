"""The pages, HTML, styles, scripts and data in one file; and what a page asks for."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from math import isfinite, radians
from urllib.parse import parse_qsl

from tbcad.common.web_page import BEGIN, web_page
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.simulate.scene.rays import camera_around_object

MAX_DISTANCE_MM = 5000.0
MAX_APERTURE_MM = 300.0
MIN_PX, MAX_PX = 16, 2048
SHOWN = 40  # characters of what is not allowed
# The nearest viewpoint, in radii of the capture sphere.
MIN_RADII = 1.5


@dataclass(frozen=True)
class Query:
    """One view."""

    azimuth: float = 0.0  # degrees
    elevation: float = 30.0  # degrees
    distance: float = 640.0  # of the camera from the middle of the object, mm
    aperture: float = 0.0  # diameter of the lens, mm; 0 for a pinhole
    focus: float = 0.0  # sharp plane, mm from the middle of the object toward the camera
    width: int = 640  # columns
    height: int = 480  # rows
    still: int = 0  # 1 for the best picture, 0 for the quickest

    def check(self, capture_mm: float) -> "Query":
        """This query, if all of its values are allowed; else InputError."""
        for name, (low, high) in limits(capture_mm).items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"{name} {value:g} is not allowed: {low:g} to {high:g}")
        return self

    def camera(self, capture_mm: float) -> Camera:
        """The camera of this view."""
        size = self.width, self.height
        angles = radians(self.azimuth), radians(self.elevation)
        return camera_around_object(*angles, self.distance, capture_mm, size)


def limits(capture_mm: float) -> dict[str, tuple[float, float]]:
    """The least and the largest value of each part of a query."""
    radius = capture_mm / 2
    return {
        "azimuth": (-3600.0, 3600.0),
        "elevation": (0.0, 90.0),
        "distance": (MIN_RADII * radius, MAX_DISTANCE_MM),
        "aperture": (0.0, MAX_APERTURE_MM),
        "focus": (-radius, radius),
        "width": (MIN_PX, MAX_PX),
        "height": (MIN_PX, MAX_PX),
        "still": (0, 1),
    }


def parse_query(text: str, capture_mm: float) -> Query:
    """The query of an address; what it leaves out has its default.

    InputError: a name is unknown or given twice, or a value is no number or not allowed.
    """
    kinds = {one.name: type(one.default) for one in fields(Query)}
    try:
        pairs = parse_qsl(text, keep_blank_values=True, max_num_fields=len(kinds))
    except ValueError:
        raise InputError("the query has too many parts") from None
    values = asdict(Query())
    for k, (name, value) in enumerate(pairs):
        if name not in kinds or name in {before for before, _ in pairs[:k]}:
            raise InputError(
                f"{name[:SHOWN]!r} is unknown or given twice: allowed is {', '.join(kinds)}"
            )
        values[name] = _number(name, value, kinds[name])
    return Query(**values).check(capture_mm)


def _number(name: str, text: str, kind: type) -> float:
    try:
        value: float = kind(text)
        finite = isfinite(value)
    except (ValueError, OverflowError):  # of a whole number beyond all floats
        finite = False
    if not finite:
        raise InputError(f"{name} {text[:SHOWN]!r} is no number")
    return value


def viewer_page(
    title: str, start: Query, capture_mm: float, method: str, *, lens: bool = True
) -> str:
    """The page that asks a server for views, beginning with one.

    `method` is that of views that do not move; `lens`: whether there are views by a lens, of a
    light field.
    """
    allowed = limits(capture_mm)
    first = {name: getattr(start, name) for name in allowed}
    data = {"start": first, "limits": allowed, "method": method, "lens": lens}
    return filled("viewer", title, data, kind=": light field" if lens else ": field")


def filled(
    name: str,
    title: str,
    data: Mapping[str, object],
    *,
    kind: str = "",
    begin: str = BEGIN,
    images: str = "",
    **more: str,
) -> str:
    """A page with its styles, script and data.

    `name` is that of its HTML and script; the script reads `data` as JSON; `kind` is shown behind
    the title; `images` says where pictures come from without a server; `more` is other HTML by the
    names of its places.
    """
    static = files("tbcad.light.viewer") / "static"
    blocks = {
        "style": (static / "page.css").read_text(encoding="utf-8"),
        "script": (static / f"{name}.js").read_text(encoding="utf-8"),
        **more,
    }
    body = (static / f"{name}.html").read_text(encoding="utf-8")
    return web_page(body, blocks, title=title, kind=kind, data=data, begin=begin, images=images)
