"""What "virtual cameras" and "pixels of one" may mean: every definition with its figure."""

import numpy as np

from tbcad.mirrors.array import MirrorArray, numbered_directions
from tbcad.simulate.study.paper import claimed
from tbcad.simulate.study.pixels import Sensor, count_pixels, virtual_cameras
from tbcad.simulate.study.sweep import try_design
from tbcad.simulate.study.tables import Cell, Record, Table
from tbcad.spec.design import Spec

NOTES = (
    "The paper has 1657 virtual cameras at n = 18 (Table I) and 1586 in another place. 1657 is "
    "the number of directions with z >= 0, the definition used here.",
    "Definitions of the same figure: none that we tried is 1586, whether of cameras or of pixels.",
)
# What radii are called: their keys of the design.
RADII: dict[str, dict[str, object]] = {
    "traced, no margin": {"radius_rule": "traced", "margin_mm": 0.0},
    "traced, the design's margin": {"radius_rule": "traced"},
    "paper": {"radius_rule": "paper"},
    "flat": {"radius_rule": "flat"},
}


def definitions(spec: Spec) -> Table:
    """Every definition of both figures for one design."""
    records = [_record(spec, name, "any", value) for name, value in _directions(spec).items()]
    for radii, keys in RADII.items():
        attempt = try_design(spec, mirrors=keys)
        if attempt.half is None:
            refused = _record(spec, "no design", radii, None, attempt.reason)
            records.append({**refused, "paper": None, "other_paper": None})
        else:
            pixels = _pixels(spec, attempt.half)
            records += [_record(spec, name, radii, value) for name, value in pixels.items()]
    return Table.of_records("resolution-definitions", records, NOTES)


def _record(spec: Spec, name: str, radii: str, value: Cell, reason: str = "") -> Record:
    n = spec.optics.n
    known = n == claimed("design_n")
    return {
        "definition": name,
        "radii": radii,
        "n": n,
        "value": value,
        "paper": int(claimed("virtual_cameras")) if known else None,
        "other_paper": int(claimed("other_count")) if known else None,
        "reason": reason,
    }


def _directions(spec: Spec) -> dict[str, Cell]:
    u = numbered_directions(spec.optics.n)[0]
    upper = u[:, 2] >= 0
    return {
        "virtual cameras: directions with z >= 0": int(upper.sum()),
        "directions with z > 0": int((u[:, 2] > 0).sum()),
        "half of all directions": len(u) / 2,
        "mirrors of both halves, halved ones twice": 2 * int((upper & (u[:, 0] >= 0)).sum()),
    }


def _pixels(spec: Spec, half: MirrorArray) -> dict[str, float]:
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
