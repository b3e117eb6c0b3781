"""Simulate what an export photographs: capture, views, refocusing."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import check_is_capture, check_is_export, check_is_object
from tbcad.cli.options import (
    DEFAULT_METHOD,
    METHODS,
    Azimuth,
    Capture,
    Distance,
    Elevation,
    Exports,
    Force,
    ForceFile,
    Fov,
    Height,
    JsonResult,
    ObjectFile,
    OutPicture,
    OutReplaced,
    PaintOption,
    Width,
)
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.optics.camera import Camera
    from tbcad.simulate.capture.geometry import Geometry
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.scene.ray_casting import Scene
    from tbcad.simulate.views.method import MethodChoice
    from tbcad.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.simulate.views.synthesis import Method
    from tbcad.types import Bytes, Progress

MOST_SAMPLES = 8
WIDEST_DEG = 170


@app.command()
def capture(
    folder: Exports,
    object_file: ObjectFile = None,
    out: OutReplaced = Path("captures"),
    fit: Annotated[
        bool, typer.Option("--fit", help="Move and scale the object into the capture sphere.")
    ] = False,
    paint: PaintOption = "own",
    samples: Annotated[
        int,
        typer.Option(
            min=1, max=MOST_SAMPLES, help="Anti-aliasing: a pixel is the mean of N x N rays."
        ),
    ] = 1,
    mesh: Annotated[
        bool,
        typer.Option("--mesh", help="Trace the exported meshes instead of the recorded spheres."),
    ] = False,
    prototype: Annotated[
        bool,
        typer.Option(
            "--prototype",
            help="Trace the balls of the prototype, stop by stop, and merge the photographs into "
            "those of the shell.",
        ),
    ] = False,
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Simulate the photographs of an object by both cameras through the mirrors of an export.

    Writes both photographs at the full size of the sensors, and the light field: the ray, colour
    and mirror of every pixel.
    """
    if mesh and prototype:
        raise InputError("--mesh and --prototype exclude each other: leave one out")
    check_is_export(folder)
    check_is_object(object_file)
    from tbcad.api import photograph, write_photographs
    from tbcad.output.folder import check_replaceable

    geometry: Geometry = "mesh" if mesh else "prototype" if prototype else "spheres"
    check_replaceable(out, force)
    with stages(3) as screen:
        photographs = photograph(
            folder, object_file, geometry, fit, paint, samples, screen.stage, screen.detail
        )
        record = write_photographs(photographs, out, force, screen.stage)
    if json:
        print_json(record)
        return 0
    for camera, counts in record["cameras"].items():
        seen, on = counts["pixels_that_see_the_capture_sphere"], counts["pixels_on_mirrors"]
        typer.echo(f"camera {camera}: {on} pixels on mirrors, {seen} see the capture sphere")
    typer.echo(f"{out}: {photographs.subject.name} as camera_a.png, camera_b.png and lightfield.h5")
    return 0


@app.command()
def view(
    capture_folder: Capture,
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    out: OutPicture = Path("view.png"),
    method: Annotated[
        Literal["nearest", "blend", "depth"] | None,
        typer.Option(
            help=f"{METHODS}; depth: a blend at the depth that the light field itself shows. "
            f"{DEFAULT_METHOD}"
        ),
    ] = None,
    surface: Annotated[
        Literal["plane", "object"],
        typer.Option(
            help="Surface of the points that are compared by blend: the plane through the centre "
            "of the object, or the object itself."
        ),
    ] = "plane",
    depth_files: Annotated[
        list[Path] | None,
        typer.Option(
            "--depth",
            metavar="FILE",
            help="Also write the depth of --method depth: as PNG of 16 bits, or as points (PLY); "
            "repeatable.",
        ),
    ] = None,
    width: Width = 640,
    height: Height = 480,
    fov: Fov = None,
    force: ForceFile = False,
) -> int:
    """Synthesise the view of a camera anywhere around the object from a light field.

    For a simulated capture also writes the ray-traced ground truth and a comparison, and prints
    PSNR and SSIM.
    """
    check_is_capture(capture_folder)
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.capture.photograph import to_bytes
    from tbcad.simulate.scene.ground_truth import pinhole_picture
    from tbcad.simulate.views.mirror_tiles import MirrorTiles

    _check_pictures(capture_folder, out, force)
    _check_depth(depth_files or [], out, method, surface, force)
    with stages(3) as screen, LightField.open(capture_folder) as source:
        screen.stage("light field")
        at = _viewpoint(source, (azimuth, elevation, distance), (width, height), fov)
        scene = _scene(capture_folder)
        if surface == "object" and scene is None:
            raise InputError(f"{capture_folder} has no object: use --surface plane")
        screen.stage("view")
        tiles, chosen, reason = MirrorTiles(source), "depth", "as --method says"
        if method == "depth":
            picture = _depth_view(tiles, at, depth_files or [], screen.detail)
        else:
            chosen, reason = (choice := _method(tiles, method, surface))
            picture = _view(tiles, at, choice.method, scene if surface == "object" else None)
        screen.stage("truth")
        truth = None if scene is None else to_bytes(pinhole_picture(scene, at))
    typer.echo(f"method {chosen}: {reason}")
    _show(out, picture, truth, (chosen, "ray-traced"))
    for file in depth_files or []:
        typer.echo(f"{file}: depth")
    return 0


