"""Pictures of a field by a camera: colours, opacity, depth and normals."""

from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from pathlib import Path
from threading import Lock

import numpy as np
from scipy import ndimage

from tbcad.common.figure_files import image_bytes
from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.camera import Camera
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.fit import fit, medium_of
from tbcad.light.reconstruction.marching import Singles, composited
from tbcad.light.reconstruction.rays import LEAST_CHORD_MM, captured_rays, entries
from tbcad.light.reconstruction.start import Level, Settings
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.image_files import write_images
from tbcad.light.simulate.parallel import over_chunks
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.viewpoints import ViewMethod
from tbcad.types import Bytes, Floats

STRIDE = 0.45  # distances of nodes between samples
RAYS_PER_CHUNK = 1 << 13
SMOOTHED = 1.2  # nodes, standard deviation: the opacity whose gradient gives normals
PREVIEW_DEG, PREVIEW_MM, PREVIEW_PX = (30.0, 30.0), 640.0, (480, 360)
BEFORE = 1.0  # nodes: where it is taken, in front of where the ray is half opaque
QUICK = Settings(levels=(Level(36, 1), Level(64, 1)), batch=10_000)

_one_at_a_time = Lock()  # a fit takes all cores, and much memory


@dataclass(frozen=True)
class FieldPicture:
    """A view of a field."""

    image: Bytes  # red, green, blue on the black background, (h, w, 3)
    opacity: Singles  # 0 to 1, (h, w)
    # along each pixel's ray from the pinhole to where it becomes half opaque, mm, (h, w); NaN where
    # it does not
    distance: Floats

    def depth(self, view: Camera) -> Floats:
        """Depth (h, w) for files: mm behind the plane through the origin that faces the view.

        Where rays become half opaque; NaN where they do not.
        """
        away = self.distance * (view_directions(view) @ view.forward)
        return np.asarray(away + float(view.pinhole @ view.forward))


def field_picture(made: Field, view: Camera, stride: float = STRIDE) -> FieldPicture:
    """The picture that a pinhole camera outside of the capture sphere would see.

    The stride between samples is in distances of nodes.
    """
    direction = view_directions(view).reshape(-1, 3)
    origin = np.broadcast_to(view.pinhole, direction.shape)
    entry, length = entries(origin, direction, made.grid.width_mm / 2)
    seen = np.flatnonzero(length > LEAST_CHORD_MM)
    found = np.zeros((len(direction), 5), dtype=np.float32)
    found[:, 4] = np.nan
    entry_seen, way, length = entry[seen], direction[seen].astype(np.float32), length[seen]
    medium = medium_of(made, stride)

    def part(at: slice) -> Singles:
        return composited(entry_seen[at], way[at], length[at], medium)

    found[seen] = over_chunks(part, len(seen), RAYS_PER_CHUNK)
    shape = (view.height_px, view.width_px)
    before = np.linalg.norm(entry - view.pinhole, axis=1)
    image = np.rint(255 * np.clip(found[:, :3], 0, 1)).astype(np.uint8)
    return FieldPicture(
        image.reshape(*shape, 3),
        found[:, 3].reshape(shape),
        (before + found[:, 4]).reshape(shape),
    )


def field_normals(made: Field, view: Camera, picture: FieldPicture) -> Floats:
    """Unit normals where the rays of a view's picture are half opaque, toward the view, (h, w, 3).

    In the frame of the object, NaN where rays do not become so. They are the gradient of the nodes'
    opacity, smoothed, a little in front: within a surface, which is a node or two thick, it has no
    side. In front is first toward the view, then along the normal that this gives.
    """
    known = np.isfinite(picture.distance)
    direction = view_directions(view)[known]
    pitch, half = made.grid.pitch_mm, made.grid.width_mm / 2
    at = (view.pinhole + half + picture.distance[known][:, None] * direction) / pitch
    opaque = made.grid.dense((1 - np.exp(-pitch * made.density())).astype(np.float32))
    opaque = ndimage.gaussian_filter(opaque, SMOOTHED)
    normal = -direction
    for _ in range(2):
        found = -_gradient(opaque, at + BEFORE * normal)
        side = -np.sign(dot(found, direction))[:, None]  # against the rays; 0: there is none
        normal = np.where(side != 0, side * unit(found), normal)
    result = np.full((*known.shape, 3), np.nan)
    result[known] = normal
    return result


def _gradient(lattice: Singles, at: Floats) -> Floats:
    """Differences of a lattice (n, n, n) across two nodes about places in it (k, 3), (k, 3)."""
    ahead, behind = (
        [ndimage.map_coordinates(lattice, (at + step).T, order=1) for step in side * np.eye(3)]
        for side in (1, -1)
    )
    return np.stack(ahead, axis=1).astype(np.float64) - np.stack(behind, axis=1)


def normals_png(normals: Floats) -> bytes:
    """Normals (h, w, 3) as a PNG: red, green, blue are 0.5 + 0.5 x, y, z; black: unknown."""
    shown = np.rint(255 * (0.5 + 0.5 * np.nan_to_num(normals, nan=-1.0)))
    return image_bytes(shown.astype(np.uint8))


def opacity_png(picture: FieldPicture) -> bytes:
    """The opacity as a PNG in grey: 0 nothing, 255 opaque."""
    return image_bytes(np.rint(255 * np.clip(picture.opacity, 0, 1)).astype(np.uint8))


def write_preview(file: Path, made: Field) -> None:
    """Write how a field looks from the usual side."""
    azimuth, elevation = map(radians, PREVIEW_DEG)
    at = camera_around_object(azimuth, elevation, PREVIEW_MM, made.grid.width_mm, PREVIEW_PX)
    write_images({file: field_picture(made, at).image})


def quick_views(source: LightField) -> Callable[[Camera], Bytes]:
    """Function that makes a camera's picture (h, w, 3) from a coarse field, fitted to all rays.

    InputError: none of them meets the capture sphere.
    """
    with _one_at_a_time:
        *_, last = fit(captured_rays(source), QUICK)
    made = last.field()
    return lambda camera: field_picture(made, camera).image


BY_FIELD = ViewMethod("field", quick_views)
