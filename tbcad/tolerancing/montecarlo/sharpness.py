"""Cost of errors in the views: simulated pictures of builds, with rays known or assumed.

An uncalibrated build takes every pixel's ray for the designed one. A calibrated build knows its
rays, but for the residual of the calibration.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tbcad.core.mirrors.array import design
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.pedestals.cells import GrooveWalls
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.camera_photographs import design_light_field, sphere_light_field
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.light.simulate.capture.photograph import BAND_ROWS
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.real_scene import scene_by
from tbcad.light.simulate.scene.reflector import Reflector, SubstitutedReflector
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality, pinhole_targets, viewpoints_around
from tbcad.options.captures import Optics
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.types import Bytes, Floats, Ints, Progress

CALIBRATION_STREAM = 2000  # random stream of the residual, apart from those of the kinds of error
VIEWPOINTS = ((20.0, 60.0), 2, 640.0)  # elevations, azimuths and distance of the viewpoints


@dataclass(frozen=True)
class ReferenceViews:
    """Views to compare with the truth."""

    capture_mm: float  # diameter of the capture sphere
    views: list[Camera]  # viewpoints, v of them
    truths: list[Bytes]  # pictures of a real camera there, (h, w, 3) each
    taken_by: int | RealOptics = 1  # photographs: rays of a pixel, or the lens


@dataclass(frozen=True)
class Sharpness:
    """SSIM of views against the truth, over s builds and v viewpoints."""

    designed: Floats  # of the shell as designed, (v,)
    uncalibrated: Floats  # with the designed rays, (s, v)
    calibrated: Floats  # with rays known but for the residual of the calibration, (s, v)


def sharpness(
    cameras: tuple[Reflector, Reflector],
    builds: tuple[ShellDraws, ShellDraws],
    scene: Scene,
    reference: ReferenceViews,
    residual: float,
    seed: int = 1,
    progress: Progress = lambda _: None,
) -> Sharpness:
    """Views of builds with errors, and with a random residual of calibration, against the truth.

    The residual is of a mirror's direction, per axis, radians.
    """
    light_field = partial(
        sphere_light_field,
        scene=scene,
        capture_mm=reference.capture_mm,
        samples=reference.taken_by,
    )
    designed = light_field(cameras)
    rows = [_ssim(designed, reference)]
    for k in range(len(builds[0])):
        progress(f"build {k + 1} of {len(builds[0])}")
        a, b = (built_reflector(at, draws, k) for at, draws in zip(cameras, builds, strict=True))
        built = light_field((a, b))
        calibrated = _with_residual(built, residual, (seed, k))
        for known in (_with_rays_of(designed, built), calibrated):
            rows.append(_ssim(known, reference))
    table = np.array(rows)
    return Sharpness(table[0], table[1::2], table[2::2])


@dataclass(frozen=True)
class BuiltReflector(SubstitutedReflector):
    """A camera and mirrors in a build; designed cells only limit where in the picture they are."""

    built_walls: GrooveWalls

    @property
    def walls(self) -> GrooveWalls:
        """Walls that end mirrors on pedestals."""
        return self.built_walls

    def boxes(self) -> Ints:
        """Columns and rows about each cell, wider by its own size on all sides, (m, 4)."""
        box = super().boxes()
        border = np.repeat(box[:, 1::2] - box[:, 0::2], 2, axis=1) * [-1, 1, -1, 1]
        size = np.repeat([self.camera.width_px, self.camera.height_px], 2)
        return np.asarray(np.clip(box + border, 0, size))


def built_reflector(at: Reflector, draws: ShellDraws, build: int) -> BuiltReflector:
    """One camera and its mirrors in a build; with the mean scale a sphere stays a sphere."""
    scale = float(draws.scale[build].mean())
    tilt = Rotation.from_rotvec(draws.shell_tilt[build])
    radius = at.mirrors.radius + draws.radius[build]
    centre = tilt.apply(scale * (at.mirrors.centre + draws.centre[build]))
    normal = tilt.apply(at.mirrors.normal)
    apex = centre + draws.shell_shift[build] + scale * radius[:, None] * normal
    surfaces = Surfaces(apex, normal, 1 / (scale * radius))
    view = _view(at.camera, draws, build)
    walls = built_walls(at.walls, draws, build, draws.wall[build])
    return BuiltReflector(at.camera_id, view, at.u, at.cells, surfaces, walls)


def built_walls(
    walls: GrooveWalls, draws: ShellDraws, build: int, off: Floats | float = 0.0
) -> GrooveWalls:
    """Walls moved with their shell as a build has it, each off along its normal, mm, (w,)."""
    tilt, scale = Rotation.from_rotvec(draws.shell_tilt[build]), float(draws.scale[build].mean())
    point = walls.point + np.reshape(off, (-1, 1)) * walls.normal
    moved = tilt.apply(scale * point) + draws.shell_shift[build]
    return GrooveWalls.of_planes(walls.mirror, moved, tilt.apply(walls.normal))


def _view(view: Camera, draws: ShellDraws, build: int) -> Camera:
    tilt = Rotation.from_rotvec(draws.camera_tilt[build])
    return replace(
        view,
        pinhole=view.pinhole + draws.camera_shift[build],
        forward=tilt.apply(view.forward),
        right=tilt.apply(view.right),
        hfov=float(2 * np.arctan(np.tan(view.hfov / 2) / draws.focal[build])),
    )


def _with_rays_of(rays: LightField, pictures: LightField) -> LightField:
    """The pictures of one light field with the rays of another."""
    colour = {name: frame.planes["colour"] for name, frame in pictures.frames.items()}
    planes = {name: {**one.planes, "colour": colour[name]} for name, one in rays.frames.items()}
    return _with_planes(rays, planes)


def _with_planes(source: LightField, planes: dict[str, dict[str, Any]]) -> LightField:
    frames = {name: replace(one, planes=planes[name]) for name, one in source.frames.items()}
    return replace(source, frames=frames)


def _with_residual(built: LightField, residual: float, seed: tuple[int, int]) -> LightField:
    """A light field with every mirror's rays turned by a random residual of the calibration."""
    sequence = np.random.SeedSequence(seed[0], spawn_key=(seed[1], CALIBRATION_STREAM))
    turned = partial(_rotated, residual=residual, generator=np.random.default_rng(sequence))
    return _with_planes(built, {name: turned(frame) for name, frame in built.frames.items()})


