"""The optical layout: the section through both cameras, with the symbols of docs/glossary.md."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tbcad.cad.drafting.dimensions import across, diameter, labels
from tbcad.cad.drafting.sheet import (
    A3,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    notes_beside_title,
    placed,
    sheet_frame,
    table,
)
from tbcad.cad.drafting.views import straight
from tbcad.cad.formats.checked_files import columns
from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Point, Polyline
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
AROUND_MM = 12.0  # room round the drawing
CROSS_MM, DOT_MM = 1.5, 0.7  # on paper: half a cross of a virtual camera; radius of a place
BEYOND = 1.6  # of the capture radius: where reflected rays end
LEVEL_MM, LEADER_MM, LEADER_DEG = 8.0, 12.0, 200.0  # of a dimension and of the leader's corner
NOTES = (
    "In the plane y = 0, x to the right, z up; all is to scale.",
    "O: centre of the capture sphere and focus of both ellipses; A, B: pinholes, the others.",
    "Crosses: virtual cameras, each at d = 2a from O in the direction u of its mirror.",
    "Rays: from A to both edges of the first, the middle and the last whole mirror in the",
    "plane, and as they are reflected there, traced exactly.",
    "Symbols as in docs/glossary.md.",
)


@dataclass(frozen=True)
class LayoutMirrors:
    """Mirrors of camera a whose directions are in the plane y = 0, by their angle."""

    apex: Floats  # x and z, mm, (m, 2)
    centre: Floats  # x and z of the sphere, mm, (m, 2)
    radius: Floats  # mm, (m,); PLANAR_MM for planar ones
    direction: Floats  # x and z of u, (m, 2)
    theta: Floats  # theta_0 and theta_1, deg, (m, 2)
    ids: tuple[str, ...]  # numbers of the mirrors

    def edges(self) -> Floats:
        """Where neighbours' circles meet, nearest to their apices, mm, (m - 1, 2)."""
        pairs = pairwise(range(len(self.radius)))
        return np.array([self._meeting(i, j) for i, j in pairs]).reshape(-1, 2)

    def _meeting(self, i: int, j: int) -> Floats:
        between = self.centre[j] - self.centre[i]
        distance = float(np.hypot(*between))
        along = (distance**2 + self.radius[i] ** 2 - self.radius[j] ** 2) / (2 * distance)
        height = math.sqrt(max(self.radius[i] ** 2 - along**2, 0.0))
        unit = between / distance
        foot, across_it = self.centre[i] + along * unit, np.array([-unit[1], unit[0]])
        middle = (self.apex[i] + self.apex[j]) / 2
        ends = np.stack([foot + height * across_it, foot - height * across_it])
        return np.asarray(ends[np.argmin(np.hypot(*(ends - middle).T))])


def layout_sheet(design: DesignRecord, rows: Sequence[MirrorRow], title: str) -> list[Sheet]:
    """The sheet of a design and the rows of its mirrors.csv; title: its name."""
    optics = design.spec.optics
    pinhole = np.array(optics.camera_mm)[[0, 2]]
    mirrors, minor = _mirrors(rows), optics.semi_minor_mm
    half_distance = _half(optics)
    major = math.hypot(minor, half_distance)
    capture = optics.capture_diameter_mm / 2
    reach = 2 * major
    left, low, right, high = drawing_room(A3)
    column = right - sum(WIDTHS_MM)
    size = 2 * reach, reach - min(float(pinhole[1]), -capture)
    room = column - left - 2 * AROUND_MM, high - low - 2 * AROUND_MM - LEVEL_MM
    scale = choose_scale(size, room)
    middle = (left + column) / 2, high - AROUND_MM - reach * scale
    drawn = [
        *_ellipses(pinhole, major, minor),
        Circle(Layer.CUT, (0.0, 0.0), capture),
        Arc(Layer.CENTRE, (0.0, 0.0), reach, 0.0, 180.0),
        *_mirror_arcs(mirrors),
        *_rays(mirrors, pinhole, capture),
    ]
    on_paper = placed(drawn, middle, scale)
    block = TitleBlock(
        "optical layout", title, "-", 1, "-", "section y = 0", tolerances="nominal sizes"
    )
    entities = [
        *sheet_frame(A3, scale, block),
        *on_paper,
        *_places(mirrors, pinhole, reach, middle, scale, on_paper),
        *_capture_length(capture, pinhole, middle, scale),
        *table((column, high), WIDTHS_MM, (HEAD, *_values(rows, mirrors, optics, major))),
        *notes_beside_title(A3, NOTES),
    ]
    return [Sheet(NAME, block.title, NAME, A3, scale, middle, tuple(entities))]


