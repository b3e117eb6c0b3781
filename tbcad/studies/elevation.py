"""Mirrors over their angles: radius over polar angle (section 5.1), pixels over elevation (4.2)."""

import numpy as np
from numpy.typing import ArrayLike

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.spec.design import Spec, spec_with
from tbcad.light.simulate.capture.pixel_counts import PixelCounts, Sensor, count_pixels
from tbcad.studies.paper import with_lens_of_table_i
from tbcad.types import Floats, Progress

CURVES = {"traced": ("exact rays", "C0."), "paper": ("eqs. 1 and 2", "C1.")}
RADIUS_PLACE = "section 5.1"
PIXELS_PLACE = "section 4.2, Fig. 7b"
UNEVEN_PLACE = "section 6"
BAND_DEG = 15.0
NOTES = (
    "polar_deg: about w, the axis from the object to the camera, on which the prototype's base "
    "rotates; the elevation of section 5.1. azimuth 0 is the zenith's side. elevation_deg: of the "
    "virtual camera above the plane z = 0; the elevation of sections 4.2 and 4.4. Mirrors of "
    "camera a; b's mirror them.",
    "Radii: paper: eqs. 1 and 2; traced: exact coverage of the capture diameter and "
    "mirrors.margin_mm. nearly_flat: traced radius set by mirrors.max_radius_widths.",
    "seeing_px: pixels whose ray, off the mirror with its traced radius, meets the capture sphere; "
    "mirrors that the seam halves count with both halves. area_mm2, to_camera_mm, to_object_mm: "
    "of the mirror's cell and apex.",
    "Correlation: Pearson's coefficient over all mirrors. The paper states correlations, no "
    "coefficient.",
)


def elevation(spec: Spec, progress: Progress = lambda _: None) -> Study:
    """The study: radii of every mirror by both rules, its pixels, and how they follow the angles.

    Raises:
        SpecError: the mirrors cannot be made.
    """
    spec, arrays = with_lens_of_table_i(spec), {}
    for rule in CURVES:
        progress(f"radii by rule {rule}")
        arrays[rule] = design(spec_with(spec, mirrors={"radius_rule": rule})).arrays[0]
    progress("pixels")
    traced = arrays["traced"]
    sensor = Sensor(spec.camera.width_px, spec.camera.height_px)
    counts = count_pixels(traced, (sensor,), spec.optics.capture_diameter_mm / 2)[0]
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
    return Table.of_columns("elevation", columns, NOTES)


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
    elevation = ("elevation", mirrors.numbers("elevation_deg"))
    to_object = ("distance from the object", mirrors.numbers("to_object_mm"))
    area = ("area", mirrors.numbers("area_mm2"))
    return [
        _correlated("traced", ("pixels", mirrors.numbers("seeing_px")), elevation, PIXELS_PLACE),
        _correlated("traced", area, elevation, PIXELS_PLACE),
        _correlated(
            "traced",
            ("distance from the camera", mirrors.numbers("to_camera_mm")),
            elevation,
            PIXELS_PLACE,
        ),
        _correlated("traced", area, to_object, UNEVEN_PLACE),
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
