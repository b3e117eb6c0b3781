"""Mirrors over n and over angles: sphere seen whole (Fig. 5c), radii (5.1), pixels (4.2)."""

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from tbcad.common.results import Cell, Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.spec.design import Spec, spec_with
from tbcad.light.simulate.capture.photograph import (
    PixelCounts,
    Sensor,
    count_pixels,
    virtual_cameras,
)
from tbcad.studies.paper import (
    DesignAttempt,
    claims,
    for_each_n,
    notes,
    try_design,
    with_lens_of_table_i,
)
from tbcad.types import Floats, Progress

RULES = ("flat", "paper", "traced")
# By more than rounding in the coverage that the search for radii leaves.
SHORT_BY = 1e-5
AREA_CURVES = {
    "traced_minimum_mm": ("traced radii, minimum", "C2.-"),
    "paper_median_mm": ("eqs. 1 and 2, median", "C1.--"),
    "paper_minimum_mm": ("eqs. 1 and 2, minimum", "C1.-"),
    "flat_median_mm": ("flat, median", "C0.--"),
    "flat_minimum_mm": ("flat, minimum", "C0.-"),
    "flat_closed_form_mm": ("flat, 2 d sin(min theta_0)", "k:"),
    "paper_claim_flat_mm": ("the paper: flat", "k+"),
    "paper_claim_convex_mm": ("the paper: convex", "kx"),
}
CURVES = {"traced": ("exact rays", "C0."), "paper": ("eqs. 1 and 2", "C1.")}
RADIUS_PLACE = "section 5.1"
PIXELS_PLACE = "section 4.2, Fig. 7b"
UNEVEN_PLACE = "section 6"
BAND_DEG = 15.0


def capture_area(
    spec: Spec, ns: range, progress: Progress = lambda _: None, scheduler: str | None = None
) -> Study:
    """The study: coverage of flat and convex mirrors for every n."""
    records = for_each_n(partial(_area_record, spec), ns, progress, scheduler)
    table = Table.of_records("capture-area", records, notes("capture-area"))
    n = table.numbers("n")
    curves = (
        Series(label, n, table.numbers(c), style) for c, (label, style) in AREA_CURVES.items()
    )
    title = f"Capture diameter, {spec.optics.capture_diameter_mm:g} mm wanted"
    return Study(
        "capture-area",
        tuple(figure for record in records for figure in _area_figures(record)),
        (table,),
        (PlotPanel(title, "subdivision n", "diameter seen whole, mm", tuple(curves)),),
    )


def _area_record(spec: Spec, n: int) -> Record:
    """One row: the figures of all radius rules at one n."""
    attempts = {
        rule: try_design(spec, optics={"n": n}, mirrors={"radius_rule": rule}) for rule in RULES
    }
    array = next((attempt.array for attempt in attempts.values() if attempt.array), None)
    record: Record = {"n": n, "virtual_cameras": None, "flat_closed_form_mm": None}
    if array:
        smallest = float(np.sin(array.theta0.min()))
        record["virtual_cameras"] = virtual_cameras(array)
        record["flat_closed_form_mm"] = 2 * array.ellipsoid.camera_distance * smallest
    for rule, attempt in attempts.items():
        coverage = _coverage(attempt, spec.optics.capture_diameter_mm)
        record |= {f"{rule}_{name}": cell for name, cell in coverage.items()}
    flat, convex = claims().get(f"flat_capture_n{n}"), claims()["convex_capture"]
    record["paper_claim_flat_mm"] = flat.value if flat else None
    record["paper_claim_convex_mm"] = convex.value if n == claims()["design_n"].value else None
    return record


def _coverage(attempt: DesignAttempt, capture_mm: float) -> dict[str, Cell]:
    if attempt.array is None:
        empty = dict.fromkeys(("minimum_mm", "median_mm", "mirrors_short"))
        return {**empty, "reason": attempt.reason}
    coverage = attempt.array.coverage
    return {
        "minimum_mm": float(coverage.min()),
        "median_mm": float(np.median(coverage)),
        "mirrors_short": int((coverage < capture_mm * (1 - SHORT_BY)).sum()),
        "reason": "",
    }


