"""What the cameras see the object in: the recorded spheres, the meshes, or the prototype."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.light.simulate.capture.photograph import CameraPhotographs, RowBand, Samples, photograph
from tbcad.light.simulate.capture.real import RealOptics, real_photograph
from tbcad.light.simulate.prototype.merge import merge_run
from tbcad.light.simulate.prototype.run import ball_reflector, prototype_runs, read_plan
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.light.simulate.scene.shell_meshes import mesh_tracer, read_shell_meshes
from tbcad.light.simulate.scene.upper_lamps import upper_screen
from tbcad.options.captures import Geometry
from tbcad.types import Progress


def camera_photographs(
    export: ExportedDesign,
    scene: Scene,
    geometry: Geometry,
    samples: Samples | RealOptics,
    progress: Progress,
) -> CameraPhotographs:
    """Both cameras, each with what takes its photograph.

    By spheres of the record, meshes of the shells, or the prototype's balls, stop by stop; a pixel
    is the mean of `samples`, or, by spheres and balls, as a real camera takes it. InputError where
    files of that geometry are missing or broken.
    """
    if geometry == "prototype":
        both = prototype_runs(export.reflectors, read_plan(export))
        # Photographs show what hides the object; the merge leaves out a little more.
        seen = replace(scene, screen=upper_screen(export.folder))
        wider = upper_screen(export.folder, wider=True)
        return [
            (ball_reflector(run), partial(merge_run, run, seen, samples, progress, wider))
            for run in both
        ]
    if isinstance(samples, RealOptics):
        return [
            (one, partial(real_photograph, one, scene, samples, progress))
            for one in export.reflectors
        ]
    shells = read_shell_meshes(export) if geometry == "mesh" else None

    def photograph_of(reflector: Reflector) -> Iterable[RowBand]:
        trace = mesh_tracer(shells, reflector) if shells else exact_tracer(reflector)
        return photograph(reflector.camera, trace, scene, samples, progress)

    return [(reflector, partial(photograph_of, reflector)) for reflector in export.reflectors]


def photographed(
    export: ExportedDesign,
    scene: Scene,
    geometry: Geometry,
    samples: Samples | RealOptics,
    progress: Progress,
) -> LightField:
    """The light field in memory; arguments and errors as of `camera_photographs`."""
    cameras = camera_photographs(export, scene, geometry, samples, progress)
    return light_field_in_memory(((at, bands()) for at, bands in cameras), export.capture_mm)
