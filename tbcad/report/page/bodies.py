"""Contents of the 3D view: shells, bodies of prototype.glb, facts of mirrors; arrays as text."""

import base64
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.checked_files import columns
from tbcad.cad.formats.glb import ColouredMesh, read_glb
from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.primitives import Cylinder, Primitive, enclosing_triangles, revolved_along
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.design import MeshSpec, Spec
from tbcad.core.spec.errors import SpecError
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.design import NAME as DESIGN
from tbcad.records.design import DesignRecord
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import BallRow, MirrorRow, PictureRow
from tbcad.report.page.verdict import Verdict
from tbcad.shell.envelope import closing_envelope
from tbcad.shell.facets import Facets, means, middles, mirror_facets
from tbcad.shell.mesh import shell_mesh
from tbcad.types import Floats, Ints

LEVEL = 6
ALIGNED = 4  # bytes: typed arrays of a browser begin at multiples of their items
# Kinds of numbers by the names of JavaScript's typed arrays.
KINDS = {"Int16Array": "<i2", "Uint16Array": "<u2", "Uint32Array": "<u4", "Float32Array": "<f4"}

Place = list[int | str]  # where an array lies: first byte, number of items, kind


@dataclass
class PackedArrays:
    """Arrays that are added one by one, and the text that holds them all."""

    _parts: list[bytes] = field(default_factory=list)
    _size: int = 0

    def add(self, values: NDArray[Any], kind: str) -> Place:
        """Add an array, flattened, as one of KINDS; return where it lies."""
        data = np.ascontiguousarray(values, dtype=KINDS[kind]).tobytes()
        place: Place = [self._size, values.size, kind]
        padded = data + bytes(-len(data) % ALIGNED)
        self._parts.append(padded)
        self._size += len(padded)
        return place

    def text(self) -> str:
        """All arrays: zlib's format, in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), LEVEL)).decode("ascii")


UM_PER_MM = 1000.0
# Key, label, unit, digits, and field of a mirror in verify.json.
MEASURED = (
    ("covered", "Coverage, on the spheres in the files", "mm", 2, "coverage_fitted_mm"),
    ("facets", "Coverage, on the facets in the files", "mm", 2, "coverage_facet_mm"),
    ("pixels", "Pixels", "", 0, "pixels"),
    ("centre", "Position error of the centre, in the files", "µm", 3, "centre_error_mm"),
    ("radius_error", "Radius error, in the files", "µm", 3, "radius_error_mm"),
)


class Quantity(NamedTuple):
    """A figure of every mirror."""

    key: str  # short name
    label: str  # what it is
    unit: str  # of the values
    digits: int  # after the point
    values: Floats  # (m,); NaN is unknown
    map: bool = True  # whether the map can show it
    added: bool = False  # whether both halves of a mirror on the seam add up

    def packed(self, arrays: PackedArrays) -> dict[str, Any]:
        """The figure for the page."""
        told = {name: value for name, value in self._asdict().items() if name != "values"}
        return told | {"values": arrays.add(self.values, "Float32Array")}


def packed_mirrors(folder: Path, verdict: Verdict | None, arrays: PackedArrays) -> dict[str, Any]:
    """All mirrors of both cameras for the page, with the prototype's balls if there are any."""
    rows = MirrorRow.read(folder)
    there = (folder / PictureRow.FILE).is_file()  # not without a prototype
    plan = {row.mirror: row for row in PictureRow.read(folder)} if there else {}
    shown = [plan.get(row.id) for row in rows]
    off = np.array([one.error_deg if one else np.nan for one in shown])
    pointing = Quantity("pointing", "Prototype: direction error", "°", 2, off)
    quantities = [*_verified(rows, verdict), *_designed(rows), pointing]
    # Ball, stop, angle of the base and turn of the object, degrees.
    photographs = [
        one and [one.ball, one.stop, round(one.base_angle_deg, 4), one.object_turn_deg]
        for one in shown
    ]
    known = [one for one in quantities if np.isfinite(one.values).any()]
    return {
        "ids": [row.id for row in rows],
        "pose": arrays.add(columns(rows, "ux uy uz px py pz nx ny nz"), "Float32Array"),
        "radius": arrays.add(np.array([row.radius_mm or np.inf for row in rows]), "Float32Array"),
        "size": arrays.add(columns(rows, "size_mm")[:, 0], "Float32Array"),
        "quantities": [one.packed(arrays) for one in known],
        "plan": photographs if plan else [],
        "balls": _balls(folder) if plan else [],
    }


def _verified(rows: Sequence[MirrorRow], verdict: Verdict | None) -> Iterator[Quantity]:
    if verdict is None:
        return
    measured = {one.id: one for one in verdict.mirrors}
    for key, label, unit, digits, name in MEASURED:
        found = (getattr(measured.get(row.id), name, None) for row in rows)
        factor = UM_PER_MM if unit == "µm" else 1.0
        values = np.array([np.nan if value is None else factor * value for value in found])
        yield Quantity(key, label, unit, digits, values, added=key == "pixels")


