"""The folder of a machine as built: solids, table, legend and record."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.as_built.deviations import UM_PER_MM, Deviations, colours
from tbcad.as_built.solids import ball_group
from tbcad.formats.csv_table import Row, write_table
from tbcad.formats.step_assembly import write_assembly
from tbcad.machine.machine import Machine
from tbcad.simulate.image_files import write_images
from tbcad.simulate.prototype.plan import Plan
from tbcad.types import Bytes

SCHEMA = "tbcad-as-built/1"
STEP, TABLE, LEGEND, RECORD = "as_built.step", "deviations.csv", "legend.png", "as_built.json"
COLUMNS = (
    *("ball", "x_mm", "y_mm", "z_mm", "radius_mm"),
    *("dx_um", "dy_um", "dz_um", "distance_um", "radius_error_um", "colour"),
)
# Of the legend, pixels.
WIDTH, HEIGHT, EDGE, BAR, TICK, FONT = 640, 96, 40, 28, 6, 16
TICKS = 5


def write_as_built(
    folder: Path, machine: Machine, plan: Plan, found: Deviations, facts: dict[str, Any]
) -> dict[str, Any]:
    """Write all files into a folder, and return the record.

    Args:
        folder: exists, and is the caller's to replace.
        machine: as calibrated.
        plan: as designed.
        found: the difference.
        facts: what it is based on.
    """
    write_assembly(folder / STEP, "prototype_as_built", [ball_group(machine, plan, found)])
    write_table(folder / TABLE, COLUMNS, _rows(machine, found))
    write_images({folder / LEGEND: legend(found.scale_um)})
    record = {
        "schema": SCHEMA,
        **facts,
        "scale_um": [0.0, found.scale_um],
        "base": {
            "shift_mm": found.shift.tolist(),
            "turn_deg": np.degrees(found.turn).tolist(),
        },
        "largest_um": float(found.distance_um.max()),
        "median_um": float(np.median(found.distance_um)),
        "files": {"solids": STEP, "table": TABLE, "legend": LEGEND},
    }
    (folder / RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return record


def legend(scale_um: float) -> Bytes:
    """A picture of the colours from 0 to the end of the scale, (h, w, 3)."""
    picture = np.full((HEIGHT, WIDTH, 3), 255, dtype=np.uint8)
    share = np.linspace(0, 1, WIDTH - 2 * EDGE)
    picture[EDGE // 2 : EDGE // 2 + BAR, EDGE:-EDGE] = np.rint(255 * colours(share))
    image = Image.fromarray(picture)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(FONT)
    under = EDGE // 2 + BAR
    for part in np.linspace(0, 1, TICKS + 1).tolist():
        x = EDGE + part * (WIDTH - 2 * EDGE - 1)
        draw.line([(x, under), (x, under + TICK)], fill="black")
        draw.text((x, under + TICK), f"{part * scale_um:g}", fill="black", font=font, anchor="ma")
    name = "centre off the designed base, micrometres"
    draw.text((WIDTH / 2, HEIGHT - FONT), name, fill="black", font=font, anchor="ma")
    return np.asarray(image)


def _rows(machine: Machine, found: Deviations) -> list[Row]:
    """Measured centre at base angle zero, radius, and what they are off by."""
    shades = np.rint(255 * colours(found.distance_um / found.scale_um)).astype(int)
    table = np.column_stack(
        [
            machine.centre,
            machine.radius,
            UM_PER_MM * found.offset,
            found.distance_um,
            UM_PER_MM * found.radius,
        ]
    )
    return [
        {
            "ball": number,
            **dict(zip(COLUMNS[1:-1], values, strict=True)),
            "colour": "#{:02x}{:02x}{:02x}".format(*shade),
        }
        for number, (values, shade) in enumerate(zip(table.tolist(), shades, strict=True), 1)
    ]
