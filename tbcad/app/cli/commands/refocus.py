"""Refocus a light field."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import app
from tbcad.app.cli.commands.picture_files import (
    check_pictures,
    compared_files,
    scene_of,
    true_picture,
    viewpoint_of,
    write_compared,
)
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
    Fov,
    Height,
    OutPicture,
    Width,
)

if TYPE_CHECKING:
    from tbcad.core.optics.camera import Camera
    from tbcad.light.simulate.scene.ray_casting import Scene
    from tbcad.light.simulate.views.refocus import ThinLens
    from tbcad.types import Bytes, Progress


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
    fov: Fov = None,
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
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.image_files import (
        ANIMATED_SUFFIXES,
        check_image_path,
        write_animation,
    )
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.light.simulate.views.refocus import ThinLens, refocus_sweep
    from tbcad.output.single_files import check_file

    check_pictures(capture_folder, out, force)
    if sweep is not None:
        check_image_path(sweep, force, ANIMATED_SUFFIXES)
        check_file(sweep, force, (capture_folder,))
        if sweep in (out, *compared_files(out)):
            raise InputError(f"--sweep {sweep}: a picture of this command: choose another name")
    names = ("69 pinholes", "pinhole" if all_in_focus else "real lens")
    with stages(3 + (sweep is not None)) as screen, LightField.open(capture_folder) as source:
        screen.stage("light field")
        at = viewpoint_of(source, (azimuth, elevation, distance), (width, height), fov)
        lens = ThinLens(aperture, focus)
        lens.check(at, source.capture_mm)
        tiles, scene = MirrorTiles(source), scene_of(capture_folder)
        screen.stage(names[0])
        picture = refocused(tiles, at, lens, all_in_focus, screen.detail).image
        screen.stage(names[1])
        samples = 0 if all_in_focus else truth_samples
        truth = None if scene is None else _truth(scene, at, lens, samples, screen.detail)
        if sweep is not None:
            screen.stage("sweep")
            write_animation(sweep, refocus_sweep(tiles, at, aperture, frames, screen.detail))
    write_compared(out, picture, truth, names)
    if sweep is not None:
        typer.echo(f"{sweep}: focus from the back of the capture sphere to its front, and back")
    return 0


def _truth(
    scene: "Scene", at: "Camera", lens: "ThinLens", samples: int, progress: "Progress"
) -> "Bytes":
    """The ray-traced picture of the lens; of a pinhole without samples of one."""
    from tbcad.light.simulate.capture.photograph import to_bytes
    from tbcad.light.simulate.views.refocus import lens_picture

    if samples == 0:
        return true_picture(scene, at)
    return to_bytes(lens_picture(scene, at, lens, samples, progress))


tell_options(__name__)