def _area_figures(record: Record) -> list[Figure]:
    n, where = record["n"], claims()["convex_capture"].where
    figures = {
        f"flat, n = {n}, 2 d sin(min theta_0)": ("flat_closed_form_mm", "paper_claim_flat_mm"),
        f"flat, n = {n}, exact minimum": ("flat_minimum_mm", "paper_claim_flat_mm"),
    }
    for rule in ("paper", "traced"):
        for kind in ("minimum", "median"):
            name = f"convex, n = {n}, {rule} radii, exact {kind}"
            figures[name] = (f"{rule}_{kind}_mm", "paper_claim_convex_mm")
    return [
        Figure(name, "mm", record[ours], record[paper], where)
        for name, (ours, paper) in figures.items()
        if record[paper] is not None
    ]


def elevation(spec: Spec, progress: Progress = lambda _: None) -> Study:
    """The study: radii of every mirror by both rules, its pixels, and how they follow the angles.

    SpecError: the mirrors cannot be made.
    """
    spec, arrays = with_lens_of_table_i(spec), {}
    for rule in CURVES:
        progress(f"radii by rule {rule}")
        arrays[rule] = design(spec_with(spec, mirrors={"radius_rule": rule})).arrays[0]
    progress("pixels")
    traced = arrays["traced"]
    sensor = Sensor(spec.camera.width_px, spec.camera.height_px)
    counts = count_pixels(traced, sensor, spec.optics.capture_diameter_mm / 2)
    mirrors = _mirrors(traced, arrays["paper"], counts, spec.mirrors.max_radius_widths)
    correlations = [
        record for rule, array in arrays.items() for record in _correlations(rule, array)
    ]
    correlations += _pixel_correlations(mirrors)
    tables = (
        mirrors,
        Table.of_records("elevation-pixels", _bands(mirrors)),
        Table.of_records("elevation-correlation", correlations),
    )
    panels = (_radius_panel(arrays), _pixel_panel(mirrors))
    figures = (*_figures(arrays, correlations), *_pixel_figures(mirrors))
    return Study("elevation", figures, tables, panels)


def _mirrors(
    traced: MirrorArray, paper: MirrorArray, counts: PixelCounts, max_radius_widths: float
) -> Table:
    longest = max_radius_widths * traced.half_width
    halved = np.where(traced.u[:, 0] == 0, 2, 1)
    columns: dict[str, ArrayLike] = {
        "id": traced.ids,
        "polar_deg": np.degrees(traced.polar),
        "azimuth_deg": np.degrees(traced.azimuth),
        "elevation_deg": np.degrees(np.arcsin(np.clip(traced.u[:, 2], -1, 1))),
        "traced_radius_mm": traced.mirrors.radius,
        "paper_radius_mm": paper.mirrors.radius,
        "nearly_flat": (traced.mirrors.radius >= longest * (1 - 1e-9)).astype(int),
        "seeing_px": counts.seen * halved,
        "area_mm2": traced.area * halved,
        "to_camera_mm": norm(traced.mirrors.apex - traced.camera.pinhole),
        "to_object_mm": traced.apex_distance,
    }
    return Table.of_columns("elevation", columns, notes("elevation"))


def _correlations(rule: str, array: MirrorArray) -> list[Record]:
    radius = array.mirrors.radius
    values = {"radius": radius, "log radius": np.log(radius)}
    angles = {"polar angle": array.polar, "absolute azimuth": np.abs(array.azimuth)}
    return [
        _correlated(rule, (name, value), (other, angle), RADIUS_PLACE)
        for name, value in values.items()
        for other, angle in angles.items()
    ]


