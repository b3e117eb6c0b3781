"""Views with the prototype, blurred by an optical low-pass filter (section 5.3, Fig. 11)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.camera_photographs import photographed
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import Samples, subpixel_shifts, to_bytes
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import Shift
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import (
    ThinLens,
    disc_points,
    lens_picture,
    pixel_points,
    refocus,
)
from tbcad.light.simulate.views.viewpoints import (
    BY_NEAREST,
    Viewpoints,
    ViewTargets,
    pinhole_targets,
)
from tbcad.options.captures import Geometry
from tbcad.studies.paper import claimed, notes
from tbcad.types import Bytes, Progress

WHERE = "section 5.3, Fig. 11"
NO_FILTER = "none"
SHELL, PROTOTYPE = "shell", "prototype"
ELEVATIONS_DEG = (15.0, 45.0)
LENS_SIZE = (320, 240)  # pixels of the pictures with the large aperture
TRUTH_RAYS = 64  # a pixel of their ground truth
LENS_RAYS = 9  # over the blur circle, times samples x samples


@dataclass(frozen=True)
class Blur:
    """What blurs the photographs of one case."""

    geometry: str  # of the mirrors
    name: str  # none, filter or lens
    px: float  # separation or diameter, pixels
    samples: Samples  # rays of a pixel


@dataclass(frozen=True)
class BlurOptions:
    """The blurs that are tried, pixels."""

    separations_px: tuple[float, ...] = (0.75, 1.0, 2.0)  # of the low-pass filter's images
    lens_px: tuple[float, ...] = (2.4,)  # diameters of the lens's blur circle
    # a pixel, in each of the filter's images, is the mean of samples x samples rays
    samples: int = 2

    def cases(self) -> list[Blur]:
        """Shell and prototype without blur, and the prototype with each."""
        n, rays = self.samples, LENS_RAYS * self.samples**2
        return [
            Blur(SHELL, NO_FILTER, 0.0, n),
            Blur(PROTOTYPE, NO_FILTER, 0.0, n),
            *(Blur(PROTOTYPE, "filter", px, low_pass_shifts(px, n)) for px in self.separations_px),
            *(Blur(PROTOTYPE, "lens", px, defocus_shifts(px, rays)) for px in self.lens_px),
        ]


def low_pass(
    export: ExportedDesign,
    subject: SceneObject,
    viewpoints: Viewpoints,
    options: BlurOptions,
    progress: Progress = lambda _: None,
) -> Study:
    """The study: captures with each blur, and views of each against the truth.

    The distance of the viewpoints is that of the pinholes. InputError: the export has no prototype.
    """
    scene, focus = prepared_scene(subject), ThinLens(claimed("prototype_aperture"), 0.0)
    near = replace(viewpoints, distance_mm=claimed("prototype_distance"))
    lenses = _lens_targets(scene, near.cameras(export.capture_mm, LENS_SIZE), focus, progress)
    pinholes = pinhole_targets(scene, viewpoints.cameras(export.capture_mm), progress)
    records: list[Record] = []
    sharpest: dict[str, float] = {}
    for case in options.cases():
        geometry: Geometry = "prototype" if case.geometry == PROTOTYPE else "spheres"
        light_field = photographed(export, scene, geometry, case.samples, progress)
        contrast = _contrast(light_field)
        relative = contrast / sharpest.setdefault(case.geometry, contrast)
        head: Record = {"geometry": case.geometry, "blur": case.name, "px": case.px}
        views = {
            "pinhole": pinholes.quality(BY_NEAREST.views(light_field), progress),
            "aperture": lenses.quality(_refocused(light_field, focus), progress),
        }
        for kind, quality in views.items():
            for row in Table.of_columns("", {**viewpoints.angles(), **quality}).records():
                records.append({**head, "view": kind, **row, "photograph_contrast": relative})
    table = Table.of_records("low-pass", records, (f"Object: {subject.name}.", *notes("low-pass")))
    means = Table.of_records("low-pass-means", _means(table))
    return Study("low-pass", _figures(means), (table, means), _panels(means))


def _lens_targets(
    scene: Scene, cameras: list[Camera], focus: ThinLens, progress: Progress
) -> ViewTargets:
    truths = []
    for k, view in enumerate(cameras):
        progress(f"truth of the aperture {k + 1} of {len(cameras)}")
        truths.append(to_bytes(lens_picture(scene, view, focus, TRUTH_RAYS)))
    return ViewTargets(scene, cameras, truths)


def _refocused(light_field: LightField, focus: ThinLens) -> Callable[[Camera], Bytes]:
    tiles = MirrorTiles(light_field)
    return lambda view: refocus(tiles, view, focus).image


def _contrast(light_field: LightField) -> float:
    """Root mean square difference of neighbouring pixels in a row that belong to one mirror."""
    squares = []
    for frame in light_field.frames.values():
        mirror, colour = frame.planes["mirror"][:], frame.planes["colour"][:].astype(np.float32)
        same = (mirror[:, 1:] == mirror[:, :-1]) & (mirror[:, 1:] > 0)
        squares.append(np.mean((colour[:, 1:] - colour[:, :-1])[same] ** 2))
    return float(np.sqrt(np.mean(squares)))


def _means(table: Table) -> list[Record]:
    keys = dict.fromkeys(row[:4] for row in table.rows)
    records: list[Record] = []
    for key in keys:
        head: Record = dict(zip(table.columns[:4], key, strict=True))
        rows = table.where(**head)
        names = ("psnr_db", "ssim", "ssim_on_object", "blur_mm", "photograph_contrast")
        means = {name: float(rows.numbers(name).mean()) for name in names}
        records.append({**head, "views": len(rows.rows), **means})
    return records


def _name(record: Record) -> str:
    blur = "no blur" if record["blur"] == NO_FILTER else f"{record['blur']} {record['px']:g} px"
    return f"{record['geometry']}, {blur}"


def _figures(means: Table) -> tuple[Figure, ...]:
    units = {"ssim": ("mean SSIM", ""), "blur_mm": ("mean blur", "mm")}
    figures = [
        Figure(f"{_name(record)}: {name}, {record['view']}", unit, record[key], where=WHERE)
        for record in means.records()
        for key, (name, unit) in units.items()
    ]
    for record in means.where(view="pinhole").records():
        name = f"{_name(record)}: contrast of the photographs"
        figures.append(Figure(name, "", record["photograph_contrast"], where=WHERE))
    return tuple(figures)


def _panels(means: Table) -> tuple[PlotPanel, ...]:
    names = tuple(_name(record) for record in means.where(view="pinhole").records())
    place = np.arange(len(names), dtype=np.float64)

    def panel(column: str, title: str, unit: str) -> PlotPanel:
        pinhole, aperture = (
            means.where(view=view).numbers(column) for view in ("pinhole", "aperture")
        )
        bars = (
            Series("pinhole at --distance", pinhole, place, "C0o"),
            Series("aperture of 80 mm at 160 mm", aperture, place, "C1s"),
        )
        return PlotPanel(title, unit, "", bars, names=names)

    return (
        panel("ssim", "Similarity of views to the truth", "mean SSIM"),
        panel("blur_mm", "Blur of views", "mean standard deviation at the object, mm"),
    )


def low_pass_shifts(separation_px: float, samples: int) -> tuple[Shift, ...]:
    """Rays of a pixel behind a birefringent low-pass filter: samples x samples for each image.

    Two crossed plates split every point into four, at the corners of a square of this side. Along
    rows and columns f cycles a pixel pass by |cos(pi separation f)|, and 1 / (2 separation) not at
    all (J. E. Greivenkamp, Applied Optics 29, 676, 1990).
    """
    ends = (-separation_px / 2, separation_px / 2)
    images = product(subpixel_shifts(samples), ends, ends)
    return tuple((x + column, y + row) for (x, y), row, column in images)


def defocus_shifts(diameter_px: float, count: int) -> tuple[Shift, ...]:
    """Rays of a pixel out of focus: points of an even blur circle and of the pixel."""
    circle = (disc_points(count) * diameter_px / 2).tolist()
    pairs = zip(circle, pixel_points(count), strict=True)
    return tuple((x + column, y + row) for (x, y), (column, row) in pairs)