def _designed(rows: Sequence[MirrorRow]) -> Iterator[Quantity]:
    def column(name: str) -> Floats:
        return columns(rows, name)[:, 0]

    yield Quantity("designed", "Coverage, as computed", "mm", 2, column("coverage_mm"))
    yield Quantity("radius", "Radius", "mm", 2, column("radius_mm"))
    yield Quantity("area", "Area of the cell", "mm²", 2, column("cell_area_mm2"), added=True)
    yield Quantity("polar", "Polar angle about the axis", "°", 2, column("polar_deg"), False)
    yield Quantity("azimuth", "Azimuth about the axis", "°", 2, column("azimuth_deg"), False)


def _balls(folder: Path) -> list[dict[str, Any]]:
    return [
        {
            "number": ball.number,
            "name": f"ball {ball.size}" if ball.kind != "cap" else ball.size,
            "apex": [ball.px, ball.py, ball.pz],
            "normal": [ball.nx, ball.ny, ball.nz],
            "radius": ball.radius_mm,
        }
        for ball in BallRow.read(folder)
    ]


Record = dict[str, Any]

# Display only, for the outlines of mirrors and the casing.
# Coarser than a design may ask for.
COARSE = MeshSpec().model_copy(
    update={"ray_error_mm": 10.0, "chord_error_mm": 1.0, "structure_error_mm": 0.2}
)
STEPS = 65_535  # of positions along a body's longest side
# In the exploded view: static parts are moved away from the object by this share of their
# distance, balls and caps out of their seats by so many radii of the capture sphere, fasteners
# against their direction, shells apart by this share of their width.
APART, LIFTED, FASTENER_MM, SHELLS_APART = 0.7, 1.5, 30.0, 0.6
STATIC = ("stage", "frame", "bought", "shroud")
SHELL_COLOUR = (0.80, 0.80, 0.80, 1.0)
RING, SHINING = (0.25, 0.26, 0.28, 1.0), (1.0, 0.85, 0.30, 1.0)
RING_MM = 12.0  # how far a ring of LEDs reaches beyond them, and its height


class Body(NamedTuple):
    """A body of the 3D view."""

    name: str  # as in the files
    group: str  # key of the group that is switched on and off
    vertices: Floats  # mm, (v, 3)
    triangles: Ints  # counter-clockwise from outside, (t, 3)
    colour: tuple[float, ...]  # red, green, blue and opacity, 0 to 1
    apart: Floats  # by how much it is moved when everything is taken apart, mm, (3,)
    turns: bool = False  # whether it turns with the base


def packed_body(body: Body, arrays: PackedArrays, *, whole: bool = False) -> Record:
    """A body for the page; its positions are rounded to STEPS along its longest side.

    Of a whole one all triangles stay, since what they are of is told in their order.
    """
    low = body.vertices.min(axis=0)
    step = float(np.ptp(body.vertices, axis=0).max()) / STEPS or 1.0
    places = np.round((body.vertices - low) / step).astype(np.int64)
    triangles = body.triangles
    if not whole:
        # One number for a place, which is sorted far faster than three.
        number = places @ [1 << 32, 1 << 16, 1]
        _, first, index = np.unique(number, return_index=True, return_inverse=True)
        places, triangles = places[first], index[triangles]
        triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    record = {
        "name": body.name,
        "group": body.group,
        "low": _short(low),
        "step": step,
        "vertices": arrays.add(places.T, "Uint16Array"),
        "triangles": arrays.add(triangles, "Uint32Array"),
        "colour": [round(float(value), 3) for value in body.colour],
        "apart": _short(body.apart),
    }
    return record if whole else record | {"turns": body.turns}


def coarse_facets(export: ExportedDesign) -> Facets:
    """Camera a's mirrors, for display only."""
    camera_a = export.reflectors[0]
    return mirror_facets(_coarse(export.spec), camera_a.cells, norm(camera_a.mirrors.apex))


def packed_shells(export: ExportedDesign, facets: Facets, arrays: PackedArrays) -> list[Record]:
    """Camera a's shell from its record, and b's as its mirror image; none if it cannot be drawn."""
    camera_a = export.reflectors[0]
    spec = _coarse(export.spec)
    distance = norm(camera_a.mirrors.apex)
    ellipsoid = Ellipsoid(camera_a.camera.pinhole, spec.optics.semi_minor_mm)
    try:
        envelope = closing_envelope(spec.shell, camera_a.cells, ellipsoid)
    except SpecError:  # a coat that leaves no room; the files are there all the same
        return []
    mesh = shell_mesh(spec, camera_a.cells, envelope, distance)
    vertices, triangles = _with_fans(mesh, facets, camera_a.mirrors)
    width = np.array([SHELLS_APART * float(np.ptp(vertices[:, 0])), 0.0, 0.0])
    shell = Body("shell_a", "shell_a", vertices, triangles, SHELL_COLOUR, width)
    owner = np.zeros(len(triangles), dtype=np.int64)
    owner[: len(facets.outlines.cell)] = facets.outlines.cell + 1
    record = packed_body(shell, arrays, whole=True) | {"owner": arrays.add(owner, "Uint16Array")}
    image = {"name": "shell_b", "group": "shell_b", "mirrored": "shell_a", "apart": _short(-width)}
    return [record, image]