def _rotated(frame: CameraFrame, residual: float, generator: np.random.Generator) -> dict[str, Any]:
    """Planes of a frame whose mirrors' rays are turned by small random angles."""
    rotation = np.vstack([np.zeros(3), residual * generator.standard_normal((len(frame.u), 3))])
    mirror, direction = frame.planes["mirror"], frame.planes["direction"]

    def rotated(rows: slice) -> NDArray[np.float32]:
        turned = direction[rows] + np.cross(rotation[mirror[rows]], direction[rows])
        length = np.linalg.norm(turned, axis=2)[..., None]
        unit = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
        return np.asarray(unit, dtype=np.float32)

    bands = in_threads(rotated, chunks(len(mirror), BAND_ROWS))
    return {**frame.planes, "direction": np.concatenate(bands)}


def _ssim(source: LightField, reference: ReferenceViews) -> Floats:
    tiles = MirrorTiles(source)
    pictures = [synthesise(tiles, view).image for view in reference.views]
    pairs = zip(reference.truths, pictures, strict=True)
    qualities = in_threads(lambda pair: image_quality(*pair), pairs)
    return np.array([quality.ssim for quality in qualities])


def reference_views(
    scene: Scene,
    capture_mm: float,
    progress: Progress = lambda _: None,
    taken_by: int | RealOptics = 1,
) -> ReferenceViews:
    """The views that are compared, with their truths."""
    views = viewpoints_around(*VIEWPOINTS).cameras(capture_mm)
    truths = pinhole_targets(scene, views, progress).truths
    return ReferenceViews(capture_mm, views, truths, taken_by)


def view_ssims(specs: dict[str, Spec], optics: Optics = "ideal") -> dict[str, float]:
    """Mean SSIM of views of the built-in object by designs of one capture diameter."""
    capture_mm = next(iter(specs.values())).optics.capture_diameter_mm
    scene = scene_by(optics, built_in_object(capture_mm))
    reference = reference_views(scene, capture_mm)

    def mean(spec: Spec) -> float:
        source = design_light_field(design(spec), scene, optics)
        return float(_ssim(source, reference).mean())

    return {words: mean(spec) for words, spec in specs.items()}
