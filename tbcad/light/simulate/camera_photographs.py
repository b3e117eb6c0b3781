"""What the cameras see the object in: the recorded spheres, the meshes, or the prototype."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.light_field import (
    LightField,
    light_field_in_memory,
    traced_light_field,
)
from tbcad.light.simulate.capture.photograph import CameraPhotographs, RowBand, Samples, photograph
from tbcad.light.simulate.capture.real import RealOptics, real_photograph
from tbcad.light.simulate.prototype.merge import merge_run
from tbcad.light.simulate.prototype.run import ball_reflector, prototype_runs, read_plan
from tbcad.light.simulate.real_camera import design_optics
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, reflectors
from tbcad.light.simulate.scene.shell_meshes import mesh_tracer, read_shell_meshes
from tbcad.light.simulate.scene.upper_lamps import upper_screen
from tbcad.options.captures import Geometry, Optics
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
    if geometry == "spheres" or isinstance(samples, RealOptics):
        return sphere_photographs(export.reflectors, scene, samples, progress)
    shells = read_shell_meshes(export)

    def photograph_of(reflector: Reflector) -> Iterable[RowBand]:
        trace = mesh_tracer(shells, reflector)
        return photograph(reflector.camera, trace, scene, samples, progress)

    return [(reflector, partial(photograph_of, reflector)) for reflector in export.reflectors]


def sphere_photographs(
    both: Iterable[Reflector],
    scene: Scene,
    samples: Samples | RealOptics = 1,
    progress: Progress = lambda _: None,
) -> CameraPhotographs:
    """Cameras before exact spheres, each with what takes its photograph."""

    def photograph_of(one: Reflector) -> Iterable[RowBand]:
        if isinstance(samples, RealOptics):
            return real_photograph(one, scene, samples, progress)
        return photograph(one.camera, exact_tracer(one), scene, samples, progress)

    return [(one, partial(photograph_of, one)) for one in both]


def design_light_field(
    designed: MirrorDesign, scene: Scene, optics: Optics, coarser: int = 1
) -> LightField:
    """The light field of a design: of ideal optics its pixels are traced when they are read.

    `coarser`: pixels of the design along the sides of one, with real optics.
    """
    if optics == "ideal":
        return traced_light_field(designed, scene)
    capture_mm = designed.spec.optics.capture_diameter_mm
    both = [replace(at, camera=at.camera.coarser(coarser)) for at in reflectors(designed)]
    return sphere_light_field(both, scene, capture_mm, design_optics(designed))


def sphere_light_field(
    both: Iterable[Reflector], scene: Scene, capture_mm: float, samples: Samples | RealOptics = 1
) -> LightField:
    """The light field in memory of cameras before exact spheres."""
    bands = ((at, take()) for at, take in sphere_photographs(both, scene, samples))
    return light_field_in_memory(bands, capture_mm)


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
