"""What the two numbers of Table II may mean: every definition, for its four sensors."""

from functools import cache

import numpy as np

from tbcad.common.results import Record, Table
from tbcad.common.schedule import run_units
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.mirrors.array import numbered_directions
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.capture.photograph import (
    Sensor,
    count_pixels,
    virtual_cameras,
)
from tbcad.studies.paper import (
    NUMBER,
    RESOLUTION,
    BalancedSensor,
    balanced_sensors,
    is_table_i,
    notes,
    try_design,
    with_lens_of_table_i,
)
from tbcad.types import Floats, Progress

# What radii are called: their keys of the design.
RADII: dict[str, dict[str, object]] = {
    "traced": {"radius_rule": "traced"},
    "traced, no margin": {"radius_rule": "traced", "margin_mm": 0.0},
    "paper": {"radius_rule": "paper"},
    "flat": {"radius_rule": "flat"},
}
COLUMNS = (
    *("definition", "radii", "width_px", "height_px", "n", "value"),
    *(f"paper_{NUMBER}", f"paper_{RESOLUTION}", "reason"),
)
FIT_COLUMNS = ("definition", "radii", *(f"rms_from_{c}_percent" for c in (NUMBER, RESOLUTION)))
ANY = "any"
IN_FRAME = "mirrors of both arrays whose apex is in the frame"
DISC = "disc pixels / mirrors"
PITCHED_RADII = "paper"  # counted at the pitch, too
# Pitches that are tried, degrees from the vertical; the object is toward positive ones.
PITCHES_DEG = np.arange(-30.0, 60.0, 0.02)


def definitions(
    spec: Spec, rows: tuple[BalancedSensor, ...], progress: Progress = lambda _: None
) -> tuple[Table, Table]:
    """Every definition for rows of Table II, and how far each is from its columns.

    n and sensor of the design are those of the rows, one after the other.
    """
    spec = with_lens_of_table_i(spec)
    units = [(row, radii) for row in reversed(rows) for radii in RADII]
    pitch = best_pitch(spec) if rows else 0.0
    counted = run_units(
        lambda unit: _pixel_records(spec, pitch, *unit),
        units,
        progress=lambda unit: progress(f"Table II: n = {unit[0].n}, radii {unit[1]}"),
    )
    records = [record for row in rows for record in _mirror_records(spec, row, pitch)]
    records += [record for by_sensor in reversed(counted) for record in by_sensor]
    table = Table.of_records(
        "resolution-definitions", records, notes("resolution-definitions"), COLUMNS
    )
    fits = _fits(table, known=is_table_i(spec))
    return table, Table.of_records("resolution-table-ii", fits, columns=FIT_COLUMNS)


def _record(
    row: BalancedSensor, name: str, radii: str, value: float | None, reason: str = ""
) -> Record:
    cells = (name, radii, row.width_px, row.height_px, row.n, value, *row.printed, reason)
    return dict(zip(COLUMNS, cells, strict=True))


def _mirror_records(spec: Spec, row: BalancedSensor, pitch: float) -> list[Record]:
    u = numbered_directions(row.n, spec.optics.stretch)[0]
    upper = u[:, 2] >= 0
    half_a = upper & (u[:, 0] >= 0)
    values = {
        "directions with z >= 0": int(upper.sum()),
        "directions with z > 0": int((u[:, 2] > 0).sum()),
        "half of all directions": len(u) / 2,
        "mirrors of both arrays, those on the seam counted twice": 2 * int(half_a.sum()),
        f"{IN_FRAME}, {_at(pitch)}": apices_in_frame(spec, row.n, pitch),
    }
    return [_record(row, name, ANY, value) for name, value in values.items()]


