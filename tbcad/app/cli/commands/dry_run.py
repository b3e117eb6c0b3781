"""Output of `tbcad build --dry-run`: a dozen lines, or a record."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from tbcad.app.cli.app import result_lines
from tbcad.common.screen import Stages
from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.output.overview import Overview, PrintEstimate, overview
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


def overview_lines(figures: Overview, seconds: float) -> Iterator[str]:
    """Lines of at most 80 columns; seconds: that the build is expected to take."""
    made, radii = figures.prototype, "planar"
    if figures.radius_mm is not None:
        radii = "radius {:.1f} to {:.1f} mm".format(*figures.radius_mm)
    return result_lines(
        "build-dry-run",
        all=figures,
        radii=radii,
        shells=figures.shell_prints and _print_text(figures.shell_prints),
        prototype=made,
        bought_balls=made and made.balls,
        balls=made and _counted(made.balls, "ball"),
        caps=f" and {_counted(made.caps, 'cap')}" if made and made.caps else "",
        ball_price=made and _price_text(made.ball_price),
        prints=made and _print_text(made.prints),
        note=figures.note,
        minutes=max(seconds / MINUTE, 0.1),
    )


def overview_record(figures: Overview, seconds: float) -> dict[str, Any]:
    """The same for programs: fields of `Overview`, masses in grams, prices by currency."""
    record = asdict(figures) | {"spec": spec_dict(figures.spec)}
    return record | {"build_seconds": round(seconds)}


def _print_text(figures: PrintEstimate) -> str:
    return (
        f"{figures.volume_cm3:.0f} cm3, about {figures.mass_g:.0f} g, {figures.hours:.0f} h, "
        f"{_price_text(figures.price)}, printed by FDM"
    )


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _price_text(prices: Mapping[str, float]) -> str:
    """Sums in all currencies of the list of prices."""
    sums = (f"{amount:.0f} {currency}" for currency, amount in prices.items())
    return f"about {' and '.join(sums)}" if prices else "no price"
