"""The record of a design: mirrors.csv, and design.json with the resolved spec and the cameras."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.formats.csv_table import Row, write_table
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.spec.load import spec_dict

SCHEMA = "tbcad-design/2"
DESIGN_FILE, MIRRORS_FILE = "design.json", "mirrors.csv"
COLUMNS = (
    *("id", "camera"),
    *("ux", "uy", "uz", "px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz"),
    *("radius_mm", "size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg"),
    *("cell_area_mm2", "coverage_mm"),
)


def mirror_rows(half: MirrorArray) -> list[Row]:
    """One row for each mirror, in the order of COLUMNS; planar mirrors have no sphere."""
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


def write_record(folder: Path, design: MirrorDesign, shells: bool) -> None:
    """Write mirrors.csv and design.json; `shells`: whether the shells' files are there too."""
    write_table(
        folder / MIRRORS_FILE, COLUMNS, (row for half in design.halves for row in mirror_rows(half))
    )
    text = json.dumps(document(design, shells), indent=1, allow_nan=False) + "\n"
    (folder / DESIGN_FILE).write_text(text, encoding="utf-8")


def document(design: MirrorDesign, shells: bool) -> dict[str, Any]:
    """What design.json holds; the mirrors are in the file that it names."""
    spec = design.spec
    return {
        "schema": SCHEMA,
        "spec": spec_dict(spec),
        "target_mm": spec.optics.capture_diameter_mm,
        "coating_mm": spec.mirrors.coating_um / 1000,
        "foot_z_mm": design.halves[0].foot,
        "cameras": [camera_record(half) for half in design.halves],
        "parts": [shell_record(half) for half in design.halves if shells],
        "mirrors": MIRRORS_FILE,
    }


def camera_record(half: MirrorArray) -> dict[str, Any]:
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


def shell_record(half: MirrorArray) -> dict[str, str]:
    """Record of one part and its files."""
    name = f"shell_{half.camera_id}"
    files = {kind: f"{name}.{kind}" for kind in ("step", "stl", "3mf")}
    return {"name": name, "camera": half.camera_id, **files}