def layout_rows(export: DrawnExport) -> list[MirrorRow]:
    """Rows of the export's mirrors.csv. InputError: it is not as it was written."""
    export.file(MirrorRow.FILE)
    return MirrorRow.read(export.folder)


def has_layout(design: DesignRecord) -> bool:
    """Whether the pinholes are in the plane y = 0, which the layout is drawn in."""
    return abs(design.spec.optics.camera_mm[1]) < IN_PLANE


def _half(optics: OpticsSpec) -> float:
    """Half the distance of the foci, c, mm."""
    return float(np.linalg.norm(optics.camera_mm)) / 2


def _mirrors(rows: Sequence[MirrorRow]) -> LayoutMirrors:
    flat = [row for row in rows if row.camera == "a" and abs(row.uy) < IN_PLANE]
    flat.sort(key=lambda row: math.atan2(row.ux, row.uz))
    apex, normal = columns(flat, "px pz"), columns(flat, "nx nz")
    radius = np.array([row.radius_mm or PLANAR_MM for row in flat])
    return LayoutMirrors(
        apex=apex,
        centre=apex - radius[:, np.newaxis] * normal,
        radius=radius,
        direction=columns(flat, "ux uz"),
        theta=columns(flat, "theta0_deg theta1_deg"),
        ids=tuple(row.id for row in flat),
    )


def _ellipses(pinhole: Floats, major: float, minor: float) -> Iterator[Entity]:
    """Both ellipses, and lines through their foci."""
    axis = pinhole / np.hypot(*pinhole)
    angle = np.linspace(0, 2 * np.pi, ELLIPSE_POINTS)[:-1]
    side = np.array([-axis[1], axis[0]])
    points = (
        pinhole / 2 + major * np.outer(np.cos(angle), axis) + minor * np.outer(np.sin(angle), side)
    )
    for sign in (1, -1):
        corners = tuple((sign * x, z) for x, z in np.round(points, 4).tolist())
        yield Polyline(Layer.DIMENSIONS, corners)
        ends = np.stack([pinhole / 2 - major * axis, pinhole / 2 + major * axis]) * [sign, 1]
        (x, z), (right, high) = ends.tolist()
        yield Line(Layer.CENTRE, (x, z), (right, high))


def _mirror_arcs(mirrors: LayoutMirrors) -> Iterator[Entity]:
    """Arcs of whole mirrors in the plane, for camera a and mirrored for b."""
    edges = mirrors.edges()
    for k in range(1, len(mirrors.radius) - 1):
        for sign in (1, -1):
            flip = np.array([sign, 1])
            (x, z), radius = (flip * mirrors.centre[k]).tolist(), float(mirrors.radius[k])
            if radius == PLANAR_MM:
                (a, b), (c, d) = (flip * edges[k - 1 : k + 1]).tolist()
                yield Line(Layer.CUT, (a, b), (c, d))
                continue
            ends = [
                math.degrees(math.atan2(*reversed((flip * edge - (x, z)).tolist())))
                for edge in (edges[k - 1], edges[k])
            ]
            first, last = ends if (ends[1] - ends[0]) % 360 < 180 else ends[::-1]
            yield Arc(Layer.CUT, (x, z), radius, first % 360, last % 360)


def _rays(mirrors: LayoutMirrors, pinhole: Floats, capture: float) -> Iterator[Entity]:
    """From the pinhole to edges of three mirrors, reflected, and on past the capture sphere."""
    edges = mirrors.edges()
    for k in _traced(mirrors):
        for edge in (edges[k - 1], edges[k]):
            incoming = edge - pinhole
            normal = (edge - mirrors.centre[k]) / mirrors.radius[k]
            out = incoming - 2 * (incoming @ normal) * normal
            out /= np.hypot(*out)
            end = edge + (-(edge @ out) + BEYOND * capture) * out
            corners = [tuple(point) for point in np.round([pinhole, edge, end], 4).tolist()]
            yield Polyline(Layer.RAYS, ((corners[0]), corners[1], corners[2]), closed=False)


