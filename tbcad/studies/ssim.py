"""How like the truth views are: by sensor, each with its own n (Fig. 9), and of the prototype."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from scipy.stats import linregress, ttest_rel

from tbcad.common.results import Cell, Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.camera_photographs import photographed, sphere_photographs
from tbcad.light.simulate.capture.files import create_light_field, write_camera
from tbcad.light.simulate.capture.light_field import NAME, LightField
from tbcad.light.simulate.capture.photograph import Samples, Sensor
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.real_camera import design_optics, real_optics
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.real_scene import scene_by
from tbcad.light.simulate.scene.reflector import ExportedDesign, reflectors
from tbcad.light.simulate.views.viewpoints import (
    QUALITY,
    ViewMethod,
    Viewpoints,
    ViewTargets,
    pinhole_targets,
)
from tbcad.options.captures import Geometry, Optics
from tbcad.prototype.balls.catalogue import recorded_roughness_nm
from tbcad.studies.paper import (
    balanced_sensors,
    claims,
    megapixels,
    notes,
    try_design,
    with_lens_of_table_i,
)
from tbcad.types import Floats, Progress

MEANS = ("width_px", "height_px", "n", "elevation_deg", "views", *QUALITY, "ssim_sd")
FITS = ("elevation_deg", "sensors", "slope", "intercept", "r2")
ALL = "all"  # in the place of an elevation: views at all of them
WHERE = "section 4.4, Fig. 9"


def sensor_n(spec: Spec, sensor: Sensor) -> int:
    """A sensor's n: that of Table II where the design is in it, else one in proportion."""
    paper = {(row.width_px, row.height_px): row.n for row in balanced_sensors()}
    if paper.get((spec.camera.width_px, spec.camera.height_px)) == spec.optics.n:
        return paper.get((sensor.width_px, sensor.height_px), proportionate_n(spec, sensor))
    return proportionate_n(spec, sensor)


def proportionate_n(spec: Spec, sensor: Sensor) -> int:
    """Mirrors grow with n^2, and are to grow with the square root of the pixels."""
    pixels = spec.camera.width_px * spec.camera.height_px
    factor = float((sensor.width_px * sensor.height_px / pixels) ** 0.25)
    return max(1, round(spec.optics.n * factor))


def ssim(
    spec: Spec,
    subject: SceneObject,
    sensors: tuple[Sensor, ...],
    viewpoints: Viewpoints,
    method: ViewMethod,
    progress: Progress = lambda _: None,
    optics: Optics = "ideal",
) -> Study:
    """The study: captures with every sensor and its n, and views of each against the truth."""
    spec, scene = with_lens_of_table_i(spec), scene_by(optics, subject)
    cameras = viewpoints.cameras(spec.optics.capture_diameter_mm)
    targets = pinhole_targets(scene, cameras, progress)
    records: list[Record] = []
    for sensor in sensors:
        head, quality, reason = _compared(spec, targets, method, progress, sensor, optics)
        views = Table.of_columns("", {**viewpoints.angles(), **quality})
        records += [{**head, **view, "reason": reason} for view in views.records()]
    facts = f"Object: {subject.name}; {method}; {optics} optics."
    table = Table.of_records("ssim", records, (facts, *notes("ssim")))
    means = Table.of_records(
        "ssim-means", [mean for sensor in sensors for mean in _means(table, sensor)], columns=MEANS
    )
    fits = Table.of_records("ssim-fits", _fits(means), columns=FITS)
    panels = (_ssim_panel(means, fits), *_elevation_panels(means))
    return Study("ssim", tuple(_figures(means, fits)), (table, means, fits), panels)


def _compared(
    spec: Spec,
    targets: ViewTargets,
    method: ViewMethod,
    progress: Progress,
    sensor: Sensor,
    optics: Optics,
) -> tuple[Record, dict[str, Floats], str]:
    """One sensor with its n, QUALITY of its views, and what a refusal of its design says."""
    head: Record = {**asdict(sensor), "n": sensor_n(spec, sensor)}
    attempt = try_design(spec, optics={"n": head["n"]}, camera=asdict(sensor))
    if attempt.design is None:
        return head, dict.fromkeys(QUALITY, np.full(len(targets.cameras), np.nan)), attempt.reason
    with _light_field(attempt.design, targets.scene, optics, progress) as light_field:
        return head, targets.quality(method.views(light_field), progress), attempt.reason


@contextmanager
def _light_field(
    design: MirrorDesign, scene: Scene, optics: Optics, progress: Progress
) -> Iterator[LightField]:
    """The light field of a design in a file: of the largest sensor it would fill the memory."""
    with tempfile.TemporaryDirectory(prefix="tbcad-study-") as folder:
        file = Path(folder) / NAME
        with create_light_field(file, design.spec.optics.capture_diameter_mm, {}) as store:
            taken_by = design_optics(design) if optics == "real" else 1
            for one, bands in sphere_photographs(reflectors(design), scene, taken_by, progress):
                write_camera(store, one, bands())
        with LightField.open(file) as light_field:
            yield light_field


