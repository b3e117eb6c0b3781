"""Which balance of virtual cameras and pixels is best for which object (section 6).

A ball about the origin is seen at a distance of its radius from the reference plane, which goes
through the origin; a matt surface sends the same light in all directions, a glossy one does not.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.camera_photographs import design_light_field
from tbcad.light.simulate.capture.photograph import Sensor, count_pixels, virtual_cameras
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.real_scene import scene_by
from tbcad.light.simulate.views.viewpoints import (
    ViewMethod,
    ViewTargets,
    image_quality_map,
    pinhole_targets,
    viewpoints_over_hemisphere,
)
from tbcad.options.captures import Optics
from tbcad.studies.paper import notes, try_design, with_lens_of_table_i
from tbcad.types import Progress

SUBDIVISIONS = (6, 9, 12, 15, 18, 22, 27, 33)
NEAR, FAR = 0.3, 0.98  # radius of the ball, in that of the capture sphere
GLOSS = 1.0  # highlights as bright as the lamps
BEST_COLUMNS = (
    *("surface", "radius_mm", "n", "virtual_cameras", "pixels", "cameras_per_pixel"),
    "ssim_on_object",
)
COLUMNS = ("n", "virtual_cameras", "pixels", "surface", "radius_mm", "ssim_on_object", "reason")


@dataclass(frozen=True)
class Subject:
    """One object with its truth."""

    surface: str  # "matt" or "glossy"
    radius_mm: float  # of the ball
    seen: ViewTargets  # from each viewpoint

    @property
    def name(self) -> str:
        """For legends."""
        return f"{self.surface}, {self.radius_mm:g} mm from the reference plane"


def balance(
    spec: Spec,
    ns: tuple[int, ...],
    views: int,
    distance_mm: float,
    method: ViewMethod,
    progress: Progress = lambda _: None,
    optics: Optics = "ideal",
) -> Study:
    """The study: SSIM of views over n at the design's sensor, for four objects."""
    spec = with_lens_of_table_i(spec)
    viewpoints = viewpoints_over_hemisphere(views, distance_mm)
    cameras = viewpoints.cameras(spec.optics.capture_diameter_mm)
    seen = subjects(spec.optics.capture_diameter_mm, cameras, progress, optics)
    records = [one for n in ns for one in _of_n(spec, n, seen, method, progress, optics)]
    facts = f"Method: {method}; {optics} optics."
    table = Table.of_records("balance", records, (facts, *notes("balance")), COLUMNS)
    best = [one for subject in seen for one in _best(table, subject)]
    panels = (_panel(table, seen, method),)
    figures = (Figure(f"{one['object']}: best n", "", one["n"], where="section 6") for one in best)
    bests = Table.of_records("balance-best", best, columns=BEST_COLUMNS)
    return Study("balance", tuple(figures), (table, bests), panels)


def subjects(
    capture_mm: float, cameras: list[Camera], progress: Progress, optics: Optics = "ideal"
) -> list[Subject]:
    """The four objects with their truth."""
    result = []
    for share in (NEAR, FAR):
        radius = round(share * capture_mm / 2, 2)
        matt = scene_by(optics, patterned_ball(radius))
        for surface, scene in (("matt", matt), ("glossy", replace(matt, gloss=GLOSS))):
            result.append(Subject(surface, radius, pinhole_targets(scene, cameras, progress)))
    return result


def _of_n(
    spec: Spec,
    n: int,
    seen: list[Subject],
    method: ViewMethod,
    progress: Progress,
    optics: Optics,
) -> list[Record]:
    """A row for each object, or for what a refusal of the design says."""
    attempt = try_design(spec, optics={"n": n})
    head: Record = {**dict.fromkeys(COLUMNS), "n": n, "reason": attempt.reason}
    if attempt.design is None:
        return [head]
    head |= _counts(attempt.design)
    rows: list[Record] = []
    for one in seen:
        progress(f"n = {n}: {one.name}")
        value = ssim_on_object(attempt.design, one.seen, method, optics)
        own: Record = {"surface": one.surface, "radius_mm": one.radius_mm, "ssim_on_object": value}
        rows.append({**head, **own})
    return rows


def _counts(design: MirrorDesign) -> Record:
    array, camera = design.arrays[0], design.spec.camera
    sensor = Sensor(camera.width_px, camera.height_px)
    counts = count_pixels(array, sensor, design.spec.optics.capture_diameter_mm / 2)
    number = virtual_cameras(array)
    return {"virtual_cameras": number, "pixels": float(2 * counts.seen.sum() / number)}


def ssim_on_object(
    design: MirrorDesign, seen: ViewTargets, method: ViewMethod, optics: Optics = "ideal"
) -> float:
    """Mean local SSIM where the object is, over all views."""
    view = method.views(design_light_field(design, seen.scene, optics))
    values = [
        image_quality_map(truth, view(at))[1][mask].mean()
        for at, truth, mask in zip(seen.cameras, seen.truths, seen.masks, strict=True)
    ]
    return float(np.mean(values))


def _rows(table: Table, subject: Subject) -> Table:
    return table.where(surface=subject.surface, radius_mm=subject.radius_mm)


def _best(table: Table, subject: Subject) -> list[Record]:
    """The row with the highest SSIM, with the ratio of virtual cameras to pixels."""
    rows = _rows(table, subject).records()
    if not rows:
        return []
    best = max(rows, key=lambda row: float(row["ssim_on_object"] or 0))
    ratio = float(best["virtual_cameras"] or 0) / float(best["pixels"] or 1)
    return [{**best, "cameras_per_pixel": ratio, "object": subject.name}]


def _panel(table: Table, seen: list[Subject], method: ViewMethod) -> PlotPanel:
    styles = ("C0o-", "C0s--", "C1o-", "C1s--")
    series = []
    for subject, style in zip(seen, styles, strict=True):
        rows = _rows(table, subject)
        ratio = rows.numbers("virtual_cameras") / rows.numbers("pixels")
        series.append(Series(subject.name, ratio, rows.numbers("ssim_on_object"), style))
    label = "virtual cameras per pixel of a virtual camera"
    return PlotPanel(f"Views by method {method}", label, "SSIM on the object", tuple(series), "x")
