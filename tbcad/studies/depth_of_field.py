"""Depth of the mirrors' virtual images, and the stop that a real lens would need (section 6)."""

from dataclasses import astuple, dataclass

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.camera.requirements import (
    FANS,
    PLACES,
    DepthRange,
    Lens,
    VirtualImages,
    aperture_stop,
    aperture_stops,
    focal_length,
    lens_for,
    virtual_images,
)
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.capture.photograph import count_pixels, virtual_cameras
from tbcad.studies.paper import claimed, claims, notes, try_design, with_lens_of_table_i
from tbcad.studies.resolution import default_sensors, pixel_pitch
from tbcad.studies.resolved import ResolvedSpots, spot_mm
from tbcad.types import Floats, Progress

RULES = ("traced", "paper", "flat")
POINTS = tuple(f"{place}_{fan}" for place in PLACES for fan in FANS)
NUMBERS = (
    *("polar_deg", "radius_mm", "incidence_deg", "to_mirror_mm"),
    *(f"{point}_mm" for point in POINTS),
    *(f"{point}_depth_mm" for point in POINTS),
)
PUPILS = (
    *("radii", "width_px", "height_px", "best_pupil_mm", "average_px", "resolved_average_spots"),
    *("ideal_spot_mm", "real_spot_mm"),
)
CONSTANT = "camera to images of the centre, flat radii: farthest less nearest"
PAPER_RANGE = "the paper's distances"
RANGES_SHOWN = ("traced radii, along the axis", PAPER_RANGE)
# Columns of the stops that are figures of the study: what they are called, and their units.
STOP_FIGURES = {
    "pupil_mm": ("pupil", "mm"),
    "f_number": ("F-number", ""),
    "blur_px": ("blur circle", "px"),
    "total_px": ("blur and diffraction", "px"),
    "light": ("light relative to wide open", ""),
}
# Images in the plot: radii, point of the capture sphere, fan, label, mark.
IMAGES = (
    ("traced", 0, 0, "traced radii: nearest point, tangential", "C0."),
    ("traced", 1, 0, "centre, tangential", "C2."),
    ("traced", 1, 1, "centre, sagittal", "C4."),
    ("traced", 2, 1, "farthest point, sagittal", "C1."),
    ("flat", 1, 0, "flat mirrors: centre", "k."),
)
SMALLEST_STOP = 8  # of the plot, in F-numbers of the lens wide open


@dataclass(frozen=True)
class LensOptions:
    """The lens and its pixels."""

    blur_px: float = 1.0  # largest blur circle allowed
    pixel_um: float = 3.45  # width of a pixel, micrometres
    wide_open: float = 2.8  # F-number of the lens fully open


def depth_of_field(spec: Spec, options: LensOptions, progress: Progress = lambda _: None) -> Study:
    """The study: where the images are by all radius rules, and the stops for them."""
    spec = with_lens_of_table_i(spec)
    camera, wide_open = spec.camera, options.wide_open
    lens = lens_for(
        np.radians(camera.hfov_deg), camera.width_px, options.pixel_um / 1000, wide_open
    )
    by_rule, refusals = _by_rule(spec, progress)
    ranges = _ranges(by_rule)
    stops = _stop_records(ranges, lens, options.blur_px)
    pupils = _pupil_records(spec, by_rule, progress)
    tables = (
        _mirror_table(by_rule, (*notes("depth-of-field"), *refusals)),
        Table.of_records("depth-of-field-stops", stops, notes("depth-of-field-stops")),
        Table.of_records("depth-of-field-pupils", pupils, notes("depth-of-field-pupils"), PUPILS),
    )
    figures = (
        *_image_figures(by_rule),
        *_flat_figures(by_rule, ranges),
        *_stop_figures(stops),
        *_pupil_figures(pupils),
    )
    panels = (_image_panel(by_rule), _blur_panel(ranges, lens))
    return Study("depth-of-field", figures, tables, panels)


def _by_rule(spec: Spec, progress: Progress) -> tuple[dict[str, VirtualImages], list[str]]:
    """Mirrors by each radius rule that makes them, and why the others do not."""
    by_rule, refusals = {}, []
    for rule in RULES:
        progress(f"radii by rule {rule}")
        attempt = try_design(spec, mirrors={"radius_rule": rule})
        if attempt.array is None:
            refusals.append(f"No figures of {rule} radii: {attempt.reason}")
        else:
            radius = spec.optics.capture_diameter_mm / 2
            by_rule[rule] = virtual_images(attempt.array, radius)
    return by_rule, refusals


def _mirror_table(by_rule: dict[str, VirtualImages], notes: tuple[str, ...]) -> Table:
    numbers = [np.empty((0, len(NUMBERS)))]
    for one in by_rule.values():
        mirrors = np.degrees(one.array.polar), one.array.mirrors.radius, np.degrees(one.incidence)
        images = (places.reshape(len(one.array), -1) for places in (one.distance, one.depth))
        numbers.append(np.column_stack([*mirrors, one.to_mirror, *images]))
    columns = {
        "id": [name for images in by_rule.values() for name in images.array.ids],
        "radii": [rule for rule, images in by_rule.items() for _ in images.array.ids],
        **dict(zip(NUMBERS, np.vstack(numbers).T, strict=True)),
    }
    return Table.of_columns("depth-of-field", columns, notes)


def _range(values: Floats) -> DepthRange:
    return DepthRange(float(values.min()), float(values.max()))


