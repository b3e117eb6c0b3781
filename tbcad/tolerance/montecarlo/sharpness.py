"""What errors cost in the views: pictures of machines that are off, with rays known or not.

An uncalibrated machine takes every pixel's ray for the designed one. A calibrated one knows where
its rays go, but for what the calibration leaves.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.optics.camera import Camera
from tbcad.optics.surfaces import Surfaces
from tbcad.simulate.capture.light_field import Frame, LightField, light_field_in_memory
from tbcad.simulate.capture.photograph import photograph
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.simulate.scene.rays import exact_tracer
from tbcad.simulate.scene.reflector import Reflector, SubstitutedReflector
from tbcad.simulate.study.viewpoints import view_quality
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method
from tbcad.tolerance.montecarlo.draws import Draws
from tbcad.types import Bytes, Floats, Ints, Progress

# Stream of random numbers, beside those of the kinds of error.
LEFT_OVER = 2000


@dataclass(frozen=True)
class Wanted:
    """Views to be made.

    Attributes:
        capture_mm: diameter of the capture sphere.
        views: viewpoints, v of them.
        truths: what a real camera would see there, (h, w, 3) each.
    """

    capture_mm: float
    views: list[Camera]
    truths: list[Bytes]


@dataclass(frozen=True)
class Sharpness:
    """SSIM of views against the truth, over s machines and v viewpoints.

    Attributes:
        designed: of the machine as designed, (v,).
        uncalibrated: with rays taken for the designed ones, (s, v).
        calibrated: with rays known but for what calibration leaves, (s, v).
    """

    designed: Floats
    uncalibrated: Floats
    calibrated: Floats


def sharpness(
    cameras: tuple[Reflector, Reflector],
    machines: tuple[Draws, Draws],
    scene: Scene,
    wanted: Wanted,
    left: float,
    seed: int = 1,
    method: Method = "nearest",
    progress: Progress = lambda _: None,
) -> Sharpness:
    """Views of machines that are off, against the truth.

    Args:
        cameras: both halves as designed.
        machines: how far each half of each machine is off.
        scene: the object.
        wanted: the views.
        left: what a calibration leaves of a mirror's direction, per axis, radians.
        seed: of what calibration leaves.
        method: how views are made.
        progress: told how far it has come.
    """
    as_designed = _captured(cameras, scene, wanted.capture_mm)
    scored = [_ssim(as_designed, scene, wanted, method)]
    for k in range(len(machines[0])):
        progress(f"machine {k + 1} of {len(machines[0])}")
        made = tuple(actual(at, draws, k) for at, draws in zip(cameras, machines, strict=True))
        taken = _captured((made[0], made[1]), scene, wanted.capture_mm)
        scored.append(_ssim(_with_rays(taken, as_designed), scene, wanted, method))
        known = _left_over(taken, left, (seed, k))
        scored.append(_ssim(known, scene, wanted, method))
    table = np.array(scored)
    return Sharpness(table[0], table[1::2], table[2::2])


@dataclass(frozen=True)
class AsMade(SubstitutedReflector):
    """A camera and its mirrors, where they have come to be.

    The cells are those of the design: they only say where in the picture a mirror may be.
    """

    def boxes(self) -> Ints:
        """Columns and rows about each cell, wider by its own size on all sides, (m, 4)."""
        box = super().boxes()
        room = np.repeat(box[:, 1::2] - box[:, 0::2], 2, axis=1) * [-1, 1, -1, 1]
        size = np.repeat([self.camera.width_px, self.camera.height_px], 2)
        wider: Ints = np.clip(box + room, 0, size)
        return wider


def actual(at: Reflector, draws: Draws, machine: int) -> AsMade:
    """One camera and its mirrors as a machine has them.

    The mean of the scales along the axes stands for all three: a sphere stays a sphere.
    """
    scale = float(draws.scale[machine].mean())
    turn = Rotation.from_rotvec(draws.shell_tilt[machine])
    shift = draws.shell_shift[machine]
    mirrors = at.mirrors
    radius = mirrors.radius + draws.radius[machine]
    centre = scale * (mirrors.centre + draws.centre[machine])
    normal = turn.apply(mirrors.normal)
    grown = Surfaces(
        turn.apply(centre) + shift + scale * radius[:, None] * normal, normal, 1 / (scale * radius)
    )
    return AsMade(at.camera_id, _view(at.camera, draws, machine), at.u, at.cells, grown)


def _view(view: Camera, draws: Draws, machine: int) -> Camera:
    turn = Rotation.from_rotvec(draws.camera_tilt[machine])
    half = np.tan(view.hfov / 2) / draws.focal[machine]
    return replace(
        view,
        pinhole=view.pinhole + draws.camera_shift[machine],
        forward=turn.apply(view.forward),
        right=turn.apply(view.right),
        hfov=float(2 * np.arctan(half)),
    )


def _captured(cameras: tuple[Reflector, Reflector], scene: Scene, capture_mm: float) -> LightField:
    both = {at.camera_id: (at, photograph(at.camera, exact_tracer(at), scene)) for at in cameras}
    return light_field_in_memory(both, capture_mm)


def _with_rays(taken: LightField, known: LightField) -> LightField:
    """The pictures of one light field with the rays of another."""
    frames = {
        name: replace(
            known.frames[name],
            planes={**known.frames[name].planes, "colour": frame.planes["colour"]},
        )
        for name, frame in taken.frames.items()
    }
    return replace(taken, frames=frames)


def _left_over(taken: LightField, left: float, seed: tuple[int, int]) -> LightField:
    """Every mirror's rays turned by what a calibration leaves, each mirror's by its own."""
    generator = np.random.default_rng(
        np.random.SeedSequence(seed[0], spawn_key=(seed[1], LEFT_OVER))
    )
    frames = {
        name: replace(frame, planes=_turned(frame, left, generator))
        for name, frame in taken.frames.items()
    }
    return replace(taken, frames=frames)


def _turned(frame: Frame, left: float, generator: np.random.Generator) -> dict[str, object]:
    turn = np.vstack([np.zeros(3), left * generator.standard_normal((len(frame.u), 3))])
    way, about = frame.planes["direction"], turn[frame.planes["mirror"]]
    bent = way + np.cross(about, way)
    length = np.linalg.norm(bent, axis=2)[..., None]
    unit = np.divide(bent, length, out=np.zeros_like(bent), where=length > 0)
    return {**frame.planes, "direction": unit.astype(np.float32)}


def _ssim(source: LightField, scene: Scene, wanted: Wanted, method: Method) -> Floats:
    """SSIM of each view, (v,)."""
    found = view_quality(
        MirrorTiles(source), scene, wanted.views, wanted.truths, method, lambda _: None
    )
    return found[:, 1]
