"""The pages: HTML, styles, scripts and data in one file."""

from collections.abc import Mapping
from importlib.resources import files

from tbcad.viewer.query import Query, limits
from tbcad.web_page import BEGIN, web_page


def viewer_page(
    title: str, start: Query, capture_mm: float, method: str, *, lens: bool = True
) -> str:
    """The page that asks a server for views.

    Args:
        title: name of the light field, or of a field without one.
        start: the first view.
        capture_mm: diameter of the capture sphere.
        method: of views that do not move.
        lens: whether there are views by a lens: of a light field.
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

    Args:
        name: of its HTML and script.
        title: text.
        data: what the script reads, as JSON.
        kind: what the browser shows behind the title.
        begin: the first lines.
        images: where pictures come from when there is no server.
        more: other HTML by the names of its places.
    """
    static = files("tbcad.viewer") / "static"
    blocks = {
        "style": (static / "page.css").read_text(encoding="utf-8"),
        "script": (static / f"{name}.js").read_text(encoding="utf-8"),
        **more,
    }
    body = (static / f"{name}.html").read_text(encoding="utf-8")
    return web_page(body, blocks, title=title, kind=kind, data=data, begin=begin, images=images)
