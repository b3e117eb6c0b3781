"""An object as the lamps of a machine light it: with its shadows on itself, matt or glossy."""

from dataclasses import replace

import numpy as np

from tbcad.core.optics.lamp_light import RectangularLamps
from tbcad.core.optics.mirror_light import Lamps
from tbcad.light.simulate.object_files.finish import Finish
from tbcad.light.simulate.scene.cast_light import (
    Lit,
    Source,
    cast_light,
    cut_small,
    direction_sources,
    lamp_sources,
    led_sources,
    open_share,
)
from tbcad.light.simulate.scene.highlights import Gloss
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import (
    LAMP_LIGHT,
    LAMPS,
    Scene,
    embree_scene,
    prepared_scene,
    sky_light,
)
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.light.simulate.scene.shell_lamps import mirror_light
from tbcad.options.captures import Optics

AnyLamps = RectangularLamps | Lamps | None


def scene_by(optics: Optics, subject: SceneObject) -> Scene:
    """An object in the built-in light: for real optics with its shadows on itself."""
    return real_scene(None, subject, None) if optics == "real" else prepared_scene(subject)


def real_scene(
    export: ExportedDesign | None, subject: SceneObject, lamps: AnyLamps, gloss: float | None = None
) -> Scene:
    """An object in the light of a prototype's lamps, of a shell's, or in the built-in light: None.

    `gloss`: its roughness; None: as its materials say, which of most files are matt. Shadows are
    those of lamps. Of the light by a shell's mirrors a surface gets the share that comes from
    virtual cameras which the object does not hide; the built-in sky casts none.
    """
    small = cut_small(subject)
    embree = embree_scene(small.points, small.faces)
    sources, rest = _built_in_light()
    if isinstance(lamps, RectangularLamps):
        sources, rest = lamp_sources(lamps), lambda points, _: np.zeros(len(points))
    elif lamps is not None and export is not None:
        by_mirrors = mirror_light(export, lamps)
        directions = np.concatenate([one.u for one in export.reflectors])

        def hidden_in_part(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
            share = open_share(embree, directions, points, normals)
            return np.asarray(share * by_mirrors(points, normals))

        sources, rest = led_sources(lamps), hidden_in_part
    light = cast_light(embree, small, sources, rest, None if lamps else 1.0)
    lit = replace(small, light=light.total)
    finish = small.finish if gloss is None else Finish.even(len(small.faces), gloss)
    glossy = None if finish is None else Gloss(light, finish)
    return Scene(lit, embree, light.total, small.radius, microfacets=glossy)


def _built_in_light() -> tuple[list[Source], Lit]:
    return direction_sources(LAMPS, LAMP_LIGHT), lambda _, normals: sky_light(normals)
