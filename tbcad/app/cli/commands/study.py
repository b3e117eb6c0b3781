"""The studies of the paper: heavy libraries are imported inside the commands."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import Work, app, of_design, of_export
from tbcad.app.cli.help_texts import PlainGroup
from tbcad.errors import InputError
from tbcad.options.call import tell_options
from tbcad.options.captures import Optics
from tbcad.options.checks import check_is_object
from tbcad.options.shared import (
    Distance,
    MethodOfStudy,
    ObjectFile,
    PaintOption,
    Scheduler,
    UnitOption,
    UpOption,
)

if TYPE_CHECKING:
    from tbcad.core.spec.design import Spec
    from tbcad.light.simulate.capture.photograph import Sensor
    from tbcad.light.simulate.scene.object import SceneObject
    from tbcad.light.simulate.views.viewpoints import ViewMethod

study = typer.Typer(
    cls=PlainGroup,
    no_args_is_help=True,
    help="Reproduce a study of the paper: tables, notes and a plot, next to the paper's figures.",
)
app.add_typer(study, name="study")

First = Annotated[int, typer.Option("--from", metavar="N")]
"""Smallest n, 1 or more."""
Last = Annotated[int, typer.Option("--to", metavar="N")]
"""Largest n, up to 60."""
Sensors = Annotated[list[str] | None, typer.Option("--sensor", metavar="WxH")]
"""Width x height, pixels; repeatable. By default the sensor of the design, and half, twice and four
times its width and height (Table II)."""
Azimuths = Annotated[int, typer.Option(min=1, max=360)]
"""Number of azimuths at each elevation."""
OpticsOption = Annotated[Optics, typer.Option("--optics")]
"""Of the photographs. ideal: pinholes; real: the lens that the design requires with its pupil,
shadows of the object on itself, scatter and noise, as tbcad capture --optics real."""


RatiosOption = Annotated[list[str] | None, typer.Option("--ratio", metavar="C:P")]
"""Virtual cameras to pixels; repeatable. By default 1:1, 1:4 and 4:1."""


@study.command("resolution")
@of_design
def resolution_command(
    spec: "Spec",
    first: First = 2,
    last: Last = 40,
    sensors: Sensors = None,
    ratios: RatiosOption = None,
    scheduler: Scheduler = None,
) -> Work:
    """Count virtual cameras and their pixels, and find where they balance (Fig. 5b, Table II)."""
    from tbcad.studies.paper import n_range
    from tbcad.studies.resolution import parse_ratio, resolution

    ns, counted = n_range(first, last), _sensors(sensors, spec)
    wanted = tuple(parse_ratio(text) for text in dict.fromkeys(ratios or ("1:1", "1:4", "4:1")))
    return partial(resolution, spec, ns, counted, wanted, scheduler=scheduler)


@study.command("capture-area")
@of_design
def capture_area_command(
    spec: "Spec",
    first: First = 2,
    last: Last = 36,
    scheduler: Scheduler = None,
) -> Work:
    """Measure how large an object flat and convex mirrors can see whole (Fig. 5c)."""
    from tbcad.studies.elevation import capture_area
    from tbcad.studies.paper import n_range

    ns = n_range(first, last)
    return partial(capture_area, spec, ns, scheduler=scheduler)


@study.command("elevation")
@of_design
def elevation_command(spec: "Spec") -> Work:
    """Correlate the mirrors' radii with polar angle, and their pixels with elevation (4.2, 5.1)."""
    from tbcad.studies.elevation import elevation

    return partial(elevation, spec)


BlurPxOption = Annotated[float, typer.Option(min=0.01, max=1000)]
"""Largest blur circle, in pixels."""
PixelUmOption = Annotated[float, typer.Option(min=0.01, max=1000)]
"""Width of a pixel, micrometres."""
WideOpenOption = Annotated[float, typer.Option(min=0.1, max=1000)]
"""Smallest f-number of the lens."""


@study.command("depth-of-field")
@of_design
def depth_command(
    spec: "Spec",
    blur_px: BlurPxOption = 1.0,
    pixel_um: PixelUmOption = 3.45,
    wide_open: WideOpenOption = 2.8,
) -> Work:
    """Find the depth of the virtual images, and the f-number that a lens needs (section 6)."""
    from tbcad.studies.depth_of_field import LensOptions, depth_of_field

    return partial(depth_of_field, spec, LensOptions(blur_px, pixel_um, wide_open))


@study.command("ssim")
@of_design
def ssim_command(
    spec: "Spec",
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    paint: PaintOption = "own",
    sensors: Sensors = None,
    method: MethodOfStudy = "nearest",
    azimuths: Azimuths = 4,
    distance: Distance = 640.0,
    optics: OpticsOption = "ideal",
) -> Work:
    """Compare views with the ground truth for several sensors, each with its own n (Fig. 9)."""
    check_is_object(object_file, up, unit)
    from tbcad.light.simulate.views.viewpoints import ELEVATIONS_DEG, viewpoints_around
    from tbcad.studies.ssim import ssim

    simulated = _sensors(sensors, spec)
    places = viewpoints_around(ELEVATIONS_DEG, azimuths, distance)
    subject = _subject(object_file, spec.optics.capture_diameter_mm, paint, up, unit)
    return partial(ssim, spec, subject, simulated, places, _by(method), optics=optics)


