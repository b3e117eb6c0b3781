"""The merge of photographs that are simulated: what a stop's photograph shows is traced."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from tbcad.simulate.capture.photograph import RowBand, Samples, sample_shifts, to_bytes
from tbcad.simulate.prototype.ball_rays import reflected_colours, resampled_photograph
from tbcad.simulate.prototype.merge import (
    MergePlan,
    merge_photographs,
    merge_plan,
    merged_bands,
    merged_pixels,
)
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene, object_in_front
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

Resample = Literal["photograph", "exact"]


@dataclass(frozen=True)
class SimulatedPhotographs:
    """What the photographs of a run's stops show of a scene.

    Attributes:
        run: the run.
        scene: the object.
        samples: a pixel is the mean of these rays.
    """

    run: PrototypeRun
    scene: Scene
    samples: Samples = 1

    def colours(self, stop: int, places: Floats) -> Bytes:
        """Colours (n, 3) of a stop's photograph at columns and rows (n, 2)."""
        return resampled_photograph(self.run, self.scene, stop, self.samples, places)

    def in_front(self, mirror: Ints, direction: Floats, distance: Floats) -> Bools:
        """Where (n,) the object is before what camera rays meet at distances (n,), mm."""
        del mirror
        return object_in_front(self.scene, self.run.camera.pinhole, direction, distance)[0]


def merge_run(
    run: PrototypeRun,
    scene: Scene,
    resample: Resample = "photograph",
    samples: Samples = 1,
    progress: Progress = lambda _: None,
) -> Iterator[RowBand]:
    """Bands of the merged picture from top to bottom.

    Args:
        run: for camera a's mirrors or camera b's.
        scene: the object.
        resample: "photograph": between the four nearest pixels of the stop's photograph, as with
            a real prototype; "exact": traced along the rotated direction itself.
        samples: a pixel, of the photograph or of the picture, is the mean of these rays.
        progress: called with each step.
    """
    photographs = SimulatedPhotographs(run, scene, samples)
    plan = merge_plan(run, scene.radius, photographs.in_front)
    if resample == "photograph":
        yield from merge_photographs(plan, photographs, progress)
    else:
        yield from merged_bands(plan, partial(_traced, plan, photographs), progress)


def _traced(plan: MergePlan, photographs: SimulatedPhotographs, rows: range, _: Bools) -> Bytes:
    """Colours (n, 3) along the rotated directions themselves."""
    pinhole, scene = plan.run.camera.pinhole, photographs.scene
    total = np.zeros((len(rows) * plan.run.reflector.camera.width_px, 3), dtype=np.float32)
    shifts = sample_shifts(photographs.samples)
    for shift in shifts:
        _mirror, hits, front, direction = merged_pixels(plan, rows, shift)
        direct = object_in_front(scene, pinhole, direction, hits.distance)[1]
        total += np.where(front[:, None], direct, reflected_colours(scene, hits))
    return to_bytes(total / np.float32(len(shifts)))
