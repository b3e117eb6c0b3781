"""The light of a shell's own lamps on an object: direct, and thrown onto it by the mirrors.

By mirrors it varies smoothly: light on surfaces in the capture sphere is fitted, in place by all
products of up to two coordinates, in direction by spherical harmonics up to the second order, which
hold what matt surfaces receive (Ramamoorthi and Hanrahan, J. Opt. Soc. Am. A 18, 2001). No shadows.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.mirror_light import (
    REFLECTED,
    Lamps,
    direct_light,
    light_by_mirrors,
    lit_mirrors,
)
from tbcad.errors import InputError
from tbcad.light.simulate.scene.cast_light import Lit
from tbcad.light.simulate.scene.lamps import exposed
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import both_sides
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.design import NAME, DesignRecord
from tbcad.types import Floats

SAMPLES = 600  # surfaces that light is fitted on: six and more for each of its figures


def read_shell_lamps(folder: Path) -> Lamps:
    """The lamps of a build's shell. InputError: it has none, or its record cannot be read."""
    found = DesignRecord.read(folder / NAME).lamps
    if found is None:
        raise InputError(
            f"{folder} has no lamps on its shell's cameras: build it with shell.lamps.leds, or "
            "leave out --own-light"
        )
    places, normals = (
        np.array([getattr(one, name) for one in found.places])
        for name in ("position_mm", "direction")
    )
    return Lamps(places, normals, np.full(len(places), found.candela))


def lit_by_mirrors(export: ExportedDesign, lamps: Lamps, subject: SceneObject) -> SceneObject:
    """An object with the light of lamps at its corners, as bright as a good exposure shows it."""
    by_mirrors = mirror_light(export, lamps)

    def light(normals: Floats) -> Floats:
        direct = direct_light(lamps, subject.points, normals)
        return np.asarray(by_mirrors(subject.points, normals) + direct)

    return replace(subject, light=exposed(both_sides(light, subject.normals)))


def mirror_light(export: ExportedDesign, lamps: Lamps) -> Lit:
    """Light of lamps by mirrors on surfaces in the capture sphere, lux."""
    factors = mirror_light_factors(export, lamps)
    return lambda places, normals: np.maximum(_terms(export, places, normals) @ factors, 0.0)


def mirror_light_factors(export: ExportedDesign, lamps: Lamps) -> Floats:
    """Factors of the terms of light by mirrors, lux, (t,)."""
    draw = np.random.default_rng(0)
    way, normals = unit(draw.normal(size=(2, SAMPLES, 3)))
    places = way * export.capture_mm / 2 * np.cbrt(draw.random((SAMPLES, 1)))
    total = np.zeros(SAMPLES)
    for one in export.reflectors:
        mirrors = lit_mirrors(one.mirrors, one.side, one.foot)
        total += REFLECTED * light_by_mirrors(lamps, mirrors, places, normals)
    factors, *_ = np.linalg.lstsq(_terms(export, places, normals), total, rcond=None)
    return np.asarray(factors)


def _terms(export: ExportedDesign, places: Floats, normals: Floats) -> Floats:
    """Products (k, 90) of ten terms of place and nine of direction."""
    place, way = _quadratic(places / (export.capture_mm / 2)), _quadratic(normals)[:, :-1]
    return np.asarray((place[:, :, None] * way[:, None]).reshape(len(places), -1))


def _quadratic(v: Floats) -> Floats:
    """Products (k, 10) of up to two coordinates; of unit vectors the last follows from others."""
    x, y, z = v.T
    return np.stack([np.ones(len(v)), x, y, z, x * y, y * z, z * x, x * x, y * y, z * z], axis=1)
