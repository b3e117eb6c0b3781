"""Studies of the paper: heavy libraries are imported inside the commands."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.options import (
    Distance,
    Method,
    MethodOption,
    ObjectFile,
    Paint,
    PaintOption,
    Scheduler,
)
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.simulate.study.record import Study
    from tbcad.spec.design import Spec

PIPED_WIDTH = 160

study = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Measure again what the paper claims: CSV files, notes and a plot, beside its figures.",
)
app.add_typer(study, name="study")

DesignFile = Annotated[
    Path | None, typer.Option(help="Design file (TOML); without one, the design of the paper.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change any key of the design; repeatable."),
]
Out = Annotated[Path, typer.Option(help="Folder for the files; others in it are left as they are.")]
First = Annotated[int, typer.Option("--from", metavar="N", help="Least n of the sweep, from 1.")]
Last = Annotated[int, typer.Option("--to", metavar="N", help="Largest n of the sweep, to 60.")]
Sensors = Annotated[
    list[str] | None,
    typer.Option(
        "--sensor",
        metavar="WxH",
        help="Columns x rows; repeatable. Without: the design's, and 2, 3, 4 times its sides.",
    ),
]
Azimuths = Annotated[int, typer.Option(help="Viewpoints all round, at each elevation.")]
STUDIES = Path("studies")


@study.command("resolution")
def resolution_command(
    design: DesignFile = None,
    settings: Settings = None,
    out: Out = STUDIES,
    first: First = 2,
    last: Last = 40,
    sensors: Sensors = None,
    ratios: Annotated[
        list[str] | None,
        typer.Option(
            "--ratio",
            metavar="C:P",
            help="Virtual cameras to pixels; repeatable. Without: 1:1, 1:4, 4:1.",
        ),
    ] = None,
    scheduler: Scheduler = None,
) -> int:
    """Count virtual cameras and pixels, and where they balance (Fig. 5b, Table II)."""
    from tbcad.simulate.study.pixels import sensor_of
    from tbcad.simulate.study.resolution import default_sensors, ratio_of, resolution
    from tbcad.simulate.study.sweep import numbers

    ns = numbers(first, last)
    given = tuple(sensor_of(text) for text in dict.fromkeys(sensors or ()))
    wanted = tuple(ratio_of(text) for text in dict.fromkeys(ratios or ("1:1", "1:4", "4:1")))
    return _run(
        design,
        settings,
        out,
        lambda spec, told: resolution(
            spec, ns, given or default_sensors(spec), wanted, told, scheduler
        ),
    )


@study.command("capture-area")
def capture_area_command(
    design: DesignFile = None,
    settings: Settings = None,
    out: Out = STUDIES,
    first: First = 2,
    last: Last = 36,
    scheduler: Scheduler = None,
) -> int:
    """Measure how large an object flat and convex mirrors see whole (Fig. 5c)."""
    from tbcad.simulate.study.capture_area import capture_area
    from tbcad.simulate.study.sweep import numbers

    ns = numbers(first, last)
    return _run(design, settings, out, lambda spec, told: capture_area(spec, ns, told, scheduler))


@study.command("elevation")
def elevation_command(
    design: DesignFile = None, settings: Settings = None, out: Out = STUDIES
) -> int:
    """Correlate the mirrors' radii with their polar angle (Fig. 7b)."""
    from tbcad.simulate.study.elevation import elevation

    return _run(design, settings, out, elevation)


@study.command("depth-of-field")
def depth_command(
    design: DesignFile = None,
    settings: Settings = None,
    out: Out = STUDIES,
    blur_px: Annotated[float, typer.Option(help="Largest blur circle, in pixels.")] = 1.0,
    pixel_um: Annotated[float, typer.Option(help="Width of a pixel, micrometres.")] = 3.45,
    wide_open: Annotated[float, typer.Option(help="F-number of the lens fully open.")] = 2.8,
) -> int:
    """Find how deep the mirrors' images lie, and the stop a real lens would need (section 6)."""
    from tbcad.simulate.study.depth import Optics, depth

    optics = Optics(blur_px, pixel_um, wide_open).checked()
    return _run(design, settings, out, lambda spec, told: depth(spec, optics, told))


