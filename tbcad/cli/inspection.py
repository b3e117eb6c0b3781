"""What a workshop is told of a shell: heavy libraries are imported inside the command."""

from dataclasses import replace
from pathlib import Path

import typer

from tbcad.cli.app import command
from tbcad.cli.output_mode import print_json
from tbcad.options.shared import JsonResult
from tbcad.options.tolerances import InspectionOptions
from tbcad.screen import stages


@command()
def inspection(options: InspectionOptions, json: JsonResult = False) -> int:
    """Write what a workshop needs for the shells: limits of every mirror, tolerances in STEP.

    inspection_a.csv and inspection_b.csv have each mirror's sphere and by how much it may be off;
    shell_a_tolerances.step and shell_b_tolerances.step (AP242) the same with datums A, B, C.
    """
    from tbcad.api import inspect

    out = Path(options.out)
    with stages(3) as screen:
        record = inspect(replace(options, progress=screen.stage))
    if json:
        print_json(record)
        return 0
    smallest = record["limits"]["smallest"]
    walls = f", its walls by {smallest['wall_um']:.1f} um" if "wall_um" in smallest else ""
    typer.echo(
        f"Every mirror may be off by {smallest['offset_um']:.2f} um along its normal, "
        f"{smallest['tilt_mrad']:.2f} mrad and {smallest['radius_mm'] * 1000:.0f} um of radius"
        f"{walls}, all at once;\nmost by more: see the tables. Shells at their limits show "
        f"{record['simulated_minimum_mm']:.2f} of {record['target_mm']:g} mm (simulated)."
    )
    typer.echo(f"{out}: {', '.join(sorted(p.name for p in out.iterdir()))}")
    return 0
