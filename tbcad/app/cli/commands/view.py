"""Synthesise views from a light field."""

from collections.abc import Callable, Sequence
from functools import partial
from math import isnan, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import typer

from tbcad.app.cli.app import app
from tbcad.app.cli.commands.refocus import (
    check_pictures,
    compared_files,
    true_picture,
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
    Height,
    MethodOfView,
    OutPicture,
    Width,
)

if TYPE_CHECKING:
    from tbcad.common.screen import Stages
    from tbcad.core.optics.camera import Camera
    from tbcad.light.reconstruction.field import Field
    from tbcad.light.reflectance.environment import Environment
    from tbcad.light.reflectance.transport import Relit
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.scene.lamps import PointLights
    from tbcad.light.simulate.scene.ray_casting import Scene
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.types import Bytes

# Shadows of all lamps are traced for each ray of a pixel: fewer than in the built-in light.
LIT_SAMPLES = 2

LightFormat = Literal["latlong", "angular", "mirror-ball", "cross"]
AS_ASKED = "as --method says"
BY_DEFAULT = {
    "field": "its file is in the capture's folder",
    "depth": "a blend at the depth that is found",
}


DepthFilesOption = Annotated[list[Path] | None, typer.Option("--depth", metavar="FILE")]
"""Also write the depth that is found: as PNG of 16 bits, or as points (PLY); repeatable."""
NormalsFileOption = Annotated[Path | None, typer.Option("--normals", metavar="FILE")]
"""Of a field: also write the surface's normals (PNG)."""
OpacityFileOption = Annotated[Path | None, typer.Option("--opacity", metavar="FILE")]
"""Of a field: also write the opacity (PNG)."""
LightOption = Annotated[Path | None, typer.Option(metavar="FILE")]
"""Show the object in the light of its surroundings, a picture by direction (.hdr, .exr), by the
reflectance field of tbcad capture --lights."""
LightFormatOption = Annotated[LightFormat | None, typer.Option()]
"""How that picture has its directions, +x in the middle and up at the top: latlong (the default
where it is 2:1), a disc (angular, mirror-ball), or a cross of six faces."""
FrameOption = Annotated[int | None, typer.Option(min=0, metavar="K")]
"""Frame of tbcad capture --frames to show, from 0 on."""


@app.command()
def view(
    capture_folder: Capture[Path],
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    out: OutPicture[Path] = Path("view.png"),
    method: MethodOfView = None,
    depth_files: DepthFilesOption = None,
    normals_file: NormalsFileOption = None,
    opacity_file: OpacityFileOption = None,
    light: LightOption = None,
    light_turn: Annotated[
        float, typer.Option(help="Turns that light about z, degrees, counterclockwise from above.")
    ] = 0.0,
    light_format: LightFormatOption = None,
    frame: FrameOption = None,
    width: Width = 640,
    height: Height = 480,
    force: ForceFile = False,
) -> int:
    """Synthesise the view of a camera anywhere around the object from a light field.

    For a simulated capture also writes the ray-traced ground truth and a comparison, and prints
    PSNR and SSIM.
    """
    check_is_capture(capture_folder)
    of_field = [("normals", normals_file)] if normals_file else []
    of_field += [("opacity", opacity_file)] if opacity_file else []
    beside = [*(("depth", file) for file in depth_files or ()), *of_field]
    by_default = method is None and light is None
    asked = "field" if by_default and of_field else method
    chosen = asked or "depth"
    from tbcad.common.atomic_files import replace_files
    from tbcad.light.reconstruction.field import wanted_field
    from tbcad.light.reflectance.environment import read_environment
    from tbcad.light.simulate.capture.files import captured_scene
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.capture.sequence import sequence_frame
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.light.simulate.views.viewpoints import image_quality
    from tbcad.light.viewer.page import Query

    check_pictures(capture_folder, out, force, light)
    _check_beside(beside, out, chosen, force, (capture_folder, light))
    _check_light(light, light_turn, light_format, chosen, frame)
    place = Query(azimuth, elevation, distance, width=width, height=height)
    wanted = None if light is None else read_environment(light, radians(light_turn), light_format)
    with stages(4) as screen, LightField.open(capture_folder) as stored:
        screen.stage("light field")
        source = stored if frame is None else sequence_frame(stored, capture_folder, frame)
        at = place.camera(source.capture_mm)
        scene, tiles = captured_scene(capture_folder), MirrorTiles(source)
        relit = None if wanted is None else _relit(capture_folder, source, wanted)
        shown = tiles if relit is None else MirrorTiles(relit.field)
        made = wanted_field(asked if by_default else chosen, capture_folder, source, frame)
        if made is not None:
            screen.stage("view")
            picture, contents = _of_field(made, at)
        else:
            picture, contents = _of_light_field((tiles, shown), at, chosen, screen)
        for what, file in beside:
            data = contents[what + file.suffix.lower()]()
            replace_files(file.parent, {file.name: data})
        screen.stage("truth")
        turned = None if frame is None else (capture_folder, frame)
        truth, same_lamps = _truths(scene, at, turned, relit, wanted)
    chosen = "field" if made is not None else chosen
    typer.echo(f"method {chosen}: {AS_ASKED if asked else BY_DEFAULT[chosen]}")
    if relit is not None:
        typer.echo(f"light {light}: by {len(relit.lamps.place)} lamps")
    write_compared(out, picture, truth, (chosen, "ray-traced"))
    if same_lamps is not None:
        ssim = image_quality(same_lamps, picture).ssim
        if not isnan(ssim):
            typer.echo(f"SSIM {ssim:.4f} against one lit by the same lamps")
    typer.echo("".join(f"{file}: {what}\n" for what, file in beside), nl=False)
    return 0


