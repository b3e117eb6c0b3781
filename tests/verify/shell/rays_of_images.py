"""The lens that a camera needs, from where the virtual images of the capture sphere are.

The virtual images are found from rays next to every principal ray.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from tbcad_verify.mesh.surfaces import Surfaces, reflect_directions
from tbcad_verify.mesh.vectors import cross, dot, norm, unit
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.types import Floats

STEP = 3e-4  # of rays at a finite distance from the principal one, as a share of the apex's
WAVELENGTH_MM, AIRY_FACTOR = 550e-6, 2.44


@dataclass(frozen=True)
class Lens:
    """Distance of focus, and diameter of the pupil of least blur and diffraction, mm."""

    focus: float
    pupil: float


def needed_lens(export: Export, camera: Camera) -> Lens:
    """The lens that shows the whole capture sphere in every mirror as sharp as possible."""
    near, far = image_depths(export, camera)
    spread = 1 / near - 1 / far
    return Lens(2 / (1 / near + 1 / far), math.sqrt(2 * AIRY_FACTOR * WAVELENGTH_MM / spread))


def image_depths(export: Export, camera: Camera) -> tuple[float, float]:
    """Depths of the nearest and the farthest virtual image of the capture sphere, mm.

    Both fans of rays are reflected at a small distance from the principal ray, and run backward
    to where the two of each fan meet; no formula of a mirror's image is used.
    """
    mirrors = export.mirrors.take(np.flatnonzero(export.mirrors.camera == camera.id))
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
    return float(np.min(depth)), float(np.max(depth))


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