def _check_depth(
    files: list[Path],
    out: Path,
    method: Literal["nearest", "blend", "depth"] | None,
    surface: Literal["plane", "object"],
    force: bool,
) -> None:
    from tbcad.simulate.image_files import check_image_path

    if method != "depth" and files:
        raise InputError(f"--depth {files[0]}: no depth is looked for: add --method depth")
    if method == "depth" and surface == "object":
        raise InputError("--method depth finds the surface itself: leave out --surface object")
    for k, file in enumerate(files):
        check_image_path(file, force, (".png", ".ply"))
        if file in (out, *_compared_files(out), *files[:k]):
            raise InputError(f"--depth {file}: another file of this command: choose another name")


def _view(tiles: "MirrorTiles", at: "Camera", method: "Method", scene: "Scene | None") -> "Bytes":
    """The picture, on the surface of an object if one is given."""
    from tbcad.simulate.scene.ray_casting import depth_along_rays
    from tbcad.simulate.views.synthesis import synthesise

    depth = None if scene is None else depth_along_rays(scene)
    return synthesise(tiles, at, method, depth).image


def _depth_view(
    tiles: "MirrorTiles", at: "Camera", files: list[Path], progress: "Progress"
) -> "Bytes":
    """The picture at the depth that is found, and files of that depth."""
    from tbcad.atomic_files import replace_files
    from tbcad.depth.view import depth_view

    picture, depth = depth_view(tiles, at, progress)
    for file in files:
        content = depth.ply(picture.image) if file.suffix.lower() == ".ply" else depth.png()
        replace_files(file.parent, {file.name: content})
    return picture.image


@app.command()
def refocus(
    capture_folder: Capture,
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    aperture: Annotated[float, typer.Option(help="Diameter of the lens, mm.")] = 300.0,
    focus: Annotated[
        float,
        typer.Option(
            help="Position of the focal plane: mm from the centre of the object toward the camera."
        ),
    ] = 0.0,
    out: OutPicture = Path("refocus.png"),
    sweep: Annotated[
        Path | None,
        typer.Option(
            help="Also write an animation of the focus through the object: GIF, WebP or PNG."
        ),
    ] = None,
    frames: Annotated[
        int, typer.Option(min=2, max=500, help="Number of pictures in the animation.")
    ] = 21,
    width: Width = 640,
    height: Height = 480,
    fov: Fov = None,
    truth_samples: Annotated[
        int, typer.Option(min=1, max=100_000, help="Rays per pixel of the ray-traced lens.")
    ] = 256,
    force: ForceFile = False,
) -> int:
    """Refocus a light field: the picture of a large lens, as the mean of 69 pinhole views.

    For a simulated capture also writes the ray-traced picture of a real lens and a comparison.
    """
    check_is_capture(capture_folder)
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.capture.photograph import to_bytes
    from tbcad.simulate.image_files import ANIMATED_SUFFIXES, check_image_path, write_animation
    from tbcad.simulate.scene.ground_truth import lens_picture
    from tbcad.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.simulate.views.refocus import ThinLens, refocus_sweep
    from tbcad.simulate.views.refocus import refocus as refocused

    _check_pictures(capture_folder, out, force)
    if sweep is not None:
        check_image_path(sweep, force, ANIMATED_SUFFIXES)
    with stages(3 + (sweep is not None)) as screen, LightField.open(capture_folder) as source:
        screen.stage("light field")
        at = _viewpoint(source, (azimuth, elevation, distance), (width, height), fov)
        lens = ThinLens(aperture, focus)
        lens.check(at, source.capture_mm)
        tiles, scene = MirrorTiles(source), _scene(capture_folder)
        screen.stage("69 pinholes")
        picture = refocused(tiles, at, lens).image
        screen.stage("real lens")
        truth = None
        if scene is not None:
            truth = to_bytes(lens_picture(scene, at, lens, truth_samples, screen.detail))
        if sweep is not None:
            screen.stage("sweep")
            write_animation(sweep, refocus_sweep(tiles, at, aperture, frames, screen.detail))
    _show(out, picture, truth, ("69 pinholes", "real lens"))
    if sweep is not None:
        typer.echo(f"{sweep}: focus from the back of the capture sphere to its front, and back")
    return 0


