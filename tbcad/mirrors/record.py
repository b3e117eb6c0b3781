"""The record: mirrors.csv, and design.json with the resolved spec, cameras and mirrors."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.spec.load import spec_dict

Row = dict[str, str | float | None]

SCHEMA = "tbcad-design/1"
COLUMNS = (
    *("id", "camera"),
    *("ux", "uy", "uz", "px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz"),
    *("radius_mm", "size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg"),
    *("cell_area_mm2", "coverage_mm"),
)


def rows(half: MirrorArray) -> list[Row]:
    """One record for each mirror, in the order of COLUMNS; planar mirrors have no sphere."""
    mirrors = half.mirrors
    numbers = np.column_stack(
        [
            half.u,
            mirrors.apex,
            mirrors.normal,
            mirrors.centre,
            mirrors.radius,
            half.half_width,
            np.degrees([half.theta0, half.theta1, half.polar, half.azimuth]).T,
            half.area,
            half.coverage,
        ]
    )
    values = [[None if np.isnan(x) else x + 0.0 for x in row] for row in numbers.tolist()]
    return [
        dict(zip(COLUMNS, [name, half.camera_id, *row], strict=True))
        for name, row in zip(half.ids, values, strict=True)
    ]


def write_mirrors(path: Path, records: list[Row]) -> None:
    """Write mirrors.csv with full double precision; what does not exist is left empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)


def write_record(folder: Path, design: MirrorDesign, shells: bool) -> None:
    """Write mirrors.csv and design.json; whether the shells' files are there too is recorded."""
    records = [row for half in design.halves for row in rows(half)]
    write_mirrors(folder / "mirrors.csv", records)
    write_design(folder / "design.json", design, records, shells)


def write_design(path: Path, design: MirrorDesign, records: list[Row], shells: bool = True) -> None:
    """Write design.json."""
    spec = design.spec
    document = {
        "schema": SCHEMA,
        "spec": spec_dict(spec),
        "target_mm": spec.optics.capture_diameter_mm,
        "coating_mm": spec.mirrors.coating_um / 1000,
        "foot_z_mm": design.halves[0].foot,
        "cameras": [camera(half) for half in design.halves],
        "parts": [part(half) for half in design.halves if shells],
        "mirrors": records,
    }
    path.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def camera(half: MirrorArray) -> dict[str, Any]:
    """Record of one camera."""
    view = half.camera
    return {
        "id": half.camera_id,
        "pinhole_mm": (view.pinhole + 0.0).tolist(),
        "forward": (view.forward + 0.0).tolist(),
        "right": (view.right + 0.0).tolist(),
        "width_px": view.width_px,
        "height_px": view.height_px,
        "hfov_deg": round(float(np.degrees(view.hfov)), 12),
    }


def part(half: MirrorArray) -> dict[str, str]:
    """Record of one part and its files."""
    name = f"shell_{half.camera_id}"
    files = {kind: f"{name}.{kind}" for kind in ("step", "stl", "3mf")}
    return {"name": name, "camera": half.camera_id, **files}
