"""One camera with its mirrors: of a design, or as a build records it, checked."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ConfigDict

from tbcad.cad.formats.checked_files import REBUILD, Record, columns
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorDesign, numbered_directions
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import (
    GrooveWalls,
    PedestalCells,
    groove_walls,
    pedestal_cells,
)
from tbcad.core.optics.pedestals.plan import pedestal_plan
from tbcad.core.optics.power_diagram import NotRegularError, bounded_triangulation
from tbcad.core.optics.surfaces import Surfaces, planes
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.records.design import NAME as DESIGN_FILE
from tbcad.records.design import CameraRecord, DesignRecord
from tbcad.records.tables import MirrorRow
from tbcad.types import Floats, Ints

# Boxes around cells in the picture are widened by this: an arc may bulge beyond its samples.
MARGIN_PX = 2
ARC_SAMPLES = np.linspace(0, 1, 9)
# What is called a unit vector may be off by rounding in a text file.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Reflector:
    """One camera and its m mirrors, in the order of their ids."""

    camera_id: str  # "a" or "b"
    camera: Camera  # its pinhole, axes and sensor
    u: Floats  # directions of the virtual cameras, (m, 3)
    cells: Cells  # of the reflecting surfaces

    def __len__(self) -> int:
        return len(self.u)

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces without the seam and the foot plane."""
        return self.cells.mirror_surfaces

    @property
    def walls(self) -> GrooveWalls:
        """What ends mirrors on pedestals, besides seam and foot."""
        return groove_walls(self.cells)

    @property
    def foot(self) -> float:
        """Height z of the foot plane, mm."""
        return float(self.cells.surfaces.apex[self.cells.foot, 2])

    @property
    def side(self) -> float:
        """Sign of x on the side of the seam where the mirrors are."""
        return 1.0 if self.camera_id == "a" else -1.0

    def boxes(self) -> Ints:
        """Columns and rows that hold each cell's picture: x0, x1, y0, y1, ends excluded, (m, 4)."""
        arcs, m = self.cells.arcs, len(self)
        which = np.broadcast_to(np.arange(len(arcs))[:, None], (len(arcs), len(ARC_SAMPLES)))
        samples = arcs.at(which, np.broadcast_to(ARC_SAMPLES, which.shape))
        pixels = self.camera.project(samples)
        low, high = np.full((m, 2), np.inf), np.full((m, 2), -np.inf)
        for faces in (arcs.left, arcs.right):
            mine = faces < m
            np.minimum.at(low, faces[mine], pixels[mine].min(axis=1))
            np.maximum.at(high, faces[mine], pixels[mine].max(axis=1))
        size = np.array([self.camera.width_px, self.camera.height_px])
        first = np.clip(np.floor(low) - MARGIN_PX, 0, size)
        last = np.clip(np.ceil(high) + 1 + MARGIN_PX, 0, size)
        return np.stack([first, last], axis=2).reshape(m, 4).astype(np.int64)

    def neighbours_at_edge(self) -> Ints:
        """For each mirror the neighbours that the seam or the foot cuts, -1 where no more, (m, k).

        A ray may enter the sphere of such a neighbour beyond the edge, where there is no mirror;
        what it would meet inside that sphere lies in the wall. Mirrors on pedestals end at planes
        of their own: they have no such neighbours.
        """
        faces, m = self.cells.arcs.faces, len(self)
        if isinstance(self.cells, PedestalCells):
            return np.full((m, 0), -1)
        cut = np.zeros(m + 2, dtype=bool)
        cut[faces[(faces >= m).any(axis=1)].min(axis=1)] = True
        pairs = np.concatenate([faces, faces[:, ::-1]])
        pairs = pairs[(pairs < m).all(axis=1) & cut[pairs[:, 1]]]
        pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
        count = np.bincount(pairs[:, 0], minlength=m)
        place = np.arange(len(pairs)) - np.repeat(np.cumsum(count) - count, count)
        table = np.full((m, int(count.max(initial=0))), -1)
        table[pairs[:, 0], place] = pairs[:, 1]
        return table


