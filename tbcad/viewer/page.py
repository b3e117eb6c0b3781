"""The pages: HTML, styles, scripts and data in one file."""

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files

from tbcad.viewer.query import Query, limits


def viewer_page(title: str, start: Query, capture_mm: float, method: str) -> str:
    """The page that asks a server for views.

    Args:
        title: name of the light field.
        start: the first view.
        capture_mm: diameter of the capture sphere.
        method: of views that do not move.
    """
    allowed = limits(capture_mm)
    first = {name: getattr(start, name) for name in allowed}
    return filled("viewer", title, {"start": first, "limits": allowed, "method": method})


def filled(name: str, title: str, data: Mapping[str, object], **more: str) -> str:
    """A page with its styles, script and data.

    Args:
        name: of its HTML and script.
        title: text.
        data: what the script reads, as JSON.
        more: other HTML by the names of its places.
    """
    static = files("tbcad.viewer") / "static"
    parts = {
        "title": escape(title),
        "style": (static / "page.css").read_text(encoding="utf-8"),
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "script": (static / f"{name}.js").read_text(encoding="utf-8"),
        **more,
    }
    begin, *rest = (static / f"{name}.html").read_text(encoding="utf-8").split("{{")
    places = (piece.split("}}", 1) for piece in rest)
    return begin + "".join(parts[place] + text for place, text in places)
