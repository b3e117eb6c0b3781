"""What `tbcad build --dry-run` prints: a dozen lines, or a record."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from tbcad.cli.stage_times import build_times
from tbcad.mirrors.array import design
from tbcad.output.overview import Overview, PrintEstimate, PrototypeOverview, overview
from tbcad.output.parts import PROTOTYPE, default_parts
from tbcad.screen import Stages
from tbcad.spec.design import Spec
from tbcad.spec.load import spec_dict

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

MINUTE = 60


def show_overview(spec: Spec, asked: Sequence[str] | None, output: "Output", screen: Stages) -> int:
    """Print what a build would give, as a record when that is the output."""
    parts = default_parts(spec) if asked is None else asked
    screen.stage("mirrors: radii and cells")
    found = overview(design(spec), parts, screen.stage, optional_prototype=asked is None)
    there = [part for part in parts if part != PROTOTYPE or found.prototype]
    seconds = sum(build_times(spec.optics.n, there, True, None).values())
    if output == "json":
        typer.echo(json.dumps(overview_record(found, seconds), indent=1))
    else:
        typer.echo("\n".join(overview_lines(found, seconds)))
    return 0


def overview_lines(found: Overview, seconds: float) -> list[str]:
    """Lines of at most 80 columns; seconds: that the build is expected to take."""
    radii = "planar"
    if found.radius_mm is not None:
        radii = "radius {:.1f} to {:.1f} mm".format(*found.radius_mm)
    lines = [
        f"mirrors           {found.mirrors} ({found.virtual_cameras} virtual cameras), {radii}",
        f"minimum coverage  {found.minimum_coverage_mm:.2f} mm, of "
        f"{found.spec.optics.capture_diameter_mm:g} mm",
        f"lens              {found.view_angle_deg:g} degrees across "
        f"{found.spec.camera.width_px} pixels",
    ]
    if found.shell_prints:
        lines.append(f"both shells       {_print_text(found.shell_prints)}")
    if found.prototype:
        lines += _prototype_lines(found.prototype)
    if found.note:
        lines.append(found.note)
    minutes = max(seconds / MINUTE, 0.1)
    return [
        *lines,
        f"build             about {minutes:.1f} minutes with verification, on two cores",
    ]


def overview_record(found: Overview, seconds: float) -> dict[str, Any]:
    """The same for programs: fields of `Overview`, masses in grams, prices in euros."""
    record = asdict(found) | {"spec": spec_dict(found.spec)}
    return record | {"build_seconds": round(seconds)}


def _prototype_lines(found: PrototypeOverview) -> Iterator[str]:
    caps = f" and {found.caps} caps" if found.caps else ""
    yield f"prototype         {found.balls} balls{caps}, {found.stops} stops, " + (
        f"swing {found.swing_deg:.0f} degrees"
    )
    yield f"  coverage        {found.minimum_coverage_mm:.2f} mm, " + (
        f"{found.kept_share:.0%} of the shell's pixels"
    )
    yield f"  balls           {found.ball_mass_g:.0f} g, about {found.ball_price:.0f} EUR"
    yield f"  turning         {found.turning_mass_g:.0f} g, driven by {found.motor}"
    yield f"  printed parts   {_print_text(found.prints)}"


def _print_text(found: PrintEstimate) -> str:
    return (
        f"{found.volume_cm3:.0f} cm3, about {found.mass_g:.0f} g, {found.hours:.0f} h, "
        f"{found.price:.0f} EUR by FDM"
    )
