"""Views by a field against those by depth and by nearest rays: tables in Markdown.

python benchmarks/fields.py exports/ [MESH ...]: five objects and any meshes, 24 viewpoints each, as
captured and with blurred, noisy photographs; some minutes an object.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.core.optics.camera import Camera
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.fitted import reconstruction
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.camera_photographs import camera_photographs
from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, Paint, load_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import pinhole_picture
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.options.captures import ReconstructOptions
from tbcad.types import Bytes

CAPTURE_MM, DISTANCE_MM, SIZE = 60.0, 640.0, (640, 480)
VIEWS, FEW = 24, 4
GOLDEN = np.pi * (3 - 5**0.5)  # between viewpoints, which spread evenly
BLUR_PX, NOISE = 0.45, 2  # standard deviations: of lens and diffraction, and of 255
NEAR_PX = 12  # of the silhouette: farther away is background
METHODS = ("nearest", "depth", "field")


@dataclass(frozen=True)
class Subject:
    """An object: its mesh (None: the built-in knot), how it is painted, and its gloss."""

    mesh: trimesh.Trimesh | None
    paint: Paint = "own"
    gloss: float = 0.0


@dataclass(frozen=True)
class Result:
    """Views of one object by one method.

    Attributes:
        ssim: of each view.
        psnr: of each view, dB.
        dark: mean of each view away from the object, of 255.
    """

    ssim: NDArray[np.float64]
    psnr: NDArray[np.float64]
    dark: NDArray[np.float64]


def coloured(mesh: trimesh.Trimesh, colour: tuple[int, int, int]) -> trimesh.Trimesh:
    colours = np.tile(np.array([*colour, 255], np.uint8), (len(mesh.vertices), 1))
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colours)
    return mesh


def moved(mesh: trimesh.Trimesh, by: tuple[float, float, float]) -> trimesh.Trimesh:
    mesh.apply_translation(by)
    return mesh


def rods() -> trimesh.Trimesh:
    """Nine rods of 1.2 mm across the capture sphere, five balls, and a plate with a hole."""
    rng = np.random.default_rng(20)
    ends = rng.normal(size=(9, 2, 3))
    ends *= 25 / np.linalg.norm(ends, axis=2, keepdims=True)
    short = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) < 25
    ends[short, 1] *= -1
    colours = rng.integers(60, 240, (15, 3)).tolist()
    parts = [trimesh.creation.cylinder(0.6, segment=pair, sections=24) for pair in ends]
    for k in range(5):
        ball = trimesh.creation.icosphere(3, 2.5 + 0.5 * k)
        parts.append(moved(ball, tuple(rng.uniform(-13, 13, 3))))
    parts.append(moved(trimesh.creation.annulus(5, 9, 1.5), (6, -6, 10)))
    return trimesh.util.concatenate(list(map(coloured, parts, colours)))


def few_colours() -> trimesh.Trimesh:
    """A box, a cylinder and a cone, each of one colour, so that most rays tell no depth."""
    box = moved(trimesh.creation.box((20, 20, 14)), (-6, 0, -8))
    cylinder = moved(trimesh.creation.cylinder(7, 26, sections=64), (11, 8, 0))
    cone = moved(trimesh.creation.cone(9, 20, sections=64), (-5, -3, -1))
    colours = [(200, 40, 40), (40, 70, 200), (220, 200, 40)]
    return trimesh.util.concatenate(list(map(coloured, (box, cylinder, cone), colours)))


def rounded() -> trimesh.Trimesh:
    """A ring about a ball."""
    ring = trimesh.creation.torus(17, 5, major_sections=96, minor_sections=48)
    return trimesh.util.concatenate([ring, trimesh.creation.icosphere(5, 9)])


def subjects(meshes: list[Path]) -> dict[str, Subject]:
    """Five, and what is given."""
    own = {
        "knot": Subject(None),
        "patterned box": Subject(trimesh.creation.box((34, 34, 34)), "pattern"),
        "few colours": Subject(few_colours()),
        "rods of 1.2 mm": Subject(rods()),
        "glossy ring": Subject(rounded(), "pattern", gloss=0.3),
    }
    given = {path.stem: Subject(trimesh.load_mesh(path), "pattern") for path in meshes}
    return {**own, **given}


def scene_of(subject: Subject, folder: Path) -> Scene:
    """The object as `tbcad capture` takes it from a file."""
    path = None
    if subject.mesh is not None:
        path = folder / "object.ply"
        subject.mesh.export(path)
    options = ObjectOptions(paint=subject.paint)
    return replace(prepared_scene(load_object(path, CAPTURE_MM, options)), gloss=subject.gloss)


def photographed(export: ExportedDesign, scene: Scene) -> LightField:
    cameras = camera_photographs(export, scene, "spheres", 1, lambda _: None)
    bands = ((at, taken()) for at, taken in cameras)
    return light_field_in_memory(bands, CAPTURE_MM, {"samples": 1})


def blurred(source: LightField) -> LightField:
    """The photographs as a lens and a sensor would have them."""
    rng = np.random.default_rng(2)
    frames = {}
    for name, frame in source.frames.items():
        colour = ndimage.gaussian_filter(frame.image().astype(float), (BLUR_PX, BLUR_PX, 0))
        colour = np.rint(np.clip(colour + NOISE * rng.normal(size=colour.shape), 0, 255))
        planes = {**frame.planes, "colour": colour.astype(np.uint8)}
        frames[name] = replace(frame, planes=planes)
    return replace(source, frames=frames)


def viewpoints(count: int) -> list[Camera]:
    """Cameras over the hemisphere, low ones and high ones in turn, 3 to 78 degrees up."""
    cameras = []
    for k in range(count):
        azimuth = (radians(10) + k * GOLDEN) % (2 * np.pi)
        height = 0.05 + 0.93 * ((k * 7) % count + 0.5) / count
        cameras.append(
            camera_around_object(azimuth, float(np.arcsin(height)), DISTANCE_MM, CAPTURE_MM, SIZE)
        )
    return cameras


def fitted(source: LightField) -> tuple[Field, float]:
    """A field as `tbcad reconstruct` makes it, and the seconds of all of it on the clock."""
    start = time.monotonic()
    made = reconstruction(source, ReconstructOptions(""))
    return made, time.monotonic() - start


def compared(
    source: LightField, truths: list[Bytes], cameras: list[Camera], made: Field
) -> dict[str, Result]:
    """All methods at all viewpoints."""
    tiles = MirrorTiles(source)
    depths = depth_views(tiles)
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in METHODS}
    for truth, camera in zip(truths, cameras, strict=True):
        away = ~ndimage.binary_dilation(truth.max(axis=2) > 0, iterations=NEAR_PX)
        pictures = {
            "nearest": synthesise(tiles, camera).image,
            "depth": depths.of(camera)[0].image,
            "field": field_picture(made, camera).image,
        }
        for name, picture in pictures.items():
            quality = image_quality(truth, picture)
            found[name].append((quality.ssim, quality.psnr_db, float(picture[away].mean())))
    return {name: Result(*np.array(values).T) for name, values in found.items()}


COLUMNS = (
    *["object", "SSIM nearest", "depth", "field", "PSNR nearest", "depth", "field"],
    *["1 - SSIM to depth", "PSNR over depth", "worst view over depth: SSIM", "dB"],
    *["background", "seconds"],
)


def line(name: str, results: dict[str, Result], seconds: float) -> str:
    """A row of the table."""
    depth, field = results["depth"], results["field"]
    ratio = (1 - field.ssim.mean()) / (1 - depth.ssim.mean())
    cells = [
        name,
        *[f"{results[method].ssim.mean():.4f}" for method in METHODS],
        *[f"{results[method].psnr.mean():.2f}" for method in METHODS],
        f"{ratio:.2f}",
        f"{(field.psnr - depth.psnr).mean():+.2f}",
        f"{(field.ssim - depth.ssim).min():+.4f}",
        f"{(field.psnr - depth.psnr).min():+.2f}",
        f"{field.dark.mean():.2f}",
        f"{seconds:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def rows(
    export: ExportedDesign, wanted: dict[str, Subject], views: int, kinds: int
) -> Iterator[str]:
    """The table, line by line."""
    cameras = viewpoints(views)
    with tempfile.TemporaryDirectory() as folder:
        for name, subject in wanted.items():
            scene = scene_of(subject, Path(folder))
            truths = [to_bytes(pinhole_picture(scene, at, 4)) for at in cameras]
            sharp = photographed(export, scene)
            for kind, source in ((name, sharp), (f"- {name}, blurred", blurred(sharp)))[:kinds]:
                made, seconds = fitted(source)
                yield line(kind, compared(source, truths, cameras, made), seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare views by a field with those by depth.")
    parser.add_argument("export", type=Path, help="folder written by tbcad build, n = 18")
    parser.add_argument("meshes", type=Path, nargs="*", help="more objects, with the pattern")
    parser.add_argument("--only", action="append", help="name of an object, repeatable")
    parser.add_argument("--quick", action="store_true", help=f"{FEW} viewpoints instead of {VIEWS}")
    parser.add_argument("--sharp", action="store_true", help="without blurred photographs")
    options = parser.parse_args()
    every = subjects(options.meshes)
    wanted = {name: every[name] for name in options.only or every}
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}", flush=True)
    for row in rows(
        read_export(options.export), wanted, FEW if options.quick else VIEWS, 2 - options.sharp
    ):
        print(row, flush=True)


if __name__ == "__main__":
    main()