def _means(table: Table, sensor: Sensor) -> list[Record]:
    """Means over azimuths at each elevation, and over all views of a sensor."""
    views = table.where(**asdict(sensor), reason="")
    groups = {e: views.where(elevation_deg=e) for e in sorted(set(views.numbers("elevation_deg")))}
    return [_mean(name, group) for name, group in {**groups, ALL: views}.items() if group.rows]


def _mean(name: Cell, group: Table) -> Record:
    ssim = group.numbers("ssim")
    return {
        **{key: group.column(key)[0] for key in ("width_px", "height_px", "n")},
        "elevation_deg": name,
        "views": len(ssim),
        **{key: float(group.numbers(key).mean()) for key in QUALITY},
        "ssim_sd": float(np.std(ssim, ddof=1)) if len(ssim) > 1 else None,
    }


def _fits(means: Table) -> list[Record]:
    """Lines through the means of each elevation over the logarithm of the pixels."""
    fits: list[Record] = []
    for elevation in dict.fromkeys(means.column("elevation_deg")):
        rows = means.where(elevation_deg=elevation)
        x = np.log10(1e6 * megapixels(rows))
        if len(np.unique(x)) < 2:
            continue
        fit = linregress(x, rows.numbers("ssim"))
        line = (float(fit.slope), float(fit.intercept))
        # Through two points there is always a line.
        r2 = float(fit.rvalue**2) if len(x) > 2 else None
        fits.append(dict(zip(FITS, (elevation, len(x), *line, r2), strict=True)))
    return fits


def _figures(means: Table, fits: Table) -> Iterator[Figure]:
    for mean in means.where(elevation_deg=ALL).records():
        name = "{width_px}x{height_px}, n = {n}: mean".format(**mean)
        yield Figure(f"{name} SSIM", "", mean["ssim"], where=WHERE)
        yield Figure(f"{name} PSNR", "dB", mean["psnr_db"], where=WHERE)
        yield Figure(f"{name} blur", "mm", mean["blur_mm"], where=WHERE)
    for fit in fits.where(elevation_deg=ALL).records():
        yield Figure("SSIM for ten times the pixels", "", fit["slope"], where=WHERE)
        yield Figure("R^2 of SSIM over log pixels", "", fit["r2"], where=WHERE)
    for size, rows in _by_sensor(means).items():
        yield from _elevation_figures(size, rows)


def _by_sensor(means: Table) -> dict[str, Table]:
    """Means at each elevation, without those over all, by sensor."""
    sizes = dict.fromkeys(zip(means.column("width_px"), means.column("height_px"), strict=True))
    elevations = replace(means, rows=tuple(r for r in means.rows if ALL not in r))
    return {f"{w}x{h}": elevations.where(width_px=w, height_px=h) for w, h in sizes}


def _elevation_figures(size: str, rows: Table) -> Iterator[Figure]:
    """Where views are sharpest, most similar, and the object largest."""
    elevation, place = rows.numbers("elevation_deg"), claims()["sharpest_elevation"]
    best: dict[str, tuple[int, Cell]] = {
        "least blur": (int(rows.numbers("blur_mm").argmin()), place.value),
        "highest SSIM": (int(rows.numbers("ssim").argmax()), f"not {place.value:g}"),
        "highest SSIM on the object": (int(rows.numbers("ssim_on_object").argmax()), None),
        "largest image of the object": (int(rows.numbers("object_share").argmax()), place.value),
    }
    for name, (index, paper) in best.items():
        where = place.where if paper else ""
        yield Figure(
            f"{size}: elevation of the {name}", "deg", float(elevation[index]), paper, where
        )


def _ssim_panel(means: Table, fits: Table) -> PlotPanel:
    series = []
    for k, elevation in enumerate(dict.fromkeys(means.column("elevation_deg"))):
        rows = means.where(elevation_deg=elevation)
        name = "all elevations" if elevation == ALL else f"elevation {elevation:g} degrees"
        style = "ko" if elevation == ALL else f"C{k}.:"
        series.append(Series(name, megapixels(rows), rows.numbers("ssim"), style))
    x, fit = megapixels(means.where(elevation_deg=ALL)), fits.where(elevation_deg=ALL)
    for slope, intercept, r2 in np.column_stack([fit.numbers(key) for key in FITS[2:]]):
        label = "line" if np.isnan(r2) else f"line, R^2 = {r2:.3f}"
        series.append(Series(label, x, slope * np.log10(1e6 * x) + intercept, "k-"))
    title = "Similarity of views to the truth"
    return PlotPanel(title, "sensor, megapixels", "SSIM", tuple(series), logarithmic="x")


