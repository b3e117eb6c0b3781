"""Views from the prototype's merged pictures against those of the full shell."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from tbcad.simulate.capture.geometry import Geometry, camera_photographs
from tbcad.simulate.capture.light_field import light_field_in_memory
from tbcad.simulate.scene.exported import Exported
from tbcad.simulate.scene.object import SceneObject
from tbcad.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.tables import SUMMARY, Cell, Table
from tbcad.simulate.study.viewpoints import Viewpoints, ground_truths, view_quality
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method
from tbcad.types import Floats, Progress

COLUMNS = (
    *("elevation_deg", "azimuth_deg", "shell_psnr_db", "prototype_psnr_db"),
    *("shell_ssim", "prototype_ssim", "ssim_difference"),
)
LEVEL = 0.95
WHERE = "section 5.3"
NOTES = (
    "Difference: the prototype's SSIM less the shell's, view by view against the same ray-traced "
    "truth. Interval: Student's t at 95 % over the views; neighbouring views share captured rays "
    "and are not wholly independent, so the true interval is somewhat wider.",
    "The prototype's picture is merged from photographs of every stop, as the machine takes them, "
    "both runs; the same number of rays a pixel for both.",
)


@dataclass(frozen=True)
class PairedDifference:
    """Paired differences of two series of views.

    Attributes:
        mean: of the differences.
        low: lower end of the interval of the mean.
        high: its upper end.
    """

    mean: float
    low: float
    high: float

    @property
    def significant(self) -> bool:
        """Whether the interval leaves zero out."""
        return self.low > 0 or self.high < 0


def paired_difference(one: Floats, other: Floats) -> PairedDifference:
    """The other's values (v,) less the one's, and the interval of their mean (Student's t)."""
    apart = other - one
    mean = float(apart.mean())
    if len(apart) < 2:
        return PairedDifference(mean, -np.inf, np.inf)
    error = float(apart.std(ddof=1) / np.sqrt(len(apart)))
    half = float(student.ppf((1 + LEVEL) / 2, len(apart) - 1)) * error
    return PairedDifference(mean, mean - half, mean + half)


def prototype_vs_shell(
    export: Exported,
    subject: SceneObject,
    places: Viewpoints,
    method: Method,
    samples: int = 3,
    progress: Progress = lambda _: None,
) -> Study:
    """The study: both light fields of one object, and the same views of both.

    Args:
        export: a design with its prototype.
        subject: the object.
        places: viewpoints.
        method: how views are made.
        samples: a pixel of a photograph is the mean of samples x samples rays.
        progress: told how far it has come.

    Raises:
        InputError: there is no prototype in the export.
    """
    scene, views = prepared_scene(subject), places.views(export.capture_mm)
    pictures = ground_truths(scene, views, progress)
    kinds: tuple[Geometry, ...] = ("spheres", "prototype")
    one, other = (
        view_quality(_tiles(export, scene, kind, samples, progress), scene, views, pictures, method,
               progress)
        for kind in kinds
    )  # fmt: skip
    angles = np.column_stack([places.elevation_deg, places.azimuth_deg])
    columns = np.column_stack([angles, one[:, 0], other[:, 0], one[:, 1], other[:, 1]])
    columns = np.column_stack([columns, other[:, 1] - one[:, 1]])
    facts = f"Object: {subject.name}; {method}; {samples} x {samples} rays a pixel."
    rows = tuple(tuple(row) for row in columns.tolist())
    table = Table("prototype", COLUMNS, rows, (facts, *NOTES))
    summary = Table("prototype-summary", SUMMARY, _summary(one, other))
    return Study("prototype", summary, (table,), _panels(places, one, other))


def _tiles(
    export: Exported, scene: Scene, kind: Geometry, samples: int, progress: Progress
) -> MirrorTiles:
    captured = {
        at.camera_id: (at, bands())
        for at, bands in camera_photographs(export, scene, kind, samples, progress)
    }
    return MirrorTiles(light_field_in_memory(captured, export.capture_mm))


def _summary(one: Floats, other: Floats) -> tuple[tuple[Cell, ...], ...]:
    apart = paired_difference(one[:, 1], other[:, 1])
    verdict = "significant" if apart.significant else "not significant"
    return (
        ("mean SSIM of the shell's views", "", float(one[:, 1].mean()), None, WHERE),
        ("mean SSIM of the prototype's views", "", float(other[:, 1].mean()), None, WHERE),
        ("difference", "", apart.mean, None, WHERE),
        ("its interval at 95 %, low", "", apart.low, None, WHERE),
        ("its interval at 95 %, high", "", apart.high, None, WHERE),
        ("at 95 % the difference is", "", verdict, "no significant difference", WHERE),
        ("mean PSNR of the shell's views", "dB", float(one[:, 0].mean()), None, WHERE),
        ("mean PSNR of the prototype's views", "dB", float(other[:, 0].mean()), None, WHERE),
    )


def _panels(places: Viewpoints, one: Floats, other: Floats) -> tuple[Panel, ...]:
    elevation = places.elevation_deg
    pairs = (
        Series("shell", elevation - 0.7, one[:, 1], "C0."),
        Series("prototype", elevation + 0.7, other[:, 1], "C1."),
    )
    apart = Series("", elevation, other[:, 1] - one[:, 1], "k.")
    return (
        Panel("Views against the truth", "elevation, deg", "SSIM", pairs),
        Panel("Prototype less shell", "elevation, deg", "difference of SSIM", (apart,)),
    )
