"""What "virtual cameras" and "pixels of one" may mean: every reading with its figure."""

import numpy as np

from tbcad.mirrors.array import MirrorArray, numbered_directions
from tbcad.simulate.study.paper import claimed
from tbcad.simulate.study.pixels import Sensor, count_pixels, virtual_cameras
from tbcad.simulate.study.sweep import spec_with, try_design
from tbcad.simulate.study.tables import Cell, Table
from tbcad.spec.design import Spec

COLUMNS = ("reading", "radii", "n", "value", "paper", "other_paper", "reason")
NOTES = (
    "The paper has 1657 virtual cameras at n = 18 (Table I) and 1586 in another place. 1657 is "
    "the number of directions with z >= 0, the definition used here.",
    "Readings of the same figure: none that we tried is 1586, whether of cameras or of pixels.",
)
# Radius rule and margin, and what they are called.
RADII: tuple[tuple[str, str, float | None], ...] = (
    ("traced, no margin", "traced", 0.0),
    ("traced, the design's margin", "traced", None),
    ("paper", "paper", None),
    ("flat", "flat", None),
)


def definitions(spec: Spec) -> Table:
    """Every reading of both figures for one design."""
    rows = _directions(spec)
    for name, rule, margin in RADII:
        rows += _pixels(spec_with(spec, rule=rule, margin_mm=margin), name)
    return Table("resolution-definitions", COLUMNS, tuple(rows), NOTES)


def _directions(spec: Spec) -> list[tuple[Cell, ...]]:
    n = spec.optics.n
    z = numbered_directions(n)[0][:, 2]
    mine = int((numbered_directions(n)[0][z >= 0, 0] >= 0).sum())
    readings = {
        "virtual cameras: directions with z >= 0": int((z >= 0).sum()),
        "directions with z > 0": int((z > 0).sum()),
        "half of all directions": len(z) / 2,
        "mirrors of both halves, halved ones twice": 2 * mine,
    }
    return [_row(spec, name, "any", value) for name, value in readings.items()]


def _pixels(spec: Spec, radii: str) -> list[tuple[Cell, ...]]:
    tried = try_design(spec)
    if tried.made is None:
        return [("no design", radii, spec.optics.n, None, None, None, tried.reason)]
    found = _readings(spec, tried.made.halves[0])
    return [_row(spec, name, radii, value) for name, value in found.items()]


def _readings(spec: Spec, half: MirrorArray) -> dict[str, float]:
    sensor = Sensor(spec.camera.width_px, spec.camera.height_px)
    counted = count_pixels(half, (sensor,), spec.optics.capture_diameter_mm / 2)[0]
    cameras = virtual_cameras(half)
    seen, on = float(counted.seen.sum()), float(counted.on.sum())
    return {
        "seeing pixels / virtual cameras": 2 * seen / cameras,
        "seeing pixels / mirrors": seen / len(half),
        "seeing pixels of a mirror, median": float(np.median(counted.seen)),
        "pixels on mirrors / virtual cameras": 2 * on / cameras,
        "pixels on mirrors / mirrors": on / len(half),
        "pixels on a mirror, median": float(np.median(counted.on)),
        "pixels of both frames / virtual cameras": 2 * sensor.width_px * sensor.height_px / cameras,
    }


def _row(spec: Spec, name: str, radii: str, value: float) -> tuple[Cell, ...]:
    n = spec.optics.n
    both = (int(claimed("virtual_cameras")), int(claimed("other_count")))
    return (name, radii, n, value, *(both if n == claimed("design_n") else (None, None)), "")
