"""One camera's mirrors, lamps, a lens and a glossy knot: what three renderers photograph.

Shell a of the build in `rendered/`, before four lamps where the prototype has them and two above
on the side without mirrors. Light that other renderers give is kept in `rendered/real.npz`.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tbcad.core.optics.lamp_light import RectangularLamps
from tbcad.core.optics.lens import PupilLens
from tbcad.light.simulate.scene.object import SceneObject, built_in_object
from tbcad.light.simulate.scene.reflector import Reflector, read_export

RENDERED = Path(__file__).parent / "rendered"
KEPT = RENDERED / "real.npz"
LENS, RAY_SHARE = PupilLens(0.85, 125.0), 0.75
ROUGHNESS, INDEX = 0.3, 1.5  # of the knot
FINE, SAMPLES = 2, 4  # fine pixels across a pixel; rays of each, for each lamp
CROP = 96, 16, 648, 520  # first column and row, columns, rows: all mirrors that show the knot
STEP = 1 / 16  # of levels, as they are kept
WHITE_LUX = 2000.0  # what level 255 is of a matt white surface
LAMP_MM, LUMEN = (16.0, 50.0), 90.0


@dataclass(frozen=True)
class RealMachine:
    """What is photographed."""

    reflector: Reflector
    subject: SceneObject
    lamps: RectangularLamps


@cache
def machine() -> RealMachine:
    """The machine of `rendered/build`."""
    export = read_export(RENDERED / "build")
    low = [[x, y, -90.0] for x in (118.0, -118.0) for y in (52.0, -52.0)]
    places = np.array([*low, [-118.0, 52.0, 90.0], [-118.0, -52.0, 90.0]])
    inward = -np.sign(places[:, :1]) * np.array([[1.0, 0, 0]])
    lamps = RectangularLamps(places, inward, *LAMP_MM, LUMEN)
    return RealMachine(export.reflectors[0], built_in_object(export.capture_mm), lamps)


def steps(levels: np.ndarray) -> np.ndarray:
    """Levels as whole numbers, as they are kept."""
    return np.clip(np.rint(levels / STEP), 0, 65_535).astype(np.uint16)


def kept(name: str) -> np.ndarray:
    """Levels (h, w, 3) of a picture that is kept."""
    with np.load(KEPT) as file:
        return STEP * file[name].astype(np.float64)


def at_pixels(fine: np.ndarray) -> np.ndarray:
    """Pixels (h, w, c) of a picture (2 h, 2 w, c) behind the Airy pattern of 550 nm.

    By Fourier's transform of the whole picture: a pixel's own area, a fine one's less.
    """
    camera = machine().reflector.camera
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
