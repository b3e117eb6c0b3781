"""How like the truth views are, sensor by sensor, each with its own n (Fig. 9)."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import linregress

from tbcad.simulate.capture.light_field import NAME, LightField, create_light_field, write_camera
from tbcad.simulate.capture.photograph import photograph
from tbcad.simulate.scene.object import SceneObject
from tbcad.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.simulate.scene.rays import exact_tracer
from tbcad.simulate.scene.reflector import reflectors
from tbcad.simulate.study.pixels import Sensor
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.sweep import spec_with, try_design
from tbcad.simulate.study.tables import SUMMARY, Cell, Table
from tbcad.simulate.study.viewpoints import Viewpoints, ground_truths, view_quality
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method
from tbcad.spec.design import Spec
from tbcad.types import Bytes, Floats, Progress

COLUMNS = (
    *("width_px", "height_px", "n", "elevation_deg", "azimuth_deg"),
    *("psnr_db", "ssim", "reason"),
)
MEANS = ("width_px", "height_px", "n", "elevation_deg", "views", "psnr_db", "ssim", "ssim_sd")
FITS = ("elevation_deg", "sensors", "slope", "intercept", "r2")
WHERE = "Fig. 9"
NOTES = (
    "SSIM and PSNR of views of 640 x 480 pixels, over the whole frame, against ray-traced "
    "pictures of the same object (4 x 4 rays a pixel).",
    "Each sensor has its own n: that of the design times the fourth root of how many times the "
    "pixels it has, rounded, which keeps virtual cameras and pixels of one in proportion. Which n "
    "the paper took is not known to us; it sweeps n to 36, which is what its largest sensor gets.",
    "Only the paper's first and last sensor, 2080 x 1552 and 8320 x 6208, are known to us; that "
    "the two between are twice and three times the first is our assumption (--sensor).",
    "Fit: least squares of the mean SSIM over log10 of a sensor's pixels; r2 is the square of the "
    "correlation. The paper's slope and R^2 are not known to us.",
)


@dataclass(frozen=True)
class SensorCase:
    """A sensor and the subdivision that goes with it."""

    sensor: Sensor
    n: int


def sensor_cases(spec: Spec, sensors: tuple[Sensor, ...]) -> tuple[SensorCase, ...]:
    """Sensors with their own n: mirrors grow with n^2, and are to grow with the pixels' root."""
    camera = spec.camera
    one = camera.width_px * camera.height_px

    def own(sensor: Sensor) -> int:
        times = float(sensor.width_px * sensor.height_px / one)
        return max(1, round(spec.optics.n * float(times**0.25)))

    return tuple(SensorCase(sensor, own(sensor)) for sensor in sensors)


def ssim(
    spec: Spec,
    subject: SceneObject,
    sensors: tuple[Sensor, ...],
    places: Viewpoints,
    method: Method,
    progress: Progress = lambda _: None,
) -> Study:
    """The study: captures with every sensor, and views of each against the truth.

    Args:
        spec: the design; sensor and n are varied.
        subject: the object.
        sensors: in place of the design's.
        places: viewpoints.
        method: how views are made.
        progress: told how far it has come.
    """
    scene, views = prepared_scene(subject), places.views(spec.optics.capture_diameter_mm)
    pictures = ground_truths(scene, views, progress)
    rows: list[tuple[Cell, ...]] = []
    for case in sensor_cases(spec, sensors):
        rows += _rows(spec, case, scene, (places, pictures), method, progress)
    table = Table("ssim", COLUMNS, tuple(rows), (f"Object: {subject.name}; {method}.", *NOTES))
    means = Table("ssim-means", MEANS, _means(table, sensors))
    fits = Table("ssim-fits", FITS, _fits(means))
    summary = Table("ssim-summary", SUMMARY, _summary(means, fits))
    return Study("ssim", summary, (table, means, fits), (_panel(means, fits),))


