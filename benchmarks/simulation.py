"""Photographs against POV-Ray, views against a tree over all captured rays, refocusing: warm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import povray
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from timing import Figure, Row, Spent, Work, at_least, at_most, measured, spent_in_turns

from tbcad.core.optics.camera import Camera
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.image_files import write_images
from tbcad.light.simulate.parallel import THREADS
from tbcad.light.simulate.scene.object import GREY, SceneObject, built_in_object
from tbcad.light.simulate.scene.object_from_file import load_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object, exact_tracer, view_directions
from tbcad.light.simulate.scene.reflector import Reflector, read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import TwoPlane, two_plane_along
from tbcad.light.simulate.views.refocus import ThinLens, lens_pinholes, refocus
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.types import Floats

Cameras = Sequence[Reflector]

PLACE = np.radians(30), np.radians(30), 640.0
LENS = ThinLens(aperture_mm=300, plane_mm=5)
PER_CENT = 100
BOTH = "- seconds of both cores together"


def photographs(export: Path, folder: Path, rounds: int, file: Path | None) -> list[Row]:
    """Both cameras' pictures as PNG files, ours and POV-Ray's."""
    made = read_export(export)
    subject = load_object(file, made.capture_mm) if file else built_in_object(made.capture_mm)
    grey = plain(subject)
    works = [
        partial(photographed, made.reflectors, prepared_scene(subject), folder),
        partial(photographed, made.reflectors, prepared_scene(grey), folder),
    ]
    what = f"both photographs, {subject.name}"
    if not povray.installed():
        ours, _ = spent_in_turns(works, rounds)
        return [at_most(what, ours.seconds, 5, "s"), Row("POV-Ray", (), note="not installed")]
    for at in made.reflectors:
        povray.write_scene(folder / f"{at.camera_id}.pov", at, grey)
    ours, greys, theirs = spent_in_turns(
        [*works, partial(rendered, made.reflectors, folder)], rounds
    )
    return [
        at_most(what, ours.seconds, 5, "s"),
        measured(BOTH, ours.cpu, "s"),
        measured("- the object grey", greys.seconds, "s"),
        measured(BOTH, greys.cpu, "s"),
        measured("POV-Ray's, the object grey", theirs.seconds, "s"),
        measured(BOTH, theirs.cpu, "s"),
        at_least("POV-Ray's to ours, grey", theirs.seconds.over(greys.seconds), 5, "times"),
        measured(BOTH, theirs.cpu.over(greys.cpu), "times"),
        at_least("pixels with the object, or without, alike", likeness(folder), 99.5, "%"),
    ]


def views(capture: Path, rounds: int) -> list[Row]:
    """Views of one light field, the nearest ray by a tree, and refocusing."""
    with LightField.open(capture) as source:
        tiles, at = MirrorTiles(source), camera_around_object(*PLACE, source.capture_mm)
        every = all_rays(source, at)
        works: list[Work] = [
            partial(synthesise, tiles, at),
            partial(depth_views(tiles).of, at),
            lambda: synthesise(MirrorTiles(source), at),
            every.points,
            partial(cKDTree, every.points()),
            partial(cKDTree(every.points()).query, every.wanted, workers=THREADS),
        ]
        spent = spent_in_turns(works, rounds)
        (lens,) = spent_in_turns([partial(refocus, tiles, at, LENS)], rounds)
    return [
        *_views(*spent[:3]),
        *_tree(spent[0], spent[3:], every),
        at_most(f"refocused, 640 x 480, {len(lens_pinholes())} pinholes", lens.seconds, 5, "s"),
        measured(BOTH, lens.cpu, "s"),
    ]


def _views(nearest: Spent, blend: Spent, first: Spent) -> list[Row]:
    return [
        at_most("view, 640 x 480, nearest rays", nearest.seconds, 0.1, "s"),
        measured(BOTH, nearest.cpu, "s"),
        measured("- the first of an open light field", first.seconds, "s"),
        measured("view, 640 x 480, at the depth found", blend.seconds, "s"),
        measured(BOTH, blend.cpu, "s"),
    ]


def _tree(view: Spent, stages: Sequence[Spent], every: Every) -> list[Row]:
    points, building, asking = (one.seconds for one in stages)
    values = [one.values for one in (points, building, asking)]
    whole = Figure(tuple(np.sum(values, axis=0).tolist()))
    cpu = stages[2].cpu.over(view.cpu)
    return [
        measured(f"tree: {every.count / 1e6:.1f} million rays as points", points, "s"),
        measured("tree: building", building, "s"),
        measured(f"tree: asking for {len(every.wanted)} rays, {THREADS} threads", asking, "s"),
        at_least("tree to view", whole.over(view.seconds), 10, "times"),
        measured("- the asking alone", asking.over(view.seconds), "times"),
        measured("- the asking alone, seconds of both cores", cpu, "times"),
    ]


@dataclass(frozen=True)
class Every:
    """All captured rays and the wanted ones of a view.

    Attributes:
        two_plane: parametrisation along the view.
        origin: of captured rays, (n, 3).
        direction: of captured rays, (n, 3).
        wanted: two-plane coordinates, (k, 4).
    """

    two_plane: TwoPlane
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    wanted: Floats

    @property
    def count(self) -> int:
        return len(self.origin)

    def points(self) -> Floats:
        """Coordinates of the captured rays, without those that are too oblique."""
        found = self.two_plane.coordinates(self.origin, self.direction)
        return found[~np.isnan(found[:, 0])]


def all_rays(source: LightField, at: Camera) -> Every:
    """What the tree is made of, and what it is asked for: rays that meet the capture sphere."""
    parts = []
    for frame in source.frames.values():
        on = frame.planes["mirror"][:] > 0
        parts.append([frame.planes[name][:][on] for name in ("origin", "direction")])
    two_plane = two_plane_along(at.forward, at.right, source.capture_mm)
    way = view_directions(at).reshape(-1, 3)
    way = way[np.linalg.norm(np.cross(at.pinhole, way), axis=1) <= source.capture_mm / 2]
    wanted = two_plane.coordinates(np.broadcast_to(at.pinhole, way.shape), way)
    origin, direction = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Every(two_plane, origin, direction, wanted)


def plain(subject: SceneObject) -> SceneObject:
    """The object in one grey."""
    colour = np.full((len(subject.faces), 3, 3), GREY)
    return replace(subject, albedo=colour, uv=None, texture=None, tiles=None, patterned=False)


def photographed(cameras: Cameras, scene: Scene, folder: Path) -> None:
    """Both pictures, written one after the other."""
    for at in cameras:
        bands = photograph(at.camera, exact_tracer(at), scene)
        picture = np.concatenate([band.colour for band in bands])
        write_images({folder / f"ours_{at.camera_id}.png": picture})


def rendered(cameras: Cameras, folder: Path) -> None:
    """POV-Ray's pictures of both, written one after the other."""
    for at in cameras:
        povray.render(folder / f"{at.camera_id}.pov", at.camera)


def likeness(folder: Path) -> Figure:
    """Pixels that show the object in our and in POV-Ray's picture or in neither, per cent."""
    pairs = [(folder / f"ours_{camera}.png", folder / f"{camera}.png") for camera in "ab"]
    return Figure((PER_CENT * float(np.mean([povray.alike(*pair) for pair in pairs])),))
