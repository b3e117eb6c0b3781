"""What `tbcad build --dry-run` prints: a dozen lines, or a record."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from tbcad.output.overview import Overview, Print, PrototypeOverview
from tbcad.spec.load import spec_dict


def overview_lines(found: Overview, seconds: float) -> list[str]:
    """Lines of at most 80 columns; seconds: that the build is expected to take."""
    low, high = found.radius_mm
    lines = [
        f"mirrors           {found.mirrors} ({found.virtual_cameras} virtual cameras), "
        f"radius {low:.1f} to {high:.1f} mm",
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
    return [*lines, f"build             about {seconds / 60:.1f} minutes with verification"]


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


def _print_text(found: Print) -> str:
    return (
        f"{found.volume_cm3:.0f} cm3, about {found.mass_g:.0f} g, {found.hours:.0f} h, "
        f"{found.price:.0f} EUR by FDM"
    )
