"""How deep the mirrors' images lie, and the stop that a real lens would need (section 6)."""

from dataclasses import dataclass

import numpy as np

from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorArray
from tbcad.simulate.study.lens import (
    DepthRange,
    Lens,
    aperture_stop,
    aperture_stops,
    focal_length,
    lens_for,
)
from tbcad.simulate.study.paper import claimed, claims
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.sweep import spec_with, try_design
from tbcad.simulate.study.tables import SUMMARY, Cell, Table
from tbcad.simulate.study.virtual_images import FANS, PLACES, VirtualImages, virtual_images
from tbcad.spec.design import Spec
from tbcad.types import Floats, Progress

RULES = ("traced", "paper", "flat")
POINTS = tuple(f"{place}_{fan}" for place in PLACES for fan in FANS)
COLUMNS = (
    *("id", "radii", "polar_deg", "radius_mm", "incidence_deg", "to_mirror_mm"),
    *(f"{point}_mm" for point in POINTS),
    *(f"{point}_depth_mm" for point in POINTS),
)
STOPS = (
    *("range", "near_mm", "far_mm", "focus_mm", "focal_mm", "stop", "pupil_mm", "f_number"),
    *("blur_px", "airy_px", "total_px", "light", "stops_lost"),
)
NOTES = (
    "Distances are from the camera's pinhole to the virtual image of a point of the capture "
    "sphere on the mirror's principal ray: the nearest to the mirror, the centre, the farthest. "
    "Coddington's equations; tangential and sagittal fans have images of their own.",
    "_depth_: the same along the camera's optical axis, which is what a lens focuses on. The "
    "camera is turned as the design turns it.",
    "Mirrors of camera a; b's mirror them. The paper's range is of distances, as we read it.",
)
LENS_NOTES = (
    "A thin lens without aberrations or field curvature, stop at the lens, whose angle of view is "
    "the design's; focused on the harmonic mean of the range's ends, where their blur is equal.",
    "blur_px: geometric blur circle at both ends. airy_px: Airy disc of 550 nm on the axis; it is "
    "larger off the axis. total_px: root of the sum of their squares.",
    "blur limited: the largest pupil within --blur-px. sharpest: least total_px. light: relative "
    "to the lens wide open (--wide-open); stops_lost: in factors of two. No stop is wider than "
    "wide open.",
    "The aperture that the paper gives, if it gives one, is not known to us.",
)


DRAWN = ("traced radii, along the axis", "the paper's distances")
SHOWN = {
    "pupil_mm": ("pupil", "mm"),
    "f_number": ("F-number", ""),
    "blur_px": ("blur circle", "px"),
    "total_px": ("blur and diffraction", "px"),
    "light": ("light left", ""),
}


# What is drawn: radii, point of the capture sphere, fan, label, mark.
IMAGES = (
    ("traced", 0, 0, "traced radii: nearest point, tangential", "C0."),
    ("traced", 1, 0, "centre, tangential", "C2."),
    ("traced", 1, 1, "centre, sagittal", "C4."),
    ("traced", 2, 1, "farthest point, sagittal", "C1."),
    ("flat", 1, 0, "flat mirrors: centre", "k."),
)
FARTHEST_STOP = 8  # of the plot, in F-numbers of the lens wide open


@dataclass(frozen=True)
class LensOptions:
    """What the user may say of the lens.

    Attributes:
        blur_px: largest blur circle allowed.
        pixel_um: width of a pixel, micrometres.
        wide_open: F-number of the lens fully open.
    """

    blur_px: float = 1.0
    pixel_um: float = 3.45
    wide_open: float = 2.8

    def checked(self) -> "LensOptions":
        """These, when all are above 0 to 1000.

        Raises:
            InputError: one is not.
        """
        for option, value in vars(self).items():
            if not 0 < value <= 1000:
                name = "--" + option.replace("_", "-")
                raise InputError(f"{name} {value:g}: allowed is above 0 to 1000: change it")
        return self


def depth_of_field(spec: Spec, optics: LensOptions, progress: Progress = lambda _: None) -> Study:
    """The study: where the images are by all radius rules, and the stops for them."""
    radius, lens = spec.optics.capture_diameter_mm / 2, _lens(spec, optics.checked())
    found: dict[str, tuple[MirrorArray, VirtualImages]] = {}
    reasons = []
    for rule in RULES:
        progress(f"radii by rule {rule}")
        tried = try_design(spec_with(spec, rule=rule))
        if tried.made is None:
            reasons.append(f"No figures of {rule} radii: {tried.reason}")
            continue
        half = tried.made.halves[0]
        found[rule] = (half, virtual_images(half, radius))
    rows = tuple(row for rule, (half, at) in found.items() for row in _rows(rule, half, at))
    mirrors = Table("depth-of-field", COLUMNS, rows, (*NOTES, *reasons))
    stopped = Table("depth-of-field-stops", STOPS, _stop_rows(found, lens, optics), LENS_NOTES)
    summary = Table("depth-of-field-summary", SUMMARY, _summary(found, stopped))
    return Study("depth-of-field", summary, (mirrors, stopped), _panels(found, lens))


