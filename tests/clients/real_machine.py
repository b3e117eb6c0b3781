"""One camera's mirrors, lamps, a lens and a glossy knot: what three renderers photograph.

Shell a of the build in `rendered/`, before four lamps where the prototype has them and two above
on the side without mirrors. Light that other renderers give is kept in `rendered/real.npz`.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from tbcad.core.optics.camera import Camera
from tbcad.core.optics.lamp_light import RectangularLamps, irradiance
from tbcad.core.optics.lens import PupilLens
from tbcad.core.optics.surfaces import Surfaces
from tbcad.light.simulate.capture.real import RealOptics, _band, mirror_rays, with_halo
from tbcad.light.simulate.scene.object import SceneObject, built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.real_scene import real_scene
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export

RENDERED = Path(__file__).parent / "rendered"
KEPT = RENDERED / "real.npz"
LENS, RAY_SHARE = PupilLens(0.85, 125.0), 0.75
ROUGHNESS, INDEX = 0.3, 1.5  # of the knot
FINE, SAMPLES = 2, 4  # fine pixels across a pixel; rays of each, for each lamp
CROP = 96, 16, 648, 520  # first column and row, columns, rows: all mirrors that show the knot
STEP = 1 / 2  # of levels, as they are kept
WHITE_LUX = 2000.0  # what level 255 is of a matt white surface
NEAR_MM, EDGE_PX = 33.0, 11  # where pixels are compared: round the object, off edges of mirrors
BALL_MM, BALL_LAMP = 20.0, 4  # another object, in the light of one lamp
LAMP_MM, LUMEN = (16.0, 50.0), 90.0


def mitsuba_mirrors(mirrors: Surfaces) -> dict[str, Any]:
    """Spheres that reflect all, as Mitsuba's scenes have them."""
    return {
        f"mirror_{k}": {
            "type": "sphere",
            "center": centre.tolist(),
            "radius": float(radius),
            "bsdf": {"type": "conductor", "material": "none"},
        }
        for k, (centre, radius) in enumerate(zip(mirrors.centre, mirrors.radius, strict=True))
    }


@dataclass(frozen=True)
class RealMachine:
    """What is photographed."""

    export: ExportedDesign
    subject: SceneObject
    lamps: RectangularLamps

    @property
    def reflector(self) -> Reflector:
        """Camera a with its mirrors."""
        return self.export.reflectors[0]


@cache
def machine() -> RealMachine:
    """The machine of `rendered/build`."""
    export = read_export(RENDERED / "build")
    low = [[x, y, -90.0] for x in (118.0, -118.0) for y in (52.0, -52.0)]
    places = np.array([*low, [-118.0, 52.0, 90.0], [-118.0, -52.0, 90.0]])
    inward = -np.sign(places[:, :1]) * np.array([[1.0, 0, 0]])
    lamps = RectangularLamps(places, inward, *LAMP_MM, LUMEN)
    return RealMachine(export, built_in_object(export.capture_mm), lamps)


def steps(levels: np.ndarray) -> np.ndarray:
    """Levels as whole numbers, as they are kept."""
    return np.clip(np.rint(levels / STEP), 0, 65_535).astype(np.uint16)


def kept(name: str) -> np.ndarray:
    """Levels (h, w, 3) of a picture that is kept."""
    with np.load(KEPT) as file:
        return STEP * file[name].astype(np.float64)


def at_pixels(fine: np.ndarray, camera: Camera | None = None) -> np.ndarray:
    """Pixels (h, w, c) of a picture (2 h, 2 w, c) behind the Airy pattern of 550 nm.

    By Fourier's transform of the whole picture: a pixel's own area, a fine one's less.
    """
    camera = camera or machine().reflector.camera
    pitch = 2 * np.tan(camera.hfov / 2) / camera.width_px
    finest = LENS.pupil_mm / 550e-6 * pitch / FINE  # cycles a fine pixel
    y, x = (np.fft.fftfreq(n) for n in fine.shape[:2])
    share = np.clip(np.hypot(x[None, :], y[:, None]) / finest, 0, 1)
    airy = 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))
    area = [np.sinc(FINE * one) / np.sinc(one) for one in (y, x)]
    passed = airy * area[0][:, None] * area[1][None]
    waves = np.fft.fft2(fine, axes=(0, 1)) * passed[..., None]
    # A pixel's middle is half a fine one beside that of its first.
    for axis, one in enumerate((y, x)):
        shift = np.exp(1j * np.pi * (FINE - 1) * one)
        waves *= np.expand_dims(shift, tuple({0, 1, 2} - {axis}))
    return np.fft.ifft2(waves, axes=(0, 1)).real[::FINE, ::FINE]


@cache
def compared() -> np.ndarray:
    """Mirrors (h, w), from 1, of the pixels that show what is near the object; 0 of all others."""
    left, top, columns, rows = CROP
    rays = exact_tracer(machine().reflector)(range(top, top + rows), (0.0, 0.0))
    near = np.linalg.norm(np.cross(rays.origin, rays.direction), axis=2) < NEAR_MM
    inner = minimum_filter(rays.mirror, EDGE_PX) == maximum_filter(rays.mirror, EDGE_PX)
    return np.where(near & inner, rays.mirror, 0)[:, left : left + columns]


def shown(scene: Scene, lamps: RectangularLamps) -> float:
    """Levels of `WHITE_LUX` over those of a scene, whose white is that of its own exposure."""
    brightest = np.argmax(scene.shade[:, 0])
    at = scene.subject.points[[brightest]], scene.subject.normals[[brightest]]
    return float(irradiance(lamps, *at)[0] / scene.shade[brightest, 0] / WHITE_LUX)


def our_light(subject: SceneObject, lamps: RectangularLamps, gloss: float | None) -> np.ndarray:
    """What `tbcad capture --optics real` counts before scatter and noise, of lossless mirrors.

    Levels (h, w, 3) as those of `kept`.
    """
    one = machine().reflector
    scene = real_scene(machine().export, subject, lamps, gloss)
    optics = RealOptics(LENS, 1.0, np.zeros(1), ray_share=RAY_SHARE)
    left, top, columns, rows = CROP
    part = exact_tracer(one), mirror_rays(one, optics), scene, optics, range(top, top + rows)
    _, light = _band(one.camera, *part)
    whole = with_halo(light, optics.kernel(one.camera))
    return np.asarray(whole[:, left : left + columns] * shown(scene, lamps))