@study.command("ssim")
def ssim_command(
    design: DesignFile = None,
    settings: Settings = None,
    out: Out = STUDIES,
    object_file: ObjectFile = None,
    paint: PaintOption = Paint.OWN,
    sensors: Sensors = None,
    method: MethodOption = Method.NEAREST,
    azimuths: Azimuths = 4,
    distance: Distance = 640.0,
) -> int:
    """Compare views with the truth, sensor by sensor, each with its own n (Fig. 9)."""
    from tbcad.simulate.scene.object import chosen
    from tbcad.simulate.study.pixels import sensor_of
    from tbcad.simulate.study.resolution import default_sensors
    from tbcad.simulate.study.ssim import ssim
    from tbcad.simulate.study.views import ELEVATIONS_DEG, round_of

    given = tuple(sensor_of(text) for text in dict.fromkeys(sensors or ()))
    places = round_of(ELEVATIONS_DEG, azimuths, distance)
    return _run(
        design,
        settings,
        out,
        lambda spec, told: ssim(
            spec,
            chosen(object_file, spec.optics.capture_diameter_mm, paint=paint.value),
            given or default_sensors(spec),
            places,
            method.value,
            told,
        ),
    )


@study.command("prototype")
def prototype_command(
    folder: Annotated[Path, typer.Argument(help="Folder written by tbcad build.")],
    out: Out = STUDIES,
    object_file: ObjectFile = None,
    paint: PaintOption = Paint.OWN,
    method: MethodOption = Method.NEAREST,
    azimuths: Azimuths = 4,
    distance: Distance = 640.0,
    samples: Annotated[
        int, typer.Option(min=1, max=8, help="A pixel is the mean of N x N rays.")
    ] = 3,
) -> int:
    """Compare views out of the prototype's merged pictures with those of the full shell."""
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object import chosen
    from tbcad.simulate.study.prototype_vs_shell import stand_in
    from tbcad.simulate.study.views import ELEVATIONS_DEG, round_of

    places = round_of(ELEVATIONS_DEG, azimuths, distance)
    export = read_export(folder)
    subject = chosen(object_file, export.capture_mm, paint=paint.value)
    return _done(out, lambda told: stand_in(export, subject, places, method.value, samples, told))


def _run(
    design: Path | None,
    settings: list[str] | None,
    out: Path,
    work: "Callable[[Spec, Callable[[str], None]], Study]",
) -> int:
    """Do a study of a design."""
    from tbcad.spec.design import load_spec

    spec = load_spec(design, list(settings or []))
    return _done(out, lambda told: work(spec, told))


def _done(out: Path, work: "Callable[[Callable[[str], None]], Study]") -> int:
    """Do a study, write its files, and show its figures beside the paper's."""
    from tbcad.simulate.study.record import check_target, write

    check_target(out)
    with stages(2) as told:
        told.stage("study: mirrors and rays")
        found = work(told.detail)
        told.stage("study: files")
        files = write(found, out)
    _show(found)
    typer.echo(f"{out}: {', '.join(file.name for file in files)}")
    return 0


def _show(found: "Study") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("quantity", "tbcad", "the paper", "where in the paper", box=None)
    for quantity, unit, ours, paper, where in found.summary.rows:
        table.add_row(str(quantity), _shown(ours, unit), _shown(paper, unit), str(where))
    # Piped, a table needs no terminal's width.
    (Console() if sys.stdout.isatty() else Console(width=PIPED_WIDTH)).print(table)


def _shown(value: str | int | float | None, unit: str | int | float | None) -> str:
    """A figure in short; the files have it in full."""
    short = f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
    return f"{short} {unit}".rstrip() if value is not None else short
