"""The record of a design: mirrors.csv, and design.json with the resolved spec and the cameras."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from tbcad.formats.csv_table import Row, write_table
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.spec.load import spec_dict

Record: TypeAlias = dict[str, Any]

SCHEMA = "tbcad-design/2"
DESIGN_FILE, MIRRORS_FILE = "design.json", "mirrors.csv"
COLUMNS = (
    *("id", "camera"),
    *("ux", "uy", "uz", "px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz"),
    *("radius_mm", "size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg"),
    *("cell_area_mm2", "coverage_mm"),
)


def mirror_rows(array: MirrorArray) -> list[Row]:
    """One row for each mirror, in the order of COLUMNS; planar mirrors have no sphere."""
    mirrors = array.mirrors
    numbers = np.column_stack(
        [
            array.u,
            mirrors.apex,
            mirrors.normal,
            mirrors.centre,
            mirrors.radius,
            array.half_width,
            np.degrees([array.theta0, array.theta1, array.polar, array.azimuth]).T,
            array.area,
            array.coverage,
        ]
    )
    values = [[None if np.isnan(x) else x + 0.0 for x in row] for row in numbers.tolist()]
    return [
        dict(zip(COLUMNS, [name, array.camera_id, *row], strict=True))
        for name, row in zip(array.ids, values, strict=True)
    ]


def write_record(
    folder: Path, design: MirrorDesign, shells: bool, mandrels: Sequence[Record] = ()
) -> None:
    """Write mirrors.csv and design.json, with shells and their negatives where they are there."""
    write_table(
        folder / MIRRORS_FILE,
        COLUMNS,
        (row for array in design.arrays for row in mirror_rows(array)),
    )
    text = json.dumps(document(design, shells, mandrels), indent=1, allow_nan=False) + "\n"
    (folder / DESIGN_FILE).write_text(text, encoding="utf-8")


def document(design: MirrorDesign, shells: bool, mandrels: Sequence[Record] = ()) -> Record:
    """What design.json holds; the mirrors are in the file that it names."""
    spec = design.spec
    return {
        "schema": SCHEMA,
        "spec": spec_dict(spec),
        "target_mm": spec.optics.capture_diameter_mm,
        "coating_mm": spec.mirrors.coating_um / 1000,
        "foot_z_mm": design.arrays[0].foot,
        "cameras": [camera_record(array) for array in design.arrays],
        "parts": [shell_record(array) for array in design.arrays if shells],
        **({"mandrels": list(mandrels)} if mandrels else {}),
        "mirrors": MIRRORS_FILE,
    }


def camera_record(array: MirrorArray) -> dict[str, Any]:
    """Record of one camera."""
    view = array.camera
    return {
        "id": array.camera_id,
        "pinhole_mm": (view.pinhole + 0.0).tolist(),
        "forward": (view.forward + 0.0).tolist(),
        "right": (view.right + 0.0).tolist(),
        "width_px": view.width_px,
        "height_px": view.height_px,
        "hfov_deg": round(float(np.degrees(view.hfov)), 12),
    }


def shell_record(array: MirrorArray) -> dict[str, str]:
    """Record of one part and its files."""
    return _part_files("shell", array)


def mandrel_files(array: MirrorArray) -> dict[str, str]:
    """Name and files of one shell's negative."""
    return _part_files("mandrel", array)


def _part_files(part: str, array: MirrorArray) -> dict[str, str]:
    name = f"{part}_{array.camera_id}"
    files = {kind: f"{name}.{kind}" for kind in ("step", "stl", "3mf")}
    return {"name": name, "camera": array.camera_id, **files}