def _method(
    tiles: "MirrorTiles", asked: "Method | None", surface: Literal["plane", "object"]
) -> "MethodChoice":
    from tbcad.simulate.views.method import MethodChoice, suitable_method

    if asked is not None:
        return MethodChoice(asked, "as --method says")
    if surface == "object":
        return MethodChoice("blend", "--surface object is for a blend")
    return suitable_method(tiles)


def _check_pictures(capture: Path, out: Path, force: bool) -> None:
    """Refuse, before any work, pictures that cannot be written or that exist."""
    from tbcad.simulate.image_files import check_image_path

    compared = _compared_files(out) if _has_object(capture) else []
    for file in (out, *compared):
        check_image_path(file, force)


def _compared_files(out: Path) -> list[Path]:
    """The ground truth and the comparison that are written beside a picture."""
    return [out.with_name(f"{out.stem}-{what}{out.suffix}") for what in ("truth", "and-truth")]


def _has_object(capture: Path) -> bool:
    """Whether a capture is simulated: real photographs come without the object."""
    from tbcad.simulate.capture.files import OBJECT

    return (capture / OBJECT).is_file()


def _viewpoint(
    source: "LightField",
    place: tuple[float, float, float],
    size: tuple[int, int],
    fov: float | None,
) -> "Camera":
    from math import radians

    from tbcad.simulate.scene.viewpoint import camera_around_object

    azimuth, elevation, distance = place
    if fov is not None and not 0 < fov < WIDEST_DEG:
        raise InputError(f"--fov {fov:g} is no angle of view: allowed is above 0, below 170")
    wide = None if fov is None else radians(fov)
    return camera_around_object(
        radians(azimuth), radians(elevation), distance, source.capture_mm, size, wide
    )


def _scene(folder: Path) -> "Scene | None":
    """The object of a simulated capture; None where there is none, as with real photographs."""
    from tbcad.simulate.capture.files import read_object
    from tbcad.simulate.scene.ray_casting import prepared_scene

    if not _has_object(folder):
        return None
    return prepared_scene(read_object(folder))


def _show(out: Path, picture: "Bytes", truth: "Bytes | None", names: tuple[str, str]) -> None:
    """Write the picture, and a comparison with the ground truth where it is known."""
    from tbcad.simulate.image_files import difference, side_by_side, write_images
    from tbcad.simulate.image_quality import image_quality

    if truth is None:
        write_images({out: picture})
        typer.echo(f"{out}: written, without ground truth: the capture names no object")
        return
    files = _compared_files(out)
    sheet = side_by_side(
        {names[0]: picture, names[1]: truth, "difference": difference(truth, picture)}
    )
    write_images({out: picture, files[0]: truth, files[1]: sheet})
    quality = image_quality(truth, picture)
    typer.echo(
        f"PSNR {quality.psnr_db:.2f} dB, SSIM {quality.ssim:.4f} against the {names[1]} picture"
    )
    typer.echo(f"{out}, {files[0].name}, {files[1].name}: written")