def _with_fans(mesh: Mesh, facets: Facets, mirrors: Surfaces) -> tuple[Floats, Ints]:
    """A shell's mesh with a fan about the middle of each mirror in place of its facets.

    The fans come first, in the order of the outlines; the other faces need no inner vertices.
    """
    outlines, inner = facets.outlines, len(facets.vertices)
    rim, m = len(outlines.vertices), len(mirrors)
    planar = not mirrors.curvature.any()
    hubs = means(outlines.points, outlines.cell) if planar else middles(outlines, mirrors)
    fans = [outlines.vertex[outlines.following], outlines.vertex, rim + outlines.cell]
    others = mesh.triangles[len(facets.triangles) :]
    others = np.where(others < rim, others, others - inner + rim + m)
    vertices = np.concatenate([mesh.vertices[:rim], hubs, mesh.vertices[inner:]])
    return vertices, np.concatenate([np.column_stack(fans), others])


def packed_outlines(facets: Facets, arrays: PackedArrays) -> Record:
    """Points along the outline of each of camera a's cells, mm; offsets of the cells, (m + 1,)."""
    count = np.bincount(facets.outlines.cell)
    offsets = np.concatenate([[0], np.cumsum(count)])
    return {
        "points": arrays.add(facets.outlines.points, "Float32Array"),
        "offsets": arrays.add(offsets, "Uint32Array"),
    }


def prototype_bodies(folder: Path) -> Iterator[Body]:
    """All bodies of prototype.glb, in millimetres and z up."""
    record = Prototype.read(folder / NAME)
    drawn = read_glb(folder / record.assembly.glb)
    turning = {part.name for part in record.with_role("base", "cap")}
    turning |= {f"ball_{seat.ball}" for seat in record.seats}
    turning |= {one.name for one in record.bought if one.turns}
    turning |= {one.name for one in record.fasteners if one.turns}
    apart = _apart(record, drawn)
    for one in drawn:
        mesh, turns = one.mesh, one.name in turning
        points, faces = mesh.vertices, mesh.triangles
        yield Body(one.name, one.group, points, faces, one.colour, apart[one.name], turns)


def lamp_bodies(folder: Path) -> Iterator[Body]:
    """The lamps on the lenses of a shell's cameras, roughly: their rings, and each LED."""
    record = DesignRecord.read(folder / DESIGN)
    if (lamps := record.lamps) is None:
        return
    for camera in record.cameras:
        mine = [one for one in lamps.places if one.camera == camera.id]
        places, forward = np.array([one.position_mm for one in mine]), np.array(camera.forward)
        middle = np.array(camera.pinhole_mm) + lamps.front_mm * forward
        inner, outer = lamps.bore_mm / 2, norm(places[0] - middle) + RING_MM
        profile = np.array([[0, inner], [0, outer], [-RING_MM, outer], [-RING_MM, inner]])
        yield _primitive(f"lamp_ring_{camera.id}", revolved_along(profile, middle, forward), RING)
        for k, place in enumerate(places, 1):
            led = Cylinder(place, forward, lamps.emitter_mm / 2, lamps.emitter_mm / 2)
            yield _primitive(f"led_{camera.id}{k}", led, SHINING)


def _primitive(name: str, body: Primitive, colour: tuple[float, ...]) -> Body:
    corners = enclosing_triangles(body).reshape(-1, 3)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    return Body(name, "lamps", corners, triangles, colour, np.zeros(3))


def _coarse(spec: Spec) -> Spec:
    return spec.model_copy(update={"mesh": COARSE})


def _short(vector: Floats) -> list[float]:
    return [round(float(value), 4) + 0.0 for value in vector]


def _apart(record: Prototype, drawn: Sequence[ColouredMesh]) -> Mapping[str, Floats]:
    """By how much each body is moved in the exploded view, mm, (3,)."""
    radius = record.target_mm / 2
    seats = {f"ball_{seat.ball}": np.array(seat.axis) for seat in record.seats}
    seats |= {part.name: seats[f"ball_{part.ball}"] for part in record.with_role("cap")}
    moved = {}
    for one in drawn:
        points = one.mesh.vertices
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        away = APART * middle if one.group in STATIC else np.zeros(3)
        moved[one.name] = away - LIFTED * radius * seats.get(one.name, np.zeros(3))
    for screw in record.fasteners:
        held = moved.get(screw.through[0] if screw.through else "", np.zeros(3))
        moved[screw.name] = held - FASTENER_MM * np.array(screw.along)
    return moved