def _lens(spec: Spec, optics: LensOptions) -> Lens:
    camera, pixel = spec.camera, optics.pixel_um / 1000
    return lens_for(np.radians(camera.hfov_deg), camera.width_px, pixel, optics.wide_open)


def _rows(rule: str, half: MirrorArray, at: VirtualImages) -> list[tuple[Cell, ...]]:
    numbers = np.column_stack(
        [
            np.degrees(half.polar),
            half.mirrors.radius,
            np.degrees(at.incidence),
            at.to_mirror,
            at.distance.reshape(len(half), -1),
            at.depth.reshape(len(half), -1),
        ]
    )
    values = [[None if np.isnan(x) else x for x in row] for row in numbers.tolist()]
    return [(name, rule, *row) for name, row in zip(half.ids, values, strict=True)]


def span(values: Floats) -> DepthRange:
    """From the least to the largest of some depths."""
    return DepthRange(float(values.min()), float(values.max()))


def _ranges(found: dict[str, tuple[MirrorArray, VirtualImages]]) -> dict[str, DepthRange]:
    ranges = {f"{rule} radii, along the axis": span(at.depth) for rule, (_, at) in found.items()}
    ranges |= {f"{rule} radii, distances": span(at.distance) for rule, (_, at) in found.items()}
    paper = DepthRange(claimed("depth_near"), claimed("depth_far"))
    return ranges | {"the paper's distances": paper}


def _stop_rows(
    found: dict[str, tuple[MirrorArray, VirtualImages]], lens: Lens, optics: LensOptions
) -> tuple[tuple[Cell, ...], ...]:
    rows: list[tuple[Cell, ...]] = []
    for name, over in _ranges(found).items():
        head = (name, over.near, over.far, over.focus, focal_length(lens, over))
        for kind, at in aperture_stops(lens, over, optics.blur_px).items():
            figures = (at.pupil, at.f_number, at.blur_px, at.airy_px, at.total_px)
            rows.append((*head, kind, *figures, at.light, at.stops_lost))
    return tuple(rows)


def _summary(
    found: dict[str, tuple[MirrorArray, VirtualImages]], stopped: Table
) -> tuple[tuple[Cell, ...], ...]:
    near, far = claims()["depth_near"], claims()["depth_far"]
    rows: list[tuple[Cell, ...]] = []
    for rule, (_, at) in found.items():
        over = span(at.distance)
        rows += [
            (f"camera to nearest image, {rule} radii", "mm", over.near, near.value, near.where),
            (f"camera to farthest image, {rule} radii", "mm", over.far, far.value, far.where),
        ]
    for row in stopped.rows:
        cells = dict(zip(stopped.columns, row, strict=True))
        if cells["range"] in DRAWN and cells["stop"] != "wide open":
            name = f"{cells['stop']}, {cells['range']}"
            rows += [
                (f"{name}: {text}", unit, cells[column], None, near.where)
                for column, (text, unit) in SHOWN.items()
            ]
    return tuple(rows)


def _panels(found: dict[str, tuple[MirrorArray, VirtualImages]], lens: Lens) -> tuple[Panel, ...]:
    series = [
        Series(
            label, np.degrees(found[rule][0].polar), found[rule][1].distance[:, place, fan], mark
        )
        for rule, place, fan, label, mark in IMAGES
        if rule in found
    ]
    polar = np.concatenate([half.polar for half, _ in found.values()] or [np.zeros(1)])
    ends = np.degrees([polar.min(), polar.max()])
    for key, style in (("depth_near", "r--"), ("depth_far", "r-.")):
        series.append(
            Series(f"the paper: {claimed(key):g} mm", ends, np.full(2, claimed(key)), style)
        )
    what = (
        "Virtual images of the capture sphere",
        "polar angle about w, deg",
        "from the camera, mm",
    )
    return Panel(*what, tuple(series)), _blur_panel(found, lens)


def _blur_panel(found: dict[str, tuple[MirrorArray, VirtualImages]], lens: Lens) -> Panel:
    series: list[Series] = []
    ranges = {name: over for name, over in _ranges(found).items() if name in DRAWN}
    for k, (name, over) in enumerate(ranges.items()):
        numbers = np.linspace(lens.wide_open, FARTHEST_STOP * lens.wide_open, 60)
        at = [aperture_stop(lens, over, focal_length(lens, over) / f) for f in numbers]
        blur, total = (
            np.array(x) for x in zip(*((s.blur_px, s.total_px) for s in at), strict=True)
        )
        series += [
            Series(f"blur circle, {name}", numbers, blur, f"C{k}--"),
            Series(f"with diffraction, {name}", numbers, total, f"C{k}-"),
        ]
    return Panel("Blur at the ends of the range", "F-number", "pixels", tuple(series))