def _ranges(by_rule: dict[str, VirtualImages]) -> dict[str, DepthRange]:
    return {
        **{f"{rule} radii, along the axis": _range(one.depth) for rule, one in by_rule.items()},
        **{f"{rule} radii, distances": _range(one.distance) for rule, one in by_rule.items()},
        PAPER_RANGE: DepthRange(claimed("depth_near"), claimed("depth_far")),
    }


def _stop_records(ranges: dict[str, DepthRange], lens: Lens, blur_px: float) -> list[Record]:
    return [
        {
            "range": name,
            "near_mm": over.near,
            "far_mm": over.far,
            "focus_mm": over.focus,
            "focal_mm": focal_length(lens, over),
            "stop": kind,
            **stop,
        }
        for name, over in ranges.items()
        for kind, stop in aperture_stops(lens, over, blur_px).items()
    ]


def _pupil_records(
    spec: Spec, by_rule: dict[str, VirtualImages], progress: Progress
) -> list[Record]:
    """For each radius rule and sensor, the pupil with the most resolvable spots."""
    capture, records = spec.optics.capture_diameter_mm, []
    for rule, images in by_rule.items():
        cameras = virtual_cameras(images.array)
        for sensor in default_sensors(spec):
            progress(f"pupils, {rule} radii, {sensor}")
            seen = count_pixels(images.array, sensor, capture / 2).seen
            real = ResolvedSpots(images, seen, pixel_pitch(images.array.camera, sensor))
            ideal, spots = (2 * float(each.sum()) / cameras for each in (seen, real.spots))
            # Flat mirrors see a part of the sphere only: their pixels do not share its disc.
            widths = [None if rule == "flat" else spot_mm(capture, n) for n in (ideal, spots)]
            figures = (rule, *astuple(sensor), real.best_pupil, ideal, spots, *widths)
            records.append(dict(zip(PUPILS, figures, strict=True)))
    return records


def _pupil_figures(pupils: list[Record]) -> list[Figure]:
    name = "pupil with the most spots, {width_px}x{height_px}, {radii} radii"
    return [Figure(name.format(**one), "mm", one["best_pupil_mm"]) for one in pupils]


def _image_figures(by_rule: dict[str, VirtualImages]) -> list[Figure]:
    near, far = claims()["depth_near"], claims()["depth_far"]
    figures = []
    for rule, images in by_rule.items():
        over = _range(images.distance)
        for which, ours, paper in (("nearest", over.near, near), ("farthest", over.far, far)):
            name = f"camera to {which} image, {rule} radii"
            figures.append(Figure(name, "mm", ours, paper.value, paper.where))
    return figures


def _flat_figures(by_rule: dict[str, VirtualImages], ranges: dict[str, DepthRange]) -> list[Figure]:
    """Whether flat mirrors keep the images at one distance, and convex ones need more depth."""
    if "flat" not in by_rule:
        return []
    where = claims()["depth_near"].where
    centre = by_rule["flat"].distance[:, 1]
    figures = [Figure(CONSTANT, "mm", float(np.ptp(centre)), 0.0, where)]
    for kind in ("distances", "along the axis"):
        spread = {rule: ranges[f"{rule} radii, {kind}"].spread for rule in by_rule}
        figures += [
            Figure(f"1/near - 1/far of {rule} radii over flat, {kind}", "", ratio, "> 1", where)
            for rule, ratio in ((rule, spread[rule] / spread["flat"]) for rule in spread)
            if rule != "flat"
        ]
    return figures


def _stop_figures(stops: list[Record]) -> list[Figure]:
    where = claims()["depth_near"].where
    return [
        Figure(f"{stop['stop']}, {stop['range']}: {text}", unit, stop[column], where=where)
        for stop in stops
        if stop["range"] in RANGES_SHOWN and stop["stop"] != "wide open"
        for column, (text, unit) in STOP_FIGURES.items()
    ]


def _image_panel(by_rule: dict[str, VirtualImages]) -> PlotPanel:
    series = [
        Series(label, np.degrees(one.array.polar), one.distance[:, place, fan], mark)
        for rule, place, fan, label, mark in IMAGES
        if (one := by_rule.get(rule))
    ]
    polar = np.concatenate([one.array.polar for one in by_rule.values()] or [np.zeros(1)])
    ends = np.degrees([polar.min(), polar.max()])
    for key, style in (("depth_near", "k--"), ("depth_far", "k-.")):
        paper = claimed(key)
        series.append(Series(f"the paper: {paper:g} mm", ends, np.full(2, paper), style))
    title = "Virtual images of the capture sphere"
    return PlotPanel(title, "polar angle, degrees", "distance from the camera, mm", tuple(series))


def _blur_panel(ranges: dict[str, DepthRange], lens: Lens) -> PlotPanel:
    series: list[Series] = []
    f_numbers = np.linspace(lens.wide_open, SMALLEST_STOP * lens.wide_open, 60)
    shown = [(name, over) for name, over in ranges.items() if name in RANGES_SHOWN]
    for k, (name, over) in enumerate(shown):
        stops = [aperture_stop(lens, over, focal_length(lens, over) / f) for f in f_numbers]
        blur, total = np.array([(stop["blur_px"], stop["total_px"]) for stop in stops]).T
        series += [
            Series(f"blur circle, {name}", f_numbers, blur, f"C{k}--"),
            Series(f"with diffraction, {name}", f_numbers, total, f"C{k}-"),
        ]
    return PlotPanel("Blur at the ends of the range", "F-number", "diameter, pixels", tuple(series))
