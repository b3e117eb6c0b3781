"""The record of a design: mirrors.csv, design.json with spec and cameras, and a map as SVG."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.common.figure_files import shades
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.records.design import NAME as DESIGN_FILE
from tbcad.records.design import (
    CameraRecord,
    DesignRecord,
    MandrelRecord,
    ShellFiles,
    ShellLamps,
)
from tbcad.records.tables import MirrorRow
from tbcad.types import Floats

COLUMNS = MirrorRow.columns()
SIZE_PX = 320
EDGE_PX = 8
DOT_SHARE = 0.8  # of the distance of neighbours that lie evenly


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
    folder: Path,
    design: MirrorDesign,
    shells: bool,
    mandrels: Sequence[MandrelRecord] = (),
    lamps: ShellLamps | None = None,
) -> None:
    """Write mirrors.csv and design.json, with shells, negatives and lamps where they are there."""
    write_table(
        folder / MirrorRow.FILE,
        COLUMNS,
        (row for array in design.arrays for row in mirror_rows(array)),
    )
    design_record(design, shells, mandrels, lamps).write(folder / DESIGN_FILE)


def design_record(
    design: MirrorDesign,
    shells: bool,
    mandrels: Sequence[MandrelRecord] = (),
    lamps: ShellLamps | None = None,
) -> DesignRecord:
    """What design.json holds; the mirrors are in the file that it names."""
    spec, (a, b) = design.spec, design.arrays
    return DesignRecord(
        spec=spec,
        target_mm=spec.optics.capture_diameter_mm,
        coating_mm=spec.mirrors.coating_um / 1000,
        foot_z_mm=a.foot,
        cameras=(_camera(a), _camera(b)),
        parts=tuple(ShellFiles(**part_files("shell", one)) for one in (a, b) if shells),
        mandrels=tuple(mandrels),
        lamps=lamps,
        mirrors=MirrorRow.FILE,
    )


def _camera(array: MirrorArray) -> CameraRecord:
    view = array.camera
    return CameraRecord(
        id=array.camera_id,
        pinhole_mm=(view.pinhole + 0.0).tolist(),
        forward=(view.forward + 0.0).tolist(),
        right=(view.right + 0.0).tolist(),
        width_px=view.width_px,
        height_px=view.height_px,
        hfov_deg=round(float(np.degrees(view.hfov)), 12),
    )


def part_files(part: str, array: MirrorArray) -> dict[str, Any]:
    """Name, camera and files of one half's "shell", or of its negative, the "mandrel"."""
    name = f"{part}_{array.camera_id}"
    files = {kind: f"{name}.{kind}" for kind in ("step", "stl", "3mf")}
    return {"name": name, "camera": array.camera_id, **files}


def hemisphere_map(arrays: tuple[MirrorArray, MirrorArray]) -> str:
    """SVG with a dot for each mirror at its direction, coloured by the logarithm of its radius.

    Lambert's azimuthal projection: equal areas, the zenith in the middle, x to the right. Planar
    mirrors, which have no radius, have all one colour.
    """
    u = np.concatenate([array.u for array in arrays])
    radius = np.concatenate([array.mirrors.radius for array in arrays])
    logarithm = np.log(radius) if np.isfinite(radius).all() else np.zeros(len(u))
    half = SIZE_PX / 2 - EDGE_PX
    x, y = SIZE_PX / 2 + half * equal_area(u).T * [[1], [-1]]
    dot = DOT_SHARE * half / np.sqrt(len(u))
    dots = "".join(
        f'<circle cx="{cx:.1f}" cy="{cy:.1f}" r="{dot:.2f}" fill="{colour}"/>'
        for cx, cy, colour in zip(x, y, shades(logarithm), strict=True)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE_PX}" height="{SIZE_PX}" '
        f'viewBox="0 0 {SIZE_PX} {SIZE_PX}" role="img" aria-label="directions of all mirrors">'
        f"{dots}</svg>"
    )


def equal_area(u: Floats) -> Floats:
    """Lambert's projection of unit vectors (m, 3), z >= 0, to the unit disc, (m, 2)."""
    return np.asarray(u[:, :2] / np.sqrt(1 + u[:, 2:]))
