"""What the cameras photograph through: the recorded spheres, the meshes, or the prototype."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Literal

from tbcad.simulate.capture.photograph import Band, Tracer, photograph
from tbcad.simulate.prototype.merge import merge
from tbcad.simulate.prototype.plan import read_plan
from tbcad.simulate.prototype.run import runs, stand_ins
from tbcad.simulate.scene.exported import Exported
from tbcad.simulate.scene.facets import on_mesh, read_shells
from tbcad.simulate.scene.rays import exact
from tbcad.simulate.scene.reflector import Reflector
from tbcad.simulate.scene.shading import Scene
from tbcad.types import Progress

Geometry = Literal["spheres", "mesh", "prototype"]
Captured = list[tuple[Reflector, Callable[[], Iterable[Band]]]]


def cameras(
    export: Exported, scene: Scene, geometry: Geometry, samples: int, progress: Progress
) -> Captured:
    """Both cameras, each with what takes its photograph.

    Args:
        export: the design as it was written.
        scene: the object.
        geometry: spheres of the record, meshes of the shells, or the prototype's balls, stop by
            stop.
        samples: a pixel is the mean of samples x samples rays.
        progress: told how far it has come.

    Raises:
        InputError: files of that geometry are missing or broken.
    """
    if geometry == "prototype":
        both = runs(export.reflectors, read_plan(export))
        return [
            (stand_ins(run), partial(merge, run, scene, "photograph", samples, progress))
            for run in both
        ]
    shells = read_shells(export) if geometry == "mesh" else None

    def tracer(at: Reflector) -> Tracer:
        return on_mesh(shells, at) if shells else exact(at)

    return [
        (at, partial(photograph, at.camera, tracer(at), scene, samples, progress))
        for at in export.reflectors
    ]
