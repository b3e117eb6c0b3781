"""Refocus a light field; the ground truth and files of all pictures from one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import app
from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.call import tell_options
from tbcad.options.checks import check_is_capture
from tbcad.options.shared import (
    Azimuth,
    Capture,
    Distance,
    Elevation,
    ForceFile,
    Height,
    OutPicture,
    Width,
)

if TYPE_CHECKING:
    from tbcad.core.optics.camera import Camera
    from tbcad.light.simulate.scene.ray_casting import Scene
    from tbcad.types import Bytes


def check_pictures(capture: Path, out: Path, force: bool, *inputs: Path | None) -> None:
    """Refuse, before any work, pictures that cannot be written, that exist, or that are read."""
    from tbcad.light.simulate.capture.files import OBJECT
    from tbcad.output.single_files import check_file

    compared = compared_files(out) if (capture / OBJECT).is_file() else []
    for file in (out, *compared):
        check_file(file, force, (capture, *inputs), (".png",))


def compared_files(out: Path) -> list[Path]:
    """The ground truth and the comparison that are written beside a picture."""
    return [out.with_name(f"{out.stem}-{what}{out.suffix}") for what in ("truth", "and-truth")]


def true_picture(scene: "Scene", at: "Camera", samples: int = 4) -> "Bytes":
    """Picture of a pinhole camera, ray-traced with samples x samples rays a pixel."""
    from tbcad.light.simulate.capture.photograph import to_bytes
    from tbcad.light.simulate.views.refocus import pinhole_picture

    return to_bytes(pinhole_picture(scene, at, samples))


def write_compared(
    out: Path, picture: "Bytes", truth: "Bytes | None", names: tuple[str, str]
) -> None:
    """Write the picture, and a comparison with the ground truth where it is known."""
    from tbcad.light.simulate.image_files import compared, write_images
    from tbcad.light.simulate.views.viewpoints import image_quality

    if truth is None:
        write_images({out: picture})
        typer.echo(f"{out}: written, without ground truth: the capture names no object")
        return
    files = compared_files(out)
    sheet = compared({names[0]: picture, names[1]: truth})
    write_images({out: picture, files[0]: truth, files[1]: sheet})
    typer.echo(image_quality(truth, picture).words(names[1]))
    typer.echo(f"{out}, {files[0].name}, {files[1].name}: written")


FocusOption = Annotated[float, typer.Option()]
"""Position of the focal plane: mm from the centre of the object toward the camera."""
AllInFocusOption = Annotated[bool, typer.Option("--all-in-focus")]
"""Make each pixel sharp at its own depth, which is found in the light field, instead of at
--focus."""
SweepOption = Annotated[Path | None, typer.Option()]
"""Also write an animation of the focus through the object: GIF, WebP or PNG."""


@app.command()
def refocus(
    capture_folder: Capture[Path],
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    aperture: Annotated[float, typer.Option(help="Diameter of the lens, mm.")] = 300.0,
    focus: FocusOption = 0.0,
    all_in_focus: AllInFocusOption = False,
    out: OutPicture[Path] = Path("refocus.png"),
    sweep: SweepOption = None,
    frames: Annotated[
        int, typer.Option(min=2, max=500, help="Number of pictures in the animation.")
    ] = 21,
    width: Width = 640,
    height: Height = 480,
    truth_samples: Annotated[
        int, typer.Option(min=1, max=100_000, help="Rays per pixel of the ray-traced lens.")
    ] = 256,
    force: ForceFile = False,
) -> int:
    """Refocus a light field: the picture of a large lens, as the mean of 69 pinhole views.

    For a simulated capture also writes the ray-traced picture of a real lens and a comparison; of a
    pinhole with --all-in-focus, since no real lens is sharp everywhere.
    """
    check_is_capture(capture_folder)
    if all_in_focus and sweep is not None:
        raise InputError("--all-in-focus has no focus to move: leave out --sweep")
    from tbcad.app.api.views import refocused
    from tbcad.light.simulate.capture.files import captured_scene
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.capture.photograph import to_bytes
    from tbcad.light.simulate.image_files import ANIMATED_SUFFIXES, write_animation
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.light.simulate.views.refocus import ThinLens, lens_picture, refocus_sweep
    from tbcad.light.viewer.page import Query
    from tbcad.output.single_files import check_file

    check_pictures(capture_folder, out, force)
    if sweep is not None:
        check_file(sweep, force, (capture_folder,), ANIMATED_SUFFIXES)
        if sweep in (out, *compared_files(out)):
            raise InputError(f"--sweep {sweep}: a picture of this command: choose another name")
    place = Query(azimuth, elevation, distance, width=width, height=height)
    names = ("69 pinholes", "pinhole" if all_in_focus else "real lens")
    with stages(3 + (sweep is not None)) as screen, LightField.open(capture_folder) as source:
        screen.stage("light field")
        at = place.camera(source.capture_mm)
        lens = ThinLens(aperture, focus)
        lens.check(at, source.capture_mm)
        tiles, scene = MirrorTiles(source), captured_scene(capture_folder)
        screen.stage(names[0])
        picture = refocused(tiles, at, lens, all_in_focus, screen.detail).image
        screen.stage(names[1])
        truth = None
        if scene is not None and all_in_focus:
            truth = true_picture(scene, at)
        elif scene is not None:
            truth = to_bytes(lens_picture(scene, at, lens, truth_samples, screen.detail))
        if sweep is not None:
            screen.stage("sweep")
            write_animation(sweep, refocus_sweep(tiles, at, aperture, frames, screen.detail))
    write_compared(out, picture, truth, names)
    if sweep is not None:
        typer.echo(f"{sweep}: focus from the back of the capture sphere to its front, and back")
    return 0


tell_options(__name__)
