"""What an export says of its cameras and mirrors: design.json and mirrors.csv, checked."""

from pathlib import Path

import numpy as np
from pydantic import ConfigDict

from tbcad.cad.formats.checked_files import REBUILD, Record, columns
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import numbered_directions
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import pedestal_cells
from tbcad.core.optics.pedestals.plan import pedestal_plan
from tbcad.core.optics.power_diagram import NotRegularError, bounded_triangulation
from tbcad.core.optics.surfaces import Surfaces, planes
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.records.design import NAME as DESIGN_FILE
from tbcad.records.design import CameraRecord, DesignRecord
from tbcad.records.tables import MirrorRow
from tbcad.types import Floats

# What is called a unit vector may be off by rounding in a text file.
ROUNDING = 1e-9


class ExportedDesign(Record):
    """What the simulation needs of an export."""

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    folder: Path  # where it lies
    spec: Spec  # the design that was asked for
    capture_mm: float  # diameter of the capture sphere
    # camera a and camera b with the mirrors that were recorded
    reflectors: tuple[Reflector, Reflector]


def read_export(folder: Path) -> ExportedDesign:
    """Read the record of a folder that `tbcad build` wrote.

    Raises:
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
