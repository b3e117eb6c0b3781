"""What `tbcad build --dry-run` prints: a dozen lines, or a record."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from tbcad.common.screen import Stages
from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.output.overview import Overview, PrintEstimate, PrototypeOverview, overview
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

MINUTE = 60
# Seconds of a verified build of the paper's design (n = 18) on two cores: whatever the mirrors, and
# in proportion to their number but for a fixed share.
SECONDS = {(SHELL,): (1.0, 25.8), (PROTOTYPE,): (20.7, 12.8), PARTS: (20.7, 18.8)}
N, FIXED_SHARE = 18, 0.2


def show_overview(
    spec: Spec, parts: Sequence[str], optional: bool, output: "Output", screen: Stages
) -> int:
    """Print what a build would give, as a record when that is the output."""
    screen.stage("mirrors: radii and cells")
    figures = overview(design(spec), parts, screen.stage, optional_prototype=optional)
    there = [part for part in parts if part != PROTOTYPE or figures.prototype]
    fixed, of_mirrors = SECONDS[tuple(there)]
    share = FIXED_SHARE + (1 - FIXED_SHARE) * (spec.optics.n / N) ** 2
    seconds = fixed + share * of_mirrors
    if output == "json":
        typer.echo(json.dumps(overview_record(figures, seconds), indent=1))
    else:
        typer.echo("\n".join(overview_lines(figures, seconds)))
    return 0


def overview_lines(figures: Overview, seconds: float) -> list[str]:
    """Lines of at most 80 columns; seconds: that the build is expected to take."""
    radii = "planar"
    if figures.radius_mm is not None:
        radii = "radius {:.1f} to {:.1f} mm".format(*figures.radius_mm)
    lines = [
        f"mirrors           {figures.mirrors} ({figures.virtual_cameras} virtual cameras), {radii}",
        f"minimum coverage  {figures.minimum_coverage_mm:.2f} mm, of "
        f"{figures.spec.optics.capture_diameter_mm:g} mm",
        f"lens              {figures.view_angle_deg:g} degrees across "
        f"{figures.spec.camera.width_px} pixels",
    ]
    if figures.shell_prints:
        lines.append(f"both shells       {_print_text(figures.shell_prints)}")
    if figures.prototype:
        lines += _prototype_lines(figures.prototype)
    if figures.note:
        lines.append(figures.note)
    minutes = max(seconds / MINUTE, 0.1)
    return [
        *lines,
        f"build             about {minutes:.1f} minutes with verification, on two cores",
    ]


def overview_record(figures: Overview, seconds: float) -> dict[str, Any]:
    """The same for programs: fields of `Overview`, masses in grams, prices by currency."""
    record = asdict(figures) | {"spec": spec_dict(figures.spec)}
    return record | {"build_seconds": round(seconds)}


def _prototype_lines(figures: PrototypeOverview) -> Iterator[str]:
    caps = f" and {figures.caps} caps" if figures.caps else ""
    yield f"prototype         {figures.balls} balls{caps}, {figures.stops} stops, " + (
        f"swing {figures.swing_deg:.0f} degrees"
    )
    yield f"  coverage        {figures.minimum_coverage_mm:.2f} mm, " + (
        f"{figures.kept_share:.0%} of the shell's pixels"
    )
    yield f"  balls           {figures.ball_mass_g:.0f} g, {_price_text(figures.ball_price)}"
    yield f"  turning         {figures.turning_mass_g:.0f} g, driven by {figures.motor}"
    yield f"  printed parts   {_print_text(figures.prints)}"


def _print_text(figures: PrintEstimate) -> str:
    return (
        f"{figures.volume_cm3:.0f} cm3, about {figures.mass_g:.0f} g, {figures.hours:.0f} h, "
        f"{_price_text(figures.price)} by FDM"
    )


def _price_text(prices: Mapping[str, float]) -> str:
    """Sums in all currencies of the list of prices."""
    sums = (f"{amount:.0f} {currency}" for currency, amount in prices.items())
    return f"about {' and '.join(sums)}" if prices else "no price"
