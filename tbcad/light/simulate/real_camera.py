"""The real camera of a build: its lens by camera.json, and how its mirrors reflect."""

from collections.abc import Sequence

import numpy as np

from tbcad.core.camera.requirements import MIRROR_REFLECTANCE, camera_requirements
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.lens import WAVELENGTH_MM, PupilLens
from tbcad.core.optics.mirror_light import REFLECTED
from tbcad.core.optics.reflection import roughness_nm, scattered_share
from tbcad.light.simulate.capture.real import WHITE_SHARE, RealOptics
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.camera_sheet import NAME, CameraSheet, RealOpticsRecord

LEFT_OUT = (
    "light that meets two mirrors",
    "aberrations of the lens, colours of its blur",
    "printed parts, LEDs and lamps in the picture",
    "dust, hot pixels, errors of form",
)
LEFT_OUT_OF_RUNS = (
    "light of the object that meets two mirrors, light of LEDs on the object",
    *LEFT_OUT[1:3],
)


def design_optics(designed: MirrorDesign) -> RealOptics:
    """The lens that a design requires before its shell's mirrors: `real_optics` if none is listed.

    Polished as ordered, reflectance and noise as there.
    """
    radius = designed.spec.optics.capture_diameter_mm / 2
    needed = camera_requirements(designed.arrays[0], radius)
    lens = PupilLens(needed.pupil_mm, needed.focus_mm)
    return RealOptics(lens, REFLECTED, np.array([roughness_nm()]))


def real_optics(
    export: ExportedDesign, balls_nm: Sequence[float] | None = None
) -> tuple[RealOptics, RealOpticsRecord]:
    """The lens that camera.json names, before a shell's mirrors or balls, and what a record says.

    `balls_nm`: RMS roughness of each ball. InputError: there is no camera.json, or it is broken.
    """
    sheet = CameraSheet.read(export.folder / NAME)
    listed, needed = sheet.in_use, sheet.requirements
    pupil = needed.pupil_mm if listed is None else listed.focal_mm / listed.f_number
    rough = np.array([roughness_nm()] if balls_nm is None else balls_nm)
    reflectance = REFLECTED if balls_nm is None else MIRROR_REFLECTANCE
    optics = RealOptics(PupilLens(pupil, needed.focus_mm), reflectance, rough)
    scattered = [scattered_share(one) for one in (float(np.median(rough)), float(rough.max()))]
    return optics, RealOpticsRecord(
        lens=None if listed is None else listed.name,
        pupil_mm=pupil,
        focus_mm=needed.focus_mm,
        wavelength_nm=round(WAVELENGTH_MM * 1e6, 3),
        rays_a_pixel=optics.fine**2,
        reflectance=reflectance,
        scattered=(scattered[0], scattered[1]),
        gloss=None,
        white=WHITE_SHARE,
        full_electrons=optics.sensor.full_electrons,
        read_electrons=optics.sensor.read_electrons,
        bits=optics.sensor.bits,
        left_out=LEFT_OUT,
    )
