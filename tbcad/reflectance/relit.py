"""A light field in another light, from its reflectance field."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.reflectance.environment import Environment
from tbcad.reflectance.field_file import AGAIN, ReflectanceField
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.capture.photograph import to_bytes
from tbcad.simulate.scene.point_lights import PointLights
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.types import Colours

# Percentile of the light along rays that a photograph shows as white.
EXPOSED = 99.5
# Directions of the sky that the ground truth is lit from.
TRUE_LIGHTS = 512


@dataclass(frozen=True)
class Relit:
    """A light field in another light.

    Attributes:
        field: with other colours, in memory; its rays stay in the file.
        lamps: that it is lit by.
        points: whether these shine alike in all directions.
        exposure: by which light was multiplied to be shown, 1 as white.
    """

    field: LightField
    lamps: PointLights
    points: bool
    exposure: float


def relit(source: LightField, reflectance: ReflectanceField, light: Environment) -> Relit:
    """The light field as its lamps show it together, with the brightest of it white.

    Raises:
        InputError: the reflectance field is not of this light field.
    """
    lamps = light.on_lamps(reflectance.lamps.place)
    lit = {name: reflectance.lit(name, lamps.colour) for name in reflectance.pixel}
    peak = np.concatenate([values.max(axis=1, initial=0) for values in lit.values()])
    white = float(np.percentile(peak, EXPOSED)) if len(peak) else 0.0
    exposure = 1 / white if white > 0 else 1.0
    frames = {}
    for name, frame in source.frames.items():
        shape = (frame.camera.height_px, frame.camera.width_px)
        if name not in lit or reflectance.pixel[name].max(initial=0) >= shape[0] * shape[1]:
            raise InputError(f"the reflectance field is not of this light field: {AGAIN}")
        colour = _picture(255 * exposure * lit[name], reflectance.pixel[name], shape)
        frames[name] = replace(frame, planes={**frame.planes, "colour": colour})
    points = reflectance.facts.get("light", "points") == "points"
    return Relit(replace(source, frames=frames), lamps, points, exposure)


def _picture(colours: Colours, pixel: Any, shape: tuple[int, int]) -> Any:
    picture = np.zeros((shape[0] * shape[1], 3), dtype=np.uint8)
    picture[pixel] = to_bytes(colours)
    return picture.reshape(*shape, 3)


def lit_scene(scene: Scene, lights: PointLights, exposure: float) -> Scene:
    """The object in the light of lamps, as bright as an exposure shows it."""
    return replace(scene, lamps=PointLights(lights.place, exposure * lights.colour))