@dataclass(frozen=True)
class SubstitutedReflector(Reflector):
    """A camera with other surfaces in place of its mirrors."""

    surfaces: Surfaces  # in place of the mirrors, (m,)

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces."""
        return self.surfaces


def reflectors(design: MirrorDesign) -> tuple[Reflector, Reflector]:
    """Both cameras of a design with their mirrors."""
    a, b = (
        Reflector(array.camera_id, array.camera, array.u, array.cells) for array in design.arrays
    )
    return a, b


class ExportedDesign(Record):
    """What the simulation needs of a build."""

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    folder: Path  # where it lies
    spec: Spec  # the design that was asked for
    capture_mm: float  # diameter of the capture sphere
    # camera a and camera b with the mirrors that were recorded
    reflectors: tuple[Reflector, Reflector]


def read_export(folder: Path) -> ExportedDesign:
    """Read the record of a folder that `tbcad build` wrote.

    InputError: it is none, or what it says cannot be.
    """
    path = folder / DESIGN_FILE
    document = DesignRecord.read(path)
    if tuple(camera.id for camera in document.cameras) != ("a", "b"):
        raise InputError(f"{path}: cameras are not a and b: {REBUILD}")
    table, mirrors = folder / MirrorRow.FILE, MirrorRow.read(folder)
    a, b = (
        _reflector(table, document, camera, [one for one in mirrors if one.camera == camera.id])
        for camera in document.cameras
    )
    return ExportedDesign(
        folder=folder, spec=document.spec, capture_mm=document.target_mm, reflectors=(a, b)
    )


def _reflector(
    path: Path, document: DesignRecord, camera: CameraRecord, mirrors: list[MirrorRow]
) -> Reflector:
    n = document.spec.optics.n
    every, faces = numbered_directions(n, document.spec.optics.stretch)
    kept = (every[:, 0] >= 0) & (every[:, 2] >= 0)
    if len(mirrors) != kept.sum():
        raise InputError(
            f"{path}: camera {camera.id} has {len(mirrors)} mirrors, allowed is "
            f"{kept.sum()} at n = {n}: {REBUILD}"
        )
    mirrored = camera.id == "b"
    triangles = bounded_triangulation(faces, every, kept)
    u, surfaces = _surfaces(path, mirrors)
    walls = planes(
        np.array([[0, 0, 0], [0, 0, document.foot_z_mm]]),
        np.array([[-1.0 if mirrored else 1.0, 0, 0], [0, 0, 1]]),
    )
    try:
        start = triangles[:, ::-1] if mirrored else triangles
        if document.spec.shell.edges == "pedestal":
            pinhole, groove = np.array(camera.pinhole_mm), document.spec.shell.groove_mm
            plan = pedestal_plan(surfaces.joined(walls), start, pinhole, groove)
            cells: Cells = pedestal_cells(plan, surfaces)
        else:
            cells = cells_of(surfaces.joined(walls), start)
    except NotRegularError as error:
        raise InputError(
            f"{path}: the mirrors of camera {camera.id} bound no cells: {error}: {REBUILD}"
        ) from None
    return Reflector(camera.id, _view(path.with_name(DESIGN_FILE), camera), u, cells)


def _surfaces(path: Path, mirrors: list[MirrorRow]) -> tuple[Floats, Surfaces]:
    names = "ux uy uz", "px py pz", "nx ny nz"
    u, apex, normal = (columns(mirrors, three) for three in names)
    curvature = np.array([1 / one.radius_mm if one.radius_mm else 0.0 for one in mirrors])
    for name, vectors in (("u", u), ("n", normal)):
        if np.abs(norm(vectors) - 1).max() > ROUNDING:
            raise InputError(f"{path}: mirrors have {name} of another length than 1: {REBUILD}")
    return u, Surfaces(apex, normal, curvature)


def _view(path: Path, camera: CameraRecord) -> Camera:
    forward, right = np.array(camera.forward), np.array(camera.right)
    gram = np.array([forward @ forward - 1, right @ right - 1, forward @ right])
    if np.abs(gram).max() > ROUNDING:
        raise InputError(f"{path}: camera {camera.id} has axes that are not square: {REBUILD}")
    return Camera(
        np.array(camera.pinhole_mm),
        forward,
        right,
        camera.width_px,
        camera.height_px,
        float(np.radians(camera.hfov_deg)),
    )