NsOption = Annotated[list[int] | None, typer.Option("--n", min=2, max=60)]
"""Subdivision; repeatable. By default eight from 6 to 33."""


@study.command("balance")
@of_design
def balance_command(
    spec: "Spec",
    ns: NsOption = None,
    method: MethodOfStudy = "nearest",
    views: Annotated[
        int, typer.Option(min=1, max=1000, help="Number of viewpoints, evenly over the hemisphere.")
    ] = 12,
    distance: Distance = 640.0,
    optics: OpticsOption = "ideal",
) -> Work:
    """Find which balance of virtual cameras and pixels is best for which object (section 6)."""
    from tbcad.studies.balance import SUBDIVISIONS, balance

    wanted = tuple(sorted(set(ns or SUBDIVISIONS)))
    return partial(balance, spec, wanted, views, distance, _by(method), optics=optics)


SamplesOption = Annotated[int | None, typer.Option(min=1, max=8, metavar="N")]
"""Anti-aliasing of ideal photographs: a pixel is the mean of N x N rays; by default 3, with a
low-pass filter 2."""


@study.command("prototype")
@of_export
def prototype_command(
    folder: Path,
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    paint: PaintOption = "own",
    method: MethodOfStudy = "nearest",
    azimuths: Azimuths = 4,
    distance: Distance = 640.0,
    samples: SamplesOption = None,
    optics: OpticsOption = "ideal",
) -> Work:
    """Compare views from the prototype's merged photographs with those of the full shell."""
    _check_real(optics, {"--samples": samples})
    check_is_object(object_file, up, unit)
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.light.simulate.views.viewpoints import ELEVATIONS_DEG, viewpoints_around
    from tbcad.studies.ssim import prototype_vs_shell

    places = viewpoints_around(ELEVATIONS_DEG, azimuths, distance)
    export = read_export(folder)
    subject = _subject(object_file, export.capture_mm, paint, up, unit)
    by = _by(method)
    return partial(prototype_vs_shell, export, subject, places, by, samples or 3, optics=optics)


FilterPxOption = Annotated[list[float] | None, typer.Option(min=0.01, max=16, metavar="PX")]
"""Separation of the filter's four images, pixels; repeatable. By default 0.75, 1 and 2."""
LensPxOption = Annotated[list[float] | None, typer.Option(min=0.01, max=16, metavar="PX")]
"""Diameter of a lens's blur circle, pixels; repeatable. By default 2.4, the least that the depth of
field allows."""


@study.command("low-pass")
@of_export
def low_pass_command(
    folder: Path,
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    paint: PaintOption = "own",
    azimuths: Azimuths = 4,
    distance: Distance = 640.0,
    filter_px: FilterPxOption = None,
    lens_px: LensPxOption = None,
    samples: SamplesOption = None,
    optics: OpticsOption = "ideal",
) -> Work:
    """Blur the prototype's photographs by an optical low-pass filter or a lens (5.3, Fig. 11)."""
    _check_real(optics, {"--samples": samples, "--lens-px": lens_px})
    check_is_object(object_file, up, unit)
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.light.simulate.views.viewpoints import viewpoints_around
    from tbcad.studies.low_pass import ELEVATIONS_DEG, BlurOptions, low_pass

    usual = BlurOptions()
    options = BlurOptions(
        tuple(filter_px or usual.separations_px), tuple(lens_px or usual.lens_px), samples or 2
    )
    places = viewpoints_around(ELEVATIONS_DEG, azimuths, distance)
    export = read_export(folder)
    subject = _subject(object_file, export.capture_mm, paint, up, unit)
    return partial(low_pass, export, subject, places, options, optics=optics)


@study.command("calibration")
@of_export
def calibration_command(folder: Path) -> Work:
    """Find how well rays are known after calibration, by LEDs, noise and process (5.2)."""
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.rig.calibration.study import calibration_study

    export = read_export(folder)
    return partial(calibration_study, export)


def _check_real(optics: Optics, ideal: dict[str, object]) -> None:
    """Refuse options of ideal photographs with real ones: those have a lens and its rays."""
    for option, given in ideal.items():
        if optics == "real" and given:
            raise InputError(f"--optics real is not for {option}: leave one of both out")


def _by(method: MethodOfStudy) -> "ViewMethod":
    from tbcad.light.depth.depth_map import BY_DEPTH
    from tbcad.light.reconstruction.picture import BY_FIELD
    from tbcad.light.simulate.views.viewpoints import BY_NEAREST

    return {by.name: by for by in (BY_NEAREST, BY_DEPTH, BY_FIELD)}[method]


def _subject(
    object_file: Path | None, capture_mm: float, paint: PaintOption, up: UpOption, unit: UnitOption
) -> "SceneObject":
    """The object of a study; one line on stderr says how its file was taken."""
    from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object

    options = ObjectOptions(paint=paint, up=up, unit=unit)
    return load_object(object_file, capture_mm, options, partial(typer.echo, err=True))


def _sensors(given: list[str] | None, spec: "Spec") -> tuple["Sensor", ...]:
    """The sensors that are wanted, each once; by default those of Table II for the design."""
    from tbcad.light.simulate.capture.photograph import parse_sensor
    from tbcad.studies.resolution import default_sensors

    return tuple(map(parse_sensor, dict.fromkeys(given or ()))) or default_sensors(spec)


tell_options(__name__)
