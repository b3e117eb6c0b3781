"""camera.json against the mirrors: where the virtual images lie, and the stop that suits them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from tbcad_verify.mesh.surfaces import Surfaces, reflect_directions
from tbcad_verify.mesh.vectors import cross, dot, norm, unit
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.validation import Strict, parse_json, validated
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list
from tbcad_verify.types import Floats

SCHEMA, SHEET = "tbcad-camera/1", "camera.json"
SHARE = 1e-4  # by which a figure may be off: rays at a finite distance from the principal one
STEP = 3e-4  # of that distance, as a share of the apex's from the object
ROUNDING_PX = 1e-6
WAVELENGTH_MM, AIRY_FACTOR = 550e-6, 2.44


class Requirements(Strict):
    """What the sheet asks of a camera and its lens."""

    width_px: int
    height_px: int
    hfov_deg: float = Field(gt=0, lt=180)
    vfov_deg: float = Field(gt=0, lt=180)
    near_mm: float = Field(gt=0)
    far_mm: float = Field(gt=0)
    focus_mm: float = Field(gt=0)
    pupil_mm: float = Field(gt=0)
    blur_px: float = Field(ge=0)
    airy_px: float = Field(ge=0)
    total_px: float = Field(ge=0)


class Sheet(Strict):
    """camera.json, of which the candidates are advice and not verified."""

    requirements: Requirements


@dataclass(frozen=True)
class Depths:
    """Depth of the nearest and the farthest virtual image, mm."""

    near: float
    far: float


def read_sheet(export: Export) -> Requirements:
    """What camera.json asks.

    Raises:
        BadExport: the sheet is missing or malformed.
    """
    text = read(export.folder, SHEET, MAX_TEXT_BYTES)
    return validated(SHEET, Sheet, parse_json(text, SCHEMA)).requirements


def sheet_check(name: CheckName, export: Export) -> Check:
    """The requirements are those of the cameras and mirrors on record.

    Raises:
        BadExport: the sheet is missing or malformed.
    """
    sheet = read_sheet(export)
    camera = next(iter(export.cameras.values()))
    expected = _figures(camera, image_depths(export, camera))
    wrong = [
        f"{key} {getattr(sheet, key):.6g}, not {value:.6g}"
        for key, value in expected.items()
        if not abs(getattr(sheet, key) - value) <= SHARE * abs(value)
    ]
    wrong += _angle_faults(sheet, export, camera)
    return at_most(name, len(wrong), 0, short_list(wrong))


def _angle_faults(sheet: Requirements, export: Export, camera: Camera) -> list[str]:
    """The angles of view hold all apices and are no larger than the frame; pixels follow them."""
    ray = _own(export, camera).columns("px", 3) - camera.pinhole[:, None]
    faults = []
    for axis, angle, pixels, most in (
        (camera.right, sheet.hfov_deg, sheet.width_px, camera.width),
        (camera.down, sheet.vfov_deg, sheet.height_px, camera.height),
    ):
        half = math.tan(math.radians(angle) / 2)
        if half < np.abs((axis @ ray) / (camera.forward @ ray)).max():
            faults.append(f"{angle:.4g} degrees do not hold all apices")
        if pixels != math.ceil(2 * half / camera.pitch - ROUNDING_PX) or pixels > most:
            faults.append(f"{pixels} pixels over {angle:.4g} degrees")
    return faults


def _own(export: Export, camera: Camera) -> Mirrors:
    return export.mirrors.take(np.flatnonzero(export.mirrors.camera == camera.id))


def image_depths(export: Export, camera: Camera) -> Depths:
    """Nearest and farthest virtual image of the capture sphere's nearest and farthest points.

    Both fans of rays are reflected at a small distance from the principal ray, and run backward
    to where the two of each fan meet; no formula of a mirror's image is used.
    """
    mirrors = _own(export, camera)
    surfaces, apex = mirrors.surfaces(), mirrors.columns("px", 3)
    # Along the principal ray, which a mirror on the seam does not send to the origin.
    inward = unit(reflect_directions(apex - camera.pinhole[:, None], surfaces.normal))
    to_origin = norm(apex)
    depth = [
        camera.forward @ (image - camera.pinhole[:, None])
        for reach in (-1.0, 1.0)
        for image in _images(
            surfaces, apex + (to_origin + reach * export.target_mm / 2) * inward, camera.pinhole
        )
    ]
    return Depths(float(np.min(depth)), float(np.max(depth)))


def _images(surfaces: Surfaces, point: Floats, pinhole: Floats) -> list[Floats]:
    """(3, M) images of points by the tangential and by the sagittal fan."""
    apex, normal = surfaces.point, surfaces.normal
    across = unit(cross(point - apex, pinhole[:, None] - apex))
    reach = STEP * norm(point - apex)
    return [
        _meeting(
            *(
                line
                for side in (-reach, reach)
                for line in _reflected(surfaces, point, apex + side * fan)
            )
        )
        for fan in (cross(across, normal), across)
    ]


def _reflected(surfaces: Surfaces, point: Floats, near: Floats) -> tuple[Floats, Floats]:
    """Where rays from points meet the surfaces near tangent points, and their directions then."""
    hit = near - surfaces.height(near) * surfaces.gradient(near)
    n, d = unit(surfaces.gradient(hit)), unit(hit - point)
    return hit, d - 2 * dot(d, n) * n


def _meeting(p: Floats, d: Floats, q: Floats, e: Floats) -> Floats:
    """(3, M) the middle of the shortest segment between lines p + t d and q + s e."""
    product, apart = dot(d, e), q - p
    lever = 1 - product**2
    t = (dot(apart, d) - product * dot(apart, e)) / lever
    s = (product * dot(apart, d) - dot(apart, e)) / lever
    return np.asarray((p + t * d + q + s * e) / 2)


def _figures(camera: Camera, depths: Depths) -> dict[str, float]:
    spread = 1 / depths.near - 1 / depths.far
    pupil = math.sqrt(2 * AIRY_FACTOR * WAVELENGTH_MM / spread)
    blur = pupil * spread / 2 / camera.pitch
    airy = AIRY_FACTOR * WAVELENGTH_MM / pupil / camera.pitch
    return {
        "near_mm": depths.near,
        "far_mm": depths.far,
        "focus_mm": 2 / (1 / depths.near + 1 / depths.far),
        "pupil_mm": pupil,
        "blur_px": blur,
        "airy_px": airy,
        "total_px": math.hypot(blur, airy),
    }
