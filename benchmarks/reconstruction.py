"""A field fitted to the rays of a capture, and views of it beside the other ways to make them."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from simulation import BOTH, PLACE, photographed
from timing import Row, Work, at_least, at_most, measured, spent_in_turns

from tbcad.core.optics.camera import Camera
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.fit import fit
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.reconstruction.rays import captured_rays
from tbcad.light.reconstruction.start import Settings
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import synthesise

TURN = 12  # viewpoints around the object


def reconstruction(export: Path, capture: Path, folder: Path, rounds: int) -> list[Row]:
    """The fit against the photographs themselves, and views by field, depth and nearest rays."""
    cameras = read_export(export).reflectors
    with LightField.open(capture) as source:
        scene = prepared_scene(built_in_object(source.capture_mm))
        made: list[Field] = []
        both, fitting = spent_in_turns(
            [partial(photographed, cameras, scene, folder), lambda: made.append(fitted(source))], 1
        )
        rows = [
            at_most("field of both photographs, n = 18", fitting.seconds, 180, "s"),
            measured(BOTH, fitting.cpu, "s"),
            measured("- to taking both photographs", fitting.seconds.over(both.seconds), "times"),
        ]
        return rows + _views(source, made[-1], rounds)


def fitted(source: LightField) -> Field:
    *_, last = fit(captured_rays(source), Settings())
    return last.field()


def _views(source: LightField, made: Field, rounds: int) -> list[Row]:
    at = camera_around_object(*PLACE, source.capture_mm)
    tiles = MirrorTiles(source)
    depths = depth_views(tiles)
    works: list[Work] = [
        partial(field_picture, made, at),
        partial(depths.of, at),
        partial(synthesise, tiles, at),
        lambda: [field_picture(made, camera) for camera in around(source.capture_mm)],
    ]
    field, depth, nearest, turn = spent_in_turns(works, rounds)
    return [
        at_most("view, 640 x 480, by field", field.seconds, 0.2, "s"),
        measured(BOTH, field.cpu, "s"),
        measured("- to a view by depth", field.seconds.over(depth.seconds), "times"),
        measured("- to a view by nearest rays", field.seconds.over(nearest.seconds), "times"),
        at_least(
            "views a second by field, 320 x 240, while turning", turn.seconds.rate(TURN), 15, "/s"
        ),
    ]


def around(capture_mm: float) -> list[Camera]:
    """Small views of a turn."""
    angles = np.linspace(0, 2 * np.pi, TURN, endpoint=False)
    _, elevation, distance = PLACE
    return [
        camera_around_object(float(angle), elevation, distance, capture_mm, (320, 240))
        for angle in angles
    ]