def _pixel_records(spec: Spec, pitch: float, row: BalancedSensor, radii: str) -> list[Record]:
    attempt = try_design(spec, optics={"n": row.n}, mirrors=RADII[radii])
    if attempt.array is None:
        return [_record(row, "no design", radii, None, attempt.reason)]
    sensor = Sensor(row.width_px, row.height_px)
    radius = spec.optics.capture_diameter_mm / 2
    counts = count_pixels(attempt.array, sensor, radius)
    cameras, values = virtual_cameras(attempt.array), dict[str, float]()
    kinds = {"seeing": counts.seen, "disc": counts.disc, "on mirrors": counts.on}
    for name, pixels in kinds.items():
        values[f"{name} pixels / virtual cameras"] = 2 * float(pixels.sum()) / cameras
        values[f"{name} pixels / mirrors"] = float(pixels.mean())
        values[f"{name} pixels of a mirror, median"] = float(np.median(pixels))
    whole = 2 * sensor.width_px * sensor.height_px
    values["pixels of both frames / virtual cameras"] = whole / cameras
    if radii == PITCHED_RADII:
        turned = count_pixels(attempt.array, sensor, radius, axes=axes_at_pitch(pitch))
        values[f"{DISC}, {_at(pitch)}"] = float(turned.disc.mean())
    return [_record(row, name, radii, value) for name, value in values.items()]


def _at(pitch: float) -> str:
    return f"camera pitched by {np.degrees(pitch):.1f} deg"


def _fits(table: Table, *, known: bool) -> list[Record]:
    """How far each definition is from both columns; of another design than the paper's: unknown."""
    keys = dict.fromkeys(zip(table.column("definition"), table.column("radii"), strict=True))
    fits: list[Record] = []
    for definition, radii in keys:
        rows = table.where(definition=definition, radii=radii)
        fit: Record = {"definition": definition, "radii": radii}
        for name, column in zip(FIT_COLUMNS[2:], (NUMBER, RESOLUTION), strict=True):
            share = rows.numbers("value") / rows.numbers(f"paper_{column}")
            off = float(100 * np.sqrt(np.mean((share - 1) ** 2)))
            fit[name] = off if known and np.isfinite(off) else None
        fits.append(fit)
    return fits


def apices_in_frame(spec: Spec, n: int, pitch: float) -> int:
    """Apices of both arrays in their cameras' frames; those on the seam count for both.

    `pitch`: from the vertical toward the object, radians; rows of pixels lie along y.
    """
    camera = with_lens_of_table_i(spec).camera
    half_width = np.tan(np.radians(camera.hfov_deg) / 2)
    half_height = half_width * camera.height_px / camera.width_px
    optics = spec.optics
    ray = _rays_to_apices(n, optics.camera_mm, optics.semi_minor_mm, optics.stretch)
    forward, right = axes_at_pitch(pitch)
    depth, along, across = np.stack([forward, right, np.cross(forward, right)]) @ ray.T
    inside = (np.abs(along) <= half_width * depth) & (np.abs(across) <= half_height * depth)
    return 2 * int(inside.sum())


def axes_at_pitch(pitch: float) -> tuple[Floats, Floats]:
    """Forward and right of camera a at a pitch (radians) from the vertical, (3,) each."""
    forward = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])
    return forward, np.array([0.0, 1.0, 0.0])


def best_pitch(spec: Spec) -> float:
    """The pitch whose counts come nearest to the second column of Table II, radians.

    Nearest: the sum of the absolute differences is smallest; the middle of the pitches with that.
    """
    pitches = np.radians(PITCHES_DEG)
    off = np.zeros(len(pitches))
    for row in balanced_sensors():
        counts = [apices_in_frame(spec, row.n, pitch) for pitch in pitches.tolist()]
        off += np.abs(np.array(counts) - row.average_of_virtual_camera_resolution)
    return float(np.median(pitches[off == off.min()]))


@cache
def _rays_to_apices(
    n: int, pinhole: tuple[float, ...], semi_minor: float, stretch: tuple[float, float]
) -> Floats:
    """From camera a's pinhole to its mirrors' apices, mm, (m, 3)."""
    ellipsoid = Ellipsoid(np.array(pinhole), semi_minor)
    u = numbered_directions(n, stretch)[0]
    half_a = (u[:, 0] >= 0) & (u[:, 2] >= 0)
    return ellipsoid.apices(u[half_a]) - ellipsoid.pinhole
