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
from tbcad.light.simulate.scene.mirror_glow import mirror_glow
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
from tbcad.types import Floats

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
    virtual cameras which the object does not hide, matt and in gloss; the built-in sky casts none.
    """
    small = cut_small(subject)
    embree = embree_scene(small.points, small.faces)
    finish = small.finish if gloss is None else Finish.even(len(small.faces), gloss)
    sources, rest = _built_in_light()
    shares: list[Floats] = []  # of the light by mirrors, outside and behind
    if isinstance(lamps, RectangularLamps):
        sources, rest = lamp_sources(lamps), lambda points, _: np.zeros(len(points))
    elif lamps is not None and export is not None:
        by_mirrors = mirror_light(export, lamps)
        directions = np.concatenate([one.u for one in export.reflectors])

        def hidden_in_part(points: Floats, normals: Floats) -> Floats:
            shares.append(open_share(embree, directions, points, normals))
            return np.asarray(shares[-1] * by_mirrors(points, normals))

        sources, rest = led_sources(lamps), hidden_in_part
    light = cast_light(embree, small, sources, rest, None if lamps else 1.0)
    glow = None
    if finish is not None and isinstance(lamps, Lamps) and export is not None:
        share = np.stack(shares, axis=1)
        glow = mirror_glow(export, lamps, finish.roughness, share, light.white)
        light = replace(light, rest=np.zeros_like(light.rest))  # metals show it in their gloss
    lit = replace(small, light=light.total)
    glossy = None if finish is None else Gloss(light, finish, glow)
    return Scene(lit, embree, light.total, small.radius, microfacets=glossy)


def _built_in_light() -> tuple[list[Source], Lit]:
    return direction_sources(LAMPS, LAMP_LIGHT), lambda _, normals: sky_light(normals)
