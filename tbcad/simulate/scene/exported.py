"""What an export says of its cameras and mirrors: design.json, checked before it is used."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tbcad.errors import InputError
from tbcad.geometry.vectors import norm
from tbcad.mirrors.array import numbered_directions
from tbcad.optics.camera import Camera
from tbcad.optics.cells import cells_of
from tbcad.optics.power_diagram import NotRegularError, bounded_triangulation
from tbcad.optics.surfaces import Surfaces, planes
from tbcad.simulate.scene.reflector import Reflector
from tbcad.spec.design import Spec
from tbcad.types import Floats

NAME = "design.json"
LARGEST_FILE = 200_000_000  # bytes; n = 60 takes 12 million
AGAIN = "build it again with tbcad build"
# What is called a unit vector may be off by rounding in a text file.
ROUNDING = 1e-9

Number = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]


class Record(BaseModel):
    """A table of a file: what else it has is left alone."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class _Camera(Record):
    id: Literal["a", "b"]
    pinhole_mm: Vector
    forward: Vector
    right: Vector
    width_px: int = Field(ge=16, le=32_768)
    height_px: int = Field(ge=16, le=32_768)
    hfov_deg: float = Field(ge=1, le=170)


class _Mirror(Record):
    id: str
    camera: Literal["a", "b"]
    ux: Number
    uy: Number
    uz: Number
    px: Number
    py: Number
    pz: Number
    nx: Number
    ny: Number
    nz: Number
    radius_mm: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None


class _Document(Record):
    schema_name: Literal["tbcad-design/1"] = Field(alias="schema")
    spec: dict[str, Any]
    target_mm: float = Field(gt=0, le=1000)
    foot_z_mm: Number
    cameras: tuple[_Camera, _Camera]
    mirrors: list[_Mirror]


class Exported(Record):
    """An export as light meets it.

    Attributes:
        folder: where it lies.
        spec: the design that was asked for.
        capture_mm: diameter of the capture sphere.
        reflectors: camera a and camera b with the mirrors that were recorded.
    """

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    folder: Path
    spec: Spec
    capture_mm: float
    reflectors: tuple[Reflector, Reflector]


def read_export(folder: Path) -> Exported:
    """Read the record of a folder that `tbcad build` wrote.

    Raises:
        InputError: it is none, or what it says cannot be.
    """
    path = folder / NAME
    document = _document(path)
    try:
        spec = Spec.model_validate(document.spec)
    except ValidationError as error:
        raise _refused(path, error, "spec.") from None
    a, b = (_reflector(path, document, spec, camera) for camera in document.cameras)
    if (a.camera_id, b.camera_id) != ("a", "b"):
        raise InputError(f"{path}: cameras are not a and b: {AGAIN}")
    return Exported(folder=folder, spec=spec, capture_mm=document.target_mm, reflectors=(a, b))


def _document(path: Path) -> _Document:
    if not path.is_file():
        raise InputError(f"{path} is not there: name a folder that tbcad build wrote")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path} is over 200 MB, no design: {AGAIN}")
    try:
        return _Document.model_validate(json.loads(path.read_bytes()))
    except ValidationError as error:
        raise _refused(path, error) from None
    except (ValueError, RecursionError, OSError) as error:
        raise InputError(f"{path} cannot be read: {error}: {AGAIN}") from None


def _refused(path: Path, error: ValidationError, prefix: str = "") -> InputError:
    first = error.errors(include_url=False, include_context=False)[0]
    where = prefix + ".".join(str(part) for part in first["loc"])
    return InputError(f"{path}: {where}: {first['msg'].lower()}: {AGAIN}")


def _reflector(path: Path, document: _Document, spec: Spec, camera: _Camera) -> Reflector:
    every, faces = numbered_directions(spec.optics.n)
    kept = (every[:, 0] >= 0) & (every[:, 2] >= 0)
    mine = [mirror for mirror in document.mirrors if mirror.camera == camera.id]
    if len(mine) != kept.sum():
        raise InputError(
            f"{path}: camera {camera.id} has {len(mine)} mirrors, allowed is "
            f"{kept.sum()} at n = {spec.optics.n}: {AGAIN}"
        )
    mirrored = camera.id == "b"
    triangles, boundary = bounded_triangulation(faces, every, kept)
    u, mirrors = _surfaces(path, mine)
    walls = planes(
        np.array([[0, 0, 0], [0, 0, document.foot_z_mm]]),
        np.array([[-1.0 if mirrored else 1.0, 0, 0], [0, 0, 1]]),
    )
    try:
        cells = cells_of(
            mirrors.joined(walls), boundary, triangles[:, ::-1] if mirrored else triangles
        )
    except NotRegularError as error:
        raise InputError(
            f"{path}: the mirrors of camera {camera.id} bound no cells: {error}: {AGAIN}"
        ) from None
    return Reflector(camera.id, _view(path, camera), u, cells)


def _surfaces(path: Path, mirrors: list[_Mirror]) -> tuple[Floats, Surfaces]:
    columns = np.array(
        [
            (
                m.ux,
                m.uy,
                m.uz,
                m.px,
                m.py,
                m.pz,
                m.nx,
                m.ny,
                m.nz,
                1 / m.radius_mm if m.radius_mm else 0,
            )
            for m in mirrors
        ]
    )
    u, apex, normal, curvature = np.split(columns, [3, 6, 9], axis=1)
    for name, vectors in (("u", u), ("n", normal)):
        if np.abs(norm(vectors) - 1).max() > ROUNDING:
            raise InputError(f"{path}: mirrors have {name} of another length than 1: {AGAIN}")
    return u, Surfaces(apex, normal, curvature[:, 0])


def _view(path: Path, camera: _Camera) -> Camera:
    forward, right = np.array(camera.forward), np.array(camera.right)
    gram = np.array([forward @ forward - 1, right @ right - 1, forward @ right])
    if np.abs(gram).max() > ROUNDING:
        raise InputError(f"{path}: camera {camera.id} has axes that are not square: {AGAIN}")
    return Camera(
        np.array(camera.pinhole_mm),
        forward,
        right,
        camera.width_px,
        camera.height_px,
        float(np.radians(camera.hfov_deg)),
    )