def _rows(
    spec: Spec,
    case: SensorCase,
    scene: Scene,
    wanted: tuple[Viewpoints, list[Bytes]],
    method: Method,
    progress: Progress,
) -> list[tuple[Cell, ...]]:
    places, pictures = wanted
    head = (case.sensor.width_px, case.sensor.height_px, case.n)
    keys = {"width_px": case.sensor.width_px, "height_px": case.sensor.height_px}
    tried = try_design(
        spec_with(spec, n=case.n).model_copy(update={"camera": spec.camera.model_copy(update=keys)})
    )
    angles = zip(places.elevation_deg.tolist(), places.azimuth_deg.tolist(), strict=True)
    if tried.made is None:
        return [(*head, *angle, None, None, tried.reason) for angle in angles]
    views = places.views(spec.optics.capture_diameter_mm)
    # A light field of the largest sensor is larger than memory should be: it goes to a file.
    with tempfile.TemporaryDirectory(prefix="tbcad-study-") as folder:
        file = Path(folder) / NAME
        with create_light_field(file, spec.optics.capture_diameter_mm, {}) as store:
            for at in reflectors(tried.made):
                write_camera(store, at, photograph(at.camera, exact_tracer(at), scene, 1, progress))
        with LightField.open(file) as source:
            found = view_quality(MirrorTiles(source), scene, views, pictures, method, progress)
    return [(*head, *angle, *pair, "") for angle, pair in zip(angles, found.tolist(), strict=True)]


def _means(table: Table, sensors: tuple[Sensor, ...]) -> tuple[tuple[Cell, ...], ...]:
    """Means over azimuths, for each sensor and elevation, and over all its views."""
    columns = ("width_px", "height_px", "n", "elevation_deg", "psnr_db", "ssim")
    width, height, n, elevation, psnr, alike = (np.array(table.numbers(k)) for k in columns)
    rows = []
    for sensor in sensors:
        mine = (width == sensor.width_px) & (height == sensor.height_px) & np.isfinite(alike)
        if not mine.any():
            continue
        groups: list[tuple[Cell, NDArray[np.bool_]]] = [
            (float(e), mine & (elevation == e)) for e in np.unique(elevation[mine])
        ]
        for name, group in [*groups, ("all", mine)]:
            spread = float(np.std(alike[group], ddof=1)) if group.sum() > 1 else None
            head = (sensor.width_px, sensor.height_px, int(n[mine][0]), name)
            values = (float(psnr[group].mean()), float(alike[group].mean()))
            rows.append((*head, int(group.sum()), *values, spread))
    return tuple(rows)


def _of(means: Table, elevation: Cell) -> tuple[Floats, Floats]:
    """log10 of the sensors' pixels and mean SSIM at an elevation."""
    mine = np.array([cell == elevation for cell in means.column("elevation_deg")])
    pixels = np.array(means.numbers("width_px")) * np.array(means.numbers("height_px"))
    return np.log10(pixels[mine]), np.array(means.numbers("ssim"))[mine]


def _fits(means: Table) -> tuple[tuple[Cell, ...], ...]:
    rows: list[tuple[Cell, ...]] = []
    for elevation in dict.fromkeys(means.column("elevation_deg")):
        x, y = _of(means, elevation)
        if len(np.unique(x)) < 2:
            continue
        fit = linregress(x, y)
        # Through two points there is always a line.
        r2 = float(fit.rvalue**2) if len(x) > 2 else None
        rows.append((elevation, len(x), float(fit.slope), float(fit.intercept), r2))
    return tuple(rows)


def _summary(means: Table, fits: Table) -> tuple[tuple[Cell, ...], ...]:
    rows: list[tuple[Cell, ...]] = []
    for width, height, n, elevation, _, psnr, alike, _ in means.rows:
        if elevation == "all":
            name = f"{width}x{height}, n = {n}: mean"
            rows.append((f"{name} SSIM", "", alike, None, WHERE))
            rows.append((f"{name} PSNR", "dB", psnr, None, WHERE))
    for elevation, _, slope, _, r2 in fits.rows:
        if elevation == "all":
            rows.append(("SSIM for ten times the pixels", "", slope, None, WHERE))
            rows.append(("R^2 of SSIM over log pixels", "", r2, None, WHERE))
    return tuple(rows)


def _panel(means: Table, fits: Table) -> Panel:
    series = []
    for k, elevation in enumerate(dict.fromkeys(means.column("elevation_deg"))):
        x, y = _of(means, elevation)
        name = "all" if elevation == "all" else f"{elevation:g} deg"
        style = "ko" if elevation == "all" else f"C{k}.:"
        series.append(Series(name, 10**x / 1e6, y, style))
    for elevation, _, slope, intercept, r2 in fits.rows:
        if elevation == "all":
            x, _ = _of(means, "all")
            label = "fit" if r2 is None else f"fit, R^2 = {r2:.3f}"
            line = float(slope or 0) * x + float(intercept or 0)
            series.append(Series(label, 10**x / 1e6, line, "k-"))
    return Panel("Views against the truth", "megapixels", "SSIM", tuple(series), logarithmic="x")