def _elevation_panels(means: Table) -> list[PlotPanel]:
    labels = {
        "blur_mm": ("Blur of views", "standard deviation at the object, mm"),
        "ssim_on_object": ("Similarity where the object is", "SSIM"),
    }
    panels = []
    for column, (title, unit) in labels.items():
        curves = (
            Series(size, rows.numbers("elevation_deg"), rows.numbers(column), f"C{k}.-")
            for k, (size, rows) in enumerate(_by_sensor(means).items())
        )
        panels.append(PlotPanel(title, "elevation, degrees", unit, tuple(curves)))
    return panels


LEVEL = 0.95
PROTOTYPE_WHERE = "section 5.1"


def mean_difference_interval(one: Floats, other: Floats) -> tuple[float, float]:
    """Interval of the mean of the other's values (v,) less the one's (Student's t, paired)."""
    if len(one) < 2:
        return -np.inf, np.inf
    interval = ttest_rel(other, one).confidence_interval(LEVEL)
    return float(interval.low), float(interval.high)


def prototype_vs_shell(
    export: ExportedDesign,
    subject: SceneObject,
    viewpoints: Viewpoints,
    method: ViewMethod,
    samples: int = 3,
    progress: Progress = lambda _: None,
    optics: Optics = "ideal",
) -> Study:
    """The study: both light fields of one object, and the same views of both.

    A pixel of an ideal photograph is the mean of samples x samples rays. InputError: there is no
    prototype in the export.
    """
    scene = scene_by(optics, subject)
    targets = pinhole_targets(scene, viewpoints.cameras(export.capture_mm), progress)
    kinds: tuple[Geometry, ...] = ("spheres", "prototype")
    takers = taken_by(export, optics, samples)
    light_fields = (photographed(export, scene, kind, takers[kind], progress) for kind in kinds)
    shell, prototype = (targets.quality(method.views(one), progress) for one in light_fields)
    rays = f"{samples} x {samples} rays a pixel" if optics == "ideal" else "real optics"
    facts = f"Object: {subject.name}; {method}; {rays}."
    columns = {
        **viewpoints.angles(),
        **{
            f"{name}_{key}": quality[key]
            for key in ("psnr_db", "ssim", "blur_mm")
            for name, quality in (("shell", shell), ("prototype", prototype))
        },
        "ssim_difference": prototype["ssim"] - shell["ssim"],
    }
    table = Table.of_columns("prototype", columns, (facts, *notes("prototype")))
    return Study("prototype", _prototype_figures(table), (table,), _prototype_panels(table))


def taken_by(
    export: ExportedDesign, optics: Optics, samples: Samples
) -> dict[Geometry, Samples | RealOptics]:
    """What takes the photographs of shell and prototype of an export."""
    if optics == "ideal":
        return {"spheres": samples, "prototype": samples}
    balls = real_optics(export, recorded_roughness_nm(export.folder))[0]
    return {"spheres": real_optics(export)[0], "prototype": balls}


def _prototype_figures(table: Table) -> tuple[Figure, ...]:
    mean = {name: float(table.numbers(name).mean()) for name in table.columns}
    low, high = mean_difference_interval(
        table.numbers("shell_ssim"), table.numbers("prototype_ssim")
    )
    verdict = "not significant" if low <= 0 <= high else "significant"
    spread = float(np.std(table.numbers("shell_ssim"), ddof=1)) if len(table.rows) > 1 else None
    figures = (
        Figure("mean SSIM of the shell's views", "", mean["shell_ssim"]),
        Figure("mean SSIM of the prototype's views", "", mean["prototype_ssim"]),
        Figure("difference", "", mean["ssim_difference"]),
        Figure("its interval at 95 %, low", "", low),
        Figure("its interval at 95 %, high", "", high),
        Figure("at 95 % the difference is", "", verdict, "no significant difference"),
        Figure("standard deviation of SSIM over the shell's views", "", spread),
        Figure("mean blur of the shell's views", "mm", mean["shell_blur_mm"]),
        Figure("mean blur of the prototype's views", "mm", mean["prototype_blur_mm"]),
        Figure("mean PSNR of the shell's views", "dB", mean["shell_psnr_db"]),
        Figure("mean PSNR of the prototype's views", "dB", mean["prototype_psnr_db"]),
    )
    return tuple(replace(figure, where=PROTOTYPE_WHERE) for figure in figures)


def _prototype_panels(table: Table) -> tuple[PlotPanel, ...]:
    elevation = table.numbers("elevation_deg")
    pairs = (
        Series("shell", elevation - 0.7, table.numbers("shell_ssim"), "C0."),
        Series("prototype", elevation + 0.7, table.numbers("prototype_ssim"), "C1."),
    )
    difference = Series("", elevation, table.numbers("ssim_difference"), "k.")
    return (
        PlotPanel("Views against the truth", "elevation, degrees", "SSIM", pairs),
        PlotPanel(
            "Prototype less shell", "elevation, degrees", "difference of SSIM", (difference,)
        ),
    )
