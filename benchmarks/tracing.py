"""Rays of the verification against the same rays given straight to Embree, in as many threads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tbcad_verify.mesh.mesh import mesh_from_facets
from tbcad_verify.mesh.rays import (
    THREADS,
    RayScene,
    distances_to_planes,
    first_hits,
    in_threads,
    pixel_rows,
    row_chunks,
)
from tbcad_verify.mesh.stl import parse
from tbcad_verify.record.export import Camera, read_export
from tbcad_verify.record.files import read
from tbcad_verify.shell import light
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import recover
from timing import Row, at_least, in_turns, measured

Singles = NDArray[np.float32]
Calls = list[tuple[Singles, Singles]]


@dataclass(frozen=True)
class Recorder:
    """Passes rays on to Embree and keeps them: origins and directions, (N, 3) a call."""

    embree: Any
    calls: Calls = field(default_factory=list)

    def run(self, origins: Singles, directions: Singles) -> Any:
        self.calls.append((origins, directions))
        return self.embree.run(origins, directions)


def tracing(export: Path, rounds: int) -> list[Row]:
    """Camera rays alone, and all that the verification's last stage does."""
    setup = optical_setup_of(export)
    first, both = (recorded(setup, stage) for stage in (camera_rays, full_sensor))
    embree = setup.scene.embree
    works = [
        partial(camera_rays, setup, setup.scene),
        partial(straight, embree, first),
        partial(full_sensor, setup, setup.scene),
        partial(straight, embree, both),
    ]
    hits, raw_hits, sensor, raw_sensor = in_turns(works, rounds)
    few, many = count(first) / 1e6, count(both) / 1e6
    unit = "million rays/s"
    return [
        measured("verification: every pixel's ray, hit in float64", hits.rate(few), unit),
        measured(
            f"Embree alone, {THREADS} threads, these {few:.1f} million", raw_hits.rate(few), unit
        ),
        at_least("verification to Embree", raw_hits.over(hits), 0.5, "times"),
        measured("verification: the whole stage, reflected rays too", sensor.rate(many), unit),
        measured(f"Embree alone, these {many:.1f} million", raw_sensor.rate(many), unit),
        at_least("verification to Embree", raw_sensor.over(sensor), 0.7, "times"),
    ]


def optical_setup_of(folder: Path) -> OpticalSetup:
    """The optical setup of an export, ready to trace."""
    export = read_export(folder)
    meshes = [mesh_from_facets(parse(read(export.folder, part.stl))) for part in export.parts]
    pairs = zip(meshes, export.parts, strict=True)
    found = [recover(mesh, pinhole_of(export, part), export.target_mm / 2) for mesh, part in pairs]
    return set_up(export, meshes, found)


def camera_rays(setup: OpticalSetup, scene: RayScene) -> None:
    """Make every pixel's ray, find its facet, and where it meets that one in float64."""
    for camera in setup.cameras:
        in_threads(partial(hit, scene, camera), row_chunks(camera))


def hit(
    scene: RayScene, camera: Camera, rows: tuple[int, int]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Facets that the rays of some rows meet, and how far away."""
    origin, rays = camera.pinhole[:, None], pixel_rows(camera, *rows)
    facet = first_hits(scene, origin, rays)
    met = np.flatnonzero(facet >= 0)
    return facet, distances_to_planes(scene, facet[met], origin, np.take(rays, met, axis=1))


def full_sensor(setup: OpticalSetup, scene: RayScene) -> None:
    """The last stage of the verification: every pixel's ray, its reflection, and what it meets."""
    own = replace(setup, scene=scene)
    for camera in setup.cameras:
        light.full_sensor(replace(setup.sensor_scene(camera), own=scene, setup=own))


def straight(embree: Any, calls: Calls) -> None:
    """Embree and nothing else, on rays that are ready as float32."""
    in_threads(lambda call: embree.run(*call), calls)


def recorded(setup: OpticalSetup, stage: Any) -> Calls:
    """The rays that a stage gives to Embree."""
    recorder = Recorder(setup.scene.embree)
    stage(setup, replace(setup.scene, embree=recorder))
    return recorder.calls


def count(calls: Iterable[tuple[Singles, Singles]]) -> int:
    return sum(len(origins) for origins, _ in calls)