def _pixel_correlations(mirrors: Table) -> list[Record]:
    """What section 4.2 says of mirrors in higher positions, and section 6 of those nearby."""
    pairs = (
        ("pixels", "seeing_px", "elevation", "elevation_deg", PIXELS_PLACE),
        ("area", "area_mm2", "elevation", "elevation_deg", PIXELS_PLACE),
        ("distance from the camera", "to_camera_mm", "elevation", "elevation_deg", PIXELS_PLACE),
        ("area", "area_mm2", "distance from the object", "to_object_mm", UNEVEN_PLACE),
    )
    return [
        _correlated("traced", (of, mirrors.numbers(one)), (to, mirrors.numbers(other)), where)
        for of, one, to, other, where in pairs
    ]


def _correlated(radii: str, of: tuple[str, Floats], to: tuple[str, Floats], where: str) -> Record:
    return {
        "radii": radii,
        "of": of[0],
        "with": to[0],
        "correlation": correlation(of[1], to[1]),
        "mirrors": len(of[1]),
        "where": where,
    }


def correlation(x: Floats, y: Floats) -> float:
    """Pearson's coefficient of two arrays (k,)."""
    return float(np.corrcoef(x, y)[0, 1])


def _bands(mirrors: Table) -> list[Record]:
    """Means over the mirrors in bands of elevation; the last holds the zenith."""
    elevation = mirrors.numbers("elevation_deg")
    last = 90 / BAND_DEG - 1
    band = np.minimum(np.floor(elevation / BAND_DEG), last)
    records: list[Record] = []
    for k in np.unique(band).tolist():
        record: Record = {
            "elevation_from_deg": k * BAND_DEG,
            "elevation_to_deg": (k + 1) * BAND_DEG,
            "mirrors": int((band == k).sum()),
        }
        for name in ("seeing_px", "area_mm2", "to_camera_mm", "traced_radius_mm"):
            record[f"mean_{name}"] = float(mirrors.numbers(name)[band == k].mean())
        records.append(record)
    return records


def _figures(arrays: dict[str, MirrorArray], correlations: list[Record]) -> tuple[Figure, ...]:
    ranges = {
        f"radii by rule {rule}": ("mm", array.mirrors.radius) for rule, array in arrays.items()
    }
    ranges["polar angle"] = ("deg", np.degrees(arrays["traced"].polar))
    extremes = (
        Figure(f"{name}, {which}", unit, value, where=RADIUS_PLACE)
        for name, (unit, values) in ranges.items()
        for which, value in (("smallest", float(values.min())), ("largest", float(values.max())))
    )
    name = "correlation of {of} with {with}, {radii}"
    correlated = (
        Figure(name.format(**r), "", r["correlation"], where=str(r["where"])) for r in correlations
    )
    return (*extremes, *correlated)


def _pixel_figures(mirrors: Table) -> tuple[Figure, ...]:
    pixels = mirrors.numbers("seeing_px")
    values = {"fewest": pixels.min(), "median": np.median(pixels), "most": pixels.max()}
    return tuple(
        Figure(f"pixels of a virtual camera, {name}", "", float(value), where=UNEVEN_PLACE)
        for name, value in values.items()
    )


def _radius_panel(arrays: dict[str, MirrorArray]) -> PlotPanel:
    series = []
    for rule, (label, style) in CURVES.items():
        radius, polar = arrays[rule].mirrors.radius, arrays[rule].polar
        named = f"{label}: correlation of log radius {correlation(np.log(radius), polar):.3f}"
        series.append(Series(named, np.degrees(polar), radius, style))
    title = "Radius of the mirrors"
    return PlotPanel(title, "polar angle about the axis, degrees", "radius, mm", tuple(series), "y")


def _pixel_panel(mirrors: Table) -> PlotPanel:
    elevation, pixels = mirrors.numbers("elevation_deg"), mirrors.numbers("seeing_px")
    bands = Table.of_records("", _bands(mirrors))
    middle = bands.numbers("elevation_from_deg") + BAND_DEG / 2
    series = (
        Series("each virtual camera", elevation, pixels, "C0."),
        Series(f"mean of {BAND_DEG:g} degrees", middle, bands.numbers("mean_seeing_px"), "ko-"),
    )
    return PlotPanel("Pixels that see the object", "elevation, degrees", "pixels", series)