def _traced(mirrors: LayoutMirrors) -> list[int]:
    """The first, the middle and the last whole mirror of the plane."""
    last = len(mirrors.radius) - 2
    return sorted({1, (1 + last) // 2, last}) if last >= 1 else []


def _places(
    mirrors: LayoutMirrors,
    pinhole: Floats,
    reach: float,
    middle: Point,
    scale: float,
    drawn: Sequence[Entity],
) -> Iterator[Entity]:
    """Dots with names, and crosses of virtual cameras."""

    def at(point: Floats) -> Point:
        x, z = point.tolist()
        return middle[0] + scale * x, middle[1] + scale * z

    for virtual in mirrors.direction:
        for x, y in {at(reach * virtual), at(reach * virtual * [-1, 1])}:
            yield Line(Layer.DIMENSIONS, (x - CROSS_MM, y), (x + CROSS_MM, y))
            yield Line(Layer.DIMENSIONS, (x, y - CROSS_MM), (x, y + CROSS_MM))
    named = {"O": np.zeros(2), "A": pinhole, "B": pinhole * [-1, 1]}
    if traced := _traced(mirrors):
        k = traced[len(traced) // 2]
        shown = (mirrors.apex[k], mirrors.centre[k], reach * mirrors.direction[k])
        named |= dict(zip(NAMES, shown, strict=True))
        if mirrors.radius[k] == PLANAR_MM:
            del named["C"]
        yield Line(Layer.CENTRE, middle, at(reach * mirrors.direction[k]))
    dots = [Circle(Layer.CUT, at(point), DOT_MM) for point in named.values()]
    yield from dots
    yield from labels(dots, list(named), straight(drawn))


def _capture_length(
    capture: float, pinhole: Floats, middle: Point, scale: float
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


def _values(
    rows: Sequence[MirrorRow], mirrors: LayoutMirrors, optics: OpticsSpec, major: float
) -> list[tuple[str, ...]]:
    """Symbols, what they are, and their values."""
    radii = [row.radius_mm for row in rows if row.radius_mm]
    span = f"{min(radii):.3f} to {max(radii):.3f}" if radii else "all planar"
    x, y, z = optics.camera_mm
    half, minor = _half(optics), optics.semi_minor_mm
    counted = " + ".join(str(sum(row.camera == one for row in rows)) for one in "ab")
    values: list[tuple[str, ...]] = [
        ("n", "subdivision", f"{optics.n}"),
        ("", "mirrors of camera a + b", counted),
        ("2 R", "diameter of the capture sphere, mm", f"{optics.capture_diameter_mm:g}"),
        ("A", "pinhole of camera a, mm", f"({x:g}, {y:g}, {z:g})"),
        ("B", "pinhole of camera b, mm", f"({-x:g}, {y:g}, {z:g})"),
        ("a", "semi-major axis of the ellipsoid, mm", f"{major:.4f}"),
        ("b", "semi-minor axis, mm", f"{minor:g}"),
        ("2 c", "distance of the foci O and A, mm", f"{2 * half:.4f}"),
        ("d = 2 a", "from O to a virtual camera V, mm", f"{2 * major:.4f}"),
        ("r", "radii of the mirrors, mm", span),
    ]
    if traced := _traced(mirrors):
        k = traced[len(traced) // 2]
        (x, z), (first, second) = mirrors.apex[k].tolist(), mirrors.theta[k].tolist()
        own = "planar" if mirrors.radius[k] == PLANAR_MM else f"{mirrors.radius[k]:.3f}"
        values += [
            ("", "the mirror that is named", mirrors.ids[k]),
            ("P", "its apex (x, z), mm", f"({x:.3f}, {z:.3f})"),
            ("r", "its radius, C = P - r N, mm", own),
            ("theta_0", "half angle of the flat mirror, deg", f"{first:.3f}"),
            ("theta_1", "half angle wanted (eq. 1), deg", f"{second:.3f}"),
        ]
    return values
