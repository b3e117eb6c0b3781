"""The optical layout: the section through both cameras, with the symbols of docs/glossary.md."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from tbcad.cad.drafting.dimensions import across, diameter, labels
from tbcad.cad.drafting.sheet import (
    A3,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    placed,
    table,
)
from tbcad.cad.drafting.views import straight
from tbcad.cad.formats.checked_files import columns
from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Point, Polyline
from tbcad.core.spec.csv_rows import read_toml
from tbcad.core.spec.sizes import OpticsSpec
from tbcad.drawings.export import DrawnExport
from tbcad.records.design import DesignRecord
from tbcad.records.tables import MirrorRow
from tbcad.types import Floats

NAME = "optical_layout"
PLANAR_MM = 1e6  # radius that stands for a plane: off by 1e-5 mm over a mirror of 10 mm
IN_PLANE = 1e-9  # of a direction's y
HEAD, WIDTHS_MM = ("symbol", "what", "value"), (16.0, 58.0, 30.0)
NAMES = ("P", "C", "V")  # apex, centre and virtual camera of the mirror that is named
ELLIPSE_POINTS = 361
SIDES = (np.array([1, 1]), np.array([-1, 1]))  # camera a's, and mirrored for b
AROUND_MM = 12.0  # room round the drawing
# On paper: half a cross of a virtual camera; radius of a place, height of its name (ISO 3098-1).
CROSS_MM, DOT_MM, SYMBOL_MM = 1.5, 0.7, 5.0
BEYOND = 1.6  # of the capture radius: where reflected rays end
LEVEL_MM, LEADER_MM, LEADER_DEG = 8.0, 12.0, 200.0  # of a dimension and of the leader's corner
WORDS = "optical_layout.toml"


@dataclass(frozen=True)
class Layout:
    """The plane y = 0: x and z, mm; mirrors of camera a by their angle, over m of them."""

    optics: OpticsSpec
    rows: tuple[MirrorRow, ...]  # of all mirrors
    flat: tuple[MirrorRow, ...]  # of those whose directions are in the plane, (m,)
    pinhole: Floats  # of camera a, (2,)
    major: float  # semi-major axis of the ellipsoid
    apex: Floats  # of the mirrors, (m, 2)
    centre: Floats  # of their spheres, (m, 2)
    radius: Floats  # of them, (m,); PLANAR_MM for planar mirrors
    virtual: Floats  # virtual cameras, (m, 2)
    edges: Floats  # where neighbours' circles meet, nearest to their apices, (m - 1, 2)

    @property
    def traced(self) -> list[int]:
        """The first, the middle and the last whole mirror; the middle one's points have names."""
        last = len(self.flat) - 2
        return sorted({1, (1 + last) // 2, last}) if last >= 1 else []

    @property
    def named(self) -> int | None:
        """The mirror whose points have names."""
        return self.traced[len(self.traced) // 2] if self.traced else None


def _layout(optics: OpticsSpec, rows: Sequence[MirrorRow]) -> Layout:
    flat = [row for row in rows if row.camera == "a" and abs(row.uy) < IN_PLANE]
    flat.sort(key=lambda row: math.atan2(row.ux, row.uz))
    major = math.hypot(optics.semi_minor_mm, _half(optics))
    apex, radius = columns(flat, "px pz"), np.array([row.radius_mm or PLANAR_MM for row in flat])
    centre = apex - radius[:, np.newaxis] * columns(flat, "nx nz")
    return Layout(
        optics,
        tuple(rows),
        tuple(flat),
        np.array(optics.camera_mm)[[0, 2]],
        major,
        apex,
        centre,
        radius,
        2 * major * columns(flat, "ux uz"),
        _edges(apex, centre, radius),
    )


def _half(optics: OpticsSpec) -> float:
    """Half the distance of the foci, c, mm."""
    return float(np.linalg.norm(optics.camera_mm)) / 2


def _edges(apex: Floats, centre: Floats, radius: Floats) -> Floats:
    between = np.diff(centre, axis=0)
    distance = np.hypot(*between.T)
    along = (distance**2 + radius[:-1] ** 2 - radius[1:] ** 2) / (2 * distance)
    height = np.sqrt(np.maximum(radius[:-1] ** 2 - along**2, 0.0))
    unit = between / distance[:, np.newaxis]
    foot = centre[:-1] + along[:, np.newaxis] * unit
    across_it = height[:, np.newaxis] * np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    away = ((foot - (apex[:-1] + apex[1:]) / 2) * across_it).sum(axis=1) > 0
    return np.asarray(foot + np.where(away, -1, 1)[:, np.newaxis] * across_it)


def draw_layout(export: DrawnExport) -> list[Sheet]:
    """The sheet of a build. InputError: its mirrors.csv is not as it was written."""
    export.file(MirrorRow.FILE)
    optics = export.design.spec.optics
    layout, capture = _layout(optics, MirrorRow.read(export.folder)), optics.capture_diameter_mm / 2
    words = read_toml(files("tbcad.drawings").joinpath(WORDS), WORDS, "words")
    pinhole, reach = layout.pinhole, 2 * layout.major
    left, low, right, high = drawing_room(A3)
    column = right - sum(WIDTHS_MM)
    size = 2 * reach, reach - min(float(pinhole[1]), -capture)
    room = column - left - 2 * AROUND_MM, high - low - 2 * AROUND_MM - LEVEL_MM
    scale = choose_scale(size, room)
    middle = (left + column) / 2, high - AROUND_MM - reach * scale
    flat = [
        *_ellipses(layout),
        Circle(Layer.CUT, (0.0, 0.0), capture),
        Arc(Layer.CENTRE, (0.0, 0.0), reach, 0.0, 180.0),
        *_mirror_arcs(layout),
        *_rays(layout, capture),
    ]
    on_paper = placed(flat, middle, scale)
    block = TitleBlock(
        "optical layout", export.title, "-", 1, "-", "section y = 0", tolerances="nominal sizes"
    )
    drawn = [
        *on_paper,
        *_places(layout, middle, scale, on_paper),
        *_capture_length(layout.pinhole, capture, middle, scale),
        *table((column, high), WIDTHS_MM, (HEAD, *_values(layout, words))),
    ]
    return [Sheet.framed((NAME, NAME), block, A3, scale, middle, drawn, words["notes"])]


def has_layout(design: DesignRecord) -> bool:
    """Whether the pinholes are in the plane y = 0, which the layout is drawn in."""
    return abs(design.spec.optics.camera_mm[1]) < IN_PLANE


def _ellipses(layout: Layout) -> Iterator[Entity]:
    """Both ellipses, and lines through their foci."""
    pinhole, major = layout.pinhole, layout.major
    axis = pinhole / np.hypot(*pinhole)
    angle = np.linspace(0, 2 * np.pi, ELLIPSE_POINTS)[:-1]
    side = layout.optics.semi_minor_mm * np.outer(np.sin(angle), np.array([-axis[1], axis[0]]))
    points = pinhole / 2 + major * np.outer(np.cos(angle), axis) + side
    for flip in SIDES:
        corners = tuple((x, z) for x, z in (flip * np.round(points, 4)).tolist())
        yield Polyline(Layer.DIMENSIONS, corners)
        ends = np.stack([pinhole / 2 - major * axis, pinhole / 2 + major * axis]) * flip
        (x, z), (right, high) = ends.tolist()
        yield Line(Layer.CENTRE, (x, z), (right, high))


def _mirror_arcs(layout: Layout) -> Iterator[Entity]:
    """Arcs of whole mirrors in the plane, for camera a and mirrored for b."""
    edges = layout.edges
    for k in range(1, len(layout.flat) - 1):
        for flip in SIDES:
            (x, z), radius = (flip * layout.centre[k]).tolist(), float(layout.radius[k])
            if layout.radius[k] == PLANAR_MM:
                (a, b), (c, d) = (flip * edges[k - 1 : k + 1]).tolist()
                yield Line(Layer.CUT, (a, b), (c, d))
                continue
            ends = [
                math.degrees(math.atan2(*reversed((flip * edge - (x, z)).tolist())))
                for edge in (edges[k - 1], edges[k])
            ]
            first, last = ends if (ends[1] - ends[0]) % 360 < 180 else ends[::-1]
            yield Arc(Layer.CUT, (x, z), radius, first % 360, last % 360)


def _rays(layout: Layout, capture: float) -> Iterator[Entity]:
    """From the pinhole to edges of three mirrors, reflected, and on past the capture sphere."""
    for k in layout.traced:
        for edge in layout.edges[k - 1 : k + 1]:
            incoming = edge - layout.pinhole
            normal = (edge - layout.centre[k]) / layout.radius[k]
            out = incoming - 2 * (incoming @ normal) * normal
            out /= np.hypot(*out)
            end = edge + (-(edge @ out) + BEYOND * capture) * out
            a, b, c = (tuple(point) for point in np.round([layout.pinhole, edge, end], 4).tolist())
            yield Polyline(Layer.RAYS, (a, b, c), closed=False)


def _places(
    layout: Layout, middle: Point, scale: float, drawn: Sequence[Entity]
) -> Iterator[Entity]:
    """Dots with names, and crosses of virtual cameras."""

    def at(point: Floats) -> Point:
        x, z = point.tolist()
        return middle[0] + scale * x, middle[1] + scale * z

    for virtual in layout.virtual:
        for x, y in {at(virtual), at(virtual * [-1, 1])}:
            yield Line(Layer.DIMENSIONS, (x - CROSS_MM, y), (x + CROSS_MM, y))
            yield Line(Layer.DIMENSIONS, (x, y - CROSS_MM), (x, y + CROSS_MM))
    named = {"O": np.zeros(2), "A": layout.pinhole, "B": layout.pinhole * [-1, 1]}
    if (k := layout.named) is not None:
        shown = (layout.apex[k], layout.centre[k], layout.virtual[k])
        named |= dict(zip(NAMES, shown, strict=True))
        if layout.radius[k] == PLANAR_MM:
            del named["C"]
        yield Line(Layer.CENTRE, middle, at(layout.virtual[k]))
    dots = [Circle(Layer.CUT, at(point), DOT_MM) for point in named.values()]
    yield from dots
    yield from labels(dots, list(named), straight(drawn), height=SYMBOL_MM)


def _capture_length(
    pinhole: Floats, capture: float, middle: Point, scale: float
) -> Iterator[Entity]:
    """The capture sphere's diameter, and the distance of the pinholes."""
    x, y = middle
    turn = math.radians(LEADER_DEG)
    tip = x + scale * capture * math.cos(turn), y + scale * capture * math.sin(turn)
    corner = tip[0] - LEADER_MM, tip[1] - LEADER_MM
    sphere = Circle(Layer.CUT, middle, scale * capture)
    yield diameter(sphere, tip, corner, f"{2 * capture:g}", "capture sphere Ø<>")
    low, reach = y + scale * float(pinhole[1]), abs(float(pinhole[0]))
    left, right = (x - scale * reach, low), (x + scale * reach, low)
    yield across(left, right, low - LEVEL_MM, f"{2 * reach:g}")


def _values(layout: Layout, words: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    optics, k = layout.optics, layout.named
    radii = [row.radius_mm for row in layout.rows if row.radius_mm]
    x, y, z = optics.camera_mm
    values = {
        "optics": optics,
        "counted": " + ".join(str(sum(row.camera == one for row in layout.rows)) for one in "ab"),
        **{"x": x, "minus_x": -x, "y": y, "z": z},
        **{"major": layout.major, "virtual": 2 * layout.major, "foci": 2 * _half(optics)},
        "span": f"{min(radii):.3f} to {max(radii):.3f}" if radii else "all planar",
    }
    if k is not None:
        planar = layout.radius[k] == PLANAR_MM
        values["mirror"] = layout.flat[k]
        values["radius"] = "planar" if planar else f"{layout.radius[k]:.3f}"
    for symbol, what, value in (*words["whole"], *(words["named"] if k is not None else ())):
        yield symbol, what, value.format(**values)
