"""Views from the prototype's merged pictures against those of the full shell."""

from dataclasses import replace

import numpy as np
from scipy.stats import ttest_rel

from tbcad.common.results import Figure, PlotPanel, Series, Study, Table
from tbcad.light.simulate.camera_photographs import photographed
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.viewpoints import (
    StudyMethod,
    Viewpoints,
    ground_truths,
    view_quality,
)
from tbcad.options.captures import Geometry
from tbcad.studies.paper import notes
from tbcad.types import Floats, Progress

LEVEL = 0.95
WHERE = "section 5.1"


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
    method: StudyMethod,
    samples: int = 3,
    progress: Progress = lambda _: None,
) -> Study:
    """The study: both light fields of one object, and the same views of both.

    A pixel of a photograph is the mean of samples x samples rays. InputError: there is no prototype
    in the export.
    """
    scene, views = prepared_scene(subject), viewpoints.cameras(export.capture_mm)
    truths = ground_truths(scene, views, progress)
    kinds: tuple[Geometry, ...] = ("spheres", "prototype")
    light_fields = (photographed(export, scene, kind, samples, progress) for kind in kinds)
    shell, prototype = (
        view_quality(MirrorTiles(one), scene, views, truths, method, progress)
        for one in light_fields
    )
    facts = f"Object: {subject.name}; {method}; {samples} x {samples} rays a pixel."
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
    return Study("prototype", _figures(table), (table,), _panels(table))


def _figures(table: Table) -> tuple[Figure, ...]:
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
    return tuple(replace(figure, where=WHERE) for figure in figures)


def _panels(table: Table) -> tuple[PlotPanel, ...]:
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