def _truths(
    scene: "Scene | None",
    at: "Camera",
    turned: tuple[Path, int] | None,
    relit: "Relit | None",
    wanted: "Environment | None",
) -> tuple["Bytes | None", "Bytes | None"]:
    """The ray-traced pictures, and in the light of the same lamps, where they are known."""
    from tbcad.light.reflectance.transport import TRUE_LIGHTS, lit_scene

    if scene is None:
        return None, None
    if relit is None or wanted is None:
        from tbcad.light.simulate.capture.sequence import turned_frame

        return true_picture(*(turned_frame(*turned, scene, at) if turned else (scene, at))), None

    def lit_by(lights: "PointLights") -> "Bytes":
        return true_picture(lit_scene(scene, lights, relit.exposure), at, LIT_SAMPLES)

    return lit_by(wanted.far_lights(TRUE_LIGHTS)), lit_by(relit.lamps) if relit.points else None


def _relit(folder: Path, source: "LightField", wanted: "Environment") -> "Relit":
    from tbcad.light.reflectance.transport import open_reflectance, relit

    with open_reflectance(folder) as reflectance:
        return relit(source, reflectance, wanted)


def _check_light(
    light: Path | None, turn: float, kind: LightFormat | None, method: str, frame: int | None
) -> None:
    if light is None and turn:
        raise InputError(f"--light-turn {turn:g} turns no light: add --light")
    if light is None and kind is not None:
        raise InputError(f"--light-format {kind} is of no light: add --light")
    if light is not None and method == "field":
        raise InputError(f"--light {light}: a field has its own light: leave out --method field")
    if light is not None and frame is not None:
        raise InputError("--frame has its own light: leave out --light")


def _check_beside(
    beside: Sequence[tuple[str, Path]],
    out: Path,
    method: str,
    force: bool,
    inputs: tuple[Path | None, ...],
) -> None:
    """Refuse, before any work, what cannot be written or what a method does not give.

    Each file beside the picture comes with what it shows, as its option is called: depth ...
    """
    from tbcad.output.single_files import check_file

    taken = [out, *compared_files(out)]
    for what, file in beside:
        if what == "depth" and method not in ("depth", "field"):
            raise InputError(f"--depth {file}: no depth is looked for: add --method depth")
        if what != "depth" and method != "field":
            raise InputError(f"--{what} {file}: only a field has that: add --method field")
        check_file(file, force, inputs, (".png", ".ply") if what == "depth" else (".png",))
        if file in taken:
            raise InputError(f"--{what} {file}: another file of this command: choose another name")
        taken.append(file)


Contents: TypeAlias = dict[str, Callable[[], bytes]]
"""Writers of the files beside a picture, by subject and suffix."""


def _of_field(made: "Field", at: "Camera") -> tuple["Bytes", Contents]:
    """The picture of a field (h, w, 3), and what else is known of it."""
    from tbcad.light.depth.depth_map import depth_ply, depth_png
    from tbcad.light.reconstruction import picture as pictures

    picture = pictures.field_picture(made, at)
    depth = picture.depth(at)
    return picture.image, {
        "depth.png": lambda: depth_png(depth, made.grid.width_mm),
        "depth.ply": lambda: depth_ply(at, depth, picture.image),
        "normals.png": lambda: pictures.normals_png(pictures.field_normals(made, at, picture)),
        "opacity.png": lambda: pictures.opacity_png(picture),
    }


def _of_light_field(
    fields: tuple["MirrorTiles", "MirrorTiles"], at: "Camera", method: str, screen: "Stages"
) -> tuple["Bytes", Contents]:
    """The picture by nearest rays or by depth, and the depth that is found for it.

    The fields are the light field, and the one of the same rays whose colours are shown.
    """
    from tbcad.light.depth.depth_map import depth_views
    from tbcad.light.simulate.views.synthesis import synthesise

    tiles, shown = fields
    if method == "nearest":
        screen.stage("view")
        return synthesise(shown, at).image, {}
    screen.stage("pictures of the virtual cameras")
    views = depth_views(tiles, progress=screen.detail)
    screen.stage("depth and view")
    picture, found = views.of(at, shown)
    return picture.image, {"depth.png": found.png, "depth.ply": partial(found.ply, picture.image)}


tell_options(__name__)
